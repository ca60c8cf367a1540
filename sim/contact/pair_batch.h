/* pair_batch.h: closest points of many pairs at once, in row loops that vectorise. The same bits as
 * pair_evaluate for every width. */
#ifndef TOILE_CONTACT_PAIR_BATCH_H
#define TOILE_CONTACT_PAIR_BATCH_H

#include "sim/base/vector.h"
#include "sim/contact/lists.h"

#define PAIR_VECTOR 8 /* the widest */
#define PAIR_BATCH 32 /* a multiple of it; both kinds stay in the first cache */

/* Pairs of one kind as one row per number. */
typedef struct PairRows {
    double x[4][3][PAIR_BATCH];   /* [m] in: the places */
    double weight[4][PAIR_BATCH]; /* out, as in Pair */
    double normal[3][PAIR_BATCH];
    double distance[PAIR_BATCH];
    double soft[PAIR_BATCH];    /* of edges */
    double feature[PAIR_BATCH]; /* a whole number */
} PairRows;

/* What is compiled for one vector width; works on the first `vectors` x PAIR_VECTOR pairs. */
typedef struct PairKernel {
    void (*faces)(PairRows *rows, int vectors);
    void (*edges)(PairRows *rows, int vectors);
} PairKernel;

extern const PairKernel pair_kernel_scalar, pair_kernel_sse2, pair_kernel_avx2, pair_kernel_avx512;

typedef struct PairBatch {
    const PairKernel *kernel;
    int count[2];               /* waiting, of each kind */
    Pair *pairs[2][PAIR_BATCH]; /* likewise */
    PairRows rows[2];
} PairBatch;

/* Nothing waits. `width` is one that runs here. */
void pair_batch_begin(PairBatch *batch, VectorWidth width);

/* The pair waits, at the positions of now; it may be evaluated, with others, at any call. */
void pair_batch_add(PairBatch *batch, const Points *points, Pair *pair);

/* Evaluates all that wait. */
void pair_batch_end(PairBatch *batch);

#endif
