/* solid_triangle.c: where a triangle comes nearest to a convex solid. The signed distance d is
 * convex, and its gradient is the normal: a corner is the place if d does not fall towards the
 * other two; a point of a side if d does not fall towards the third corner; otherwise the place
 * is inside, where the normal is that of the triangle, below the solid's support point. Nearest to
 * a sphere is what is nearest to its middle. */
#include <stdbool.h>
#include <string.h>

#include "sim/geom/solid.h"

#define MOST_ROUNDS 60      /* of the search along a side: halves the bracket at worst */
#define SIDE_TOLERANCE 1e-9 /* of the side */

Vec3 solid_support_point(const Solid *solid, Vec3 d) {
    Vec3 half = solid->half;
    double r = solid->radius, across = sqrt(d.x * d.x + d.y * d.y);
    Vec3 rim = across > 0.0 ? vec3(r * d.x / across, r * d.y / across, 0) : vec3(0, 0, 0);
    switch (solid->kind) {
    case SOLID_SPHERE:
        return vec3_scale(r, d);
    case SOLID_BOX:
        return vec3_axpy(
            vec3(copysign(half.x - r, d.x), copysign(half.y - r, d.y), copysign(half.z - r, d.z)),
            r, d);
    case SOLID_CYLINDER:
        return vec3(rim.x, rim.y, copysign(half.z, d.z));
    case SOLID_CAPSULE:
        return vec3_axpy(vec3(0, 0, copysign(half.z, d.z)), r, d);
    case SOLID_CONE:
        return d.z * half.z > across * r - d.z * half.z ? vec3(0, 0, half.z)
                                                        : vec3(rim.x, rim.y, -half.z);
    case SOLID_PLANE:
        break;
    }
    return vec3(0, 0, 0);
}

double solid_flat_margin(const Solid *solid, Vec3 p) {
    if (solid->kind == SOLID_PLANE) {
        return INFINITY;
    }
    if (solid->kind != SOLID_BOX) {
        return 0.0;
    }
    double q[3] = {fabs(p.x) - (solid->half.x - solid->radius),
                   fabs(p.y) - (solid->half.y - solid->radius),
                   fabs(p.z) - (solid->half.z - solid->radius)};
    int top = q[0] >= q[1] && q[0] >= q[2] ? 0 : q[1] >= q[2] ? 1 : 2;
    double side = max2(q[(top + 1) % 3], q[(top + 2) % 3]);
    /* beside the face nothing changes before a second coordinate leaves the core; inside, before
     * another face is nearer */
    return max2(0.0, q[top] > 0.0 ? -side : 0.5 * (q[top] - side));
}

/* half the slope of the squared distance from the core of a box at p + s t, and its own slope */
static double box_slope(const double core[3], const double p[3], const double t[3], double s,
                        double *rise) {
    double slope = 0.0;
    *rise = 0.0;
    for (int c = 0; c < 3; c++) {
        double q = p[c] + s * t[c];
        if (fabs(q) > core[c]) {
            slope += t[c] * (q - copysign(core[c], q));
            *rise += t[c] * t[c];
        }
    }
    return slope;
}

/* On a box that slope is linear between the places where a coordinate enters or leaves the core.
 * False inside the core. */
