/* obstacle.c: contact of cloth with convex solids on the explicit road (explicit.md 3, 4, 10.1). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/contact/force.h"

static double *vertex_bristle(const Contact *c, int place, int obstacle) {
    return c->bristles + 3 * ((size_t)place * (size_t)c->def->obstacle_count + (size_t)obstacle);
}

/* ---- lists ---- */

static void touch_key(const Touch *touch, int key[4]) {
    memcpy(key, touch->place, 3 * sizeof *key);
    key[3] = touch->obstacle;
}

static void add_touch(Contact *c, const Touch *touch, double due) {
    int count = c->touch_count;
    if (count == c->touch_room) {
        c->touch_room = 2 * c->touch_room + 1024;
        c->touches = arena_grow(c->arena, Touch, c->touches, count, c->touch_room);
        c->touch_due = arena_grow(c->arena, double, c->touch_due, count, c->touch_room);
        c->touch_owner = arena_grow(c->arena, int, c->touch_owner, count, c->touch_room);
        c->due_touches = arena_push(c->arena, int, c->touch_room); /* an evaluation follows */
    }
    c->touches[c->touch_count] = *touch;
    c->touch_owner[c->touch_count] = touch->owner;
    c->touch_due[c->touch_count++] = due;
}

static double group_distance(const Contact *c, int g) {
    return c->surface.panels[c->surface.groups[g].panel].distance;
}

/* lower bound of the distance of a group */
static double group_apart(const Contact *c, const Points *x, int g, int o) {
    const SurfaceGroup *group = &c->surface.groups[g];
    Box box = box_empty();
    for (int k = group->vertex_begin; k < group->vertex_end; k++) {
        box_add(&box, point_at(x, c->surface.group_vertices[k]));
    }
    Vec3 normal, centre = vec3_scale(0.5, vec3_add(box.low, box.high));
    double radius = 0.5 * vec3_length(vec3_sub(box.high, box.low));
    Vec3 p = pose_unapply(c->poses[o], centre);
    return solid_distance(&c->def->obstacles[o].solid, p, &normal) - radius;
}

static void search_cell(Contact *c, const Points *x, const SurfaceCell *cell, int owner, int o,
                        double slack) {
    const GroupTouch *group = &c->group_touches[owner];
    for (int k = 0; k < cell->vertex_count; k++) {
        Touch touch = {.obstacle = o,
                       .owner = owner,
                       .frozen = -1.0,
                       .place = {cell->vertex[k], -1, -1},
                       .weight = {1.0},
                       .feature = 1};
        obstacle_evaluate(c, x, &touch);
        if (touch.distance <= group->near + slack) {
            add_touch(c, &touch, group->path + touch.distance - group->near);
        } else {
            memset(vertex_bristle(c, touch.place[0], o), 0, 3 * sizeof(double));
        }
    }
    for (int k = 0; k < cell->triangle_count && c->def->obstacles[o].solid.kind != SOLID_PLANE;
         k++) {
        const int *corner = c->surface.triangles + 3 * (size_t)cell->triangle[k];
        Touch touch = {.obstacle = o,
                       .owner = owner,
                       .frozen = -1.0,
                       .place = {corner[0], corner[1], corner[2]}};
        obstacle_evaluate(c, x, &touch);
        if (touch.distance <= group->near + slack) {
            add_touch(c, &touch, group->path + touch.distance - group->near);
        }
    }
}

static void query_group(Contact *c, const Points *x, int g, int o, double dt) {
    int owner = g * c->def->obstacle_count + o;
    GroupTouch *group = &c->group_touches[owner];
    double dhat = group_distance(c, g), step = group->speed * dt;
    group->near = max2(dhat, CONTACT_NEAR_STEPS * step);
    double slack = max2(CONTACT_LEAST_SLACK * dhat, CONTACT_LONG_SLACK_STEPS * step);
    if (c->def->obstacles[o].mesh) { /* its features are in the lists of pairs */
        group->near = group->limit = INFINITY;
        return;
    }
    double apart = group_apart(c, x, g, o);
    if (apart > group->near + slack) {
        group->limit = group->path + apart - group->near;
        return;
    }
    const SurfaceGroup *cells = &c->surface.groups[g];
    for (int k = cells->cell_begin; k < cells->cell_end; k++) {
        search_cell(c, x, &c->surface.cells[k], owner, o, slack);
    }
    group->limit = group->path + slack;
}

