/* One frame: its moments, each resampled and painted, their mean, and what is written over it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/between.h"
#include "render/draw_parts.h"
#include "render/motion.h"
#include "render/overlay.h"
#include "render/srgb.h"
#include "sim/base/clock.h"
#include "sim/base/hash.h"

#define DENSITY_MOMENTS 16 /* of a film in which a moving camera is asked how near it comes */

/* ---- the camera ---- */

static Camera camera_of(const Drawer *drawer, const StateLayout *layout, const StateFrame *frame) {
    Vec3 moved = {0, 0, 0};
    if (drawer->film.move.follow) {
        moved = vec3_sub(draw_middle(frame, layout->node_count), drawer->middle);
    }
    return camera_at(&drawer->film, &drawer->camera, frame->time, moved);
}

/* The density that the nearest view asks for: one for the whole film, so that nothing pops. */
static double pixels_per_metre(const Drawer *drawer) {
    const Film *film = &drawer->film;
    double most = 0.0, seconds = film->frame_count / film->rate;
    for (int i = 0; i <= DENSITY_MOMENTS; i++) {
        Camera camera =
            camera_at(film, &drawer->camera, seconds * i / DENSITY_MOMENTS, vec3(0, 0, 0));
        most = fmax(most, camera_pixels_per_metre(&camera, drawer->def.height));
    }
    return most;
}

/* ---- a moment ---- */

