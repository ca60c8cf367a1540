#include "sim/contact/pair_batch.h"

void pair_batch_begin(PairBatch *batch, VectorWidth width) {
    static const PairKernel *const kernels[] = {&pair_kernel_scalar, &pair_kernel_sse2,
                                                &pair_kernel_avx2, &pair_kernel_avx512};
    batch->kernel = kernels[width];
    batch->count[PAIR_FACE] = batch->count[PAIR_EDGES] = 0;
}

static void evaluate(PairBatch *batch, PairKind kind) {
    PairRows *rows = &batch->rows[kind];
    int count = batch->count[kind], vectors = (count + PAIR_VECTOR - 1) / PAIR_VECTOR;
    for (int row = 0; row < 12; row++) { /* the last vector is worked on as a whole */
        double *x = rows->x[row / 3][row % 3];
        for (int k = count; k < vectors * PAIR_VECTOR; k++) {
            x[k] = 0.0;
        }
    }
    (kind == PAIR_FACE ? batch->kernel->faces : batch->kernel->edges)(rows, vectors);
    for (int k = 0; k < count; k++) {
        Pair *pair = batch->pairs[kind][k];
        for (int a = 0; a < 4; a++) {
            pair->weight[a] = rows->weight[a][k];
        }
        pair->feature = (int)rows->feature[k];
        pair->soft = kind == PAIR_FACE ? 1.0 : rows->soft[k];
        pair->distance = rows->distance[k];
        if (pair->distance > 0.0) {
            pair->normal = vec3(rows->normal[0][k], rows->normal[1][k], rows->normal[2][k]);
        }
    }
    batch->count[kind] = 0;
}

void pair_batch_add(PairBatch *batch, const Points *points, Pair *pair) {
    int k = batch->count[pair->kind]++;
    PairRows *rows = &batch->rows[pair->kind];
    batch->pairs[pair->kind][k] = pair;
    for (int a = 0; a < 4; a++) {
        Vec3 x = point_at(points, pair->place[a]);
        rows->x[a][0][k] = x.x, rows->x[a][1][k] = x.y, rows->x[a][2][k] = x.z;
    }
    if (k + 1 == PAIR_BATCH) {
        evaluate(batch, pair->kind);
    }
}

void pair_batch_end(PairBatch *batch) {
    for (PairKind kind = PAIR_FACE; kind <= PAIR_EDGES; kind++) {
        if (batch->count[kind] > 0) {
            evaluate(batch, kind);
        }
    }
}
