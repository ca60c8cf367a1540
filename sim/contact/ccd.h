/* ccd.h: how far along its straight path a pair of features may go: conservative continuous
 * collision detection.
 *
 * From t = 0 on: the closest points of the two features give a unit normal n. The distance of the
 * features is at least the smallest separation n.(x_i - x_j) of their corners, and every one of
 * those is linear in t. So all t are proven up to
 *
 *     t + min over i, j with n.(p_i - p_j) < 0 of (n.(x_i - x_j) - target) / (-n.(p_i - p_j)),
 *
 * and there the search goes on. It is safe for any n, however inexact the closest points are.
 * A solid is convex: it lies behind the tangent plane of its nearest point, and the corners of the
 * triangle are measured from that plane. */
#ifndef TOILE_CONTACT_CCD_H
#define TOILE_CONTACT_CCD_H

#include "sim/contact/lists.h"
#include "sim/geom/solid.h"

/* Share in [0, 1] of the motions p [m] of the corners x [m] during which their distance is at
 * least `target` [m] > 0. Proven, not estimated. *normal: from the second feature to the first
 * where the search stopped; untouched when the features touch at the start (then 0). */
double ccd_pair(PairKind kind, const Vec3 x[4], const Vec3 p[4], double target, Vec3 *normal);

/* The same for a triangle and a solid that stands still; everything in the solid's frame. */
double ccd_solid(const Solid *solid, const Vec3 x[3], const Vec3 p[3], double target, Vec3 *normal);
/* ... and for one point. */
double ccd_solid_point(const Solid *solid, Vec3 x, Vec3 p, double target, Vec3 *normal);

/* Signed distance [m] of a triangle from a solid, in its frame, with the normal there, the weights
 * of the nearest point and the feature that holds it (as a set of corners). */
double ccd_solid_distance(const Solid *solid, const Vec3 x[3], Vec3 *normal, double weight[3],
                          int *feature);

#endif
