#include "sim/contact/quiet_blocks.h"

#include <math.h>
#include <string.h>

SlopeKernel *quiet_blocks_kernel(VectorWidth width) {
    static SlopeKernel *const *const kernels[] = {&slope_kernel_scalar, &slope_kernel_sse2,
                                                  &slope_kernel_avx2, &slope_kernel_avx512};
    return *kernels[width];
}

QuietPanel *quiet_blocks_create(const Surface *surface, Arena *arena) {
    QuietPanel *panels = arena_push(arena, QuietPanel, surface->panel_count);
    for (int p = 0; p < surface->panel_count; p++) {
        QuietPanel *panel = &panels[p];
        bool lattice = quiet_is_lattice(surface, p);
        int across = surface->first_group[p + 1] - surface->first_group[p], along = across > 0;
        if (lattice) {
            across = surface->blocks[2 * p], along = surface->blocks[2 * p + 1];
            const SurfacePanel *of = &surface->panels[p];
            panel->least = of->distance / surface_lattice_altitude(of);
            panel->motion = 1.0 / sqrt(1.0 / (of->h1 * of->h1) + 1.0 / (of->h2 * of->h2));
            panel->strips = arena_push(arena, QuietStrips, across * along);
            panel->cut = arena_push(arena, unsigned char, across *along);
        }
        while (across * along > 0) {
            QuietLevel *level = &panel->level[panel->level_count++];
            *level = (QuietLevel){across, along, arena_push(arena, QuietBlock, across * along),
                                  arena_push(arena, double, across *along)};
            if (across * along == 1) {
                break;
            }
            across = (across + 1) / 2, along = (along + 1) / 2;
        }
    }
    return panels;
}

static inline Vec3 place_now(const QuietView *view, int place) {
    if (place >= view->cloth_count) {
        return vec3_load(view->x + 3 * (long)place);
    }
    int slot = view->slot[place];
    double *const *x = view->lanes->x;
    return vec3(x[0][slot], x[1][slot], x[2][slot]);
}

/* Blocks of a lattice to be fitted at once. */
typedef struct Batch {
    const QuietView *view;
    int panel, count;
    QuietBlock *blocks[SLOPE_BATCH];
    SlopeRows rows;
} Batch;

static void batch_begin(Batch *batch, const QuietView *view, int panel) {
    batch->view = view;
    batch->panel = panel;
    batch->count = 0;
    memset(&batch->rows, 0, sizeof batch->rows); /* all of them are worked on */
    for (int k = 0; k < SLOPE_BATCH; k++) {
        batch->rows.cells[0][k] = batch->rows.cells[1][k] = 1.0;
    }
}

static void batch_end(Batch *batch) {
    SlopeRows *rows = &batch->rows;
    const SurfacePanel *panel = &batch->view->surface->panels[batch->panel];
    batch->view->kernel((double[]){panel->h1, panel->h2}, rows);
    for (int k = 0; k < batch->count; k++) {
        SlopeRow *u = rows->mean[0], *v = rows->mean[1], *n = rows->normal;
        SlopeRow *low = rows->low, *high = rows->high;
        *batch->blocks[k] = (QuietBlock){
            .place = {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}},
            .slopes = {.mean = {{u[0][k], u[1][k], u[2][k]}, {v[0][k], v[1][k], v[2][k]}},
                       .normal = {n[0][k], n[1][k], n[2][k]},
                       .flat = rows->flat[k],
                       .steep = rows->steep[k]},
        };
    }
    batch->count = 0;
}

/* a rectangle of cells, at most SURFACE_BLOCK along each side */
static void batch_add(Batch *batch, const int first[2], const int cells[2], QuietBlock *block) {
    const QuietView *view = batch->view;
    const SurfacePanel *panel = &view->surface->panels[batch->panel];
    SlopeRows *rows = &batch->rows;
    int at = batch->count++;
    batch->blocks[at] = block;
    rows->cells[0][at] = cells[0], rows->cells[1][at] = cells[1];
    double *const *x = view->lanes->x; /* a lattice is cloth */
    int column[SLOPE_NODES];
    for (int k = 0; k < SLOPE_NODES; k++) {
        int i = first[0] + (k < cells[0] ? k : cells[0]);
        column[k] = i < panel->nu ? i : i - panel->nu;
    }
    for (int m = 0; m < SLOPE_NODES; m++) {
        int row = first[1] + (m < cells[1] ? m : cells[1]);
        const int *slot = view->slot + panel->first + row * panel->nu;
        for (int k = 0; k < SLOPE_NODES; k++) {
            int s = slot[column[k]];
            rows->x[m][k][0][at] = x[0][s];
            rows->x[m][k][1][at] = x[1][s];
            rows->x[m][k][2][at] = x[2][s];
        }
    }
    if (batch->count == SLOPE_BATCH) {
        batch_end(batch);
    }
}

