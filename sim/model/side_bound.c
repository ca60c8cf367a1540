#include "sim/model/side_bound.h"

#include <math.h>

#define ALLOWED (1.0 + SWEEP_SIDE_EXCESS)

const int side_bound_corners[4][4] = {{0, 1, 2, 3}, {2, 3, 0, 1}, {0, 2, 1, 3}, {1, 3, 0, 2}};

bool side_bound_exceeded(Vec3 own, Vec3 other, double spacing, SideExcess *out) {
    if (!side_bound_reached(own, spacing)) {
        return false;
    }
    Vec3 mean = vec3_scale(0.5, vec3_add(own, other));
    double square = vec3_dot(own, own), allowed = ALLOWED * ALLOWED * vec3_dot(mean, mean);
    if (square <= allowed) { /* most are as long as their cell */
        return false;
    }
    double length = sqrt(square), stretched = vec3_length(mean);
    out->excess = length - ALLOWED * max2(spacing, stretched);
    if (out->excess <= 0.0) {
        return false;
    }
    out->most = side_bound_most(spacing);
    out->along = vec3_scale(1.0 / length, own);
    out->curving = 1.0 / length;
    out->slope[0] = out->along;
    out->slope[1] = out->mean = vec3(0, 0, 0);
    out->uncurving = 0.0;
    if (stretched > spacing) { /* its bound moves with the cell */
        out->mean = vec3_scale(1.0 / stretched, mean);
        out->uncurving = 0.25 * ALLOWED / stretched;
        out->slope[1] = vec3_scale(-0.5 * ALLOWED, out->mean);
        out->slope[0] = vec3_add(out->along, out->slope[1]);
    }
    return true;
}

static Vec3 side_vector(const double *x, const int *node, const int *corner) {
    return vec3_sub(vec3_load(x + 3 * (size_t)node[corner[1]]),
                    vec3_load(x + 3 * (size_t)node[corner[0]]));
}

/* side `k` of cell `i` */
static bool exceeded(const SweepLattice *l, const StrainSamples *cells, int i, int k,
                     const double *x, SideExcess *side) {
    const int *node = cells->node + cells->start[i], *corner = side_bound_corners[k];
    return side_bound_exceeded(side_vector(x, node, corner), side_vector(x, node, corner + 2),
                               k < 2 ? l->h1 : l->h2, side);
}

double side_bound_energy(const SweepLattice *l, const StrainSamples *cells, const double *x) {
    double energy = 0.0;
    SideExcess side;
    for (int i = 0; i < cells->sample_count; i++) {
        for (int k = 0; k < 4; k++) {
            if (exceeded(l, cells, i, k, x, &side)) {
                double bent = min2(side.excess, side.most);
                energy += side_bound_stiffness(l, k / 2) * bent * (side.excess - 0.5 * bent);
            }
        }
    }
    return energy;
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
static void vector_block(const SideExcess *side, double k, bool definite, int p, int q, double sign,
                         double block[9]) {
    double a[3], b[3], n[3], m[3];
    vec3_store(a, side->slope[p]);
    vec3_store(b, side->slope[q]);
    vec3_store(n, side->along);
    vec3_store(m, side->mean);
    double bent = min2(side->excess, side->most), stiff = side->excess < side->most ? 1.0 : 0.0;
    double curving = p == 0 && q == 0 ? bent * side->curving : 0.0;
    double uncurving = definite ? 0.0 : bent * side->uncurving;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            double one = r == c ? 1.0 : 0.0;
            block[3 * r + c] = sign * k *
                               (stiff * a[r] * b[c] + curving * (one - n[r] * n[c]) -
                                uncurving * (one - m[r] * m[c]));
        }
    }
}

void side_bound_add_hessian(const SweepLattice *l, const StrainSamples *cells, const double *x,
                            bool definite, double *values) {
    SideExcess side;
    for (int i = 0; i < cells->sample_count; i++) {
        const BlockPlace *places = cells->places + cells->place_start[i];
        for (int k = 0; k < 4; k++) {
            if (!exceeded(l, cells, i, k, x, &side)) {
                continue;
            }
            for (int a = 0; a < 4; a++) {
                for (int b = 0; b < 4; b++) {
                    int row = side_bound_corners[k][a], column = side_bound_corners[k][b];
                    const BlockPlace *place = places + row * (row + 1) / 2 + column;
                    if (column > row || place->base < 0) {
                        continue;
                    }
                    double block[9];
                    vector_block(&side, side_bound_stiffness(l, k / 2), definite, a / 2, b / 2,
                                 a % 2 == b % 2 ? 1.0 : -1.0, block);
                    block_add(values, *place, block);
                }
            }
        }
    }
}
