/* Do two triangles cross? Quick certificates that they do not, then signs of determinants. */
#include "sim/geom/crossing.h"

#include "sim/geom/exact.h"

/* A sum of three products of rounded differences is known to 5 units of the sum of their sizes;
 * with room for the second order. [Higham 2002, section 3.1] */
#define DOT_BOUND (8.0 * 0x1p-53)
#define DOT_SMALLEST 1e-290 /* underflow of a product loses 2^-1074 */

static bool same_point(const double *a, const double *b) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* ---- in a plane, seen along axis `drop` ---- */

static bool ranges_overlap(double a, double b, double c, double d) {
    return fmin(a, b) <= fmax(c, d) && fmin(c, d) <= fmax(a, b);
}

/* closed segments pq and rs, points allowed: each straddles or touches the line of the other, and
 * their boxes meet (which alone decides when all is collinear) */
static bool segments_meet_2d(const double *p, const double *q, const double *r, const double *s,
                             int drop) {
    int i = (drop + 1) % 3, j = (drop + 2) % 3;
    return ranges_overlap(p[i], q[i], r[i], s[i]) && ranges_overlap(p[j], q[j], r[j], s[j]) &&
           exact_orient2d(p, q, r, drop) * exact_orient2d(p, q, s, drop) <= 0 &&
           exact_orient2d(r, s, p, drop) * exact_orient2d(r, s, q, drop) <= 0;
}

static bool point_in_2d(const double *p, const CrossingTriangle *t, int drop) {
    int least = 1, most = -1;
    for (int k = 0; k < 3; k++) {
        int sign = exact_orient2d(t->corner[k], t->corner[(k + 1) % 3], p, drop);
        least = sign < least ? sign : least;
        most = sign > most ? sign : most;
    }
    return least * most >= 0;
}

static bool segment_meets_2d(const double *p, const double *q, const CrossingTriangle *t,
                             int drop) {
    for (int k = 0; k < 3; k++) {
        if (segments_meet_2d(p, q, t->corner[k], t->corner[(k + 1) % 3], drop)) {
            return true;
        }
    }
    return point_in_2d(p, t, drop);
}

/* An axis along which the triangle shows area, the most likely one first; -1: it has none. */
static int view_axis(const CrossingTriangle *t) {
    Vec3 a = vec3_load(t->corner[0]);
    Vec3 n = vec3_cross(vec3_sub(vec3_load(t->corner[1]), a), vec3_sub(vec3_load(t->corner[2]), a));
    double size[3] = {fabs(n.x), fabs(n.y), fabs(n.z)};
    int best = size[0] > size[1] ? (size[0] > size[2] ? 0 : 2) : size[1] > size[2] ? 1 : 2;
    for (int k = 0; k < 3; k++) {
        int axis = (best + k) % 3;
        if (exact_orient2d(t->corner[0], t->corner[1], t->corner[2], axis) != 0) {
            return axis;
        }
    }
    return -1;
}

/* ---- without area ---- */

/* The segment that three collinear points span: its ends are the first and last in the order of
 * (x, y, z). */
static void span_of(const CrossingTriangle *t, const double *ends[2]) {
    ends[0] = ends[1] = t->corner[0];
    for (int k = 1; k < 3; k++) {
        const double *p = t->corner[k];
        for (int side = 0; side < 2; side++) {
            const double *end = ends[side];
            int axis = p[0] != end[0] ? 0 : p[1] != end[1] ? 1 : 2;
            if (side == 0 ? p[axis] < end[axis] : p[axis] > end[axis]) {
                ends[side] = p;
            }
        }
    }
}

static bool segments_meet(const double *p, const double *q, const double *r, const double *s) {
    for (int i = 0; i < 3; i++) {
        if (!ranges_overlap(p[i], q[i], r[i], s[i])) {
            return false;
        }
    }
    if (exact_orient3d(p, q, r, s) != 0) {
        return false;
    }
    for (int axis = 0; axis < 3; axis++) {
        if (exact_orient2d(p, q, r, axis) || exact_orient2d(p, q, s, axis) ||
            exact_orient2d(r, s, p, axis) || exact_orient2d(r, s, q, axis)) {
            return segments_meet_2d(p, q, r, s, axis);
        }
    }
    return true; /* collinear, and the boxes meet */
}

/* ---- in space ---- */

static int plane_side(const CrossingTriangle *t, const double *p) {
    return exact_orient3d(t->corner[0], t->corner[1], t->corner[2], p);
}

