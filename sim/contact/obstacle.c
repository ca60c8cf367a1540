/* obstacle.c: contact of cloth with convex solids on the explicit road (contact.md). */
#include <math.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/contact/force.h"

#define MOST_OF_TRIANGLE 4 /* its face and its sides push */

/* those of a vertex are not looked up: they lie in a cache line of their own */
static const double *touch_weights(const Touch *touch) {
    static const double whole[1] = {1.0};
    return touch->place[1] < 0 ? whole : touch->weight;
}

/* ---- forces ---- */

static double touch_distance(const Contact *c, const Touch *touch) {
    return c->def->vertex_distance[touch->place[0]];
}

static double touch_mass(const Contact *c, const Touch *touch) {
    return touch->place[1] < 0 ? c->def->mass[touch->place[0]]
                               : surface_panel(&c->surface, touch->place[0])->mass;
}

static Vec3 touch_velocity(const Contact *c, const Touch *touch) {
    if (touch->place[1] < 0) {
        return contact_velocity(c, touch->place[0]);
    }
    return contact_point_velocity(c, 3, touch->place, touch->weight);
}

static double obstacle_friction(const Contact *c, int obstacle, int place) {
    double own = c->def->obstacles[obstacle].friction;
    return own >= 0.0 ? own : c->def->friction[place];
}

double touch_friction(const Contact *c, const Touch *touch) {
    return obstacle_friction(c, touch->obstacle, touch->place[0]);
}

/* of the stiffness */
static double touch_share(const Contact *c, const Touch *touch) {
    return c->at_solids.share * (touch->place[1] < 0 ? 1.0 : touch->share);
}

static ContactForce force_of(const Contact *c, Touch *touch, double dt, double share) {
    Vec3 carried = contact_carried(c, touch->obstacle, touch->point, dt);
    Vec3 v = vec3_sub(touch_velocity(c, touch), carried);
    bool vertex = touch->place[1] < 0;
    double *memory = contact_vertex_bristle(c, touch->place[0], touch->obstacle);
    Vec3 bristle = vertex ? vec3_load(memory) : touch->bristle;
    ContactForce force = contact_solid_force(
        touch_share(c, touch), touch->distance, touch_distance(c, touch), touch_mass(c, touch),
        touch_friction(c, touch), touch->normal, v, dt, share, &bristle);
    if (vertex) {
        vec3_store(memory, bristle);
    } else {
        touch->bristle = bristle;
    }
    force.carried = carried;
    return force;
}

static bool all_held(const Contact *c, const Touch *touch) {
    bool held = true;
    for (int k = 0; k < touch_corners(touch); k++) {
        held = held && c->held[touch->place[k]];
    }
    return held;
}

bool obstacle_pushes(const Contact *c, const Touch *touch) {
    bool inside = touch->place[1] < 0 || touch->feature == 7;
    return inside && touch->distance < touch_distance(c, touch) && !all_held(c, touch);
}

/* ---- sides ---- */

/* edges are in the order of their first places, of which those of cloth come before those of meshes */
static int cloth_edges(const Contact *c) {
    int count = 0;
    while (count < c->surface.edge_count &&
           c->surface.edges[2 * (size_t)count] < c->def->vertex_count) {
        count++;
    }
    return count;
}

void obstacle_create_sides(Contact *c, Arena *arena) {
    bool solids = false;
    for (int k = 0; k < c->def->obstacle_count; k++) {
        solids = solids || !c->def->obstacles[k].mesh;
    }
    c->touches.side_count = solids ? cloth_edges(c) * c->def->obstacle_count : 0;
    c->touches.sides = arena_push(arena, SideTouch, c->touches.side_count);
    c->bristles.sides = arena_push(arena, Vec3, c->touches.side_count);
}

void obstacle_begin_sides(Contact *c, bool remembered) {
    if (c->bristles.sides_rub) {
        memset(c->bristles.sides, 0, (size_t)c->touches.side_count * sizeof *c->bristles.sides);
    }
    c->bristles.sides_rub = remembered;
}

