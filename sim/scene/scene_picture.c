/* Pictures that a scene names: behind it, and printed on cloth. Only the renderer opens them; here they
 * must be files that can be read. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sim/scene/scene_schema.h"

#define WIDEST 1e3 /* [m] a repeat */

typedef struct PictureKeys {
    const char *file;
    double width; /* [m] */
} PictureKeys;

static void picture_keys_default(void *object) { *(PictureKeys *)object = (PictureKeys){0}; }

static const Field picture_fields[] = {
    {"file", FIELD_TEXT, offsetof(PictureKeys, file), .required = true,
     .help = "a picture, beside the scene"},
    {"width", FIELD_NUMBER, offsetof(PictureKeys, width), .unit = "m", .min = 1e-4, .max = WIDEST,
     .word = "auto", .word_value = 0.0, .help = "of a repeat; auto: the panel's"},
    {0}};
const Schema print_schema = {.name = "print",
                             .help = "a picture printed on cloth",
                             .fields = picture_fields,
                             .size = sizeof(PictureKeys),
                             .set_default = picture_keys_default,
                             .shorthand = 1};

static bool find_file(Reader *reader, const Yaml *value, const char *key, const char *file,
                      FilmPicture *picture) {
    Sources sources = scene_context(reader)->sources;
    const char *path = source_resolve(&sources, value->place.source, file);
    char *absolute = realpath(path, NULL);
    struct stat status;
    const char *quote = report_quote_long(reader->report, file);
    bool ok = true;
    if (!absolute || stat(absolute, &status) != 0 || access(absolute, R_OK) != 0) {
        ok = report_error(reader->report, value->place,
                          errno == ENOENT ? EXIT_MISSING_INPUT : EXIT_IO, "'%s' %s: %s", key, quote,
                          strerror(errno));
    } else if (!S_ISREG(status.st_mode) || strchr(absolute, '\n')) {
        ok = schema_error(reader, value, "'%s' %s is no picture file", key, quote);
    } else if (strlen(absolute) >= FILM_PATH_SIZE || strlen(file) >= FILM_PATH_SIZE) {
        ok = schema_error(reader, value, "'%s' %s: the path is too long", key, quote);
    } else {
        strcpy(picture->name, file);
        strcpy(picture->path, absolute);
    }
    free(absolute);
    return ok;
}

bool backdrop_read(Reader *reader, const Yaml *value, const char *text, Film *film) {
    if (text[0] != '#') {
        return find_file(reader, value, "backdrop", text, &film->backdrop);
    }
    if (strlen(text) != 7 || strspn(text + 1, "0123456789abcdefABCDEF") != 6) {
        return schema_error(reader, value, "'backdrop' is %s; a colour has six digits, \"#1a2b3c\"",
                            report_quote(reader->report, text));
    }
    strcpy(film->backdrop.name, text);
    strcpy(film->backdrop.path, text);
    return true;
}

bool print_read(Reader *reader, const Field *field, const Yaml *value, void *member) {
    FilmPicture *picture = member;
    PictureKeys keys = {0};
    if (!schema_read(reader, &print_schema, value, &keys)) {
        return false;
    }
    picture->width = keys.width;
    return find_file(reader, value, field->key, keys.file, picture);
}

void print_print(FILE *out, int indent, const Field *field, const void *member) {
    const FilmPicture *picture = member;
    if (!picture->name[0]) {
        return;
    }
    fprintf(out, "%*s%s: {file: ", indent, "", field->key);
    schema_print_text(out, picture->name);
    if (picture->width > 0.0) {
        fputs(", width: ", out);
        schema_print_quantity(out, picture->width, "m");
    }
    fputs("}\n", out);
}
