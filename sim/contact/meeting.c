#include "sim/contact/meeting.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/contact/ccd.h"
#include "sim/contact/constants.h"

#define LEVEL_NORMAL 1e-12 /* along the axis: the nearest point is on the round side */
#define NO_PLACE INT32_MIN /* in keys of contacts that several pairs stand for */

/* ---- keys ---- */

unsigned meeting_slot(const int key[4], int slot_count) {
    return (unsigned)(hash_bytes(key, 4 * sizeof *key) & (uint64_t)(slot_count - 1));
}

static bool same_key(const int a[4], const int b[4]) { return memcmp(a, b, 4 * sizeof *a) == 0; }

static Meeting *find(const Meetings *m, const int key[4]) {
    for (unsigned s = m->slot_count > 0 ? meeting_slot(key, m->slot_count) : 0; m->slot_count > 0;
         s = (s + 1) & (unsigned)(m->slot_count - 1)) {
        if (m->slots[s] == 0) {
            return NULL;
        }
        if (same_key(m->items[m->slots[s] - 1].key, key)) {
            return &m->items[m->slots[s] - 1];
        }
    }
    return NULL;
}

static void index_meeting(Meetings *m, int index) {
    unsigned s = meeting_slot(m->items[index].key, m->slot_count);
    while (m->slots[s] != 0) {
        s = (s + 1) & (unsigned)(m->slot_count - 1);
    }
    m->slots[s] = index + 1;
}

void meetings_clear(Meetings *m) {
    m->count = 0;
    if (m->slot_count > 0) {
        memset(m->slots, 0, (size_t)m->slot_count * sizeof *m->slots);
    }
}

static Meeting *append(Barrier *b, const Meeting *meeting) {
    Meetings *m = &b->now;
    if (m->count == m->room) {
        m->room = m->room > 0 ? 2 * m->room : 1024;
        m->items = arena_grow(b->arena, Meeting, m->items, m->count, m->room);
        m->slot_count = 2 * m->room;
        m->slots = arena_push(b->arena, int, m->slot_count);
        for (int i = 0; i < m->count; i++) {
            index_meeting(m, i);
        }
    }
    m->items[m->count] = *meeting;
    index_meeting(m, m->count);
    return &m->items[m->count++];
}

/* bristle at the start of the step */
static Vec3 remembered(const Barrier *b, const Meeting *m) {
    if (m->count == 1) {
        size_t at = (size_t)m->place[0] * (size_t)b->def->obstacle_count + (size_t)m->obstacle;
        return vec3_load(b->memory->bristles + 3 * at);
    }
    unsigned s = meeting_slot(m->key, b->memory_slot_count);
    while (b->memory_slots[s] != 0) {
        const PairMemory *pair = &b->memory->pairs[b->memory_slots[s] - 1];
        if (same_key(pair->place, m->key)) {
            return vec3_load(pair->bristle);
        }
        s = (s + 1) & (unsigned)(b->memory_slot_count - 1);
    }
    return vec3(0, 0, 0);
}

/* ---- finding ---- */

/* motion of the mesh since the start of the step, where it is touched now; the other way round where
 * the mesh is the first side, as the force is */
static Vec3 carried_by_mesh(const Barrier *b, const Meeting *m, const double *x) {
    Vec3 sum = {0, 0, 0};
    for (int k = 0; k < m->count; k++) {
        size_t at = 3 * (size_t)m->place[k];
        if (!is_cloth(b, m->place[k])) {
            Vec3 moved = vec3_sub(vec3_load(x + at), vec3_load(b->start + at));
            sum = vec3_axpy(sum, -m->foot.weight[k], moved);
        }
    }
    return sum;
}

