/* sweep_kernel.c: the row loops of sweep.h. Compiled once per vector width (see the Makefile):
 * VECTOR_VARIANT names the variant, VECTOR_SIMD asks for vector code.
 *
 * Letters (mlpg.h): F1, F2 slopes of a cell, k its twist, P1, P2 membrane force along the cell's
 * edges, S = P1 - Q and T = P1 + Q with Q the twist force; m11, m22 bending moments at nodes. */
#include <stddef.h>

#include "sim/base/vector.h"
#include "sim/model/sweep.h"

/* membrane forces of one row of cells */
typedef struct CellRow {
    double *s[3], *t[3], *p2[3];
} CellRow;

typedef struct Rows {
    CellRow cells[2];    /* below and above the node row at work */
    double *m11[2][3];   /* node rows j, j + 1 */
    double *m22[3][3];   /* node rows j - 1, j, j + 1 */
    double *spare[2][3]; /* m11, m22 of a border row whose m22 belongs to the next row */
    double *force[3];
    double *normal[2][3]; /* of a row and of the border row beyond it; rest curvature only */
    double *turn1[2][3];  /* node rows j, j + 1: couples that turn the slope F1 */
    double *turn2[3][3];  /* node rows j - 1, j, j + 1: the same for F2 */
} Rows;

static void rows_bind(Rows *rows, double *buffer, int stride) {
    double *next = buffer + LANE_MARGIN;
    for (int c = 0; c < 3; c++) {
        for (int side = 0; side < 2; side++) {
            rows->cells[side].s[c] = next, next += stride;
            rows->cells[side].t[c] = next, next += stride;
            rows->cells[side].p2[c] = next, next += stride;
        }
        for (int k = 0; k < 2; k++) {
            rows->m11[k][c] = next, next += stride;
            rows->spare[k][c] = next, next += stride;
            rows->normal[k][c] = next, next += stride;
            rows->turn1[k][c] = next, next += stride;
        }
        for (int k = 0; k < 3; k++) {
            rows->m22[k][c] = next, next += stride;
            rows->turn2[k][c] = next, next += stride;
        }
        rows->force[c] = next, next += stride;
    }
}

static void fill_zero(double *const row[3], int begin, int end) {
    for (int c = 0; c < 3; c++) {
        double *restrict out = row[c];
        for (int i = begin; i < end; i++) {
            out[i] = 0.0;
        }
    }
}

/* Loops that write buffers alone run on into the free slots after a row, to whole vectors of the
 * widest kind: the tail costs more than the work in vain. Nothing is read from there. */
#define WHOLE_VECTORS 8
/* A row moves with its nodes at 1/7 and 6/7: where it is bent to a parabola, no node is much faster
 * against these than against the best frame. */
#define FRAME_NODES 7
/* a loop for each use, with its flags known; out of line it does not vectorise */
#define ONE_LOOP static inline __attribute__((always_inline))
static int whole(int count) { return (count + WHOLE_VECTORS - 1) & -WHOLE_VECTORS; }

