/* bending.h: quadratic (isometric) bending, W_b = 1/2 sum A D_abcd k_ab . k_cd with the vector
 * curvatures k_ab = G_ab x (mlpg.md). Rows are constant, so the whole energy is one constant
 * scalar matrix K that acts on x, y and z alike: W_b = 1/2 x' K x.
 *
 * Rest curvature k0 adds  - sum A (D k0)_ab n . k_ab + const  with n the unit normal of the
 * sample; its gradient is exact (n varies), its tangent is the Gauss-Newton form of
 * 1/2 A D |k - k0 n|^2: positive semidefinite, and exact at the rest shape.
 */
#ifndef TOILE_MODEL_BENDING_H
#define TOILE_MODEL_BENDING_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/solve/block_matrix.h"

/* One row entry: weights of a node in k11, k22, k12 [1/m2] and in the slopes F1, F2 [1/m]
 * (slopes are used only with rest curvature). */
typedef struct BendingEntry {
    int node;
    double g11, g22, g12, f1, f2;
} BendingEntry;

typedef struct BendingSamples {
    int sample_count, entry_count;
    int *start;            /* (sample_count + 1) */
    BendingEntry *entries; /* (entry_count) */
    double (*weight)[4];   /* [N m3] A D11, A D12, A D22, 4 A D66 of each sample */
} BendingSamples;

typedef struct Bending {
    int node_count;   /* ghosts included */
    int solved_count; /* nodes below this number are unknowns */
    int *start;       /* (node_count + 1) full rows of K */
    int *column;
    double *value;            /* [N/m] */
    struct BendingRest *rest; /* NULL: flat rest state; see bending_rest.h */
    BlockPlace *places;       /* of the lower entries, row after row */
} Bending;

/* `rest_curvature`: [1/m] along u and v, or NULL for a flat rest state. */
Bending bending_create(const BendingSamples *samples, int node_count, int solved_count,
                       const double rest_curvature[2], Arena *arena);

double bending_energy(const Bending *bending, const double *x);
void bending_add_gradient(const Bending *bending, const double *x, double *gradient);
/* only of the nodes that are no unknowns */
void bending_add_border_gradient(const Bending *bending, const double *x, double *gradient);
/* only the rest-curvature part, which the explicit sweep leaves out */
void bending_add_rest_gradient(const Bending *bending, const double *x, double *gradient);
int bending_couple(const Bending *bending, int *pairs);
void bending_bind(Bending *bending, const BlockMatrix *matrix, int first, Arena *arena);
/* x is used with rest curvature only */
void bending_add_hessian(const Bending *bending, const double *x, double *values);

#endif
