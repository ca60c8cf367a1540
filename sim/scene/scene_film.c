#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define FILM_SECONDS 4.0 /* [s] default length */
#define FILM_MOST_FRAMES 1e6

typedef struct FilmKeys {
    Film film;
    double seconds; /* [s] */
    const char *look;
    const char *title;
    const char *backdrop;
    const Yaml *camera, *cameras, *floor;
} FilmKeys;

static void film_keys_default(void *object) {
    *(FilmKeys *)object =
        (FilmKeys){.film = film_default(), .seconds = FILM_SECONDS, .look = "teal-twill"};
    FilmKeys *keys = object;
    keys->film.range[0] = keys->film.range[1] = NAN;
}

static const char *const surface_words[] = {"mesh", "splats", NULL};

static const Field film_fields[] = {
    {"rate", FIELD_NUMBER, offsetof(FilmKeys, film.rate), .unit = "1/s", .min = 0.01, .max = 1e5,
     .help = "frames a second"},
    {"seconds", FIELD_NUMBER, offsetof(FilmKeys, seconds), .unit = "s", .min = 0.0, .max = 1e6,
     .help = "length of the film"},
    {"size", FIELD_GRID, offsetof(FilmKeys, film.width), .min = 16, .max = 16384,
     .help = "pixels, both even"},
    {"camera", FIELD_RAW, offsetof(FilmKeys, camera), .group = &camera_schema,
     .help = "auto, or a mapping"},
    {"look", FIELD_NAME, offsetof(FilmKeys, look), .min = 2, .help = "of cloths that do not say"},
    {"cameras", FIELD_RAW, offsetof(FilmKeys, cameras), .group = &camera_schema,
     .help = "more cameras of the same scene: name and mapping; chosen by render --camera NAME"},
    {"surface", FIELD_WORD, offsetof(FilmKeys, film.surface), .words = surface_words,
     .help = "draw cloth as triangles or as points with discs"},
    {"range", FIELD_POINT, offsetof(FilmKeys, film.range), .unit = "", .max = 1e9,
     .help = "of a measuring look, in the units of its legend; default: from the whole run"},
    {"blur", FIELD_NUMBER, offsetof(FilmKeys, film.blur), .unit = "", .min = 0.0, .max = 1.0,
     .help = "motion blur: part of a frame for which the shutter is open; 0.5 as in cinema"},
    {"blur_samples", FIELD_COUNT, offsetof(FilmKeys, film.blur_samples), .min = 2, .max = 64,
     .help = "pictures averaged for it: the cost of a frame, so many times"},
    {"play", FIELD_NUMBER, offsetof(FilmKeys, film.play), .unit = "1/s", .min = 0.0, .max = 1e5,
     .help = "frames a second when it is shown; less than rate is slow motion; 0: rate"},
    {"title", FIELD_TEXT, offsetof(FilmKeys, title), .help = "written over the picture"},
    {"backdrop", FIELD_TEXT, offsetof(FilmKeys, backdrop),
     .help = "a picture file or \"#rrggbb\" behind the scene, with its shadows"},
    {"show_time", FIELD_BOOL, offsetof(FilmKeys, film.show_time), .help = "write the time"},
    {"show_scale", FIELD_BOOL, offsetof(FilmKeys, film.show_scale),
     .help = "draw a bar of a round length; needs a parallel projection"},
    {"floor", FIELD_RAW, offsetof(FilmKeys, floor),
     .help = "draw a floor: true, false, or its height; default true, under everything"},
    {0}};
const Schema film_schema = {.name = "film",
                            .help = "what the film shows",
                            .fields = film_fields,
                            .size = sizeof(FilmKeys),
                            .set_default = film_keys_default};

static bool read_floor(Reader *reader, const Yaml *value, Film *film) {
    if (yaml_is(value, "true") || yaml_is(value, "false")) {
        film->floor = yaml_is(value, "true");
        return true;
    }
    film->floor = true;
    return schema_read_number(reader, "floor", "m", -SCENE_FARTHEST, SCENE_FARTHEST, value,
                              &film->floor_height);
}