/* cells between node rows j and j + 1 */
static void cell_row(const SweepLattice *l, const Lanes *lanes, int j, CellRow *cells) {
    int cell_count = l->wrap ? l->nu : l->nu - 1;
    size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
    const double *restrict xa = lanes->stretched[0] + at, *restrict ya = lanes->stretched[1] + at;
    const double *restrict za = lanes->stretched[2] + at;
    const double *restrict xb = xa + l->stride, *restrict yb = ya + l->stride;
    const double *restrict zb = za + l->stride;
    double *restrict sx = cells->s[0], *restrict sy = cells->s[1], *restrict sz = cells->s[2];
    double *restrict tx = cells->t[0], *restrict ty = cells->t[1], *restrict tz = cells->t[2];
    double *restrict px = cells->p2[0], *restrict py = cells->p2[1], *restrict pz = cells->p2[2];
    double area = l->h1 * l->h2;
    double to_f1 = 0.5 / l->h1, to_f2 = 0.5 / l->h2, to_k = 1.0 / area;
    double to_p1 = area * to_f1, to_p2 = area * to_f2;
    double c11 = l->c11, c12 = l->c12, c22 = l->c22, c66 = l->c66;
    double twist = 4.0 * l->d66, glass = l->hourglass * area / 12.0;
    VECTOR_LOOP
    for (int i = 0; i < whole(cell_count); i++) {
        double ex = xa[i + 1] - xa[i], ey = ya[i + 1] - ya[i], ez = za[i + 1] - za[i];
        double gx = xb[i + 1] - xb[i], gy = yb[i + 1] - yb[i], gz = zb[i + 1] - zb[i];
        double f1x = to_f1 * (ex + gx), f1y = to_f1 * (ey + gy), f1z = to_f1 * (ez + gz);
        double kx = to_k * (gx - ex), ky = to_k * (gy - ey), kz = to_k * (gz - ez);
        double f2x = to_f2 * ((xb[i] - xa[i]) + (xb[i + 1] - xa[i + 1]));
        double f2y = to_f2 * ((yb[i] - ya[i]) + (yb[i + 1] - ya[i + 1]));
        double f2z = to_f2 * ((zb[i] - za[i]) + (zb[i + 1] - za[i + 1]));
        double e1 = 0.5 * (f1x * f1x + f1y * f1y + f1z * f1z - 1.0);
        double e2 = 0.5 * (f2x * f2x + f2y * f2y + f2z * f2z - 1.0);
        double s12 = c66 * (f1x * f2x + f1y * f2y + f1z * f2z);
        double s1 = c11 * e1 + c12 * e2, s2 = c12 * e1 + c22 * e2;
        double t1 = glass * (f1x * kx + f1y * ky + f1z * kz);
        double t2 = glass * (f2x * kx + f2y * ky + f2z * kz);
        double p1x = to_p1 * (s1 * f1x + s12 * f2x + t1 * kx);
        double p1y = to_p1 * (s1 * f1y + s12 * f2y + t1 * ky);
        double p1z = to_p1 * (s1 * f1z + s12 * f2z + t1 * kz);
        double qx = t1 * f1x + t2 * f2x + twist * kx;
        double qy = t1 * f1y + t2 * f2y + twist * ky;
        double qz = t1 * f1z + t2 * f2z + twist * kz;
        px[i] = to_p2 * (s2 * f2x + s12 * f1x + t2 * kx);
        py[i] = to_p2 * (s2 * f2y + s12 * f1y + t2 * ky);
        pz[i] = to_p2 * (s2 * f2z + s12 * f1z + t2 * kz);
        sx[i] = p1x - qx, sy[i] = p1y - qy, sz[i] = p1z - qz;
        tx[i] = p1x + qx, ty[i] = p1y + qy, tz[i] = p1z + qz;
    }
    for (int c = 0; c < 3; c++) {
        int last = l->nu - 1;
        cells->s[c][-1] = l->wrap ? cells->s[c][last] : 0.0;
        cells->t[c][-1] = l->wrap ? cells->t[c][last] : 0.0;
        cells->p2[c][-1] = l->wrap ? cells->p2[c][last] : 0.0;
        if (!l->wrap) {
            cells->s[c][last] = cells->t[c][last] = cells->p2[c][last] = 0.0;
        }
    }
}

/* index of the node whose second difference stands for the curvature at `at`: itself, or the
 * next inner node on a free border; *scale 2 on a clamped border (half a spacing to the wall) */
static int curvature_centre(int at, int count, bool clamp_low, bool clamp_high, double *scale) {
    *scale = 1.0;
    if (at == 0) {
        *scale = clamp_low ? 2.0 : 1.0;
        return clamp_low ? 0 : 1;
    }
    if (at == count - 1) {
        *scale = clamp_high ? 2.0 : 1.0;
        return clamp_high ? count - 1 : count - 2;
    }
    return at;
}

/* moments of one component of node row j: m11 folded to its centres, m22 as it is; `normal` of
 * the row, or NULL without rest curvature */