static ContactForce side_force(const Contact *c, int side, double dt, double share) {
    const SideTouch *s = &c->touches.sides[side];
    const int *place = contact_side_places(c, side);
    int obstacle = side % c->def->obstacle_count;
    double mass = surface_panel(&c->surface, place[0])->mass;
    double mu = obstacle_friction(c, obstacle, place[0]);
    Vec3 carried = contact_carried(c, obstacle, s->point, dt);
    Vec3 v = contact_point_velocity(c, 2, place, (double[]){1.0 - s->at, s->at});
    ContactForce force = contact_solid_force(
        s->share * c->at_solids.share, s->distance, c->def->vertex_distance[place[0]], mass, mu,
        s->normal, vec3_sub(v, carried), dt, share, &c->bristles.sides[side]);
    force.carried = carried;
    return force;
}

/* those that push; others let go */
static void choose_sides(Contact *c, Touch *touch) {
    for (int k = 0; k < 3; k++) {
        if (!(touch->sides & 1U << k)) {
            continue;
        }
        int side = contact_side(c, touch, k);
        const int *place = contact_side_places(c, side);
        if (c->held[place[0]] && c->held[place[1]]) {
            obstacle_forget_sides(c, touch, 1U << k);
            continue;
        }
        c->forces.pushing[c->forces.pushing_count++] = -1 - side;
        c->bristles.sides_rub = true;
    }
}

/* What pushes: vertices and faces by their touches, sides by -1 - their number. */
static void choose_pushing(Contact *c) {
    contact_make_force_room(c, MOST_OF_TRIANGLE * c->look.touch_count);
    for (int k = 0; k < c->look.group_count; k++) {
        const GroupTouch *group = &c->touches.groups[c->look.groups[k]];
        for (int m = group->begin; m < group->begin + group->pushing; m++) {
            int t = c->touches.looked[m] < 0 ? -1 - c->touches.looked[m] : c->touches.looked[m];
            bool sides = c->touches.looked[m] < 0;
            if (!sides || obstacle_pushes(c, &c->touches.list[t])) {
                c->forces.pushing[c->forces.pushing_count++] = t;
            }
            if (sides) {
                choose_sides(c, &c->touches.list[t]);
            }
        }
    }
}

/* The vertices that something pushes. */
typedef struct Pushed {
    int count;
    const int *place;
    double weight[3];
} Pushed;

static Pushed pushed_by(const Contact *c, int item) {
    if (item < 0) {
        double at = c->touches.sides[-1 - item].at;
        return (Pushed){2, contact_side_places(c, -1 - item), {1.0 - at, at}};
    }
    const Touch *touch = &c->touches.list[item];
    const double *w = touch->weight;
    return touch->place[1] < 0 ? (Pushed){1, touch->place, {1.0}}
                               : (Pushed){3, touch->place, {w[0], w[1], w[2]}};
}

static ContactForce force_by(const Contact *c, int item, double dt, double share) {
    return item < 0 ? side_force(c, -1 - item, dt, share)
                    : force_of(c, &c->touches.list[item], dt, share);
}

/* Forces of c->forces.pushing, in parts whose number depends on nothing but theirs. Cloth is numbered as its groups
 * are, so that most of them push vertices of their own part alone. */
typedef struct PushJob {
    Contact *c;
    double dt, share;
    int split[CONTACT_PARTS + 1]; /* first vertex of each part */
    int left[CONTACT_PARTS];      /* forces that push vertices of several */
    ContactWork work[CONTACT_PARTS];
} PushJob;

static bool is_within(const Pushed *pushed, int first, int end) {
    bool within = true;
    for (int k = 0; k < pushed->count; k++) {
        within = within && pushed->place[k] >= first && pushed->place[k] < end;
    }
    return within;
}

static void apply(Contact *c, const Pushed *pushed, const ContactForce *force, ContactWork *work) {
    contact_apply(c, force, pushed->count, pushed->place, pushed->weight, work);
}

