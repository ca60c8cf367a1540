#include "sim/contact/ccd.h"

#include <string.h>

#include "sim/contact/constants.h"

static void move(const Vec3 *x, const Vec3 *p, double t, int count, Vec3 *moved) {
    for (int k = 0; k < count; k++) {
        moved[k] = vec3_axpy(x[k], t, p[k]);
    }
}

/* is the search over? *t then holds the answer */
static bool ends(double advance, double distance, double target, double *t) {
    if (*t + advance >= 1.0) {
        *t = 1.0;
        return true;
    }
    if (advance < CONTACT_CCD_ADVANCE || (*t > 0.0 && distance <= CONTACT_CCD_NEAR * target)) {
        return true;
    }
    *t += advance;
    return false;
}

double ccd_pair(PairKind kind, const Vec3 x[4], const Vec3 p[4], double target, Vec3 *normal) {
    Vec3 y[4];
    int first = kind == PAIR_FACE ? 1 : 2;
    double t = 0.0;
    for (int round = 0; round < CONTACT_CCD_ROUNDS; round++) {
        move(x, p, t, 4, y);
        Pair pair = pair_between(kind, y);
        if (!(pair.distance > 0.0)) {
            return t;
        }
        Vec3 n = *normal = pair.normal;
        double advance = INFINITY;
        for (int a = 0; a < first; a++) {
            for (int b = first; b < 4; b++) {
                double closing = vec3_dot(n, vec3_sub(p[b], p[a]));
                double apart = vec3_dot(n, vec3_sub(y[a], y[b])) - target;
                if (closing > 0.0 && apart < advance * closing) {
                    advance = apart / closing;
                }
            }
        }
        if (ends(advance, pair.distance, target, &t)) {
            return t;
        }
    }
    return t;
}

double ccd_solid_distance(const Solid *solid, const Vec3 x[3], Vec3 *normal, double weight[3],
                          int *feature) {
    double d[3];
    Vec3 n[3];
    for (int k = 0; k < 3; k++) {
        d[k] = solid_distance(solid, x[k], &n[k]);
    }
    SolidNearest nearest = solid_nearest_on_triangle(solid, x, d, n);
    memcpy(weight, nearest.weight, sizeof nearest.weight);
    *feature = nearest.feature;
    *normal = nearest.normal;
    return nearest.distance;
}

/* does the tangent plane below one corner part triangle and solid during the rest of the way? */
static bool plane_parts(const Solid *solid, const Vec3 y[3], const Vec3 p[3], double rest,
                        double target) {
    for (int a = 0; a < 3; a++) {
        Vec3 n;
        double d = solid_distance(solid, y[a], &n), least = d;
        for (int k = 0; k < 3; k++) {
            double height = d + vec3_dot(n, vec3_sub(y[k], y[a]));
            least = fmin(least, fmin(height, height + rest * vec3_dot(n, p[k])));
        }
        if (d > 0.0 && least >= target) {
            return true;
        }
    }
    return false;
}

double ccd_solid(const Solid *solid, const Vec3 x[3], const Vec3 p[3], double target,
                 Vec3 *normal) {
    Vec3 y[3];
    double t = 0.0;
    for (int round = 0; round < CONTACT_CCD_ROUNDS; round++) {
        move(x, p, t, 3, y);
        if (plane_parts(solid, y, p, 1.0 - t, target)) {
            return 1.0;
        }
        double w[3], advance = INFINITY;
        int feature;
        Vec3 n, at = {0, 0, 0};
        double distance = ccd_solid_distance(solid, y, &n, w, &feature);
        if (!(distance > 0.0)) {
            return t;
        }
        *normal = n;
        for (int k = 0; k < 3; k++) {
            at = vec3_axpy(at, w[k], y[k]);
        }
        for (int k = 0; k < 3; k++) {
            double closing = -vec3_dot(n, p[k]);
            double apart = distance + vec3_dot(n, vec3_sub(y[k], at)) - target;
            if (closing > 0.0 && apart < advance * closing) {
                advance = apart / closing;
            }
        }
        if (ends(advance, distance, target, &t)) {
            return t;
        }
    }
    return t;
}

double ccd_solid_point(const Solid *solid, Vec3 x, Vec3 p, double target, Vec3 *normal) {
    double t = 0.0;
    for (int round = 0; round < CONTACT_CCD_ROUNDS; round++) {
        double distance = solid_distance(solid, vec3_axpy(x, t, p), normal);
        double closing = -vec3_dot(*normal, p);
        double advance = closing > 0.0 ? (distance - target) / closing : INFINITY;
        if (ends(advance, distance, target, &t)) {
            return t;
        }
    }
    return t;
}