bool crossing_segment(const double p[3], const double q[3], const CrossingTriangle *t) {
    int side_p = plane_side(t, p), side_q = plane_side(t, q);
    if (side_p * side_q > 0) {
        return false;
    }
    if (side_p == 0 && side_q == 0) {
        int axis = view_axis(t);
        if (axis >= 0) {
            return segment_meets_2d(p, q, t, axis);
        }
        const double *ends[2];
        span_of(t, ends);
        return segments_meet(p, q, ends[0], ends[1]);
    }
    /* the line meets the plane in one point: on the same side of all three edges? */
    int least = 1, most = -1;
    for (int k = 0; k < 3; k++) {
        int sign = exact_orient3d(p, q, t->corner[k], t->corner[(k + 1) % 3]);
        least = sign < least ? sign : least;
        most = sign > most ? sign : most;
    }
    return least * most >= 0;
}

/* In one plane, or one of them without area. */
static bool flat_triangles(const CrossingTriangle *a, const CrossingTriangle *b) {
    int axis_a = view_axis(a), axis_b = view_axis(b);
    if (axis_a < 0 || axis_b < 0) {
        const CrossingTriangle *thin = axis_a < 0 ? a : b, *other = axis_a < 0 ? b : a;
        const double *ends[2];
        span_of(thin, ends);
        return crossing_segment(ends[0], ends[1], other);
    }
    for (int k = 0; k < 3; k++) {
        if (segment_meets_2d(a->corner[k], a->corner[(k + 1) % 3], b, axis_b)) {
            return true;
        }
    }
    return point_in_2d(b->corner[0], a, axis_b);
}

/* ---- certificates in plain doubles, proven by an error bound ---- */

/* Range of n . (p - origin) over the corners, widened by the rounding. */
static void project(const CrossingTriangle *t, Vec3 n, Vec3 origin, double *low, double *high) {
    *low = INFINITY, *high = -INFINITY;
    for (int k = 0; k < 3; k++) {
        Vec3 p = vec3_sub(vec3_load(t->corner[k]), origin);
        double x = n.x * p.x, y = n.y * p.y, z = n.z * p.z;
        double dot = x + y + z, doubt = DOT_BOUND * (fabs(x) + fabs(y) + fabs(z)) + DOT_SMALLEST;
        if (!isfinite(doubt)) { /* overflow: nothing is known */
            *low = -INFINITY, *high = INFINITY;
            return;
        }
        *low = fmin(*low, dot - doubt);
        *high = fmax(*high, dot + doubt);
    }
}

static bool separated_along(const CrossingTriangle *a, const CrossingTriangle *b, Vec3 n) {
    double low_a, high_a, low_b, high_b;
    Vec3 origin = vec3_load(a->corner[0]);
    project(a, n, origin, &low_a, &high_a);
    project(b, n, origin, &low_b, &high_b);
    return high_a < low_b || high_b < low_a;
}

static Vec3 edge_of(const CrossingTriangle *t, int k) {
    return vec3_sub(vec3_load(t->corner[(k + 1) % 3]), vec3_load(t->corner[k]));
}

static Vec3 sum_of(const CrossingTriangle *t) {
    return vec3_add(vec3_load(t->corner[0]),
                    vec3_add(vec3_load(t->corner[1]), vec3_load(t->corner[2])));
}

/* True: a plane between them was found. The plane across the line of the centres, the planes of
 * both, and for neighbours in one plane those upright on their edges. */
static bool separated(const CrossingTriangle *a, const CrossingTriangle *b) {
    if (separated_along(a, b, vec3_sub(sum_of(b), sum_of(a)))) {
        return true;
    }
    const CrossingTriangle *both[2] = {a, b};
    Vec3 normal[2];
    for (int i = 0; i < 2; i++) {
        normal[i] = vec3_cross(edge_of(both[i], 0), edge_of(both[i], 1));
        if (separated_along(a, b, normal[i])) {
            return true;
        }
    }
    for (int k = 0; k < 6; k++) {
        if (separated_along(a, b, vec3_cross(edge_of(both[k / 3], k % 3), normal[k / 3]))) {
            return true;
        }
    }
    return false;
}

/* The corners 1 and 2 of both lie strictly on two sides of a plane through the shared corner 0. */
static bool cones_separated(const CrossingTriangle *a, const CrossingTriangle *b) {
    Vec3 apex = vec3_load(a->corner[0]), arm[4], zero = {0, 0, 0};
    for (int k = 0; k < 4; k++) {
        arm[k] = vec3_sub(vec3_load((k < 2 ? a : b)->corner[1 + k % 2]), apex);
    }
    Vec3 n = zero;
    for (int k = 0; k < 4; k++) {
        n = vec3_axpy(n, k < 2 ? -1.0 : 1.0, vec3_unit(arm[k], zero));
    }
    for (int k = 0; k < 4; k++) {
        double x = n.x * arm[k].x, y = n.y * arm[k].y, z = n.z * arm[k].z;
        double dot = (x + y + z) * (k < 2 ? -1.0 : 1.0);
        if (!(dot > DOT_BOUND * (fabs(x) + fabs(y) + fabs(z)) + DOT_SMALLEST)) {
            return false;
        }
    }
    return true;
}

/* ---- pairs ---- */

