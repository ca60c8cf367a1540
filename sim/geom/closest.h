/* closest.h: closest points of a point and a triangle, and of two segments (Ericson,
 * Real-Time Collision Detection, 5.1), with the features that hold them. Inline: passing the
 * vectors cost as much as the work. */
#ifndef TOILE_GEOM_CLOSEST_H
#define TOILE_GEOM_CLOSEST_H

#include "sim/base/vec.h"

enum { CORNER_A = 1, CORNER_B = 2, CORNER_C = 4 };

static inline int closest_hold(double w[3], double wa, double wb, double wc, int feature) {
    w[0] = wa, w[1] = wb, w[2] = wc;
    return feature;
}

/* Closest point w[0] a + w[1] b + w[2] c of triangle abc to p. Returns the feature that holds it
 * as a set of corners: bit 0 for a, bit 1 for b, bit 2 for c (7: the inside of the face).
 * Degenerate triangles are allowed. */
static inline int closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c, double w[3]) {
    Vec3 ab = vec3_sub(b, a), ac = vec3_sub(c, a), ap = vec3_sub(p, a);
    double d1 = vec3_dot(ab, ap), d2 = vec3_dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) {
        return closest_hold(w, 1, 0, 0, CORNER_A);
    }
    Vec3 bp = vec3_sub(p, b);
    double d3 = vec3_dot(ab, bp), d4 = vec3_dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) {
        return closest_hold(w, 0, 1, 0, CORNER_B);
    }
    double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
        double v = d1 / (d1 - d3);
        return closest_hold(w, 1.0 - v, v, 0, CORNER_A | CORNER_B);
    }
    Vec3 cp = vec3_sub(p, c);
    double d5 = vec3_dot(ab, cp), d6 = vec3_dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6) {
        return closest_hold(w, 0, 0, 1, CORNER_C);
    }
    double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
        double v = d2 / (d2 - d6);
        return closest_hold(w, 1.0 - v, 0, v, CORNER_A | CORNER_C);
    }
    double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
        double v = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return closest_hold(w, 0, 1.0 - v, v, CORNER_B | CORNER_C);
    }
    double sum = va + vb + vc;
    return closest_hold(w, 1.0 - vb / sum - vc / sum, vb / sum, vc / sum,
                        CORNER_A | CORNER_B | CORNER_C);
}

static inline double unit_clamp(double x) { return x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x; }

/* Closest points p + s (p1 - p) and q + t (q1 - q). Returns a set: bit 0 when s lies strictly
 * inside its segment, bit 1 when t does. *sine2: squared sine of the angle between them, >= 0. */
static inline int closest_on_segments(Vec3 p, Vec3 p1, Vec3 q, Vec3 q1, double *s, double *t,
                                      double *sine2) {
    Vec3 d1 = vec3_sub(p1, p), d2 = vec3_sub(q1, q), r = vec3_sub(p, q);
    double a = vec3_dot(d1, d1), e = vec3_dot(d2, d2), b = vec3_dot(d1, d2);
    double c = vec3_dot(d1, r), f = vec3_dot(d2, r);
    double det = a * e - b * b;
    det = det > 0.0 ? det : 0.0; /* rounding makes it negative for parallel segments */
    *sine2 = a * e > 0.0 ? det / (a * e) : 0.0;
    double u = det > 0.0 ? unit_clamp((b * f - c * e) / det) : 0.0;
    double v = e > 0.0 ? (b * u + f) / e : 0.0;
    if (v < 0.0 || v > 1.0) {
        v = unit_clamp(v);
        u = a > 0.0 ? unit_clamp((b * v - c) / a) : 0.0;
    }
    *s = u, *t = v;
    return (u > 0.0 && u < 1.0 ? 1 : 0) | (v > 0.0 && v < 1.0 ? 2 : 0);
}

#endif
