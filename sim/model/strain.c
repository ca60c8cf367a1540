#include "sim/model/strain.h"

#include <math.h>
#include <string.h>

#include "sim/base/error.h"

/* slopes 0 F1, 1 F2, 2 k12 */
const StrainKind strain_lattice = {
    .slope_count = 3,
    .strain_count = 5,
    .terms = {{{0, 0, 0.5}}, {{1, 1, 0.5}}, {{0, 1, 1.0}}, {{0, 2, 1.0}}, {{1, 2, 1.0}}},
    .rest = {0.5, 0.5}};

/* slopes 0 F1, 1 F2, 2 k11, 3 k12, 4 k22; strains E11 E22 g12, then E11,1 E22,1 g12,1 and ,2 */
const StrainKind strain_scattered = {.slope_count = 5,
                                     .strain_count = 9,
                                     .terms = {{{0, 0, 0.5}},
                                               {{1, 1, 0.5}},
                                               {{0, 1, 1.0}},
                                               {{0, 2, 1.0}},
                                               {{1, 3, 1.0}},
                                               {{1, 2, 1.0}, {0, 3, 1.0}},
                                               {{0, 3, 1.0}},
                                               {{1, 4, 1.0}},
                                               {{1, 3, 1.0}, {0, 4, 1.0}}},
                                     .rest = {0.5, 0.5}};

/* slopes 0 F1, 1 F2 */
const StrainKind strain_triangle = {.slope_count = 2,
                                    .strain_count = 3,
                                    .terms = {{{0, 0, 0.5}}, {{1, 1, 0.5}}, {{0, 1, 1.0}}},
                                    .rest = {0.5, 0.5}};

typedef double Slopes[STRAIN_MAX_SLOPES][3];

static void slopes_of(const StrainSamples *s, int sample, const double *x, Slopes v) {
    int slopes = s->kind->slope_count;
    for (int p = 0; p < slopes; p++) {
        v[p][0] = v[p][1] = v[p][2] = 0.0;
    }
    for (int k = s->start[sample]; k < s->start[sample + 1]; k++) {
        const double *node = x + 3 * (size_t)s->node[k], *row = s->row + (size_t)k * (size_t)slopes;
        for (int p = 0; p < slopes; p++) {
            v[p][0] += row[p] * node[0];
            v[p][1] += row[p] * node[1];
            v[p][2] += row[p] * node[2];
        }
    }
}