static void moment_component(const SweepLattice *l, const double *x, int j,
                             const double *restrict normal, double *restrict m11,
                             double *restrict m22) {
    double scale2, scale1;
    int count = whole(l->nu);
    int centre2 = curvature_centre(j, l->nv, l->clamp[2], l->clamp[3], &scale2);
    const double *restrict row = x + (ptrdiff_t)j * l->stride;
    const double *restrict mid = x + (ptrdiff_t)centre2 * l->stride;
    const double *restrict low = mid - l->stride, *restrict high = mid + l->stride;
    double to_k1 = 1.0 / (l->h1 * l->h1), to_k2 = scale2 / (l->h2 * l->h2);
    double w = l->h1 * l->h2 * (j == 0 || j == l->nv - 1 ? 0.5 : 1.0);
    double w11 = w * l->d11, w12 = w * l->d12, w22 = w * l->d22 * scale2, w21 = w12 * scale2;
    VECTOR_LOOP
    for (int i = 0; i < count; i++) {
        double k11 = to_k1 * ((row[i - 1] - row[i]) + (row[i + 1] - row[i]));
        double k22 = to_k2 * ((low[i] - mid[i]) + (high[i] - mid[i]));
        m11[i] = w11 * k11 + w12 * k22;
        m22[i] = w22 * k22 + w21 * k11;
    }
    if (normal) {
        double rest11 = w11 * l->rest1 + w * l->d12 * l->rest2;
        double rest22 = w22 * l->rest2 + w21 * l->rest1;
        VECTOR_LOOP
        for (int i = 0; i < count; i++) {
            m11[i] -= rest11 * normal[i];
            m22[i] -= rest22 * normal[i];
        }
    }
    if (l->wrap) {
        m11[-1] = m11[l->nu - 1];
        m11[l->nu] = m11[0];
        return;
    }
    /* borders in u have half a cell, and their curvature from the next inner node */
    double edge11[2];
    for (int side = 0; side < 2; side++) {
        int i = side == 0 ? 0 : l->nu - 1;
        int c = curvature_centre(i, l->nu, l->clamp[0], l->clamp[1], &scale1);
        double k11 = scale1 * to_k1 * ((row[c - 1] - row[c]) + (row[c + 1] - row[c]));
        double k22 = to_k2 * ((low[i] - mid[i]) + (high[i] - mid[i]));
        edge11[side] = 0.5 * scale1 * (w11 * k11 + w12 * k22);
        m22[i] = 0.5 * (w22 * k22 + w21 * k11);
        m11[i] = 0.0;
    }
    for (int side = 0; side < 2; side++) {
        int i = side == 0 ? 0 : l->nu - 1;
        m11[curvature_centre(i, l->nu, l->clamp[0], l->clamp[1], &scale1)] += edge11[side];
    }
    m11[-1] = m11[l->nu] = 0.0;
}

/* Rest curvature of a wrapped lattice: energy -n . q with q = M1 k11 + M2 k22. Normals of node
 * row j, and the couples F2 x y and y x F1 (y: the part of q in the surface / |F1 x F2|), already
 * divided by the width over which the slopes are taken (bending.c). */
