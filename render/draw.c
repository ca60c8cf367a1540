#include "render/draw_parts.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "render/gl.h"
#include "sim/base/hash.h"
#include "sim/base/memory.h"

#define DRAW_VERSION 3 /* raised when the C code changes what pictures look like */

static bool is_fixed(QuantityRange range) { return range.low < range.high; }

static QuantityRange range_of(const DrawDef *def, const Film *film) {
    return is_fixed(def->range) ? def->range : (QuantityRange){film->range[0], film->range[1]};
}

static const char *look_name(const DrawDef *def, const StateHeader *header, int cloth) {
    return def->look ? def->look : header->cloths[cloth].look;
}

bool draw_needs_end(Run *run, const DrawDef *def, Error *error) {
    int obstacle;
    double floor = run_floor(run, &obstacle, error);
    const StateHeader *header = state_header(run->reader);
    const Film *film = def->film ? def->film : &header->film;
    bool ranges = false, fixed = is_fixed(range_of(def, film));
    for (int i = 0; i < header->cloth_count && !fixed; i++) {
        Error unknown = {0};
        const Look *look = look_find(look_name(def, header, i), &unknown);
        ranges = ranges || (look && look->quantity != QUANTITY_NONE);
    }
    return ranges || camera_needs_reach(film, !isnan(floor));
}

static bool find_looks(Drawer *drawer, Error *error) {
    const StateHeader *header = state_header(drawer->run->reader);
    for (int i = 0; i < header->cloth_count; i++) {
        drawer->looks[i] = look_find(look_name(&drawer->def, header, i), error);
        if (!drawer->looks[i]) {
            return false;
        }
        drawer->thickness[i] = header->cloths[i].thickness;
        drawer->kinds[i] = drawer->looks[i]->quantity;
        drawer->shown_kinds[drawer->kinds[i]] = true;
    }
    return true;
}

/* A colour means the same in all frames. */
static bool find_ranges(Drawer *drawer, Error *error) {
    QuantityRange given = range_of(&drawer->def, &drawer->film);
    bool fixed = is_fixed(given);
    int found = 0;
    for (int kind = QUANTITY_NONE + 1; kind < QUANTITY_COUNT; kind++) {
        double scale = quantities[kind].scale;
        if (!drawer->shown_kinds[kind]) {
            continue;
        }
        drawer->measures = true;
        drawer->ranges[kind] = (QuantityRange){given.low / scale, given.high / scale};
        if (fixed && found++ > 0) {
            return error_set(error, EXIT_USAGE,
                             "--range: the cloths show different quantities; leave it out");
        }
        if (!fixed &&
            !quantity_find_range(kind, drawer->run, drawer->kinds, &drawer->ranges[kind], error)) {
            return false;
        }
    }
    return !is_fixed(drawer->def.range) || drawer->measures ||
           error_set(error, EXIT_USAGE, "--range: no cloth has a measuring look (see looks)");
}

static bool find_props(Drawer *drawer, int floor_obstacle, Error *error) {
    PaintProp *props = drawer->props;
    const StateHeader *header = state_header(drawer->run->reader);
    for (int i = 0; i < header->obstacle_count; i++) {
        bool hidden = drawer->film.floor && i == floor_obstacle;
        props[i] = (PaintProp){.solid = header->obstacles[i].solid,
                               .mesh = header->obstacles[i].mesh,
                               .hidden = hidden};
        props[i].look = prop_look_find(header->obstacles[i].look, error);
        if (!props[i].look) {
            return false;
        }
    }
    return true;
}

static bool find_camera(Drawer *drawer, double floor, Error *error) {
    const Film *film = &drawer->film;
    int width = drawer->def.width, height = drawer->def.height;
    CameraReach reach;
    bool needed = camera_needs_reach(film, !isnan(floor));
    if (needed && !run_find_reach(drawer->run, width, height, &reach, error)) {
        return false;
    }
    drawer->camera = camera_create(film, width, height, needed ? &reach : NULL, floor);
    return true;
}