/* motion of the obstacle since the start of the step, where it is touched now */
static Vec3 carried(const Barrier *b, const Meeting *m, const double *x) {
    if (m->obstacle < 0) {
        return carried_by_mesh(b, m, x);
    }
    if (!b->def->obstacles[m->obstacle].moves) {
        return vec3(0, 0, 0);
    }
    Vec3 at = {0, 0, 0};
    for (int k = 0; k < m->count; k++) {
        at = vec3_axpy(at, m->foot.weight[k], vec3_load(x + 3 * (size_t)m->place[k]));
    }
    Vec3 body = pose_unapply(b->poses[m->obstacle], at);
    return vec3_sub(at, pose_apply(b->memory->poses[m->obstacle], body));
}

static void rub(const Barrier *b, Meeting *m, const double *x) {
    m->carried = carried(b, m, x);
    Vec3 before = remembered(b, m), t = vec3_sub(before, m->carried), n = m->foot.normal;
    for (int k = 0; k < m->count; k++) {
        size_t at = 3 * (size_t)m->place[k];
        if (is_cloth(b, m->place[k])) {
            Vec3 moved = vec3_sub(vec3_load(x + at), vec3_load(b->start + at));
            t = vec3_axpy(t, m->foot.weight[k], moved);
        }
    }
    m->slid = vec3_sub(t, before);
    m->stretch = vec3_axpy(t, -vec3_dot(t, n), n);
    m->limit = m->friction * m->force / (CONTACT_BRISTLE_SHARE * m->stiffness);
    m->slips = vec3_length(m->stretch) > m->limit;
}

/* with foot and stiffness known */
static void meet(Barrier *b, Meeting *m, const double *x) {
    m->energy = contact_law(m->foot.distance, m->dhat, m->stiffness, &m->force, &m->curvature);
    m->tilt *= m->force;
    rub(b, m, x);
    append(b, m);
}

static double obstacle_friction(const Barrier *b, int obstacle, int place) {
    double own = b->def->obstacles[obstacle].friction;
    return own >= 0.0 ? own : b->def->friction[place];
}

static double stiffness_of(const Barrier *b, double share, double mass) {
    return share * mass / (b->def->reference_step * b->def->reference_step);
}

static void find_vertices(Barrier *b, int obstacle, const double *x) {
    const ContactDef *def = b->def;
    Pose pose = b->poses[obstacle];
    for (int i = 0; i < def->vertex_count; i++) {
        Vec3 normal, at = vec3_load(x + 3 * (size_t)i);
        if (def->mass[i] == 0.0 || b->held[i]) {
            continue;
        }
        double d = solid_distance(&def->obstacles[obstacle].solid, pose_unapply(pose, at), &normal);
        if (d >= def->vertex_distance[i]) {
            continue;
        }
        Meeting m = {.key = {i, -1, -1, obstacle},
                     .obstacle = obstacle,
                     .count = 1,
                     .first = 1,
                     .place = {i},
                     .foot = {d, {1.0}, quat_rotate(pose.turn, normal)},
                     .dhat = def->vertex_distance[i],
                     .stiffness = stiffness_of(b, CONTACT_STIFFNESS, def->mass[i]),
                     .share = 1.0,
                     .friction = obstacle_friction(b, obstacle, i)};
        meet(b, &m, x);
    }
}

/* A triangle at a solid, in the frame of the solid. */
typedef struct Near {
    const Candidate *item;
    const Solid *solid;
    Pose pose;
    Vec3 y[3]; /* its corners */
    double distance[3];
} Near;

