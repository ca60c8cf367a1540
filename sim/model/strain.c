#include "sim/model/strain.h"

#include <math.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/parallel.h"
#include "sim/base/quad.h"

#define ENERGY_GRAIN 256 /* samples a thread takes at once, some 10 us */

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

typedef Quad Slopes[STRAIN_MAX_SLOPES];

/* What loops over slopes and strains is made once for each kind, which is then a constant: the loops
 * unroll and cost half. */
#define FOR_ONE_KIND static inline __attribute__((always_inline)) void
#define BY_KIND(function, samples, ...)                                                            \
    do {                                                                                           \
        if ((samples)->kind == &strain_lattice) {                                                  \
            function(samples, &strain_lattice, __VA_ARGS__);                                       \
        } else if ((samples)->kind == &strain_triangle) {                                          \
            function(samples, &strain_triangle, __VA_ARGS__);                                      \
        } else {                                                                                   \
            function(samples, &strain_scattered, __VA_ARGS__);                                     \
        }                                                                                          \
    } while (0)

FOR_ONE_KIND slopes_of(const StrainSamples *s, const StrainKind *kind, int sample, const double *x,
                       Slopes v) {
    int slopes = kind->slope_count;
    for (int p = 0; p < slopes; p++) {
        v[p] = (Quad){0};
    }
    for (int k = s->start[sample]; k < s->start[sample + 1]; k++) {
        const double *node = x + 3 * (size_t)s->node[k], *row = s->row + (size_t)k * (size_t)slopes;
        Quad at = {node[0], node[1], node[2], 0.0};
        for (int p = 0; p < slopes; p++) {
            v[p] += row[p] * at;
        }
    }
}

/* quadratic part of the strains (without the rest values) */
FOR_ONE_KIND quadratic_strains(const StrainKind *kind, Slopes v, double *strain) {
    for (int k = 0; k < kind->strain_count; k++) {
        strain[k] = 0.0;
        for (int t = 0; t < 2 && kind->terms[k][t].c != 0.0; t++) {
            Quad product = v[kind->terms[k][t].p] * v[kind->terms[k][t].q];
            strain[k] += kind->terms[k][t].c * (product[0] + product[1] + product[2]);
        }
    }
}

FOR_ONE_KIND stress_of(const StrainSamples *s, const StrainKind *kind, int sample,
                       const double *strain, double *stress) {
    stress[0] = s->c11 * strain[0] + s->c12 * strain[1];
    stress[1] = s->c12 * strain[0] + s->c22 * strain[1];
    stress[2] = s->c66 * strain[2];
    if (kind == &strain_triangle) {
        return;
    }
    const double *glass = s->hourglass + 3 * (size_t)sample;
    if (kind == &strain_lattice) {
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
    stress_of(s, s->kind, sample, strain, stress);
}

typedef struct EnergyJob {
    const StrainSamples *samples;
    const double *x;
} EnergyJob;

/* [J] of samples */
QUADS static void energy_terms(int first, int end, const void *context, double *out) {
    const EnergyJob *job = context;
    const StrainSamples *s = job->samples;
    for (int i = first; i < end; i++) {
        Slopes v;
        double strain[STRAIN_MAX_STRAINS] = {0}, stress[STRAIN_MAX_STRAINS] = {0}, density = 0.0;
        slopes_of(s, s->kind, i, job->x, v);
        sample_state(s, i, v, strain, stress);
        for (int k = 0; k < s->kind->strain_count; k++) {
            density += 0.5 * strain[k] * stress[k];
        }
        out[i - first] = s->area[i] * density;
    }
}

double strain_energy(const StrainSamples *s, const double *x) {
    EnergyJob job = {s, x};
    return parallel_sum(0.0, s->sample_count, ENERGY_GRAIN, energy_terms, &job);
}

/* the stress that multiplies d(Green strain) */
FOR_ONE_KIND green_stress(const StrainSamples *s, const StrainKind *kind, int sample, Slopes v,
                          double *stress) {
    double strain[STRAIN_MAX_STRAINS] = {0}, u[3];
    quadratic_strains(kind, v, strain);
    for (int k = 0; k < kind->strain_count; k++) {
        strain[k] -= kind->rest[k];
    }
    if (!s->corotational) {
        stress_of(s, kind, sample, strain, stress);
        return;
    }
    corotational_strains(strain, u);
    stress_of(s, kind, sample, strain, stress);
    corotational_stress(u, stress);
}

FOR_ONE_KIND add_gradient(const StrainSamples *s, const StrainKind *kind, const double *x,
                          double *gradient) {
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v, g = {{0}};
        double stress[STRAIN_MAX_STRAINS];
        slopes_of(s, kind, i, x, v);
        green_stress(s, kind, i, v, stress);
        for (int k = 0; k < kind->strain_count; k++) {
            for (int t = 0; t < 2 && kind->terms[k][t].c != 0.0; t++) {
                int p = kind->terms[k][t].p, q = kind->terms[k][t].q;
                double factor = s->area[i] * stress[k] * kind->terms[k][t].c;
                g[p] += factor * v[q];
                g[q] += factor * v[p];
            }
        }
        for (int k = s->start[i]; k < s->start[i + 1]; k++) {
            double *out = gradient + 3 * (size_t)s->node[k];
            const double *row = s->row + (size_t)k * (size_t)kind->slope_count;
            Quad sum = row[0] * g[0];
            for (int p = 1; p < kind->slope_count; p++) {
                sum += row[p] * g[p];
            }
            out[0] += sum[0], out[1] += sum[1], out[2] += sum[2];
        }
    }
}

