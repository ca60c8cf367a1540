#include "render/draw.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "render/gl.h"
#include "render/overlay.h"
#include "sim/base/hash.h"

#define DRAW_VERSION 1 /* raised when the C code changes what pictures look like */

struct Drawer {
    Arena arena;
    Run *run;
    DrawDef def;
    Camera camera;
    Arena scratch;       /* of a frame */
    const Look **looks;  /* (cloth_count) */
    double *thickness;   /* [m] (cloth_count) */
    QuantityKind *kinds; /* (cloth_count) of measuring looks */
    bool measures, shown_kinds[QUANTITY_COUNT];
    QuantityRange ranges[QUANTITY_COUNT];
    PaintProp *props; /* (obstacle_count) */
    Painter *painter; /* NULL until the first frame is drawn */
    Resampler *resampler;
    int layout_index; /* of the resampler; -1 = none */
    int drawn;        /* index of the frame in `image`; -1 = none */
    uint64_t shown;   /* hash of what `image` shows */
    Image image;
    DrawTimes *times;
};

static bool is_fixed(QuantityRange range) { return range.low < range.high; }

static const char *look_name(const DrawDef *def, const StateHeader *header, int cloth) {
    return def->look ? def->look : header->cloths[cloth].look;
}

bool draw_needs_end(Run *run, const DrawDef *def, Error *error) {
    int obstacle;
    double floor = run_floor(run, &obstacle, error);
    const StateHeader *header = state_header(run->reader);
    bool ranges = false;
    for (int i = 0; i < header->cloth_count && !is_fixed(def->range); i++) {
        Error unknown = {0};
        const Look *look = look_find(look_name(def, header, i), &unknown);
        ranges = ranges || (look && look->quantity != QUANTITY_NONE);
    }
    return ranges || camera_needs_reach(&header->film, !isnan(floor));
}

/* What the film should look like. */
static const Film *film_of(const Drawer *drawer) {
    return drawer->def.film ? drawer->def.film : &state_header(drawer->run->reader)->film;
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
    QuantityRange given = drawer->def.range;
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
    return !fixed || drawer->measures ||
           error_set(error, EXIT_USAGE, "--range: no cloth has a measuring look (see looks)");
}