static void rest_row(const SweepLattice *l, const Lanes *lanes, int j, double *const normal[3],
                     double *const turn1[3], double *const turn2[3]) {
    double scale;
    int centre = curvature_centre(j, l->nv, l->clamp[2], l->clamp[3], &scale);
    int low_row = j > 0 ? j - 1 : j, high_row = j + 1 < l->nv ? j + 1 : j;
    double w = l->h1 * l->h2 * (j == 0 || j == l->nv - 1 ? 0.5 : 1.0);
    double m1 = w * (l->d11 * l->rest1 + l->d12 * l->rest2) / (l->h1 * l->h1);
    double m2 = w * (l->d12 * l->rest1 + l->d22 * l->rest2) * scale / (l->h2 * l->h2);
    double to_f1 = 0.5 / l->h1, to_f2 = 1.0 / (l->h2 * (high_row - low_row));
    const double *p[3][3], *k[3][3]; /* rows of the slopes; rows of k22 */
    for (int c = 0; c < 3; c++) {
        const double *x = lanes->x[c] + l->first;
        p[0][c] = x + (ptrdiff_t)low_row * l->stride;
        p[1][c] = x + (ptrdiff_t)j * l->stride;
        p[2][c] = x + (ptrdiff_t)high_row * l->stride;
        k[1][c] = x + (ptrdiff_t)centre * l->stride;
        k[0][c] = k[1][c] - l->stride, k[2][c] = k[1][c] + l->stride;
    }
    const double *restrict x0 = p[0][0], *restrict y0 = p[0][1], *restrict z0 = p[0][2];
    const double *restrict x1 = p[1][0], *restrict y1 = p[1][1], *restrict z1 = p[1][2];
    const double *restrict x2 = p[2][0], *restrict y2 = p[2][1], *restrict z2 = p[2][2];
    const double *restrict xl = k[0][0], *restrict yl = k[0][1], *restrict zl = k[0][2];
    const double *restrict xm = k[1][0], *restrict ym = k[1][1], *restrict zm = k[1][2];
    const double *restrict xh = k[2][0], *restrict yh = k[2][1], *restrict zh = k[2][2];
    double *restrict nx = normal[0], *restrict ny = normal[1], *restrict nz = normal[2];
    double *restrict ax = turn1[0], *restrict ay = turn1[1], *restrict az = turn1[2];
    double *restrict bx = turn2[0], *restrict by = turn2[1], *restrict bz = turn2[2];
    VECTOR_LOOP
    for (int i = 0; i < whole(l->nu); i++) {
        double ux = to_f1 * (x1[i + 1] - x1[i - 1]), uy = to_f1 * (y1[i + 1] - y1[i - 1]);
        double uz = to_f1 * (z1[i + 1] - z1[i - 1]);
        double vx = to_f2 * (x2[i] - x0[i]), vy = to_f2 * (y2[i] - y0[i]);
        double vz = to_f2 * (z2[i] - z0[i]);
        double cx = uy * vz - uz * vy, cy = uz * vx - ux * vz, cz = ux * vy - uy * vx;
        /* collapsed cells have no normal, and then no rest moment either */
        double size = cx * cx + cy * cy + cz * cz, root = __builtin_sqrt(size);
        double inverse = root > 1e-150 ? 1.0 / root : 0.0;
        cx *= inverse, cy *= inverse, cz *= inverse;
        double qx = m1 * ((x1[i - 1] - x1[i]) + (x1[i + 1] - x1[i])) +
                    m2 * ((xl[i] - xm[i]) + (xh[i] - xm[i]));
        double qy = m1 * ((y1[i - 1] - y1[i]) + (y1[i + 1] - y1[i])) +
                    m2 * ((yl[i] - ym[i]) + (yh[i] - ym[i]));
        double qz = m1 * ((z1[i - 1] - z1[i]) + (z1[i + 1] - z1[i])) +
                    m2 * ((zl[i] - zm[i]) + (zh[i] - zm[i]));
        double out = qx * cx + qy * cy + qz * cz;
        qx = inverse * (qx - out * cx), qy = inverse * (qy - out * cy);
        qz = inverse * (qz - out * cz);
        nx[i] = cx, ny[i] = cy, nz[i] = cz;
        ax[i] = to_f1 * (vy * qz - vz * qy), ay[i] = to_f1 * (vz * qx - vx * qz);
        az[i] = to_f1 * (vx * qy - vy * qx);
        bx[i] = to_f2 * (qy * uz - qz * uy), by[i] = to_f2 * (qz * ux - qx * uz);
        bz[i] = to_f2 * (qx * uy - qy * ux);
    }
    for (int c = 0; c < 3; c++) {
        turn1[c][-1] = turn1[c][l->nu - 1];
        turn1[c][l->nu] = turn1[c][0];
    }
}

/* force of the couples: the slope of node i is taken from its neighbours (in v: from itself on a
 * border) */
static void gather_turns(const SweepLattice *l, const Rows *rows, int j, int c) {
    const double *restrict a = rows->turn1[0][c], *restrict low = rows->turn2[0][c];
    const double *restrict own = rows->turn2[1][c], *restrict high = rows->turn2[2][c];
    double *restrict force = rows->force[c];
    double from_own = j == 0 ? -1.0 : j == l->nv - 1 ? 1.0 : 0.0;
    VECTOR_LOOP
    for (int i = 0; i < whole(l->nu); i++) {
        force[i] += (a[i - 1] - a[i + 1]) + (low[i] - high[i]) + from_own * own[i];
    }
}

static bool own_centre(const SweepLattice *l, int j) {
    double scale;
    return curvature_centre(j, l->nv, l->clamp[2], l->clamp[3], &scale) == j;
}

/* m11 of node row j, and m22 gathered at it: its own unless its centre is the next inner row,
 * plus that of a border row whose centre it is */
