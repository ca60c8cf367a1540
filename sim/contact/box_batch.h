/* box_batch.h: where many triangles come nearest to boxes, in row loops that vectorise. The same bits as
 * solid_nearest_on_triangle for every width. */
#ifndef TOILE_CONTACT_BOX_BATCH_H
#define TOILE_CONTACT_BOX_BATCH_H

#include <stdbool.h>

#include "sim/base/vector.h"
#include "sim/geom/solid.h"

#define BOX_VECTOR 8 /* the widest */
#define BOX_BATCH 32 /* a multiple of it; stays in the first cache */

/* One number of all triangles. */
typedef double BoxRow[BOX_BATCH];

/* Triangles and boxes, as in SolidNearest; everything in the frame of the box. */
typedef struct BoxRows {
    BoxRow x[3][3];         /* [m] in: the corners */
    BoxRow height[3];       /* [m] in: distances of them */
    BoxRow up[3][3];        /* in: normals there */
    BoxRow core[3], radius; /* [m] in: of the box, half its size without the rounding */
    BoxRow weight[3], point[3], normal[3], distance; /* out: of the nearest point */
    BoxRow feature, lower;                           /* out: a whole number; [m] */
    /* out: of the sides; nothing else is said of one whose distance is infinite */
    BoxRow side_at[3], side_distance[3], side_lower[3], side_normal[3][3];
    BoxRow within; /* out: 1 where a side ends within the core, of which nothing is said */
    /* in: is there a triangle across the border of a core? Below and above zero, along each axis */
    bool across[3][2];
} BoxRows;

/* Works on the first `vectors` x BOX_VECTOR triangles. */
typedef void BoxKernel(BoxRows *rows, int vectors);

extern BoxKernel *const box_kernel_scalar, *const box_kernel_sse2;
extern BoxKernel *const box_kernel_avx2, *const box_kernel_avx512;

typedef struct BoxBatch {
    BoxKernel *kernel;
    int count;                       /* waiting */
    const Solid *boxes[BOX_BATCH];   /* of those */
    SolidNearest nearest[BOX_BATCH]; /* of those that were solved last */
    BoxRows rows;
} BoxBatch;

/* Nothing waits. `width` is one that runs here. */
void box_batch_begin(BoxBatch *batch, VectorWidth width);

/* Corner k of the next triangle, with its distance from the box and the normal there. */
void box_batch_set(BoxBatch *batch, int k, Vec3 x, double distance, Vec3 normal);

/* That triangle waits at this box; at most BOX_BATCH may. Returns how many do. */
int box_batch_add(BoxBatch *batch, const Solid *box);

/* Finds where all that wait come nearest; then nothing waits. Returns how many did. */
int box_batch_solve(BoxBatch *batch);

/* The corners of one that was solved last. */
void box_batch_corners(BoxBatch *batch, int k, Vec3 x[3]);

#endif
