#include "sim/contact/quiet_blocks.h"

#include <math.h>
#include <string.h>

const SlopeKernel *quiet_blocks_kernel(VectorWidth width) {
    static const SlopeKernel *const kernels[] = {&slope_kernel_scalar, &slope_kernel_sse2,
                                                 &slope_kernel_avx2, &slope_kernel_avx512};
    return kernels[width];
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
            panel->line[0] = of->h1 / panel->motion, panel->line[1] = of->h2 / panel->motion;
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
    double *const *x = view->lanes;
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
    memset(batch->rows.row, 0, sizeof batch->rows.row); /* all of them are worked on */
    memset(batch->rows.column, 0, sizeof batch->rows.column);
    for (int k = 0; k < SLOPE_BATCH; k++) {
        batch->rows.cells[0][k] = batch->rows.cells[1][k] = 1.0;
    }
}

static void slopes_put(SlopeValues *to, int k, const Slopes *from) {
    for (int a = 0; a < 2; a++) {
        to->mean[a][0][k] = from->mean[a].x, to->mean[a][1][k] = from->mean[a].y;
        to->mean[a][2][k] = from->mean[a].z;
    }
    to->normal[0][k] = from->normal.x, to->normal[1][k] = from->normal.y;
    to->normal[2][k] = from->normal.z;
    to->flat[k] = from->flat, to->steep[k] = from->steep;
}

static void batch_end(Batch *batch) {
    SlopeRows *rows = &batch->rows;
    const QuietView *view = batch->view;
    const SurfacePanel *panel = &view->surface->panels[batch->panel];
    SlopeNodes nodes = {{panel->h1, panel->h2}, view->slot + panel->first, view->lanes};
    view->kernel->fit(&nodes, rows); /* a lattice is cloth */
    for (int k = 0; k < batch->count; k++) {
        SlopeRow *low = rows->low, *high = rows->high;
        *batch->blocks[k] = (QuietBlock){
            .place = {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}},
            .slopes = slope_values_at(&rows->slopes, k),
        };
    }
    batch->count = 0;
}

/* a rectangle of cells, at most SURFACE_BLOCK along each side */
static void batch_add(Batch *batch, const int first[2], const int cells[2], QuietBlock *block) {
    const SurfacePanel *panel = &batch->view->surface->panels[batch->panel];
    int at = batch->count++;
    batch->blocks[at] = block;
    slope_rows_place(&batch->rows, at, panel, first, cells);
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

/* a leaf along an axis */
static void cut_leaf(Batch *batch, const QuietPanel *panel, const int block[2], int axis) {
    const SurfacePanel *of = &batch->view->surface->panels[batch->panel];
    int leaf = block[1] * panel->level[0].across + block[0];
    int first[2] = {block[0] * SURFACE_BLOCK, block[1] * SURFACE_BLOCK}, cells[2];
    int count = quiet_blocks_cells(of, block, axis);
    cells[axis] = 1, cells[1 - axis] = quiet_blocks_cells(of, block, 1 - axis);
    for (int k = 0; k < count; k++, first[axis]++) {
        batch_add(batch, first, cells, &panel->strips[leaf].strip[axis][k]);
    }
    panel->cut[leaf] |= (unsigned char)(1 << axis);
}

const QuietBlock *quiet_blocks_cut(const QuietView *view, const QuietPanel *panel, int p,
                                   const int block[2], int axis) {
    int across = panel->level[0].across, leaf = block[1] * across + block[0];
    if (!(panel->cut[leaf] & 1 << axis)) {
        /* with the other of two, which fits in the same vectors */
        int other[2] = {block[0] ^ 1, block[1]};
        Batch batch;
        batch_begin(&batch, view, p);
        cut_leaf(&batch, panel, block, axis);
        if (other[0] < across) {
            cut_leaf(&batch, panel, other, axis);
        }
        batch_end(&batch);
    }
    return panel->strips[leaf].strip[axis];
}

_Static_assert(2 * SURFACE_BLOCK <= SLOPE_BATCH, "the strips of two leaves are one batch");

void quiet_blocks_join(const SlopeKernel *kernel, const Slopes *part[][SLOPE_PARTS],
                       Slopes *all[]) {
    SlopeJoin join;
    for (int k = 0; k < SLOPE_BATCH; k++) {
        for (int m = 0; m < SLOPE_PARTS; m++) {
            slopes_put(&join.part[m], k, part[k][m]);
        }
    }
    kernel->join(&join);
    for (int k = 0; k < SLOPE_BATCH; k++) {
        *all[k] = slope_values_at(&join.all, k);
    }
}

/* The four blocks of the next finer level, at a side some of them twice. */
static void blocks_within(const QuietLevel *fine, int across, int b, const QuietBlock *part[]) {
    for (int k = 0; k < SLOPE_PARTS; k++) {
        int column = 2 * (b % across) + (k & 1), row = 2 * (b / across) + (k >> 1);
        column = column < fine->across ? column : fine->across - 1;
        row = row < fine->along ? row : fine->along - 1;
        part[k] = &fine->blocks[row * fine->across + column];
    }
}

/* blocks of those of the next finer level */
static void fit_level(const QuietView *view, const QuietLevel *fine, const QuietLevel *level,
                      bool lattice) {
    const Slopes *slopes[SLOPE_BATCH][SLOPE_PARTS];
    Slopes *all[SLOPE_BATCH];
    int count = level->across * level->along;
    for (int first = 0; first < count; first += SLOPE_BATCH) {
        for (int k = 0; k < SLOPE_BATCH; k++) {
            int b = first + k < count ? first + k : count - 1; /* the last one again */
            QuietBlock *block = &level->blocks[b];
            const QuietBlock *part[SLOPE_PARTS];
            blocks_within(fine, level->across, b, part);
            block->place = part[0]->place;
            for (int m = 1; m < SLOPE_PARTS; m++) {
                block->place = box_union(block->place, part[m]->place);
            }
            for (int m = 0; m < SLOPE_PARTS; m++) {
                slopes[k][m] = &part[m]->slopes;
            }
            all[k] = &block->slopes;
        }
        if (lattice) {
            quiet_blocks_join(view->kernel, slopes, all);
        }
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
        }
        if (k > 0) {
            fit_level(view, &panel->level[k - 1], level, lattice);
        }
    }
}
