/* Which side of a closed mesh? The winding number along a segment that meets no edge. */
#include "sim/base/error.h"
#include "sim/base/hash.h"
#include "sim/geom/crossing.h"
#include "sim/geom/exact.h"

/* Directions that are tried: one that meets an edge or a corner exactly tells nothing. Each fails
 * with a probability of about 1e-15 an edge. */
#define MOST_TRIES 16
#define SEED 61 /* of the directions */

/* Outside of the ball around the point that holds the mesh, in direction number `number`. */
static Vec3 far_point(const CrossingMesh *mesh, Vec3 point, int number) {
    double reach = 0.0;
    for (int i = 0; i < mesh->vertex_count; i++) {
        Vec3 off = vec3_sub(vec3_load(mesh->vertices + 3 * (size_t)i), point);
        reach = fmax(reach, vec3_length(off));
    }
    uint64_t draw = 3 * (uint64_t)number;
    Vec3 way =
        vec3(hash_random(SEED, draw), hash_random(SEED, draw + 1), hash_random(SEED, draw + 2));
    return vec3_axpy(point, 2.0 * reach, vec3_unit(way, vec3(0.3, 0.5, 0.8)));
}

/* 1 or -1: pq goes through the triangle, against or along its normal; 0: past it. False: it meets
 * the border exactly. */
static bool pass_through(const double *p, const double *q, const CrossingTriangle *t, int *sign) {
    int side_p = exact_orient3d(t->corner[0], t->corner[1], t->corner[2], p);
    int side_q = exact_orient3d(t->corner[0], t->corner[1], t->corner[2], q);
    *sign = 0;
    if (side_p * side_q > 0) {
        return true;
    }
    int turn[3];
    for (int k = 0; k < 3; k++) {
        turn[k] = exact_orient3d(p, q, t->corner[k], t->corner[(k + 1) % 3]);
    }
    int low = turn[0] < turn[1] ? turn[0] : turn[1], high = turn[0] > turn[1] ? turn[0] : turn[1];
    low = turn[2] < low ? turn[2] : low;
    high = turn[2] > high ? turn[2] : high;
    if (low < 0 && high > 0) {
        return true;
    }
    *sign = side_p;
    return low * high > 0 && side_p * side_q < 0;
}

bool crossing_point_inside(const CrossingMesh *mesh, const double point[3]) {
    for (int number = 0; number < MOST_TRIES; number++) {
        double far[3];
        int winding = 0;
        bool clear = true;
        vec3_store(far, far_point(mesh, vec3_load(point), number));
        for (int i = 0; clear && i < mesh->triangle_count; i++) {
            const int32_t *v = mesh->triangles + 3 * (size_t)i;
            CrossingTriangle t = {{mesh->vertices + 3 * (size_t)v[0],
                                   mesh->vertices + 3 * (size_t)v[1],
                                   mesh->vertices + 3 * (size_t)v[2]}};
            int sign;
            clear = pass_through(point, far, &t, &sign);
            winding += sign;
        }
        if (clear) {
            return winding != 0;
        }
    }
    return true; /* on the surface, whatever the direction */
}
