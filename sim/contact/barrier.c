#include "sim/contact/barrier.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/contact/ccd.h"
#include "sim/contact/constants.h"
#include "sim/geom/crossing.h"

#define NO_PLACE INT32_MIN /* in keys of contacts that several pairs stand for */

typedef struct Meeting {
    int key[4];
    int obstacle, count, first; /* count corners, the first so many against the others */
    int place[4];
    double weight[4]; /* of the closest points; negative on the second side */
    double distance, dhat;
    double stiffness, friction; /* k [N/m], mu */
    Vec3 normal;
    double energy, force, curvature;
    Vec3 stretch; /* [m] of the bristle, tangential */
    double limit; /* [m] stretch at which it slips */
    bool slips;
    double tilt; /* [N m] f (R + d) */
    Vec3 gradient[3];
} Meeting;

/* contacts, and a hash table of their keys */
typedef struct Meetings {
    Meeting *items;
    int count, room;
    int *slots, slot_count; /* 1 + index */
} Meetings;

/* a block that is not in the pattern */
typedef struct Lumped {
    int meeting, a, b;
    double factor;
} Lumped;

struct Barrier {
    const ContactDef *def;
    Arena *arena;
    Clamp clamp;
    Meetings now, before;
    Lumped *lumped;
    int lumped_count, lumped_room;
    /* of the step */
    const ContactMemory *memory;
    int *memory_slots, memory_slot_count;
    const double *start;
    const unsigned char *held;
};

Barrier *barrier_create(const ContactDef *def, Arena *arena) {
    Barrier *b = arena_push(arena, Barrier, 1);
    *b = (Barrier){.def = def, .arena = arena, .clamp = clamp_create(def, arena)};
    return b;
}

/* ---- keys ---- */

static unsigned slot_of(const int key[4], int slot_count) {
    return (unsigned)(hash_bytes(key, 4 * sizeof *key) & (uint64_t)(slot_count - 1));
}

static bool same_key(const int a[4], const int b[4]) { return memcmp(a, b, 4 * sizeof *a) == 0; }