/* gradients of the weights over the feature that holds the nearest point, and R + d */
static void tilt(const Near *near, Meeting *m, const Vec3 y[3]) {
    const Solid *solid = near->solid;
    Vec3 up = quat_rotate(quat_inverse(near->pose.turn), m->foot.normal);
    bool round = solid->kind == SOLID_SPHERE || solid->kind == SOLID_CAPSULE ||
                 (solid->kind == SOLID_CYLINDER && fabs(up.z) < LEVEL_NORMAL);
    if (!round) {
        return;
    }
    Vec3 gradient[3] = {{0, 0, 0}};
    if (m->count == 2) {
        Vec3 e = vec3_sub(y[1], y[0]);
        gradient[1] = vec3_scale(1.0 / vec3_dot(e, e), e);
        gradient[0] = vec3_scale(-1.0, gradient[1]);
    } else {
        Vec3 across = vec3_cross(vec3_sub(y[1], y[0]), vec3_sub(y[2], y[0]));
        for (int k = 0; k < 3; k++) {
            Vec3 e = vec3_sub(y[(k + 2) % 3], y[(k + 1) % 3]);
            gradient[k] = vec3_scale(1.0 / vec3_dot(across, across), vec3_cross(across, e));
        }
    }
    bool along_axis = solid->kind == SOLID_CYLINDER || fabs(up.z) < LEVEL_NORMAL;
    for (int k = 0; k < 3; k++) {
        gradient[k].z = solid->kind != SOLID_SPHERE && along_axis ? 0.0 : gradient[k].z;
        m->gradient[k] = quat_rotate(near->pose.turn, gradient[k]);
    }
    m->tilt = solid->radius + m->foot.distance;
}

static Meeting touch_of(const Barrier *b, const Candidate *item, int count) {
    double mass = surface_panel(&b->clamp.near.places.surface, item->place[0])->mass;
    return (Meeting){.obstacle = item->obstacle,
                     .count = count,
                     .first = count,
                     .dhat = item->dhat,
                     .stiffness = stiffness_of(b, CONTACT_STIFFNESS, mass),
                     .share = 1.0,
                     .friction = obstacle_friction(b, item->obstacle, item->place[0])};
}

/* inside a side or a face, which is nearer than its border by `lower` [m] */
static void fade(Meeting *m, double lower) {
    m->share = contact_share_inside(lower, m->dhat);
    m->stiffness *= m->share;
}

static Foot foot_of(const Near *near, const Vec3 y[3]) {
    Foot foot;
    Vec3 up;
    int feature;
    foot.distance = ccd_solid_distance(near->solid, y, &up, foot.weight, &feature);
    foot.normal = quat_rotate(near->pose.turn, up);
    return foot;
}

/* one side of a triangle, from corner p to corner q: its nearest point, if that lies inside; returns
 * the least distance of the side */
static double find_side(Barrier *b, const Near *near, int p, int q, const double *x) {
    const Candidate *item = near->item;
    int place[2] = {item->place[p], item->place[q]};
    Vec3 side[3] = {near->y[p], near->y[q], near->y[q]};
    Foot foot = foot_of(near, side);
    foot.weight[1] = 1.0 - foot.weight[0];
    int low = place[0] < place[1] ? place[0] : place[1];
    int key[4] = {low, place[0] + place[1] - low, -1, item->obstacle};
    double ends = fmin(near->distance[p], near->distance[q]);
    if (foot.distance >= item->dhat || foot.distance >= ends - CONTACT_LEVEL * item->dhat ||
        (b->held[place[0]] && b->held[place[1]]) || find(&b->now, key)) {
        return foot.distance;
    }
    Meeting m = touch_of(b, item, 2);
    m.foot = foot;
    fade(&m, ends - foot.distance);
    memcpy(m.key, key, sizeof key);
    memcpy(m.place, place, sizeof place);
    tilt(near, &m, side);
    meet(b, &m, x);
    return foot.distance;
}

/* Edges and faces; corners are met as vertices. Every edge has a contact of its own: only one for
 * a triangle would jump from edge to edge where a chord lies along a cylinder or an edge. */
