#include "sim/contact/impulses.h"

#include <math.h>
#include <string.h>

#include "sim/contact/force.h"

#define REPULSION_PART 0.1      /* of d/dt: the fastest parting that a repulsion makes */
#define REPULSION_STIFFNESS 0.6 /* k = share m / reference_step^2: about that of the threads */

Impulses *impulses_create(const Contact *c, Arena *arena) {
    int n = c->places.count;
    Impulses *i = arena_push(arena, Impulses, 1);
    i->zones = impact_zones_create(n, arena);
    i->changed = arena_push(arena, int, n);
    i->mass = arena_push(arena, double, n);
    i->place = arena_push(arena, Vec3, n);
    i->move = arena_push(arena, Vec3, n);
    i->lead = arena_push(arena, Vec3, n);
    i->given = (double(*)[2])arena_push(arena, double, 2 * c->def->obstacle_count);
    i->strikes = arena_push(arena, unsigned char, c->def->obstacle_count);
    return i;
}

/* ---- what strikes ---- */

Strike impulses_pair(const Contact *c, const Pair *pair) {
    Strike s = {.count = 4,
                .normal = pair->normal,
                .carried = pair_carried(c, pair),
                .friction = pair_friction(c, pair),
                .obstacle = pair_obstacle(c, pair)};
    memcpy(s.place, pair->place, sizeof s.place);
    memcpy(s.weight, pair->weight, sizeof s.weight);
    return s;
}

Strike impulses_touch(const Contact *c, const Touch *touch, double dt) {
    Strike s = {.count = touch->place[1] < 0 ? 1 : 3,
                .normal = touch->normal,
                .carried = contact_carried(c, touch->obstacle, touch->point, dt),
                .friction = touch_friction(c, touch),
                .obstacle = touch->obstacle};
    memcpy(s.place, touch->place, sizeof touch->place);
    memcpy(s.weight, touch->weight, sizeof touch->weight);
    return s;
}

bool impulses_all_held(const Contact *c, const Strike *s) {
    bool held = true;
    for (int a = 0; a < s->count; a++) {
        held = held && c->held[s->place[a]];
    }
    return held;
}

/* the velocity from here on counts as that before the step's impulses (losses.c) */
void impulses_note_before(Contact *c, const Strike *s) {
    for (int a = 0; a < s->count; a++) {
        int place = s->place[a];
        if (place < c->def->vertex_count && !c->is_touched[place]) {
            c->is_touched[place] = TOUCHED;
            c->some_touched = true;
            c->tolls[place] = (Toll){.before = contact_velocity(c, place)};
        }
    }
}

void impulses_note_change(Contact *c, const Strike *s) {
    for (int a = 0; a < s->count; a++) {
        c->impulses->changed[s->place[a]] = c->impulses->round;
    }
}

/* ---- impulses ---- */

/* [J] What no impulse moves, a solid or what handles hold, does by one on the first side. */
static double work_of(const Contact *c, const Strike *s, Vec3 impulse) {
    double work = vec3_dot(impulse, s->carried);
    for (int a = 0; a < s->count; a++) {
        if (s->place[a] < c->def->vertex_count && c->held[s->place[a]]) {
            work -= s->weight[a] * vec3_dot(impulse, contact_velocity(c, s->place[a]));
        }
    }
    return work;
}

/* of the first side against the second; that of a solid has no places */
static Vec3 velocity_of(const Contact *c, const Strike *s) {
    Vec3 v = contact_point_velocity(c, s->count, s->place, s->weight);
    return s->count == 4 ? v : vec3_sub(v, s->carried);
}

static double mobility_of(const Contact *c, const Strike *s) {
    double mobility = 0.0;
    for (int a = 0; a < s->count; a++) {
        mobility += s->weight[a] * s->weight[a] * contact_mobility(c, s->place[a]);
    }
    return mobility;
}

double impulses_stop(Contact *c, const Strike *s, double wanted) {
    double apart = vec3_dot(velocity_of(c, s), s->normal);
    if (apart >= wanted || mobility_of(c, s) <= 0.0) {
        return 0.0;
    }
    impulses_note_before(c, s);
    impulses_note_change(c, s);
    bool done =
        contact_impulse(c, s->count, s->place, s->weight, s->normal, s->carried, apart, wanted);
    return done ? wanted - apart : 0.0;
}

