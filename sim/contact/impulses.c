#include "sim/contact/impulses.h"

#include <math.h>
#include <string.h>

#include "sim/contact/ccd.h"
#include "sim/contact/force.h"

#define REPULSION_PART 0.1      /* of d/dt: the fastest parting that a repulsion makes */
#define REPULSION_STIFFNESS 0.6 /* k = share m / reference_step^2: about that of the threads */
#define COLLISION_CORE 0.05     /* of H: nearer than this in a step is a collision */
#define COLLISION_ROUNDS 5
#define MOST_ZONE_SHARE 0.02 /* of the vertices: more glued ones are a step too long */
#define LEAST_ZONE_ROOM 16   /* vertices that zones may always have: two pairs and a bit */

Impulses *impulses_create(const Contact *c, Arena *arena) {
    int n = c->places.count;
    Impulses *i = arena_push(arena, Impulses, 1);
    i->zones = impact_zones_create(n, arena);
    i->changed = arena_push(arena, int, n);
    i->mass = arena_push(arena, double, n);
    i->place = arena_push(arena, Vec3, n);
    i->move = arena_push(arena, Vec3, n);
    return i;
}

/* ---- what strikes ---- */

static Strike strike_of_pair(const Contact *c, const Pair *pair) {
    Strike s = {.count = 4, .normal = pair->normal, .friction = pair_friction(c, pair)};
    memcpy(s.place, pair->place, sizeof s.place);
    memcpy(s.weight, pair->weight, sizeof s.weight);
    return s;
}

static Strike strike_of_touch(const Contact *c, const Touch *touch) {
    Strike s = {.count = touch->place[1] < 0 ? 1 : 3,
                .normal = touch->normal,
                .friction = touch_friction(c, touch)};
    memcpy(s.place, touch->place, sizeof touch->place);
    memcpy(s.weight, touch->weight, sizeof touch->weight);
    return s;
}

static bool all_held(const Contact *c, const Strike *s) {
    bool held = true;
    for (int a = 0; a < s->count; a++) {
        held = held && c->held[s->place[a]];
    }
    return held;
}

/* the velocity from here on counts as that before the step's impulses (losses.c) */
static void note_before(Contact *c, const Strike *s) {
    for (int a = 0; a < s->count; a++) {
        int place = s->place[a];
        if (place < c->def->vertex_count && !c->is_touched[place]) {
            c->is_touched[place] = 1;
            c->touched[c->touched_count++] = place;
            c->tolls[place] = (Toll){.before = contact_velocity(c, place)};
        }
    }
}

static void note_change(Contact *c, const Strike *s) {
    for (int a = 0; a < s->count; a++) {
        c->impulses->changed[s->place[a]] = c->impulses->round;
    }
}

/* ---- impulses ---- */

static double mobility_of(const Contact *c, const Strike *s) {
    double mobility = 0.0;
    for (int a = 0; a < s->count; a++) {
        mobility += s->weight[a] * s->weight[a] * contact_mobility(c, s->place[a]);
    }
    return mobility;
}

double impulses_stop(Contact *c, const Strike *s, double wanted) {
    Vec3 v = contact_point_velocity(c, s->count, s->place, s->weight);
    double apart = vec3_dot(v, s->normal);
    if (apart >= wanted || mobility_of(c, s) <= 0.0) {
        return 0.0;
    }
    note_before(c, s);
    note_change(c, s);
    contact_impulse(c, s->count, s->place, s->weight, s->normal, vec3(0, 0, 0), apart, wanted);
    return wanted - apart;
}

Vec3 impulses_rub(Contact *c, const Strike *s, double grown) {
    Vec3 v = contact_point_velocity(c, s->count, s->place, s->weight);
    Vec3 sliding = vec3_axpy(v, -vec3_dot(v, s->normal), s->normal);
    double speed = vec3_length(sliding), taken = min2(s->friction * grown, speed);
    if (!(taken > 0.0)) {
        return vec3(0, 0, 0);
    }
    Vec3 impulse = vec3_scale(-taken / (speed * mobility_of(c, s)), sliding);
    for (int a = 0; a < s->count; a++) {
        int place = s->place[a];
        double share = s->weight[a] * contact_mobility(c, place);
        if (share != 0.0) {
            contact_mark_changed(c, place);
            vec3_store(c->v + 3 * (long)place,
                       vec3_axpy(contact_velocity(c, place), share, impulse));
        }
    }
    return impulse;
}

