/* Does a triangle reach inside a solid?
 *
 * All solids are convex, so the signed distance d is a convex function and its gradient at c bounds
 * it from below: d(p) >= d(c) + g . (p - c). The deepest point of a triangle is enclosed in a
 * polygon of its plane, which each tangent halves: the part with g . (p - c) > 0 is no deeper than
 * c. Cuts through the centre of gravity leave at most 1 - 1/e of the area [Levin 1965, Newman 1965,
 * the method of centres of gravity], and the tangent over the polygon says how deep it can be at
 * most. */
#include "sim/base/error.h"
#include "sim/geom/crossing.h"

/* Cuts; each adds at most one corner. 64 shrink an area by 1e12; the tangent bound ends most
 * searches within 10. */
#define MOST_CUTS 64
#define MOST_CORNERS (3 + MOST_CUTS)

typedef struct Polygon {
    int count;
    double corner[MOST_CORNERS][2]; /* (u, v): the point a + u (b - a) + v (c - a) */
} Polygon;

/* Centre of gravity; of the corners when there is no area. */
static void find_centre(const Polygon *polygon, double centre[2]) {
    const double *o = polygon->corner[0];
    double area = 0.0, sum[2] = {0, 0}, mean[2] = {0, 0};
    for (int i = 0; i < polygon->count; i++) {
        const double *p = polygon->corner[i], *q = polygon->corner[(i + 1) % polygon->count];
        double part = (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
        area += part;
        for (int k = 0; k < 2; k++) {
            sum[k] += part * (p[k] + q[k] - 2.0 * o[k]) / 3.0;
            mean[k] += p[k] / polygon->count;
        }
    }
    for (int k = 0; k < 2; k++) {
        double at = o[k] + sum[k] / area;
        centre[k] = area > 0.0 && isfinite(at) ? at : mean[k];
    }
}

/* Keeps the corners with slope . (p - centre) <= 0. */
static void cut(Polygon *polygon, const double centre[2], const double slope[2]) {
    Polygon left = {0};
    double height[MOST_CORNERS];
    for (int i = 0; i < polygon->count; i++) {
        height[i] = slope[0] * (polygon->corner[i][0] - centre[0]) +
                    slope[1] * (polygon->corner[i][1] - centre[1]);
    }
    for (int i = 0; i < polygon->count; i++) {
        int j = (i + 1) % polygon->count;
        const double *p = polygon->corner[i], *q = polygon->corner[j];
        if (height[i] <= 0.0 && left.count < MOST_CORNERS) {
            left.corner[left.count][0] = p[0];
            left.corner[left.count++][1] = p[1];
        }
        if ((height[i] < 0.0) != (height[j] < 0.0) && height[i] != 0.0 && height[j] != 0.0 &&
            left.count < MOST_CORNERS) {
            double t = height[i] / (height[i] - height[j]);
            left.corner[left.count][0] = p[0] + t * (q[0] - p[0]);
            left.corner[left.count++][1] = p[1] + t * (q[1] - p[1]);
        }
    }
    *polygon = left;
}

/* a, b, c in the solid's frame */
static bool reaches_inside(const Solid *solid, Vec3 a, Vec3 b, Vec3 c) {
    Vec3 u = vec3_sub(b, a), v = vec3_sub(c, a);
    Polygon polygon = {3, {{0, 0}, {1, 0}, {0, 1}}};
    for (int i = 0; i < MOST_CUTS && polygon.count > 0; i++) {
        double centre[2];
        Vec3 normal;
        find_centre(&polygon, centre);
        Vec3 p = vec3_axpy(vec3_axpy(a, centre[0], u), centre[1], v);
        double d = solid_distance(solid, p, &normal), lowest = d;
        if (d < -CROSSING_DEPTH) {
            return true;
        }
        double slope[2] = {vec3_dot(normal, u), vec3_dot(normal, v)};
        for (int k = 0; k < polygon.count; k++) {
            lowest = fmin(lowest, d + slope[0] * (polygon.corner[k][0] - centre[0]) +
                                      slope[1] * (polygon.corner[k][1] - centre[1]));
        }
        if (lowest > -CROSSING_RESOLUTION) {
            return false;
        }
        cut(&polygon, centre, slope);
    }
    return false;
}

static bool triangle_inside(const Solid *solid, const Vec3 p[3]) {
    Vec3 normal, middle = vec3_scale(1.0 / 3.0, vec3_add(p[0], vec3_add(p[1], p[2])));
    double reach = 0.0;
    for (int k = 0; k < 3; k++) {
        reach = fmax(reach, vec3_length(vec3_sub(p[k], middle)));
    }
    /* no point of it is farther from the middle than a corner, and d changes no faster than 1 */
    if (solid_distance(solid, middle, &normal) > reach) {
        return false;
    }
    for (int k = 0; k < 3; k++) {
        if (solid_distance(solid, p[k], &normal) < -CROSSING_DEPTH) {
            return true;
        }
    }
    return solid->kind != SOLID_PLANE && reaches_inside(solid, p[0], p[1], p[2]);
}

Crossings crossing_count_solid(const CrossingMesh *mesh, const Solid *solid, Pose pose) {
    Crossings found = {0, {-1, -1}};
    for (int i = 0; i < mesh->triangle_count; i++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            size_t vertex = (size_t)mesh->triangles[3 * (size_t)i + (size_t)k];
            p[k] = pose_unapply(pose, vec3_load(mesh->vertices + 3 * vertex));
        }
        if (triangle_inside(solid, p) && found.count++ == 0) {
            found.first[0] = i;
        }
    }
    return found;
}
