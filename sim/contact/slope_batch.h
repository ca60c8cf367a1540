/* slope_batch.h: where some blocks of a lattice are and how their gradients differ (slopes.h), in row
 * loops that vectorise; the same bits for every width. */
#ifndef TOILE_CONTACT_SLOPE_BATCH_H
#define TOILE_CONTACT_SLOPE_BATCH_H

#include "sim/base/vector.h"
#include "sim/contact/slopes.h"
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

/* Column `at` is that rectangle of cells of a lattice, at most SURFACE_BLOCK along each side. */
static inline void slope_rows_place(SlopeRows *rows, int at, const SurfacePanel *panel,
                                    const int first[2], const int cells[2]) {
    rows->cells[0][at] = cells[0], rows->cells[1][at] = cells[1];
    for (int k = 0; k < SLOPE_NODES; k++) {
        int i = first[0] + (k < cells[0] ? k : cells[0]);
        rows->column[k][at] = i < panel->nu ? i : i - panel->nu;
        rows->row[k][at] = (first[1] + (k < cells[1] ? k : cells[1])) * panel->nu;
    }
}

/* of block k */
static inline Slopes slope_values_at(const SlopeValues *from, int k) {
    const SlopeRow *u = from->mean[0], *v = from->mean[1], *n = from->normal;
    return (Slopes){.mean = {{u[0][k], u[1][k], u[2][k]}, {v[0][k], v[1][k], v[2][k]}},
                    .normal = {n[0][k], n[1][k], n[2][k]},
                    .flat = from->flat[k],
                    .steep = from->steep[k]};
}

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
