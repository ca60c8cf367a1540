/* slope_kernel.c: the row loops of slope_batch.h. Compiled once per vector width (see the Makefile). */
#include "sim/contact/slope_batch.h"

#define LEAST_AREA 1e-100 /* [m2] below it any plane will do: nothing is proven by it */

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

/* [m] of the nodes along v, u */
typedef SlopeRow Places[SLOPE_NODES][SLOPE_NODES][3];

static inline void gather(const SlopeNodes *nodes, const SlopeRows *rows, Places places) {
    const double *x = nodes->x[0], *y = nodes->x[1], *z = nodes->x[2];
    const int *slot = nodes->slot;
    for (int m = 0; m < SLOPE_NODES; m++) {
        for (int k = 0; k < SLOPE_NODES; k++) {
            VECTOR_LOOP
            for (int i = 0; i < SLOPE_BATCH; i++) {
                int s = slot[rows->row[m][i] + rows->column[k][i]];
                places[m][k][0][i] = x[s], places[m][k][1][i] = y[s], places[m][k][2][i] = z[s];
            }
        }
    }
}

static inline void bound(SlopeRows *rows, Places places, int a) {
    SlopeRow low, high;
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        low[i] = high[i] = places[0][0][a][i];
    }
    for (int m = 0; m < SLOPE_NODES; m++) {
        VECTOR_LOOP
        for (int i = 0; i < SLOPE_BATCH; i++) {
            double p = places[m][0][a][i], q = places[m][1][a][i];
            double r = places[m][2][a][i], s = places[m][3][a][i];
            low[i] = smaller(low[i], smaller(smaller(p, q), smaller(r, s)));
            high[i] = larger(high[i], larger(larger(p, q), larger(r, s)));
        }
    }
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        rows->low[a][i] = low[i], rows->high[a][i] = high[i];
    }
}

/* mean difference of neighbours along u and along v, [m] */
static inline void find_mean(SlopeRows *rows, Places places, int a) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        double u = places[0][3][a][i] - places[0][0][a][i];
        double v = places[3][0][a][i] - places[0][0][a][i];
        u += places[1][3][a][i] - places[1][0][a][i], v += places[3][1][a][i] - places[0][1][a][i];
        u += places[2][3][a][i] - places[2][0][a][i], v += places[3][2][a][i] - places[0][2][a][i];
        u += places[3][3][a][i] - places[3][0][a][i], v += places[3][3][a][i] - places[0][3][a][i];
        rows->slopes.mean[0][a][i] = u / (SLOPE_NODES * rows->cells[0][i]);
        rows->slopes.mean[1][a][i] = v / (SLOPE_NODES * rows->cells[1][i]);
    }
}

static inline void find_normal(SlopeValues *slopes) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        double ax = slopes->mean[0][0][i], ay = slopes->mean[0][1][i], az = slopes->mean[0][2][i];
        double bx = slopes->mean[1][0][i], by = slopes->mean[1][1][i], bz = slopes->mean[1][2][i];
        double x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
        double length = __builtin_sqrt(x * x + y * y + z * z);
        int flat = length > LEAST_AREA;
        double scale = 1.0 / (flat ? length : 1.0);
        slopes->normal[0][i] = x * scale, slopes->normal[1][i] = y * scale;
        slopes->normal[2][i] = flat ? z * scale : 1.0;
    }
}

/* The mean that is taken off the differences of each cell along an axis: none where there is no cell, since
 * these are of a node with itself. */
typedef SlopeRow Means[SURFACE_BLOCK][3];

static inline void spread_mean(const SlopeRows *rows, int axis, Means means) {
    for (int cell = 0; cell < SURFACE_BLOCK; cell++) {
        for (int a = 0; a < 3; a++) {
            VECTOR_LOOP
            for (int i = 0; i < SLOPE_BATCH; i++) {
                means[cell][a][i] =
                    cell < rows->cells[axis][i] ? rows->slopes.mean[axis][a][i] : 0.0;
            }
        }
    }
}

/* squares of what the difference of two nodes has within the plane and across it besides the mean */
static inline void widen(SlopeRow here[3], SlopeRow next[3], SlopeRow mean[3], SlopeRow normal[3],
                         int i, double *flat, double *steep) {
    double x = next[0][i] - here[0][i] - mean[0][i];
    double y = next[1][i] - here[1][i] - mean[1][i];
    double z = next[2][i] - here[2][i] - mean[2][i];
    double a = normal[0][i] * x + normal[1][i] * y + normal[2][i] * z;
    x -= a * normal[0][i], y -= a * normal[1][i], z -= a * normal[2][i];
    *flat = larger(*flat, x * x + y * y + z * z);
    *steep = larger(*steep, a * a);
}