/* the numbers of those that are left go to c->forces.left, from the first of the part on */
static void push_part(int part, int first, int end, void *context) {
    PushJob *job = context;
    Contact *c = job->c;
    int left = 0;
    for (int k = first; k < end; k++) {
        ContactForce force = force_by(c, c->forces.pushing[k], job->dt, job->share);
        Pushed pushed = pushed_by(c, c->forces.pushing[k]);
        if (is_within(&pushed, job->split[part], job->split[part + 1])) {
            apply(c, &pushed, &force, &job->work[part]);
        } else {
            c->forces.found[k] = force;
            c->forces.left[first + left++] = k;
        }
    }
    job->left[part] = left;
}

/* where each part begins; returns how many forces a part has */
static int split_vertices(PushJob *job) {
    const Contact *c = job->c;
    int share = (c->forces.pushing_count + CONTACT_PARTS - 1) / CONTACT_PARTS;
    int grain = share > CONTACT_LEAST_PART ? share : CONTACT_LEAST_PART;
    int parts = parallel_chunk_count(c->forces.pushing_count, grain);
    job->split[0] = 0;
    for (int p = 1; p < parts; p++) {
        int place = pushed_by(c, c->forces.pushing[p * grain]).place[0];
        job->split[p] = place > job->split[p - 1] ? place : job->split[p - 1];
    }
    job->split[parts] = c->def->vertex_count;
    return grain;
}

static void push_all(Contact *c, double dt, double share) {
    PushJob job = {.c = c, .dt = dt, .share = share};
    int grain = split_vertices(&job);
    parallel_for(c->forces.pushing_count, grain, push_part, &job);
    for (int p = 0; p < parallel_chunk_count(c->forces.pushing_count, grain); p++) {
        for (int m = p * grain; m < p * grain + job.left[p]; m++) {
            int k = c->forces.left[m];
            Pushed pushed = pushed_by(c, c->forces.pushing[k]);
            apply(c, &pushed, &c->forces.found[k], &job.work[p]);
        }
        contact_note_work(c, &job.work[p]);
    }
    c->some_touched = c->some_touched || c->forces.pushing_count > 0;
}

void obstacle_forces(Contact *c, double dt, double share) {
    obstacle_find(c, dt);
    choose_pushing(c);
    push_all(c, dt, share);
    resting_forces(c, dt, share);
}

/* ---- guard ---- */

void obstacle_refresh(Contact *c, double dt) {
    if (c->groups.outgrown && obstacle_search(c, dt)) {
        obstacle_look(c);
    }
}

static void touch_impulse(Contact *c, const Touch *touch, double dt) {
    double floor = CONTACT_IMPULSE_GAP * touch_distance(c, touch);
    double motion = CONTACT_IMPULSE_RESERVE * dt * c->touches.groups[touch->owner].speed;
    if (touch->distance - floor >= motion) {
        return;
    }
    Vec3 carried = contact_carried(c, touch->obstacle, touch->point, dt);
    double vn = vec3_dot(vec3_sub(touch_velocity(c, touch), carried), touch->normal);
    double least = touch->distance > floor ? (floor - touch->distance) / dt : 0.0;
    contact_impulse(c, touch_corners(touch), touch->place, touch_weights(touch), touch->normal,
                    carried, vn, least);
}

/* the corners stay on their side of the plane, less what is reserved for the obstacle */
static void touch_shorten(Contact *c, const Points *x, const Touch *touch, double dt) {
    double reserve = max2(0.0, min2(obstacle_reach(c, touch), 0.5 * touch->distance));
    double floor = reserve + CONTACT_PLANE_FLOOR * touch_distance(c, touch);
    double motion = dt * c->groups.motion[touch->owner / c->def->obstacle_count].fastest;
    if (motion <= CONTACT_PLANE_SHARE * (touch->distance - floor)) {
        return; /* no corner is nearer to the plane */
    }
    for (int a = 0; a < touch_corners(touch); a++) {
        Vec3 over = vec3_sub(point_at(x, touch->place[a]), touch->point);
        double height = vec3_dot(touch->normal, over);
        contact_hold_back(c, touch->place[a], touch->normal, height - floor, dt);
    }
}

