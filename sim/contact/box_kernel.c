/* box_kernel.c: the row loops of box_batch.h. Compiled once per vector width (see the Makefile). What
 * solid.c and solid_triangle.c find by branches is found here by choosing among all cases, by the same
 * operations. */
#include "sim/contact/box_batch.h"

#include <math.h>

/* the least distance along a side, corner by corner of the triangle */
typedef struct Side {
    BoxRow along[3], asked; /* asked: 1 where the distance falls from both ends */
    BoxRow low, high;       /* share of the way: between the ends of a piece */
} Side;

static inline double dot(double ax, double ay, double az, double bx, double by, double bz) {
    return ax * bx + ay * by + az * bz;
}

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline double signed_as(double a, double b) { return __builtin_copysign(a, b); }

/* a point of every triangle, and what is known there */
typedef struct Spots {
    BoxRow at[3], normal[3], distance;
} Spots;

/* distance_box, outside of the core */
static void measure_outside(const BoxRows *rows, Spots *spots, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double x = spots->at[0][k], y = spots->at[1][k], z = spots->at[2][k];
        double ox = larger(__builtin_fabs(x) - rows->core[0][k], 0.0);
        double oy = larger(__builtin_fabs(y) - rows->core[1][k], 0.0);
        double oz = larger(__builtin_fabs(z) - rows->core[2][k], 0.0);
        double outside = __builtin_sqrt(dot(ox, oy, oz, ox, oy, oz));
        spots->normal[0][k] = signed_as(1.0, x) * ox / outside;
        spots->normal[1][k] = signed_as(1.0, y) * oy / outside;
        spots->normal[2][k] = signed_as(1.0, z) * oz / outside;
        spots->distance[k] = outside;
    }
}

/* ... and within it or over a top */
static void measure(const BoxRows *rows, Spots *spots, int count) {
    measure_outside(rows, spots, count);
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double x = spots->at[0][k], y = spots->at[1][k], z = spots->at[2][k];
        double qx = __builtin_fabs(x) - rows->core[0][k], qy = __builtin_fabs(y) - rows->core[1][k];
        double qz = __builtin_fabs(z) - rows->core[2][k], distance = spots->distance[k];
        double nx = spots->normal[0][k], ny = spots->normal[1][k], nz = spots->normal[2][k];
        int is_in = distance <= 0.0, is_top = (qx <= 0.0) & (qy <= 0.0) & (qz > 0.0);
        int by_x = is_in & (qx >= qy) & (qx >= qz), by_y = qy >= qz;
        double iy = by_y ? signed_as(1.0, y) : 0.0, iz = by_y ? 0.0 : signed_as(1.0, z);
        nx = is_in ? 0.0 : nx, ny = is_in ? iy : ny, nz = is_in ? iz : nz;
        nx = by_x ? signed_as(1.0, x) : nx, ny = by_x ? 0.0 : ny, nz = by_x ? 0.0 : nz;
        distance = is_in ? larger(qy, qz) : distance, distance = by_x ? qx : distance;
        spots->normal[0][k] = is_top ? 0.0 : nx, spots->normal[1][k] = is_top ? 0.0 : ny;
        spots->normal[2][k] = is_top ? signed_as(1.0, z) : nz;
        spots->distance[k] = (is_top ? qz : distance) - rows->radius[k];
    }
}

/* where `yes`; what is there is read in any case, since a store in a branch would keep the loop from vectors */
static inline void put(double *place, int yes, double value) {
    double before = *place;
    *place = yes ? value : before;
}

static inline void take(BoxRows *rows, int k, int yes, const Spots *spots, double feature) {
    put(&rows->point[0][k], yes, spots->at[0][k]);
    put(&rows->point[1][k], yes, spots->at[1][k]);
    put(&rows->point[2][k], yes, spots->at[2][k]);
    put(&rows->normal[0][k], yes, spots->normal[0][k]);
    put(&rows->normal[1][k], yes, spots->normal[1][k]);
    put(&rows->normal[2][k], yes, spots->normal[2][k]);
    put(&rows->distance[k], yes, spots->distance[k]);
    put(&rows->feature[k], yes, feature);
}

/* the nearest corner */
static void choose_corner(BoxRows *rows, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double a = rows->height[0][k], b = rows->height[1][k], c = rows->height[2][k];
        int first = a <= b;
        double low = first ? a : b, w0 = first ? 1.0 : 0.0, w1 = first ? 0.0 : 1.0;
        double feature = first ? 1.0 : 2.0;
        int third = c < low;
        rows->weight[0][k] = third ? 0.0 : w0;
        rows->weight[1][k] = third ? 0.0 : w1;
        rows->weight[2][k] = third ? 1.0 : 0.0;
        rows->feature[k] = third ? 4.0 : feature;
        rows->distance[k] = third ? c : low;
        rows->within[k] = rows->lower[k] = 0.0;
        rows->side_distance[0][k] = rows->side_distance[1][k] = rows->side_distance[2][k] =
            (double)INFINITY;
    }
    for (int a = 0; a < 3; a++) {
        VECTOR_LOOP
        for (int k = 0; k < count; k++) {
            int first = rows->weight[0][k] > 0.0, third = rows->weight[2][k] > 0.0;
            double x = first ? rows->x[0][a][k] : rows->x[1][a][k];
            double n = first ? rows->up[0][a][k] : rows->up[1][a][k];
            rows->point[a][k] = third ? rows->x[2][a][k] : x;
            rows->normal[a][k] = third ? rows->up[2][a][k] : n;
        }
    }
}

