#include "sim/contact/quiet_blocks.h"

#include <math.h>
#include <string.h>

#define PACKED_ROWS (SURFACE_BLOCK * SURFACE_BLOCK) /* of one coordinate */

const SlopeKernel *quiet_blocks_kernel(VectorWidth width) {
    static const SlopeKernel *const kernels[] = {&slope_kernel_scalar, &slope_kernel_sse2,
                                                 &slope_kernel_avx2, &slope_kernel_avx512};
    return kernels[width];
}

int quiet_blocks_cells(const SurfacePanel *panel, const int block[2], int axis) {
    int lines = axis == 0 ? panel->nu - !panel->wrap : panel->nv - 1;
    int left = lines - block[axis] * SURFACE_BLOCK;
    return left < SURFACE_BLOCK ? left : SURFACE_BLOCK;
}

static void create_lattice(QuietPanel *panel, const SurfacePanel *of, Arena *arena) {
    const QuietLevel *leaves = &panel->level[0];
    panel->least = of->distance / surface_lattice_altitude(of);
    panel->motion = 1.0 / sqrt(1.0 / (of->h1 * of->h1) + 1.0 / (of->h2 * of->h2));
    panel->line[0] = of->h1 / panel->motion, panel->line[1] = of->h2 / panel->motion;
    panel->strips = arena_push(arena, QuietStrips, leaves->across * leaves->along);
    panel->cut = arena_push(arena, unsigned char, leaves->across * leaves->along);
    panel->packed = arena_push(arena, float, 3 * PACKED_ROWS * leaves->room);
    for (int axis = 0; axis < 2; axis++) {
        panel->cells[axis] = arena_push(arena, float, leaves->room);
        for (int b = 0; b < leaves->room; b++) {
            int block[2] = {b % leaves->pitch, b / leaves->pitch};
            bool is_one = block[0] < leaves->across && block[1] < leaves->along;
            panel->cells[axis][b] = is_one ? (float)quiet_blocks_cells(of, block, axis) : 1.0f;
        }
    }
    for (int k = 0; k < panel->level_count; k++) {
        panel->level[k].slopes = slope_field_create(panel->level[k].room, arena);
        panel->level[k].window = arena_push(arena, float, panel->level[k].room);
    }
}

