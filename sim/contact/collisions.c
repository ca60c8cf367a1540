/* collisions.c: the second and third part of contact by impulses: collisions in a step, impact zones,
 * obstacles that wait (impulses.h). */
#include <math.h>
#include <string.h>

#include "sim/contact/ccd.h"
#include "sim/contact/force.h"
#include "sim/contact/impulses.h"

#define COLLISION_CORE 0.05 /* of H: nearer than this in a step is a collision */
#define COLLISION_ROUNDS 5
#define PINCHED 0.5          /* of the core: nearer than this is pressed */
#define MOST_ZONE_SHARE 0.02 /* of the vertices: more glued ones are a step too long */
#define LEAST_ZONE_ROOM 16   /* vertices that zones may always have: two pairs and a bit */

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
    Pair then = pair_between(pair->kind, x);
    *s = impulses_pair(c, pair);
    memcpy(s->weight, then.weight, sizeof s->weight);
    s->normal = then.distance > 0.0 ? then.normal : pair->normal;
    return true;
}

/* corners and motions of a touch in the frame of its solid */
static void motion_at_solid(const Contact *c, const Strike *s, double dt, Vec3 *x, Vec3 *p) {
    Pose pose = c->poses[s->obstacle], next = c->programmes.next[s->obstacle];
    bool moves = c->def->obstacles[s->obstacle].moves;
    Quat back = quat_inverse(pose.turn);
    motion_of(c, s->count, s->place, dt, x, p);
    for (int a = 0; a < s->count; a++) {
        Vec3 end = vec3_add(x[a], p[a]);
        x[a] = pose_unapply(pose, x[a]);
        p[a] = moves ? vec3_sub(pose_unapply(next, end), x[a]) : quat_rotate(back, p[a]);
    }
}

static bool touch_collides(Contact *c, const Touch *touch, double dt, Strike *s) {
    const ContactObstacle *obstacle = &c->def->obstacles[touch->obstacle];
    const Solid *solid = &obstacle->solid;
    Vec3 x[3], p[3], up = {0, 0, 0}, meets = {0, 0, 0};
    double lowest = INFINITY;
    *s = impulses_touch(c, touch, dt);
    motion_at_solid(c, s, dt, x, p);
    for (int a = 0; a < s->count; a++) {
        lowest = min2(lowest, solid_distance(solid, x[a], &up));
    }
    double target = core_of(c->def->vertex_distance[s->place[0]],
                            touch->spare ? lowest : min2(lowest, touch->distance));
    double t = s->count == 1 ? ccd_solid_point(solid, x[0], p[0], target, &up)
                             : ccd_solid(solid, x, p, target, &up);
    if (t >= 1.0) {
        return false;
    }
    for (int a = 0; a < s->count; a++) {
        x[a] = vec3_axpy(x[a], t, p[a]);
    }
    if (s->count == 3) {
        int feature;
        ccd_solid_distance(solid, x, &up, s->weight, &feature);
    }
    for (int a = 0; a < s->count; a++) {
        meets = vec3_axpy(meets, s->weight[a], x[a]);
    }
    const Pose *end =
        obstacle->moves ? &c->programmes.next[touch->obstacle] : &c->poses[touch->obstacle];
    s->normal = quat_rotate(end->turn, up);
    s->carried =
        contact_carried(c, touch->obstacle, pose_apply(c->poses[touch->obstacle], meets), dt);
    return true;
}

/* what a round does with a pair that collides */
typedef void Answer(Contact *c, const Strike *s);

/* moves in this step */
static bool is_driven(const Contact *c, int obstacle) {
    return c->def->obstacles[obstacle].moves &&
           c->programmes.next_clocks[obstacle] != c->programmes.clocks[obstacle];
}

/* an answer may change nothing, where a feature turns into another: then it collides again */
static void collide(Contact *c, const Strike *s, Answer *answer) {
    c->impulses->colliding++;
    impulses_note_change(c, s);
    if (s->obstacle >= 0 && is_driven(c, s->obstacle)) {
        c->impulses->strikes[s->obstacle] = 1;
    }
    answer(c, s);
}

static void look_at_pair(Contact *c, const DuePair *due, double dt, Answer *answer) {
    const Pair *pair = &c->lists.pairs[due->pair];
    double motion = c->lists.paths.speed[due->owner] * dt;
    double room = pair->distance - core_of(pair->dhat, pair->distance);
    Strike s = {.count = 4};
    if (room > motion || !is_stale(c, pair->place, 4)) {
        return;
    }
    memcpy(s.place, pair->place, sizeof s.place);
    bool same = in_one_zone(c, &s);
    if (!impulses_all_held(c, &s) && !(same && !any_held(c, &s)) &&
        pair_collides(c, pair, dt, &s)) {
        c->impulses->stuck = c->impulses->stuck || same;
        collide(c, &s, answer);
    }
}

