#include "sim/model/side_bound.h"

#include <math.h>

#include "sim/base/parallel.h"

#define ENERGY_GRAIN 1024 /* sides a thread takes at once, some 10 us */

const int side_bound_corners[4][4] = {{0, 1, 2, 3}, {2, 3, 0, 1}, {0, 2, 1, 3}, {1, 3, 0, 2}};

/* d2 excess: curving (I - along along') by the side itself, less uncurving (I - mean mean') by all four
 * pairs of vectors, all unit vectors; of a side that is too short both are negative */
typedef struct SideCurve {
    Vec3 along, mean;
    double curving, uncurving; /* [1/m] */
} SideCurve;

static SideCurve curve_of(const SideExcess *side, Vec3 own, Vec3 mean) {
    double length = vec3_length(own), stretched = vec3_length(mean);
    bool moves = side->of_cell > 0.0;
    return (SideCurve){.along = vec3_scale(1.0 / length, own),
                       .mean = vec3_scale(moves ? 1.0 / stretched : 0.0, mean),
                       .curving = side->sign / length,
                       .uncurving = moves ? 0.25 * side->sign * side->of_cell / stretched : 0.0};
}

static Vec3 side_vector(const double *x, const int *node, const int *corner) {
    return vec3_sub(vec3_load(x + 3 * (size_t)node[corner[1]]),
                    vec3_load(x + 3 * (size_t)node[corner[0]]));
}

/* side `k` of cell `i`, and the mean of it and the one across */
static void side_vectors(const StrainSamples *cells, int i, int k, const double *x, Vec3 *own,
                         Vec3 *mean) {
    const int *node = cells->node + cells->start[i], *corner = side_bound_corners[k];
    *own = side_vector(x, node, corner);
    *mean = vec3_scale(0.5, vec3_add(*own, side_vector(x, node, corner + 2)));
}

static double side_spacing(const SweepLattice *l, int k) { return k < 2 ? l->h1 : l->h2; }

static bool exceeded(const SweepLattice *l, const StrainSamples *cells, int i, int k,
                     const double *x, SideExcess *side) {
    Vec3 own, mean;
    side_vectors(cells, i, k, x, &own, &mean);
    return side_bound_exceeded(own, mean, side_spacing(l, k), side);
}

typedef struct EnergyJob {
    const SweepLattice *lattice;
    const StrainSamples *cells;
    const double *x;
} EnergyJob;

/* [J] of sides, four of each cell */
static void energy_terms(int first, int end, const void *context, double *out) {
    const EnergyJob *job = context;
    for (int n = first; n < end; n++) {
        SideExcess side;
        bool is_beyond = exceeded(job->lattice, job->cells, n / 4, n % 4, job->x, &side);
        double bent = is_beyond ? min2(side.excess, side.most) : 0.0;
        out[n - first] = is_beyond ? side_bound_stiffness(job->lattice, n % 4 / 2) * bent *
                                         (side.excess - 0.5 * bent)
                                   : 0.0;
    }
}

double side_bound_energy(const SweepLattice *l, const StrainSamples *cells, const double *x) {
    EnergyJob job = {l, cells, x};
    return parallel_sum(0.0, 4 * cells->sample_count, ENERGY_GRAIN, energy_terms, &job);
}

void side_bound_add_gradient(const SweepLattice *l, const StrainSamples *cells, const double *x,
                             double *gradient) {
    SideExcess side;
    for (int i = 0; i < cells->sample_count; i++) {
        const int *node = cells->node + cells->start[i];
        for (int k = 0; k < 4; k++) {
            if (!exceeded(l, cells, i, k, x, &side)) {
                continue;
            }
            double force = side_bound_stiffness(l, k / 2) * min2(side.excess, side.most);
            for (int c = 0; c < 4; c++) {
                double *g = gradient + 3 * (size_t)node[side_bound_corners[k][c]];
                double sign = c % 2 == 0 ? -force : force;
                vec3_store(g, vec3_axpy(vec3_load(g), sign, side.slope[c / 2]));
            }
        }
    }
}

/* k (slope slope' + excess d2 excess) by vectors p and q, times `sign`; the first only until the side
 * yields */
static void vector_block(const SideExcess *side, const SideCurve *curve, double k, bool definite,
                         int p, int q, double sign, double block[9]) {
    double a[3], b[3], n[3], m[3];
    vec3_store(a, side->slope[p]);
    vec3_store(b, side->slope[q]);
    vec3_store(n, curve->along);
    vec3_store(m, curve->mean);
    double bent = min2(side->excess, side->most), stiff = side->excess < side->most ? 1.0 : 0.0;
    double curving = p == 0 && q == 0 ? bent * curve->curving : 0.0;
    double uncurving = bent * curve->uncurving;
    if (definite) {
        curving = max2(curving, 0.0), uncurving = min2(uncurving, 0.0);
    }
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            double one = r == c ? 1.0 : 0.0;
            block[3 * r + c] = sign * k *
                               (stiff * a[r] * b[c] + curving * (one - n[r] * n[c]) -
                                uncurving * (one - m[r] * m[c]));
        }
    }
}

static void add_side_hessian(const SideExcess *side, const SideCurve *curve, double stiffness,
                             bool definite, const int *corners, const BlockPlace *places,
                             double *values) {
    for (int a = 0; a < 4; a++) {
        for (int b = 0; b < 4; b++) {
            int row = corners[a], column = corners[b];
            const BlockPlace *place = places + row * (row + 1) / 2 + column;
            if (column > row || place->base < 0) {
                continue;
            }
            double block[9];
            vector_block(side, curve, stiffness, definite, a / 2, b / 2,
                         a % 2 == b % 2 ? 1.0 : -1.0, block);
            block_add(values, *place, block);
        }
    }
}

void side_bound_add_hessian(const SweepLattice *l, const StrainSamples *cells, const double *x,
                            bool definite, double *values) {
    for (int i = 0; i < cells->sample_count; i++) {
        for (int k = 0; k < 4; k++) {
            Vec3 own, mean;
            SideExcess side;
            side_vectors(cells, i, k, x, &own, &mean);
            if (side_bound_exceeded(own, mean, side_spacing(l, k), &side)) {
                SideCurve curve = curve_of(&side, own, mean);
                add_side_hessian(&side, &curve, side_bound_stiffness(l, k / 2), definite,
                                 side_bound_corners[k], cells->places + cells->place_start[i],
                                 values);
            }
        }
    }
}