static void moment_row(const SweepLattice *l, const Lanes *lanes, int j, const Rows *rows,
                       double *const m11[3], double *const m22[3], double *const turn1[3],
                       double *const turn2[3]) {
    if (j < 0 || j >= l->nv) {
        fill_zero(m22, 0, l->nu);
        if (l->rest) {
            fill_zero(turn2, 0, l->nu);
        }
        return;
    }
    if (l->rest) {
        rest_row(l, lanes, j, rows->normal[0], turn1, turn2);
    }
    for (int c = 0; c < 3; c++) {
        const double *x = lanes->bent[c] + l->first;
        moment_component(l, x, j, l->rest ? rows->normal[0][c] : NULL, m11[c], m22[c]);
    }
    if (!own_centre(l, j)) {
        fill_zero(m22, 0, l->nu);
        return;
    }
    for (int side = 0; side < 2; side++) {
        int border = side == 0 ? 0 : l->nv - 1, next = side == 0 ? 1 : l->nv - 2;
        if (j != next || own_centre(l, border)) {
            continue;
        }
        if (l->rest) {
            rest_row(l, lanes, border, rows->normal[1], rows->force, rows->spare[0]);
        }
        for (int c = 0; c < 3; c++) {
            moment_component(l, lanes->bent[c] + l->first, border,
                             l->rest ? rows->normal[1][c] : NULL, rows->spare[0][c],
                             rows->spare[1][c]);
            double *restrict sum = m22[c];
            const double *restrict add = rows->spare[1][c];
            VECTOR_LOOP
            for (int i = 0; i < whole(l->nu); i++) {
                sum[i] += add[i];
            }
        }
    }
}

static void gather_force(const SweepLattice *l, const Rows *rows, const CellRow *below,
                         const CellRow *above, int c) {
    const double *restrict sa = above->s[c], *restrict pa = above->p2[c];
    const double *restrict tb = below->t[c], *restrict pb = below->p2[c];
    const double *restrict m11 = rows->m11[0][c], *restrict low = rows->m22[0][c];
    const double *restrict mid = rows->m22[1][c], *restrict high = rows->m22[2][c];
    double *restrict force = rows->force[c];
    double to_f1 = 1.0 / (l->h1 * l->h1), to_f2 = 1.0 / (l->h2 * l->h2);
    VECTOR_LOOP
    for (int i = 0; i < whole(l->nu); i++) {
        double membrane =
            (pa[i] + pa[i - 1]) + (sa[i] - sa[i - 1]) + (tb[i] - tb[i - 1]) - (pb[i] + pb[i - 1]);
        double bend1 = to_f1 * ((m11[i - 1] - m11[i]) + (m11[i + 1] - m11[i]));
        double bend2 = to_f2 * ((low[i] - mid[i]) + (high[i] - mid[i]));
        force[i] = membrane - bend1 - bend2;
    }
}

static void kick_row(const SweepLattice *l, const Lanes *lanes, const SweepKick *kick, int j,
                     const double *row_force, int c) {
    size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
    double *restrict v = lanes->v[c] + at;
    const double *restrict outside = lanes->f[c] + at, *restrict weight = lanes->weight + at;
    const double *restrict force = row_force;
    double dt = kick->dt, keep = kick->keep;
    double push = dt * (c == 0 ? kick->push.x : c == 1 ? kick->push.y : kick->push.z);
    if (!kick->moved) {
        VECTOR_LOOP
        for (int i = 0; i < l->nu; i++) {
            v[i] = (v[i] + (dt * weight[i] * (force[i] + outside[i]) + push)) * keep;
        }
        return;
    }
    double *restrict moved = kick->moved[c] + at;
    VECTOR_LOOP
    for (int i = 0; i < l->nu; i++) {
        double before = v[i];
        v[i] = (before + (dt * weight[i] * (force[i] + outside[i]) + push)) * keep;
        moved[i] = v[i] - before;
    }
}

static void rotate_moments(Rows *rows) {
    for (int c = 0; c < 3; c++) {
        double *oldest = rows->m22[0][c], *done = rows->m11[0][c];
        double *oldest_turn = rows->turn2[0][c], *done_turn = rows->turn1[0][c];
        rows->turn2[0][c] = rows->turn2[1][c];
        rows->turn2[1][c] = rows->turn2[2][c];
        rows->turn2[2][c] = oldest_turn;
        rows->turn1[0][c] = rows->turn1[1][c];
        rows->turn1[1][c] = done_turn;
        rows->m22[0][c] = rows->m22[1][c];
        rows->m22[1][c] = rows->m22[2][c];
        rows->m22[2][c] = oldest;
        rows->m11[0][c] = rows->m11[1][c];
        rows->m11[1][c] = done;
    }
}

