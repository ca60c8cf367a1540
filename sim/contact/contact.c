#include "sim/contact/contact.h"

#include <math.h>
#include <string.h>

#include "sim/contact/constants.h"

Contact contact_create(const ContactDef *def, Arena *arena) {
    int n = def->vertex_count, o = def->obstacle_count;
    return (Contact){.def = def,
                     .pairs = arena_push(arena, ContactPair, n * o),
                     .poses = arena_push(arena, Pose, o),
                     .next = arena_push(arena, Pose, o),
                     .clocks = arena_push(arena, double, o),
                     .next_clocks = arena_push(arena, double, o),
                     .bristles = arena_push(arena, double, 3 * n * o),
                     .weight_kept = arena_push(arena, double, n)};
}

Pose contact_pose(const ContactObstacle *obstacle, double clock) {
    return pose_compose(motion_pose(obstacle->motion, clock), obstacle->start);
}

double contact_law(double d, double dhat, double k, double *force, double *curvature) {
    double tau = CONTACT_LOG_BELOW * dhat;
    if (d >= dhat) {
        *force = *curvature = 0.0;
        return 0.0;
    }
    if (d >= tau) {
        *force = k * (dhat - d);
        *curvature = k;
        return 0.5 * k * (dhat - d) * (dhat - d);
    }
    double safe = fmax(d, CONTACT_LEAST_GAP * dhat);
    *force = k * tau * (dhat - tau) / safe;
    *curvature = k * tau * (dhat - tau) / (safe * safe);
    return k * tau * (dhat - tau) * log(tau / safe) + 0.5 * k * (dhat - tau) * (dhat - tau);
}

double contact_room(const ContactDef *def, double distance) {
    return fmax(0.0, CONTACT_PLANE_SHARE * (distance - CONTACT_PLANE_FLOOR * def->distance));
}

static Vec3 lane_load(double *const lane[3], int slot) {
    return vec3(lane[0][slot], lane[1][slot], lane[2][slot]);
}

static void lane_store(double *const lane[3], int slot, Vec3 a) {
    lane[0][slot] = a.x, lane[1][slot] = a.y, lane[2][slot] = a.z;
}

static void pair_evaluate(const Contact *c, ContactView view, ContactPair *pair) {
    const ContactObstacle *obstacle = &c->def->obstacles[pair->obstacle];
    Pose pose = c->poses[pair->obstacle];
    Vec3 x = lane_load(view.lanes->x, view.slot[pair->vertex]);
    Vec3 normal;
    pair->distance = solid_distance(&obstacle->solid, pose_unapply(pose, x), &normal);
    pair->normal = quat_rotate(pose.turn, normal);
    pair->point = vec3_axpy(x, -pair->distance, pair->normal);
}

static void make_list(Contact *c, ContactView view, double fastest, double dt) {
    double dhat = c->def->distance, step = fastest * dt;
    c->near = fmax(dhat, CONTACT_NEAR_STEPS * step);
    c->slack = fmax(CONTACT_LEAST_SLACK * dhat, CONTACT_SLACK_STEPS * step);
    c->path = 0.0;
    c->pair_count = 0;
    c->statistics.rebuilds++;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        for (int i = 0; i < c->def->vertex_count; i++) {
            ContactPair pair = {.vertex = i, .obstacle = o};
            if (c->def->mass[i] == 0.0) {
                continue;
            }
            pair_evaluate(c, view, &pair);
            if (pair.distance <= c->near + c->slack) {
                pair.due = pair.distance - c->near;
                c->pairs[c->pair_count++] = pair;
            } else {
                memset(c->bristles + 3 * ((size_t)i * (size_t)c->def->obstacle_count + (size_t)o),
                       0, 3 * sizeof(double));
            }
        }
    }
}