static bool search_box_side(const Solid *box, Vec3 a, Vec3 b, SolidSide *best) {
    double p[3] = {a.x, a.y, a.z}, t[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    double core[3] = {box->half.x - box->radius, box->half.y - box->radius,
                      box->half.z - box->radius};
    double low = 0.0, high = 1.0, rise;
    for (int k = 0; k < 6; k++) {
        int c = k / 2;
        double border = (k % 2 ? core[c] : -core[c]) - p[c];
        if ((border > 0.0) != (border < t[c])) { /* both ends on the same side of it */
            continue;
        }
        double at = border / t[c];
        if (at > low && at < high) {
            if (box_slope(core, p, t, at, &rise) > 0.0) {
                high = at;
            } else {
                low = at;
            }
        }
    }
    double middle = 0.5 * (low + high), slope = box_slope(core, p, t, middle, &rise);
    if (rise <= 0.0) {
        return false;
    }
    best->at = min2(max2(middle - slope / rise, low), high);
    best->distance = solid_distance(box, vec3_axpy(a, best->at, vec3_sub(b, a)), &best->normal);
    return true;
}

/* least distance between a and b, where the slopes da < 0 at a and db > 0 at b are known */
static SolidSide search_side(const Solid *solid, Vec3 a, Vec3 b, double da, double db) {
    Vec3 along = vec3_sub(b, a);
    double low = 0.0, high = 1.0;
    int stuck = 0;
    SolidSide best = {.at = -da / (db - da)};
    if (solid->kind == SOLID_BOX && search_box_side(solid, a, b, &best)) {
        return best;
    }
    for (int round = 0; round < MOST_ROUNDS && high - low > SIDE_TOLERANCE; round++) {
        double s = low - da * (high - low) / (db - da);
        s = round % 3 == 2 || !(s > low && s < high) ? 0.5 * (low + high) : s;
        best.at = s;
        best.distance = solid_distance(solid, vec3_axpy(a, s, along), &best.normal);
        double slope = vec3_dot(best.normal, along);
        if (fabs(slope) <= SOLID_LEVEL * vec3_length(along)) {
            break;
        }
        int side = slope > 0.0 ? 1 : -1;
        if (slope > 0.0) {
            high = s, db = slope;
            da *= stuck == side ? 0.5 : 1.0; /* Illinois: do not crawl from one end */
        } else {
            low = s, da = slope;
            db *= stuck == side ? 0.5 : 1.0;
        }
        stuck = side;
    }
    return best;
}

/* inside of the face; false when the support point lies beside the triangle */
static bool search_face(const Solid *solid, const Vec3 x[3], Vec3 normal, double w[3]) {
    Vec3 e1 = vec3_sub(x[1], x[0]), e2 = vec3_sub(x[2], x[0]), up = vec3_cross(e1, e2);
    double area2 = vec3_dot(up, up);
    if (area2 <= 0.0) {
        return false;
    }
    up = vec3_scale((vec3_dot(up, normal) < 0.0 ? -1.0 : 1.0) / sqrt(area2), up);
    Vec3 r = vec3_sub(solid_support_point(solid, up), x[0]);
    double a = vec3_dot(e1, e1), b = vec3_dot(e1, e2), c = vec3_dot(e2, e2);
    double p = vec3_dot(e1, r), q = vec3_dot(e2, r), det = a * c - b * b;
    w[1] = (c * p - b * q) / det;
    w[2] = (a * q - b * p) / det;
    w[0] = 1.0 - w[1] - w[2];
    return w[0] > 0.0 && w[1] > 0.0 && w[2] > 0.0;
}

static Vec3 point_of(const double w[3], const Vec3 x[3]) {
    return vec3_add(vec3_add(vec3_scale(w[0], x[0]), vec3_scale(w[1], x[1])),
                    vec3_scale(w[2], x[2]));
}

static int nearest_corner(const double distance[3]) {
    int low = distance[0] <= distance[1] ? 0 : 1;
    return distance[2] < distance[low] ? 2 : low;
}

/* the nearest corner, or the nearest point of a side */
static SolidNearest nearest_on_sides(const Solid *solid, const Vec3 x[3], const double distance[3],
                                     const Vec3 normal[3]) {
    int low = nearest_corner(distance);
    SolidNearest best = {
        .feature = 1 << low, .point = x[low], .normal = normal[low], .distance = distance[low]};
    best.weight[low] = 1.0;
    for (int k = 0; k < 3; k++) {
        int a = k, b = (k + 1) % 3;
        Vec3 along = vec3_sub(x[b], x[a]);
        double da = vec3_dot(normal[a], along), db = vec3_dot(normal[b], along);
        double level = SOLID_LEVEL * vec3_length(along);
        SolidSide *side = &best.side[k];
        side->distance = INFINITY;
        if (da >= -level || db <= level) {
            continue;
        }
        *side = search_side(solid, x[a], x[b], da, db);
        side->lower = min2(distance[a], distance[b]) - side->distance;
        if (side->distance < best.distance) {
            best.feature = (1 << a) | (1 << b);
            best.weight[a] = 1.0 - side->at, best.weight[b] = side->at;
            best.weight[(k + 2) % 3] = 0.0;
            best.point = vec3_axpy(x[a], side->at, along);
            best.normal = side->normal;
            best.distance = side->distance;
        }
    }
    return best;
}

/* does the face reach lower than the nearest point of its border, and where? */
static bool reaches_lower(const Solid *solid, const Vec3 x[3], const SolidNearest *border,
                          double w[3]) {
    double fall = 0.0;
    for (int k = 0; k < 3; k++) {
        Vec3 to = vec3_sub(x[k], border->point);
        fall = min2(fall, vec3_dot(border->normal, to) + SOLID_LEVEL * vec3_length(to));
    }
    return fall < 0.0 && search_face(solid, x, border->normal, w);
}

static void take_point(const Solid *ball, SolidNearest *best, Vec3 p, double length, int feature) {
    best->feature = feature;
    best->point = p;
    best->normal = length > 0.0 ? vec3_scale(1.0 / length, p) : vec3(0, 0, 1);
    best->distance = length - ball->radius;
}

/* the same at a sphere: what is nearest to its middle. Products of corners decide, without roots. */
static SolidNearest nearest_on_sphere(const Solid *ball, const Vec3 x[3],
                                      const double distance[3]) {
    int low = nearest_corner(distance);
    SolidNearest best = {0};
    best.weight[low] = 1.0;
    take_point(ball, &best, x[low], distance[low] + ball->radius, 1 << low);
    double slope[3], square[3]; /* of sides: first corner . side, side . side */
    for (int k = 0; k < 3; k++) {
        int b = k < 2 ? k + 1 : 0;
        Vec3 along = vec3_sub(x[b], x[k]);
        double aa = vec3_dot(along, along), from = vec3_dot(x[k], along), to = from + aa;
        double ra = distance[k] + ball->radius, rb = distance[b] + ball->radius;
        double level = SOLID_LEVEL * SOLID_LEVEL * aa;
        SolidSide *side = &best.side[k];
        slope[k] = from, square[k] = aa;
        side->distance = INFINITY;
        if (from >= 0.0 || to <= 0.0 || from * from <= level * ra * ra ||
            to * to <= level * rb * rb) {
            continue;
        }
        double at = -from / aa;
        Vec3 p = vec3_axpy(x[k], at, along);
        double length = vec3_length(p);
        *side = (SolidSide){
            .at = at, .distance = length - ball->radius, .normal = vec3_scale(1.0 / length, p)};
        side->lower = min2(distance[k], distance[b]) - side->distance;
        if (side->distance < best.distance) {
            best.weight[k] = 1.0 - at, best.weight[b] = at, best.weight[3 - k - b] = 0.0;
            take_point(ball, &best, p, length, (1 << k) | (1 << b));
        }
    }
    double c01 = 0.5 * (square[0] + square[2] - square[1]), det = square[0] * square[2] - c01 * c01;
    double p = -slope[0], q = slope[2] + square[2];
    double w1 = square[2] * p - c01 * q, w2 = square[0] * q - c01 * p;
    if (w1 > 0.0 && w2 > 0.0 && w1 + w2 < det) {
        double border = best.distance;
        best.weight[1] = w1 / det, best.weight[2] = w2 / det;
        best.weight[0] = 1.0 - best.weight[1] - best.weight[2];
        Vec3 foot = point_of(best.weight, x);
        take_point(ball, &best, foot, vec3_length(foot), 7);
        best.lower = border - best.distance;
    }
    return best;
}

SolidNearest solid_nearest_on_triangle(const Solid *solid, const Vec3 x[3],
                                       const double distance[3], const Vec3 normal[3]) {
    if (solid->kind == SOLID_SPHERE) {
        return nearest_on_sphere(solid, x, distance);
    }
    SolidNearest nearest = nearest_on_sides(solid, x, distance, normal);
    double w[3], border = nearest.distance;
    if (!reaches_lower(solid, x, &nearest, w)) {
        return nearest;
    }
    nearest.feature = 7;
    memcpy(nearest.weight, w, sizeof w);
    nearest.point = point_of(w, x);
    nearest.distance = solid_distance(solid, nearest.point, &nearest.normal);
    nearest.lower = border - nearest.distance;
    return nearest;
}
