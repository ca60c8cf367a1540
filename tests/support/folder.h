/* folder.h: a folder of its own for a test program. */
#ifndef TOILE_TESTS_FOLDER_H
#define TOILE_TESTS_FOLDER_H

#include <stdbool.h>

/* Makes it, /tmp/toile-NAME-XXXXXX. */
bool folder_make(const char *name);

/* The path of a file in it; holds until the fourth call after this one. */
const char *folder_path(const char *file);

/* Takes it away with all that is in it; 0 when that went well. */
int folder_remove(void);

#endif
