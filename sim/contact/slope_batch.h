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

typedef struct SlopeRows {
    SlopeRow x[SLOPE_NODES][SLOPE_NODES]
              [3];            /* [m] in: nodes along v, u; past a side the last ones again */
    SlopeRow cells[2];        /* in: 1 .. SURFACE_BLOCK along u, v */
    SlopeRow low[3], high[3]; /* [m] out: box of the nodes */
    SlopeRow mean[2][3];      /* out: of dx/du, dx/dv */
    SlopeRow normal[3];       /* out: unit vector across both */
    SlopeRow flat, steep; /* out: largest difference from the mean within the plane, across it */
} SlopeRows;

/* h: [m] size of a cell. */
typedef void SlopeKernel(const double h[2], SlopeRows *rows);

extern SlopeKernel *const slope_kernel_scalar,
    *const slope_kernel_sse2, *const slope_kernel_avx2, *const slope_kernel_avx512;

#endif