Vec3 draw_middle(const StateFrame *frame, int node_count) {
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < node_count; i++) {
        sum = vec3_axpy(sum, 1.0, vec3_load(frame->x + 3 * (size_t)i));
    }
    return vec3_scale(1.0 / (node_count > 0 ? node_count : 1), sum);
}

static bool find_middle(Drawer *drawer, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    if (!state_read_frame(drawer->run->reader, 0, &frame, &layout, &layout_index, error)) {
        return false;
    }
    drawer->middle = draw_middle(&frame, layout.node_count);
    return true;
}

static bool set_up(Drawer *drawer, Error *error) {
    const StateHeader *header = state_header(drawer->run->reader);
    drawer->looks = arena_push(&drawer->arena, const Look *, header->cloth_count);
    drawer->thickness = arena_push(&drawer->arena, double, header->cloth_count);
    drawer->kinds = arena_push(&drawer->arena, QuantityKind, header->cloth_count);
    drawer->props = arena_push(&drawer->arena, PaintProp, header->obstacle_count);
    Error none = {0};
    int floor_obstacle;
    double floor = run_floor(drawer->run, &floor_obstacle, &none);
    if (none.code != EXIT_OK) {
        return error_set(error, none.code, "%s", none.text);
    }
    if (drawer->film.move.follow && !find_middle(drawer, error)) {
        return false;
    }
    return find_looks(drawer, error) && find_ranges(drawer, error) &&
           find_props(drawer, floor_obstacle, error) && find_camera(drawer, floor, error);
}

bool draw_start_painter(Drawer *drawer, Error *error) {
    if (drawer->painter) {
        return true;
    }
    const StateHeader *header = state_header(drawer->run->reader);
    PaintDef def = {.width = drawer->def.width,
                    .height = drawer->def.height,
                    .quality = drawer->def.quality,
                    .camera = drawer->camera,
                    .floor = drawer->film.floor,
                    .linear = drawer->def.linear,
                    .clear = drawer->def.clear,
                    .splats = drawer->film.surface == FILM_SPLATS,
                    .cloth_count = header->cloth_count,
                    .plate = drawer->plate.rgba ? &drawer->plate : NULL,
                    .prints = drawer->prints,
                    .looks = drawer->looks,
                    .ranges = drawer->ranges,
                    .thickness = drawer->thickness,
                    .prop_count = header->obstacle_count,
                    .props = drawer->props};
    drawer->painter = gl_open(drawer->def.threads, error) ? paint_create(&def, error) : NULL;
    if (drawer->painter && drawer->times) {
        paint_measure(drawer->painter, drawer->times->paint);
    }
    return drawer->painter != NULL;
}

Drawer *draw_create(Run *run, const DrawDef *def, Error *error) {
    Drawer *drawer = memory_zeroed(1, sizeof *drawer);
    drawer->run = run;
    drawer->def = *def;
    drawer->def.film = NULL;
    drawer->film = def->film ? *def->film : state_header(run->reader)->film;
    drawer->film.surface = def->splats ? FILM_SPLATS : drawer->film.surface;
    drawer->layout_index = drawer->drawn = -1;
    if (def->width <= 0) {
        drawer->def.width = drawer->film.width;
        drawer->def.height = drawer->film.height;
    }
    drawer->image = image_create(drawer->def.width, drawer->def.height);
    drawer->image.clear = def->clear;
    if (!set_up(drawer, error) || !draw_read_plate(drawer, error) ||
        !draw_read_prints(drawer, error)) {
        draw_destroy(drawer);
        return NULL;
    }
    drawer->pictures = draw_hash_pictures(drawer);
    return drawer;
}

void draw_destroy(Drawer *drawer) {
    if (!drawer) {
        return;
    }
    paint_destroy(drawer->painter);
    resample_destroy(drawer->resampler);
    image_free(&drawer->image);
    draw_free_pictures(drawer);
    arena_free(&drawer->arena);
    arena_free(&drawer->scratch);
    free(drawer);
}

const Film *draw_film(const Drawer *drawer) { return &drawer->film; }
int draw_width(const Drawer *drawer) { return drawer->def.width; }
int draw_height(const Drawer *drawer) { return drawer->def.height; }
int draw_count(const Drawer *drawer) { return drawer->count; }
int draw_triangles(const Drawer *drawer) {
    return drawer->resampler ? resample_surface(drawer->resampler)->fine_count : 0;
}

