/* `camera` and `cameras` of a film. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define SENSOR_HEIGHT 0.024 /* [m] of the 35 mm camera that `focal` speaks of */

typedef struct CameraKeys {
    bool fit;
    Vec3 eye, target, up; /* [m]; eye NAN: not given */
    double fov, focal;    /* [rad], [m]; NAN */
    bool follow;
    const Yaml *orthographic, *orbit, *keys;
} CameraKeys;

typedef struct OrbitKeys {
    double by, from, to; /* [rad], [s]; NAN */
} OrbitKeys;

typedef struct KeyKeys {
    double t;         /* [s] */
    Vec3 eye, target; /* [m]; target NAN: the camera's */
    double fov;       /* [rad]; NAN: the camera's */
} KeyKeys;

typedef struct OrthographicKeys {
    double px_per_mm;
} OrthographicKeys;

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

static void orbit_default(void *object) { *(OrbitKeys *)object = (OrbitKeys){NAN, 0.0, NAN}; }

static const Field orbit_fields[] = {
    {"by", FIELD_NUMBER, offsetof(OrbitKeys, by), .unit = "angle", .min = -1e3, .max = 1e3,
     .required = true, .help = "whole angle; positive is to the right of the camera"},
    {"from", FIELD_NUMBER, offsetof(OrbitKeys, from), .unit = "s", .min = 0.0, .max = 1e6,
     .help = "when it starts"},
    {"to", FIELD_NUMBER, offsetof(OrbitKeys, to), .unit = "s", .min = 0.0, .max = 1e6,
     .help = "when it ends; default: with the film"},
    {0}};
static const Schema orbit_schema = {.name = "orbit",
                                    .help = "a way round the target",
                                    .fields = orbit_fields,
                                    .size = sizeof(OrbitKeys),
                                    .set_default = orbit_default};

static void key_default(void *object) {
    *(KeyKeys *)object =
        (KeyKeys){.t = NAN, .eye = {NAN, NAN, NAN}, .target = {NAN, NAN, NAN}, .fov = NAN};
}

static const Field key_fields[] = {
    {"t", FIELD_NUMBER, offsetof(KeyKeys, t), .unit = "s", .min = 0.0, .max = 1e6, .required = true,
     .help = "when"},
    {"eye", FIELD_VECTOR, offsetof(KeyKeys, eye), .unit = "m", .max = SCENE_FARTHEST,
     .required = true, .help = "where the camera is"},
    {"target", FIELD_VECTOR, offsetof(KeyKeys, target), .unit = "m", .max = SCENE_FARTHEST,
     .help = "what it looks at; default: that of the camera"},
    {"fov", FIELD_NUMBER, offsetof(KeyKeys, fov), .unit = "angle", .min = 0.005, .max = 3.0,
     .help = "vertical field of view; default: that of the camera"},
    {0}};
static const Schema key_schema = {.name = "key",
                                  .help = "where the camera is at one time",
                                  .fields = key_fields,
                                  .size = sizeof(KeyKeys),
                                  .set_default = key_default};

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
    {"follow", FIELD_BOOL, offsetof(CameraKeys, follow),
     .help = "go along with the middle of the cloth"},
    {"orbit", FIELD_RAW, offsetof(CameraKeys, orbit), .group = &orbit_schema,
     .help = "go round the target, about the upright line"},
    {"keys", FIELD_RAW, offsetof(CameraKeys, keys), .group = &key_schema,
     .help = "a list of places in time, two or more, in place of eye; between them a smooth curve"},
    {0}};
const Schema camera_schema = {.name = "camera",
                              .help = "the camera",
                              .fields = camera_fields,
                              .size = sizeof(CameraKeys),
                              .set_default = camera_keys_default};

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

static bool read_orbit(Reader *reader, const Yaml *value, Film *film) {
    OrbitKeys keys;
    orbit_default(&keys);
    if (!schema_read(reader, &orbit_schema, value, &keys)) {
        return false;
    }
    film->move.orbit = keys.by;
    film->move.orbit_begin = keys.from;
    film->move.orbit_end = isnan(keys.to) ? NAN : keys.to; /* the end is known later */
    if (keys.to <= keys.from) {
        return schema_error(reader, value, "the orbit ends at %g s before it starts at %g s",
                            keys.to, keys.from);
    }
    return true;
}

