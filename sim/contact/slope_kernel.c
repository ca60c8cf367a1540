/* slope_kernel.c: the row loops of slope_batch.h. Compiled once per vector width (see the Makefile). */
#include "sim/contact/slope_batch.h"

#define LEAST_AREA 1e-10f /* below it any plane will do: nothing is proven by it */
/* a loop for each use, with its constants known */
#define ONE_LOOP static inline __attribute__((always_inline))

ONE_LOOP float larger(float a, float b) { return a > b ? a : b; }
ONE_LOOP float smaller(float a, float b) { return a < b ? a : b; }
ONE_LOOP float size_of(float a) { return a < 0.0f ? -a : a; }

static void pack_nodes(const double *x, double origin, int count, float *const out[SURFACE_BLOCK]) {
    float *restrict first = out[0], *restrict second = out[1], *restrict third = out[2];
    VECTOR_LOOP
    for (int b = 0; b < count; b++) {
        first[b] = (float)(x[3 * b] - origin);
        second[b] = (float)(x[3 * b + 1] - origin);
        third[b] = (float)(x[3 * b + 2] - origin);
    }
}

_Static_assert(SURFACE_BLOCK == 3, "nodes of a row go by threes, loops over cells are written out");

/* ---- nodes ---- */

/* the batch of one coordinate of each node */
typedef const float *Places[SLOPE_NODES][SLOPE_NODES];

/* [m] widens `far` to how far a node is from the origin along an axis */
ONE_LOOP void bound(SlopeFit *fit, Places place, int axis, SlopeRow far) {
    SlopeRow low, high;
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        low[i] = high[i] = place[0][0][i];
    }
    for (int m = 0; m < SLOPE_NODES; m++) {
        const float *a = place[m][0], *b = place[m][1], *c = place[m][2], *d = place[m][3];
        VECTOR_LOOP
        for (int i = 0; i < SLOPE_BATCH; i++) {
            low[i] = smaller(low[i], smaller(smaller(a[i], b[i]), smaller(c[i], d[i])));
            high[i] = larger(high[i], larger(larger(a[i], b[i]), larger(c[i], d[i])));
        }
    }
    double origin = fit->origin[axis];
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        float most = larger(-low[i], high[i]), off = SLOPE_ROUNDING * most;
        fit->low[axis][i] = origin + (double)(low[i] - off);
        fit->high[axis][i] = origin + (double)(high[i] + off);
        far[i] = larger(far[i], most);
    }
}

/* mean difference of neighbours along u and along v, [m] */
ONE_LOOP void find_mean(const SlopeFit *fit, Places place, SlopeRow u, SlopeRow v) {
    const float *across = fit->cells[0] + fit->at, *along = fit->cells[1] + fit->at;
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        float a = (place[0][3][i] - place[0][0][i]) + (place[1][3][i] - place[1][0][i]);
        float b = (place[3][0][i] - place[0][0][i]) + (place[3][1][i] - place[0][1][i]);
        a += (place[2][3][i] - place[2][0][i]) + (place[3][3][i] - place[3][0][i]);
        b += (place[3][2][i] - place[0][2][i]) + (place[3][3][i] - place[0][3][i]);
        u[i] = a / (SLOPE_NODES * across[i]);
        v[i] = b / (SLOPE_NODES * along[i]);
    }
}

/* unit vectors across both */
ONE_LOOP void find_normal(SlopeRow u[3], SlopeRow v[3], SlopeRow normal[3]) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        float x = u[1][i] * v[2][i] - u[2][i] * v[1][i];
        float y = u[2][i] * v[0][i] - u[0][i] * v[2][i];
        float z = u[0][i] * v[1][i] - u[1][i] * v[0][i];
        float length = __builtin_sqrtf(x * x + y * y + z * z);
        int flat = length > LEAST_AREA;
        float scale = 1.0f / (flat ? length : 1.0f);
        normal[0][i] = x * scale, normal[1][i] = y * scale;
        normal[2][i] = flat ? z * scale : 1.0f;
    }
}