/* Is a touch of a group so near that motions of `motion` [m] concern the guard? Then those that are near
 * are known one by one. */
static bool concerns_guard(Contact *c, int owner, double motion) {
    const GroupTouch *group = &c->touches.groups[owner];
    bool rests = resting_holds(&c->resting, owner);
    if (group->near_count == 0 && !rests) {
        return false;
    }
    double room = group->gap - CONTACT_IMPULSE_GAP * group->dhat;
    if (!c->def->obstacles[owner % c->def->obstacle_count].moves && room >= motion) {
        return false;
    }
    if (rests) {
        resting_wake(c, owner);
    }
    return true;
}

void obstacle_impulses(Contact *c, double dt) {
    if (!c->groups.narrow) {
        return;
    }
    double before = c->statistics.impulses;
    for (int k = 0; k < c->look.group_count; k++) {
        const GroupTouch *group = &c->touches.groups[c->look.groups[k]];
        double motion = CONTACT_IMPULSE_RESERVE * dt * group->speed;
        bool concerns = concerns_guard(c, c->look.groups[k], motion);
        for (int m = 0; m < group->near_count && concerns; m++) {
            touch_impulse(c, &c->touches.list[c->touches.near[group->begin + m]], dt);
        }
    }
    c->at_solids.impulses += c->statistics.impulses - before;
}

void obstacle_shorten(Contact *c, double dt) {
    if (!c->groups.narrow) {
        return;
    }
    Points x = contact_positions(c);
    for (int k = 0; k < c->look.group_count; k++) {
        const GroupTouch *group = &c->touches.groups[c->look.groups[k]];
        double motion = dt * c->groups.motion[c->look.groups[k] / c->def->obstacle_count].fastest;
        bool concerns = concerns_guard(c, c->look.groups[k], motion / CONTACT_PLANE_SHARE);
        for (int m = 0; m < group->near_count && concerns; m++) {
            touch_shorten(c, &x, &c->touches.list[c->touches.near[group->begin + m]], dt);
        }
    }
}

bool obstacle_check(Contact *c, double dt) {
    if (c->groups.outgrown && obstacle_search(c, dt)) {
        obstacle_look(c);
    }
    return c->groups.outgrown;
}

/* [J] of a vertex or a face */
static double touch_energy(const Contact *c, const Touch *touch, double dt) {
    double force, curvature, k = touch_share(c, touch) * touch_mass(c, touch) / (dt * dt);
    return contact_law(touch->distance, touch_distance(c, touch), k, &force, &curvature);
}

/* [J] of the sides of a triangle */
static double sides_energy(const Contact *c, const Touch *touch, double dt) {
    double k = c->at_solids.share * touch_mass(c, touch) / (dt * dt);
    double energy = 0.0, force, curvature;
    for (int m = 0; m < 3; m++) {
        if (touch->sides & 1U << m) {
            const SideTouch *s = &c->touches.sides[contact_side(c, touch, m)];
            energy += contact_law(s->distance, touch_distance(c, touch), s->share * k, &force,
                                  &curvature);
        }
    }
    return energy;
}

/* [J] of a touch that is due */
static double energy_of(const Contact *c, const Touch *touch, double dt) {
    bool vertex = touch->place[1] < 0;
    double energy = obstacle_pushes(c, touch) ? touch_energy(c, touch, dt) : 0.0;
    return vertex ? energy : energy + sides_energy(c, touch, dt);
}

double obstacle_energy(Contact *c, double dt) {
    double energy = 0.0;
    for (int i = 0; i < contact_owners(c); i++) {
        if (resting_holds(&c->resting, i)) {
            resting_wake(c, i);
        }
        const GroupTouch *group = &c->touches.groups[i];
        for (int t = group->begin; t < group->begin + group->count; t++) {
            energy +=
                group->path >= c->touches.due[t] ? energy_of(c, &c->touches.list[t], dt) : 0.0;
        }
    }
    return energy;
}