/* a touch over a flat face was left out for as long as it stays there */
static void look_at_touch(Contact *c, int t, double dt, Answer *answer) {
    const Touch *touch = &c->touches.list[t];
    const GroupTouch *group = &c->touches.groups[touch->owner];
    Strike s = {.count = touch->place[1] < 0 ? 1 : 3};
    memcpy(s.place, touch->place, sizeof touch->place);
    if (c->touches.due[t] - group->path < group->speed * dt && is_stale(c, s.place, s.count) &&
        !impulses_all_held(c, &s) && touch_collides(c, touch, dt, &s)) {
        collide(c, &s, answer);
    }
}

/* the groups of the changed vertices move otherwise now: are the lists still wide enough? */
static void follow(Contact *c, double dt) {
    contact_move_changed_groups(c, dt);
    bool again = c->pairs_wanted && self_check(c, dt);
    again = (c->def->obstacle_count > 0 && obstacle_check(c, dt)) || again;
    c->impulses->searched = again;
}

/* One look at all that may collide. Returns how many did. */
static int look(Contact *c, double dt, Answer *answer) {
    Impulses *i = c->impulses;
    i->round++;
    i->colliding = 0;
    for (int k = 0; k < c->due.count; k++) {
        look_at_pair(c, &c->due.pairs[k], dt, answer);
    }
    for (int k = 0; k < contact_owners(c); k++) {
        const GroupTouch *group = &c->touches.groups[k];
        for (int t = group->begin; t < group->begin + group->count; t++) {
            look_at_touch(c, t, dt, answer);
        }
    }
    return i->colliding;
}

static void stop(Contact *c, const Strike *s) { impulses_rub(c, s, impulses_stop(c, s, 0.0)); }

/* ---- impact zones ---- */

static void join(Contact *c, const Strike *s) {
    bool driven = s->obstacle >= 0 && is_driven(c, s->obstacle);
    int solid = s->count == 4 ? ZONE_FREE : driven ? s->obstacle : ZONE_STILL;
    impact_zones_join(&c->impulses->zones, s->count, s->place, solid);
}

/* a solid, or what a handle or a programme moves, changes the velocity of a vertex that goes with it: work, and
 * no loss */
static void work_on(Contact *c, int place, Vec3 change, Vec3 carried) {
    double work = vec3_dot(change, carried) / c->weight_kept[place];
    c->statistics.work += work;
    c->statistics.guard += work;
}

static bool settle_zone(Contact *c, int root, double dt) {
    Impulses *i = c->impulses;
    int count = 0, place = root, solid = i->zones.solid[root];
    bool any_held = false;
    do {
        bool held = contact_mobility(c, place) == 0.0;
        Vec3 x = vec3_load(c->x + 3 * (long)place);
        Vec3 lead = solid >= 0 ? contact_carried(c, solid, x, dt) : vec3(0, 0, 0);
        any_held = any_held || held;
        i->mass[count] = held ? INFINITY : 1.0 / c->weight_kept[place];
        i->place[count] = x;
        i->lead[count] = lead;
        i->move[count++] = contact_velocity(c, place);
        place = i->zones.next[place];
    } while (place != root);
    if (solid == ZONE_TORN || !impact_zone_settle(count, i->mass, i->place,
                                                  solid == ZONE_FREE ? NULL : i->lead, i->move)) {
        return false;
    }
    for (int k = 0; k < count; k++, place = i->zones.next[place]) {
        Vec3 v = contact_velocity(c, place);
        if (memcmp(&v, &i->move[k], sizeof v) != 0) {
            Strike s = {.count = 1, .place = {place}};
            impulses_note_before(c, &s);
            impulses_note_change(c, &s);
            contact_mark_changed(c, place);
            if (solid >= 0 || any_held) {
                Vec3 carried = solid >= 0 ? i->lead[k] : i->move[k];
                work_on(c, place, vec3_sub(i->move[k], v), carried);
            }
            vec3_store(c->v + 3 * (long)place, i->move[k]);
        }
    }
    return true;
}

static bool settle_all(Contact *c, double dt) {
    ImpactZones *zones = &c->impulses->zones;
    bool settled = true;
    for (int k = 0; k < zones->member_count && settled; k++) {
        bool root = zones->parent[zones->members[k]] == zones->members[k];
        settled = !root || settle_zone(c, zones->members[k], dt);
    }
    double most = max2(LEAST_ZONE_ROOM, MOST_ZONE_SHARE * c->def->vertex_count);
    int glued = 0; /* but for what is held between obstacles that wait */
    for (int k = 0; k < zones->member_count; k++) {
        int root = impact_zones_root(zones, zones->members[k]);
        glued += !c->impulses->waits || zones->solid[root] != ZONE_STILL;
    }
    return settled && glued <= most;
}