/* what is said about the picture fits together */
static bool check_picture(Reader *reader, const Yaml *map, const FilmKeys *keys) {
    const Film *film = &keys->film;
    bool ok = true;
    if (!isnan(film->range[0]) && !(film->range[0] < film->range[1])) {
        ok = schema_error(reader, yaml_find(map, "range"), "'range' goes from %g to %g",
                          film->range[0], film->range[1]);
    }
    if (keys->title && strlen(keys->title) >= FILM_TITLE_SIZE) {
        ok = schema_error(reader, yaml_find(map, "title"), "'title' has %d characters; at most %d",
                          (int)strlen(keys->title), FILM_TITLE_SIZE - 1);
    }
    if (film->show_scale && film->camera != CAMERA_ORTHOGRAPHIC) {
        ok = schema_error(reader, yaml_find(map, "show_scale"),
                          "'show_scale' needs 'camera: {orthographic: true}': in perspective every "
                          "depth has its own scale");
    }
    return ok;
}

static bool check_film(Reader *reader, const Yaml *map, const FilmKeys *keys) {
    const Yaml *size = yaml_find(map, "size"), *seconds = yaml_find(map, "seconds");
    const Film *film = &keys->film;
    double frames = keys->seconds * film->rate;
    bool ok = true;
    if (film->width % 2 || film->height % 2) {
        ok = schema_error(reader, size, "'size' is %d x %d; video needs even numbers", film->width,
                          film->height);
    }
    if (frames < 0.5 || frames > FILM_MOST_FRAMES) {
        ok =
            schema_error(reader, seconds ? seconds : map,
                         "'seconds' is %g s: %s at %g frames a second", keys->seconds,
                         frames < 0.5 ? "not one frame" : "more than a million frames", film->rate);
    }
    return ok;
}

bool scene_read_film(Reader *reader, const Field *field, const Yaml *value, void *member) {
    (void)field;
    Scene *scene = member;
    SceneContext *context = scene_context(reader);
    FilmKeys keys;
    film_keys_default(&keys);
    bool ok = schema_read(reader, &film_schema, value, &keys);
    if (value->kind != YAML_MAP) {
        return false;
    }
    ok = (!keys.camera || camera_read(reader, keys.camera, &keys.film)) && ok;
    ok = (!keys.cameras || cameras_read(reader, keys.cameras, &keys.film)) && ok;
    ok = (!keys.floor || read_floor(reader, keys.floor, &keys.film)) && ok;
    ok = (!keys.backdrop ||
          backdrop_read(reader, yaml_find(value, "backdrop"), keys.backdrop, &keys.film)) &&
         ok;
    ok = check_film(reader, value, &keys) && check_picture(reader, value, &keys) && ok;
    double frames = fmax(1.0, fmin(FILM_MOST_FRAMES, round(keys.seconds * keys.film.rate)));
    keys.film.frame_count = (int)frames;
    camera_end(&keys.film, frames / keys.film.rate);
    if (isnan(keys.film.range[0])) {
        keys.film.range[0] = keys.film.range[1] = 0.0;
    }
    snprintf(keys.film.title, sizeof keys.film.title, "%s", keys.title ? keys.title : "");
    scene->film = keys.film;
    context->look = keys.look;
    context->seconds = frames / keys.film.rate;
    reader->frame_seconds = 1.0 / keys.film.rate;
    return ok;
}

void scene_print_film(FILE *out, int indent, const Field *field, const void *member) {
    const Film *film = &((const Scene *)member)->film;
    FilmKeys keys = {.film = *film, .seconds = film->frame_count / film->rate};
    fprintf(out, "%*s%s:\n", indent, "", field->key);
    if (film->range[0] >= film->range[1]) {
        keys.film.range[0] = NAN;
    }
    keys.title = film->title[0] ? film->title : NULL;
    keys.backdrop = film->backdrop.name[0] ? film->backdrop.name : NULL;
    schema_print(out, indent + 2, &film_schema, &keys);
    camera_print(out, indent + 2, film);
    fprintf(out, "%*sfloor: ", indent + 2, "");
    if (film->floor && !isnan(film->floor_height)) {
        schema_print_quantity(out, film->floor_height, "m");
    } else {
        fputs(film->floor ? "true" : "false", out);
    }
    fputc('\n', out);
}
