#include "render/output.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/file.h"
#include "sim/base/memory.h"

#define QUEUE_FRAMES 3 /* pictures between drawing and encoding */
#define SEQUENCE_NAME "%04d.png"
#define KEY_TEXT "toile:key"
#define PART_SIZE (OUTPUT_PATH_SIZE + 8)

typedef struct Entry {
    Image image;
    int frame;
    uint64_t key;
} Entry;

struct Output {
    OutputDef def;
    char part[PART_SIZE]; /* of a video */
    Video *video;
    Error error; /* the first one, of the encoder's thread too */
    /* the queue to that thread */
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    Entry entries[QUEUE_FRAMES];
    int first, count;
    bool ending;
};

/* ---- names ---- */

static bool has_ending(const char *path, const char *ending) {
    size_t length = strlen(path), n = strlen(ending);
    return length > n && strcmp(path + length - n, ending) == 0;
}

/* True if the only % of path begins a %d, %4d or %04d. */
static bool is_pattern(const char *path) {
    const char *percent = strchr(path, '%');
    if (!percent || strchr(percent + 1, '%')) {
        return false;
    }
    const char *end = percent + 1 + strspn(percent + 1, "0123456789");
    return *end == 'd' && end - percent <= 4;
}

static void name_frame(const OutputDef *def, int frame, char name[OUTPUT_PATH_SIZE]) {
    const char *percent = def->kind == OUTPUT_SEQUENCE ? strchr(def->path, '%') : NULL;
    if (!percent) {
        snprintf(name, OUTPUT_PATH_SIZE, "%s", def->path);
        return;
    }
    int width = atoi(percent + 1);
    snprintf(name, OUTPUT_PATH_SIZE, "%.*s%0*d%s", (int)(percent - def->path), def->path, width,
             frame, strchr(percent, 'd') + 1);
}

bool output_plan(const char *path, OutputDef *def, Error *error) {
    struct stat status;
    const char *slash = strrchr(path, '/'), *last = slash ? slash + 1 : path;
    bool folder = stat(path, &status) == 0 && S_ISDIR(status.st_mode);
    if (strlen(path) + sizeof SEQUENCE_NAME + 1 > sizeof def->path) {
        return error_set(error, EXIT_USAGE, "-o: the path is too long");
    }
    snprintf(def->path, sizeof def->path, "%s", path);
    if (folder || *last == '\0' || !strchr(last, '.')) {
        def->kind = OUTPUT_SEQUENCE;
        snprintf(def->path + strlen(path), sizeof def->path - strlen(path), "%s%s",
                 *last == '\0' ? "" : "/", SEQUENCE_NAME);
        return strchr(path, '%') == NULL || error_set(error, EXIT_USAGE, "-o %s: no .png", path);
    }
    if (video_format_of(path)) {
        def->kind = OUTPUT_VIDEO;
        return true;
    }
    def->exr = has_ending(path, ".exr");
    if (!def->exr && !has_ending(path, ".png")) {
        char endings[256] = "";
        for (int i = 0; i < video_format_count; i++) {
            size_t used = strlen(endings);
            snprintf(endings + used, sizeof endings - used, ".%s, ", video_formats[i].ending);
        }
        return error_set(error, EXIT_USAGE, "-o %s: expected an ending %s.exr or .png, or a folder",
                         path, endings);
    }
    def->kind = strchr(path, '%') ? OUTPUT_SEQUENCE : OUTPUT_PICTURE;
    return def->kind == OUTPUT_PICTURE || is_pattern(path) ||
           error_set(error, EXIT_USAGE, "-o %s: expected one %%04d for the frame number", path);
}

static void write_key(uint64_t key, char text[OUTPUT_KEY_SIZE]) {
    snprintf(text, OUTPUT_KEY_SIZE, "toile %016llx", (unsigned long long)key);
}

