/* mesh_import.c: the only file that knows assimp. */
#include "sim/scene/mesh_import.h"

#include <assimp/version.h>
#include <stdio.h>

const char *mesh_import_version(void) {
    static char text[32];
    snprintf(text, sizeof text, "assimp %u.%u.%u", aiGetVersionMajor(), aiGetVersionMinor(),
             aiGetVersionPatch());
    return text;
}
