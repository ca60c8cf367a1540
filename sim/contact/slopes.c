#include "sim/contact/slopes.h"

#include "sim/contact/flatness.h"

static inline Vec3 normal_of(Vec3 a, Vec3 b) { return vec3_unit(vec3_cross(a, b), vec3(0, 0, 1)); }

/* mean and plane of several blocks */
static inline Slopes middle_of(const Slopes *const part[], int count) {
    Vec3 sum[2] = {part[0]->mean[0], part[0]->mean[1]};
    for (int k = 1; k < count; k++) {
        sum[0] = vec3_add(sum[0], part[k]->mean[0]);
        sum[1] = vec3_add(sum[1], part[k]->mean[1]);
    }
    Vec3 normal = normal_of(sum[0], sum[1]);
    return (Slopes){
        .mean = {vec3_scale(1.0 / count, sum[0]), vec3_scale(1.0 / count, sum[1])},
        .normal = normal,
    };
}

/* Largest |P (G - C)| of a block for the mean and the plane of `middle`. What leaves the plane of the
 * block shows there by the sine of the angle of both planes. */
static inline double flat_of(const Slopes *part, const Slopes *middle, double *cosine,
                             double *sine) {
    Vec3 n = middle->normal;
    double square = 0.0;
    for (int k = 0; k < 2; k++) {
        Vec3 d = vec3_sub(part->mean[k], middle->mean[k]);
        d = vec3_axpy(d, -vec3_dot(d, n), n);
        square += vec3_dot(d, d);
    }
    Vec3 turn = vec3_cross(part->normal, n);
    *cosine = fabs(vec3_dot(part->normal, n));
    *sine = vec3_length(turn);
    return sqrt(square) + part->flat + *sine * part->steep;
}

static inline double steep_of(const Slopes *part, const Slopes *middle, double cosine,
                              double sine) {
    double a = vec3_dot(middle->normal, vec3_sub(part->mean[0], middle->mean[0]));
    double b = vec3_dot(middle->normal, vec3_sub(part->mean[1], middle->mean[1]));
    return sqrt(a * a + b * b) + cosine * part->steep + sine * part->flat;
}

Slopes slopes_join(const Slopes *const part[], int count) {
    Slopes all = middle_of(part, count);
    for (int k = 0; k < count; k++) {
        double cosine, sine;
        all.flat = max2(all.flat, flat_of(part[k], &all, &cosine, &sine));
        all.steep = max2(all.steep, steep_of(part[k], &all, cosine, sine));
    }
    return all;
}

double slopes_least(const Slopes *const part[], int count) {
    Slopes all = middle_of(part, count);
    double most = 0.0;
    for (int k = 0; k < count; k++) {
        double cosine, sine;
        most = max2(most, flat_of(part[k], &all, &cosine, &sine));
    }
    return flatness_stretch(all.mean[0], all.mean[1]) - most;
}
