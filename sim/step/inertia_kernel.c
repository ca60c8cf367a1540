/* inertia_kernel.c: the row loop of inertia.h. Compiled once per vector width (see the Makefile). */
#include <stddef.h>

#include "sim/step/inertia.h"

/* (1 - g L^2) of a row or of a column */
static inline double spread(double low2, double low, double here, double high, double high2) {
    return here - SWEEP_MASS_SCALING * ((low2 + high2) - 4.0 * (low + high) + 6.0 * here);
}

static ptrdiff_t mirrored(const SweepLattice *l, int j) {
    int row = j < 0 ? -j : j >= l->nv ? 2 * (l->nv - 1) - j : j;
    return (ptrdiff_t)row * l->stride;
}

/* nodes first .. last - 1, in whole blocks */
static void across(const SweepLattice *l, const double *moved, int j, int first, int last,
                   double *restrict out) {
    const double *base = moved + l->first;
    const double *restrict low2 = base + mirrored(l, j - 2), *restrict low =
                                                                 base + mirrored(l, j - 1);
    const double *restrict here = base + mirrored(l, j);
    const double *restrict high = base + mirrored(l, j + 1), *restrict high2 =
                                                                 base + mirrored(l, j + 2);
    int end = first + ((last - first + INERTIA_BLOCK - 1) & -INERTIA_BLOCK);
    VECTOR_LOOP
    for (int i = first; i < end; i++) {
        out[i] = spread(low2[i], low[i], here[i], high[i], high2[i]);
    }
}

static void spread_row(const InertiaChange *change, int j, int begin, int end, double *buffer) {
    const SweepLattice *l = change->lattice;
    size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
    double *restrict row = buffer + LANE_MARGIN, share = change->share;
    int nu = l->nu, last = nu - 1;
    int first = begin > 0 ? begin - INERTIA_BLOCK : 0, stop = end < nu ? end + INERTIA_BLOCK : nu;
    for (int c = 0; c < 3; c++) {
        across(l, change->moved[c], j, first, stop < nu ? stop : nu, row);
        if (first == 0) {
            row[-2] = l->wrap ? row[nu - 2] : row[2];
            row[-1] = l->wrap ? row[nu - 1] : row[1];
        }
        if (stop >= nu) {
            row[nu] = l->wrap ? row[0] : row[last - 1];
            row[nu + 1] = l->wrap ? row[1] : row[last - 2];
        }
        const double *restrict moved = change->moved[c] + at;
        double *restrict v = change->v[c] + at;
        VECTOR_LOOP
        for (int i = begin; i < end; i++) {
            v[i] +=
                spread(row[i - 2], row[i - 1], row[i], row[i + 1], row[i + 2]) - share * moved[i];
        }
    }
}

InertiaKernel *const VECTOR_JOIN(inertia_kernel_, VECTOR_VARIANT) = spread_row;
