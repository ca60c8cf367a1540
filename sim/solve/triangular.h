/* triangular.h: solves with one sparse symmetric positive definite matrix, again and again: its
 * Cholesky factor as plain columns in an arena. For constant matrices of a model's own. */
#ifndef TOILE_SOLVE_TRIANGULAR_H
#define TOILE_SOLVE_TRIANGULAR_H

#include <stdbool.h>

#include "sim/base/arena.h"

typedef struct Triangular {
    int count;
    int *order;    /* (count) which unknown is eliminated at each place */
    int *start;    /* (count + 1) columns of L; the diagonal comes first */
    int *row;      /* (start[count]) */
    double *value; /* (start[count]) */
    double *work;  /* (count) */
} Triangular;

/* One entry of the lower triangle; those of the same place are summed. */
typedef struct TriangularEntry {
    int row, column; /* row >= column */
    double value;
} TriangularEntry;

/* False: the matrix is not positive definite. */
bool triangular_create(int count, const TriangularEntry *entries, int entry_count, Arena *arena,
                       Triangular *out);

/* b (count) becomes the solution. */
void triangular_solve(const Triangular *l, double *b);

#endif
