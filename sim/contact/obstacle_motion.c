/* obstacle_motion.c: driven solids on the explicit road take part in the guard (contact.md, Guard). */
#include <math.h>

#include "sim/contact/engine.h"

void obstacle_place(Contact *c, int obstacle) {
    Pose pose = c->poses[obstacle];
    c->frames[obstacle] =
        (Frame){pose.shift,
                {quat_rotate(pose.turn, vec3(1, 0, 0)), quat_rotate(pose.turn, vec3(0, 1, 0)),
                 quat_rotate(pose.turn, vec3(0, 0, 1))}};
}

/* [m] no point of an obstacle is farther from its origin */
static double bound_of(const ContactObstacle *obstacle) {
    double square = 0.0;
    for (int a = 0; obstacle->mesh && a < 3; a++) {
        double most = max2(fabs(obstacle->mesh->low[a]), fabs(obstacle->mesh->high[a]));
        square += most * most;
    }
    return obstacle->mesh ? sqrt(square) : solid_bound(&obstacle->solid);
}

/* [m] largest motion of any point of a rigid obstacle */
static double farthest_motion(const ContactObstacle *obstacle, Pose a, Pose b) {
    double bound = bound_of(obstacle);
    Quat turn = quat_multiply(b.turn, quat_inverse(a.turn));
    double half = sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z);
    double angle = 2.0 * asin(min2(1.0, half));
    double turned = isfinite(bound) ? bound * angle : 0.0;
    return vec3_length(vec3_sub(b.shift, a.shift)) + turned;
}

/* Where the programme comes back to the place at which an obstacle was stopped, it goes on from there:
 * what waits in a pinch opens when the programme opens. */
static bool may_leap(const ContactObstacle *obstacle, double clock, double time_end, double dt) {
    bool animated = obstacle->mesh && obstacle->mesh->frame_count > 1;
    if (animated || !(time_end - clock > CONTACT_LEAP_AFTER * dt)) {
        return false;
    }
    Pose here = contact_pose(obstacle, clock), wished = contact_pose(obstacle, time_end);
    Pose before = contact_pose(obstacle, time_end - dt);
    return farthest_motion(obstacle, here, wished) <= farthest_motion(obstacle, before, wished);
}

double contact_next_clock(const ContactObstacle *obstacle, double clock, double time_end,
                          double dt) {
    double behind = time_end - clock, most = CONTACT_CATCH_UP * dt;
    if (may_leap(obstacle, clock, time_end, dt)) {
        return time_end;
    }
    return clock + max2(-most, min2(most, behind));
}

void obstacle_demand(Contact *c, double dt, double time_end) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        const ContactObstacle *obstacle = &c->def->obstacles[o];
        if (!obstacle->moves) {
            c->programmes.clocks[o] = c->programmes.next_clocks[o] = time_end;
            continue;
        }
        c->programmes.next_clocks[o] =
            contact_next_clock(obstacle, c->programmes.clocks[o], time_end, dt);
        c->programmes.next[o] = contact_pose(obstacle, c->programmes.next_clocks[o]);
        if (obstacle->mesh) {
            mesh_demand(c, o, dt);
        } else {
            c->obstacle_speed[o] =
                farthest_motion(obstacle, c->poses[o], c->programmes.next[o]) / dt;
        }
    }
}

Vec3 obstacle_velocity(const Contact *c, int obstacle, Vec3 point, double dt) {
    Vec3 moved = pose_apply(c->programmes.next[obstacle], pose_unapply(c->poses[obstacle], point));
    return vec3_scale(1.0 / dt, vec3_sub(moved, point));
}

double obstacle_reach(const Contact *c, const Touch *touch) {
    const ContactObstacle *obstacle = &c->def->obstacles[touch->obstacle];
    if (!obstacle->moves) {
        return 0.0;
    }
    Pose pose = c->programmes.next[touch->obstacle];
    if (obstacle->solid.kind == SOLID_PLANE) {
        Vec3 moved = pose_apply(pose, pose_unapply(c->poses[touch->obstacle], touch->point));
        return vec3_dot(touch->normal, vec3_sub(moved, touch->point));
    }
    Vec3 local = quat_rotate(quat_inverse(pose.turn), touch->normal);
    double reach = solid_support(&obstacle->solid, local) + vec3_dot(touch->normal, pose.shift);
    return reach - vec3_dot(touch->normal, touch->point);
}

/* phi: the largest share of its demanded motion that keeps every near corner separated */
static double free_share(const Contact *c, const Points *x, int o, double dt) {
    double phi = 1.0;
    for (int k = 0; k < c->look.touch_count; k++) {
        const Touch *touch = &c->touches.list[c->look.touches[k]];
        if (touch->obstacle != o) {
            continue;
        }
        double beyond = obstacle_reach(c, touch), gap = INFINITY;
        for (int a = 0; a < touch_corners(touch); a++) {
            Vec3 v = contact_velocity(c, touch->place[a]);
            Vec3 end = vec3_axpy(point_at(x, touch->place[a]), dt, v);
            gap = min2(gap, vec3_dot(touch->normal, vec3_sub(end, touch->point)));
        }
        gap -= CONTACT_PLANE_FLOOR * c->def->vertex_distance[touch->place[0]];
        if (beyond > CONTACT_YIELD_SHARE * gap) {
            phi = min2(phi, max2(0.0, CONTACT_YIELD_SHARE * gap / beyond));
        }
    }
    return phi;
}

void obstacle_move(Contact *c, double dt) {
    Points x = contact_positions(c);
    for (int o = 0; o < c->def->obstacle_count; o++) {
        const ContactObstacle *obstacle = &c->def->obstacles[o];
        if (!obstacle->moves) {
            continue;
        }
        double phi = c->impulses      ? 1.0 /* what waits has no motion left */
                     : obstacle->mesh ? mesh_free_share(c, o, dt)
                                      : free_share(c, &x, o, dt);
        if (phi < 1.0 &&
            c->programmes.next_clocks[o] - c->programmes.clocks[o] > CONTACT_LEAP_AFTER * dt) {
            phi = 0.0; /* what lies between the two times is elsewhere */
        }
        c->programmes.clocks[o] += phi * (c->programmes.next_clocks[o] - c->programmes.clocks[o]);
        c->poses[o] =
            phi == 1.0 ? c->programmes.next[o] : contact_pose(obstacle, c->programmes.clocks[o]);
        obstacle_place(c, o);
        if (obstacle->mesh) {
            mesh_move(c, o, phi);
        }
    }
}
