#include <math.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define FILM_SECONDS 4.0 /* [s] default length */
#define FILM_MOST_FRAMES 1e6
#define SENSOR_HEIGHT 0.024 /* [m] of the 35 mm camera that `focal` speaks of */

typedef struct FilmKeys {
    Film film;
    double seconds; /* [s] */
    const char *look;
    const Yaml *camera, *floor;
} FilmKeys;

typedef struct CameraKeys {
    bool fit;
    Vec3 eye, target, up; /* [m]; eye NAN: not given */
    double fov, focal;    /* [rad], [m]; NAN */
    const Yaml *orthographic;
} CameraKeys;

typedef struct OrthographicKeys {
    double px_per_mm;
} OrthographicKeys;

static void film_keys_default(void *object) {
    *(FilmKeys *)object =
        (FilmKeys){.film = film_default(), .seconds = FILM_SECONDS, .look = "teal-twill"};
}

static void camera_keys_default(void *object) {
    Film film = film_default();
    *(CameraKeys *)object = (CameraKeys){
        .eye = {NAN, NAN, NAN}, .target = film.target, .up = film.up, .fov = NAN, .focal = NAN};
}

static const Field orthographic_fields[] = {
    {"px_per_mm", FIELD_NUMBER, offsetof(OrthographicKeys, px_per_mm), .unit = "", .min = 1e-4,
     .max = 1e4, .help = "scale [px/mm]; default: as large as fits"},
    {0}};
static const Schema orthographic_schema = {.name = "orthographic",
                                           .help = "a parallel projection",
                                           .fields = orthographic_fields,
                                           .size = sizeof(OrthographicKeys)};

static const Field camera_fields[] = {
    {"fit", FIELD_BOOL, offsetof(CameraKeys, fit),
     .help = "keep the direction, come as near as the whole motion allows; so does 'camera: auto'"},
    {"eye", FIELD_VECTOR, offsetof(CameraKeys, eye), .unit = "m", .max = SCENE_FARTHEST,
     .help = "where the camera stands; default [1, -2, 0.9] and fit"},
    {"target", FIELD_VECTOR, offsetof(CameraKeys, target), .unit = "m", .max = SCENE_FARTHEST,
     .help = "what it looks at"},
    {"up", FIELD_VECTOR, offsetof(CameraKeys, up), .unit = "", .max = SCENE_FARTHEST,
     .help = "what is up in the picture"},
    {"fov", FIELD_NUMBER, offsetof(CameraKeys, fov), .unit = "angle", .min = 0.005, .max = 3.0,
     .help = "vertical field of view; default 0.5 rad"},
    {"focal", FIELD_NUMBER, offsetof(CameraKeys, focal), .unit = "m", .min = 1e-3, .max = 5.0,
     .help = "focal length on 24 x 36 mm film, in place of fov"},
    {"orthographic", FIELD_RAW, offsetof(CameraKeys, orthographic), .group = &orthographic_schema,
     .help = "true or a mapping: no perspective"},
    {0}};
static const Schema camera_schema = {.name = "camera",
                                     .help = "the camera",
                                     .fields = camera_fields,
                                     .size = sizeof(CameraKeys),
                                     .set_default = camera_keys_default};

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
    {"floor", FIELD_RAW, offsetof(FilmKeys, floor),
     .help = "draw a floor: true, false, or its height; default true, under everything"},
    {0}};
const Schema film_schema = {.name = "film",
                            .help = "what the film shows",
                            .fields = film_fields,
                            .size = sizeof(FilmKeys),
                            .set_default = film_keys_default};

static bool read_orthographic(Reader *reader, const Yaml *value, Film *film) {
    if (!value || yaml_is(value, "false")) {
        return true;
    }
    OrthographicKeys keys = {0.0};
    if (!yaml_is(value, "true") && !schema_read(reader, &orthographic_schema, value, &keys)) {
        return false;
    }
    film->camera = CAMERA_ORTHOGRAPHIC;
    film->pixels_per_mm = keys.px_per_mm;
    return true;
}