Vec3 impulses_rub(Contact *c, const Strike *s, double grown) {
    Vec3 v = velocity_of(c, s);
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
    double work = work_of(c, s, impulse);
    c->statistics.work += work;
    c->statistics.guard += work; /* is no loss */
    return impulse;
}

/* The work of a repulsion is known at the end of the step: it is not in the guard's book, but in those of
 * damping and friction. */
static void pay(Contact *c, const Strike *s, Vec3 parting, Vec3 friction) {
    ContactStatistics *book = &c->statistics;
    double given[2] = {vec3_dot(parting, s->carried), vec3_dot(friction, s->carried)};
    book->damping += given[0];
    book->friction += given[1];
    book->guard -= work_of(c, s, vec3_add(parting, friction));
    if (s->obstacle >= 0) {
        c->impulses->given[s->obstacle][0] += given[0];
        c->impulses->given[s->obstacle][1] += given[1];
    }
    for (int a = 0; a < s->count; a++) {
        if (s->place[a] < c->def->vertex_count) {
            Toll *toll = &c->tolls[s->place[a]];
            toll->damping = vec3_axpy(toll->damping, s->weight[a], parting);
            toll->friction = vec3_axpy(toll->friction, s->weight[a], friction);
        }
    }
}

static void repel(Contact *c, const Strike *s, double overlap, double mass, double dt) {
    double apart = vec3_dot(velocity_of(c, s), s->normal);
    double most = REPULSION_PART * overlap / dt;
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
    return pair->distance < pair->dhat && !impulses_all_held(c, s) &&
           (pair->kind == PAIR_FACE || pair->feature == 3);
}

static double overlap_of(const Contact *c, const Touch *touch) {
    return c->def->vertex_distance[touch->place[0]] - touch->distance;
}

static bool touch_repels(const Contact *c, const Touch *touch, const Strike *s) {
    bool corner = touch->feature == 1 || touch->feature == 2 || touch->feature == 4;
    return overlap_of(c, touch) > 0.0 && !impulses_all_held(c, s) &&
           (touch->place[1] < 0 || !corner);
}

void impulses_find(Contact *c, double dt) {
    if (c->pairs_wanted) {
        self_find(c, dt);
    }
    if (c->def->obstacle_count > 0) {
        obstacle_find(c, dt);
    }
    for (int k = 0; k < c->due.count; k++) {
        const Pair *pair = &c->lists.pairs[c->due.pairs[k].pair];
        Strike s = impulses_pair(c, pair);
        if (repels(c, pair, &s)) {
            impulses_note_before(c, &s);
        }
    }
    for (int k = 0; k < c->look.touch_count; k++) {
        const Touch *touch = &c->touches.list[c->look.touches[k]];
        Strike s = impulses_touch(c, touch, dt);
        if (touch_repels(c, touch, &s)) {
            impulses_note_before(c, &s);
        }
    }
}

void impulses_repel(Contact *c, double dt) {
    memset(c->impulses->given, 0, (size_t)c->def->obstacle_count * sizeof *c->impulses->given);
    for (int k = 0; k < c->due.count; k++) {
        const Pair *pair = &c->lists.pairs[c->due.pairs[k].pair];
        Strike s = impulses_pair(c, pair);
        if (repels(c, pair, &s)) {
            double mass = min2(surface_panel(&c->surface, s.place[0])->mass,
                               surface_panel(&c->surface, s.place[3])->mass);
            repel(c, &s, pair->dhat - pair->distance, mass, dt);
        }
    }
    for (int k = 0; k < c->look.touch_count; k++) {
        const Touch *touch = &c->touches.list[c->look.touches[k]];
        Strike s = impulses_touch(c, touch, dt);
        if (touch_repels(c, touch, &s)) {
            repel(c, &s, overlap_of(c, touch), surface_panel(&c->surface, s.place[0])->mass, dt);
        }
    }
}