static bool read_key(Reader *reader, const Yaml *item, Film *film) {
    FilmMove *move = &film->move;
    KeyKeys keys;
    key_default(&keys);
    if (!schema_read(reader, &key_schema, item, &keys)) {
        return false;
    }
    Film there = *film;
    there.eye = keys.eye;
    there.target = isnan(keys.target.x) ? film->target : keys.target;
    if (!check_view(reader, item, &there)) {
        return false;
    }
    if (move->key_count > 0 && !(keys.t > move->keys[move->key_count - 1].time)) {
        return schema_error(reader, item, "'t' is %g s, not after %g s of the key before", keys.t,
                            move->keys[move->key_count - 1].time);
    }
    move->keys[move->key_count++] =
        (FilmKey){keys.t, keys.eye, there.target, isnan(keys.fov) ? film->fov : keys.fov};
    return true;
}

static bool read_keys(Reader *reader, const Yaml *value, Film *film) {
    bool ok = true;
    if (value->kind != YAML_LIST || value->count < 2 || value->count > FILM_MOST_KEYS) {
        return schema_error(reader, value, "'keys' wants a list of 2 to %d mappings",
                            FILM_MOST_KEYS);
    }
    for (const Yaml *item = value->first; item; item = item->next) {
        ok = read_key(reader, item, film) && ok;
    }
    film->camera = film->camera == CAMERA_AUTO ? CAMERA_PERSPECTIVE : film->camera;
    return ok;
}

bool camera_read(Reader *reader, const Yaml *value, Film *film) {
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
    film->move.follow = keys.follow;
    return read_orthographic(reader, keys.orthographic, film) && check_view(reader, value, film) &&
           (!keys.orbit || read_orbit(reader, keys.orbit, film)) &&
           (!keys.keys || read_keys(reader, keys.keys, film));
}

bool cameras_read(Reader *reader, const Yaml *value, Film *film) {
    bool ok = true;
    if (value->kind != YAML_MAP || value->count > FILM_MOST_VIEWS) {
        return schema_error(reader, value, "'cameras' wants up to %d names, each with a mapping",
                            FILM_MOST_VIEWS);
    }
    for (const Yaml *item = value->first; item; item = item->next) {
        Film other = film_default();
        FilmView *view = &film->views[film->view_count];
        if (!name_check(reader, item->key, "a camera")) {
            ok = false;
            continue;
        }
        if (strlen(item->key->text) >= FILM_NAME_SIZE) {
            ok = schema_error(reader, item->key, "the name of a camera has at most %d letters",
                              FILM_NAME_SIZE - 1);
            continue;
        }
        if (!camera_read(reader, item, &other)) {
            ok = false;
            continue;
        }
        *view = (FilmView){.camera = other.camera,
                           .eye = other.eye,
                           .target = other.target,
                           .up = other.up,
                           .fov = other.fov,
                           .pixels_per_mm = other.pixels_per_mm,
                           .move = other.move};
        snprintf(view->name, sizeof view->name, "%s", item->key->text);
        film->view_count++;
    }
    return ok;
}

/* An orbit without an end goes on to the end of the film. */
void camera_end(Film *film, double seconds) {
    for (int i = -1; i < film->view_count; i++) {
        FilmMove *move = i < 0 ? &film->move : &film->views[i].move;
        if (isnan(move->orbit_end)) {
            move->orbit_end = fmax(seconds, move->orbit_begin + 1e-6);
        }
    }
}

static void print_move(FILE *out, const FilmMove *move) {
    if (move->follow) {
        fputs(", follow: true", out);
    }
    if (move->orbit != 0.0) {
        fputs(", orbit: {by: ", out);
        schema_print_quantity(out, move->orbit, "angle");
        fputs(", from: ", out);
        schema_print_quantity(out, move->orbit_begin, "s");
        fputs(", to: ", out);
        schema_print_quantity(out, move->orbit_end, "s");
        fputc('}', out);
    }
    for (int i = 0; i < move->key_count; i++) {
        fputs(i == 0 ? ", keys: [{t: " : ", {t: ", out);
        schema_print_quantity(out, move->keys[i].time, "s");
        fputs(", eye: ", out);
        print_vector(out, move->keys[i].eye, "m");
        fputs(", target: ", out);
        print_vector(out, move->keys[i].target, "m");
        fputs(", fov: ", out);
        schema_print_quantity(out, move->keys[i].fov, "angle");
        fputs(i + 1 == move->key_count ? "}]" : "}", out);
    }
}

static void print_view(FILE *out, int indent, const char *key, const Film *film) {
    fprintf(out, "%*s%s: {fit: %s, eye: ", indent, "", key,
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
    print_move(out, &film->move);
    fputs("}\n", out);
}

void camera_print(FILE *out, int indent, const Film *film) {
    print_view(out, indent, "camera", film);
    if (film->view_count > 0) {
        fprintf(out, "%*scameras:\n", indent, "");
    }
    for (int i = 0; i < film->view_count; i++) {
        Film other = *film;
        film_use_view(&other, &film->views[i]);
        print_view(out, indent + 2, film->views[i].name, &other);
    }
}
