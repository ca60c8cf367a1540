/* rest_batch.h: forces on vertices over one flat face of a solid that stands still, in row loops that
 * vectorise: the same law as for any touch (force.h), the same bits for every width. */
#ifndef TOILE_CONTACT_REST_BATCH_H
#define TOILE_CONTACT_REST_BATCH_H

#include "sim/base/vec.h"
#include "sim/base/vector.h"

#define REST_VECTOR 8 /* the widest */
#define REST_BATCH 32 /* a multiple of it */

/* Vertices as one row per number. */
typedef struct RestRows {
    double distance[REST_BATCH];    /* [m] in */
    double mass[REST_BATCH];        /* [kg] in */
    double v[3][REST_BATCH];        /* [m/s] in */
    double bristle[3][REST_BATCH];  /* [m] in and out */
    double friction[3][REST_BATCH]; /* [N] out */
    double total[REST_BATCH];       /* [N] out, along the normal */
    double damping[REST_BATCH];     /* [N] out, its part by damping */
    double stiffness[REST_BATCH];   /* [N/m] out */
    double approach[REST_BATCH];    /* [m/s] out */
} RestRows;

/* What they have in common. */
typedef struct RestFace {
    double normal[3];
    double dhat;         /* [m] contact distance */
    double friction;     /* mu */
    double stiffness;    /* of the law, share of m / dt^2 */
    double dt, share_dt; /* [s] step, kick */
} RestFace;

/* Works on the first `vectors` x REST_VECTOR vertices; without a force beyond dhat. */
typedef void RestKernel(const RestFace *face, RestRows *rows, int vectors);

extern RestKernel *const rest_kernel_scalar, *const rest_kernel_sse2, *const rest_kernel_avx2,
                                                                          *const rest_kernel_avx512;

#endif
