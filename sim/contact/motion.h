/* motion.h: how the cloth moves in a step: positions and velocities copied from the lanes, and a bound
 * for every group. Vertices of a lattice lie in rows of slots that follow each other: these are copied, and
 * groups of whole blocks bounded, by row loops that vectorise. The same bits for every width. */
#ifndef TOILE_CONTACT_MOTION_H
#define TOILE_CONTACT_MOTION_H

#include "sim/base/arena.h"
#include "sim/base/parallel.h"
#include "sim/base/vec.h"
#include "sim/base/vector.h"
#include "sim/contact/surface.h"

/* How a group moves in this step. */
typedef struct GroupMotion {
    Vec3 velocity;    /* [m/s] of its middle */
    double deviation; /* [m/s] largest of any of its vertices from that */
    double fastest;   /* [m/s] no vertex is faster */
} GroupMotion;

/* Places that follow each other, in slots that do. */
typedef struct MotionRun {
    int place, slot, count;
} MotionRun;

#define MOTION_BLOCK (SURFACE_BLOCK + 1) /* vertices along a side */

/* A group of so many rows of so many slots. */
typedef struct MotionBlock {
    int group, middle;     /* slot of its middle */
    int row[MOTION_BLOCK]; /* first slots */
} MotionBlock;

typedef struct MotionKernel {
    void (*copy)(const MotionRun *runs, int count, double *const lanes[3], double *out);
    void (*bound)(const MotionBlock *blocks, int count, double *const v[3], GroupMotion *motion);
} MotionKernel;

extern const MotionKernel motion_kernel_scalar, motion_kernel_sse2, motion_kernel_avx2,
    motion_kernel_avx512;

/* What of the cloth lies in rows. */
typedef struct MotionRows {
    const MotionKernel *kernel;
    int *slot;           /* (vertex_count) that they were found for */
    MotionRun *runs;     /* (run_count) every vertex is in one */
    MotionBlock *blocks; /* (block_count) */
    int *others;         /* (other_count) groups that are none and can move */
    int run_count, block_count, other_count;
} MotionRows;

MotionRows motion_rows_create(const Surface *surface, int vertex_count, Arena *arena);
/* slot: (vertex_count). Does nothing while those stay. */
void motion_rows_set(MotionRows *rows, const Surface *surface, const int *slot, int vertex_count);

/* From the lanes to out: (vertex_count x 3). */
typedef struct MotionCopy {
    const MotionRows *rows;
    double *const *lanes; /* 3 */
    double *out;
} MotionCopy;

ParallelLoop motion_copy_loop(MotionCopy *copy);
/* Of the groups that are blocks first .. end - 1; motion: (group_count). */
void motion_bound(const MotionRows *rows, int first, int end, double *const v[3],
                  GroupMotion *motion);

#endif