/* What is taken off the differences along an axis: the mean, but nothing where there is no cell, since there a
 * node is compared with itself. */
ONE_LOOP void spread_mean(const float *cells, SlopeRow mean[3], SlopeRow means[SURFACE_BLOCK][3]) {
    for (int cell = 0; cell < SURFACE_BLOCK; cell++) {
        for (int a = 0; a < 3; a++) {
            VECTOR_LOOP
            for (int i = 0; i < SLOPE_BATCH; i++) {
                means[cell][a][i] = (float)cell < cells[i] ? mean[a][i] : 0.0f;
            }
        }
    }
}

typedef struct Wide {
    float flat, steep; /* squares */
} Wide;

/* what (x, y, z) has within the plane and across it */
ONE_LOOP Wide wider(Wide most, SlopeRow normal[3], int i, float x, float y, float z) {
    float n = normal[0][i] * x + normal[1][i] * y + normal[2][i] * z;
    x -= n * normal[0][i], y -= n * normal[1][i], z -= n * normal[2][i];
    return (Wide){larger(most.flat, x * x + y * y + z * z), larger(most.steep, n * n)};
}

/* largest squares of the differences of nodes that follow each other besides the mean */
ONE_LOOP void widen_line(const float *x[SLOPE_NODES], const float *y[SLOPE_NODES],
                         const float *z[SLOPE_NODES], SlopeRow means[SURFACE_BLOCK][3],
                         SlopeRow normal[3], SlopeRow flat, SlopeRow steep) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        Wide most = {flat[i], steep[i]};
        most = wider(most, normal, i, x[1][i] - x[0][i] - means[0][0][i],
                     y[1][i] - y[0][i] - means[0][1][i], z[1][i] - z[0][i] - means[0][2][i]);
        most = wider(most, normal, i, x[2][i] - x[1][i] - means[1][0][i],
                     y[2][i] - y[1][i] - means[1][1][i], z[2][i] - z[1][i] - means[1][2][i]);
        most = wider(most, normal, i, x[3][i] - x[2][i] - means[2][0][i],
                     y[3][i] - y[2][i] - means[2][1][i], z[3][i] - z[2][i] - means[2][2][i]);
        flat[i] = most.flat, steep[i] = most.steep;
    }
}

ONE_LOOP void widen_all(const SlopeFit *fit, Places x[3], SlopeRow mean[2][3], SlopeRow normal[3],
                        SlopeRow flat[2], SlopeRow steep[2]) {
    SlopeRow means[2][SURFACE_BLOCK][3];
    spread_mean(fit->cells[0] + fit->at, mean[0], means[0]);
    spread_mean(fit->cells[1] + fit->at, mean[1], means[1]);
    for (int m = 0; m < SLOPE_NODES; m++) {
        const float *line[3][SLOPE_NODES];
        for (int a = 0; a < 3; a++) {
            for (int k = 0; k < SLOPE_NODES; k++) {
                line[a][k] = x[a][k][m];
            }
        }
        widen_line(x[0][m], x[1][m], x[2][m], means[0], normal, flat[0], steep[0]);
        widen_line(line[0], line[1], line[2], means[1], normal, flat[1], steep[1]);
    }
}