void draw_measure(Drawer *drawer, DrawTimes *times) {
    drawer->times = times;
    if (drawer->painter) {
        paint_measure(drawer->painter, times ? times->paint : NULL);
    }
}

static uint64_t hash_pair(uint64_t a, uint64_t b) {
    uint64_t both[2] = {a, b};
    return hash_bytes(both, sizeof both);
}

static bool hash_velocities(Drawer *drawer, int index, uint64_t *hash, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    if (!state_read_frame(drawer->run->reader, index, &frame, &layout, &layout_index, error)) {
        return false;
    }
    *hash = hash_bytes(frame.v, 3 * sizeof *frame.v * (size_t)layout.node_count);
    return true;
}

bool draw_needs_velocities(const Drawer *drawer) {
    return drawer->measures || drawer->film.blur > 0.0;
}

/* Adds what else the film asks for, and where a picture depends on more than its frame's places. */
static bool add_film(Drawer *drawer, int index, uint64_t *seen, Error *error) {
    const Film *film = &drawer->film;
    const FilmMove *move = &film->move;
    double numbers[] = {film->blur,       film->blur_samples, film->show_time, film->show_scale,
                        move->orbit,      move->orbit_begin,  move->orbit_end, move->follow,
                        drawer->middle.x, drawer->middle.y,   drawer->middle.z};
    *seen = hash_pair(*seen, hash_bytes(numbers, sizeof numbers));
    *seen = hash_pair(*seen, hash_bytes(film->title, strlen(film->title)));
    *seen = hash_pair(*seen, hash_bytes(move->keys, sizeof *move->keys * (size_t)move->key_count));
    *seen = hash_pair(*seen, hash_bytes(drawer->ranges, sizeof drawer->ranges));
    int first = film->blur > 0.0 && index > 0 ? index - 1 : index;
    for (int i = first; i <= index && draw_needs_velocities(drawer); i++) {
        uint64_t places, moving;
        if (!run_hash(drawer->run, i, i + 1, &places, error) ||
            !hash_velocities(drawer, i, &moving, error)) {
            return false;
        }
        *seen = hash_pair(*seen, hash_pair(places, moving));
    }
    return true;
}

bool draw_frame_key(Drawer *drawer, int index, uint64_t *key, Error *error) {
    const StateHeader *header = state_header(drawer->run->reader);
    const Camera *c = &drawer->camera;
    const Quality *quality = drawer->def.quality;
    uint64_t frame;
    if (!run_hash(drawer->run, index, index + 1, &frame, error)) {
        return false;
    }
    double numbers[] = {c->eye.x,
                        c->eye.y,
                        c->eye.z,
                        c->forward.x,
                        c->forward.y,
                        c->forward.z,
                        c->up.x,
                        c->up.y,
                        c->up.z,
                        c->half_x,
                        c->half_y,
                        c->distance,
                        c->perspective,
                        c->floor_height,
                        drawer->film.floor,
                        drawer->film.rate,
                        drawer->def.width,
                        drawer->def.height,
                        drawer->film.surface,
                        drawer->def.triangles,
                        drawer->def.linear,
                        drawer->def.clear};
    size_t settings = sizeof *quality - offsetof(Quality, samples);
    uint64_t seen = hash_bytes(numbers, sizeof numbers);
    for (int i = 0; i < header->cloth_count; i++) {
        seen = hash_pair(seen, look_hash(drawer->looks[i]));
        seen = hash_pair(seen, hash_bytes(&drawer->thickness[i], sizeof(double)));
    }
    for (int i = 0; i < header->obstacle_count; i++) {
        seen = hash_pair(seen, prop_look_hash(drawer->props[i].look));
    }
    if (!add_film(drawer, index, &seen, error)) {
        return false;
    }
    uint64_t parts[] = {
        frame,       seen, drawer->pictures, shader_hash(), hash_bytes(&quality->samples, settings),
        DRAW_VERSION};
    *key = hash_bytes(parts, sizeof parts);
    return true;
}