static bool is_wanted(const GroupTouch *group, bool by_path, double dt) {
    return by_path ? group->path > group->limit
                   : CONTACT_LEAST_NEAR_STEPS * group->speed * dt > group->near;
}

/* takes out a touch; the last one fills its place */
static void drop_touch(Contact *c, int t) {
    const Touch *touch = &c->touches[t];
    if (touch->place[1] >= 0 && vec3_dot(touch->bristle, touch->bristle) > 0.0 &&
        c->touch_memory_count < c->touch_memory_room) {
        PairMemory *memory = &c->touch_memory[c->touch_memory_count++];
        touch_key(touch, memory->place);
        vec3_store(memory->bristle, touch->bristle);
    }
    int last = --c->touch_count;
    c->touches[t] = c->touches[last];
    c->touch_due[t] = c->touch_due[last];
    c->touch_owner[t] = c->touch_owner[last];
}

/* searches the groups that spent their path, or that became too fast for their list */
static bool search(Contact *c, bool by_path, double dt) {
    int owners = contact_cloth_groups(c) * c->def->obstacle_count, wanted = 0;
    for (int i = 0; i < owners; i++) {
        c->owner_wanted[i] = is_wanted(&c->group_touches[i], by_path, dt);
        wanted += c->owner_wanted[i];
    }
    if (wanted == 0) {
        return false;
    }
    Points x = contact_positions(c);
    c->statistics.rebuilds++;
    c->touch_memory_count = 0;
    for (int t = 0; t < c->touch_count;) {
        if (c->owner_wanted[c->touch_owner[t]]) {
            drop_touch(c, t);
        } else {
            t++;
        }
    }
    int first = c->touch_count;
    for (int i = 0; i < owners; i++) {
        if (c->owner_wanted[i]) {
            query_group(c, &x, i / c->def->obstacle_count, i % c->def->obstacle_count, dt);
        }
    }
    obstacle_restore(c, first);
    return true;
}

static int compare_keys(const void *a, const void *b) {
    return memcmp(((const PairMemory *)a)->place, ((const PairMemory *)b)->place,
                  sizeof((const PairMemory *)a)->place);
}

/* gives kept bristles to the touches from `first` on */
void obstacle_restore(Contact *c, int first) {
    size_t kept = (size_t)c->touch_memory_count;
    if (kept > 1) {
        qsort(c->touch_memory, kept, sizeof *c->touch_memory, compare_keys);
    }
    for (int t = first; t < c->touch_count && kept > 0; t++) {
        PairMemory key;
        touch_key(&c->touches[t], key.place);
        const PairMemory *memory =
            bsearch(&key, c->touch_memory, kept, sizeof *c->touch_memory, compare_keys);
        if (memory) {
            c->touches[t].bristle = vec3_load(memory->bristle);
        }
    }
    c->touch_memory_count = 0;
}

static Frame frame_of(Pose pose) {
    return (Frame){pose.shift,
                   {quat_rotate(pose.turn, vec3(1, 0, 0)), quat_rotate(pose.turn, vec3(0, 1, 0)),
                    quat_rotate(pose.turn, vec3(0, 0, 1))}};
}

void obstacle_begin(Contact *c, double dt) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        c->frames[o] = frame_of(c->poses[o]);
    }
    c->touch_count = c->due_touch_count = 0;
    memset(c->group_touches, 0,
           (size_t)(contact_cloth_groups(c) * c->def->obstacle_count) * sizeof *c->group_touches);
    for (int g = 0; g < contact_cloth_groups(c); g++) {
        for (int o = 0; o < c->def->obstacle_count; o++) {
            GroupTouch *group = &c->group_touches[g * c->def->obstacle_count + o];
            group->speed = c->motion[g].fastest;
            group->limit = -1.0;
        }
    }
    int kept = c->touch_memory_count; /* from the last interval; nothing is dropped yet */
    search(c, true, dt);
    c->touch_memory_count = kept;
    obstacle_restore(c, 0);
}

/* ---- motion of obstacles ---- */

/* largest motion of any point of an obstacle, per second */
static double fastest_point(const ContactObstacle *obstacle, Pose a, Pose b, double dt) {
    double bound = solid_bound(&obstacle->solid);
    Quat turn = quat_multiply(b.turn, quat_inverse(a.turn));
    double half = sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z);
    double angle = 2.0 * asin(min2(1.0, half));
    double turned = isfinite(bound) ? bound * angle : 0.0;
    return (vec3_length(vec3_sub(b.shift, a.shift)) + turned) / dt;
}