/* the side from corner a to corner b; is one asked for? */
static bool begin_side(const BoxRows *rows, int a, int b, Side *side, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double x = rows->x[b][0][k] - rows->x[a][0][k], y = rows->x[b][1][k] - rows->x[a][1][k];
        double z = rows->x[b][2][k] - rows->x[a][2][k];
        double from = dot(rows->up[a][0][k], rows->up[a][1][k], rows->up[a][2][k], x, y, z);
        double to = dot(rows->up[b][0][k], rows->up[b][1][k], rows->up[b][2][k], x, y, z);
        double level = SOLID_LEVEL * __builtin_sqrt(dot(x, y, z, x, y, z));
        side->along[0][k] = x, side->along[1][k] = y, side->along[2][k] = z;
        side->asked[k] = (from < -level) & (to > level) ? 1.0 : 0.0;
        side->low[k] = 0.0, side->high[k] = 1.0;
    }
    bool some = false;
    for (int k = 0; k < count; k++) {
        some = some || side->asked[k] > 0.0;
    }
    return some;
}

/* box_slope, one axis of it: half the slope at p + s t, and its own */
static inline void add_slope(double core, double p, double t, double s, double *slope,
                             double *rise) {
    double q = p + s * t;
    int out = __builtin_fabs(q) > core;
    *slope += out ? t * (q - signed_as(core, q)) : 0.0;
    *rise += out ? t * t : 0.0;
}

static inline double slope_at(const BoxRows *rows, int a, const Side *side, int k, double s,
                              double *rise) {
    double slope = 0.0;
    *rise = 0.0;
    add_slope(rows->core[0][k], rows->x[a][0][k], side->along[0][k], s, &slope, rise);
    add_slope(rows->core[1][k], rows->x[a][1][k], side->along[1][k], s, &slope, rise);
    add_slope(rows->core[2][k], rows->x[a][2][k], side->along[2][k], s, &slope, rise);
    return slope;
}

/* one piece ends where the side crosses the border of the core at sign core[c] */
static void cut_side(const BoxRows *rows, int a, int c, double sign, Side *side, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double border = sign * rows->core[c][k] - rows->x[a][c][k], t = side->along[c][k];
        double at = border / t, rise, low = side->low[k], high = side->high[k];
        double slope = slope_at(rows, a, side, k, at, &rise);
        int up = (border > 0.0) & (border < t), down = (border <= 0.0) & (border >= t);
        int cuts = (up | down) & (at > low) & (at < high), rises = slope > 0.0;
        side->low[k] = cuts & !rises ? at : low;
        side->high[k] = cuts & rises ? at : high;
    }
}

static void keep_side(BoxRows *rows, int a, int b, const Side *side, const Spots *spots,
                      const BoxRow at, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        int asked = side->asked[k] > 0.0;
        double ends = smaller(rows->height[a][k], rows->height[b][k]);
        rows->side_at[a][k] = at[k];
        rows->side_lower[a][k] = ends - spots->distance[k];
        put(&rows->side_distance[a][k], asked, spots->distance[k]);
        rows->side_normal[a][0][k] = spots->normal[0][k];
        rows->side_normal[a][1][k] = spots->normal[1][k];
        rows->side_normal[a][2][k] = spots->normal[2][k];
    }
}

static void end_side(BoxRows *rows, int a, int b, const Side *side, int count) {
    double feature = (1 << a) | (1 << b);
    double *restrict of_a = rows->weight[a], *restrict of_b = rows->weight[b];
    double *restrict of_other = rows->weight[3 - a - b];
    Spots spots;
    BoxRow at;
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double low = side->low[k], high = side->high[k], middle = 0.5 * (low + high), rise;
        double slope = slope_at(rows, a, side, k, middle, &rise);
        double share = smaller(larger(middle - slope / rise, low), high);
        at[k] = share;
        spots.at[0][k] = rows->x[a][0][k] + share * side->along[0][k];
        spots.at[1][k] = rows->x[a][1][k] + share * side->along[1][k];
        spots.at[2][k] = rows->x[a][2][k] + share * side->along[2][k];
        put(&rows->within[k], (side->asked[k] > 0.0) & (rise <= 0.0), 1.0);
    }
    measure(rows, &spots, count);
    keep_side(rows, a, b, side, &spots, at, count);
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        int nearer = (side->asked[k] > 0.0) & (spots.distance[k] < rows->distance[k]);
        put(&of_a[k], nearer, 1.0 - at[k]), put(&of_b[k], nearer, at[k]);
        put(&of_other[k], nearer, 0.0);
        take(rows, k, nearer, &spots, feature);
    }
}

