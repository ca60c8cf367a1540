/* pair_kernel.c: the row loops of pair_batch.h. Compiled once per vector width (see the Makefile). What
 * closest.h finds by branches is found here by choosing among all cases, by the same operations. */
#include "sim/contact/constants.h"
#include "sim/contact/pair_batch.h"

static inline double dot(double ax, double ay, double az, double bx, double by, double bz) {
    return ax * bx + ay * by + az * bz;
}

static inline double unit_clamp(double x) {
    double low = x < 0.0 ? 0.0 : x;
    return low > 1.0 ? 1.0 : low;
}

/* component c of the vector between the closest points: differences first, no cancellation of large
 * coordinates */
static inline double apart(const PairRows *rows, int c, int k) {
    double last = rows->x[3][c][k], sum = 0.0 + rows->weight[0][k] * (rows->x[0][c][k] - last);
    sum = sum + rows->weight[1][k] * (rows->x[1][c][k] - last);
    return sum + rows->weight[2][k] * (rows->x[2][c][k] - last);
}

static void find_distances(PairRows *rows, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double x = apart(rows, 0, k), y = apart(rows, 1, k), z = apart(rows, 2, k);
        double distance = __builtin_sqrt(dot(x, y, z, x, y, z)), scale = 1.0 / distance;
        rows->distance[k] = distance;
        rows->normal[0][k] = scale * x, rows->normal[1][k] = scale * y;
        rows->normal[2][k] = scale * z;
    }
}

/* rows of closest_on_triangle */
static void faces(PairRows *rows, int vectors) {
    int count = vectors * PAIR_VECTOR;
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double px = rows->x[0][0][k], py = rows->x[0][1][k], pz = rows->x[0][2][k];
        double ax = rows->x[1][0][k], ay = rows->x[1][1][k], az = rows->x[1][2][k];
        double bx = rows->x[2][0][k], by = rows->x[2][1][k], bz = rows->x[2][2][k];
        double cx = rows->x[3][0][k], cy = rows->x[3][1][k], cz = rows->x[3][2][k];
        double ux = bx - ax, uy = by - ay, uz = bz - az;
        double vx = cx - ax, vy = cy - ay, vz = cz - az;
        double d1 = dot(ux, uy, uz, px - ax, py - ay, pz - az);
        double d2 = dot(vx, vy, vz, px - ax, py - ay, pz - az);
        double d3 = dot(ux, uy, uz, px - bx, py - by, pz - bz);
        double d4 = dot(vx, vy, vz, px - bx, py - by, pz - bz);
        double d5 = dot(ux, uy, uz, px - cx, py - cy, pz - cz);
        double d6 = dot(vx, vy, vz, px - cx, py - cy, pz - cz);
        double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
        double d43 = d4 - d3, d56 = d5 - d6;
        int at_a = (d1 <= 0.0) & (d2 <= 0.0), at_b = (d3 >= 0.0) & (d4 <= d3);
        int at_ab = (vc <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0), at_c = (d6 >= 0.0) & (d5 <= d6);
        int at_ac = (vb <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0);
        int at_bc = (va <= 0.0) & (d43 >= 0.0) & (d56 >= 0.0);
        double sum = va + vb + vc, over = at_ac ? d2 : d43, under = at_ac ? d2 - d6 : d43 + d56;
        double t = (at_ab ? d1 : over) / (at_ab ? d1 - d3 : under);
        double wb = vb / sum, wc = vc / sum, wa = 1.0 - wb - wc, feature = 7.0;
        wa = at_bc ? 0.0 : wa, wb = at_bc ? 1.0 - t : wb, wc = at_bc ? t : wc;
        feature = at_bc ? 6.0 : feature;
        wa = at_ac ? 1.0 - t : wa, wb = at_ac ? 0.0 : wb, wc = at_ac ? t : wc;
        feature = at_ac ? 5.0 : feature;
        wa = at_c ? 0.0 : wa, wb = at_c ? 0.0 : wb, wc = at_c ? 1.0 : wc;
        feature = at_c ? 4.0 : feature;
        wa = at_ab ? 1.0 - t : wa, wb = at_ab ? t : wb, wc = at_ab ? 0.0 : wc;
        feature = at_ab ? 3.0 : feature;
        wa = at_b ? 0.0 : wa, wb = at_b ? 1.0 : wb, wc = at_b ? 0.0 : wc;
        feature = at_b ? 2.0 : feature;
        wa = at_a ? 1.0 : wa, wb = at_a ? 0.0 : wb, wc = at_a ? 0.0 : wc;
        feature = at_a ? 1.0 : feature;
        rows->weight[0][k] = 1.0, rows->weight[1][k] = -wa;
        rows->weight[2][k] = -wb, rows->weight[3][k] = -wc;
        rows->feature[k] = feature;
    }
    find_distances(rows, count);
}

/* rows of closest_on_segments */
static void edges(PairRows *rows, int vectors) {
    int count = vectors * PAIR_VECTOR;
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double px = rows->x[0][0][k], py = rows->x[0][1][k], pz = rows->x[0][2][k];
        double qx = rows->x[2][0][k], qy = rows->x[2][1][k], qz = rows->x[2][2][k];
        double ux = rows->x[1][0][k] - px, uy = rows->x[1][1][k] - py, uz = rows->x[1][2][k] - pz;
        double vx = rows->x[3][0][k] - qx, vy = rows->x[3][1][k] - qy, vz = rows->x[3][2][k] - qz;
        double rx = px - qx, ry = py - qy, rz = pz - qz;
        double a = dot(ux, uy, uz, ux, uy, uz), e = dot(vx, vy, vz, vx, vy, vz);
        double b = dot(ux, uy, uz, vx, vy, vz), c = dot(ux, uy, uz, rx, ry, rz);
        double f = dot(vx, vy, vz, rx, ry, rz), both = a * e, det = both - b * b;
        det = det > 0.0 ? det : 0.0; /* rounding makes it negative for parallel segments */
        double sine2 = det / both, s = unit_clamp((b * f - c * e) / det);
        sine2 = both > 0.0 ? sine2 : 0.0, s = det > 0.0 ? s : 0.0;
        double t = (b * s + f) / e;
        t = e > 0.0 ? t : 0.0;
        double end = unit_clamp(t), back = unit_clamp((b * end - c) / a);
        back = a > 0.0 ? back : 0.0;
        s = end == t ? s : back, t = end;
        double inside_s = s > 0.0 ? 1.0 : 0.0, inside_t = t > 0.0 ? 2.0 : 0.0;
        inside_s = s < 1.0 ? inside_s : 0.0, inside_t = t < 1.0 ? inside_t : 0.0;
        double g = sine2 / CONTACT_PARALLEL;
        rows->weight[0][k] = 1.0 - s, rows->weight[1][k] = s;
        rows->weight[2][k] = t - 1.0, rows->weight[3][k] = -t;
        rows->feature[k] = inside_s + inside_t;
        rows->soft[k] = g < 1.0 ? g * (2.0 - g) : 1.0;
    }
    find_distances(rows, count);
}

const PairKernel VECTOR_JOIN(pair_kernel_, VECTOR_VARIANT) = {faces, edges};