/* the work of a repulsion is known at the end of the step */
static void pay(Contact *c, const Strike *s, Vec3 parting, Vec3 friction) {
    for (int a = 0; a < s->count; a++) {
        if (s->place[a] < c->def->vertex_count) {
            Toll *toll = &c->tolls[s->place[a]];
            toll->damping = vec3_axpy(toll->damping, s->weight[a], parting);
            toll->friction = vec3_axpy(toll->friction, s->weight[a], friction);
        }
    }
}

static void repel(Contact *c, const Strike *s, double overlap, double mass, double dt) {
    Vec3 v = contact_point_velocity(c, s->count, s->place, s->weight);
    double apart = vec3_dot(v, s->normal), most = REPULSION_PART * overlap / dt;
    double k = REPULSION_STIFFNESS * mass / (c->def->reference_step * c->def->reference_step);
    c->statistics.approach = max2(c->statistics.approach, -apart);
    if (apart < most) {
        double spring = dt * k * overlap * mobility_of(c, s);
        double grown = impulses_stop(c, s, min2(max2(apart, 0.0) + spring, most));
        if (grown > 0.0) {
            Vec3 parting = vec3_scale(grown / mobility_of(c, s), s->normal);
            pay(c, s, parting, impulses_rub(c, s, grown));
        }
    }
}

/* ---- what is near ---- */

/* the same features as give forces by the law: edges where their points lie inside, corners once */
static bool repels(const Contact *c, const Pair *pair, const Strike *s) {
    return pair->distance < pair->dhat && !all_held(c, s) &&
           (pair->kind == PAIR_FACE || pair->feature == 3);
}

static double overlap_of(const Contact *c, const Touch *touch) {
    return c->def->vertex_distance[touch->place[0]] - touch->distance;
}

static bool touch_repels(const Contact *c, const Touch *touch, const Strike *s) {
    bool corner = touch->feature == 1 || touch->feature == 2 || touch->feature == 4;
    return overlap_of(c, touch) > 0.0 && !all_held(c, s) && (touch->place[1] < 0 || !corner);
}

void impulses_find(Contact *c, double dt) {
    if (c->pairs_wanted) {
        self_find(c, dt);
    }
    if (c->def->obstacle_count > 0) {
        obstacle_find(c, dt);
    }
    for (int k = 0; k < c->due_count; k++) {
        const Pair *pair = &c->lists.pairs[c->due_pairs[k].pair];
        Strike s = strike_of_pair(c, pair);
        if (repels(c, pair, &s)) {
            note_before(c, &s);
        }
    }
    for (int k = 0; k < c->due_touch_count; k++) {
        const Touch *touch = &c->touches[c->due_touches[k]];
        Strike s = strike_of_touch(c, touch);
        if (touch_repels(c, touch, &s)) {
            note_before(c, &s);
        }
    }
}

void impulses_repel(Contact *c, double dt) {
    for (int k = 0; k < c->due_count; k++) {
        const Pair *pair = &c->lists.pairs[c->due_pairs[k].pair];
        Strike s = strike_of_pair(c, pair);
        if (repels(c, pair, &s)) {
            double mass = min2(surface_panel(&c->surface, s.place[0])->mass,
                               surface_panel(&c->surface, s.place[3])->mass);
            repel(c, &s, pair->dhat - pair->distance, mass, dt);
        }
    }
    for (int k = 0; k < c->due_touch_count; k++) {
        const Touch *touch = &c->touches[c->due_touches[k]];
        Strike s = strike_of_touch(c, touch);
        if (touch_repels(c, touch, &s)) {
            repel(c, &s, overlap_of(c, touch), surface_panel(&c->surface, s.place[0])->mass, dt);
        }
    }
}

/* ---- collisions ---- */

/* [m] to keep in a step from the distance of its start */
static double core_of(double contact_distance, double distance) {
    return min2(COLLISION_CORE * contact_distance, CONTACT_INSIDE_CORE * distance);
}

/* one zone moves as a rigid body; only what a programme moves may be off a little */
static bool in_one_zone(Contact *c, const Strike *s) {
    ImpactZones *zones = &c->impulses->zones;
    int root = impact_zones_root(zones, s->place[0]);
    bool same = root >= 0;
    for (int a = 1; a < s->count && same; a++) {
        same = impact_zones_root(zones, s->place[a]) == root;
    }
    return same;
}

static bool any_held(const Contact *c, const Strike *s) {
    bool held = false;
    for (int a = 0; a < s->count; a++) {
        held = held || c->held[s->place[a]];
    }
    return held;
}

/* has it collided, or moved otherwise, since it was found free? */
static bool is_stale(const Contact *c, const int *place, int count) {
    const Impulses *i = c->impulses;
    bool stale = i->round == 1 || i->searched;
    for (int a = 0; a < count && !stale; a++) {
        stale = i->changed[place[a]] >= i->round - 1;
    }
    return stale;
}

