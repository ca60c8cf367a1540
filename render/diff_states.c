/* Rows of two runs: how far apart the vertices of their surfaces are. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/diff.h"
#include "render/drape.h"
#include "sim/base/memory.h"
#include "sim/state/state.h"

typedef struct Side {
    StateReader *reader;
    StateFrame frame;
    StateLayout layout;
    double *surface; /* [m] (vertex_count x 3) */
    int room;
} Side;

static bool open_side(Side *side, const char *path, Error *error) {
    side->reader = state_open(path, error);
    if (!side->reader) {
        return false;
    }
    if (state_refresh(side->reader) == STATE_DAMAGED) {
        return error_set(error, EXIT_BAD_INPUT, "%s: %s", path, state_damage(side->reader));
    }
    return true;
}

static bool read_side(Side *side, int index, Error *error) {
    int layout_index;
    if (!state_read_frame(side->reader, index, &side->frame, &side->layout, &layout_index, error)) {
        return false;
    }
    if (side->layout.vertex_count > side->room) {
        free(side->surface);
        side->room = side->layout.vertex_count;
        side->surface = memory_new(3 * sizeof *side->surface * (size_t)side->room);
    }
    state_surface(&side->layout, side->frame.x, side->surface);
    return true;
}

static void close_side(Side *side) {
    if (side->reader) {
        state_reader_close(side->reader);
    }
    free(side->surface);
}

/* [m] diagonal of the box around the cloth at rest. */
static double find_scale(const StateLayout *layout) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < 3 * layout->node_count; i++) {
        low[i % 3] = fmin(low[i % 3], layout->rest[i]);
        high[i % 3] = fmax(high[i % 3], layout->rest[i]);
    }
    return hypot(hypot(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
}

static bool same_mesh(const StateLayout *a, const StateLayout *b) {
    return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
           memcmp(a->triangles, b->triangles, 3 * sizeof(int32_t) * (size_t)a->triangle_count) == 0;
}

/* ---- the drape at the end ---- */

static bool asks_for_drape(const Diff *diff, const DiffItem *item) {
    DiffGate gate = diff_rules_gate(&diff->def.rules, item->name);
    return !isnan(gate.limit[DIFF_DRAPE]) || !isnan(gate.limit[DIFF_NODES]) ||
           !isnan(gate.limit[DIFF_OUTLINE]);
}

static bool measure_end(const char *path, Arena *arena, Drape *drape, Error *error) {
    Run run = {0};
    RunDef run_def = run_default();
    DrapeDef def = drape_default();
    run_def.path = path;
    bool good = run_open(&run, &run_def, error);
    if (good) {
        run_wait_end(&run);
        good = drape_measure(&run, &def, state_frame_count(run.reader) - 1, arena, drape, error);
        run_close(&run);
    }
    return good;
}

/* The farthest that a point of a is from its nearest one of b [m]; contours around one middle. */
static double farthest(const Contour *a, const Contour *b) {
    double most = 0.0, step = 2.0 * PI / CONTOUR_RAYS;
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double least = INFINITY, x = a->r[i] * cos(i * step), y = a->r[i] * sin(i * step);
        for (int k = 0; k < CONTOUR_RAYS; k++) {
            least = fmin(least, hypot(b->r[k] * cos(k * step) - x, b->r[k] * sin(k * step) - y));
        }
        most = fmax(most, least);
    }
    return most;
}

/* A row for the end of both runs. */
static bool compare_drapes(Diff *diff, DiffItem *item, int frame, Error *error) {
    Arena arena = {0};
    Drape a, b;
    bool good = measure_end(item->a, &arena, &a, error) && measure_end(item->b, &arena, &b, error);
    if (good && (isnan(a.dc) || isnan(b.dc))) {
        good = error_set(error, EXIT_BAD_INPUT,
                         "there is no support below the cloth to measure a "
                         "drape on; choose another profile");
    }
    if (good) {
        DiffRow *row = diff_add_row(diff, item, frame);
        row->value[DIFF_DRAPE] = fabs(a.dc - b.dc);
        row->value[DIFF_NODES] = abs(a.nodes.count - b.nodes.count);
        row->value[DIFF_OUTLINE] =
            fmax(farthest(&a.contour, &b.contour), farthest(&b.contour, &a.contour)) / a.specimen;
        diff_judge_row(diff, item, row);
    }
    arena_free(&arena);
    return good;
}

static bool compare_frame(Diff *diff, DiffItem *item, int index, Side *a, Side *b, Error *error) {
    if (!read_side(a, index, error) || !read_side(b, index, error)) {
        return false;
    }
    if (!same_mesh(&a->layout, &b->layout)) {
        if (asks_for_drape(diff, item)) { /* other meshes may hang alike */
            return true;
        }
        return error_set(error, EXIT_DIFFERS, "frame %d: the meshes differ: %d and %d vertices",
                         index, a->layout.vertex_count, b->layout.vertex_count);
    }
    double most = 0.0, scale = find_scale(&a->layout);
    for (size_t i = 0; i < (size_t)a->layout.vertex_count; i++) {
        Vec3 d = vec3_sub(vec3_load(a->surface + 3 * i), vec3_load(b->surface + 3 * i));
        most = fmax(most, vec3_length(d));
    }
    DiffRow *row = diff_add_row(diff, item, index);
    row->value[DIFF_MOVED] = most;
    row->value[DIFF_RELATIVE] = scale > 0.0 ? most / scale : NAN;
    if (a->frame.time != b->frame.time) {
        row->failed = true;
        snprintf(row->why, sizeof row->why, "times differ: %.9g s and %.9g s", a->frame.time,
                 b->frame.time);
    }
    diff_judge_row(diff, item, row);
    return true;
}

void diff_compare_states(Diff *diff, DiffItem *item) {
    Side a = {0}, b = {0};
    Error error = {0};
    if (open_side(&a, item->a, &error) && open_side(&b, item->b, &error)) {
        int of_a = state_frame_count(a.reader), of_b = state_frame_count(b.reader);
        int count = of_a < of_b ? of_a : of_b;
        for (int i = 0; i < count && error.code == EXIT_OK; i++) {
            compare_frame(diff, item, i, &a, &b, &error);
        }
        if (error.code == EXIT_OK && count > 0 && asks_for_drape(diff, item)) {
            compare_drapes(diff, item, count - 1, &error);
        } else if (of_a != of_b) {
            error_set(&error, EXIT_DIFFERS, "a has %d frames, b has %d", of_a, of_b);
        } else if (count == 0) {
            error_set(&error, EXIT_BAD_INPUT, "there is no frame in it");
        }
    }
    if (error.code != EXIT_OK) {
        snprintf(item->trouble, sizeof item->trouble, "%.500s", error.text);
        item->code = error.code;
    }
    close_side(&a);
    close_side(&b);
}
