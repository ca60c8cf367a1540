#include "tests/support/folder.h"

#include <stdio.h>
#include <stdlib.h>

#define PATHS 4

static char folder[64];

bool folder_make(const char *name) {
    snprintf(folder, sizeof folder, "/tmp/toile-%s-XXXXXX", name);
    return mkdtemp(folder) != NULL;
}

const char *folder_path(const char *file) {
    static char paths[PATHS][192];
    static int next = 0;
    char *path = paths[next++ % PATHS];
    snprintf(path, sizeof paths[0], "%s/%s", folder, file);
    return path;
}

int folder_remove(void) {
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}