static double dot3(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* quadratic part of the strains (without the rest values) */
static void quadratic_strains(const StrainKind *kind, Slopes v, double *strain) {
    for (int k = 0; k < kind->strain_count; k++) {
        strain[k] = 0.0;
        for (int t = 0; t < 2 && kind->terms[k][t].c != 0.0; t++) {
            strain[k] += kind->terms[k][t].c * dot3(v[kind->terms[k][t].p], v[kind->terms[k][t].q]);
        }
    }
}

static void stress_of(const StrainSamples *s, int sample, const double *strain, double *stress) {
    stress[0] = s->c11 * strain[0] + s->c12 * strain[1];
    stress[1] = s->c12 * strain[0] + s->c22 * strain[1];
    stress[2] = s->c66 * strain[2];
    if (s->kind == &strain_triangle) {
        return;
    }
    const double *glass = s->hourglass + 3 * (size_t)sample;
    if (s->kind == &strain_lattice) {
        stress[3] = glass[0] * strain[3];
        stress[4] = glass[0] * strain[4];
        return;
    }
    for (int k = 0; k < 3; k++) {
        double weight = k == 2 ? 0.5 : 1.0; /* 2 E12 E12 = g12 g12 / 2 */
        stress[3 + k] = weight * (glass[0] * strain[3 + k] + glass[1] * strain[6 + k]);
        stress[6 + k] = weight * (glass[1] * strain[3 + k] + glass[2] * strain[6 + k]);
    }
}

/* U = sqrt(F'F) - I as strains, and the X of X U + U X = S, so that dW/dF = F (2 X) */
static void corotational_strains(double *strain, double u[3]) {
    double c11 = 2.0 * strain[0] + 1.0, c22 = 2.0 * strain[1] + 1.0, c12 = strain[2];
    double determinant = sqrt(fmax(c11 * c22 - c12 * c12, 0.0));
    double trace = sqrt(c11 + c22 + 2.0 * determinant);
    u[0] = (c11 + determinant) / trace;
    u[1] = (c22 + determinant) / trace;
    u[2] = c12 / trace;
    strain[0] = u[0] - 1.0;
    strain[1] = u[1] - 1.0;
    strain[2] = 2.0 * u[2];
}

static void corotational_stress(const double u[3], double *stress) {
    double a = u[0], c = u[1], b = u[2], s11 = stress[0], s22 = stress[1], s12 = stress[2];
    double determinant = a * c - b * b, trace = a + c;
    /* solution of 2(a p + b q) = s11, 2(b q + c r) = s22, b p + (a + c) q + b r = s12 */
    double q = (2.0 * a * c * s12 - b * (c * s11 + a * s22)) / (2.0 * trace * determinant);
    stress[0] = 2.0 * (0.5 * s11 - b * q) / a;
    stress[1] = 2.0 * (0.5 * s22 - b * q) / c;
    stress[2] = 2.0 * q;
}

/* strains at v, and the stress conjugate to the Green strains */
static void sample_state(const StrainSamples *s, int sample, Slopes v, double *strain,
                         double *stress) {
    quadratic_strains(s->kind, v, strain);
    for (int k = 0; k < s->kind->strain_count; k++) {
        strain[k] -= s->kind->rest[k];
    }
    double u[3];
    if (s->corotational) {
        corotational_strains(strain, u);
    }
    stress_of(s, sample, strain, stress);
}

double strain_energy(const StrainSamples *s, const double *x) {
    double energy = 0.0;
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v;
        double strain[STRAIN_MAX_STRAINS] = {0}, stress[STRAIN_MAX_STRAINS] = {0}, density = 0.0;
        slopes_of(s, i, x, v);
        sample_state(s, i, v, strain, stress);
        for (int k = 0; k < s->kind->strain_count; k++) {
            density += 0.5 * strain[k] * stress[k];
        }
        energy += s->area[i] * density;
    }
    return energy;
}

/* the stress that multiplies d(Green strain) */
static void green_stress(const StrainSamples *s, int sample, Slopes v, double *stress) {
    double strain[STRAIN_MAX_STRAINS] = {0}, u[3];
    quadratic_strains(s->kind, v, strain);
    for (int k = 0; k < s->kind->strain_count; k++) {
        strain[k] -= s->kind->rest[k];
    }
    if (!s->corotational) {
        stress_of(s, sample, strain, stress);
        return;
    }
    corotational_strains(strain, u);
    stress_of(s, sample, strain, stress);
    corotational_stress(u, stress);
}

void strain_add_gradient(const StrainSamples *s, const double *x, double *gradient) {
    const StrainKind *kind = s->kind;
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v, g = {{0}};
        double stress[STRAIN_MAX_STRAINS];
        slopes_of(s, i, x, v);
        green_stress(s, i, v, stress);
        for (int k = 0; k < kind->strain_count; k++) {
            for (int t = 0; t < 2 && kind->terms[k][t].c != 0.0; t++) {
                int p = kind->terms[k][t].p, q = kind->terms[k][t].q;
                double factor = s->area[i] * stress[k] * kind->terms[k][t].c;
                for (int c = 0; c < 3; c++) {
                    g[p][c] += factor * v[q][c];
                    g[q][c] += factor * v[p][c];
                }
            }
        }
        for (int k = s->start[i]; k < s->start[i + 1]; k++) {
            double *out = gradient + 3 * (size_t)s->node[k];
            const double *row = s->row + (size_t)k * (size_t)kind->slope_count;
            for (int p = 0; p < kind->slope_count; p++) {
                out[0] += row[p] * g[p][0];
                out[1] += row[p] * g[p][1];
                out[2] += row[p] * g[p][2];
            }
        }
    }
}