static Meeting *find(const Meetings *m, const int key[4]) {
    for (unsigned s = m->slot_count > 0 ? slot_of(key, m->slot_count) : 0; m->slot_count > 0;
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
    unsigned s = slot_of(m->items[index].key, m->slot_count);
    while (m->slots[s] != 0) {
        s = (s + 1) & (unsigned)(m->slot_count - 1);
    }
    m->slots[s] = index + 1;
}

static void clear(Meetings *m) {
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

void barrier_begin(Barrier *b, const ContactMemory *memory, const double *x,
                   const unsigned char *held) {
    b->memory = memory;
    b->start = x;
    b->held = held;
    clear(&b->now);
    clear(&b->before);
    if (b->memory_slot_count < 2 * memory->pair_count || b->memory_slot_count == 0) {
        b->memory_slot_count = b->memory_slot_count > 0 ? b->memory_slot_count : 1024;
        while (b->memory_slot_count < 2 * memory->pair_count) {
            b->memory_slot_count *= 2;
        }
        b->memory_slots = arena_push(b->arena, int, b->memory_slot_count);
    }
    memset(b->memory_slots, 0, (size_t)b->memory_slot_count * sizeof *b->memory_slots);
    for (int i = 0; i < memory->pair_count; i++) {
        unsigned s = slot_of(memory->pairs[i].place, b->memory_slot_count);
        while (b->memory_slots[s] != 0) {
            s = (s + 1) & (unsigned)(b->memory_slot_count - 1);
        }
        b->memory_slots[s] = i + 1;
    }
}

/* bristle at the start of the step */
static Vec3 remembered(const Barrier *b, const Meeting *m) {
    if (m->count == 1) {
        size_t at = (size_t)m->place[0] * (size_t)b->def->obstacle_count + (size_t)m->obstacle;
        return vec3_load(b->memory->bristles + 3 * at);
    }
    unsigned s = slot_of(m->key, b->memory_slot_count);
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

static void rub(const Barrier *b, Meeting *m, const double *x) {
    Vec3 t = remembered(b, m);
    for (int k = 0; k < m->count; k++) {
        size_t at = 3 * (size_t)m->place[k];
        Vec3 moved = vec3_sub(vec3_load(x + at), vec3_load(b->start + at));
        t = vec3_axpy(t, m->weight[k], moved);
    }
    m->stretch = vec3_axpy(t, -vec3_dot(t, m->normal), m->normal);
    m->limit = m->friction * m->force / (CONTACT_BRISTLE_SHARE * m->stiffness);
    m->slips = vec3_length(m->stretch) > m->limit;
    const Meeting *old = find(&b->before, m->key);
    if (old && old->slips && vec3_dot(m->stretch, old->stretch) <= 0.0) {
        m->slips = false;
    }
}

/* with distance, normal, weights known */
static void meet(Barrier *b, Meeting *m, const double *x) {
    m->energy = contact_law(m->distance, m->dhat, m->stiffness, &m->force, &m->curvature);
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
    Pose pose = b->memory->poses[obstacle];
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
                     .weight = {1.0},
                     .distance = d,
                     .dhat = def->vertex_distance[i],
                     .stiffness = stiffness_of(b, CONTACT_STIFFNESS, def->mass[i]),
                     .friction = obstacle_friction(b, obstacle, i),
                     .normal = quat_rotate(pose.turn, normal)};
        meet(b, &m, x);
    }
}

/* gradients of the weights over the feature that holds the nearest point, and f (R + d) */
static void tilt(const Solid *solid, Meeting *m, const Vec3 y[3], Vec3 up, Pose pose) {
    bool round = solid->kind == SOLID_SPHERE || solid->kind == SOLID_CAPSULE ||
                 (solid->kind == SOLID_CYLINDER && up.z == 0.0);
    if (!round) {
        return;
    }
    int corners = 0, at[3] = {0};
    for (int k = 0; k < m->count; k++) {
        at[corners] = k;
        corners += m->weight[k] != 0.0;
    }
    Vec3 gradient[3] = {{0, 0, 0}};
    if (corners == 2) {
        Vec3 e = vec3_sub(y[at[1]], y[at[0]]);
        gradient[at[1]] = vec3_scale(1.0 / vec3_dot(e, e), e);
        gradient[at[0]] = vec3_scale(-1.0, gradient[at[1]]);
    } else {
        Vec3 across = vec3_cross(vec3_sub(y[1], y[0]), vec3_sub(y[2], y[0]));
        for (int k = 0; k < 3; k++) {
            Vec3 e = vec3_sub(y[(k + 2) % 3], y[(k + 1) % 3]);
            gradient[k] = vec3_scale(1.0 / vec3_dot(across, across), vec3_cross(across, e));
        }
    }
    bool along_axis = solid->kind == SOLID_CYLINDER || up.z == 0.0; /* no curvature along z */
    for (int k = 0; k < 3; k++) {
        gradient[k].z = solid->kind != SOLID_SPHERE && along_axis ? 0.0 : gradient[k].z;
        m->gradient[k] = quat_rotate(pose.turn, gradient[k]);
    }
    double force, curvature;
    contact_law(m->distance, m->dhat, m->stiffness, &force, &curvature);
    m->tilt = force * (solid->radius + m->distance);
}

static Meeting touch_of(const Barrier *b, const Candidate *item, int count) {
    double mass = surface_panel(&b->clamp.near.surface, item->place[0])->mass;
    return (Meeting){.obstacle = item->obstacle,
                     .count = count,
                     .first = count,
                     .dhat = item->dhat,
                     .stiffness = stiffness_of(b, CONTACT_STIFFNESS, mass),
                     .friction = obstacle_friction(b, item->obstacle, item->place[0])};
}

/* one side of a triangle, from p to q: its nearest point, if that lies inside; returns the least
 * distance of the side */
static double find_side(Barrier *b, const Candidate *item, const Vec3 y[3], int p, int q,
                        const double *x) {
    const Solid *solid = &b->def->obstacles[item->obstacle].solid;
    Pose pose = b->memory->poses[item->obstacle];
    Vec3 side[3] = {y[p], y[q], y[q]}, up, ignored;
    double w[3];
    int feature, place[2] = {item->place[p], item->place[q]};
    double d = ccd_solid_distance(solid, side, &up, w, &feature);
    double ends =
        fmin(solid_distance(solid, y[p], &ignored), solid_distance(solid, y[q], &ignored));
    int low = place[0] < place[1] ? place[0] : place[1];
    Meeting m = touch_of(b, item, 2);
    int key[4] = {low, place[0] + place[1] - low, -1, item->obstacle};
    memcpy(m.key, key, sizeof key);
    if (d >= item->dhat || d >= ends - CONTACT_LEVEL * item->dhat ||
        (b->held[place[0]] && b->held[place[1]]) || find(&b->now, key)) {
        return d;
    }
    memcpy(m.place, place, sizeof place);
    m.weight[0] = w[0], m.weight[1] = 1.0 - w[0];
    m.distance = d;
    m.normal = quat_rotate(pose.turn, up);
    tilt(solid, &m, side, up, pose);
    meet(b, &m, x);
    return d;
}

/* Edges and faces; corners are met as vertices. Every edge has a contact of its own: only one for
 * a triangle would jump from edge to edge where a chord lies along a cylinder or an edge. */
static void find_triangle(Barrier *b, const Candidate *item, const double *x) {
    const Solid *solid = &b->def->obstacles[item->obstacle].solid;
    Pose pose = b->memory->poses[item->obstacle];
    Vec3 y[3], up;
    double w[3], sides = INFINITY;
    int feature;
    bool held = true;
    for (int k = 0; k < 3; k++) {
        y[k] = pose_unapply(pose, vec3_load(x + 3 * (size_t)item->place[k]));
        held = held && b->held[item->place[k]];
    }
    double d = ccd_solid_distance(solid, y, &up, w, &feature);
    if (d >= item->dhat || held) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        sides = fmin(sides, find_side(b, item, y, k, (k + 1) % 3, x));
    }
    if (feature != 7 || d >= sides - CONTACT_LEVEL * item->dhat) {
        return;
    }
    Meeting m = touch_of(b, item, 3);
    m.key[3] = item->obstacle;
    memcpy(m.key, item->place, 3 * sizeof *m.key);
    memcpy(m.place, item->place, 3 * sizeof *m.place);
    memcpy(m.weight, w, sizeof w);
    m.distance = d;
    m.normal = quat_rotate(pose.turn, up);
    tilt(solid, &m, y, up, pose);
    meet(b, &m, x);
}

