/* file.h: files that appear whole or not at all: written as NAME.part, flushed, then renamed. */
#ifndef TOILE_RENDER_FILE_H
#define TOILE_RENDER_FILE_H

#include <stdbool.h>
#include <stdio.h>

#include "sim/base/error.h"

#define FILE_PATH_SIZE 4096
#define FILE_PART_SIZE (FILE_PATH_SIZE + 8)

typedef struct PartFile {
    FILE *out; /* NULL when nothing is open */
    char path[FILE_PATH_SIZE], part[FILE_PART_SIZE];
} PartFile;

/* Starts PATH.part. Errors: EXIT_IO. */
bool file_start(PartFile *file, const char *path, Error *error);
/* Flushes, closes and gives it its name. On failure nothing stays behind. Errors: EXIT_IO. */
bool file_finish(PartFile *file, Error *error);
/* Removes what is not whole; safe on a zeroed or finished file. */
void file_abandon(PartFile *file);

/* Gives a part that others have written and closed its name, once it is on the disk. */
bool file_commit(const char *part, const char *path, Error *error);

/* Creates the folders that `path` needs, up to its last slash. */
bool file_create_folders(const char *path, Error *error);

/* "" or a copy of what stands after the last dot of the last name. */
const char *file_ending(const char *path);

#endif
