/* mat4.h: 4 x 4 matrices, column by column as GL wants them. */
#ifndef TOILE_RENDER_MAT4_H
#define TOILE_RENDER_MAT4_H

#include "sim/base/vec.h"

typedef struct Mat4 {
    double m[16]; /* m[4 column + row] */
} Mat4;

static inline Mat4 mat4_multiply(Mat4 a, Mat4 b) {
    Mat4 c;
    for (int column = 0; column < 4; column++) {
        for (int row = 0; row < 4; row++) {
            double sum = 0.0;
            for (int k = 0; k < 4; k++) {
                sum += a.m[4 * k + row] * b.m[4 * column + k];
            }
            c.m[4 * column + row] = sum;
        }
    }
    return c;
}

/* p in the frame with these unit axes and origin. */
static inline Mat4 mat4_view(Vec3 x, Vec3 y, Vec3 z, Vec3 origin) {
    return (Mat4){{x.x, y.x, z.x, 0, x.y, y.y, z.y, 0, x.z, y.z, z.z, 0, -vec3_dot(x, origin),
                   -vec3_dot(y, origin), -vec3_dot(z, origin), 1}};
}

static inline Mat4 mat4_from_pose(Pose pose) {
    Vec3 x = quat_rotate(pose.turn, vec3(1, 0, 0));
    Vec3 y = quat_rotate(pose.turn, vec3(0, 1, 0));
    Vec3 z = quat_rotate(pose.turn, vec3(0, 0, 1));
    return (Mat4){{x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, pose.shift.x, pose.shift.y,
                   pose.shift.z, 1}};
}

static inline Pose pose_inverse(Pose pose) {
    Quat back = quat_inverse(pose.turn);
    return (Pose){vec3_scale(-1.0, quat_rotate(back, pose.shift)), back};
}

/* (x, y, z, w) of m (p, 1) */
static inline void mat4_apply(const Mat4 *m, Vec3 p, double out[4]) {
    for (int row = 0; row < 4; row++) {
        out[row] = m->m[row] * p.x + m->m[4 + row] * p.y + m->m[8 + row] * p.z + m->m[12 + row];
    }
}

static inline void mat4_store(const Mat4 *m, float out[16]) {
    for (int i = 0; i < 16; i++) {
        out[i] = (float)m->m[i];
    }
}

#endif