static void fit_blocks(SlopeFit *fit) {
    Places x[3];
    SlopeRow far = {0.0f}, mean[2][3], normal[3];
    SlopeRow flat[2] = {{0.0f}}, steep[2] = {{0.0f}};
    for (int n = 0; n < SLOPE_NODES * SLOPE_NODES; n++) {
        int m = n / SLOPE_NODES, k = n % SLOPE_NODES;
        for (int a = 0; a < 3; a++) {
            x[a][m][k] = fit->node[m][k][a] + fit->at;
        }
    }
    for (int a = 0; a < 3; a++) {
        bound(fit, x[a], a, far);
        find_mean(fit, x[a], mean[0][a], mean[1][a]);
    }
    float ru = (float)(1.0 / fit->h[0]), rv = (float)(1.0 / fit->h[1]);
    float *to[SLOPE_ROWS];
    for (int r = 0; r < SLOPE_ROWS; r++) {
        to[r] = fit->slopes.row[r] + fit->at;
    }
    find_normal(mean[0], mean[1], normal);
    widen_all(fit, x, mean, normal, flat, steep);
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        float off = SLOPE_ROUNDING * (ru + rv) * far[i];
        float within = ru * ru * flat[0][i] + rv * rv * flat[1][i];
        float across = ru * ru * steep[0][i] + rv * rv * steep[1][i];
        to[SLOPE_FLAT][i] = __builtin_sqrtf(within) + off;
        to[SLOPE_STEEP][i] = __builtin_sqrtf(across) + off;
    }
    for (int a = 0; a < 3; a++) {
        VECTOR_LOOP
        for (int i = 0; i < SLOPE_BATCH; i++) {
            to[SLOPE_MEAN + a][i] = ru * mean[0][a][i];
            to[SLOPE_MEAN + 3 + a][i] = rv * mean[1][a][i];
            to[SLOPE_NORMAL + a][i] = normal[a][i];
        }
    }
}

/* ---- blocks of blocks ---- */

typedef const float *Part[SLOPE_ROWS];

/* mean and plane */
ONE_LOOP void find_middle(Part part[SLOPE_PARTS], SlopeRow mean[6], SlopeRow normal[3]) {
    for (int r = 0; r < 6; r++) {
        const float *a = part[0][r], *b = part[1][r], *c = part[2][r], *d = part[3][r];
        VECTOR_LOOP
        for (int i = 0; i < SLOPE_BATCH; i++) {
            mean[r][i] = 0.25f * ((a[i] + b[i]) + (c[i] + d[i]));
        }
    }
    find_normal(mean, mean + 3, normal);
}

/* What differs of a part. What leaves the plane of a part shows in that of all by the sine of the angle of both
 * planes. */
ONE_LOOP void widen_by(Part part, SlopeRow mean[6], SlopeRow normal[3], SlopeRow flat,
                       SlopeRow steep) {
    const float *own_flat = part[SLOPE_FLAT], *own_steep = part[SLOPE_STEEP];
    const float *u[3] = {part[0], part[1], part[2]}, *v[3] = {part[3], part[4], part[5]};
    const float *own[3] = {part[SLOPE_NORMAL], part[SLOPE_NORMAL + 1], part[SLOPE_NORMAL + 2]};
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        float nx = normal[0][i], ny = normal[1][i], nz = normal[2][i];
        float px = own[0][i], py = own[1][i], pz = own[2][i];
        float tx = py * nz - pz * ny, ty = pz * nx - px * nz, tz = px * ny - py * nx;
        float cosine = size_of(px * nx + py * ny + pz * nz);
        float sine = __builtin_sqrtf(tx * tx + ty * ty + tz * tz);
        float ax = u[0][i] - mean[0][i], ay = u[1][i] - mean[1][i], az = u[2][i] - mean[2][i];
        float bx = v[0][i] - mean[3][i], by = v[1][i] - mean[4][i], bz = v[2][i] - mean[5][i];
        float a = nx * ax + ny * ay + nz * az, b = nx * bx + ny * by + nz * bz;
        ax -= a * nx, ay -= a * ny, az -= a * nz, bx -= b * nx, by -= b * ny, bz -= b * nz;
        float square = (ax * ax + ay * ay + az * az) + (bx * bx + by * by + bz * bz);
        float within = __builtin_sqrtf(square) + own_flat[i] + sine * own_steep[i];
        float across = __builtin_sqrtf(a * a + b * b) + cosine * own_steep[i] + sine * own_flat[i];
        flat[i] = larger(flat[i], within);
        steep[i] = larger(steep[i], across);
    }
}

