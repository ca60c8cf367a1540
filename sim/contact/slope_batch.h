/* slope_batch.h: where the blocks of a lattice are and how their gradients differ (slopes.h), in row loops
 * that vectorise; the same bits for every width. Numbers are floats: nodes count from an origin near them, and
 * what bounds gradients is wider by SLOPE_ROUNDING of what it is made of. */
#ifndef TOILE_CONTACT_SLOPE_BATCH_H
#define TOILE_CONTACT_SLOPE_BATCH_H

#include "sim/base/vector.h"
#include "sim/contact/slopes.h"
#include "sim/contact/surface.h"

#define SLOPE_BATCH 16                  /* blocks: the widest vector of floats */
#define SLOPE_NODES (SURFACE_BLOCK + 1) /* along a side of a block */
#define SLOPE_PARTS 4                   /* 2 x 2 blocks */
#define SLOPE_ROUNDING 1e-6f            /* some 16 roundings of 2^-24 */

/* One number of all blocks. */
typedef float SlopeRow[SLOPE_BATCH];

/* Slopes of many blocks, as rows of numbers: mean (6, du before dv), normal (3), flat, steep. */
#define SLOPE_MEAN 0
#define SLOPE_NORMAL 6
#define SLOPE_FLAT 9
#define SLOPE_STEEP 10
#define SLOPE_ROWS 11
typedef struct SlopeField {
    float *row[SLOPE_ROWS];
} SlopeField;

/* The blocks at .. at + SLOPE_BATCH - 1 of those that the pointers lead to. */
typedef struct SlopeFit {
    double h[2];      /* [m] in: size of a cell */
    double origin[3]; /* [m] in: of the nodes */
    int at;
    /* [m] in: each node of a block along v and u, from the origin on; past a side the last one again */
    const float *node[SLOPE_NODES][SLOPE_NODES][3];
    const float *cells[2];       /* in: 1 .. SURFACE_BLOCK along u, v */
    double low[3][SLOPE_BATCH];  /* [m] out: box of the nodes */
    double high[3][SLOPE_BATCH]; /* [m] ... */
    SlopeField slopes;           /* out */
} SlopeFit;

/* Blocks taken from anywhere in a lattice. */
typedef struct SlopeBlocks {
    SlopeRow node[SLOPE_NODES][SLOPE_NODES][3], cells[2], slopes[SLOPE_ROWS];
} SlopeBlocks;

/* The blocks of `fit` are these, all of them empty. */
void slope_blocks_begin(SlopeBlocks *blocks, SlopeFit *fit);

/* (room) of every row */
SlopeField slope_field_create(int room, Arena *arena);

static inline Slopes slope_field_at(const SlopeField *field, int block) {
    double n[SLOPE_ROWS];
    for (int r = 0; r < SLOPE_ROWS; r++) {
        n[r] = (double)field->row[r][block];
    }
    return (Slopes){.mean = {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}},
                    .normal = {n[SLOPE_NORMAL], n[SLOPE_NORMAL + 1], n[SLOPE_NORMAL + 2]},
                    .flat = n[SLOPE_FLAT],
                    .steep = n[SLOPE_STEEP]};
}

typedef struct SlopeKernel {
    /* out[c][b] = x[3 b + c] - origin, for `count` b: the columns of blocks that follow each other */
    void (*pack)(const double *x, double origin, int count, float *const out[SURFACE_BLOCK]);
    void (*fit)(SlopeFit *fit);
    /* Block at + k of `out` is one of four: 2 k and 2 k + 1 from `low` and from `high` on; k < SLOPE_BATCH. */
    void (*join)(const SlopeField *fine, int low, int high, const SlopeField *out, int at);
    /* least[at + k]: s_min(P C) - e over block at + k, the next one, and those `pitch` after both, likewise. */
    void (*window)(const SlopeField *field, int pitch, int at, float *least);
} SlopeKernel;

extern const SlopeKernel slope_kernel_scalar, slope_kernel_sse2, slope_kernel_avx2,
    slope_kernel_avx512;

#endif