static void find_pair(Barrier *b, const Candidate *item, const double *x) {
    const ContactDef *def = b->def;
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
    const Surface *surface = &b->clamp.near.surface;
    double mass = fmin(surface_panel(surface, p[0])->mass, surface_panel(surface, p[3])->mass);
    Meeting m = {.key = {p[0], p[1], p[2], pair.kind == PAIR_EDGES ? -1 - p[3] : p[3]},
                 .obstacle = -1,
                 .count = 4,
                 .first = pair.kind == PAIR_FACE ? 1 : 2,
                 .distance = pair.distance,
                 .dhat = item->dhat,
                 .stiffness = stiffness_of(b, CONTACT_SELF_STIFFNESS * pair.soft, mass),
                 .friction = sqrt(def->friction[p[0]] * def->friction[p[3]]),
                 .normal = pair.normal};
    memcpy(m.place, p, sizeof m.place);
    memcpy(m.weight, pair.weight, sizeof m.weight);
    if (pair.kind == PAIR_FACE && pair.feature != 7) {
        pair_twin_key(&pair, m.key);
        m.key[3] = NO_PLACE;
        if (find(&b->now, m.key)) {
            return;
        }
    }
    meet(b, &m, x);
}

BarrierReport barrier_look(Barrier *b, const double *x) {
    Meetings swap = b->before;
    b->before = b->now;
    b->now = swap;
    clear(&b->now);
    Candidates *near = &b->clamp.near;
    candidates_find(near, b->memory->poses, x, NULL);
    for (int o = 0; o < b->def->obstacle_count; o++) {
        find_vertices(b, o, x);
    }
    for (int i = 0; i < near->count; i++) {
        const Candidate *item = &near->items[i];
        if (item->obstacle < 0) {
            find_pair(b, item, x);
        } else if (b->def->obstacles[item->obstacle].solid.kind != SOLID_PLANE) {
            find_triangle(b, item, x);
        }
    }
    BarrierReport report = {b->now.count, INFINITY, INFINITY};
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        double *gap = m->obstacle < 0 ? &report.smallest_self_gap : &report.smallest_gap;
        *gap = fmin(*gap, m->distance);
    }
    return report;
}