/* marks the cells of row j where a side is longer or shorter than its bound; `excess`: a free row */
static void mark_beyond(const SweepLattice *l, const Lanes *lanes, int j, const SweepSides *sides,
                        double *restrict excess) {
    const double allowed = (1.0 + SWEEP_SIDE_EXCESS) * (1.0 + SWEEP_SIDE_EXCESS);
    const double demanded = (1.0 - SWEEP_SIDE_EXCESS) * (1.0 - SWEEP_SIDE_EXCESS);
    size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
    const double *restrict xa = lanes->x[0] + at, *restrict ya = lanes->x[1] + at;
    const double *restrict za = lanes->x[2] + at, *restrict xb = xa + l->stride;
    const double *restrict yb = ya + l->stride, *restrict zb = za + l->stride;
    double most1 = allowed * l->h1 * l->h1, most2 = allowed * l->h2 * l->h2;
    double least1 = demanded * l->h1 * l->h1, least2 = demanded * l->h2 * l->h2;
    int count = l->wrap ? l->nu : l->nu - 1;
    VECTOR_LOOP
    for (int i = 0; i < whole(count); i++) {
        double ex = xa[i + 1] - xa[i], ey = ya[i + 1] - ya[i], ez = za[i + 1] - za[i];
        double gx = xb[i + 1] - xb[i], gy = yb[i + 1] - yb[i], gz = zb[i + 1] - zb[i];
        double lx = xb[i] - xa[i], ly = yb[i] - ya[i], lz = zb[i] - za[i];
        double rx = xb[i + 1] - xa[i + 1], ry = yb[i + 1] - ya[i + 1], rz = zb[i + 1] - za[i + 1];
        double low = ex * ex + ey * ey + ez * ez, high = gx * gx + gy * gy + gz * gz;
        double left = lx * lx + ly * ly + lz * lz, right = rx * rx + ry * ry + rz * rz;
        double over1 = (low > high ? low : high) - most1;
        double over2 = (left > right ? left : right) - most2;
        double under1 = least1 - (low < high ? low : high);
        double under2 = least2 - (left < right ? left : right);
        double over = over1 > over2 ? over1 : over2, under = under1 > under2 ? under1 : under2;
        excess[i] = over > under ? over : under;
    }
    unsigned char any = 0, *restrict cell = sides->cell + (ptrdiff_t)j * l->nu;
#ifdef VECTOR_SIMD
#pragma omp simd reduction(| : any)
#endif
    for (int i = 0; i < count; i++) {
        cell[i] = excess[i] > 0.0;
        any |= cell[i];
    }
    sides->row[j] = any;
}

static void mark_rows(const SweepLattice *l, const Lanes *lanes, const SweepSides *sides,
                      int row_begin, int row_end, double *buffer) {
    for (int j = row_begin; j < row_end && j + 1 < l->nv; j++) {
        mark_beyond(l, lanes, j, sides, buffer);
    }
}

static void no_cells(const SweepLattice *l, const CellRow *cells) {
    fill_zero(cells->s, -1, l->nu);
    fill_zero(cells->t, -1, l->nu);
    fill_zero(cells->p2, -1, l->nu);
}

static void kick_rows(const SweepLattice *l, const Lanes *lanes, const SweepKick *kick,
                      int row_begin, int row_end, double *buffer) {
    Rows rows;
    rows_bind(&rows, buffer, l->stride);
    moment_row(l, lanes, row_begin - 1, &rows, rows.m11[1], rows.m22[0], rows.turn1[1],
               rows.turn2[0]);
    moment_row(l, lanes, row_begin, &rows, rows.m11[0], rows.m22[1], rows.turn1[0], rows.turn2[1]);
    CellRow *below = &rows.cells[0], *above = &rows.cells[1];
    if (row_begin > 0) {
        cell_row(l, lanes, row_begin - 1, below);
    } else {
        no_cells(l, below);
    }
    for (int j = row_begin; j < row_end; j++) {
        moment_row(l, lanes, j + 1, &rows, rows.m11[1], rows.m22[2], rows.turn1[1], rows.turn2[2]);
        if (j + 1 < l->nv) {
            cell_row(l, lanes, j, above);
            if (kick->sides.row) {
                mark_beyond(l, lanes, j, &kick->sides, rows.force[0]);
            }
        } else {
            no_cells(l, above);
        }
        for (int c = 0; c < 3; c++) {
            gather_force(l, &rows, below, above, c);
            if (l->rest) {
                gather_turns(l, &rows, j, c);
            }
            kick_row(l, lanes, kick, j, rows.force[c], c);
        }
        rotate_moments(&rows);
        CellRow *swap = below;
        below = above, above = swap;
    }
}

