/* strain.h: energies that are quadratic forms of strains, which are themselves quadratic in x.
 *
 * A sample has a few *slopes*: linear rows over its nodes, v_p = sum_I r_pI x_I (3-vectors).
 * Every strain is bilinear in slopes,   s_k = sum over terms c (v_p . v_q) - s0_k,
 * and the energy is  W = A/2 s' C s.  Lattice samples (mlpg.md): slopes F1, F2 and the twist
 * k12; strains E11, E22, g12 and the two hourglass strains F1.k12, F2.k12. Scattered samples:
 * slopes F1, F2, k11, k12, k22; strains E11, E22, g12 and the six gradients E_ab,c. Triangles:
 * slopes F1, F2; strains E11, E22, g12.
 */
#ifndef TOILE_MODEL_STRAIN_H
#define TOILE_MODEL_STRAIN_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/solve/block_matrix.h"

#define STRAIN_MAX_SLOPES 5
#define STRAIN_MAX_STRAINS 9

typedef struct StrainKind {
    int slope_count, strain_count;
    struct {
        int p, q;
        double c;
    } terms[STRAIN_MAX_STRAINS][2]; /* the second has c = 0 when there is only one */
    double rest[STRAIN_MAX_STRAINS];
} StrainKind;

extern const StrainKind strain_lattice, strain_scattered, strain_triangle;

typedef struct StrainSamples {
    const StrainKind *kind;
    int sample_count;
    int *start;                /* (sample_count + 1) */
    int *node;                 /* (start[sample_count]) */
    double *row;               /* (start[sample_count] x slope_count) [1/m], [1/m2] */
    double *area;              /* [m2] (sample_count) */
    double c11, c12, c22, c66; /* [N/m] membrane */
    double *hourglass;         /* [N/m ...] (sample_count x 3): lattice: k_h A/12, 0, 0;
                            scattered: k_h times the second moments M11, M12, M22 [m2];
                            triangles: NULL */
    bool corotational;         /* membrane stress from U - I instead of (F'F - I)/2 */
    int node_limit;            /* nodes from here on are ghosts: no Hessian */
    BlockPlace *places;        /* lower pairs of every sample, in order (see strain_bind) */
    int *place_start;          /* (sample_count + 1) */
} StrainSamples;

double strain_energy(const StrainSamples *samples, const double *x);
void strain_add_gradient(const StrainSamples *samples, const double *x, double *gradient);
void strain_stress(const StrainSamples *samples, const double *x, double *stress);
void strain_predict_stress(const StrainSamples *samples, const double *x_new, const double *dx,
                           double *stress);
int strain_couple(const StrainSamples *samples, int *pairs);
void strain_bind(StrainSamples *samples, const BlockMatrix *matrix, int first, Arena *arena);
void strain_add_hessian(const StrainSamples *samples, const double *x, const double *stress,
                        bool definite, double *values);

#endif