/* three cells that follow each other */
static inline void widen_line(SlopeRow *node[SLOPE_NODES], Means means, SlopeRow normal[3],
                              SlopeRow flat, SlopeRow steep) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        double most_flat = flat[i], most_steep = steep[i];
        widen(node[0], node[1], means[0], normal, i, &most_flat, &most_steep);
        widen(node[1], node[2], means[1], normal, i, &most_flat, &most_steep);
        widen(node[2], node[3], means[2], normal, i, &most_flat, &most_steep);
        flat[i] = most_flat, steep[i] = most_steep;
    }
}

static void fit_blocks(const SlopeNodes *nodes, SlopeRows *rows) {
    Places x;
    Means means[2];
    gather(nodes, rows, x);
    for (int a = 0; a < 3; a++) {
        bound(rows, x, a);
        find_mean(rows, x, a);
    }
    find_normal(&rows->slopes);
    spread_mean(rows, 0, means[0]);
    spread_mean(rows, 1, means[1]);
    SlopeRow flat[2] = {{0.0}}, steep[2] = {{0.0}};
    for (int m = 0; m < SLOPE_NODES; m++) {
        SlopeRow *along_u[SLOPE_NODES] = {x[m][0], x[m][1], x[m][2], x[m][3]};
        SlopeRow *along_v[SLOPE_NODES] = {x[0][m], x[1][m], x[2][m], x[3][m]};
        widen_line(along_u, means[0], rows->slopes.normal, flat[0], steep[0]);
        widen_line(along_v, means[1], rows->slopes.normal, flat[1], steep[1]);
    }
    double ru = 1.0 / nodes->h[0], rv = 1.0 / nodes->h[1], ru2 = ru * ru, rv2 = rv * rv;
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        rows->slopes.flat[i] = __builtin_sqrt(ru2 * flat[0][i] + rv2 * flat[1][i]);
        rows->slopes.steep[i] = __builtin_sqrt(ru2 * steep[0][i] + rv2 * steep[1][i]);
        for (int a = 0; a < 3; a++) {
            rows->slopes.mean[0][a][i] *= ru, rows->slopes.mean[1][a][i] *= rv;
        }
    }
}

_Static_assert(SURFACE_BLOCK == 3, "loops over three cells are written out");

/* what differs of a part: within the plane, and along the normal; returns the square within */
static inline double within_plane(const SlopeValues *part, const SlopeValues *all, int k, int i,
                                  double *across) {
    double nx = all->normal[0][i], ny = all->normal[1][i], nz = all->normal[2][i];
    double x = part->mean[k][0][i] - all->mean[k][0][i];
    double y = part->mean[k][1][i] - all->mean[k][1][i];
    double z = part->mean[k][2][i] - all->mean[k][2][i];
    double a = nx * x + ny * y + nz * z;
    x -= a * nx, y -= a * ny, z -= a * nz;
    *across = a;
    return x * x + y * y + z * z;
}

/* What leaves the plane of a part shows in that of all by the sine of the angle of both planes. */
static inline void widen_by(const SlopeValues *part, SlopeValues *all) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        double nx = all->normal[0][i], ny = all->normal[1][i], nz = all->normal[2][i];
        double px = part->normal[0][i], py = part->normal[1][i], pz = part->normal[2][i];
        double tx = py * nz - pz * ny, ty = pz * nx - px * nz, tz = px * ny - py * nx;
        double dot = px * nx + py * ny + pz * nz, cosine = dot < 0.0 ? -dot : dot;
        double sine = __builtin_sqrt(tx * tx + ty * ty + tz * tz), a, b;
        double square = within_plane(part, all, 0, i, &a) + within_plane(part, all, 1, i, &b);
        double flat = __builtin_sqrt(square) + part->flat[i] + sine * part->steep[i];
        double steep =
            __builtin_sqrt(a * a + b * b) + cosine * part->steep[i] + sine * part->flat[i];
        all->flat[i] = larger(all->flat[i], flat);
        all->steep[i] = larger(all->steep[i], steep);
    }
}

static void join_blocks(SlopeJoin *join) {
    SlopeValues *all = &join->all;
    for (int k = 0; k < 6; k++) {
        int axis = k / 3, a = k % 3;
        VECTOR_LOOP
        for (int i = 0; i < SLOPE_BATCH; i++) {
            all->mean[axis][a][i] =
                0.25 * ((join->part[0].mean[axis][a][i] + join->part[1].mean[axis][a][i]) +
                        (join->part[2].mean[axis][a][i] + join->part[3].mean[axis][a][i]));
        }
    }
    find_normal(all);
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        all->flat[i] = all->steep[i] = 0.0;
    }
    for (int k = 0; k < SLOPE_PARTS; k++) {
        widen_by(&join->part[k], all);
    }
}

const SlopeKernel VECTOR_JOIN(slope_kernel_, VECTOR_VARIANT) = {fit_blocks, join_blocks};
