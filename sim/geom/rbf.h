/* rbf.h: augmented radial basis functions on scattered points: interpolation rows.
 *
 * Kernel r^power (polyharmonic: no shape parameter) plus all polynomials up to `degree`, on the
 * stencil nearest to a place, scaled by the spacing. A row interpolates: it gives
 * 1 at its own node and reproduces polynomials of `degree` to round-off.
 * Source: augmented RBF of Yuan et al. 2008, section 3, with the corrections of mlpg.md. */
#ifndef TOILE_GEOM_RBF_H
#define TOILE_GEOM_RBF_H

#include "sim/geom/points.h"

typedef struct RbfKind {
    int power;  /* 3, 5 or 7 */
    int degree; /* 2 or 3 */
    int nodes;  /* least number in a stencil */
} RbfKind;

extern const RbfKind rbf_lattice_edge;       /* r^3, quadratic, 8: slopes on lattice edges */
extern const RbfKind rbf_scattered_edge;     /* r^5, quadratic, 12: slopes on scattered edges */
extern const RbfKind rbf_resample;           /* r^5, quadratic, 16: drawing the surface */
extern const RbfKind rbf_scattered_membrane; /* r^7, cubic, 24: values on scattered edges */

typedef enum RbfFunctional { RBF_VALUE, RBF_D1, RBF_D2, RBF_D11, RBF_D12, RBF_D22 } RbfFunctional;
#define RBF_FUNCTIONAL_COUNT 6

/* The stencil around a place with its factorised system. */
typedef struct RbfStencil {
    RbfKind kind;
    int count; /* nodes */
    int nodes[STENCIL_CAPACITY];
    double centre[2], scale; /* scaled coordinates: (x - centre) / scale */
    double local[2 * STENCIL_CAPACITY];
    double inverse_size; /* smallest singular value of the polynomial block */
    double *matrix;      /* factors, in the arena given to rbf_stencil */
    int *pivots;
} RbfStencil;

/* Chooses nodes around `centre` (adding distance shells until the polynomial block is well
 * conditioned) and factorises. When even all nodes do not determine the polynomials (few nodes,
 * or nodes on two lines), the degree is lowered: see kind. Memory is the arena's. */
RbfStencil rbf_stencil(const PointGrid *grid, RbfKind kind, const double centre[2], Arena *arena);

/* weights[f][i]: weight of stencil node i in functional f at `at`. */
void rbf_rows(const RbfStencil *stencil, const double at[2], int functional_count,
              const RbfFunctional *functionals, double (*weights)[STENCIL_CAPACITY]);

#endif
