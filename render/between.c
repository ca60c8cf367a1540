#include "render/between.h"

#include <math.h>
#include <string.h>

static void *copy(Arena *arena, const void *data, size_t bytes) {
    return bytes > 0 ? memcpy(arena_alloc(arena, bytes), data, bytes) : NULL;
}

StateFrame between_copy(const StateFrame *frame, int node_count, Arena *arena) {
    StateFrame kept = *frame;
    size_t nodes = 3 * sizeof(double) * (size_t)node_count;
    kept.x = copy(arena, frame->x, nodes);
    kept.v = copy(arena, frame->v, nodes);
    kept.pose = copy(arena, frame->pose, sizeof *frame->pose * (size_t)frame->pose_count);
    kept.moved = copy(arena, frame->moved, 3 * sizeof(double) * (size_t)frame->moved_count);
    return kept;
}

static Pose between_poses(Pose a, Pose b, double t) {
    double dot =
        a.turn.w * b.turn.w + a.turn.x * b.turn.x + a.turn.y * b.turn.y + a.turn.z * b.turn.z;
    double s = dot < 0.0 ? -t : t;
    Quat q = {(1 - t) * a.turn.w + s * b.turn.w, (1 - t) * a.turn.x + s * b.turn.x,
              (1 - t) * a.turn.y + s * b.turn.y, (1 - t) * a.turn.z + s * b.turn.z};
    double length = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    Pose pose = {.shift = vec3_axpy(vec3_scale(1 - t, a.shift), t, b.shift), .turn = a.turn};
    if (length > 1e-9) {
        pose.turn = (Quat){q.w / length, q.x / length, q.y / length, q.z / length};
    }
    return pose;
}

StateFrame between_frames(const StateFrame *a, const StateFrame *b, int node_count, double part,
                          Arena *arena) {
    StateFrame frame = *b;
    double t = part, step = b->time - a->time;
    double *x = arena_push(arena, double, 3 * (size_t)node_count);
    double *v = arena_push(arena, double, 3 * (size_t)node_count);
    double *moved = arena_push(arena, double, 3 * (size_t)b->moved_count);
    Pose *pose = arena_push(arena, Pose, (size_t)b->pose_count);
    /* Hermite's cubics */
    double h0 = (1 + 2 * t) * (1 - t) * (1 - t), h1 = t * t * (3 - 2 * t);
    double g0 = t * (1 - t) * (1 - t) * step, g1 = t * t * (t - 1) * step;
    for (int i = 0; i < 3 * node_count; i++) {
        x[i] = h0 * a->x[i] + h1 * b->x[i] + g0 * a->v[i] + g1 * b->v[i];
        v[i] = (1 - t) * a->v[i] + t * b->v[i];
    }
    for (int i = 0; i < 3 * b->moved_count; i++) {
        moved[i] = (1 - t) * a->moved[i] + t * b->moved[i];
    }
    for (int i = 0; i < b->pose_count; i++) {
        pose[i] = between_poses(a->pose[i], b->pose[i], t);
    }
    frame.time = a->time + t * step;
    frame.x = x, frame.v = v, frame.pose = pose, frame.moved = moved;
    return frame;
}
