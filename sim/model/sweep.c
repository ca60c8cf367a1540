#include "sim/model/sweep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/vector.h"

extern const SweepKernel sweep_kernel_scalar, sweep_kernel_sse2, sweep_kernel_avx2,
    sweep_kernel_avx512;

const SweepKernel *const sweep_kernels[] = {&sweep_kernel_scalar, &sweep_kernel_sse2,
                                            &sweep_kernel_avx2, &sweep_kernel_avx512, NULL};

bool sweep_kernel_runs_here(const SweepKernel *kernel) {
    for (VectorWidth width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
        if (kernel == sweep_kernels[width]) {
            return vector_runs_here(width);
        }
    }
    return false;
}

const SweepKernel *sweep_kernel_best(void) { return sweep_kernels[vector_best()]; }

void sweep_wrap_rows(const SweepLattice *l, double *const x[3]) {
    if (!l->wrap) {
        return;
    }
    for (int c = 0; c < 3; c++) {
        for (int j = 0; j < l->nv; j++) {
            double *row = x[c] + l->first + (ptrdiff_t)j * l->stride;
            row[-2] = row[l->nu - 2], row[-1] = row[l->nu - 1];
            row[l->nu] = row[0], row[l->nu + 1] = row[1];
        }
    }
}

/* Largest value of x (1 - g x^2), x = 0 .. 4 the square of a wave number times the spacing: over 4. With
 * both factors of inertia.h it is not exceeded where waves run along u and v at once. */
static double membrane_share(const SweepLattice *l) {
    return l->scaled ? 2.0 / 3.0 / sqrt(3.0 * SWEEP_MASS_SCALING) / 4.0 : 1.0;
}

/* the same of x^2 (1 - g x^2), over 16 */
static double bending_share(const SweepLattice *l) {
    return l->scaled ? 0.25 / SWEEP_MASS_SCALING / 16.0 : 1.0;
}

/* a quarter of density times the square of the fastest bending frequency [N/m3] */
static double bending_limit(const SweepLattice *l) {
    double h1 = l->h1 * l->h1, h2 = l->h2 * l->h2;
    return 4.0 * bending_share(l) *
           (l->d11 / (h1 * h1) + l->d22 / (h2 * h2) + (2.0 * l->d12 + 4.0 * l->d66) / (h1 * h2));
}

static double membrane_limit(const SweepLattice *l) {
    return membrane_share(l) * fmax(l->c11 / (l->h1 * l->h1), l->c22 / (l->h2 * l->h2));
}

double sweep_stable_step(const SweepLattice *l, double density) {
    return sqrt(density / (membrane_limit(l) + bending_limit(l)));
}

/* [N/m3] as membrane_limit, of one cell: stretched threads are stiffer, and their tension adds to that */
static double cell_limit(const SweepLattice *l, const double *x, int i, int j) {
    int right = i + 1 < l->nu ? i + 1 : 0;
    const double *row = x + 3 * j * l->nu, *above = row + 3 * l->nu;
    Vec3 a = vec3_load(row + 3 * i), b = vec3_load(row + 3 * right);
    Vec3 c = vec3_load(above + 3 * i), d = vec3_load(above + 3 * right);
    Vec3 f1 = vec3_scale(0.5 / l->h1, vec3_add(vec3_sub(b, a), vec3_sub(d, c)));
    Vec3 f2 = vec3_scale(0.5 / l->h2, vec3_add(vec3_sub(c, a), vec3_sub(d, b)));
    double g11 = vec3_dot(f1, f1), g22 = vec3_dot(f2, f2), g12 = vec3_dot(f1, f2);
    double e1 = 0.5 * (g11 - 1.0), e2 = 0.5 * (g22 - 1.0);
    double s1 = l->c11 * e1 + l->c12 * e2, s2 = l->c12 * e1 + l->c22 * e2, s12 = l->c66 * g12;
    double tension = fmax(0.0, 0.5 * (s1 + s2) + hypot(0.5 * (s1 - s2), s12));
    double k1 = l->c11 * g11 + l->c66 * g12 * g12 / g11 + tension;
    double k2 = l->c22 * g22 + l->c66 * g12 * g12 / g22 + tension;
    return fmax(k1 / (l->h1 * l->h1), k2 / (l->h2 * l->h2));
}

double sweep_stiffening(const SweepLattice *l, const double *x) {
    double most = 0.0;
    for (int j = 0; j + 1 < l->nv; j++) {
        for (int i = 0; i < (l->wrap ? l->nu : l->nu - 1); i++) {
            most = fmax(most, cell_limit(l, x, i, j));
        }
    }
    double bending = bending_limit(l);
    return (membrane_share(l) * most + bending) / (membrane_limit(l) + bending);
}

Fastest sweep_fastest(const SweepLattice *l, double density) {
    return (Fastest){4.0 * bending_limit(l) / density, 4.0 * membrane_limit(l) / density};
}