void strain_stress(const StrainSamples *s, const double *x, double *stress) {
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v;
        slopes_of(s, i, x, v);
        green_stress(s, i, v, stress + (size_t)i * (size_t)s->kind->strain_count);
    }
}

void strain_predict_stress(const StrainSamples *s, const double *x_new, const double *dx,
                           double *stress) {
    int strains = s->kind->strain_count;
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v, dv;
        double strain[STRAIN_MAX_STRAINS] = {0}, quadratic[STRAIN_MAX_STRAINS] = {0};
        slopes_of(s, i, x_new, v);
        slopes_of(s, i, dx, dv);
        quadratic_strains(s->kind, v, strain);
        quadratic_strains(s->kind, dv, quadratic);
        for (int k = 0; k < strains; k++) {
            strain[k] -= s->kind->rest[k] + quadratic[k];
        }
        stress_of(s, i, strain, stress + (size_t)i * (size_t)strains);
    }
}

/* calls `use` for every lower pair (a >= b in the sample's order) of solved nodes */
int strain_couple(const StrainSamples *s, int *pairs) {
    int count = 0;
    for (int i = 0; i < s->sample_count; i++) {
        for (int a = s->start[i]; a < s->start[i + 1]; a++) {
            for (int b = s->start[i]; b < a; b++) {
                if (s->node[a] >= s->node_limit || s->node[b] >= s->node_limit) {
                    continue;
                }
                if (pairs) {
                    pairs[2 * count] = s->node[a];
                    pairs[2 * count + 1] = s->node[b];
                }
                count++;
            }
        }
    }
    return count;
}

void strain_bind(StrainSamples *s, const BlockMatrix *matrix, int first, Arena *arena) {
    s->place_start = arena_push(arena, int, s->sample_count + 1);
    for (int i = 0; i < s->sample_count; i++) {
        int n = s->start[i + 1] - s->start[i];
        s->place_start[i + 1] = s->place_start[i] + n * (n + 1) / 2;
    }
    s->places = arena_push(arena, BlockPlace, s->place_start[s->sample_count]);
    BlockPlace *place = s->places;
    for (int i = 0; i < s->sample_count; i++) {
        for (int a = s->start[i]; a < s->start[i + 1]; a++) {
            for (int b = s->start[i]; b <= a; b++, place++) {
                bool solved = s->node[a] < s->node_limit && s->node[b] < s->node_limit;
                *place = solved ? block_matrix_place(matrix, first + s->node[a], first + s->node[b])
                                : (BlockPlace){-1, 0};
            }
        }
    }
}

/* positive part of the symmetric 2 x 2 matrix (a b; b d) */
static void clamp_positive(double *a, double *d, double *b) {
    double mean = 0.5 * (*a + *d), radius = hypot(0.5 * (*a - *d), *b);
    if (mean - radius >= 0.0) {
        return;
    }
    if (mean + radius <= 0.0) {
        *a = *d = *b = 0.0;
        return;
    }
    double scale = 0.5 * (mean + radius) / radius; /* l1 * (M - l2 I) / (l1 - l2) */
    double low = mean - radius;
    *a = scale * (*a - low), *d = scale * (*d - low), *b *= scale;
}

/* The two kinds of samples have constant numbers of slopes and strains: inlined with them, the
 * loops below unroll and cost half. */
#define FIXED_SIZES static inline __attribute__((always_inline)) void