OutputState output_look(const OutputDef *def, int frame, uint64_t key) {
    char name[OUTPUT_PATH_SIZE], wanted[OUTPUT_KEY_SIZE], found[OUTPUT_KEY_SIZE] = "";
    struct stat status;
    name_frame(def, frame, name);
    if (stat(name, &status) != 0) {
        return OUTPUT_ABSENT;
    }
    write_key(key, wanted);
    if (def->kind == OUTPUT_VIDEO) {
        video_read_comment(name, found, sizeof found);
    } else if (def->exr) {
        exr_read_text(name, KEY_TEXT, found, sizeof found);
    } else {
        image_read_png_text(name, KEY_TEXT, found, sizeof found);
    }
    if (strcmp(found, wanted) == 0) {
        return OUTPUT_VALID;
    }
    return strncmp(found, "toile", 5) == 0 ? OUTPUT_STALE : OUTPUT_FOREIGN;
}

bool output_may_write(const OutputDef *def, int frame, Error *error) {
    char name[OUTPUT_PATH_SIZE];
    name_frame(def, frame, name);
    struct stat status;
    if (stat(name, &status) == 0 && !S_ISREG(status.st_mode)) {
        return true; /* a device or a pipe is written to as it is */
    }
    return def->force || output_look(def, frame, 0) != OUTPUT_FOREIGN ||
           error_set(error, EXIT_IO, "%s was not written by toile; --force overwrites it", name);
}

/* ---- writing ---- */

/* Writes one picture file, a PNG or (exr not NULL) an EXR, and gives it its name when it is whole. */
static bool write_file(const Output *output, int number, uint64_t hash, const Image *image,
                       const ExrPicture *exr, Error *error) {
    char name[OUTPUT_PATH_SIZE], part[PART_SIZE], key[OUTPUT_KEY_SIZE], frame[16];
    name_frame(&output->def, number, name);
    snprintf(part, sizeof part, "%s.part", name);
    write_key(hash, key);
    snprintf(frame, sizeof frame, "%d", number);
    ImageText texts[] = {{"Software", "toile"}, {KEY_TEXT, key}, {"toile:frame", frame}};
    if ((exr ? exr_write(part, exr, texts, 3, error)
             : image_write_png(part, image, texts, 3, error)) &&
        file_commit(part, name, error)) {
        return true;
    }
    unlink(part);
    return false;
}

static bool write_entry(Output *output, const Entry *entry, Error *error) {
    return output->def.kind == OUTPUT_VIDEO
               ? video_write(output->video, &entry->image, error)
               : write_file(output, entry->frame, entry->key, &entry->image, NULL, error);
}

/* The first failure is kept for the thread that draws; needs the lock. */
static void keep_error(Output *output, const Error *error) {
    if (error->code != EXIT_OK) {
        error_set(&output->error, error->code, "%s", error->text);
    }
}

static void *encoder_main(void *context) {
    Output *output = context;
    pthread_mutex_lock(&output->lock);
    while (output->count > 0 || !output->ending) {
        if (output->count == 0) {
            pthread_cond_wait(&output->changed, &output->lock);
            continue;
        }
        const Entry *entry = &output->entries[output->first];
        bool skip = output->error.code != EXIT_OK;
        Error failed = {0};
        pthread_mutex_unlock(&output->lock);
        if (!skip) {
            write_entry(output, entry, &failed);
        }
        pthread_mutex_lock(&output->lock);
        keep_error(output, &failed);
        output->first = (output->first + 1) % QUEUE_FRAMES;
        output->count--;
        pthread_cond_broadcast(&output->changed);
    }
    pthread_mutex_unlock(&output->lock);
    return NULL;
}