QUADS void strain_add_gradient(const StrainSamples *samples, const double *x, double *gradient) {
    BY_KIND(add_gradient, samples, x, gradient);
}

FOR_ONE_KIND find_stress(const StrainSamples *s, const StrainKind *kind, const double *x,
                         double *stress) {
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v;
        slopes_of(s, kind, i, x, v);
        green_stress(s, kind, i, v, stress + (size_t)i * (size_t)kind->strain_count);
    }
}

QUADS void strain_stress(const StrainSamples *samples, const double *x, double *stress) {
    BY_KIND(find_stress, samples, x, stress);
}

FOR_ONE_KIND predict_stress(const StrainSamples *s, const StrainKind *kind, const double *x_new,
                            const double *dx, double *stress) {
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v, dv;
        double strain[STRAIN_MAX_STRAINS] = {0}, quadratic[STRAIN_MAX_STRAINS] = {0};
        slopes_of(s, kind, i, x_new, v);
        slopes_of(s, kind, i, dx, dv);
        quadratic_strains(kind, v, strain);
        quadratic_strains(kind, dv, quadratic);
        for (int k = 0; k < kind->strain_count; k++) {
            strain[k] -= kind->rest[k] + quadratic[k];
        }
        stress_of(s, kind, i, strain, stress + (size_t)i * (size_t)kind->strain_count);
    }
}

QUADS void strain_predict_stress(const StrainSamples *samples, const double *x_new,
                                 const double *dx, double *stress) {
    BY_KIND(predict_stress, samples, x_new, dx, stress);
}

int strain_couple(const StrainSamples *s, int *pairs) {
    int count = 0;
    for (int i = 0; i < s->sample_count; i++) {
        count += block_pairs(s->node + s->start[i], s->start[i + 1] - s->start[i], s->node_limit,
                             pairs ? pairs + 2 * count : NULL);
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
    for (int i = 0; i < s->sample_count; i++) {
        block_places(matrix, s->node + s->start[i], s->start[i + 1] - s->start[i], s->node_limit,
                     first, s->places + s->place_start[i]);
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

/* A 3 x 3 block, row-major, and a free place: whole vectors of two. */
typedef double PaddedBlock[10];
enum { PADDED = 10 };

/* B'CB + geometric part in slope space: block (p, q) of h couples slopes p and q */
FOR_ONE_KIND slope_hessian(const StrainSamples *s, const StrainKind *kind, int sample, Slopes v,
                           const double *sigma, bool definite,
                           PaddedBlock h[STRAIN_MAX_SLOPES][STRAIN_MAX_SLOPES]) {
    const int slopes = kind->slope_count, strains = kind->strain_count;
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
    for (int j = 0; j < 3 * slopes; j++) {
        double column[STRAIN_MAX_STRAINS];
        for (int k = 0; k < strains; k++) {
            column[k] = b[k][j];
        }
        stress_of(s, kind, sample, column, cb[j]);
    }
    double area = s->area[sample];
    for (int p = 0; p < slopes; p++) {
        for (int q = 0; q <= p; q++) {
            for (int d = 0; d < 9; d++) {
                double sum = d % 4 == 0 ? g[p][q] : 0.0;
                for (int k = 0; k < strains; k++) {
                    sum += b[k][3 * p + d / 3] * cb[3 * q + d % 3][k];
                }
                h[p][q][d] = h[q][p][3 * (d % 3) + d / 3] = area * sum;
            }
            h[p][q][9] = h[q][p][9] = 0.0;
        }
    }
}

/* blocks r_a' H r_b of all pairs of one sample's nodes */
FOR_ONE_KIND add_blocks(const StrainSamples *s, int sample,
                        PaddedBlock h[STRAIN_MAX_SLOPES][STRAIN_MAX_SLOPES], int slopes,
                        double *values) {
    const BlockPlace *place = s->places + s->place_start[sample];
    for (int a = s->start[sample]; a < s->start[sample + 1]; a++) {
        const double *row_a = s->row + (size_t)a * (size_t)slopes;
        PaddedBlock half[STRAIN_MAX_SLOPES]; /* r_a' H */
        for (int q = 0; q < slopes; q++) {
            for (int d = 0; d < PADDED; d++) {
                double sum = row_a[0] * h[0][q][d];
                for (int p = 1; p < slopes; p++) {
                    sum += row_a[p] * h[p][q][d];
                }
                half[q][d] = sum;
            }
        }
        for (int b = s->start[sample]; b <= a; b++, place++) {
            if (place->base < 0) {
                continue;
            }
            const double *row_b = s->row + (size_t)b * (size_t)slopes;
            PaddedBlock block;
            for (int d = 0; d < PADDED; d++) {
                double sum = row_b[0] * half[0][d];
                for (int q = 1; q < slopes; q++) {
                    sum += row_b[q] * half[q][d];
                }
                block[d] = sum;
            }
            block_add(values, *place, block);
        }
    }
}

FOR_ONE_KIND add_hessian(const StrainSamples *s, const StrainKind *kind, const double *x,
                         const double *sigma, bool definite, double *values) {
    for (int i = 0; i < s->sample_count; i++) {
        Slopes v;
        PaddedBlock h[STRAIN_MAX_SLOPES][STRAIN_MAX_SLOPES];
        const double *stress = sigma + (size_t)i * (size_t)kind->strain_count;
        slopes_of(s, kind, i, x, v);
        slope_hessian(s, kind, i, v, stress, definite, h);
        add_blocks(s, i, h, kind->slope_count, values);
    }
}

QUADS void strain_add_hessian(const StrainSamples *samples, const double *x, const double *stress,
                              bool definite, double *values) {
    BY_KIND(add_hessian, samples, x, stress, definite, values);
}