void obstacle_demand(Contact *c, double dt, double time_end) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        const ContactObstacle *obstacle = &c->def->obstacles[o];
        if (!obstacle->moves) {
            c->clocks[o] = c->next_clocks[o] = time_end;
            continue;
        }
        /* a clock that fell behind catches up, and may run backwards with its programme */
        double behind = time_end - c->clocks[o], most = CONTACT_CATCH_UP * dt;
        c->next_clocks[o] = c->clocks[o] + max2(-most, min2(most, behind));
        c->next[o] = contact_pose(obstacle, c->next_clocks[o]);
        if (obstacle->mesh) {
            mesh_demand(c, o, dt);
        } else {
            c->obstacle_speed[o] = fastest_point(obstacle, c->poses[o], c->next[o], dt);
        }
    }
}

/* velocity of the obstacle at the contact point, from its demanded motion */
static Vec3 point_velocity(const Contact *c, const Touch *touch, double dt) {
    if (!c->def->obstacles[touch->obstacle].moves) {
        return vec3(0, 0, 0);
    }
    Vec3 local = pose_unapply(c->poses[touch->obstacle], touch->point);
    Vec3 moved = pose_apply(c->next[touch->obstacle], local);
    return vec3_scale(1.0 / dt, vec3_sub(moved, touch->point));
}

/* how far the moving obstacle will reach along the normal beyond the plane of now */
static double reach_beyond(const Contact *c, const Touch *touch) {
    const ContactObstacle *obstacle = &c->def->obstacles[touch->obstacle];
    if (!obstacle->moves) {
        return 0.0;
    }
    Pose pose = c->next[touch->obstacle];
    if (obstacle->solid.kind == SOLID_PLANE) {
        Vec3 moved = pose_apply(pose, pose_unapply(c->poses[touch->obstacle], touch->point));
        return vec3_dot(touch->normal, vec3_sub(moved, touch->point));
    }
    Vec3 local = quat_rotate(quat_inverse(pose.turn), touch->normal);
    double reach = solid_support(&obstacle->solid, local) + vec3_dot(touch->normal, pose.shift);
    return reach - vec3_dot(touch->normal, touch->point);
}

/* ---- forces ---- */

static int corner_count(const Touch *touch) { return touch->place[1] < 0 ? 1 : 3; }

/* is the nearest point of a triangle one of its corners, which are met as vertices? */
static bool at_corner(const Touch *touch) {
    return touch->feature == 1 || touch->feature == 2 || touch->feature == 4;
}

static double touch_distance(const Contact *c, const Touch *touch) {
    return c->def->vertex_distance[touch->place[0]];
}

static double touch_mass(const Contact *c, const Touch *touch) {
    return touch->place[1] < 0 ? c->def->mass[touch->place[0]]
                               : surface_panel(&c->surface, touch->place[0])->mass;
}

static Vec3 touch_velocity(const Contact *c, const Touch *touch) {
    return contact_point_velocity(c, corner_count(touch), touch->place, touch->weight);
}

double touch_friction(const Contact *c, const Touch *touch) {
    double own = c->def->obstacles[touch->obstacle].friction;
    return own >= 0.0 ? own : c->def->friction[touch->place[0]];
}

static void push_touch(Contact *c, Touch *touch, double dt, double share) {
    double mass = touch_mass(c, touch), k = CONTACT_STIFFNESS * mass / (dt * dt);
    double force, curvature, critical = 2.0 * sqrt(k * mass);
    double damping = CONTACT_DAMPING * critical;
    contact_law(touch->distance, touch_distance(c, touch), k, &force, &curvature);
    Vec3 carried = point_velocity(c, touch, dt);
    Vec3 v = vec3_sub(touch_velocity(c, touch), carried);
    double vn = vec3_dot(v, touch->normal), total = max2(0.0, force - damping * vn);
    c->statistics.approach = max2(c->statistics.approach, -vn);
    Vec3 sliding = vec3_axpy(v, -vn, touch->normal);
    bool vertex = touch->place[1] < 0;
    double *memory = vertex_bristle(c, touch->place[0], touch->obstacle);
    Vec3 bristle = vertex ? vec3_load(memory) : touch->bristle;
    Vec3 friction = contact_friction(&bristle, touch->normal, sliding, share * dt,
                                     total * touch_friction(c, touch), k, critical);
    touch->bristle = bristle;
    if (vertex) {
        vec3_store(memory, bristle);
    }
    ContactForce push = {.sum = vec3_axpy(friction, total, touch->normal),
                         .damping = vec3_scale(total - force, touch->normal),
                         .friction = friction,
                         .stiffness = curvature + damping / dt};
    contact_carry(c, &push, carried);
    for (int a = 0; a < corner_count(touch); a++) {
        if (touch->weight[a] != 0.0) {
            contact_push(c, touch->place[a], touch->weight[a], &push);
        }
    }
}

