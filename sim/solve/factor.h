/* factor.h: Cholesky factorisation of block matrices (CHOLMOD, supernodal). */
#ifndef TOILE_SOLVE_FACTOR_H
#define TOILE_SOLVE_FACTOR_H

#include "sim/solve/block_matrix.h"

typedef struct Factor Factor; /* defined in factor_cholmod.c */

typedef enum FactorStatus {
    FACTOR_OK,
    FACTOR_NOT_POSITIVE_DEFINITE, /* the caller changes the matrix and tries again */
    FACTOR_OUT_OF_MEMORY
} FactorStatus;

/* Nested-dissection order of the nodes for a graph given as pairs: order[node] = place. */
void factor_order(int node_count, const int *pairs, int pair_count, int *order);

/* Symbolic analysis of the matrix's pattern; done once per layout. */
Factor *factor_create(const BlockMatrix *matrix);
FactorStatus factor_numeric(Factor *factor, const BlockMatrix *matrix);

/* Solves A x = b with the last good numeric factor; b, x: (node_count x 3), may be equal. */
void factor_solve(Factor *factor, const BlockMatrix *matrix, const double *b, double *x);
void factor_free(Factor *factor);

double factor_nonzeros(const Factor *factor); /* of L */
const char *factor_version(void);             /* "SuiteSparse 5.12.0, CHOLMOD 3.0.14" */

#endif