/* until nothing collides: every round joins places or zones, of which there are so many */
static bool glue(Contact *c, double dt) {
    ImpactZones *zones = &c->impulses->zones;
    bool settled = true;
    impact_zones_clear(zones);
    for (int left = 1; left > 0 && settled;) {
        left = look(c, dt, join);
        settled = left == 0 || (!c->impulses->stuck && settle_all(c, dt));
        if (left > 0 && settled) {
            follow(c, dt);
        }
    }
    c->statistics.zones += impact_zones_count(zones);
    c->statistics.zone_vertices += zones->member_count;
    return settled;
}

/* rounds of collisions, then zones; false: they take too much, or cannot be */
static bool part(Contact *c, double dt) {
    Impulses *i = c->impulses;
    int left = 1;
    memset(i->changed, 0, (size_t)c->places.count * sizeof *i->changed);
    memset(i->strikes, 0, (size_t)c->def->obstacle_count);
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
    return left == 0 || glue(c, dt);
}

/* ---- obstacles that wait ---- */

/* is `end` nearer than cloth in a step that leaves it free would come, and nearer than before? */
static bool too_near(double dhat, double distance, double end) {
    return end < distance && end < PINCHED * COLLISION_CORE * dhat;
}

static bool pair_ends_near(const Contact *c, const Pair *pair, double dt) {
    Vec3 x[4], p[4];
    motion_of(c, 4, pair->place, dt, x, p);
    for (int a = 0; a < 4; a++) {
        x[a] = vec3_add(x[a], p[a]);
    }
    return too_near(pair->dhat, pair->distance, pair_between(pair->kind, x).distance);
}

static bool touch_ends_near(const Contact *c, const Touch *touch, double dt) {
    const Solid *solid = &c->def->obstacles[touch->obstacle].solid;
    Strike s = impulses_touch(c, touch, dt);
    Vec3 x[3], p[3], up = {0, 0, 0};
    double weight[3];
    int feature;
    motion_at_solid(c, &s, dt, x, p);
    for (int a = 0; a < s.count; a++) {
        x[a] = vec3_add(x[a], p[a]);
    }
    double end = s.count == 1 ? solid_distance(solid, x[0], &up)
                              : ccd_solid_distance(solid, x, &up, weight, &feature);
    return too_near(c->def->vertex_distance[s.place[0]], touch->distance, end);
}

/* does an obstacle that struck cloth press it onto something? */
static bool pinches(const Contact *c, double dt) {
    bool struck = false, near = false;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        struck = struck || c->impulses->strikes[o];
    }
    for (int k = 0; k < c->due.count && struck && !near; k++) {
        near = pair_ends_near(c, &c->lists.pairs[c->due.pairs[k].pair], dt);
    }
    for (int k = 0; k < c->look.touch_count && struck && !near; k++) {
        near = touch_ends_near(c, &c->touches.list[c->look.touches[k]], dt);
    }
    return near;
}

/* The obstacles that struck cloth stand still in this step, and all velocities are again what they were
 * before it. False: there is none. */
static bool wait(Contact *c, double dt) {
    bool any = false;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        if (c->impulses->strikes[o]) {
            c->programmes.next[o] = c->poses[o];
            c->programmes.next_clocks[o] = c->programmes.clocks[o];
            if (c->def->obstacles[o].mesh) {
                mesh_demand(c, o, dt);
            }
            const double *given = c->impulses->given[o]; /* it did not move */
            c->statistics.work -= given[0] + given[1];
            c->statistics.damping -= given[0];
            c->statistics.friction -= given[1];
            any = true;
        }
    }
    for (int k = 0; k < c->changed_count && any; k++) {
        vec3_store(c->v + 3 * (long)c->changed[k], c->kicked[c->changed[k]]);
    }
    if (any) {
        follow(c, dt);
    }
    return any;
}

void impulses_guard(Contact *c, double dt) {
    ContactStatistics books = c->statistics;
    c->impulses->waits = false;
    bool parted = part(c, dt);
    while (!parted || pinches(c, dt)) {
        c->statistics.work = books.work;
        c->statistics.guard = books.guard;
        if (!wait(c, dt)) { /* each obstacle does once */
            break;
        }
        books = c->statistics;
        c->impulses->waits = true;
        parted = part(c, dt);
    }
    c->statistics.rejected = c->statistics.rejected || !parted;
}
