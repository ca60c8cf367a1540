/* solid.h: solids with closed forms, in their own frame: signed distance and outward normal. */
#ifndef TOILE_GEOM_SOLID_H
#define TOILE_GEOM_SOLID_H

#include "sim/base/vec.h"

typedef enum SolidKind {
    SOLID_PLANE,    /* z <= 0 is solid */
    SOLID_SPHERE,   /* radius, centre 0 */
    SOLID_BOX,      /* |x| <= half, edges rounded with `radius` (inside the extents) */
    SOLID_CYLINDER, /* axis z, |z| <= half.z, radius; flat ends */
    SOLID_CAPSULE,  /* axis z, all points within `radius` of the segment |z| <= half.z */
    SOLID_CONE      /* axis z, apex at +half.z, base of `radius` at -half.z */
} SolidKind;
#define SOLID_KIND_COUNT 6

typedef struct Solid {
    SolidKind kind;
    Vec3 half;     /* [m] half extents; only .z for cylinder, capsule, cone */
    double radius; /* [m] */
} Solid;

extern const char *const solid_names[SOLID_KIND_COUNT + 1]; /* by kind, NULL-terminated */

/* Exact signed distance [m] of p from the surface, negative inside; *normal: the unit gradient
 * (pointing out). p in the solid's frame. All solids are convex: the plane through the closest
 * point, normal to *normal, has the solid on one side. */
double solid_distance(const Solid *solid, Vec3 p, Vec3 *normal);

/* [m] how far p can move in any direction, at least, with the normal of a flat side staying what
 * it is; 0 where the surface is round. */
double solid_flat_margin(const Solid *solid, Vec3 p);

/* [m] largest dot product of a point of the solid with the unit vector `direction` (both in the
 * solid's frame); for a plane 0 along +z and INFINITY otherwise. */
double solid_support(const Solid *solid, Vec3 direction);

/* A point of the solid (not a plane) where that largest product is taken. */
Vec3 solid_support_point(const Solid *solid, Vec3 direction);

#define SOLID_LEVEL 1e-9 /* slope of the distance that counts as level */

/* The nearest point of a side, where it lies inside. */
typedef struct SolidSide {
    double at;       /* 0 .. 1 along it */
    double distance; /* [m] INFINITY: it lies at an end */
    double lower;    /* [m] by how much it is nearer than the ends */
    Vec3 normal;
} SolidSide;

/* A point w[0] x[0] + w[1] x[1] + w[2] x[2] of a triangle. */
typedef struct SolidNearest {
    int feature; /* that holds it, as a set of corners: bit k for x[k] */
    double weight[3];
    Vec3 point, normal; /* in the solid's frame */
    double distance;    /* [m] */
    double lower;       /* [m] of a face: by how much it is nearer than its sides; else 0 */
    SolidSide side[3];  /* from x[k] to the next corner */
} SolidNearest;

/* Where the signed distance is least (the distance from a convex solid is convex), given distance and
 * normal at the corners. */
SolidNearest solid_nearest_on_triangle(const Solid *solid, const Vec3 x[3],
                                       const double distance[3], const Vec3 normal[3]);

/* [m] radius of a ball around the origin that holds the solid; INFINITY for a plane. */
double solid_bound(const Solid *solid);

#endif