void contact_begin(Contact *c, ContactView view, const Pose *poses, const double *clocks,
                   const double *bristles, double fastest, double dt) {
    size_t o = (size_t)c->def->obstacle_count;
    memcpy(c->poses, poses, o * sizeof *poses);
    memcpy(c->clocks, clocks, o * sizeof *clocks);
    memcpy(c->bristles, bristles, 3 * o * (size_t)c->def->vertex_count * sizeof *bristles);
    c->statistics = (ContactStatistics){.smallest_gap = INFINITY};
    for (int i = 0; i < c->def->vertex_count; i++) {
        c->weight_kept[i] = view.lanes->weight[view.slot[i]];
    }
    make_list(c, view, fastest, dt);
}

/* speed of the fastest point of the obstacles in this step [m/s] */
static double obstacle_speed(const Contact *c, double dt) {
    double fastest = 0.0;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        const ContactObstacle *obstacle = &c->def->obstacles[o];
        if (!obstacle->moves) {
            continue;
        }
        Pose a = c->poses[o], b = c->next[o];
        double bound = solid_bound(&obstacle->solid);
        Quat turn = quat_multiply(b.turn, quat_inverse(a.turn));
        double angle =
            2.0 * asin(fmin(1.0, sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z)));
        double turned = isfinite(bound) ? bound * angle : 0.0;
        fastest = fmax(fastest, (vec3_length(vec3_sub(b.shift, a.shift)) + turned) / dt);
    }
    return fastest;
}

void contact_refresh(Contact *c, ContactView view, double dt, double fastest) {
    double speed = fastest + obstacle_speed(c, dt);
    if (c->path + speed * dt > c->slack || CONTACT_LEAST_NEAR_STEPS * speed * dt > c->near) {
        make_list(c, view, speed, dt);
    }
    c->step = speed * dt;
}

/* velocity of the obstacle at the contact point, from its last demanded motion */
static Vec3 point_velocity(const Contact *c, const ContactPair *pair, double dt) {
    if (!c->def->obstacles[pair->obstacle].moves) {
        return vec3(0, 0, 0);
    }
    Vec3 moved =
        pose_apply(c->next[pair->obstacle], pose_unapply(c->poses[pair->obstacle], pair->point));
    return vec3_scale(1.0 / dt, vec3_sub(moved, pair->point));
}

static void demand_motion(Contact *c, double dt, double time_end) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        /* a clock that fell behind catches up, and may run backwards with its programme */
        double behind = time_end - c->clocks[o];
        double most = CONTACT_CATCH_UP * dt;
        c->next_clocks[o] = c->clocks[o] + fmax(-most, fmin(most, behind));
        c->next[o] = contact_pose(&c->def->obstacles[o], c->next_clocks[o]);
    }
}

static Vec3 friction_force(Contact *c, const ContactPair *pair, Vec3 sliding, double normal_force,
                           double stiffness, double mass, double moved_for) {
    int obstacles = c->def->obstacle_count;
    double *memory =
        c->bristles + 3 * ((size_t)pair->vertex * (size_t)obstacles + (size_t)pair->obstacle);
    double own = c->def->obstacles[pair->obstacle].friction;
    double limit = normal_force * (own >= 0.0 ? own : c->def->friction[pair->vertex]);
    double kt = CONTACT_BRISTLE_SHARE * stiffness;
    Vec3 t = vec3_axpy(vec3_load(memory), moved_for, sliding);
    t = vec3_axpy(t, -vec3_dot(t, pair->normal), pair->normal);
    double pull = kt * vec3_length(t);
    if (pull > limit) {
        t = vec3_scale(limit / pull, t);
    }
    vec3_store(memory, t);
    double ct = 2.0 * CONTACT_BRISTLE_DAMPING * sqrt(kt * mass);
    Vec3 force = vec3_axpy(vec3_scale(-kt, t), -ct, sliding);
    double size = vec3_length(force);
    return size > limit && size > 0.0 ? vec3_scale(limit / size, force) : force;
}

