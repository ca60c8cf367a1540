#include "sim/step/sides.h"

#include <string.h>

#include "sim/base/parallel.h"
#include "sim/base/quad.h"

#define SHARE_ROWS 16 /* rows of cells of a share: the order of impulses depends on it */
#define FEW_SIDES 64  /* fewer are not worth a thread */

static int min_int(int a, int b) { return a < b ? a : b; }

Sides sides_create(const SweepLattice *lattice, double *const pulled[3], Arena *arena) {
    if (!lattice->bounded) {
        return (Sides){0};
    }
    SweepSides seen = {arena_push(arena, unsigned char, lattice->nv),
                       arena_push(arena, unsigned char, lattice->nu * lattice->nv)};
    int count = parallel_chunk_count(lattice->nv - 1, SHARE_ROWS);
    SidesShare *shares = arena_push(arena, SidesShare, count);
    for (int k = 0; k < count; k++) {
        shares[k].cells = arena_push(arena, int, lattice->nu);
        shares[k].beyond = arena_push(arena, int, 4 * lattice->nu);
        shares[k].buffer = arena_push(arena, double, lattice->stride + LANE_MARGIN);
    }
    return (Sides){.lattice = lattice,
                   .kernel = sweep_kernel_best(),
                   .seen = seen,
                   .shares = shares,
                   .share_count = count,
                   .blocks = inertia_blocks_create(lattice, arena),
                   .pulled = {pulled[0], pulled[1], pulled[2]},
                   .arena = arena};
}

static inline Vec3 difference(double *const lane[3], int from, int to) {
    return vec3(lane[0][to] - lane[0][from], lane[1][to] - lane[1][from],
                lane[2][to] - lane[2][from]);
}