/* B'CB + geometric part in slope space: h is (3 slopes x 3 slopes), row-major */
FIXED_SIZES slope_hessian(const StrainSamples *s, int sample, Slopes v, const double *sigma,
                          bool definite, int slopes, int strains, double *h) {
    const StrainKind *kind = s->kind;
    int size = 3 * slopes;
    double b[STRAIN_MAX_STRAINS][3 * STRAIN_MAX_SLOPES] = {{0}};
    double cb[3 * STRAIN_MAX_SLOPES][STRAIN_MAX_STRAINS];
    double g[STRAIN_MAX_SLOPES][STRAIN_MAX_SLOPES] = {{0}};
    double stress[STRAIN_MAX_STRAINS];
    memcpy(stress, sigma, (size_t)strains * sizeof *stress);
    if (definite) {
        clamp_positive(&stress[0], &stress[1], &stress[2]);
        memset(stress + 3, 0, (STRAIN_MAX_STRAINS - 3) * sizeof *stress);
    }
    for (int k = 0; k < strains; k++) {
        for (int t = 0; t < 2 && kind->terms[k][t].c != 0.0; t++) {
            int p = kind->terms[k][t].p, q = kind->terms[k][t].q;
            double c = kind->terms[k][t].c;
            g[p][q] += c * stress[k];
            g[q][p] += c * stress[k];
            for (int d = 0; d < 3; d++) {
                b[k][3 * p + d] += c * v[q][d];
                b[k][3 * q + d] += c * v[p][d];
            }
        }
    }
    for (int j = 0; j < size; j++) {
        double column[STRAIN_MAX_STRAINS] = {0};
        for (int k = 0; k < strains; k++) {
            column[k] = b[k][j];
        }
        stress_of(s, sample, column, cb[j]);
    }
    double area = s->area[sample];
    for (int i = 0; i < size; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = i % 3 == j % 3 ? g[i / 3][j / 3] : 0.0;
            for (int k = 0; k < strains; k++) {
                sum += b[k][i] * cb[j][k];
            }
            h[i * size + j] = h[j * size + i] = area * sum;
        }
    }
}

/* blocks r_a' H r_b of all pairs of one sample's nodes */
FIXED_SIZES add_blocks(const StrainSamples *s, int sample, const double *h, int slopes,
                       double *values) {
    int size = 3 * slopes;
    const BlockPlace *place = s->places + s->place_start[sample];
    for (int a = s->start[sample]; a < s->start[sample + 1]; a++) {
        const double *row_a = s->row + (size_t)a * (size_t)slopes;
        double half[3][3 * STRAIN_MAX_SLOPES] = {{0}}; /* r_a' H */
        for (int p = 0; p < slopes; p++) {
            for (int d = 0; d < 3; d++) {
                const double *from = h + (size_t)(3 * p + d) * (size_t)size;
                for (int j = 0; j < size; j++) {
                    half[d][j] += row_a[p] * from[j];
                }
            }
        }
        for (int b = s->start[sample]; b <= a; b++, place++) {
            if (place->base < 0) {
                continue;
            }
            const double *row_b = s->row + (size_t)b * (size_t)slopes;
            double block[9] = {0};
            for (int q = 0; q < slopes; q++) {
                for (int r = 0; r < 3; r++) {
                    for (int c = 0; c < 3; c++) {
                        block[3 * r + c] += half[r][3 * q + c] * row_b[q];
                    }
                }
            }
            block_add(values, *place, block);
        }
    }
}

FIXED_SIZES add_hessian(const StrainSamples *s, const double *x, const double *sigma, bool definite,
                        int slopes, int strains, double *values) {
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v;
        double h[9 * STRAIN_MAX_SLOPES * STRAIN_MAX_SLOPES];
        slopes_of(s, i, x, v);
        slope_hessian(s, i, v, sigma + (size_t)i * (size_t)strains, definite, slopes, strains, h);
        add_blocks(s, i, h, slopes, values);
    }
}

void strain_add_hessian(const StrainSamples *samples, const double *x, const double *stress,
                        bool definite, double *values) {
    if (samples->kind == &strain_lattice) {
        add_hessian(samples, x, stress, definite, 3, 5, values);
    } else if (samples->kind == &strain_triangle) {
        add_hessian(samples, x, stress, definite, 2, 3, values);
    } else {
        add_hessian(samples, x, stress, definite, 5, 9, values);
    }
}