static void pair_force(Contact *c, ContactView view, const ContactPair *pair, double dt,
                       double share) {
    const Lanes *lanes = view.lanes;
    int slot = view.slot[pair->vertex];
    double mass = c->def->mass[pair->vertex], k = CONTACT_STIFFNESS * mass / (dt * dt);
    double force, curvature;
    contact_law(pair->distance, c->def->distance, k, &force, &curvature);
    Vec3 carried = point_velocity(c, pair, dt);
    Vec3 v = vec3_sub(lane_load(lanes->v, slot), carried);
    double vn = vec3_dot(v, pair->normal);
    double damping = 2.0 * CONTACT_DAMPING * sqrt(k * mass);
    double total = fmax(0.0, force - damping * vn);
    Vec3 sliding = vec3_axpy(v, -vn, pair->normal);
    Vec3 sum = vec3_scale(total, pair->normal);
    sum = vec3_add(sum, friction_force(c, pair, sliding, total, k, mass, share * dt));
    c->statistics.work += vec3_dot(sum, carried) * share * dt;
    for (int a = 0; a < 3; a++) {
        lanes->f[a][slot] += a == 0 ? sum.x : a == 1 ? sum.y : sum.z;
    }
    double inertia = (curvature + damping / dt) * dt * dt / CONTACT_STABLE_SHARE;
    double weight = inertia > mass ? 1.0 / inertia : c->weight_kept[pair->vertex];
    lanes->weight[slot] = fmin(lanes->weight[slot], weight);
}

/* may the vertex be nearer than `near` by now? */
static bool is_due(const Contact *c, const ContactPair *pair) { return c->path >= pair->due; }

void contact_forces(Contact *c, ContactView view, double dt, double share, double time_end) {
    demand_motion(c, dt, time_end);
    for (int p = 0; p < c->pair_count; p++) {
        ContactPair *pair = &c->pairs[p];
        if (!is_due(c, pair)) {
            continue;
        }
        pair_evaluate(c, view, pair);
        pair->due = c->path + pair->distance - c->near;
        c->statistics.smallest_gap = fmin(c->statistics.smallest_gap, pair->distance);
        if (pair->distance < c->def->distance && !view.held[pair->vertex]) {
            pair_force(c, view, pair, dt, share);
        } else {
            memset(c->bristles + 3 * ((size_t)pair->vertex * (size_t)c->def->obstacle_count +
                                      (size_t)pair->obstacle),
                   0, 3 * sizeof(double));
        }
    }
}

void contact_clear(Contact *c, ContactView view) {
    for (int p = 0; p < c->pair_count; p++) {
        int slot = view.slot[c->pairs[p].vertex];
        view.lanes->f[0][slot] = view.lanes->f[1][slot] = view.lanes->f[2][slot] = 0.0;
        view.lanes->weight[slot] = c->weight_kept[c->pairs[p].vertex];
    }
}

/* inelastic impulse that keeps the gap out of the steep part of the law */
static void pair_impulse(Contact *c, ContactView view, const ContactPair *pair, double dt) {
    double floor = CONTACT_IMPULSE_GAP * c->def->distance;
    Vec3 v = lane_load(view.lanes->v, view.slot[pair->vertex]);
    double vn = vec3_dot(vec3_sub(v, point_velocity(c, pair, dt)), pair->normal);
    double least = pair->distance > floor ? (floor - pair->distance) / dt : 0.0;
    if (vn >= least || view.held[pair->vertex]) {
        return;
    }
    c->statistics.impulses++;
    lane_store(view.lanes->v, view.slot[pair->vertex], vec3_axpy(v, least - vn, pair->normal));
}