static void motion_of(const Contact *c, int count, const int *place, double dt, Vec3 *x, Vec3 *p) {
    Points points = contact_positions(c);
    for (int a = 0; a < count; a++) {
        x[a] = point_at(&points, place[a]);
        p[a] = vec3_scale(dt, contact_velocity(c, place[a]));
    }
}

/* the strike where the pair would meet in this step */
static bool pair_collides(Contact *c, const Pair *pair, double dt, Strike *s) {
    Vec3 x[4], p[4], normal = pair->normal;
    motion_of(c, 4, pair->place, dt, x, p);
    double t = ccd_pair(pair->kind, x, p, core_of(pair->dhat, pair->distance), &normal);
    if (t >= 1.0) {
        return false;
    }
    for (int a = 0; a < 4; a++) {
        x[a] = vec3_axpy(x[a], t, p[a]);
    }
    Points points = {&x[0].x};
    Pair then = *pair;
    for (int a = 0; a < 4; a++) {
        then.place[a] = a;
    }
    pair_evaluate(&points, &then);
    *s = strike_of_pair(c, pair);
    memcpy(s->weight, then.weight, sizeof s->weight);
    s->normal = then.normal;
    return true;
}

/* ccd_solid for one point: the solid lies behind the tangent plane of its nearest point */
static double ccd_point(const Solid *solid, Vec3 x, Vec3 p, double target, Vec3 *normal) {
    double t = 0.0;
    for (int round = 0; round < CONTACT_CCD_ROUNDS; round++) {
        double distance = solid_distance(solid, vec3_axpy(x, t, p), normal);
        double closing = -vec3_dot(*normal, p);
        double advance = closing > 0.0 ? (distance - target) / closing : INFINITY;
        if (t + advance >= 1.0) {
            return 1.0;
        }
        if (advance < CONTACT_CCD_ADVANCE || (t > 0.0 && distance <= CONTACT_CCD_NEAR * target)) {
            return t;
        }
        t += advance;
    }
    return t;
}

static bool touch_collides(Contact *c, const Touch *touch, double dt, Strike *s) {
    const Solid *solid = &c->def->obstacles[touch->obstacle].solid;
    Pose pose = c->poses[touch->obstacle];
    Quat back = quat_inverse(pose.turn);
    Vec3 x[3], p[3], up = {0, 0, 0};
    double lowest = INFINITY;
    *s = strike_of_touch(c, touch);
    motion_of(c, s->count, s->place, dt, x, p);
    for (int a = 0; a < s->count; a++) {
        x[a] = pose_unapply(pose, x[a]);
        p[a] = quat_rotate(back, p[a]);
        lowest = min2(lowest, solid_distance(solid, x[a], &up));
    }
    double target = core_of(c->def->vertex_distance[s->place[0]],
                            touch->spare ? lowest : min2(lowest, touch->distance));
    double t = s->count == 1 ? ccd_point(solid, x[0], p[0], target, &up)
                             : ccd_solid(solid, x, p, target, &up);
    if (t >= 1.0) {
        return false;
    }
    if (s->count == 3) {
        int feature;
        for (int a = 0; a < 3; a++) {
            x[a] = vec3_axpy(x[a], t, p[a]);
        }
        ccd_solid_distance(solid, x, &up, s->weight, &feature);
    }
    s->normal = quat_rotate(pose.turn, up);
    return true;
}

/* what a round does with a pair that collides */
typedef void Answer(Contact *c, const Strike *s, bool at_solid);

/* an answer may change nothing, where a feature turns into another: then it collides again */
static void collide(Contact *c, const Strike *s, bool at_solid, Answer *answer) {
    c->impulses->colliding++;
    note_change(c, s);
    answer(c, s, at_solid);
}

static void look_at_pair(Contact *c, const DuePair *due, double dt, Answer *answer) {
    const Pair *pair = &c->lists.pairs[due->pair];
    double motion = c->lists.group_pairs[due->owner].speed * dt;
    double room = pair->distance - core_of(pair->dhat, pair->distance);
    Strike s = {.count = 4};
    if (room > motion || !is_stale(c, pair->place, 4)) {
        return;
    }
    memcpy(s.place, pair->place, sizeof s.place);
    bool same = in_one_zone(c, &s);
    if (!all_held(c, &s) && !(same && !any_held(c, &s)) && pair_collides(c, pair, dt, &s)) {
        c->impulses->stuck = c->impulses->stuck || same;
        collide(c, &s, false, answer);
    }
}

