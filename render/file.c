#include "render/file.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool file_start(PartFile *file, const char *path, Error *error) {
    *file = (PartFile){0};
    if (strlen(path) >= sizeof file->path) {
        return error_set(error, EXIT_USAGE, "the path is too long: %.60s...", path);
    }
    snprintf(file->path, sizeof file->path, "%s", path);
    snprintf(file->part, sizeof file->part, "%s.part", path);
    file->out = fopen(file->part, "wb");
    return file->out || error_set_errno(error, EXIT_IO, "%s", path);
}

bool file_finish(PartFile *file, Error *error) {
    bool good = fflush(file->out) == 0 && !ferror(file->out) && fsync(fileno(file->out)) == 0;
    int why = errno;
    bool closed = fclose(file->out) == 0;
    file->out = NULL;
    errno = good ? errno : why;
    if (!good || !closed || rename(file->part, file->path) != 0) {
        error_set_errno(error, EXIT_IO, "%s could not be written", file->path);
        unlink(file->part);
        return false;
    }
    return true;
}

void file_abandon(PartFile *file) {
    if (file->out) {
        fclose(file->out);
        unlink(file->part);
        file->out = NULL;
    }
}

bool file_commit(const char *part, const char *path, Error *error) {
    FILE *file = fopen(part, "rb");
    bool flushed = file && fsync(fileno(file)) == 0;
    if (file) {
        fclose(file);
    }
    return (flushed && rename(part, path) == 0) ||
           error_set_errno(error, EXIT_IO, "%s could not be written", path);
}

bool file_create_folders(const char *path, Error *error) {
    char folder[FILE_PATH_SIZE];
    if (strlen(path) >= sizeof folder) {
        return error_set(error, EXIT_USAGE, "the path is too long: %.60s...", path);
    }
    for (const char *slash = *path ? strchr(path + 1, '/') : NULL; slash;
         slash = strchr(slash + 1, '/')) {
        snprintf(folder, sizeof folder, "%.*s", (int)(slash - path), path);
        if (mkdir(folder, 0777) != 0 && errno != EEXIST) {
            return error_set_errno(error, EXIT_IO, "%s", folder);
        }
    }
    return true;
}

const char *file_ending(const char *path) {
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    return dot && dot > name ? dot + 1 : "";
}
