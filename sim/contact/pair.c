/* pair.c: closest points of vertex and triangle, edge and edge. */
#include <limits.h>

#include "sim/contact/constants.h"
#include "sim/contact/lists.h"
#include "sim/geom/closest.h"

void pair_evaluate(const Points *points, Pair *pair) {
    Vec3 x[4];
    for (int k = 0; k < 4; k++) {
        x[k] = point_at(points, pair->place[k]);
    }
    double *w = pair->weight;
    pair->soft = 1.0;
    if (pair->kind == PAIR_FACE) {
        pair->feature = closest_on_triangle(x[0], x[1], x[2], x[3], w + 1);
        w[0] = 1.0, w[1] = -w[1], w[2] = -w[2], w[3] = -w[3];
    } else {
        double s, t, sine2;
        pair->feature = closest_on_segments(x[0], x[1], x[2], x[3], &s, &t, &sine2);
        w[0] = 1.0 - s, w[1] = s, w[2] = t - 1.0, w[3] = -t;
        double g = sine2 / CONTACT_PARALLEL;
        pair->soft = g < 1.0 ? g * (2.0 - g) : 1.0;
    }
    /* differences first: no cancellation of large coordinates */
    Vec3 apart = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        apart = vec3_axpy(apart, w[k], vec3_sub(x[k], x[3]));
    }
    pair->distance = vec3_length(apart);
    if (pair->distance > 0.0) {
        pair->normal = vec3_scale(1.0 / pair->distance, apart);
    }
}

Pair pair_between(PairKind kind, const Vec3 x[4]) {
    Points points = {&x[0].x};
    Pair pair = {.kind = kind, .place = {0, 1, 2, 3}};
    pair_evaluate(&points, &pair);
    return pair;
}

double pair_bound(const Points *points, const Pair *pair) {
    double height[4];
    for (int k = 0; k < 4; k++) {
        height[k] = vec3_dot(pair->normal, point_at(points, pair->place[k]));
    }
    return pair->kind == PAIR_FACE ? height[0] - max2(max2(height[1], height[2]), height[3])
                                   : min2(height[0], height[1]) - max2(height[2], height[3]);
}

/* Least and largest of the corners in a feature (closest.h); returns how many it has. */
static int feature_ends(int feature, const int corner[3], int *low, int *high) {
    int count = 0;
    *low = INT_MAX, *high = -1;
    for (int k = 0; k < 3; k++) {
        if (feature & (1 << k)) {
            *low = corner[k] < *low ? corner[k] : *low;
            *high = corner[k] > *high ? corner[k] : *high;
            count++;
        }
    }
    return count;
}

void pair_twin_key(const Pair *pair, int key[3]) {
    int low, high, vertex = pair->place[0];
    if (feature_ends(pair->feature, pair->place + 1, &low, &high) == 1) {
        high = vertex > low ? vertex : low, low = vertex > low ? low : vertex, vertex = -1;
    }
    key[0] = vertex, key[1] = low, key[2] = high;
}

double pair_rest_limit(const SurfacePanel *panel, const Pair *pair, double dhat) {
    Vec3 flat[4];
    for (int k = 0; k < 4; k++) {
        const double *material = panel->material + 2 * (size_t)(pair->place[k] - panel->first);
        flat[k] = vec3(material[0], material[1], 0.0);
    }
    return min2(dhat, CONTACT_REST_SHARE * pair_between(pair->kind, flat).distance);
}