static void forget(const Contact *c, Touch *touch) {
    touch->bristle = vec3(0, 0, 0);
    if (touch->place[1] < 0) {
        memset(vertex_bristle(c, touch->place[0], touch->obstacle), 0, 3 * sizeof(double));
    }
}

static void evaluate(Contact *c) {
    Points x = contact_positions(c);
    c->due_touch_count = 0;
    for (int t = 0; t < c->touch_count; t++) {
        Touch *touch = &c->touches[t];
        const GroupTouch *group = &c->group_touches[c->touch_owner[t]];
        if (group->path < c->touch_due[t]) {
            continue;
        }
        if (group->path <= touch->frozen) {
            obstacle_project(&x, touch);
        } else {
            obstacle_evaluate(c, &x, touch);
            touch->frozen = group->path + obstacle_frozen(c, touch);
        }
        c->touch_due[t] = group->path + touch->distance - group->near;
        if (touch->spare) {
            c->touch_due[t] = max2(c->touch_due[t], group->path + touch->margin);
        } else if (touch->distance <= group->near) {
            c->due_touches[c->due_touch_count++] = t;
        } else {
            forget(c, touch);
        }
    }
    c->statistics.evaluations += c->due_touch_count;
    c->statistics.pairs += c->touch_count;
}

/* the touch that already stands for the same edge, or -1 */
static int find_twin(Contact *c, const Touch *touch, int index) {
    int key[3] = {touch->obstacle};
    feature_ends(touch->feature, touch->place, &key[1], &key[2]);
    return contact_find_twin(c, key, index);
}

static bool all_held(const Contact *c, const Touch *touch) {
    bool held = true;
    for (int k = 0; k < corner_count(touch); k++) {
        held = held && c->held[touch->place[k]];
    }
    return held;
}

void obstacle_find(Contact *c, double dt) {
    search(c, true, dt);
    evaluate(c);
    for (int k = 0; k < c->due_touch_count; k++) {
        const Touch *touch = &c->touches[c->due_touches[k]];
        c->statistics.smallest_gap = min2(c->statistics.smallest_gap, touch->distance);
    }
}

void obstacle_forces(Contact *c, double dt, double share) {
    obstacle_find(c, dt);
    contact_clear_twins(c, c->due_touch_count);
    for (int k = 0; k < c->due_touch_count; k++) {
        Touch *touch = &c->touches[c->due_touches[k]];
        bool vertex = touch->place[1] < 0;
        if (touch->distance >= touch_distance(c, touch) || all_held(c, touch) ||
            (!vertex && at_corner(touch))) {
            forget(c, touch);
            continue;
        }
        bool edge = !vertex && touch->feature != 7;
        int twin = edge ? find_twin(c, touch, c->due_touches[k]) : -1;
        if (twin >= 0) {
            touch->bristle = c->touches[twin].bristle;
            continue;
        }
        push_touch(c, touch, dt, share);
    }
}

/* ---- guard ---- */

/* speeds of all groups; returns the largest share of its `near` that one can use up in dt */
static double take_speeds(Contact *c, double dt) {
    int obstacles = c->def->obstacle_count;
    double most = 0.0;
    for (int i = 0; i < contact_cloth_groups(c) * obstacles; i++) {
        const GroupMotion *motion = &c->motion[i / obstacles];
        GroupTouch *group = &c->group_touches[i];
        group->speed = motion->fastest + c->obstacle_speed[i % obstacles];
        most = max2(most, group->speed * dt / group->near);
    }
    return most;
}

void obstacle_refresh(Contact *c, double dt) {
    take_speeds(c, dt);
    if (search(c, false, dt)) {
        evaluate(c);
    }
}

