#include "sim/step/sides.h"

#include <math.h>
#include <string.h>

Sides sides_create(const SweepLattice *lattice, Arena *arena) {
    if (!lattice->bounded) {
        return (Sides){0};
    }
    SweepSides seen = {arena_push(arena, unsigned char, lattice->nv),
                       arena_push(arena, unsigned char, lattice->nu * lattice->nv)};
    return (Sides){.lattice = lattice,
                   .seen = seen,
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

static LongSide *new_side(Sides *sides) {
    if (sides->count == sides->room) {
        sides->room = 2 * sides->room + 64;
        sides->list = arena_grow(sides->arena, LongSide, sides->list, sides->count, sides->room);
    }
    return &sides->list[sides->count++];
}

/* side k of the cell with these nodes, which is too long */
static void add_side(Sides *sides, const Lanes *lanes, const unsigned char *held, int k,
                     const int node[4], const int slot[4], const SideExcess *found) {
    LongSide *side = new_side(sides);
    for (int c = 0; c < 4; c++) {
        int corner = side_bound_corners[k][c];
        side->slot[c] = slot[corner];
        side->mobility[c] = held[node[corner]] ? 0.0 : lanes->weight[slot[corner]];
    }
    side->slope[0] = found->slope[0], side->slope[1] = found->slope[1];
    side->excess = found->excess;
    side->most = found->most;
    side->stiffness = side_bound_stiffness(sides->lattice, k / 2);
    side->before = growth(side, lanes);
    side->impulse = 0.0;
}

static void mark_cell(Sides *sides, int i, int j) {
    int right = i + 1 < sides->lattice->nu ? i + 1 : 0;
    for (int row = j; row <= j + 1; row++) {
        inertia_blocks_mark(&sides->blocks, i, row);
        inertia_blocks_mark(&sides->blocks, right, row);
    }
}

static void add_cell(Sides *sides, const Lanes *lanes, const unsigned char *held, int i, int j) {
    const SweepLattice *l = sides->lattice;
    int before = sides->count;
    int right = i + 1 < l->nu ? i + 1 : 0, row = l->first + j * l->stride;
    int node[4] = {j * l->nu + i, j * l->nu + right, (j + 1) * l->nu + i, (j + 1) * l->nu + right};
    int slot[4] = {row + i, row + right, row + l->stride + i, row + l->stride + right};
    Vec3 along[4], mean[2]; /* both sides along u, both along v; of each two */
    for (int k = 0; k < 4; k++) {
        const int *corner = side_bound_corners[k];
        along[k] = difference(lanes->x, slot[corner[0]], slot[corner[1]]);
    }
    mean[0] = vec3_scale(0.5, vec3_add(along[0], along[1]));
    mean[1] = vec3_scale(0.5, vec3_add(along[2], along[3]));
    for (int k = 0; k < 4; k++) {
        SideExcess found;
        if (side_bound_exceeded(along[k], mean[k / 2], k < 2 ? l->h1 : l->h2, &found)) {
            add_side(sides, lanes, held, k, node, slot, &found);
        }
    }
    if (sides->count > before && l->scaled) {
        mark_cell(sides, i, j);
    }
}

void sides_find(Sides *sides, const Lanes *lanes, const unsigned char *held, bool all) {
    const SweepLattice *l = sides->lattice;
    sides->count = 0;
    if (l) {
        inertia_blocks_clear(&sides->blocks, l->nv);
    }
    for (int j = 0; l && j + 1 < l->nv; j++) {
        const unsigned char *cell = sides->seen.cell + j * l->nu;
        for (int i = 0; (all || sides->seen.row[j]) && i < (l->wrap ? l->nu : l->nu - 1); i++) {
            if (all || cell[i]) {
                add_cell(sides, lanes, held, i, j);
            }
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
