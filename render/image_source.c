#include "render/image_source.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "render/file.h"

static bool has_ending(const char *path, const char *const *endings) {
    const char *ending = file_ending(path);
    for (int i = 0; endings[i]; i++) {
        if (strcasecmp(ending, endings[i]) == 0) {
            return true;
        }
    }
    return false;
}

bool image_is_picture(const char *path) {
    static const char *const endings[] = {"png", "jpg",  "jpeg", "exr", "tif", "tiff",
                                          "bmp", "webp", "ppm",  "pgm", "tga", NULL};
    return has_ending(path, endings);
}

bool image_is_video(const char *path) {
    static const char *const endings[] = {"mp4", "mov",  "webm", "mkv", "avi",
                                          "gif", "apng", "y4m",  "m4v", NULL};
    return has_ending(path, endings);
}

static int compare_names(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* True, with the number in *order, when `name` matches a pattern with one %Nd. */
static bool match_number(const char *pattern, const char *name, long *order) {
    const char *percent = strchr(pattern, '%'), *tail = strchr(percent, 'd');
    size_t before = (size_t)(percent - pattern);
    if (!tail || strncmp(pattern, name, before) != 0 ||
        !(name[before] >= '0' && name[before] <= '9')) {
        return false;
    }
    char *end;
    *order = strtol(name + before, &end, 10);
    return strcmp(end, tail + 1) == 0;
}

typedef struct Found {
    char *path;
    long order;
} Found;

static int compare_order(const void *a, const void *b) {
    const Found *p = a, *q = b;
    return p->order != q->order ? (p->order < q->order ? -1 : 1) : strcmp(p->path, q->path);
}

/* Files of a folder: those that match `pattern`, or all pictures when it is NULL. */
static bool list_files(ImageSource *source, const char *folder, const char *pattern, Error *error) {
    DIR *open = opendir(folder);
    if (!open) {
        return error_set_errno(error, errno == ENOENT ? EXIT_MISSING_INPUT : EXIT_IO, "%s", folder);
    }
    Found *found = NULL;
    int room = 0;
    for (struct dirent *entry; (entry = readdir(open)) != NULL;) {
        long order = 0;
        if (pattern ? !match_number(pattern, entry->d_name, &order)
                    : !image_is_picture(entry->d_name)) {
            continue;
        }
        if (source->file_count == room) {
            int more = room ? 2 * room : 64;
            found = arena_grow(&source->arena, Found, found, room, more);
            room = more;
        }
        char path[FILE_PATH_SIZE];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        found[source->file_count++] = (Found){arena_strdup(&source->arena, path), order};
    }
    closedir(open);
    if (source->file_count == 0) {
        return error_set(error, EXIT_MISSING_INPUT, "%s: there are no pictures%s%s", folder,
                         pattern ? " like " : "", pattern ? pattern : "");
    }
    qsort(found, (size_t)source->file_count, sizeof *found, compare_order);
    source->files = arena_push(&source->arena, char *, source->file_count);
    for (int i = 0; i < source->file_count; i++) {
        source->files[i] = found[i].path;
    }
    if (!pattern) {
        qsort(source->files, (size_t)source->file_count, sizeof *source->files, compare_names);
    }
    return true;
}

static bool open_pattern(ImageSource *source, const char *path, Error *error) {
    char folder[FILE_PATH_SIZE];
    const char *slash = strrchr(path, '/'), *percent = strchr(path, '%');
    if ((slash && percent < slash) || strchr(percent + 1, '%')) {
        return error_set(error, EXIT_USAGE, "%s: expected one %%04d, in the file's name", path);
    }
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) : 1, slash ? path : ".");
    return list_files(source, folder[0] ? folder : "/", slash ? slash + 1 : path, error);
}

bool image_source_open(ImageSource *source, const char *path, Error *error) {
    struct stat status;
    *source = (ImageSource){.orientation = 1};
    bool there = stat(path, &status) == 0, good;
    if (!there && strchr(path, '%')) {
        good = open_pattern(source, path, error);
    } else if (!there) {
        good = error_set_errno(error, errno == ENOENT ? EXIT_MISSING_INPUT : EXIT_IO, "%s", path);
    } else if (S_ISDIR(status.st_mode)) {
        good = list_files(source, path, NULL, error);
    } else if (image_is_picture(path)) {
        source->files = arena_push(&source->arena, char *, 1);
        source->files[source->file_count++] = arena_strdup(&source->arena, path);
        good = true;
    } else {
        source->video = video_open(path, error);
        good = source->video != NULL;
    }
    if (!good) {
        image_source_close(source);
    }
    return good;
}

const char *image_source_file(const ImageSource *source) {
    return source->video || source->next == 0 ? NULL : source->files[source->next - 1];
}

VideoNext image_source_next(ImageSource *source, Image *image, Error *error) {
    if (source->video) {
        VideoNext next = video_next(source->video, image, error);
        source->orientation = video_orientation(source->video);
        return next;
    }
    if (source->next == source->file_count) {
        return VIDEO_END;
    }
    const char *path = source->files[source->next++];
    if (strcasecmp(file_ending(path), "png") == 0) {
        return image_read_png(path, image, error) ? VIDEO_PICTURE : VIDEO_WRONG;
    }
    VideoReader *reader = video_open(path, error);
    VideoNext next = reader ? video_next(reader, image, error) : VIDEO_WRONG;
    source->orientation = reader ? video_orientation(reader) : 1;
    video_reader_close(reader);
    if (next == VIDEO_END) {
        error_set(error, EXIT_BAD_INPUT, "%s: there is no picture in it", path);
        next = VIDEO_WRONG;
    }
    return next;
}

void image_source_close(ImageSource *source) {
    video_reader_close(source->video);
    arena_free(&source->arena);
    *source = (ImageSource){0};
}

void image_orient(Image *image, int orientation) {
    if (orientation <= 1) {
        return;
    }
    int w = image->width, h = image->height;
    bool turned = orientation >= 5;
    Image out = turned ? image_create(h, w) : image_create(w, h);
    for (int y = 0; y < out.height; y++) {
        for (int x = 0; x < out.width; x++) {
            /* where the pixel comes from, by the table of the EXIF standard */
            int fx = turned ? y : x, fy = turned ? x : y;
            bool flip_x =
                orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
            bool flip_y =
                orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
            fx = flip_x ? w - 1 - fx : fx;
            fy = flip_y ? h - 1 - fy : fy;
            memcpy(out.rgba + IMAGE_CHANNELS * ((size_t)y * out.width + x),
                   image->rgba + IMAGE_CHANNELS * ((size_t)fy * w + fx), IMAGE_CHANNELS);
        }
    }
    image_free(image);
    *image = out;
}

bool image_read(const char *path, Image *image, Error *error) {
    ImageSource source;
    *image = (Image){0};
    if (!image_source_open(&source, path, error)) {
        return false;
    }
    VideoNext next = image_source_next(&source, image, error);
    if (next == VIDEO_PICTURE) {
        image_orient(image, source.orientation);
    }
    image_source_close(&source);
    return next == VIDEO_PICTURE ||
           error_set(error, EXIT_BAD_INPUT, "%s: there is no picture in it", path);
}