int quiet_blocks_cells(const SurfacePanel *panel, const int block[2], int axis) {
    int lines = axis == 0 ? panel->nu - !panel->wrap : panel->nv - 1;
    int left = lines - block[axis] * SURFACE_BLOCK;
    return left < SURFACE_BLOCK ? left : SURFACE_BLOCK;
}

static void fit_lattice(const QuietView *view, const QuietLevel *level, int p) {
    const SurfacePanel *panel = &view->surface->panels[p];
    Batch batch;
    batch_begin(&batch, view, p);
    for (int b = 0; b < level->across * level->along; b++) {
        int block[2] = {b % level->across, b / level->across};
        int first[2] = {block[0] * SURFACE_BLOCK, block[1] * SURFACE_BLOCK};
        int cells[2] = {quiet_blocks_cells(panel, block, 0), quiet_blocks_cells(panel, block, 1)};
        batch_add(&batch, first, cells, &level->blocks[b]);
    }
    batch_end(&batch);
}

static void fit_scattered(const QuietView *view, const QuietLevel *level, int p) {
    const Surface *surface = view->surface;
    for (int b = 0; b < level->across; b++) {
        const SurfaceGroup *group = &surface->groups[surface->first_group[p] + b];
        Box *place = &level->blocks[b].place;
        *place = box_empty();
        for (int k = group->vertex_begin; k < group->vertex_end; k++) {
            box_add(place, place_now(view, surface->group_vertices[k]));
        }
    }
}

const QuietBlock *quiet_blocks_cut(const QuietView *view, QuietPanel *panel, int p,
                                   const int block[2], int axis) {
    int leaf = block[1] * panel->level[0].across + block[0];
    QuietBlock *strips = panel->strips[leaf].strip[axis];
    if (!(panel->cut[leaf] & 1 << axis)) {
        const SurfacePanel *of = &view->surface->panels[p];
        int first[2] = {block[0] * SURFACE_BLOCK, block[1] * SURFACE_BLOCK}, cells[2];
        int count = quiet_blocks_cells(of, block, axis);
        cells[axis] = 1, cells[1 - axis] = quiet_blocks_cells(of, block, 1 - axis);
        Batch batch;
        batch_begin(&batch, view, p);
        for (int k = 0; k < count; k++, first[axis]++) {
            batch_add(&batch, first, cells, &strips[k]);
        }
        batch_end(&batch);
        panel->cut[leaf] |= (unsigned char)(1 << axis);
    }
    return strips;
}

/* a block of those of the next finer level */
static void fit_sum(const QuietLevel *fine, int i, int j, bool lattice, QuietBlock *sum) {
    const Slopes *part[4];
    int count = 0;
    sum->place = box_empty();
    for (int k = 0; k < 4; k++) {
        int column = 2 * i + (k & 1), row = 2 * j + (k >> 1);
        if (column < fine->across && row < fine->along) {
            const QuietBlock *block = &fine->blocks[row * fine->across + column];
            sum->place = box_union(sum->place, block->place);
            part[count++] = &block->slopes;
        }
    }
    if (lattice) {
        sum->slopes = slopes_join(part, count);
    }
}

void quiet_blocks_fit(const QuietView *view, QuietPanel *panel, int p) {
    bool lattice = quiet_is_lattice(view->surface, p);
    if (panel->level_count == 0) {
        return;
    }
    if (lattice) {
        fit_lattice(view, &panel->level[0], p);
        memset(panel->cut, 0, (size_t)(panel->level[0].across * panel->level[0].along));
    } else {
        fit_scattered(view, &panel->level[0], p);
    }
    for (int k = 0; k < panel->level_count; k++) {
        const QuietLevel *level = &panel->level[k];
        for (int b = 0; b < level->across * level->along; b++) {
            level->window[b] = NAN;
            if (k > 0) {
                fit_sum(&panel->level[k - 1], b % level->across, b / level->across, lattice,
                        &level->blocks[b]);
            }
        }
    }
}
