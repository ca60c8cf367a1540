/* block_matrix.h: symmetric sparse matrices of 3 x 3 blocks, one block row per node.
 *
 * Only the lower triangle is stored, in the layout that the factorisation reads (compressed
 * scalar columns, nodes already in elimination order), so that assembly writes straight into
 * what is factorised. The pattern is made once; values change with every iteration.
 */
#ifndef TOILE_SOLVE_BLOCK_MATRIX_H
#define TOILE_SOLVE_BLOCK_MATRIX_H

#include <stdbool.h>

#include "sim/base/arena.h"

typedef struct BlockMatrix {
    int node_count;
    int *order;        /* (node_count) place of each node in elimination order */
    int *column_start; /* (node_count + 1) blocks of each column, in elimination order */
    int *row;          /* block rows, rising within a column; the diagonal block is first */
    int *scalar_start; /* (3 node_count + 1) */
    int *scalar_row;   /* (9 * blocks) */
    double *values;    /* [N/m] (9 * blocks) */
} BlockMatrix;

/* Where a block lies in values: entry (r, c) at base + c * stride + r; transposed when
 * stride < 0: entry (r, c) at base + r * -stride + c. */
typedef struct BlockPlace {
    int base, stride;
} BlockPlace;

/* `pairs`: (pair_count x 2) node pairs that may be coupled, in any order and number; the
 * diagonal is always there. Finds a fill-reducing order (nested dissection). */
BlockMatrix block_matrix_create(int node_count, const int *pairs, int pair_count, Arena *arena);

/* The place of block (row, column); must be in the pattern. */
BlockPlace block_matrix_place(const BlockMatrix *matrix, int row, int column);
/* The same; false when it is not in the pattern. */
bool block_matrix_find(const BlockMatrix *matrix, int row, int column, BlockPlace *place);

/* The nodes of one element; those from `limit` on are not solved for (ghosts). Appends their pairs to
 * `pairs` (NULL: only counts) and returns how many. */
int block_pairs(const int *nodes, int count, int limit, int *pairs);
/* The places of its blocks, lower triangle row by row, with nodes counted from `first`; base -1 where a
 * node is not solved for. Returns how many: count (count + 1) / 2. */
int block_places(const BlockMatrix *matrix, const int *nodes, int count, int limit, int first,
                 BlockPlace *places);

int block_matrix_block_count(const BlockMatrix *matrix);

static inline void block_add(double *values, BlockPlace place, const double block[9]) {
    double *v = values + place.base;
    if (place.stride > 0) {
        for (int c = 0; c < 3; c++) {
            for (int r = 0; r < 3; r++) {
                v[c * place.stride + r] += block[3 * r + c];
            }
        }
    } else {
        for (int c = 0; c < 3; c++) {
            for (int r = 0; r < 3; r++) {
                v[r * -place.stride + c] += block[3 * r + c];
            }
        }
    }
}

static inline void block_add_diagonal(double *values, BlockPlace place, double d) {
    int stride = place.stride > 0 ? place.stride : -place.stride;
    for (int c = 0; c < 3; c++) {
        values[place.base + c * (stride + 1)] += d;
    }
}

/* y = A x in node order; x, y: (node_count x 3). */
void block_matrix_multiply(const BlockMatrix *matrix, const double *x, double *y);

#endif