static bool find_props(Drawer *drawer, int floor_obstacle, Error *error) {
    PaintProp *props = drawer->props;
    const StateHeader *header = state_header(drawer->run->reader);
    for (int i = 0; i < header->obstacle_count; i++) {
        bool hidden = film_of(drawer)->floor && i == floor_obstacle;
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
    const Film *film = film_of(drawer);
    int width = drawer->def.width, height = drawer->def.height;
    CameraReach reach;
    bool needed = camera_needs_reach(film, !isnan(floor));
    if (needed && !run_find_reach(drawer->run, width, height, &reach, error)) {
        return false;
    }
    drawer->camera = camera_create(film, width, height, needed ? &reach : NULL, floor);
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
    return find_looks(drawer, error) && find_ranges(drawer, error) &&
           find_props(drawer, floor_obstacle, error) && find_camera(drawer, floor, error);
}

/* The driver is started for the first frame that really has to be drawn. */
static bool start_painter(Drawer *drawer, Error *error) {
    if (drawer->painter) {
        return true;
    }
    const StateHeader *header = state_header(drawer->run->reader);
    PaintDef def = {.width = drawer->def.width,
                    .height = drawer->def.height,
                    .quality = drawer->def.quality,
                    .camera = drawer->camera,
                    .floor = film_of(drawer)->floor,
                    .splats = drawer->def.splats,
                    .cloth_count = header->cloth_count,
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
    Drawer *drawer = calloc(1, sizeof *drawer);
    ASSERT(drawer);
    const Film *film = &state_header(run->reader)->film;
    drawer->run = run;
    drawer->def = *def;
    drawer->layout_index = drawer->drawn = -1;
    if (def->width <= 0) {
        drawer->def.width = film->width;
        drawer->def.height = film->height;
    }
    drawer->image = image_create(drawer->def.width, drawer->def.height);
    if (!set_up(drawer, error)) {
        draw_destroy(drawer);
        return NULL;
    }
    return drawer;
}

void draw_destroy(Drawer *drawer) {
    if (!drawer) {
        return;
    }
    paint_destroy(drawer->painter);
    resample_destroy(drawer->resampler);
    image_free(&drawer->image);
    arena_free(&drawer->arena);
    arena_free(&drawer->scratch);
    free(drawer);
}

int draw_width(const Drawer *drawer) { return drawer->def.width; }
int draw_height(const Drawer *drawer) { return drawer->def.height; }
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

bool draw_frame_key(Drawer *drawer, int index, uint64_t *key, Error *error) {
    const StateHeader *header = state_header(drawer->run->reader);
    const Camera *c = &drawer->camera;
    const Quality *quality = drawer->def.quality;
    uint64_t frame;
    if (!run_hash(drawer->run, index, index + 1, &frame, error)) {
        return false;
    }
    double numbers[] = {c->eye.x,          c->eye.y,          c->eye.z,
                        c->forward.x,      c->forward.y,      c->forward.z,
                        c->up.x,           c->up.y,           c->up.z,
                        c->half_x,         c->half_y,         c->distance,
                        c->perspective,    c->floor_height,   header->film.floor,
                        header->film.rate, drawer->def.width, drawer->def.height,
                        drawer->def.splats};
    size_t settings = sizeof *quality - offsetof(Quality, samples);
    uint64_t seen = hash_bytes(numbers, sizeof numbers);
    for (int i = 0; i < header->cloth_count; i++) {
        seen = hash_pair(seen, look_hash(drawer->looks[i]));
        seen = hash_pair(seen, hash_bytes(&drawer->thickness[i], sizeof(double)));
    }
    for (int i = 0; i < header->obstacle_count; i++) {
        seen = hash_pair(seen, prop_look_hash(drawer->props[i].look));
    }
    if (drawer->measures) { /* numbers come from velocities too */
        uint64_t moving;
        if (!hash_velocities(drawer, index, &moving, error)) {
            return false;
        }
        seen =
            hash_pair(seen, hash_pair(moving, hash_bytes(drawer->ranges, sizeof drawer->ranges)));
    }
    uint64_t parts[] = {frame, seen, shader_hash(), hash_bytes(&quality->samples, settings),
                        DRAW_VERSION};
    *key = hash_bytes(parts, sizeof parts);
    return true;
}

static double cpu_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void use_layout(Drawer *drawer, const StateLayout *layout, int layout_index) {
    if (layout_index == drawer->layout_index) {
        return;
    }
    ResampleDef def = {.pixels_per_metre =
                           camera_pixels_per_metre(&drawer->camera, drawer->def.height),
                       .triangle_cap = drawer->def.quality->triangle_cap,
                       .splats = drawer->def.splats,
                       .values = drawer->measures};
    resample_destroy(drawer->resampler);
    drawer->resampler = resample_create(layout, &def);
    drawer->layout_index = layout_index;
    paint_set_surface(drawer->painter, resample_surface(drawer->resampler));
}

static void move_meshes(Drawer *drawer, const StateFrame *frame) {
    const StateHeader *header = state_header(drawer->run->reader);
    for (int i = 0; i < header->obstacle_count; i++) {
        if (header->obstacles[i].mesh && header->obstacles[i].mesh->moves) {
            paint_move_mesh(drawer->painter, i, state_mesh_vertices(header, frame, i));
        }
    }
}

/* of everything that a picture of this frame shows */
static uint64_t hash_frame(const StateFrame *frame, const StateLayout *layout) {
    uint64_t parts[4] = {hash_bytes(frame->v, 3 * sizeof(double) * (size_t)layout->node_count),
                         hash_bytes(frame->x, 3 * sizeof(double) * (size_t)layout->node_count),
                         hash_bytes(frame->pose, sizeof(Pose) * (size_t)frame->pose_count),
                         hash_bytes(frame->moved, 3 * sizeof(double) * (size_t)frame->moved_count)};
    return hash_bytes(parts, sizeof parts);
}

/* The numbers of measuring looks, spread over the surface. */
static bool find_values(Drawer *drawer, const StateLayout *layout, const StateFrame *frame,
                        Error *error) {
    for (int i = 0; i < layout->cloth_count; i++) {
        if (drawer->kinds[i] == QUANTITY_NONE) {
            continue;
        }
        if (!resample_takes_values(layout, i)) {
            return error_set(error, EXIT_BAD_INPUT,
                             "look %s: the surface of cloth %d is not at its nodes",
                             drawer->looks[i]->name, i);
        }
        int count = layout->vertex_begin[i + 1] - layout->vertex_begin[i];
        ArenaMark mark = arena_mark(&drawer->scratch);
        double *values = arena_push(&drawer->scratch, double, (size_t)count);
        quantity_compute(drawer->kinds[i], layout, frame, i, &drawer->scratch, values);
        resample_values(drawer->resampler, layout, i, values);
        arena_rewind(&drawer->scratch, mark);
    }
    return true;
}

static void draw_overlay(Drawer *drawer) {
    if (drawer->measures) {
        Overlay overlay = {.shown = drawer->shown_kinds, .ranges = drawer->ranges};
        overlay_draw(&overlay, &drawer->image);
    }
}

const Image *draw_frame(Drawer *drawer, int index, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    double start = cpu_seconds();
    if (!state_read_frame(drawer->run->reader, index, &frame, &layout, &layout_index, error)) {
        return NULL;
    }
    uint64_t shown = hash_frame(&frame, &layout);
    if (drawer->drawn >= 0 && shown == drawer->shown && layout_index == drawer->layout_index &&
        !drawer->times) {
        return &drawer->image;
    }
    if (!start_painter(drawer, error)) {
        return NULL;
    }
    use_layout(drawer, &layout, layout_index);
    double read = cpu_seconds();
    const Surface *surface = resample_frame(drawer->resampler, &layout, frame.x);
    if (!find_values(drawer, &layout, &frame, error)) {
        return NULL;
    }
    double resampled = cpu_seconds();
    move_meshes(drawer, &frame);
    paint_frame(drawer->painter, surface, frame.pose, &drawer->image);
    draw_overlay(drawer);
    drawer->drawn = index;
    drawer->shown = shown;
    if (drawer->times) {
        drawer->times->read += read - start;
        drawer->times->resample += resampled - read;
        drawer->times->frames++;
    }
    return &drawer->image;
}
