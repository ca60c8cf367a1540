#include "sim/geom/solid.h"

#include <stddef.h>

const char *const solid_names[SOLID_KIND_COUNT + 1] = {"plane",   "sphere", "box", "cylinder",
                                                       "capsule", "cone",   NULL};

static double clamp(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}

static double distance_sphere(Vec3 p, double radius, Vec3 *normal) {
    double length = vec3_length(p);
    *normal = length > 0.0 ? vec3_scale(1.0 / length, p) : vec3(0, 0, 1);
    return length - radius;
}

/* sharp box of half extents b: distance and closest direction */
static double distance_box(Vec3 p, Vec3 b, double radius, Vec3 *normal) {
    Vec3 core = {b.x - radius, b.y - radius, b.z - radius};
    Vec3 q = {fabs(p.x) - core.x, fabs(p.y) - core.y, fabs(p.z) - core.z};
    Vec3 sign = {copysign(1, p.x), copysign(1, p.y), copysign(1, p.z)};
    if (q.x <= 0.0 && q.y <= 0.0 && q.z > 0.0) { /* over a top: the usual place, without a root */
        *normal = vec3(0, 0, sign.z);
        return q.z - radius;
    }
    Vec3 out = {max2(q.x, 0), max2(q.y, 0), max2(q.z, 0)};
    double outside = vec3_length(out);
    if (outside > 0.0) {
        *normal =
            vec3(sign.x * out.x / outside, sign.y * out.y / outside, sign.z * out.z / outside);
        return outside - radius;
    }
    if (q.x >= q.y && q.x >= q.z) {
        *normal = vec3(sign.x, 0, 0);
        return q.x - radius;
    }
    *normal = q.y >= q.z ? vec3(0, sign.y, 0) : vec3(0, 0, sign.z);
    return max2(q.y, q.z) - radius;
}

/* profile (r, z) of a body of revolution back to space */
static Vec3 revolve(Vec3 p, double r, double normal_r, double normal_z) {
    if (r > 0.0) {
        return vec3(normal_r * p.x / r, normal_r * p.y / r, normal_z);
    }
    return vec3(normal_r, 0, normal_z);
}

static double distance_cylinder(Vec3 p, double half, double radius, Vec3 *normal) {
    double r = sqrt(p.x * p.x + p.y * p.y), up = p.z < 0 ? -1.0 : 1.0;
    double qr = r - radius, qz = fabs(p.z) - half;
    if (qr > 0.0 && qz > 0.0) {
        double d = hypot(qr, qz);
        *normal = revolve(p, r, qr / d, up * qz / d);
        return d;
    }
    *normal = qr > qz ? revolve(p, r, 1, 0) : vec3(0, 0, up);
    return max2(qr, qz);
}

static double distance_capsule(Vec3 p, double half, double radius, Vec3 *normal) {
    Vec3 core = {0, 0, clamp(p.z, -half, half)};
    Vec3 fallback = fabs(p.z) > half ? vec3(0, 0, copysign(1, p.z)) : vec3(1, 0, 0);
    Vec3 away = vec3_sub(p, core);
    *normal = vec3_unit(away, fallback);
    return vec3_length(away) - radius;
}

/* triangle (apex (0, half), base corner (radius, -half)) in the (r, z) half plane */
static double distance_cone(Vec3 p, double half, double radius, Vec3 *normal) {
    double r = sqrt(p.x * p.x + p.y * p.y);
    double slant = hypot(radius, 2.0 * half);
    double side_r = 2.0 * half / slant, side_z = radius / slant; /* outward normal of the side */
    double to_side = side_r * r + side_z * (p.z - half);
    double to_base = -half - p.z;
    double along = (r * radius - (p.z - half) * 2.0 * half) / slant; /* from the apex downwards */
    if (along < 0.0) {                                               /* above the apex */
        double d = hypot(r, p.z - half);
        *normal = d > 0.0 ? revolve(p, r, r / d, (p.z - half) / d) : vec3(0, 0, 1);
        return d;
    }
    if (to_side <= 0.0 && to_base <= 0.0) {
        *normal = to_side > to_base ? revolve(p, r, side_r, side_z) : vec3(0, 0, -1);
        return max2(to_side, to_base);
    }
    if (along <= slant && to_side > 0.0) {
        *normal = revolve(p, r, side_r, side_z);
        return to_side;
    }
    if (r <= radius) {
        *normal = vec3(0, 0, -1);
        return to_base;
    }
    double d = hypot(r - radius, p.z + half);
    *normal = revolve(p, r, (r - radius) / d, (p.z + half) / d);
    return d;
}

double solid_distance(const Solid *solid, Vec3 p, Vec3 *normal) {
    switch (solid->kind) {
    case SOLID_SPHERE:
        return distance_sphere(p, solid->radius, normal);
    case SOLID_BOX:
        return distance_box(p, solid->half, solid->radius, normal);
    case SOLID_CYLINDER:
        return distance_cylinder(p, solid->half.z, solid->radius, normal);
    case SOLID_CAPSULE:
        return distance_capsule(p, solid->half.z, solid->radius, normal);
    case SOLID_CONE:
        return distance_cone(p, solid->half.z, solid->radius, normal);
    case SOLID_PLANE:
        break;
    }
    *normal = vec3(0, 0, 1);
    return p.z;
}

double solid_support(const Solid *solid, Vec3 d) {
    Vec3 half = solid->half;
    double r = solid->radius, across = sqrt(d.x * d.x + d.y * d.y);
    switch (solid->kind) {
    case SOLID_SPHERE:
        return r;
    case SOLID_BOX:
        return fabs(d.x) * (half.x - r) + fabs(d.y) * (half.y - r) + fabs(d.z) * (half.z - r) + r;
    case SOLID_CYLINDER:
        return fabs(d.z) * half.z + across * r;
    case SOLID_CAPSULE:
        return fabs(d.z) * half.z + r;
    case SOLID_CONE:
        return max2(d.z * half.z, across * r - d.z * half.z);
    case SOLID_PLANE:
        break;
    }
    return d.z > 0.0 && across == 0.0 ? 0.0 : INFINITY;
}

double solid_bound(const Solid *solid) {
    switch (solid->kind) {
    case SOLID_SPHERE:
        return solid->radius;
    case SOLID_BOX:
        return vec3_length(solid->half);
    case SOLID_CYLINDER:
    case SOLID_CONE:
        return hypot(solid->half.z, solid->radius);
    case SOLID_CAPSULE:
        return solid->half.z + solid->radius;
    case SOLID_PLANE:
        break;
    }
    return INFINITY;
}