/* what is off by rounding, of blocks with this mean that differ by so much from it */
ONE_LOOP float rounding_of(SlopeRow mean[6], int i, float flat, float steep) {
    float u = size_of(mean[0][i]) + size_of(mean[1][i]) + size_of(mean[2][i]);
    float v = size_of(mean[3][i]) + size_of(mean[4][i]) + size_of(mean[5][i]);
    return SLOPE_ROUNDING * (u + v + flat + steep);
}

/* blocks in turn */
ONE_LOOP void split(const float *row, SlopeRow even, SlopeRow odd) {
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        even[i] = row[2 * i], odd[i] = row[2 * i + 1];
    }
}

static void join_blocks(const SlopeField *fine, int low, int high, const SlopeField *out, int at) {
    Part parts[SLOPE_PARTS];
    SlopeRow own[SLOPE_PARTS][SLOPE_ROWS], mean[6], normal[3], flat = {0.0f}, steep = {0.0f};
    for (int k = 0; k < 2 * SLOPE_ROWS; k++) {
        int first = k < SLOPE_ROWS ? 0 : 2, r = k % SLOPE_ROWS;
        split(fine->row[r] + (first == 0 ? low : high), own[first][r], own[first + 1][r]);
        parts[first][r] = own[first][r], parts[first + 1][r] = own[first + 1][r];
    }
    find_middle(parts, mean, normal);
    for (int k = 0; k < SLOPE_PARTS; k++) {
        widen_by(parts[k], mean, normal, flat, steep);
    }
    float *to_flat = out->row[SLOPE_FLAT] + at, *to_steep = out->row[SLOPE_STEEP] + at;
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        float off = rounding_of(mean, i, flat[i], steep[i]);
        to_flat[i] = flat[i] + off, to_steep[i] = steep[i] + off;
    }
    for (int r = 0; r < SLOPE_FLAT; r++) {
        float *to = out->row[r] + at, *from = r < SLOPE_NORMAL ? mean[r] : normal[r - SLOPE_NORMAL];
        VECTOR_LOOP
        for (int i = 0; i < SLOPE_BATCH; i++) {
            to[i] = from[i];
        }
    }
}

static void find_windows(const SlopeField *field, int pitch, int at, float *least) {
    Part parts[SLOPE_PARTS];
    SlopeRow mean[6], normal[3], flat = {0.0f}, steep = {0.0f};
    for (int r = 0; r < SLOPE_ROWS; r++) {
        const float *low = field->row[r] + at, *high = low + pitch;
        parts[0][r] = low, parts[1][r] = low + 1, parts[2][r] = high, parts[3][r] = high + 1;
    }
    find_middle(parts, mean, normal);
    for (int k = 0; k < SLOPE_PARTS; k++) {
        widen_by(parts[k], mean, normal, flat, steep);
    }
    VECTOR_LOOP
    for (int i = 0; i < SLOPE_BATCH; i++) {
        float ux = mean[0][i], uy = mean[1][i], uz = mean[2][i];
        float vx = mean[3][i], vy = mean[4][i], vz = mean[5][i];
        float p = ux * ux + uy * uy + uz * uz, q = vx * vx + vy * vy + vz * vz;
        float r = ux * vx + uy * vy + uz * vz, half = 0.5f * (p - q);
        float square = 0.5f * (p + q) - __builtin_sqrtf(half * half + r * r);
        square = larger(square - SLOPE_ROUNDING * (p + q), 0.0f);
        least[at + i] = __builtin_sqrtf(square) - flat[i] - rounding_of(mean, i, flat[i], steep[i]);
    }
}

const SlopeKernel VECTOR_JOIN(slope_kernel_, VECTOR_VARIANT) = {pack_nodes, fit_blocks, join_blocks,
                                                                find_windows};