/* ---- energy, gradient, stiffness ---- */

double barrier_energy(const Barrier *b) {
    double energy = 0.0;
    for (int i = 0; i < b->now.count; i++) {
        energy += b->now.items[i].energy;
    }
    return energy;
}

static Vec3 friction_of(const Meeting *m) {
    double kt = CONTACT_BRISTLE_SHARE * m->stiffness, length = vec3_length(m->stretch);
    return vec3_scale(m->slips ? -kt * m->limit / length : -kt, m->stretch);
}

void barrier_add_gradient(const Barrier *b, double *g) {
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        Vec3 force = vec3_axpy(friction_of(m), m->force, m->normal);
        for (int k = 0; k < m->count; k++) {
            double *at = g + 3 * (size_t)m->place[k];
            vec3_store(at, vec3_axpy(vec3_load(at), -m->weight[k], force));
        }
    }
}

static void add_outer(double block[9], double s, Vec3 a) {
    double v[3] = {a.x, a.y, a.z};
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            block[3 * r + c] += s * v[r] * v[c];
        }
    }
}

/* S of one contact */
static void stiffness_block(const Meeting *m, double block[9]) {
    double kt = CONTACT_BRISTLE_SHARE * m->stiffness, length = vec3_length(m->stretch);
    double s = m->friction == 0.0 ? 0.0 : m->slips ? kt * m->limit / length : kt;
    memset(block, 0, 9 * sizeof *block);
    block[0] = block[4] = block[8] = s;
    add_outer(block, m->curvature - s, m->normal);
    if (m->slips && s > 0.0) {
        add_outer(block, -s, vec3_scale(1.0 / length, m->stretch));
    }
}

static void lump(Barrier *b, int meeting, int a, int c, double factor) {
    if (b->lumped_count == b->lumped_room) {
        b->lumped_room = 2 * b->lumped_room + 1024;
        b->lumped = arena_grow(b->arena, Lumped, b->lumped, b->lumped_count, b->lumped_room);
    }
    b->lumped[b->lumped_count++] = (Lumped){meeting, a, c, factor};
}

static void scaled(const double s[9], double factor, double block[9]) {
    for (int k = 0; k < 9; k++) {
        block[k] = factor * s[k];
    }
}

static void add_meeting(Barrier *b, int index, BarrierAdd *add, void *context) {
    const Meeting *m = &b->now.items[index];
    double s[9], block[9];
    stiffness_block(m, s);
    for (int k = 0; k < m->count; k++) {
        for (int l = k; l < m->count; l++) {
            double factor = m->weight[k] * m->weight[l];
            scaled(s, factor, block);
            if (m->tilt > 0.0) {
                add_outer(block, m->tilt * vec3_dot(m->gradient[k], m->gradient[l]), m->normal);
            } else if (factor == 0.0) {
                continue;
            }
            bool same_side = (k < m->first) == (l < m->first);
            if (same_side && add(context, m->place[k], m->place[l], block)) {
                continue;
            }
            scaled(s, fabs(factor), block);
            add(context, m->place[k], m->place[k], block);
            add(context, m->place[l], m->place[l], block);
            lump(b, index, m->place[k], m->place[l], factor);
        }
    }
}

