#include "sim/step/sides.h"

#include "sim/base/quad.h"

Sides sides_create(const SweepLattice *lattice, Arena *arena) {
    if (!lattice->bounded) {
        return (Sides){0};
    }
    SweepSides seen = {arena_push(arena, unsigned char, lattice->nv),
                       arena_push(arena, unsigned char, lattice->nu * lattice->nv)};
    return (Sides){.lattice = lattice,
                   .kernel = sweep_kernel_best(),
                   .seen = seen,
                   .cells = arena_push(arena, int, lattice->nu),
                   .longer = arena_push(arena, int, 4 * lattice->nu),
                   .buffer = arena_push(arena, double, lattice->stride + LANE_MARGIN),
                   .blocks = inertia_blocks_create(lattice, arena),
                   .arena = arena};
}

static inline Vec3 difference(double *const lane[3], int from, int to) {
    return vec3(lane[0][to] - lane[0][from], lane[1][to] - lane[1][from],
                lane[2][to] - lane[2][from]);
}

/* [m/s] */
static inline double growth(const LongSide *side, const Lanes *lanes) {
    const int *s = side->slot;
    return vec3_dot(side->slope[0], difference(lanes->v, s[0], s[1])) +
           vec3_dot(side->slope[1], difference(lanes->v, s[2], s[3]));
}

/* nodes or slots at the corners of a cell, whose first is `at` and whose rows are `stride` apart */
static inline void find_corners(const SweepLattice *l, int i, int at, int stride, int corner[4]) {
    int right = i + 1 < l->nu ? i + 1 : 0;
    corner[0] = at + i, corner[1] = at + right;
    corner[2] = corner[0] + stride, corner[3] = corner[1] + stride;
}

/* the marked cells of a row */
static int choose_cells(const Sides *sides, int j) {
    const SweepLattice *l = sides->lattice;
    const unsigned char *marked = sides->seen.cell + j * l->nu;
    int count = 0, end = l->wrap ? l->nu : l->nu - 1;
    for (int i = 0; i < end; i++) {
        sides->cells[count] = i;
        count += marked[i];
    }
    return count;
}

/* one component of the vectors along the four sides of a cell (side_bound_corners), and half the sum of each
 * and that across */
static inline void along_sides(const double *x, const int slot[4], Quad *along, Quad *mean) {
    double low = x[slot[0]], right = x[slot[1]], above = x[slot[2]], high = x[slot[3]];
    Quad to = {right, high, above, high}, from = {low, above, low, right};
    Quad own = to - from, across = {own[1], own[0], own[3], own[2]};
    *along = own;
    *mean = 0.5 * (own + across);
}

/* Which sides of those cells are too long? Every other one is, so nothing is branched on. */
QUADS static int choose_sides(const Sides *sides, const Lanes *lanes, int j, int cell_count) {
    const SweepLattice *l = sides->lattice;
    double rest[2] = {l->h1 * l->h1, l->h2 * l->h2};
    int count = 0, slot[4];
    for (int n = 0; n < cell_count; n++) {
        Quad x, y, z, mean_x, mean_y, mean_z;
        find_corners(l, sides->cells[n], l->first + j * l->stride, l->stride, slot);
        along_sides(lanes->x[0], slot, &x, &mean_x);
        along_sides(lanes->x[1], slot, &y, &mean_y);
        along_sides(lanes->x[2], slot, &z, &mean_z);
        Quad square = x * x + y * y + z * z;
        Quad of_cell = mean_x * mean_x + mean_y * mean_y + mean_z * mean_z;
        for (int k = 0; k < 4; k++) {
            sides->longer[count] = 4 * sides->cells[n] + k;
            count += side_bound_is_exceeded(square[k], of_cell[k], rest[k / 2]);
        }
    }
    return count;
}

static void mark_cell(Sides *sides, int i, int j) {
    int right = i + 1 < sides->lattice->nu ? i + 1 : 0;
    for (int row = j; row <= j + 1; row++) {
        inertia_blocks_mark(&sides->blocks, i, row);
        inertia_blocks_mark(&sides->blocks, right, row);
    }
}

/* side k of cell i of row j */
static void set_side(const Sides *sides, const Lanes *lanes, const unsigned char *held, int i,
                     int j, int k, LongSide *side) {
    const SweepLattice *l = sides->lattice;
    int node[4], slot[4];
    find_corners(l, i, j * l->nu, l->nu, node);
    find_corners(l, i, l->first + j * l->stride, l->stride, slot);
    for (int c = 0; c < 4; c++) {
        int corner = side_bound_corners[k][c];
        side->slot[c] = slot[corner];
        side->mobility[c] = held[node[corner]] ? 0.0 : lanes->weight[slot[corner]];
    }
    Vec3 own = difference(lanes->x, side->slot[0], side->slot[1]);
    Vec3 across = difference(lanes->x, side->slot[2], side->slot[3]);
    Vec3 mean = vec3_scale(0.5, vec3_add(own, across));
    SideExcess found = side_bound_excess(own, mean, k < 2 ? l->h1 : l->h2);
    side->slope[0] = found.slope[0], side->slope[1] = found.slope[1];
    side->excess = found.excess;
    side->most = found.most;
    side->stiffness = side_bound_stiffness(l, k / 2);
    side->before = growth(side, lanes);
    side->impulse = 0.0;
}

