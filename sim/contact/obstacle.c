/* obstacle.c: contact of cloth with convex solids on the explicit road (explicit.md 3, 4, 10.1). */
#include <math.h>

#include "sim/base/parallel.h"
#include "sim/contact/force.h"

/* those of a vertex are not looked up: they lie in a cache line of their own */
static const double *touch_weights(const Touch *touch) {
    static const double whole[1] = {1.0};
    return touch->place[1] < 0 ? whole : touch->weight;
}

/* ---- forces ---- */

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
    if (touch->place[1] < 0) {
        return contact_velocity(c, touch->place[0]);
    }
    return contact_point_velocity(c, 3, touch->place, touch->weight);
}

double touch_friction(const Contact *c, const Touch *touch) {
    double own = c->def->obstacles[touch->obstacle].friction;
    return own >= 0.0 ? own : c->def->friction[touch->place[0]];
}

static ContactForce force_of(const Contact *c, Touch *touch, double dt, double share) {
    Vec3 carried = contact_carried(c, touch->obstacle, touch->point, dt);
    Vec3 v = vec3_sub(touch_velocity(c, touch), carried);
    bool vertex = touch->place[1] < 0;
    double *memory = contact_vertex_bristle(c, touch->place[0], touch->obstacle);
    Vec3 bristle = vertex ? vec3_load(memory) : touch->bristle;
    ContactForce force = contact_solid_force(
        c->at_solids.share, touch->distance, touch_distance(c, touch), touch_mass(c, touch),
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

TouchPush obstacle_push(const Contact *c, const Touch *touch) {
    bool vertex = touch->place[1] < 0;
    if (touch->distance >= touch_distance(c, touch) || all_held(c, touch) ||
        (!vertex && at_corner(touch))) {
        return TOUCH_LETS_GO;
    }
    return vertex || touch->feature == 7 ? TOUCH_PUSHES : TOUCH_SHARES_EDGE;
}

/* those that push, of which some stand for the same edge */
static void choose_pushing(Contact *c) {
    contact_make_force_room(c, c->due_touch_count);
    contact_clear_twins(c, c->due_touch_count);
    for (int k = 0; k < c->due_group_count; k++) {
        const GroupTouch *group = &c->group_touches[c->due_groups[k]];
        for (int m = group->begin; m < group->begin + group->pushing; m++) {
            bool edge = c->looked[m] < 0;
            int t = edge ? -1 - c->looked[m] : c->looked[m];
            int key[3] = {c->due_groups[k] % c->def->obstacle_count, c->edges[m].low,
                          c->edges[m].high};
            int twin = edge ? contact_find_twin(c, key, t) : -1;
            if (twin >= 0) {
                c->followers[c->follower_count++] = (Follower){t, twin};
            } else {
                c->pushing[c->pushing_count++] = t;
            }
        }
    }
}

/* Forces of c->pushing, in parts whose number depends on nothing but theirs. Cloth is numbered as its groups
 * are, so that most of them push vertices of their own part alone. */
typedef struct PushJob {
    Contact *c;
    double dt, share;
    int split[CONTACT_PARTS + 1]; /* first vertex of each part */
    int left[CONTACT_PARTS];      /* forces that push vertices of several */
    ContactWork work[CONTACT_PARTS];
} PushJob;

static bool is_within(const Touch *touch, int first, int end) {
    bool within = true;
    for (int k = 0; k < touch_corners(touch); k++) {
        within = within && touch->place[k] >= first && touch->place[k] < end;
    }
    return within;
}

static void apply(Contact *c, const Touch *touch, const ContactForce *force, ContactWork *work) {
    contact_apply(c, force, touch_corners(touch), touch->place, touch_weights(touch), work);
}

/* the numbers of those that are left go to c->left, from the first of the part on */
static void push_part(int part, int first, int end, void *context) {
    PushJob *job = context;
    Contact *c = job->c;
    int left = 0;
    for (int k = first; k < end; k++) {
        Touch *touch = &c->touches[c->pushing[k]];
        ContactForce force = force_of(c, touch, job->dt, job->share);
        if (is_within(touch, job->split[part], job->split[part + 1])) {
            apply(c, touch, &force, &job->work[part]);
        } else {
            c->forces[k] = force;
            c->left[first + left++] = k;
        }
    }
    job->left[part] = left;
}

/* where each part begins; returns how many forces a part has */
static int split_vertices(PushJob *job) {
    const Contact *c = job->c;
    int share = (c->pushing_count + CONTACT_PARTS - 1) / CONTACT_PARTS;
    int grain = share > CONTACT_LEAST_PART ? share : CONTACT_LEAST_PART;
    int parts = parallel_chunk_count(c->pushing_count, grain);
    job->split[0] = 0;
    for (int p = 1; p < parts; p++) {
        int place = c->touches[c->pushing[p * grain]].place[0];
        job->split[p] = place > job->split[p - 1] ? place : job->split[p - 1];
    }
    job->split[parts] = c->def->vertex_count;
    return grain;
}

static void push_all(Contact *c, double dt, double share) {
    PushJob job = {.c = c, .dt = dt, .share = share};
    int grain = split_vertices(&job);
    parallel_for(c->pushing_count, grain, push_part, &job);
    for (int p = 0; p < parallel_chunk_count(c->pushing_count, grain); p++) {
        for (int m = p * grain; m < p * grain + job.left[p]; m++) {
            int k = c->left[m];
            apply(c, &c->touches[c->pushing[k]], &c->forces[k], &job.work[p]);
        }
        contact_note_work(c, &job.work[p]);
    }
    c->some_touched = c->some_touched || c->pushing_count > 0;
}

void obstacle_forces(Contact *c, double dt, double share) {
    obstacle_find(c, dt);
    choose_pushing(c);
    push_all(c, dt, share);
    resting_forces(c, dt, share);
    for (int k = 0; k < c->follower_count; k++) {
        c->touches[c->followers[k].second].bristle = c->touches[c->followers[k].first].bristle;
    }
}

/* ---- guard ---- */

void obstacle_refresh(Contact *c, double dt) {
    if (c->outgrown && obstacle_search(c, dt)) {
        obstacle_look(c);
    }
}

static void touch_impulse(Contact *c, const Touch *touch, double dt) {
    double floor = CONTACT_IMPULSE_GAP * touch_distance(c, touch);
    double motion = CONTACT_IMPULSE_RESERVE * dt * c->group_touches[touch->owner].speed;
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
    double motion = dt * c->motion[touch->owner / c->def->obstacle_count].fastest;
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
    const GroupTouch *group = &c->group_touches[owner];
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
    if (!c->narrow) {
        return;
    }
    double before = c->statistics.impulses;
    for (int k = 0; k < c->due_group_count; k++) {
        const GroupTouch *group = &c->group_touches[c->due_groups[k]];
        double motion = CONTACT_IMPULSE_RESERVE * dt * group->speed;
        bool concerns = concerns_guard(c, c->due_groups[k], motion);
        for (int m = 0; m < group->near_count && concerns; m++) {
            touch_impulse(c, &c->touches[c->near_touches[group->begin + m]], dt);
        }
    }
    c->at_solids.impulses += c->statistics.impulses - before;
}

void obstacle_shorten(Contact *c, double dt) {
    if (!c->narrow) {
        return;
    }
    Points x = contact_positions(c);
    for (int k = 0; k < c->due_group_count; k++) {
        const GroupTouch *group = &c->group_touches[c->due_groups[k]];
        double motion = dt * c->motion[c->due_groups[k] / c->def->obstacle_count].fastest;
        bool concerns = concerns_guard(c, c->due_groups[k], motion / CONTACT_PLANE_SHARE);
        for (int m = 0; m < group->near_count && concerns; m++) {
            touch_shorten(c, &x, &c->touches[c->near_touches[group->begin + m]], dt);
        }
    }
}

bool obstacle_check(Contact *c, double dt) {
    if (c->outgrown && obstacle_search(c, dt)) {
        obstacle_look(c);
    }
    return c->outgrown;
}

/* [J] of a touch that is due */
static double energy_of(const Contact *c, const Touch *touch, double dt) {
    bool vertex = touch->place[1] < 0;
    if (!vertex && at_corner(touch)) {
        return 0.0;
    }
    double force, curvature, k = c->at_solids.share * touch_mass(c, touch) / (dt * dt);
    double share = vertex || touch->feature == 7 ? 1.0 : 0.5;
    return share * contact_law(touch->distance, touch_distance(c, touch), k, &force, &curvature);
}

double obstacle_energy(Contact *c, double dt) {
    double energy = 0.0;
    for (int i = 0; i < contact_owners(c); i++) {
        if (resting_holds(&c->resting, i)) {
            resting_wake(c, i);
        }
        const GroupTouch *group = &c->group_touches[i];
        for (int t = group->begin; t < group->begin + group->count; t++) {
            energy += group->path >= c->touch_due[t] ? energy_of(c, &c->touches[t], dt) : 0.0;
        }
    }
    return energy;
}