static void find_triangle(Barrier *b, const Candidate *item, const double *x) {
    Near near = {.item = item,
                 .solid = &b->def->obstacles[item->obstacle].solid,
                 .pose = b->poses[item->obstacle]};
    bool held = true;
    double sides = INFINITY;
    Vec3 ignored;
    for (int k = 0; k < 3; k++) {
        near.y[k] = pose_unapply(near.pose, vec3_load(x + 3 * (size_t)item->place[k]));
        near.distance[k] = solid_distance(near.solid, near.y[k], &ignored);
        held = held && b->held[item->place[k]];
    }
    Meeting m = touch_of(b, item, 3);
    m.foot = foot_of(&near, near.y);
    if (m.foot.distance >= item->dhat || held) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        sides = fmin(sides, find_side(b, &near, k, (k + 1) % 3, x));
    }
    if (m.foot.distance >= sides - CONTACT_LEVEL * item->dhat) {
        return;
    }
    fade(&m, sides - m.foot.distance);
    m.key[3] = item->obstacle;
    memcpy(m.key, item->place, 3 * sizeof *m.key);
    memcpy(m.place, item->place, 3 * sizeof *m.place);
    tilt(&near, &m, near.y);
    meet(b, &m, x);
}

static double pair_friction(const Barrier *b, const int place[4]) {
    int first = place[0], second = place[3];
    if (!is_cloth(b, first)) {
        return obstacle_friction(b, places_obstacle(&b->clamp.near.places, first), second);
    }
    if (!is_cloth(b, second)) {
        return obstacle_friction(b, places_obstacle(&b->clamp.near.places, second), first);
    }
    return sqrt(b->def->friction[first] * b->def->friction[second]);
}

static void find_pair(Barrier *b, const Candidate *item, const double *x) {
    Points points = {x};
    Pair pair = {.kind = item->kind};
    memcpy(pair.place, item->place, sizeof pair.place);
    pair_evaluate(&points, &pair);
    const int *p = pair.place;
    bool held = b->held[p[0]] && b->held[p[1]] && b->held[p[2]] && b->held[p[3]];
    if (pair.distance >= item->dhat || held || !(pair.distance > 0.0) || pair.soft <= 0.0 ||
        (pair.kind == PAIR_EDGES && pair.feature != 3)) {
        return;
    }
    const Surface *surface = &b->clamp.near.places.surface;
    double mass = fmin(surface_panel(surface, p[0])->mass, surface_panel(surface, p[3])->mass);
    bool cloth = is_cloth(b, p[0]) && is_cloth(b, p[3]);
    double share = cloth ? CONTACT_SELF_STIFFNESS : CONTACT_STIFFNESS;
    Meeting m = {.key = {p[0], p[1], p[2], pair.kind == PAIR_EDGES ? -1 - p[3] : p[3]},
                 .obstacle = -1,
                 .count = 4,
                 .first = pair.kind == PAIR_FACE ? 1 : 2,
                 .foot = {.distance = pair.distance, .normal = pair.normal},
                 .dhat = item->dhat,
                 .stiffness = stiffness_of(b, share * pair.soft, mass),
                 .share = 1.0,
                 .friction = pair_friction(b, p)};
    memcpy(m.place, p, sizeof m.place);
    memcpy(m.foot.weight, pair.weight, sizeof m.foot.weight);
    if (pair.kind == PAIR_FACE && pair.feature != 7) {
        pair_twin_key(&pair, m.key);
        m.key[3] = NO_PLACE;
        if (find(&b->now, m.key)) {
            return;
        }
    }
    meet(b, &m, x);
}

void meetings_find(Barrier *b, const double *x) {
    meetings_clear(&b->now);
    Candidates *near = &b->clamp.near;
    candidates_find(near, b->poses, b->poses, x, NULL);
    for (int o = 0; o < b->def->obstacle_count; o++) {
        if (!b->def->obstacles[o].mesh) {
            find_vertices(b, o, x);
        }
    }
    for (int i = 0; i < near->count; i++) {
        const Candidate *item = &near->items[i];
        if (item->obstacle < 0) {
            find_pair(b, item, x);
        } else if (b->def->obstacles[item->obstacle].solid.kind != SOLID_PLANE) {
            find_triangle(b, item, x);
        }
    }
}