/* farthest that the moving obstacle reaches along the pair's normal, beyond the plane now */
static double obstacle_demand(const Contact *c, const ContactPair *pair) {
    const ContactObstacle *obstacle = &c->def->obstacles[pair->obstacle];
    if (!obstacle->moves) {
        return 0.0;
    }
    if (obstacle->solid.kind == SOLID_PLANE) {
        Vec3 moved = pose_apply(c->next[pair->obstacle],
                                pose_unapply(c->poses[pair->obstacle], pair->point));
        return vec3_dot(pair->normal, vec3_sub(moved, pair->point));
    }
    Pose pose = c->next[pair->obstacle];
    Vec3 local = quat_rotate(quat_inverse(pose.turn), pair->normal);
    double reach = solid_support(&obstacle->solid, local) + vec3_dot(pair->normal, pose.shift);
    return reach - vec3_dot(pair->normal, pair->point);
}

/* the vertex stays on its side of the plane, less what is reserved for the obstacle */
static void pair_truncate(Contact *c, ContactView view, const ContactPair *pair, double dt) {
    double reserve = fmax(0.0, fmin(obstacle_demand(c, pair), 0.5 * pair->distance));
    double room =
        CONTACT_PLANE_SHARE * (pair->distance - reserve - CONTACT_PLANE_FLOOR * c->def->distance);
    int slot = view.slot[pair->vertex];
    Vec3 v = lane_load(view.lanes->v, slot);
    double approach = -dt * vec3_dot(v, pair->normal);
    if (approach <= fmax(room, 0.0) || view.held[pair->vertex]) {
        return;
    }
    c->statistics.truncations++;
    lane_store(view.lanes->v, slot, vec3_scale(fmax(room, 0.0) / approach, v));
}

/* phi: the largest share of its demanded motion that keeps every near vertex separated */
static void move_obstacles(Contact *c, ContactView view, double dt) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        double phi = 1.0;
        for (int p = 0; p < c->pair_count && c->def->obstacles[o].moves; p++) {
            const ContactPair *pair = &c->pairs[p];
            if (pair->obstacle != o || !is_due(c, pair)) {
                continue;
            }
            double demand = obstacle_demand(c, pair);
            Vec3 v = lane_load(view.lanes->v, view.slot[pair->vertex]);
            double gap = pair->distance + dt * vec3_dot(v, pair->normal) -
                         CONTACT_PLANE_FLOOR * c->def->distance;
            if (demand > CONTACT_YIELD_SHARE * gap) {
                phi = fmin(phi, fmax(0.0, CONTACT_YIELD_SHARE * gap / demand));
            }
        }
        c->clocks[o] += phi * (c->next_clocks[o] - c->clocks[o]);
        c->poses[o] = phi == 1.0 ? c->next[o] : contact_pose(&c->def->obstacles[o], c->clocks[o]);
    }
}

void contact_guard(Contact *c, ContactView view, double dt) {
    for (int p = 0; p < c->pair_count; p++) {
        if (is_due(c, &c->pairs[p])) {
            pair_impulse(c, view, &c->pairs[p], dt);
        }
    }
    for (int p = 0; p < c->pair_count; p++) {
        if (is_due(c, &c->pairs[p])) {
            pair_truncate(c, view, &c->pairs[p], dt);
        }
    }
    move_obstacles(c, view, dt);
    c->path += c->step;
}

double contact_energy(const Contact *c, ContactView view, double dt) {
    double energy = 0.0;
    for (int p = 0; p < c->pair_count; p++) {
        ContactPair pair = c->pairs[p];
        double force, curvature, k = CONTACT_STIFFNESS * c->def->mass[pair.vertex] / (dt * dt);
        pair_evaluate(c, view, &pair);
        energy += contact_law(pair.distance, c->def->distance, k, &force, &curvature);
    }
    return energy;
}

double contact_smallest_gap(const Contact *c, ContactView view) {
    double least = INFINITY;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        for (int i = 0; i < c->def->vertex_count; i++) {
            ContactPair pair = {.vertex = i, .obstacle = o};
            if (c->def->mass[i] > 0.0) {
                pair_evaluate(c, view, &pair);
                least = fmin(least, pair.distance);
            }
        }
    }
    return least;
}
