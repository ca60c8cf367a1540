/* motion_kernel.c: the row loops of motion.h. Compiled once per vector width (see the Makefile). */
#include "sim/contact/motion.h"

static void copy_runs(const MotionRun *runs, int count, double *const lanes[3],
                      double *restrict out) {
    for (int k = 0; k < count; k++) {
        const double *x = lanes[0] + runs[k].slot, *y = lanes[1] + runs[k].slot;
        const double *z = lanes[2] + runs[k].slot;
        double *restrict to = out + 3 * (long)runs[k].place;
        int vertices = runs[k].count;
        VECTOR_LOOP
        for (int i = 0; i < vertices; i++) {
            to[3 * i] = x[i], to[3 * i + 1] = y[i], to[3 * i + 2] = z[i];
        }
    }
}

static inline double larger(double a, double b) { return a > b ? a : b; }

static void bound_blocks(const MotionBlock *blocks, int count, double *const v[3],
                         GroupMotion *motion) {
    const double *x = v[0], *y = v[1], *z = v[2];
    for (int k = 0; k < count; k++) {
        const MotionBlock *block = &blocks[k];
        Vec3 middle = {x[block->middle], y[block->middle], z[block->middle]};
        double square[MOTION_BLOCK] = {0.0};
        for (int j = 0; j < MOTION_BLOCK; j++) {
            int row = block->row[j];
            VECTOR_LOOP
            for (int i = 0; i < MOTION_BLOCK; i++) {
                double dx = x[row + i] - middle.x, dy = y[row + i] - middle.y;
                double dz = z[row + i] - middle.z;
                square[i] = larger(dx * dx + dy * dy + dz * dz, square[i]);
            }
        }
        double most = larger(larger(square[0], square[1]), larger(square[2], square[3]));
        double deviation = __builtin_sqrt(most);
        motion[block->group] = (GroupMotion){middle, deviation, vec3_length(middle) + deviation};
    }
}

const MotionKernel VECTOR_JOIN(motion_kernel_, VECTOR_VARIANT) = {copy_runs, bound_blocks};