static bool check_view(Reader *reader, const Yaml *value, const Film *film) {
    Vec3 view = vec3_sub(film->target, film->eye);
    double distance = vec3_length(view), up = vec3_length(film->up);
    if (distance < 1e-6) {
        return schema_error(reader, value, "'eye' and 'target' are the same point");
    }
    if (vec3_length(vec3_cross(view, film->up)) < 1e-6 * distance * up || up < 1e-9) {
        return schema_error(reader, value, "the camera looks along 'up'; choose another 'up'");
    }
    return true;
}

static bool read_camera(Reader *reader, const Yaml *value, Film *film) {
    CameraKeys keys;
    camera_keys_default(&keys);
    if (yaml_is(value, "auto")) {
        return true;
    }
    if (value->kind == YAML_TEXT) {
        return schema_error(reader, value, "'camera' wants auto or a mapping of keys, found %s",
                            yaml_describe(value, reader->report));
    }
    if (!schema_read(reader, &camera_schema, value, &keys)) {
        return false;
    }
    bool placed = !isnan(keys.eye.x);
    film->camera = placed && !keys.fit ? CAMERA_PERSPECTIVE : CAMERA_AUTO;
    film->eye = placed ? keys.eye : film->eye;
    film->target = keys.target;
    film->up = keys.up;
    if (!isnan(keys.fov) && !isnan(keys.focal)) {
        return schema_error(reader, value, "'fov' and 'focal' say the same; give one of them");
    }
    film->fov = !isnan(keys.fov)     ? keys.fov
                : !isnan(keys.focal) ? 2.0 * atan(0.5 * SENSOR_HEIGHT / keys.focal)
                                     : film->fov;
    return read_orthographic(reader, keys.orthographic, film) && check_view(reader, value, film);
}

static bool read_floor(Reader *reader, const Yaml *value, Film *film) {
    if (yaml_is(value, "true") || yaml_is(value, "false")) {
        film->floor = yaml_is(value, "true");
        return true;
    }
    film->floor = true;
    return schema_read_number(reader, "floor", "m", -SCENE_FARTHEST, SCENE_FARTHEST, value,
                              &film->floor_height);
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
    ok = (!keys.camera || read_camera(reader, keys.camera, &keys.film)) && ok;
    ok = (!keys.floor || read_floor(reader, keys.floor, &keys.film)) && ok;
    ok = check_film(reader, value, &keys) && ok;
    double frames = fmax(1.0, fmin(FILM_MOST_FRAMES, round(keys.seconds * keys.film.rate)));
    keys.film.frame_count = (int)frames;
    scene->film = keys.film;
    context->look = keys.look;
    context->seconds = frames / keys.film.rate;
    reader->frame_seconds = 1.0 / keys.film.rate;
    return ok;
}

static void print_camera(FILE *out, int indent, const Film *film) {
    fprintf(out, "%*scamera: {fit: %s, eye: ", indent, "",
            film->camera == CAMERA_AUTO ? "true" : "false");
    print_vector(out, film->eye, "m");
    fputs(", target: ", out);
    print_vector(out, film->target, "m");
    fputs(", up: ", out);
    print_vector(out, film->up, "");
    fputs(", fov: ", out);
    schema_print_quantity(out, film->fov, "angle");
    if (film->camera == CAMERA_ORTHOGRAPHIC && film->pixels_per_mm > 0.0) {
        fputs(", orthographic: {px_per_mm: ", out);
        schema_print_number(out, film->pixels_per_mm);
        fputc('}', out);
    } else if (film->camera == CAMERA_ORTHOGRAPHIC) {
        fputs(", orthographic: true", out);
    }
    fputs("}\n", out);
}

void scene_print_film(FILE *out, int indent, const Field *field, const void *member) {
    const Film *film = &((const Scene *)member)->film;
    FilmKeys keys = {.film = *film, .seconds = film->frame_count / film->rate};
    fprintf(out, "%*s%s:\n", indent, "", field->key);
    schema_print(out, indent + 2, &film_schema, &keys);
    print_camera(out, indent + 2, film);
    fprintf(out, "%*sfloor: ", indent + 2, "");
    if (film->floor && !isnan(film->floor_height)) {
        schema_print_quantity(out, film->floor_height, "m");
    } else {
        fputs(film->floor ? "true" : "false", out);
    }
    fputc('\n', out);
}
