/* closest.h: closest points of a point and a triangle, and of two segments (Ericson,
 * Real-Time Collision Detection, 5.1), with the features that hold them. */
#ifndef TOILE_GEOM_CLOSEST_H
#define TOILE_GEOM_CLOSEST_H

#include "sim/base/vec.h"

/* Closest point w[0] a + w[1] b + w[2] c of triangle abc to p. Returns the feature that holds it
 * as a set of corners: bit 0 for a, bit 1 for b, bit 2 for c (7: the inside of the face).
 * Degenerate triangles are allowed. */
int closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c, double w[3]);

/* Closest points p + s (p1 - p) and q + t (q1 - q). Returns a set: bit 0 when s lies strictly
 * inside its segment, bit 1 when t does. *sine2: squared sine of the angle between them, >= 0. */
int closest_on_segments(Vec3 p, Vec3 p1, Vec3 q, Vec3 q1, double *s, double *t, double *sine2);

#endif