/* one row of the places ahead of x, unless they are x */
static void lead_row(const SweepLattice *l, const Lanes *lanes, double ahead, double *const out[3],
                     size_t at) {
    for (int c = 0; c < 3 && out[c] != lanes->x[c]; c++) {
        const double *restrict x = lanes->x[c] + at, *restrict v = lanes->v[c] + at;
        double *restrict led = out[c] + at;
        VECTOR_LOOP
        for (int i = 0; i < l->nu; i++) {
            led[i] = x[i] + ahead * v[i];
        }
    }
}

/* mean velocity of two nodes */
static inline Vec3 frame_of(double *const v[3], size_t a, size_t b) {
    return vec3(0.5 * (v[0][a] + v[0][b]), 0.5 * (v[1][a] + v[1][b]), 0.5 * (v[2][a] + v[2][b]));
}

/* largest squares so far, of every place in a vector: they are compared once for all rows */
typedef struct Most {
    double lane[WHOLE_VECTORS];
} Most;

/* x += dt v of some nodes; most: the squares of v - frame, or of v */
ONE_LOOP void drift_nodes(const Lanes *lanes, size_t at, int count, double dt, bool framed,
                          Vec3 frame, Most *most) {
    double *restrict x = lanes->x[0] + at, *restrict y = lanes->x[1] + at;
    double *restrict z = lanes->x[2] + at;
    const double *restrict vx = lanes->v[0] + at, *restrict vy = lanes->v[1] + at;
    const double *restrict vz = lanes->v[2] + at;
    VECTOR_LOOP
    for (int i = 0; i < count; i++) {
        x[i] += dt * vx[i], y[i] += dt * vy[i], z[i] += dt * vz[i];
        double a = framed ? vx[i] - frame.x : vx[i], b = framed ? vy[i] - frame.y : vy[i];
        double c = framed ? vz[i] - frame.z : vz[i], square = a * a + b * b + c * c;
        most->lane[i] = square > most->lane[i] ? square : most->lane[i];
    }
}

ONE_LOOP void drift_row(const Lanes *lanes, size_t at, int count, double dt, bool framed,
                        Vec3 frame, Most *most) {
    int i = 0;
    for (; i + WHOLE_VECTORS <= count; i += WHOLE_VECTORS) {
        drift_nodes(lanes, at + (size_t)i, WHOLE_VECTORS, dt, framed, frame, most);
    }
    drift_nodes(lanes, at + (size_t)i, count - i, dt, framed, frame, most);
}

static SweepSpeed drift_rows(const SweepLattice *l, const Lanes *lanes, const SweepDrift *drift,
                             int row_begin, int row_end) {
    SweepSpeed speed = {0.0, {{0, 0, 0}, {0, 0, 0}}, 0.0};
    size_t stride = (size_t)l->stride, first = (size_t)l->first + (size_t)row_begin * stride;
    size_t left = (size_t)(l->nu / FRAME_NODES), right = (size_t)(l->nu - 1) - left;
    Vec3 frame = vec3(0, 0, 0), next = frame_of(lanes->v, first + left, first + right);
    Most most = {{0.0}};
    if (drift->frames) {
        speed.frames = box_empty();
    }
    for (int j = row_begin; j < row_end; j++) {
        size_t at = (size_t)l->first + (size_t)j * stride;
        if (!drift->frames) {
            drift_row(lanes, at, l->nu, drift->dt, false, frame, &most);
        } else {
            frame = next;
            if (j + 1 < l->nv) {
                next = frame_of(lanes->v, at + stride + left, at + stride + right);
            }
            Vec3 shear = vec3_sub(next, frame);
            speed.shear = max2(vec3_dot(shear, shear), speed.shear);
            box_add(&speed.frames, frame);
            drift_row(lanes, at, l->nu, drift->dt, true, frame, &most);
        }
        lead_row(l, lanes, drift->bent, lanes->bent, at);
        lead_row(l, lanes, drift->stretched, lanes->stretched, at);
    }
    for (int k = 0; k < WHOLE_VECTORS; k++) {
        speed.within = max2(most.lane[k], speed.within);
    }
    return speed;
}

extern const SweepKernel VECTOR_JOIN(sweep_kernel_, VECTOR_VARIANT);
const SweepKernel VECTOR_JOIN(sweep_kernel_, VECTOR_VARIANT) = {VECTOR_TEXT(VECTOR_VARIANT),
                                                                kick_rows, drift_rows, mark_rows};
