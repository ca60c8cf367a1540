#include "sim/contact/box_batch.h"

#include <math.h>
#include <string.h>

static void clear(BoxBatch *batch) {
    batch->count = 0;
    memset(batch->rows.across, 0, sizeof batch->rows.across);
}

void box_batch_begin(BoxBatch *batch, VectorWidth width) {
    BoxKernel *const kernels[] = {box_kernel_scalar, box_kernel_sse2, box_kernel_avx2,
                                  box_kernel_avx512};
    batch->kernel = kernels[width];
    clear(batch);
}

static void put(BoxRow row[3], int at, Vec3 a) {
    row[0][at] = a.x, row[1][at] = a.y, row[2][at] = a.z;
}

static Vec3 get(BoxRow row[3], int at) { return vec3(row[0][at], row[1][at], row[2][at]); }

void box_batch_set(BoxBatch *batch, int k, Vec3 x, double distance, Vec3 normal) {
    put(batch->rows.x[k], batch->count, x);
    put(batch->rows.up[k], batch->count, normal);
    batch->rows.height[k][batch->count] = distance;
}

static void note_borders(BoxRows *rows, int at) {
    for (int a = 0; a < 3; a++) {
        double p = rows->x[0][a][at], q = rows->x[1][a][at], r = rows->x[2][a][at];
        double low = min2(min2(p, q), r), high = max2(max2(p, q), r), core = rows->core[a][at];
        rows->across[a][0] = rows->across[a][0] || (low <= -core && high >= -core);
        rows->across[a][1] = rows->across[a][1] || (low <= core && high >= core);
    }
}

int box_batch_add(BoxBatch *batch, const Solid *box) {
    int at = batch->count++;
    double r = box->radius;
    put(batch->rows.core, at, vec3(box->half.x - r, box->half.y - r, box->half.z - r));
    batch->rows.radius[at] = r;
    batch->boxes[at] = box;
    note_borders(&batch->rows, at);
    return batch->count;
}

/* the last vector is worked on as a whole: with the first triangle again */
static int fill(BoxRows *rows, int count) {
    int vectors = (count + BOX_VECTOR - 1) / BOX_VECTOR;
    BoxRow *in[] = {rows->x[0],  rows->x[1],  rows->x[2],   rows->up[0],
                    rows->up[1], rows->up[2], rows->height, rows->core};
    for (int k = count; k < vectors * BOX_VECTOR; k++) {
        for (int m = 0; m < 8; m++) {
            for (int a = 0; a < 3; a++) {
                in[m][a][k] = in[m][a][0];
            }
        }
        rows->radius[k] = rows->radius[0];
    }
    return vectors;
}

static void copy_found(BoxRows *rows, int k, SolidNearest *out) {
    out->feature = (int)rows->feature[k];
    for (int c = 0; c < 3; c++) {
        out->weight[c] = rows->weight[c][k];
    }
    out->point = get(rows->point, k), out->normal = get(rows->normal, k);
    out->distance = rows->distance[k], out->lower = rows->lower[k];
    for (int m = 0; m < 3; m++) {
        SolidSide *side = &out->side[m];
        side->distance = rows->side_distance[m][k];
        if (side->distance < INFINITY) {
            side->at = rows->side_at[m][k], side->lower = rows->side_lower[m][k];
            side->normal = get(rows->side_normal[m], k);
        }
    }
}

void box_batch_corners(BoxBatch *batch, int k, Vec3 x[3]) {
    for (int c = 0; c < 3; c++) {
        x[c] = get(batch->rows.x[c], k);
    }
}

static SolidNearest search_one(BoxRows *rows, int k, const Solid *box) {
    Vec3 x[3], up[3];
    double height[3];
    for (int c = 0; c < 3; c++) {
        x[c] = get(rows->x[c], k), up[c] = get(rows->up[c], k), height[c] = rows->height[c][k];
    }
    return solid_nearest_on_triangle(box, x, height, up);
}

int box_batch_solve(BoxBatch *batch) {
    BoxRows *rows = &batch->rows;
    int count = batch->count;
    if (count > 0) {
        batch->kernel(rows, fill(rows, count));
    }
    for (int k = 0; k < count; k++) {
        if (rows->within[k] > 0.0) {
            batch->nearest[k] = search_one(rows, k, batch->boxes[k]);
        } else {
            copy_found(rows, k, &batch->nearest[k]);
        }
    }
    clear(batch);
    return count;
}