void obstacle_impulses(Contact *c, double dt) {
    for (int k = 0; k < c->due_touch_count; k++) {
        const Touch *touch = &c->touches[c->due_touches[k]];
        double floor = CONTACT_IMPULSE_GAP * touch_distance(c, touch);
        double motion = CONTACT_IMPULSE_RESERVE * dt * c->group_touches[touch->owner].speed;
        if (touch->distance - floor >= motion) {
            continue;
        }
        Vec3 carried = point_velocity(c, touch, dt);
        double vn = vec3_dot(vec3_sub(touch_velocity(c, touch), carried), touch->normal);
        double least = touch->distance > floor ? (floor - touch->distance) / dt : 0.0;
        contact_impulse(c, corner_count(touch), touch->place, touch->weight, touch->normal, carried,
                        vn, least);
    }
}

/* the corners stay on their side of the plane, less what is reserved for the obstacle */
void obstacle_shorten(Contact *c, double dt) {
    Points x = contact_positions(c);
    for (int k = 0; k < c->due_touch_count; k++) {
        const Touch *touch = &c->touches[c->due_touches[k]];
        double reserve = max2(0.0, min2(reach_beyond(c, touch), 0.5 * touch->distance));
        double floor = reserve + CONTACT_PLANE_FLOOR * touch_distance(c, touch);
        double motion = dt * c->motion[touch->owner / c->def->obstacle_count].fastest;
        if (motion <= CONTACT_PLANE_SHARE * (touch->distance - floor)) {
            continue; /* no corner is nearer to the plane */
        }
        for (int a = 0; a < corner_count(touch); a++) {
            Vec3 over = vec3_sub(point_at(&x, touch->place[a]), touch->point);
            double height = vec3_dot(touch->normal, over);
            contact_hold_back(c, touch->place[a], touch->normal, height - floor, dt);
        }
    }
}

/* phi: the largest share of its demanded motion that keeps every near corner separated */
static double free_share(const Contact *c, const Points *x, int o, double dt) {
    double phi = 1.0;
    for (int k = 0; k < c->due_touch_count; k++) {
        const Touch *touch = &c->touches[c->due_touches[k]];
        if (touch->obstacle != o) {
            continue;
        }
        double beyond = reach_beyond(c, touch), gap = INFINITY;
        for (int a = 0; a < corner_count(touch); a++) {
            Vec3 v = contact_velocity(c, touch->place[a]);
            Vec3 end = vec3_axpy(point_at(x, touch->place[a]), dt, v);
            gap = min2(gap, vec3_dot(touch->normal, vec3_sub(end, touch->point)));
        }
        gap -= CONTACT_PLANE_FLOOR * touch_distance(c, touch);
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
        double phi = obstacle->mesh ? mesh_free_share(c, o, dt) : free_share(c, &x, o, dt);
        c->clocks[o] += phi * (c->next_clocks[o] - c->clocks[o]);
        c->poses[o] = phi == 1.0 ? c->next[o] : contact_pose(obstacle, c->clocks[o]);
        c->frames[o] = frame_of(c->poses[o]);
        if (obstacle->mesh) {
            mesh_move(c, o, phi);
        }
    }
}

bool obstacle_check(Contact *c, double dt) {
    bool again = take_speeds(c, dt) > CONTACT_PLANE_SHARE;
    if (again && search(c, false, dt)) {
        evaluate(c);
    }
    return again;
}

void obstacle_advance(Contact *c, double dt) {
    for (int i = 0; i < contact_cloth_groups(c) * c->def->obstacle_count; i++) {
        c->group_touches[i].path += c->group_touches[i].speed * dt;
    }
}

double obstacle_energy(const Contact *c, double dt) {
    double energy = 0.0;
    for (int t = 0; t < c->touch_count; t++) {
        const Touch *touch = &c->touches[t];
        bool vertex = touch->place[1] < 0;
        double force, curvature, k = CONTACT_STIFFNESS * touch_mass(c, touch) / (dt * dt);
        if (c->group_touches[c->touch_owner[t]].path >= c->touch_due[t] &&
            (vertex || !at_corner(touch))) {
            double share = vertex || touch->feature == 7 ? 1.0 : 0.5;
            energy += share *
                      contact_law(touch->distance, touch_distance(c, touch), k, &force, &curvature);
        }
    }
    return energy;
}

int obstacle_remember(const Contact *c, PairMemory *memory, int room) {
    int count = 0;
    for (int t = 0; t < c->touch_count && count < room; t++) {
        const Touch *touch = &c->touches[t];
        if (touch->place[1] >= 0 && vec3_dot(touch->bristle, touch->bristle) > 0.0) {
            touch_key(touch, memory[count].place);
            vec3_store(memory[count++].bristle, touch->bristle);
        }
    }
    return count;
}