static bool strictly_one_side(const int side[3]) {
    return side[0] && side[0] == side[1] && side[1] == side[2];
}

static bool edge_hits(const CrossingTriangle *a, const CrossingTriangle *b) {
    for (int k = 0; k < 3; k++) {
        if (crossing_segment(a->corner[k], a->corner[(k + 1) % 3], b)) {
            return true;
        }
    }
    return false;
}

bool crossing_triangles(const CrossingTriangle *a, const CrossingTriangle *b) {
    if (separated(a, b)) {
        return false;
    }
    int side_a[3], side_b[3];
    for (int k = 0; k < 3; k++) {
        side_a[k] = plane_side(b, a->corner[k]);
    }
    if (strictly_one_side(side_a)) {
        return false;
    }
    for (int k = 0; k < 3; k++) {
        side_b[k] = plane_side(a, b->corner[k]);
    }
    if (strictly_one_side(side_b)) {
        return false;
    }
    bool flat =
        (!side_a[0] && !side_a[1] && !side_a[2]) || (!side_b[0] && !side_b[1] && !side_b[2]);
    return flat ? flat_triangles(a, b) : edge_hits(a, b) || edge_hits(b, a);
}

/* b on the ray from a through d, b and d not a */
static bool same_ray(const double *a, const double *b, const double *d) {
    for (int i = 0; i < 3; i++) {
        if (exact_orient2d(a, b, d, i) != 0) {
            return false;
        }
    }
    int axis = b[0] != a[0] ? 0 : b[1] != a[1] ? 1 : 2;
    return (b[axis] > a[axis] && d[axis] > a[axis]) || (b[axis] < a[axis] && d[axis] < a[axis]);
}

/* Does the ray from corner 0 of t through b run inside t at first? */
static bool ray_in_cone(const double *b, const CrossingTriangle *t) {
    const double *a = t->corner[0], *d = t->corner[1], *e = t->corner[2];
    if (same_point(a, b)) {
        return false;
    }
    int axis = view_axis(t);
    if (axis < 0) {
        return same_ray(a, b, d) || same_ray(a, b, e);
    }
    int turn = exact_orient2d(a, d, e, axis);
    return plane_side(t, b) == 0 && exact_orient2d(a, d, b, axis) * turn >= 0 &&
           exact_orient2d(a, b, e, axis) * turn >= 0;
}

/* Sharing corner 0: they cross when their cones there have a ray in common. With areas, that ray
 * leaves one of the two through the edge opposite to the corner. */
static bool sharing_corner(const CrossingTriangle *a, const CrossingTriangle *b) {
    if (cones_separated(a, b)) {
        return false;
    }
    bool thin_a = view_axis(a) < 0, thin_b = view_axis(b) < 0;
    if (thin_a || thin_b) {
        const CrossingTriangle *thin = thin_a ? a : b, *other = thin_a ? b : a;
        return ray_in_cone(thin->corner[1], other) || ray_in_cone(thin->corner[2], other);
    }
    return crossing_segment(a->corner[1], a->corner[2], b) ||
           crossing_segment(b->corner[1], b->corner[2], a);
}

/* The part of `thin` beyond the shared edge, at one of its ends. */
static bool thin_beyond(const CrossingTriangle *thin, const CrossingTriangle *other) {
    for (int end = 0; end < 2; end++) {
        const double *at = thin->corner[end], *far = thin->corner[1 - end], *c = thin->corner[2];
        CrossingTriangle turned = {{at, far, other->corner[2]}};
        bool beyond = !same_point(at, c) && (same_point(at, far) || !same_ray(at, far, c));
        if (beyond && ray_in_cone(c, &turned)) {
            return true;
        }
    }
    return false;
}

/* Sharing the edge of corners 0 and 1: they cross when they lie in one plane on one side of it. */
static bool sharing_edge(const CrossingTriangle *a, const CrossingTriangle *b) {
    const double *p = a->corner[0], *q = a->corner[1], *c = a->corner[2], *d = b->corner[2];
    int axis_a = view_axis(a), axis_b = view_axis(b);
    if (axis_a < 0 || axis_b < 0) {
        return axis_a < 0 ? thin_beyond(a, b) : thin_beyond(b, a);
    }
    int side_c = exact_orient2d(p, q, c, axis_a), side_d = exact_orient2d(p, q, d, axis_a);
    if (side_c * side_d < 0) {
        return false;
    }
    /* side_d is 0 when b stands upright on the view of a: then they share no plane */
    return side_d != 0 && exact_orient3d(p, q, c, d) == 0;
}

bool crossing_triangles_sharing(const CrossingTriangle *a, const CrossingTriangle *b, int shared) {
    switch (shared) {
    case 0:
        return crossing_triangles(a, b);
    case 1:
        return sharing_corner(a, b);
    case 2:
        return sharing_edge(a, b);
    default:
        return true; /* twice the same triangle */
    }
}