void barrier_add_stiffness(Barrier *b, BarrierAdd *add, void *context) {
    b->lumped_count = 0;
    for (int i = 0; i < b->now.count; i++) {
        add_meeting(b, i, add, context);
    }
}

static Vec3 multiply(const double s[9], Vec3 p) {
    return vec3(s[0] * p.x + s[1] * p.y + s[2] * p.z, s[3] * p.x + s[4] * p.y + s[5] * p.z,
                s[6] * p.x + s[7] * p.y + s[8] * p.z);
}

static void add_scaled(double *y, int place, double factor, Vec3 p) {
    double *at = y + 3 * (size_t)place;
    vec3_store(at, vec3_axpy(vec3_load(at), factor, p));
}

bool barrier_add_lumped(const Barrier *b, const double *p, double *y) {
    double s[9];
    for (int i = 0; i < b->lumped_count; i++) {
        const Lumped *l = &b->lumped[i];
        if (i == 0 || b->lumped[i - 1].meeting != l->meeting) {
            stiffness_block(&b->now.items[l->meeting], s);
        }
        Vec3 sa = multiply(s, vec3_load(p + 3 * (size_t)l->a));
        Vec3 sb = multiply(s, vec3_load(p + 3 * (size_t)l->b));
        add_scaled(y, l->a, l->factor, sb);
        add_scaled(y, l->a, -fabs(l->factor), sa);
        add_scaled(y, l->b, l->factor, sa);
        add_scaled(y, l->b, -fabs(l->factor), sb);
    }
    return b->lumped_count > 0;
}

/* ---- the rest ---- */

void barrier_mark(const Barrier *b, unsigned char *flags) {
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        for (int k = 0; k < m->count; k++) {
            flags[m->place[k]] = flags[m->place[k]] || m->weight[k] != 0.0;
        }
    }
}

ClampReport barrier_clamp(Barrier *b, const double *x, double *dx, const unsigned char **changed) {
    ClampReport report = clamp_motion(&b->clamp, b->memory->poses, b->held, x, dx);
    if (changed) {
        *changed = b->clamp.changed;
    }
    return report;
}

void barrier_end(const Barrier *b, ContactMemory *memory) {
    size_t obstacles = (size_t)b->def->obstacle_count;
    memset(memory->bristles, 0,
           3 * (size_t)b->def->vertex_count * obstacles * sizeof *memory->bristles);
    memory->pair_count = memory->touch_count = 0;
    for (int i = 0; i < b->now.count; i++) { /* those at obstacles come first */
        const Meeting *m = &b->now.items[i];
        double length = vec3_length(m->stretch);
        Vec3 t = length > m->limit ? vec3_scale(m->limit / length, m->stretch) : m->stretch;
        if (m->count == 1) {
            size_t at = (size_t)m->place[0] * obstacles + (size_t)m->obstacle;
            vec3_store(memory->bristles + 3 * at, t);
        } else if (vec3_dot(t, t) > 0.0 && memory->pair_count < memory->pair_room) {
            PairMemory *pair = &memory->pairs[memory->pair_count++];
            memcpy(pair->place, m->key, sizeof pair->place);
            vec3_store(pair->bristle, t);
            memory->touch_count += m->obstacle >= 0;
        }
    }
}

int barrier_count_crossings(const Barrier *b, const double *x) {
    const Surface *s = &b->clamp.near.surface;
    Arena scratch = {0};
    CrossingMesh mesh = {b->def->vertex_count, s->triangle_count, x, s->triangles};
    int64_t count = b->def->self ? crossing_count_self(&mesh, &scratch).count : 0;
    for (int o = 0; o < b->def->obstacle_count; o++) {
        count +=
            crossing_count_solid(&mesh, &b->def->obstacles[o].solid, b->memory->poses[o]).count;
    }
    arena_free(&scratch);
    return (int)count;
}