/* [m/s] */
static inline double growth(const BoundSide *side, const Lanes *lanes) {
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

/* [m/s] that of held nodes alone */
static inline double held_growth(const BoundSide *side, const Lanes *lanes) {
    double sum = 0.0;
    for (int k = 0; k < 4; k++) {
        int s = side->slot[k];
        Vec3 v = vec3(lanes->v[0][s], lanes->v[1][s], lanes->v[2][s]);
        double along = vec3_dot(side->slope[k / 2], v);
        sum += side->mobility[k] > 0.0 ? 0.0 : k % 2 == 0 ? -along : along;
    }
    return sum;
}

/* the marked cells of a row */
static int choose_cells(const Sides *sides, const SidesShare *share, int j) {
    const SweepLattice *l = sides->lattice;
    const unsigned char *marked = sides->seen.cell + j * l->nu;
    int count = 0, end = l->wrap ? l->nu : l->nu - 1;
    for (int i = 0; i < end; i++) {
        share->cells[count] = i;
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

/* Which sides of those cells are too long or too short? Every other one is, so nothing is branched on. */
QUADS static int choose_sides(const SweepLattice *l, const SidesShare *share, const Lanes *lanes,
                              int j, int cell_count) {
    double rest[2] = {l->h1 * l->h1, l->h2 * l->h2};
    int count = 0, slot[4];
    for (int n = 0; n < cell_count; n++) {
        Quad x, y, z, mean_x, mean_y, mean_z;
        find_corners(l, share->cells[n], l->first + j * l->stride, l->stride, slot);
        along_sides(lanes->x[0], slot, &x, &mean_x);
        along_sides(lanes->x[1], slot, &y, &mean_y);
        along_sides(lanes->x[2], slot, &z, &mean_z);
        Quad square = x * x + y * y + z * z;
        Quad of_cell = mean_x * mean_x + mean_y * mean_y + mean_z * mean_z;
        for (int k = 0; k < 4; k++) {
            share->beyond[count] = 4 * share->cells[n] + k;
            count += side_bound_is_exceeded(square[k], of_cell[k], rest[k / 2]);
        }
    }
    return count;
}

/* side k of cell i of row j */
static void set_side(const Sides *sides, const Lanes *lanes, const unsigned char *held, int i,
                     int j, int k, BoundSide *side) {
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

static void push(const BoundSide *side, const Lanes *lanes, double force) {
    for (int k = 0; k < 4; k++) {
        double pull = side->mobility[k] > 0.0 ? (k % 2 == 0 ? force : -force) : 0.0;
        Vec3 slope = side->slope[k / 2];
        int slot = side->slot[k];
        lanes->f[0][slot] += pull * slope.x;
        lanes->f[1][slot] += pull * slope.y;
        lanes->f[2][slot] += pull * slope.z;
    }
}

static void push_sides(SidesShare *share, const Lanes *lanes, int first, int end,
                       double kick_time) {
    for (int n = first; n < end && kick_time > 0.0; n++) {
        BoundSide *side = &share->list[n];
        double force = side->stiffness * min2(side->excess, side->most);
        side->impulse = kick_time * force;
        push(side, lanes, force);
    }
}

static SidesWork work_of(const SidesShare *share, const Lanes *lanes) {
    SidesWork work = {0.0, 0.0};
    for (int k = 0; k < share->count; k++) {
        const BoundSide *side = &share->list[k];
        work.taken += 0.5 * side->impulse * (side->before + growth(side, lanes));
    }
    for (int k = 0; k < share->held_count; k++) {
        const BoundSide *side = &share->list[share->held[k].side];
        double mean = 0.5 * (share->held[k].before + held_growth(side, lanes));
        work.handles += side->impulse * mean;
    }
    return work;
}

static void add_work(SidesWork *sum, const SidesWork *work) {
    sum->taken += work->taken;
    sum->handles += work->handles;
}

typedef struct FindJob {
    Sides *sides;
    const Lanes *lanes;
    const unsigned char *held;
    bool all;
    double kick_time;
} FindJob;

static void add_row(const FindJob *job, SidesShare *share, int j) {
    const Sides *sides = job->sides;
    const SweepLattice *l = sides->lattice;
    int cells = sides->seen.row[j] ? choose_cells(sides, share, j) : 0;
    int count = choose_sides(l, share, job->lanes, j, cells), first = share->count;
    if (share->count + count > share->room) {
        share->full = true;
        return;
    }
    for (int n = 0; n < count; n++) {
        BoundSide *side = &share->list[share->count];
        int i = share->beyond[n] / 4;
        set_side(sides, job->lanes, job->held, i, j, share->beyond[n] % 4, side);
        share->count += side->excess > 0.0;
    }
    /* a row of nodes and the next one */
    bool held = count > 0 && memchr(job->held + j * l->nu, 1, 2 * (size_t)l->nu);
    for (int k = first; k < share->count && held; k++) {
        const double *w = share->list[k].mobility;
        if (w[0] == 0.0 || w[1] == 0.0 || w[2] == 0.0 || w[3] == 0.0) {
            double before = held_growth(&share->list[k], job->lanes);
            share->held[share->held_count++] = (HeldSide){k, before};
        }
    }
}

static void find_rows(const FindJob *job, SidesShare *share, int first, int end) {
    bool last = end + 1 == job->sides->lattice->nv;
    share->count = share->inner = share->held_count = 0;
    share->full = false;
    for (int j = first; j < end; j++) {
        share->inner = j + 1 < end ? share->inner : share->count;
        add_row(job, share, j);
    }
    share->inner = last ? share->count : share->inner;
}

/* blocks that the sides first .. end - 1 of a share change */
static void mark_sides(Sides *sides, const SidesShare *share, int first, int end) {
    const SweepLattice *l = sides->lattice;
    for (int n = first; n < end && l->scaled; n++) {
        for (int k = 0; k < 4; k++) {
            int at = share->list[n].slot[k] - l->first;
            inertia_blocks_mark(&sides->blocks, at % l->stride, at / l->stride);
        }
    }
}

static void find_chunk(int chunk, int first, int end, void *context) {
    const FindJob *job = context;
    Sides *sides = job->sides;
    SidesShare *share = &sides->shares[chunk];
    share->work = work_of(share, job->lanes);
    if (job->all) {
        sides->kernel->mark(sides->lattice, job->lanes, &sides->seen, first, end, share->buffer);
    }
    bool last = end + 1 == sides->lattice->nv;
    inertia_blocks_clear(&sides->blocks, sides->lattice, sides->pulled, first,
                         last ? end + 1 : end);
    find_rows(job, share, first, end);
    if (!share->full) {
        push_sides(share, job->lanes, 0, share->inner, job->kick_time);
        mark_sides(sides, share, 0, share->inner);
    }
}

/* shares one after the other where there is little to do; the same bits */
static void for_shares(const Sides *sides, ParallelBody *body, void *context) {
    int rows = sides->lattice->nv - 1;
    if (sides->count >= FEW_SIDES) {
        parallel_for(rows, SHARE_ROWS, body, context);
        return;
    }
    for (int k = 0; k < sides->share_count; k++) {
        body(k, k * SHARE_ROWS, min_int(rows, (k + 1) * SHARE_ROWS), context);
    }
}

/* what a share could not do while others worked: find room for its sides, push those of its last row */
static void settle_share(const FindJob *job, SidesShare *share, int k) {
    Sides *sides = job->sides;
    int pushed = share->full ? 0 : share->inner;
    while (share->full) {
        share->room = 2 * share->room + 64;
        share->list = arena_push(sides->arena, BoundSide, share->room);
        share->held = arena_push(sides->arena, HeldSide, share->room);
        find_rows(job, share, k * SHARE_ROWS,
                  min_int(sides->lattice->nv - 1, (k + 1) * SHARE_ROWS));
    }
    push_sides(share, job->lanes, pushed, share->count, job->kick_time);
    mark_sides(sides, share, pushed, share->count);
}

SidesWork sides_find(Sides *sides, const Lanes *lanes, const unsigned char *held, bool all,
                     double kick_time) {
    const SweepLattice *l = sides->lattice;
    SidesWork work = {0.0, 0.0};
    if (!l) {
        return work;
    }
    if (all) {
        sweep_wrap_rows(l, lanes->x);
    }
    FindJob job = {sides, lanes, held, all, kick_time};
    for_shares(sides, find_chunk, &job);
    sides->count = 0;
    for (int k = 0; k < sides->share_count; k++) {
        SidesShare *share = &sides->shares[k];
        settle_share(&job, share, k);
        sides->count += share->count;
        add_work(&work, &share->work);
    }
    return work;
}

/* Where impulses go to: v takes `share` of them, `pulled` all. */
typedef struct SidesPull {
    const Lanes *lanes;
    double *const *pulled; /* NULL: nobody asks */
    double share;
} SidesPull;

static inline void apply(BoundSide *side, const SidesPull *to, double impulse) {
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
static void pull(BoundSide *side, const SidesPull *to, double dt, double share) {
    const double *w = side->mobility;
    double give = 1.0 / (share * dt * dt * side->stiffness);
    double mobility = (w[0] + w[1]) * vec3_dot(side->slope[0], side->slope[0]) +
                      (w[2] + w[3]) * vec3_dot(side->slope[1], side->slope[1]);
    double missing = growth(side, to->lanes) + side->excess / dt - give * side->impulse;
    double yields = share * dt * side->stiffness * side->most;
    double wanted = side->impulse + missing / (to->share * mobility + give);
    apply(side, to, max2(0.0, min2(wanted, yields)) - side->impulse);
}

/* takes the forces of the kick back */
static void clear(const BoundSide *side, const Lanes *lanes) {
    for (int k = 0; k < 4; k++) {
        int slot = side->slot[k];
        lanes->f[0][slot] = lanes->f[1][slot] = lanes->f[2][slot] = 0.0;
    }
}

typedef struct HoldJob {
    Sides *sides;
    SidesPull to;
    double dt, share;
} HoldJob;

static void hold(const HoldJob *job, const SidesShare *share, int first, int end) {
    for (int k = first; k < end; k++) {
        pull(&share->list[k], &job->to, job->dt, job->share);
        clear(&share->list[k], job->to.lanes);
    }
}

static void hold_chunk(int chunk, int first, int end, void *context) {
    (void)first, (void)end;
    const HoldJob *job = context;
    const SidesShare *share = &job->sides->shares[chunk];
    hold(job, share, 0, share->inner);
}

void sides_hold(Sides *sides, const Lanes *lanes, double dt, double share) {
    if (sides->count == 0) {
        return;
    }
    bool scaled = sides->lattice->scaled;
    SidesPull to = {lanes, scaled ? sides->pulled : NULL, scaled ? SIDES_SCALED_MOBILITY : 1.0};
    HoldJob job = {sides, to, dt, share};
    for_shares(sides, hold_chunk, &job);
    for (int k = 0; k < sides->share_count; k++) {
        hold(&job, &sides->shares[k], sides->shares[k].inner, sides->shares[k].count);
    }
}

double sides_energy(const Sides *sides) {
    double energy = 0.0;
    for (int m = 0; m < sides->share_count; m++) {
        for (int k = 0; k < sides->shares[m].count; k++) {
            const BoundSide *side = &sides->shares[m].list[k];
            double bent = min2(side->excess, side->most);
            energy += side->stiffness * bent * (side->excess - 0.5 * bent);
        }
    }
    return energy;
}

SidesWork sides_work(const Sides *sides, const Lanes *lanes) {
    SidesWork work = {0.0, 0.0};
    for (int m = 0; m < sides->share_count; m++) {
        SidesWork one = work_of(&sides->shares[m], lanes);
        add_work(&work, &one);
    }
    return work;
}

void sides_forget(Sides *sides) {
    for (int m = 0; m < sides->share_count; m++) {
        sides->shares[m].count = sides->shares[m].inner = sides->shares[m].held_count = 0;
    }
    sides->count = 0;
}
