#include "sim/scene/motion.h"

#include <math.h>

static double piece_progress(const MotionPiece *piece, double time) {
    double r = (time - piece->from) / (piece->to - piece->from);
    if (r <= 0.0) {
        return 0.0;
    }
    if (r >= 1.0 && !piece->endless) {
        return 1.0;
    }
    return piece->smooth && !piece->endless ? r * r * r * (10.0 + r * (6.0 * r - 15.0)) : r;
}

Pose motion_pose(const Motion *motion, double time) {
    Pose pose = pose_identity();
    for (int i = 0; i < motion->piece_count; i++) {
        const MotionPiece *piece = &motion->pieces[i];
        double s = piece_progress(piece, time);
        Pose step = pose_identity();
        if (piece->kind == MOTION_MOVE) {
            step.shift = vec3_scale(s, piece->by);
        } else {
            step.turn = quat_from_axis_angle(piece->axis, s * piece->angle);
            step.shift = vec3_sub(piece->centre, quat_rotate(step.turn, piece->centre));
        }
        pose = pose_compose(step, pose);
    }
    return pose;
}

double motion_end(const Motion *motion) {
    double end = 0.0;
    for (int i = 0; i < motion->piece_count; i++) {
        end = fmax(end, motion->pieces[i].endless ? INFINITY : motion->pieces[i].to);
    }
    return end;
}