static inline double fall_to(const BoxRows *rows, int corner, int k) {
    double x = rows->x[corner][0][k] - rows->point[0][k];
    double y = rows->x[corner][1][k] - rows->point[1][k];
    double z = rows->x[corner][2][k] - rows->point[2][k];
    return dot(rows->normal[0][k], rows->normal[1][k], rows->normal[2][k], x, y, z) +
           SOLID_LEVEL * __builtin_sqrt(dot(x, y, z, x, y, z));
}

/* how much the distance falls from the nearest point to a corner, as a number below 0; does one fall? */
static bool find_falls(const BoxRows *rows, BoxRow falls, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double to_b = smaller(fall_to(rows, 1, k), fall_to(rows, 2, k));
        falls[k] = smaller(fall_to(rows, 0, k), to_b);
    }
    bool some = false;
    for (int k = 0; k < count; k++) {
        some = some || falls[k] < 0.0;
    }
    return some;
}

/* the inside of the face, below the support point: its weights; 1: that point is within */
typedef struct Face {
    BoxRow weight[3], holds;
} Face;

static void find_face(const BoxRows *rows, Face *face, Spots *spots, int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        double ax = rows->x[0][0][k], ay = rows->x[0][1][k], az = rows->x[0][2][k];
        double bx = rows->x[1][0][k], by = rows->x[1][1][k], bz = rows->x[1][2][k];
        double cx = rows->x[2][0][k], cy = rows->x[2][1][k], cz = rows->x[2][2][k];
        double ux = bx - ax, uy = by - ay, uz = bz - az, vx = cx - ax, vy = cy - ay, vz = cz - az;
        double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        double area2 = dot(nx, ny, nz, nx, ny, nz), radius = rows->radius[k];
        double turn = dot(nx, ny, nz, rows->normal[0][k], rows->normal[1][k], rows->normal[2][k]);
        double scale = (turn < 0.0 ? -1.0 : 1.0) / __builtin_sqrt(area2);
        nx = scale * nx, ny = scale * ny, nz = scale * nz;
        double rx = signed_as(rows->core[0][k], nx) + radius * nx - ax;
        double ry = signed_as(rows->core[1][k], ny) + radius * ny - ay;
        double rz = signed_as(rows->core[2][k], nz) + radius * nz - az;
        double a = dot(ux, uy, uz, ux, uy, uz), b = dot(ux, uy, uz, vx, vy, vz);
        double c = dot(vx, vy, vz, vx, vy, vz), p = dot(ux, uy, uz, rx, ry, rz);
        double q = dot(vx, vy, vz, rx, ry, rz), det = a * c - b * b;
        double w1 = (c * p - b * q) / det, w2 = (a * q - b * p) / det, w0 = 1.0 - w1 - w2;
        int inside = (area2 > 0.0) & (w0 > 0.0) & (w1 > 0.0) & (w2 > 0.0);
        face->weight[0][k] = w0, face->weight[1][k] = w1, face->weight[2][k] = w2;
        face->holds[k] = inside ? 1.0 : 0.0;
        spots->at[0][k] = w0 * ax + w1 * bx + w2 * cx;
        spots->at[1][k] = w0 * ay + w1 * by + w2 * cy;
        spots->at[2][k] = w0 * az + w1 * bz + w2 * cz;
    }
}

static void search_face(BoxRows *rows, int count) {
    Face face;
    Spots spots;
    BoxRow falls;
    if (!find_falls(rows, falls, count)) {
        return;
    }
    find_face(rows, &face, &spots, count);
    measure(rows, &spots, count);
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        int is_face = (falls[k] < 0.0) & (face.holds[k] > 0.0);
        put(&rows->weight[0][k], is_face, face.weight[0][k]);
        put(&rows->weight[1][k], is_face, face.weight[1][k]);
        put(&rows->weight[2][k], is_face, face.weight[2][k]);
        put(&rows->lower[k], is_face, rows->distance[k] - spots.distance[k]);
        take(rows, k, is_face, &spots, 7.0);
    }
}

static void search_side(BoxRows *rows, int a, int b, int count) {
    Side side;
    if (!begin_side(rows, a, b, &side, count)) {
        return;
    }
    for (int c = 0; c < 3; c++) {
        if (rows->across[c][0]) {
            cut_side(rows, a, c, -1.0, &side, count);
        }
        if (rows->across[c][1]) {
            cut_side(rows, a, c, 1.0, &side, count);
        }
    }
    end_side(rows, a, b, &side, count);
}

static void find_nearest(BoxRows *rows, int vectors) {
    int count = vectors * BOX_VECTOR;
    choose_corner(rows, count);
    search_side(rows, 0, 1, count);
    search_side(rows, 1, 2, count);
    search_side(rows, 2, 0, count);
    search_face(rows, count);
}

BoxKernel *const VECTOR_JOIN(box_kernel_, VECTOR_VARIANT) = find_nearest;