/* a touch over a flat face was left out for as long as it stays there */
static void look_at_touch(Contact *c, int t, double dt, Answer *answer) {
    const Touch *touch = &c->touches[t];
    const GroupTouch *group = &c->group_touches[touch->owner];
    Strike s = {.count = touch->place[1] < 0 ? 1 : 3};
    memcpy(s.place, touch->place, sizeof touch->place);
    if (c->touch_due[t] - group->path < group->speed * dt && is_stale(c, s.place, s.count) &&
        !all_held(c, &s) && touch_collides(c, touch, dt, &s)) {
        collide(c, &s, true, answer);
    }
}

/* the groups of the changed vertices move otherwise now: are the lists still wide enough? */
static void follow(Contact *c, double dt) {
    contact_move_changed_groups(c);
    bool again = c->pairs_wanted && self_check(c, dt);
    again = (c->def->obstacle_count > 0 && obstacle_check(c, dt)) || again;
    c->impulses->searched = again;
}

/* One look at all that may collide. Returns how many did. */
static int look(Contact *c, double dt, Answer *answer) {
    Impulses *i = c->impulses;
    i->round++;
    i->colliding = 0;
    for (int k = 0; k < c->due_count; k++) {
        look_at_pair(c, &c->due_pairs[k], dt, answer);
    }
    for (int k = 0; k < contact_cloth_groups(c) * c->def->obstacle_count; k++) {
        const GroupTouch *group = &c->group_touches[k];
        for (int t = group->begin; t < group->begin + group->count; t++) {
            look_at_touch(c, t, dt, answer);
        }
    }
    return i->colliding;
}

static void stop(Contact *c, const Strike *s, bool at_solid) {
    (void)at_solid;
    impulses_rub(c, s, impulses_stop(c, s, 0.0));
}

/* ---- impact zones ---- */

static void join(Contact *c, const Strike *s, bool at_solid) {
    impact_zones_join(&c->impulses->zones, s->count, s->place, at_solid);
}

static bool settle_zone(Contact *c, int root) {
    Impulses *i = c->impulses;
    int count = 0, place = root;
    do {
        bool held = contact_mobility(c, place) == 0.0;
        i->mass[count] = held ? INFINITY : 1.0 / c->weight_kept[place];
        i->place[count] = vec3_load(c->x + 3 * (long)place);
        i->move[count++] = contact_velocity(c, place);
        place = i->zones.next[place];
    } while (place != root);
    if (!impact_zone_settle(count, i->mass, i->place, i->zones.still[root], i->move)) {
        return false;
    }
    for (int k = 0; k < count; k++, place = i->zones.next[place]) {
        Vec3 v = contact_velocity(c, place);
        if (memcmp(&v, &i->move[k], sizeof v) != 0) {
            Strike s = {.count = 1, .place = {place}};
            note_before(c, &s);
            note_change(c, &s);
            contact_mark_changed(c, place);
            vec3_store(c->v + 3 * (long)place, i->move[k]);
        }
    }
    return true;
}

static bool settle_all(Contact *c) {
    ImpactZones *zones = &c->impulses->zones;
    bool settled = true;
    for (int k = 0; k < zones->member_count && settled; k++) {
        bool root = zones->parent[zones->members[k]] == zones->members[k];
        settled = !root || settle_zone(c, zones->members[k]);
    }
    double most = max2(LEAST_ZONE_ROOM, MOST_ZONE_SHARE * c->def->vertex_count);
    return settled && zones->member_count <= most;
}

/* until nothing collides: every round joins places or zones, of which there are so many */
static bool glue(Contact *c, double dt) {
    ImpactZones *zones = &c->impulses->zones;
    bool settled = true;
    impact_zones_clear(zones);
    for (int left = 1; left > 0 && settled;) {
        left = look(c, dt, join);
        settled = left == 0 || (!c->impulses->stuck && settle_all(c));
        if (left > 0 && settled) {
            follow(c, dt);
        }
    }
    c->statistics.zones += impact_zones_count(zones);
    c->statistics.zone_vertices += zones->member_count;
    return settled;
}

void impulses_guard(Contact *c, double dt) {
    Impulses *i = c->impulses;
    int left = 1;
    memset(i->changed, 0, (size_t)c->places.count * sizeof *i->changed);
    impact_zones_clear(&i->zones);
    i->round = 0;
    i->stuck = false;
    for (int round = 0; round < COLLISION_ROUNDS && left > 0; round++) {
        left = look(c, dt, stop);
        if (left > 0) {
            c->statistics.rounds++;
            follow(c, dt);
        }
    }
    if (left > 0 && !glue(c, dt)) {
        c->statistics.rejected = true;
    }
}
