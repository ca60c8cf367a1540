/* force.h: what every touching pair and touch does in every step, inline: passing its vectors
 * cost as much as the work. Not for others than the files of the explicit contact. */
#ifndef TOILE_CONTACT_FORCE_H
#define TOILE_CONTACT_FORCE_H

#include <math.h>

#include "sim/base/parallel.h"
#include "sim/contact/engine.h"

/* Memory that is read soon. */
static inline void contact_fetch(const void *p) { __builtin_prefetch(p); }

/* Velocity of the point with these weights. */
static inline Vec3 contact_point_velocity(const Contact *c, int count, const int *place,
                                          const double *weight) {
    Vec3 v = {0, 0, 0};
    for (int k = 0; k < count; k++) {
        v = vec3_axpy(v, weight[k], contact_velocity(c, place[k]));
    }
    return v;
}

/* [m/s] of a solid at a point; a still one is asked no further. */
static inline Vec3 contact_carried(const Contact *c, int obstacle, Vec3 point, double dt) {
    bool moves = c->def->obstacles[obstacle].moves;
    return moves ? obstacle_velocity(c, obstacle, point, dt) : vec3(0.0, 0.0, 0.0);
}

/* Adds the share w of a force to a vertex. */
static inline void contact_push(Contact *c, int place, double w, const ContactForce *force) {
    Toll *toll = &c->tolls[place];
    Push *push = &c->pushes[place];
    double impulse = w * c->kick_time;
    push->force = vec3_axpy(push->force, w, force->sum);
    push->stiffness += fabs(w) * force->stiffness;
    if (!c->is_touched[place]) {
        c->is_touched[place] = TOUCHED;
        *toll = (Toll){.damping = vec3_scale(impulse, force->damping),
                       .friction = vec3_scale(impulse, force->friction),
                       .before = contact_velocity(c, place)};
        return;
    }
    toll->damping = vec3_axpy(toll->damping, impulse, force->damping);
    toll->friction = vec3_axpy(toll->friction, impulse, force->friction);
}

/* What some forces do to what is carried, which is no loss; their fastest approach. */
typedef struct ContactWork {
    double approach, work, damping, friction;
} ContactWork;

static inline void contact_add_work(const Contact *c, const ContactForce *force, ContactWork *sum) {
    sum->approach = max2(sum->approach, force->approach);
    sum->work += c->kick_time * vec3_dot(force->sum, force->carried);
    sum->damping += c->kick_time * vec3_dot(force->damping, force->carried);
    sum->friction += c->kick_time * vec3_dot(force->friction, force->carried);
}

/* Adds a force to the vertices of a contact. */
static inline void contact_apply(Contact *c, const ContactForce *force, int count, const int *place,
                                 const double *weight, ContactWork *sum) {
    contact_add_work(c, force, sum);
    for (int k = 0; k < count; k++) {
        if (place[k] < c->def->vertex_count && weight[k] != 0.0) {
            contact_push(c, place[k], weight[k], force);
        }
    }
}

/* ... of this step */
static inline void contact_note_work(Contact *c, const ContactWork *sum) {
    ContactStatistics *s = &c->statistics;
    s->approach = max2(s->approach, sum->approach);
    s->work += sum->work;
    s->damping += sum->damping;
    s->friction += sum->friction;
}

/* The bristle follows the sliding velocity for `share_dt`, is cut to `limit` and answers with a
 * force. k [N/m], critical [kg/s]: of the normal direction. */
static inline Vec3 contact_friction(Vec3 *bristle, Vec3 normal, Vec3 sliding, double share_dt,
                                    double limit, double k, double critical) {
    double kt = CONTACT_BRISTLE_SHARE * k;
    double ct = CONTACT_BRISTLE_DAMPING * sqrt(CONTACT_BRISTLE_SHARE) * critical;
    Vec3 t = vec3_axpy(*bristle, share_dt, sliding);
    t = vec3_axpy(t, -vec3_dot(t, normal), normal);
    double pull2 = kt * kt * vec3_dot(t, t), limit2 = limit * limit;
    if (pull2 > limit2) {
        t = vec3_scale(limit / sqrt(pull2), t);
    }
    *bristle = t;
    Vec3 force = vec3_axpy(vec3_scale(-kt, t), -ct, sliding);
    double size2 = vec3_dot(force, force);
    return size2 > limit2 ? vec3_scale(limit / sqrt(size2), force) : force;
}

/* What meets a solid, of `mass`, at its distance, with velocity v against it, by a law of this share of
 * m / step^2; `carried` is left to the caller. */
static inline ContactForce contact_solid_force(double stiffness, double distance, double dhat,
                                               double mass, double mu, Vec3 normal, Vec3 v,
                                               double dt, double share, Vec3 *bristle) {
    double force, curvature, k = stiffness * mass / (dt * dt);
    double critical = 2.0 * sqrt(stiffness) * mass / dt;
    double damping = CONTACT_DAMPING * critical;
    contact_law(distance, dhat, k, &force, &curvature);
    double vn = vec3_dot(v, normal), total = max2(0.0, force - damping * vn);
    Vec3 sliding = vec3_axpy(v, -vn, normal);
    Vec3 friction = contact_friction(bristle, normal, sliding, share * dt, total * mu, k, critical);
    return (ContactForce){.sum = vec3_axpy(friction, total, normal),
                          .damping = vec3_scale(total - force, normal),
                          .friction = friction,
                          .stiffness = curvature + damping / dt,
                          .approach = -vn};
}

#endif
