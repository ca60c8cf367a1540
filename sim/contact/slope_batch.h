/* slope_batch.h: where some blocks of a lattice are and how their gradients differ (slopes.h), in row
 * loops that vectorise; the same bits for every width. */
#ifndef TOILE_CONTACT_SLOPE_BATCH_H
#define TOILE_CONTACT_SLOPE_BATCH_H

#include "sim/base/vector.h"
#include "sim/contact/surface.h"

#define SLOPE_BATCH 8                   /* blocks: the widest vector */
#define SLOPE_NODES (SURFACE_BLOCK + 1) /* along a side of a block */

/* One number of all blocks. */
typedef double SlopeRow[SLOPE_BATCH];

/* The nodes of a lattice: node n is at x[0 .. 2][slot[n]] [m]. */
typedef struct SlopeNodes {
    double h[2]; /* [m] size of a cell */
    const int *slot;
    double *const *x;
} SlopeNodes;

/* Of blocks, as Slopes. */
typedef struct SlopeValues {
    SlopeRow mean[2][3];  /* of dx/du, dx/dv */
    SlopeRow normal[3];   /* unit vector across both */
    SlopeRow flat, steep; /* largest difference from the mean within the plane, across it */
} SlopeValues;

typedef struct SlopeRows {
    /* in: first node of a row of a block, and how far the nodes of its columns are from there; past a side
     * the last one again */
    int row[SLOPE_NODES][SLOPE_BATCH], column[SLOPE_NODES][SLOPE_BATCH];
    SlopeRow cells[2];        /* in: 1 .. SURFACE_BLOCK along u, v */
    SlopeRow low[3], high[3]; /* [m] out: box of the nodes */
    SlopeValues slopes;       /* out */
} SlopeRows;

#define SLOPE_PARTS 4 /* of a block of the next coarser level */

typedef struct SlopeJoin {
    SlopeValues part[SLOPE_PARTS]; /* in: some may be the same */
    SlopeValues all;               /* out: of all parts at once */
} SlopeJoin;

typedef struct SlopeKernel {
    void (*fit)(const SlopeNodes *nodes, SlopeRows *rows);
    void (*join)(SlopeJoin *join);
} SlopeKernel;

extern const SlopeKernel slope_kernel_scalar, slope_kernel_sse2, slope_kernel_avx2,
    slope_kernel_avx512;

#endif