static void use_layout(Drawer *drawer, const StateLayout *layout, int layout_index) {
    if (layout_index == drawer->layout_index) {
        return;
    }
    ResampleDef def = {.pixels_per_metre = pixels_per_metre(drawer),
                       .triangle_cap = drawer->def.quality->triangle_cap,
                       .triangles = drawer->def.triangles,
                       .splats = drawer->film.surface == FILM_SPLATS,
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

/* The numbers of measuring looks, spread over the surface. */
static bool find_values(Drawer *drawer, const StateLayout *layout, const StateFrame *frame,
                        Error *error) {
    for (int i = 0; i < layout->cloth_count; i++) {
        if (drawer->kinds[i] == QUANTITY_NONE) {
            continue;
        }
        if (!quantity_is_kept(drawer->kinds[i], frame, error)) {
            return false;
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

/* Paints a moment into the drawer's image. */
static bool draw_moment(Drawer *drawer, const StateLayout *layout, const StateFrame *frame,
                        Error *error) {
    double start = clock_process_seconds();
    const Surface *surface = resample_frame(drawer->resampler, layout, frame->x);
    if (!find_values(drawer, layout, frame, error)) {
        return false;
    }
    if (drawer->times) {
        drawer->times->resample += clock_process_seconds() - start;
    }
    if (camera_moves(&drawer->film)) {
        Camera camera = camera_of(drawer, layout, frame);
        paint_set_camera(drawer->painter, &camera);
    }
    move_meshes(drawer, frame);
    paint_frame(drawer->painter, surface, frame->pose, &drawer->image);
    return true;
}

/* ---- motion blur: the mean light of moments from when the shutter opens to the frame's time ---- */

static void add_light(const Image *image, float *sum) {
    static float light[256];
    if (light[255] == 0.0f) {
        for (int i = 0; i < 256; i++) {
            light[i] = (float)srgb_light(i / 255.0);
        }
    }
    size_t count = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            sum[3 * i + k] += light[image->rgba[IMAGE_CHANNELS * i + k]];
        }
    }
}

static void set_mean(const float *sum, int samples, Image *image) {
    size_t count = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            double code = srgb_code((double)sum[3 * i + k] / samples);
            image->rgba[IMAGE_CHANNELS * i + k] = (uint8_t)(255.0 * code + 0.5);
        }
    }
}

static bool draw_blurred(Drawer *drawer, const StateLayout *layout, const StateFrame *before,
                         const StateFrame *frame, Error *error) {
    const Film *film = &drawer->film;
    size_t count = 3 * (size_t)drawer->def.width * (size_t)drawer->def.height;
    float *sum = arena_push(&drawer->scratch, float, count);
    bool good = true;
    memset(sum, 0, count * sizeof *sum);
    for (int i = 0; good && i < film->blur_samples; i++) {
        ArenaMark mark = arena_mark(&drawer->scratch);
        double part = 1.0 - film->blur * (1.0 - (i + 0.5) / film->blur_samples);
        StateFrame moment =
            between_frames(before, frame, layout->node_count, part, &drawer->scratch);
        good = draw_moment(drawer, layout, &moment, error);
        arena_rewind(&drawer->scratch, mark);
        if (good) {
            add_light(&drawer->image, sum);
        }
    }
    set_mean(sum, film->blur_samples, &drawer->image);
    return good;
}

/* ---- frames ---- */

/* Where a camera stands and what it sees; a camera that has come to rest stays the same. */
static uint64_t hash_camera(const Drawer *drawer, const StateLayout *layout,
                            const StateFrame *frame) {
    if (!camera_moves(&drawer->film)) {
        return 0;
    }
    Camera c = camera_of(drawer, layout, frame);
    double numbers[] = {c.eye.x, c.eye.y, c.eye.z, c.forward.x, c.forward.y, c.forward.z,
                        c.up.x,  c.up.y,  c.up.z,  c.half_x,    c.half_y,    c.distance};
    return hash_bytes(numbers, sizeof numbers);
}

/* Of everything that a picture of this frame shows. */
static uint64_t hash_frame(const Drawer *drawer, const StateFrame *frame,
                           const StateLayout *layout) {
    const Film *film = &drawer->film;
    size_t nodes = 3 * sizeof(double) * (size_t)layout->node_count;
    bool forces = drawer->shown_kinds[QUANTITY_CONTACT] && frame->contact_force;
    uint64_t parts[7] = {hash_bytes(frame->x, nodes),
                         hash_bytes(frame->pose, sizeof(Pose) * (size_t)frame->pose_count),
                         hash_bytes(frame->moved, 3 * sizeof(double) * (size_t)frame->moved_count),
                         draw_needs_velocities(drawer) ? hash_bytes(frame->v, nodes) : 0,
                         film->show_time ? hash_bytes(&frame->time, sizeof frame->time) : 0,
                         hash_camera(drawer, layout, frame),
                         forces ? hash_bytes(frame->contact_force, nodes) : 0};
    return hash_bytes(parts, sizeof parts);
}

static void draw_overlay(Drawer *drawer, const StateLayout *layout, const StateFrame *frame) {
    const Film *film = &drawer->film;
    Camera camera = camera_of(drawer, layout, frame);
    Overlay overlay = {.shown = drawer->shown_kinds,
                       .ranges = drawer->ranges,
                       .title = film->title,
                       .time = film->show_time ? frame->time : NAN,
                       .pixels_per_metre =
                           film->show_scale && !camera.perspective
                               ? camera_pixels_per_metre(&camera, drawer->def.height)
                               : 0.0};
    if (drawer->def.linear || drawer->def.clear) {
        return; /* nothing is written over what will be composed */
    }
    if (drawer->measures || film->title[0] || film->show_time || film->show_scale) {
        overlay_draw(&overlay, &drawer->image);
    }
}

/* The frame before, when the shutter is open between the two; false: there is no blur. */
static bool read_before(Drawer *drawer, int index, int layout_index, StateFrame *before) {
    StateLayout layout;
    int index_before;
    if (drawer->film.blur <= 0.0 || index == 0 ||
        !state_read_frame(drawer->run->reader, index - 1, before, &layout, &index_before, NULL) ||
        index_before != layout_index) {
        return false;
    }
    *before = between_copy(before, layout.node_count, &drawer->scratch);
    return true;
}

static bool draw_new(Drawer *drawer, int index, int layout_index, Error *error) {
    StateFrame before, frame;
    StateLayout layout;
    bool blurred = read_before(drawer, index, layout_index, &before);
    return state_read_frame(drawer->run->reader, index, &frame, &layout, &layout_index, error) &&
           (blurred ? draw_blurred(drawer, &layout, &before, &frame, error)
                    : draw_moment(drawer, &layout, &frame, error)) &&
           (draw_overlay(drawer, &layout, &frame), true);
}

const Image *draw_frame(Drawer *drawer, int index, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    double start = clock_process_seconds();
    if (!state_read_frame(drawer->run->reader, index, &frame, &layout, &layout_index, error)) {
        return NULL;
    }
    uint64_t shown = hash_frame(drawer, &frame, &layout);
    bool still = drawer->film.blur <= 0.0 || drawer->drawn == index;
    if (still && drawer->drawn >= 0 && shown == drawer->shown &&
        layout_index == drawer->layout_index && !drawer->times) {
        return &drawer->image;
    }
    if (!draw_start_painter(drawer, error)) {
        return NULL;
    }
    use_layout(drawer, &layout, layout_index);
    if (drawer->times) {
        drawer->times->read += clock_process_seconds() - start;
        drawer->times->frames++;
    }
    ArenaMark mark = arena_mark(&drawer->scratch);
    bool good = draw_new(drawer, index, layout_index, error);
    arena_rewind(&drawer->scratch, mark);
    drawer->drawn = good ? index : -1;
    drawer->count += good;
    drawer->shown = shown;
    return good ? &drawer->image : NULL;
}

/* Places of the surface's vertices at these nodes. */
static float *copy_places(Drawer *drawer, const StateLayout *layout, const double *x) {
    const Surface *surface = resample_frame(drawer->resampler, layout, x);
    float *places = arena_push(&drawer->scratch, float, 3 * (size_t)surface->vertex_count);
    for (int i = 0; i < surface->vertex_count; i++) {
        memcpy(places + 3 * (size_t)i, surface->vertices[i].position, 3 * sizeof *places);
    }
    return places;
}

/* Motion since the frame before, when it has the same layout. */
static bool find_motion(Drawer *drawer, int index, ExrPicture *picture, Error *error) {
    StateFrame before, frame;
    StateLayout layout;
    int at, before_at, samples = drawer->def.quality->samples;
    if (index == 0) {
        return true;
    }
    if (!state_read_frame(drawer->run->reader, index - 1, &before, &layout, &before_at, error)) {
        return false;
    }
    before = between_copy(&before, layout.node_count, &drawer->scratch);
    Camera camera_before = camera_of(drawer, &layout, &before);
    if (!state_read_frame(drawer->run->reader, index, &frame, &layout, &at, error)) {
        return false;
    }
    if (at != before_at || at != drawer->layout_index) {
        return true;
    }
    Camera camera = camera_of(drawer, &layout, &frame);
    MotionDef def = {.camera = &camera,
                     .camera_before = &camera_before,
                     .before = copy_places(drawer, &layout, before.x),
                     .places = copy_places(drawer, &layout, frame.x),
                     .surface = resample_surface(drawer->resampler),
                     .header = state_header(drawer->run->reader),
                     .now = &frame,
                     .then = &before,
                     .sample = {0.5 / samples, 1.0 - 0.5 / samples}};
    motion_fill(&def, picture);
    return true;
}

bool draw_exr(Drawer *drawer, int index, ExrPicture *picture, Error *error) {
    if (!draw_frame(drawer, index, error)) {
        return false;
    }
    paint_read_exr(drawer->painter, picture);
    ArenaMark mark = arena_mark(&drawer->scratch);
    bool good = find_motion(drawer, index, picture, error);
    arena_rewind(&drawer->scratch, mark);
    return good;
}