QuietPanel *quiet_blocks_create(const Surface *surface, Arena *arena) {
    QuietPanel *panels = arena_push(arena, QuietPanel, surface->panel_count);
    for (int p = 0; p < surface->panel_count; p++) {
        QuietPanel *panel = &panels[p];
        bool lattice = quiet_is_lattice(surface, p);
        int across = surface->first_group[p + 1] - surface->first_group[p], along = across > 0;
        if (lattice) {
            across = surface->blocks[2 * p], along = surface->blocks[2 * p + 1];
        }
        while (across * along > 0) {
            QuietLevel *level = &panel->level[panel->level_count++];
            *level =
                (QuietLevel){.across = across,
                             .along = along,
                             .places = arena_push(arena, Box, across * along),
                             .pitch = across + 1,
                             /* a batch reads past the last block, and twice as far in a join */
                             .room = (across + 1) * (along + 1) + 2 * SLOPE_BATCH};
            if (across * along == 1) {
                break;
            }
            across = (across + 1) / 2, along = (along + 1) / 2;
        }
        if (lattice && panel->level_count > 0) {
            create_lattice(panel, &surface->panels[p], arena);
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

static Box box_of(const SlopeFit *fit, int k) {
    return (Box){{fit->low[0][k], fit->low[1][k], fit->low[2][k]},
                 {fit->high[0][k], fit->high[1][k], fit->high[2][k]}};
}

/* where coordinate a of node (3 i + c, 3 j + m) of leaf 0 of a lattice is packed, c and m up to 3 */
static float *packed_at(const QuietPanel *panel, int a, int m, int c) {
    int row = PACKED_ROWS * a + SURFACE_BLOCK * (m % SURFACE_BLOCK) + c % SURFACE_BLOCK;
    const QuietLevel *leaves = &panel->level[0];
    int leaf = m / SURFACE_BLOCK * leaves->pitch + c / SURFACE_BLOCK;
    return panel->packed + (size_t)row * (size_t)leaves->room + leaf;
}

static SlopeFit fit_of(const QuietPanel *panel, const SurfacePanel *of) {
    return (SlopeFit){.h = {of->h1, of->h2},
                      .origin = {panel->origin[0], panel->origin[1], panel->origin[2]}};
}

/* a row of nodes; past the ends of a row that does not run around, the last node again */
static void pack_row(const QuietView *view, const QuietPanel *panel, int p, int row) {
    const SurfacePanel *of = &view->surface->panels[p];
    int j = row < of->nv ? row : of->nv - 1, whole = of->nu / SURFACE_BLOCK;
    int pitch = panel->level[0].pitch, at = row / SURFACE_BLOCK * pitch;
    for (int a = 0; a < 3; a++) {
        const double *x = view->lanes[a] + view->slot[of->first + j * of->nu];
        float *out[SURFACE_BLOCK];
        for (int c = 0; c < SURFACE_BLOCK; c++) {
            out[c] = packed_at(panel, a, row % SURFACE_BLOCK, c) + at;
        }
        view->kernel->pack(x, panel->origin[a], whole, out);
        for (int i = SURFACE_BLOCK * whole; i < SURFACE_BLOCK * pitch; i++) {
            double last = i < of->nu ? x[i] : of->wrap ? x[0] : x[of->nu - 1];
            out[i % SURFACE_BLOCK][i / SURFACE_BLOCK] = (float)(last - panel->origin[a]);
        }
    }
}

static void pack_nodes(const QuietView *view, QuietPanel *panel, int p) {
    const SurfacePanel *of = &view->surface->panels[p];
    int middle = view->slot[of->first + of->nu * (of->nv / 2) + of->nu / 2];
    for (int a = 0; a < 3; a++) {
        panel->origin[a] = view->lanes[a][middle];
    }
    for (int row = 0; row <= SURFACE_BLOCK * panel->level[0].along; row++) {
        pack_row(view, panel, p, row);
    }
}

static void fit_leaves(const QuietView *view, const QuietPanel *panel, int p) {
    const QuietLevel *level = &panel->level[0];
    SlopeFit fit = fit_of(panel, &view->surface->panels[p]);
    fit.cells[0] = panel->cells[0], fit.cells[1] = panel->cells[1];
    fit.slopes = level->slopes;
    for (int n = 0; n < 3 * SLOPE_NODES * SLOPE_NODES; n++) {
        int a = n % 3, m = n / 3 / SLOPE_NODES, c = n / 3 % SLOPE_NODES;
        fit.node[m][c][a] = packed_at(panel, a, m, c);
    }
    for (int b = 0, i = 0, j = 0; j < level->along; b++) { /* i = across: no block */
        if (b % SLOPE_BATCH == 0) {
            fit.at = b;
            view->kernel->fit(&fit);
        }
        if (i < level->across) {
            level->places[j * level->across + i++] = box_of(&fit, b % SLOPE_BATCH);
        } else {
            i = 0, j++;
        }
    }
}

static void fit_scattered(const QuietView *view, const QuietLevel *level, int p) {
    const Surface *surface = view->surface;
    for (int b = 0; b < level->across; b++) {
        const SurfaceGroup *group = &surface->groups[surface->first_group[p] + b];
        Box *place = &level->places[b];
        *place = box_empty();
        for (int k = group->vertex_begin; k < group->vertex_end; k++) {
            box_add(place, place_now(view, surface->group_vertices[k]));
        }
    }
}

/* Strip k of a leaf along an axis, as block k of `blocks`. */
static void place_strip(SlopeBlocks *blocks, const QuietPanel *panel, int leaf, int axis, int k) {
    for (int n = 0; n < 3 * SLOPE_NODES * SLOPE_NODES; n++) {
        int a = n % 3, m = n / 3 / SLOPE_NODES, c = n / 3 % SLOPE_NODES;
        int column = axis == 0 ? k + (c > 0) : c, row = axis == 1 ? k + (m > 0) : m;
        blocks->node[m][c][a][k] = packed_at(panel, a, row, column)[leaf];
    }
    blocks->cells[axis][k] = 1.0f;
    blocks->cells[1 - axis][k] = panel->cells[1 - axis][leaf];
}

const QuietStrip *quiet_blocks_cut(const QuietView *view, const QuietPanel *panel, int p,
                                   const int block[2], int axis) {
    const QuietLevel *leaves = &panel->level[0];
    int leaf = block[1] * leaves->across + block[0];
    QuietStrip *strip = panel->strips[leaf].strip[axis];
    if (!(panel->cut[leaf] & 1 << axis)) {
        const SurfacePanel *of = &view->surface->panels[p];
        SlopeBlocks blocks;
        SlopeFit fit = fit_of(panel, of);
        slope_blocks_begin(&blocks, &fit);
        int count = quiet_blocks_cells(of, block, axis);
        for (int k = 0; k < count; k++) {
            place_strip(&blocks, panel, block[1] * leaves->pitch + block[0], axis, k);
        }
        view->kernel->fit(&fit);
        for (int k = 0; k < count; k++) {
            strip[k] = (QuietStrip){box_of(&fit, k), slope_field_at(&fit.slopes, k)};
        }
        panel->cut[leaf] |= (unsigned char)(1 << axis);
    }
    return strip;
}

/* places of blocks of those of the next finer level */
static void join_places(const QuietLevel *fine, const QuietLevel *level) {
    for (int b = 0; b < level->across * level->along; b++) {
        int i = 2 * (b % level->across), j = 2 * (b / level->across);
        int right = i + 1 < fine->across ? 1 : 0, up = j + 1 < fine->along ? fine->across : 0;
        const Box *first = &fine->places[j * fine->across + i];
        level->places[b] =
            box_union(box_union(first[0], first[right]), box_union(first[up], first[up + right]));
    }
}

/* slopes likewise */
static void join_slopes(const SlopeKernel *kernel, const QuietLevel *fine,
                        const QuietLevel *level) {
    for (int j = 0; j < level->along; j++) {
        int up = 2 * j + 1 < fine->along ? fine->pitch : 0; /* else the block itself */
        for (int i = 0; i < level->across; i += SLOPE_BATCH) {
            int low = 2 * j * fine->pitch + 2 * i;
            kernel->join(&fine->slopes, low, low + up, &level->slopes, j * level->pitch + i);
        }
    }
}

/* the blocks past the sides, and no windows */
static void finish_level(const QuietLevel *level, bool wrap) {
    for (int r = 0; r < SLOPE_ROWS; r++) {
        float *row = level->slopes.row[r];
        for (int j = 0; j < level->along; j++) {
            float *end = row + j * level->pitch + level->across;
            *end = wrap ? end[-level->across] : end[-1];
        }
        float *past = row + level->along * level->pitch;
        memcpy(past, past - level->pitch, (size_t)level->pitch * sizeof *past);
    }
    for (int b = 0; b < level->room; b++) {
        level->window[b] = NAN;
    }
}

double quiet_blocks_window(const SlopeKernel *kernel, const QuietLevel *level, int i, int j) {
    int b = j * level->pitch + i;
    if (isnan(level->window[b])) {
        kernel->window(&level->slopes, level->pitch, b - b % SLOPE_BATCH, level->window);
    }
    return (double)level->window[b];
}

void quiet_blocks_fit(const QuietView *view, QuietPanel *panel, int p) {
    const SurfacePanel *of = &view->surface->panels[p];
    bool lattice = quiet_is_lattice(view->surface, p);
    for (int k = 0; k < panel->level_count; k++) {
        const QuietLevel *level = &panel->level[k], *fine = &panel->level[k > 0 ? k - 1 : 0];
        if (k > 0) {
            join_places(fine, level);
        } else if (!lattice) {
            fit_scattered(view, level, p);
        } else {
            pack_nodes(view, panel, p);
            fit_leaves(view, panel, p);
            memset(panel->cut, 0, (size_t)(level->across * level->along));
        }
        if (lattice && k > 0) {
            join_slopes(view->kernel, fine, level);
        }
        if (lattice) {
            finish_level(level, of->wrap);
        }
    }
}