static void make_room(Sides *sides, int more) {
    if (sides->count + more > sides->room) {
        sides->room = 2 * (sides->count + more) + 64;
        sides->list = arena_grow(sides->arena, LongSide, sides->list, sides->count, sides->room);
    }
}

static void add_row(Sides *sides, const Lanes *lanes, const unsigned char *held, int j) {
    int count = choose_sides(sides, lanes, j, choose_cells(sides, j));
    make_room(sides, count);
    for (int n = 0; n < count; n++) {
        int i = sides->longer[n] / 4;
        LongSide *side = &sides->list[sides->count];
        set_side(sides, lanes, held, i, j, sides->longer[n] % 4, side);
        if (side->excess > 0.0) {
            sides->count++;
            if (sides->lattice->scaled) {
                mark_cell(sides, i, j);
            }
        }
    }
}

void sides_find(Sides *sides, const Lanes *lanes, const unsigned char *held, bool all) {
    const SweepLattice *l = sides->lattice;
    sides->count = 0;
    if (!l) {
        return;
    }
    inertia_blocks_clear(&sides->blocks, l->nv);
    if (all) {
        sweep_wrap_rows(l, lanes->x);
        sides->kernel->mark(l, lanes, &sides->seen, 0, l->nv, sides->buffer);
    }
    for (int j = 0; j + 1 < l->nv; j++) {
        if (sides->seen.row[j]) {
            add_row(sides, lanes, held, j);
        }
    }
}

void sides_push(Sides *sides, const Lanes *lanes, double kick_time) {
    for (int n = 0; n < sides->count; n++) {
        LongSide *side = &sides->list[n];
        double force = side->stiffness * min2(side->excess, side->most);
        side->impulse = kick_time * force;
        for (int k = 0; k < 4; k++) {
            double pull = side->mobility[k] > 0.0 ? (k % 2 == 0 ? force : -force) : 0.0;
            Vec3 slope = side->slope[k / 2];
            int slot = side->slot[k];
            lanes->f[0][slot] += pull * slope.x;
            lanes->f[1][slot] += pull * slope.y;
            lanes->f[2][slot] += pull * slope.z;
        }
    }
}

void sides_clear(const Sides *sides, const Lanes *lanes) {
    for (int n = 0; n < sides->count; n++) {
        for (int k = 0; k < 4; k++) {
            int slot = sides->list[n].slot[k];
            lanes->f[0][slot] = lanes->f[1][slot] = lanes->f[2][slot] = 0.0;
        }
    }
}

/* Where impulses go to: v takes `share` of them, `pulled` all. */
typedef struct SidesPull {
    const Lanes *lanes;
    double *const *pulled; /* NULL: nobody asks */
    double share;
} SidesPull;

static inline void apply(LongSide *side, const SidesPull *to, double impulse) {
    side->impulse += impulse;
    for (int k = 0; k < 4; k++) {
        double change = (k % 2 == 0 ? impulse : -impulse) * side->mobility[k];
        double slope[3] = {side->slope[k / 2].x, side->slope[k / 2].y, side->slope[k / 2].z};
        int slot = side->slot[k];
        for (int a = 0; a < 3; a++) {
            to->lanes->v[a][slot] += to->share * change * slope[a];
            if (to->pulled) {
                to->pulled[a][slot] += change * slope[a];
            }
        }
    }
}

/* one of a round of sequential impulses on impulse = share dt k (excess + dt growth), which never
 * pushes and yields */
static void pull(LongSide *side, const SidesPull *to, double dt, double share) {
    const double *w = side->mobility;
    double give = 1.0 / (share * dt * dt * side->stiffness);
    double mobility = (w[0] + w[1]) * vec3_dot(side->slope[0], side->slope[0]) +
                      (w[2] + w[3]) * vec3_dot(side->slope[1], side->slope[1]);
    double missing = growth(side, to->lanes) + side->excess / dt - give * side->impulse;
    double yields = share * dt * side->stiffness * side->most;
    double wanted = side->impulse + missing / (to->share * mobility + give);
    apply(side, to, max2(0.0, min2(wanted, yields)) - side->impulse);
}

void sides_hold(Sides *sides, const Lanes *lanes, double dt, double share,
                double *const pulled[3]) {
    bool scaled = sides->count > 0 && sides->lattice->scaled;
    SidesPull to = {lanes, scaled ? pulled : NULL, scaled ? SIDES_SCALED_MOBILITY : 1.0};
    for (int k = 0; k < sides->count; k++) {
        pull(&sides->list[k], &to, dt, share);
    }
}

double sides_energy(const Sides *sides) {
    double energy = 0.0;
    for (int k = 0; k < sides->count; k++) {
        const LongSide *side = &sides->list[k];
        double bent = min2(side->excess, side->most);
        energy += side->stiffness * bent * (side->excess - 0.5 * bent);
    }
    return energy;
}

double sides_work(const Sides *sides, const Lanes *lanes) {
    double work = 0.0;
    for (int k = 0; k < sides->count; k++) {
        const LongSide *side = &sides->list[k];
        work += 0.5 * side->impulse * (side->before + growth(side, lanes));
    }
    return work;
}
