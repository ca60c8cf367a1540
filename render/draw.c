#include "render/draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "render/gl.h"
#include "sim/base/hash.h"

struct Drawer {
    Arena arena;
    Run *run;
    DrawDef def;
    Camera camera;
    Painter *painter;
    Resampler *resampler;
    int layout_index; /* of the resampler; -1 = none */
    int drawn;        /* index of the frame in `image`; -1 = none */
    uint64_t shown;   /* hash of what `image` shows */
    Image image;
    DrawTimes *times;
};

bool draw_needs_end(Run *run, Error *error) {
    int obstacle;
    double floor = run_floor(run, &obstacle, error);
    return camera_needs_reach(&state_header(run->reader)->film, !isnan(floor));
}

static bool find_looks(const Drawer *drawer, const Look **wanted, Error *error) {
    const StateHeader *header = state_header(drawer->run->reader);
    for (int i = 0; i < header->cloth_count; i++) {
        wanted[i] = look_find(drawer->def.look ? drawer->def.look : header->cloths[i].look, error);
        if (!wanted[i]) {
            return false;
        }
    }
    return true;
}

static bool find_props(const Drawer *drawer, PaintProp *props, int floor_obstacle, Error *error) {
    const StateHeader *header = state_header(drawer->run->reader);
    for (int i = 0; i < header->obstacle_count; i++) {
        bool hidden = header->film.floor && i == floor_obstacle;
        props[i] = (PaintProp){.solid = header->obstacles[i].solid, .hidden = hidden};
        props[i].look = prop_look_find(header->obstacles[i].look, error);
        if (!props[i].look) {
            return false;
        }
    }
    return true;
}

static bool find_camera(Drawer *drawer, double floor, Error *error) {
    const Film *film = &state_header(drawer->run->reader)->film;
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
    const Look **wanted = arena_push(&drawer->arena, const Look *, header->cloth_count);
    PaintProp *props = arena_push(&drawer->arena, PaintProp, header->obstacle_count);
    Error none = {0};
    int floor_obstacle;
    double floor = run_floor(drawer->run, &floor_obstacle, &none);
    if (none.code != EXIT_OK) {
        return error_set(error, none.code, "%s", none.text);
    }
    if (!find_looks(drawer, wanted, error) || !find_props(drawer, props, floor_obstacle, error) ||
        !find_camera(drawer, floor, error) || !gl_open(drawer->def.threads, error)) {
        return false;
    }
    PaintDef def = {.width = drawer->def.width,
                    .height = drawer->def.height,
                    .quality = drawer->def.quality,
                    .camera = drawer->camera,
                    .floor = header->film.floor,
                    .cloth_count = header->cloth_count,
                    .looks = wanted,
                    .prop_count = header->obstacle_count,
                    .props = props};
    drawer->painter = paint_create(&def, error);
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
    free(drawer);
}

int draw_width(const Drawer *drawer) { return drawer->def.width; }
int draw_height(const Drawer *drawer) { return drawer->def.height; }
int draw_triangles(const Drawer *drawer) {
    return drawer->resampler ? resample_surface(drawer->resampler)->fine_count : 0;
}

void draw_measure(Drawer *drawer, DrawTimes *times) {
    drawer->times = times;
    paint_measure(drawer->painter, times ? times->paint : NULL);
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
                       .triangle_cap = drawer->def.quality->triangle_cap};
    resample_destroy(drawer->resampler);
    drawer->resampler = resample_create(layout, &def);
    drawer->layout_index = layout_index;
    paint_set_surface(drawer->painter, resample_surface(drawer->resampler));
}

const Image *draw_frame(Drawer *drawer, int index, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    double start = cpu_seconds();
    if (!state_read_frame(drawer->run->reader, index, &frame, &layout, &layout_index, error)) {
        return NULL;
    }
    uint64_t parts[2] = {hash_bytes(frame.x, 3 * sizeof(double) * (size_t)layout.node_count),
                         hash_bytes(frame.pose, sizeof(Pose) * (size_t)frame.pose_count)};
    uint64_t shown = hash_bytes(parts, sizeof parts);
    if (drawer->drawn >= 0 && shown == drawer->shown && layout_index == drawer->layout_index &&
        !drawer->times) {
        return &drawer->image;
    }
    use_layout(drawer, &layout, layout_index);
    double read = cpu_seconds();
    const Surface *surface = resample_frame(drawer->resampler, &layout, frame.x);
    double resampled = cpu_seconds();
    paint_frame(drawer->painter, surface, frame.pose, &drawer->image);
    drawer->drawn = index;
    drawer->shown = shown;
    if (drawer->times) {
        drawer->times->read += read - start;
        drawer->times->resample += resampled - read;
        drawer->times->frames++;
    }
    return &drawer->image;
}
