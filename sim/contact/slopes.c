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
static inline double flat_of(const Slopes *part, const Slopes *middle) {
    Vec3 n = middle->normal;
    double square = 0.0;
    for (int k = 0; k < 2; k++) {
        Vec3 d = vec3_sub(part->mean[k], middle->mean[k]);
        d = vec3_axpy(d, -vec3_dot(d, n), n);
        square += vec3_dot(d, d);
    }
    Vec3 turn = vec3_cross(part->normal, n);
    return sqrt(square) + part->flat + vec3_length(turn) * part->steep;
}

double slopes_least(const Slopes *const part[], int count) {
    Slopes all = middle_of(part, count);
    double most = 0.0;
    for (int k = 0; k < count; k++) {
        most = max2(most, flat_of(part[k], &all));
    }
    return flatness_stretch(all.mean[0], all.mean[1]) - most;
}
