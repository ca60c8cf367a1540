/* motion.h: rigid motions over time, made of turns and moves with smooth start and stop. */
#ifndef TOILE_SCENE_MOTION_H
#define TOILE_SCENE_MOTION_H

#include <stdbool.h>

#include "sim/base/vec.h"

typedef enum MotionKind { MOTION_TURN, MOTION_MOVE } MotionKind;

/* One turn or move. Its progress s(t) runs from 0 at `from` to 1 at `to`:
 * smooth: the quintic s = 10 r^3 - 15 r^4 + 6 r^5 (velocity and acceleration 0 at both ends);
 * linear: s = r, r = (t - from) / (to - from); with `endless` it goes on after `to`. */
typedef struct MotionPiece {
    MotionKind kind;
    Vec3 axis;       /* turn: unit axis */
    Vec3 centre;     /* [m] turn: a point on the axis */
    double angle;    /* [rad] turn: whole angle */
    Vec3 by;         /* [m] move: whole displacement */
    double from, to; /* [s] */
    bool smooth;     /* true */
    bool endless;    /* a constant speed that never stops; false */
} MotionPiece;

typedef struct Motion {
    int piece_count;
    const MotionPiece *pieces; /* applied in this order; each in world space */
} Motion;

/* The pose that carries start positions to positions at `time`. */
Pose motion_pose(const Motion *motion, double time);

/* [s] after which the motion stands still; 0 for none, INFINITY for an endless one. */
double motion_end(const Motion *motion);

#endif
