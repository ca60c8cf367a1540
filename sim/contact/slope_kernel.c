/* slope_kernel.c: the row loops of slope_batch.h. Compiled once per vector width (see the Makefile). */
#include "sim/contact/slope_batch.h"

#define LEAST_AREA 1e-100 /* [m2] below it any plane will do: nothing is proven by it */

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

static inline void bound(SlopeRows *rows, int a) {
    SlopeRow low, high;
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        low[i] = high[i] = rows->x[0][0][a][i];
    }
    for (int m = 0; m < SLOPE_NODES; m++) {
        for (int k = 0; k < SLOPE_NODES; k++) {
            VECTOR_LOOP
            for (int i = 0; i < SLOPE_BATCH; i++) {
                low[i] = smaller(low[i], rows->x[m][k][a][i]);
                high[i] = larger(high[i], rows->x[m][k][a][i]);
            }
        }
    }
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        rows->low[a][i] = low[i], rows->high[a][i] = high[i];
    }
}

/* mean difference of neighbours along u and along v, [m] */
static inline void find_mean(SlopeRows *rows, int a) {
    SlopeRow u = {0.0}, v = {0.0};
    for (int k = 0; k < SLOPE_NODES; k++) {
        VECTOR_LOOP
        for (int i = 0; i < SLOPE_BATCH; i++) {
            u[i] += rows->x[k][SURFACE_BLOCK][a][i] - rows->x[k][0][a][i];
            v[i] += rows->x[SURFACE_BLOCK][k][a][i] - rows->x[0][k][a][i];
        }
    }
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        rows->mean[0][a][i] = u[i] / (SLOPE_NODES * rows->cells[0][i]);
        rows->mean[1][a][i] = v[i] / (SLOPE_NODES * rows->cells[1][i]);
    }
}

static inline void find_normal(SlopeRows *rows) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        double ax = rows->mean[0][0][i], ay = rows->mean[0][1][i], az = rows->mean[0][2][i];
        double bx = rows->mean[1][0][i], by = rows->mean[1][1][i], bz = rows->mean[1][2][i];
        double x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
        double length = __builtin_sqrt(x * x + y * y + z * z);
        int flat = length > LEAST_AREA;
        double scale = 1.0 / (flat ? length : 1.0);
        rows->normal[0][i] = x * scale, rows->normal[1][i] = y * scale;
        rows->normal[2][i] = flat ? z * scale : 1.0;
    }
}

/* squares of what the difference of two nodes along an axis has within the plane and across it besides the
 * mean, where there is such a cell */
static inline void widen(SlopeRows *rows, int axis, int cell, SlopeRow here[3], SlopeRow next[3],
                         SlopeRow flat, SlopeRow steep) {
    SlopeRow *mean = rows->mean[axis];
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        double nx = rows->normal[0][i], ny = rows->normal[1][i], nz = rows->normal[2][i];
        double x = next[0][i] - here[0][i] - mean[0][i];
        double y = next[1][i] - here[1][i] - mean[1][i];
        double z = next[2][i] - here[2][i] - mean[2][i];
        double a = nx * x + ny * y + nz * z;
        x -= a * nx, y -= a * ny, z -= a * nz;
        double within = x * x + y * y + z * z;
        int there = cell < rows->cells[axis][i];
        flat[i] = larger(flat[i], there ? within : 0.0);
        steep[i] = larger(steep[i], there ? a * a : 0.0);
    }
}

static void fit_blocks(const double h[2], SlopeRows *rows) {
    for (int a = 0; a < 3; a++) {
        bound(rows, a);
        find_mean(rows, a);
    }
    find_normal(rows);
    SlopeRow flat[2] = {{0.0}}, steep[2] = {{0.0}};
    for (int m = 0; m < SLOPE_NODES; m++) {
        for (int k = 0; k < SURFACE_BLOCK; k++) {
            widen(rows, 0, k, rows->x[m][k], rows->x[m][k + 1], flat[0], steep[0]);
            widen(rows, 1, k, rows->x[k][m], rows->x[k + 1][m], flat[1], steep[1]);
        }
    }
    double ru = 1.0 / h[0], rv = 1.0 / h[1], ru2 = ru * ru, rv2 = rv * rv;
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        rows->flat[i] = __builtin_sqrt(ru2 * flat[0][i] + rv2 * flat[1][i]);
        rows->steep[i] = __builtin_sqrt(ru2 * steep[0][i] + rv2 * steep[1][i]);
        for (int a = 0; a < 3; a++) {
            rows->mean[0][a][i] *= ru, rows->mean[1][a][i] *= rv;
        }
    }
}

SlopeKernel *const VECTOR_JOIN(slope_kernel_, VECTOR_VARIANT) = fit_blocks;
