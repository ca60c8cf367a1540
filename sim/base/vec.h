/* vec.h: vectors of three doubles, quaternions and rigid poses. */
#ifndef TOILE_BASE_VEC_H
#define TOILE_BASE_VEC_H

#include <math.h>

#define PI 3.14159265358979323846

/* fmin and fmax are calls into the C library unless NaN rules are given up; these are one
 * instruction. NaN: the second argument. */
static inline double min2(double a, double b) { return a < b ? a : b; }
static inline double max2(double a, double b) { return a > b ? a : b; }

typedef struct Vec3 {
    double x, y, z;
} Vec3;

static inline Vec3 vec3(double x, double y, double z) { return (Vec3){x, y, z}; }
static inline Vec3 vec3_load(const double *p) { return (Vec3){p[0], p[1], p[2]}; }
static inline void vec3_store(double *p, Vec3 a) { p[0] = a.x, p[1] = a.y, p[2] = a.z; }
static inline Vec3 vec3_add(Vec3 a, Vec3 b) { return (Vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline Vec3 vec3_sub(Vec3 a, Vec3 b) { return (Vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline Vec3 vec3_scale(double s, Vec3 a) { return (Vec3){s * a.x, s * a.y, s * a.z}; }
/* a + s b */
static inline Vec3 vec3_axpy(Vec3 a, double s, Vec3 b) {
    return (Vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline double vec3_dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vec3 vec3_cross(Vec3 a, Vec3 b) {
    return (Vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double vec3_length(Vec3 a) { return sqrt(vec3_dot(a, a)); }
/* Unit vector, or `fallback` when a is (almost) zero. */
static inline Vec3 vec3_unit(Vec3 a, Vec3 fallback) {
    double length = vec3_length(a);
    return length > 1e-300 ? vec3_scale(1.0 / length, a) : fallback;
}

/* Unit quaternion w + xi + yj + zk. */
typedef struct Quat {
    double w, x, y, z;
} Quat;

/* Rigid motion p -> rotate(turn, p) + shift. */
typedef struct Pose {
    Vec3 shift; /* [m] */
    Quat turn;
} Pose;

static inline Pose pose_identity(void) { return (Pose){{0, 0, 0}, {1, 0, 0, 0}}; }

static inline Quat quat_from_axis_angle(Vec3 axis, double angle) {
    Vec3 unit = vec3_unit(axis, vec3(0, 0, 1));
    double s = sin(0.5 * angle);
    return (Quat){cos(0.5 * angle), s * unit.x, s * unit.y, s * unit.z};
}
static inline Quat quat_multiply(Quat a, Quat b) {
    return (Quat){a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
                  a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                  a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                  a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
static inline Vec3 quat_rotate(Quat q, Vec3 p) {
    Vec3 u = {q.x, q.y, q.z};
    Vec3 t = vec3_scale(2.0, vec3_cross(u, p));
    return vec3_add(vec3_axpy(p, q.w, t), vec3_cross(u, t));
}
static inline Quat quat_inverse(Quat q) { return (Quat){q.w, -q.x, -q.y, -q.z}; }
static inline Vec3 pose_apply(Pose pose, Vec3 p) {
    return vec3_add(quat_rotate(pose.turn, p), pose.shift);
}
/* The point that pose maps to p. */
static inline Vec3 pose_unapply(Pose pose, Vec3 p) {
    return quat_rotate(quat_inverse(pose.turn), vec3_sub(p, pose.shift));
}
/* first `inner`, then `outer` */
static inline Pose pose_compose(Pose outer, Pose inner) {
    return (Pose){pose_apply(outer, inner.shift), quat_multiply(outer.turn, inner.turn)};
}

#endif
