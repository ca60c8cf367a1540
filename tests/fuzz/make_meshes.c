/* Writes the files of tests/support/meshes.c into a folder: a corpus. make_meshes FOLDER */
#include <stdio.h>

#include "tests/support/meshes.h"

int main(int argc, char **argv) {
    for (int i = 0; argc > 1 && i < TEST_MESH_COUNT; i++) {
        const TestMesh *mesh = &test_meshes()[i];
        char path[4200];
        snprintf(path, sizeof path, "%s/tet%d.%s", argv[1], i, mesh->name);
        FILE *file = fopen(path, "wb");
        if (!file || fwrite(mesh->bytes, 1, mesh->size, file) != mesh->size || fclose(file) != 0) {
            return 1;
        }
    }
    return 0;
}
