/* Pictures from files: what stands behind the scene, and what is printed on cloths. */
#include <stdlib.h>
#include <string.h>

#include "render/draw_parts.h"
#include "render/image_source.h"
#include "sim/base/hash.h"
#include "sim/base/text.h"

#define MOST_PRINT_PIXELS 4096 /* along a side: larger pictures are made smaller */

/* #rrggbb everywhere; false: no such colour. */
static bool fill_with(const char *text, Image *image) {
    char *end;
    unsigned long code = strtoul(text + 1, &end, 16);
    if (strlen(text) != 7 || *end) {
        return false;
    }
    for (size_t i = 0; i < (size_t)image->width * (size_t)image->height; i++) {
        uint8_t *p = image->rgba + IMAGE_CHANNELS * i;
        p[0] = (uint8_t)(code >> 16), p[1] = (uint8_t)(code >> 8), p[2] = (uint8_t)code, p[3] = 255;
    }
    return true;
}

/* The middle of a picture, as large as fills the film's. */
static void fit_into(const Image *from, Image *image) {
    double scale = (double)image->width / from->width, high = (double)image->height / from->height;
    scale = high > scale ? high : scale;
    int width = (int)(scale * from->width + 0.5), height = (int)(scale * from->height + 0.5);
    width = width < image->width ? image->width : width;
    height = height < image->height ? image->height : height;
    Image large = video_resize(from, width, height);
    int left = (width - image->width) / 2, top = (height - image->height) / 2;
    for (int y = 0; y < image->height; y++) {
        memcpy(image->rgba + IMAGE_CHANNELS * (size_t)y * (size_t)image->width,
               large.rgba + IMAGE_CHANNELS * ((size_t)(y + top) * (size_t)width + (size_t)left),
               IMAGE_CHANNELS * (size_t)image->width);
    }
    image_free(&large);
}

bool draw_read_plate(Drawer *drawer, Error *error) {
    const char *given = drawer->def.backdrop;
    const char *path = given ? given : drawer->film.backdrop.path;
    Image from = {0};
    if (!path[0] || (!given && drawer->def.clear)) { /* without a backdrop there is no scene's */
        return true;
    }
    if (drawer->def.clear) {
        return error_set(error, EXIT_USAGE, "--backdrop and --alpha exclude each other");
    }
    drawer->plate = image_create(drawer->def.width, drawer->def.height);
    if (path[0] == '#') {
        return fill_with(path, &drawer->plate) ||
               error_set(error, EXIT_USAGE, "--backdrop %s: expected #rrggbb or a picture", path);
    }
    bool good = image_read(path, &from, error);
    if (good) {
        fit_into(&from, &drawer->plate);
    }
    image_free(&from);
    return good;
}

/* [CLOTH=]FILE[@WIDTH] */
typedef struct PrintText {
    char cloth[STATE_WORD_SIZE]; /* "": all */
    char path[RUN_PATH_SIZE];
    double width; /* [m]; 0: not given */
} PrintText;

static bool split(const char *text, PrintText *print) {
    const char *equals = strchr(text, '='), *at = strrchr(text, '@');
    const char *path = equals ? equals + 1 : text;
    size_t name = equals ? (size_t)(equals - text) : 0;
    char *end = NULL;
    *print = (PrintText){0};
    if (at && at > path) {
        print->width = strtod(at + 1, &end);
        at = end != at + 1 && (!*end || strcmp(end, "m") == 0) ? at : NULL;
    }
    size_t length = at ? (size_t)(at - path) : strlen(path);
    if (name >= sizeof print->cloth || length == 0 || length >= sizeof print->path ||
        (at && !(print->width > 0.0 && print->width < 1e3))) {
        return false;
    }
    memcpy(print->cloth, text, name);
    memcpy(print->path, path, length);
    print->width = at ? print->width : 0.0;
    return true;
}

/* Reads a picture as the next of print_images. */
static bool take_print(Drawer *drawer, const char *path, Error *error) {
    Image *owned = &drawer->print_images[drawer->print_count];
    if (!image_read(path, owned, error)) {
        return false;
    }
    drawer->print_count++;
    int longest = owned->width > owned->height ? owned->width : owned->height;
    if (longest > MOST_PRINT_PIXELS) {
        double scale = (double)MOST_PRINT_PIXELS / longest;
        int width = (int)(scale * owned->width), height = (int)(scale * owned->height);
        Image small = video_resize(owned, width < 1 ? 1 : width, height < 1 ? 1 : height);
        image_free(owned);
        *owned = small;
    }
    return true;
}

/* Into every cloth that it is for, of which the first owns the picture. */
static bool read_print(Drawer *drawer, const char *text, Error *error) {
    const StateHeader *header = state_header(drawer->run->reader);
    PrintText wanted;
    const char *names[65] = {0};
    Image *owned = &drawer->print_images[drawer->print_count];
    if (!split(text, &wanted)) {
        return error_set(error, EXIT_USAGE, "--print %s: expected [CLOTH=]FILE[@WIDTH] in metres",
                         text);
    }
    bool known = false;
    for (int i = 0; i < header->cloth_count; i++) {
        bool its = !wanted.cloth[0] || strcmp(header->cloths[i].name, wanted.cloth) == 0;
        names[i < 64 ? i : 64] = i < 64 ? header->cloths[i].name : NULL;
        drawer->prints[i] = its ? (Print){owned, wanted.width} : drawer->prints[i];
        known = known || its;
    }
    if (!known) {
        const char *near = text_nearest(wanted.cloth, names);
        return error_set(error, EXIT_USAGE, "--print: no cloth is called '%s'%s%s%s", wanted.cloth,
                         near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
    }
    return take_print(drawer, wanted.path, error);
}

/* Prints of the scene; those of the command line come after them. */
static bool read_scene_print(Drawer *drawer, int cloth, Error *error) {
    const FilmPicture *print = &state_header(drawer->run->reader)->cloths[cloth].print;
    if (!print->path[0]) {
        return true;
    }
    drawer->prints[cloth] = (Print){&drawer->print_images[drawer->print_count], print->width};
    return take_print(drawer, print->path, error);
}

bool draw_read_prints(Drawer *drawer, Error *error) {
    bool good = true;
    int count = drawer->def.print_count, cloths = state_header(drawer->run->reader)->cloth_count;
    drawer->prints = arena_push(&drawer->arena, Print, cloths);
    drawer->print_images = arena_push(&drawer->arena, Image, count + cloths);
    for (int i = 0; i < cloths && good; i++) {
        good = read_scene_print(drawer, i, error);
    }
    for (int i = 0; i < count && good; i++) {
        good = read_print(drawer, drawer->def.prints[i], error);
    }
    return good;
}
static uint64_t hash_image(const Image *image) {
    return hash_bytes(image->rgba, IMAGE_CHANNELS * (size_t)image->width * (size_t)image->height);
}

uint64_t draw_hash_pictures(const Drawer *drawer) {
    uint64_t seen = drawer->plate.rgba ? hash_image(&drawer->plate) : 0;
    int cloths = state_header(drawer->run->reader)->cloth_count;
    for (int i = 0; i < cloths; i++) {
        const Print *print = &drawer->prints[i];
        uint64_t width = hash_bytes(&print->width, sizeof print->width);
        uint64_t both[3] = {seen, print->image ? hash_image(print->image) : 0, width};
        seen = hash_bytes(both, sizeof both);
    }
    return seen;
}

void draw_free_pictures(Drawer *drawer) {
    image_free(&drawer->plate);
    for (int i = 0; i < drawer->print_count; i++) {
        image_free(&drawer->print_images[i]);
    }
}