Output *output_create(const OutputDef *def, Error *error) {
    if (def->kind == OUTPUT_SEQUENCE && !file_create_folders(def->path, error)) {
        return NULL;
    }
    Output *output = memory_zeroed(1, sizeof *output);
    output->def = *def;
    if (def->kind == OUTPUT_VIDEO) {
        snprintf(output->part, sizeof output->part, "%s.part", def->path);
        output->video = video_create(output->part, video_format_of(def->path), def->width,
                                     def->height, def->rate, def->clear, error);
        if (!output->video) {
            unlink(output->part);
            free(output);
            return NULL;
        }
    }
    for (int i = 0; i < QUEUE_FRAMES; i++) {
        output->entries[i].image = image_create(def->width, def->height);
    }
    pthread_mutex_init(&output->lock, NULL);
    pthread_cond_init(&output->changed, NULL);
    if (def->background && pthread_create(&output->thread, NULL, encoder_main, output) != 0) {
        output->def.background = false; /* then this thread encodes */
    }
    return output;
}

static void set_entry(Entry *entry, int frame, const Image *image, uint64_t key) {
    ASSERT(image->width == entry->image.width && image->height == entry->image.height);
    entry->frame = frame;
    entry->key = key;
    entry->image.clear = image->clear;
    memcpy(entry->image.rgba, image->rgba,
           (size_t)image->width * (size_t)image->height * IMAGE_CHANNELS);
}

bool output_write(Output *output, int frame, const Image *image, uint64_t key, Error *error) {
    pthread_mutex_lock(&output->lock);
    while (output->count == QUEUE_FRAMES) {
        pthread_cond_wait(&output->changed, &output->lock);
    }
    Entry *entry = &output->entries[(output->first + output->count) % QUEUE_FRAMES];
    set_entry(entry, frame, image, key);
    if (output->def.background) {
        output->count++;
        pthread_cond_broadcast(&output->changed);
    } else {
        Error now = {0};
        write_entry(output, entry, &now);
        keep_error(output, &now);
    }
    Error failed = output->error;
    pthread_mutex_unlock(&output->lock);
    return failed.code == EXIT_OK || error_set(error, failed.code, "%s", failed.text);
}

bool output_write_exr(Output *output, int frame, const ExrPicture *picture, uint64_t key,
                      Error *error) {
    Image none = {0};
    return write_file(output, frame, key, &none, picture, error);
}

static void stop_encoder(Output *output) {
    if (output->def.background) {
        pthread_mutex_lock(&output->lock);
        output->ending = true;
        pthread_cond_broadcast(&output->changed);
        pthread_mutex_unlock(&output->lock);
        pthread_join(output->thread, NULL);
    }
}

static void output_free(Output *output) {
    for (int i = 0; i < QUEUE_FRAMES; i++) {
        image_free(&output->entries[i].image);
    }
    pthread_mutex_destroy(&output->lock);
    pthread_cond_destroy(&output->changed);
    free(output);
}

bool output_close(Output *output, uint64_t key, Error *error) {
    stop_encoder(output);
    Error *first = &output->error;
    if (output->def.kind == OUTPUT_VIDEO && first->code == EXIT_OK) {
        char text[OUTPUT_KEY_SIZE];
        write_key(key, text);
        if (video_close(output->video, text, first)) {
            file_commit(output->part, output->def.path, first);
        }
        output->video = NULL;
    }
    bool good = first->code == EXIT_OK || error_set(error, first->code, "%s", first->text);
    if (!good) {
        video_abandon(output->video);
        unlink(output->part);
    }
    output_free(output);
    return good;
}

void output_abandon(Output *output) {
    if (output) {
        pthread_mutex_lock(&output->lock); /* what waits in the queue is dropped */
        error_set(&output->error, EXIT_INTERRUPTED, "interrupted");
        pthread_mutex_unlock(&output->lock);
        stop_encoder(output);
        video_abandon(output->video);
        if (output->def.kind == OUTPUT_VIDEO) {
            unlink(output->part);
        }
        output_free(output);
    }
}

bool output_write_picture(const OutputDef *target, const Image *image, Error *error) {
    OutputDef def = *target;
    def.width = image->width;
    def.height = image->height;
    Output *output = output_create(&def, error);
    if (!output) {
        return false;
    }
    if (!output_write(output, 0, image, 0, error)) {
        output_abandon(output);
        return false;
    }
    return output_close(output, 0, error);
}
