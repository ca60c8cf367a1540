#include "sim/contact/contact.h"

#include <math.h>
#include <string.h>

#include "sim/base/clock.h"
#include "sim/base/parallel.h"
#include "sim/contact/engine.h"
#include "sim/contact/force.h"
#include "sim/contact/impulses.h"

#define MOST_ROUNDS 12 /* of shortening after searches; more speed needs more than one by rule */

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
    double safe = max2(d, CONTACT_LEAST_GAP * dhat);
    *force = k * tau * (dhat - tau) / safe;
    *curvature = k * tau * (dhat - tau) / (safe * safe);
    return k * tau * (dhat - tau) * log(tau / safe) + 0.5 * k * (dhat - tau) * (dhat - tau);
}

double contact_share_inside(double lower, double dhat) {
    double g = max2(0.0, lower) / (CONTACT_FADE * dhat); /* rounding may put it above */
    return g < 1.0 ? g * (2.0 - g) : 1.0;
}

Pose contact_pose(const ContactObstacle *obstacle, double clock) {
    return pose_compose(motion_pose(obstacle->motion, clock), obstacle->start);
}

double contact_motion_end(const ContactObstacle *obstacle) {
    const MeshDef *mesh = obstacle->mesh;
    double frames =
        mesh && mesh->frame_count > 1 ? (mesh->frame_count - 1) / mesh->frame_rate : 0.0;
    return max2(frames, motion_end(obstacle->motion));
}

double contact_longest_step(const ContactDef *def, const ContactMemory *memory) {
    if (memory->stiffness <= CONTACT_FULL_STEP_STIFFNESS) {
        return INFINITY;
    }
    return sqrt(CONTACT_FULL_STEP_STIFFNESS / memory->stiffness) * def->reference_step;
}

bool contact_is_crowded(const ContactDef *def, const ContactMemory *memory) {
    int pairs = 0;
    for (int k = memory->touch_count; k < memory->pair_count; k++) {
        const int *place = memory->pairs[k].place;
        int other = place[3] < 0 ? -1 - place[3] : place[3];
        pairs += place[0] < def->vertex_count && other < def->vertex_count;
    }
    return memory->stiffness > CONTACT_SELF_STIFFNESS ||
           pairs > CONTACT_CROWDED * def->vertex_count;
}

/* ---- creation ---- */

static void create_obstacles(Contact *c, Arena *arena) {
    int n = c->def->vertex_count, o = c->def->obstacle_count;
    int owners = contact_owners(c);
    c->touches.groups = arena_push(arena, GroupTouch, owners);
    c->look.sums = arena_push(arena, LookSum, owners);
    for (int k = 0; k < o; k++) {
        c->programmes.some = c->programmes.some || c->def->obstacles[k].moves;
    }
    c->resting = resting_create(owners, arena);
    c->look.groups = arena_push(arena, int, owners);
    c->look.spent = arena_push(arena, int, owners);
    c->look.counts = arena_push(arena, int, owners);
    c->look.spent_counts = arena_push(arena, int, owners);
    c->touches.known = arena_push(arena, VertexDistance, n * o);
    obstacle_create_sides(c, arena);
    c->poses = arena_push(arena, Pose, o);
    c->frames = arena_push(arena, Frame, o);
    c->programmes.next = arena_push(arena, Pose, o);
    c->programmes.clocks = arena_push(arena, double, o);
    c->programmes.next_clocks = arena_push(arena, double, o);
    c->obstacle_speed = arena_push(arena, double, o);
    c->bristles.vertices = arena_push(arena, double, 3 * n * o);
    c->bristles.memory = arena_push(arena, PairMemory, CONTACT_MEMORY_PER_VERTEX * n);
}

Contact *contact_create(const ContactDef *def, Arena *arena) {
    int n = def->vertex_count;
    Contact *c = arena_push(arena, Contact, 1);
    c->def = def;
    c->arena = arena;
    c->places = places_create(def, arena);
    c->surface = c->places.surface;
    c->x = c->places.x;
    c->pairs_wanted = def->self || c->places.meshes;
    c->programmes.mesh_target = arena_push(arena, double, 3 * (c->places.count - n));
    c->lists = lists_create(&c->surface, c->x, def->self, arena);
    c->groups = groups_create(&c->surface, n, c->places.count, arena);
    c->v = arena_push(arena, double, 3 * c->places.count);
    c->held = arena_push(arena, unsigned char, c->places.count);
    memset(c->held + n, 1, (size_t)(c->places.count - n));
    c->is_touched = arena_push(arena, unsigned char, n + 8);
    c->pushes = arena_push(arena, Push, n);
    c->tolls = arena_push(arena, Toll, n);
    c->losses = arena_push(arena, Loss, parallel_chunk_count(n, CONTACT_VERTEX_GRAIN));
    c->changed = arena_push(arena, int, n);
    c->kicked = arena_push(arena, Vec3, n);
    c->is_changed = arena_push(arena, unsigned char, n);
    c->scale = arena_push(arena, double, n);
    c->weight_kept = arena_push(arena, double, n);
    for (int i = 0; i < n; i++) {
        c->scale[i] = 1.0;
    }
    create_obstacles(c, arena);
    c->quiet = quiet_create(&c->surface, arena);
    c->impulses = def->impulses ? impulses_create(c, arena) : NULL;
    return c;
}

/* ---- shared by both kinds of contact ---- */

static void copy_lanes(const Contact *c, double *const lanes[3], double *out) {
    MotionCopy copy = {&c->groups.rows, lanes, out};
    ParallelLoop loop = motion_copy_loop(&copy);
    parallel_for_all(&loop, 1);
}

void contact_gather(Contact *c) {
    c->lists.stamp++;
    copy_lanes(c, c->view.lanes->x, c->x);
}

void contact_make_force_room(Contact *c, int most) {
    c->forces.pushing_count = c->forces.follower_count = 0;
    if (most > c->forces.room) {
        c->forces.room = 2 * most;
        c->forces.found = arena_push(c->arena, ContactForce, c->forces.room);
        c->forces.ends = arena_push(c->arena, ForceEnds, c->forces.room);
        c->forces.pushing = arena_push(c->arena, int, c->forces.room);
        c->forces.left = arena_push(c->arena, int, c->forces.room);
        c->forces.followers = arena_push(c->arena, Follower, c->forces.room);
    }
}

void contact_mark_changed(Contact *c, int place) {
    if (!c->is_changed[place]) {
        c->is_changed[place] = 1;
        c->kicked[place] = contact_velocity(c, place);
        c->changed[c->changed_count++] = place;
    }
}

bool contact_impulse(Contact *c, int count, const int *place, const double *weight, Vec3 normal,
                     Vec3 carried, double approach, double wanted) {
    double mobility = 0.0, whole = 0.0; /* as it is; if no handle held any */
    for (int a = 0; a < count; a++) {
        double square = weight[a] * weight[a];
        mobility += square * contact_mobility(c, place[a]);
        whole += place[a] < c->def->vertex_count ? square * c->weight_kept[place[a]] : 0.0;
    }
    if (approach >= wanted || mobility <= CONTACT_LEAST_FREE * whole) {
        return false;
    }
    double impulse = (wanted - approach) / mobility;
    /* [J] of what no impulse moves: solids, handles */
    double work = impulse * vec3_dot(normal, carried);
    c->statistics.impulses++;
    for (int a = 0; a < count; a++) {
        if (place[a] < c->def->vertex_count && c->held[place[a]]) {
            work -= impulse * weight[a] * vec3_dot(normal, contact_velocity(c, place[a]));
        }
        double share = impulse * weight[a] * contact_mobility(c, place[a]);
        if (share != 0.0) {
            Vec3 v = contact_velocity(c, place[a]);
            contact_mark_changed(c, place[a]);
            vec3_store(c->v + 3 * (long)place[a], vec3_axpy(v, share, normal));
        }
    }
    c->statistics.work += work;
    c->statistics.guard += work; /* is no loss */
    return true;
}

void contact_hold_back(Contact *c, int place, Vec3 away, double room, double dt) {
    double approach = -dt * vec3_dot(away, contact_velocity(c, place));
    double most = CONTACT_PLANE_SHARE * room;
    if (approach > 0.0 && approach > most) {
        contact_shorten(c, place, max2(most, 0.0) / approach);
    }
}

void contact_shorten(Contact *c, int place, double share) {
    contact_mark_changed(c, place);
    c->scale[place] = min2(c->scale[place], share);
}

/* ---- one interval ---- */

/* makes all lists for the positions and velocities of now */
static void make_lists(Contact *c, double dt) {
    contact_gather(c);
    c->groups.mean = vec3(0.0, 0.0, 0.0);
    contact_move_groups(c, dt); /* for their mean */
    contact_move_groups(c, dt);
    if (c->pairs_wanted) {
        self_begin(c, dt);
    }
    if (c->def->obstacle_count > 0) {
        obstacle_begin(c, dt);
    }
}

/* without lists from now on, when nothing can touch */
static bool become_quiet(Contact *c, double dt) {
    if (!quiet_prove(c, dt)) {
        return false;
    }
    size_t o = (size_t)c->def->obstacle_count;
    lists_clear(&c->lists, NULL, 0);
    memset(c->bristles.vertices, 0,
           3 * o * (size_t)c->def->vertex_count * sizeof *c->bristles.vertices);
    obstacle_begin_sides(c, false);
    memset(c->touches.groups, 0, (size_t)contact_owners(c) * sizeof *c->touches.groups);
    resting_clear(&c->resting, contact_owners(c));
    c->touches.count = c->touches.end = c->bristles.memory_count = 0;
    c->due.count = c->look.touch_count = c->look.group_count = 0;
    return true;
}

static bool nothing_listed(const Contact *c) {
    return c->touches.count == 0 && c->lists.pair_count == 0;
}

void contact_begin(Contact *c, ContactView view, const ContactMemory *memory, double dt) {
    size_t o = (size_t)c->def->obstacle_count;
    c->view = view;
    motion_rows_set(&c->groups.rows, &c->surface, view.slot, c->def->vertex_count);
    memcpy(c->poses, memory->poses, o * sizeof *c->poses);
    memcpy(c->programmes.next, memory->poses, o * sizeof *c->programmes.next);
    memcpy(c->programmes.clocks, memory->clocks, o * sizeof *c->programmes.clocks);
    memcpy(c->bristles.vertices, memory->bristles,
           3 * o * (size_t)c->def->vertex_count * sizeof *c->bristles.vertices);
    memset(c->obstacle_speed, 0, o * sizeof *c->obstacle_speed);
    c->statistics = (ContactStatistics){.smallest_gap = INFINITY, .smallest_self_gap = INFINITY};
    for (int i = 0; i < c->def->vertex_count; i++) {
        c->weight_kept[i] = c->view.lanes->weight[c->view.slot[i]];
    }
    int touches = memory->touch_count;
    obstacle_begin_sides(c, touches > 0);
    memcpy(c->bristles.memory, memory->pairs, (size_t)touches * sizeof *memory->pairs);
    c->bristles.memory_count = touches;
    lists_clear(&c->lists, memory->pairs + touches, memory->pair_count - touches);
    memcpy(c->held, view.held, (size_t)c->def->vertex_count);
    mesh_begin(c);
    double steps = c->step_count;
    c->step_count = 0.0;
    c->at_cloth = (Stiffness){max2(memory->stiffness, CONTACT_SELF_STIFFNESS), 0.0, INFINITY};
    double share = max2(memory->solid_stiffness, CONTACT_STIFFNESS) * view.stiffer;
    c->at_solids = (Stiffness){share, 0.0, INFINITY};
    bool nothing_kept = memory->pair_count == 0;
    if (!(nothing_kept && quiet_continues(c, steps)) && !become_quiet(c, dt)) {
        make_lists(c, dt);
    }
}

/* For the next interval: more where impulses had to hold the cloth, less where it had room, else the same,
 * so that what rests is left alone. Returns what that stores [J]. */
static double adapt(Contact *c, Stiffness *stiffness, double least, double most,
                    double (*energy)(Contact *c, double dt)) {
    bool soft = stiffness->impulses > CONTACT_MOST_IMPULSES * c->step_count;
    bool roomy = stiffness->room > CONTACT_ROOMY;
    double wanted = stiffness->share * (soft ? CONTACT_STIFFER : roomy ? CONTACT_SOFTER : 1.0);
    double share = max2(least, min2(wanted, most));
    if (share == stiffness->share) {
        return 0.0;
    }
    double stored = energy(c, c->step);
    stiffness->share = share;
    return energy(c, c->step) - stored;
}

static void adapt_all(Contact *c, ContactMemory *memory) {
    ContactStatistics *s = &c->statistics;
    if (c->pairs_wanted) {
        s->stiffened += adapt(c, &c->at_cloth, CONTACT_SELF_STIFFNESS, CONTACT_MOST_SELF_STIFFNESS,
                              self_energy);
    }
    if (c->def->obstacle_count > 0) {
        s->stiffened += adapt(c, &c->at_solids, CONTACT_STIFFNESS * c->view.stiffer,
                              CONTACT_MOST_STIFFNESS * c->view.stiffer, obstacle_energy);
    }
    s->guard -= s->stiffened;
    memory->stiffness = c->at_cloth.share;
    memory->solid_stiffness = c->at_solids.share / c->view.stiffer;
}

void contact_end(Contact *c, ContactMemory *memory) {
    if (c->some_touched) { /* by the last kick */
        copy_lanes(c, c->view.lanes->v, c->v);
        ParallelLoop losses = contact_losses_loop(c);
        parallel_for_all(&losses, 1);
        contact_sum_losses(c);
    }
    if (!c->impulses) {
        adapt_all(c, memory);
    }
    size_t o = (size_t)c->def->obstacle_count;
    memcpy(memory->poses, c->poses, o * sizeof *c->poses);
    memcpy(memory->clocks, c->programmes.clocks, o * sizeof *c->programmes.clocks);
    memcpy(memory->bristles, c->bristles.vertices,
           3 * o * (size_t)c->def->vertex_count * sizeof *c->bristles.vertices);
    memory->approach = c->statistics.approach;
    memory->touch_count = obstacle_remember(c, memory->pairs, memory->pair_room);
    memory->pair_count =
        memory->touch_count + lists_remember(&c->lists, memory->pairs + memory->touch_count,
                                             memory->pair_room - memory->touch_count);
}

/* forces to the lanes; crowded vertices are slow: inertia where stiffness is too much for the step */
static void hand_over_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    Contact *c = context;
    const Lanes *lanes = c->view.lanes;
    TouchedWalk walk = touched_walk(c->is_touched, first, end, false);
    for (int place; (place = touched_next(&walk)) >= 0;) {
        int slot = c->view.slot[place];
        Push *push = &c->pushes[place];
        double inertia = c->held[place] ? 0.0 : contact_inertia(c, push->stiffness);
        double own = c->weight_kept[place];
        lanes->f[0][slot] += push->force.x;
        lanes->f[1][slot] += push->force.y;
        lanes->f[2][slot] += push->force.z;
        lanes->weight[slot] = inertia * own > 1.0 ? 1.0 / inertia : own;
        *push = (Push){0};
    }
}

static void push_all(Contact *c, double dt, double share) {
    if (c->pairs_wanted) {
        self_forces(c, dt, share);
    }
    if (c->def->obstacle_count > 0) {
        obstacle_forces(c, dt, share);
    }
    if (c->some_touched) {
        parallel_for(c->def->vertex_count, CONTACT_VERTEX_GRAIN, hand_over_chunk, c);
    }
}

void contact_forces(Contact *c, double dt, double share, double time_end) {
    obstacle_demand(c, dt, time_end);
    c->step = dt;
    c->kick_time = share * dt;
    c->step_count++;
    if (c->quiet.holds) {
        return;
    }
    double start = clock_seconds();
    contact_gather(c);
    if (nothing_listed(c) && c->step_count > c->quiet.retry && become_quiet(c, dt)) {
        return;
    }
    if (c->impulses) {
        impulses_find(c, dt);
    } else {
        push_all(c, dt, share);
    }
    c->statistics.seconds += clock_seconds() - start;
}

/* scales the motions that the planes cut */
static void apply_scales(Contact *c) {
    for (int k = 0; k < c->changed_count; k++) {
        int place = c->changed[k];
        if (c->scale[place] < 1.0) {
            Vec3 v = contact_velocity(c, place);
            c->statistics.truncations++;
            vec3_store(c->v + 3 * (long)place, vec3_scale(c->scale[place], v));
            c->scale[place] = 1.0;
        }
    }
}

/* the velocities after the kick, and lists that are wide enough for them */
static void refresh(Contact *c, double dt) {
    contact_move_groups(c, dt);
    if (c->pairs_wanted) {
        self_refresh(c, dt);
    }
    if (c->def->obstacle_count > 0) {
        obstacle_refresh(c, dt);
    }
}

static void guard_by_planes(Contact *c, double dt) {
    bool self = c->pairs_wanted, obstacles = c->def->obstacle_count > 0;
    if (self) {
        self_impulses(c, dt);
    }
    if (obstacles) {
        obstacle_impulses(c, dt);
    }
    contact_move_changed_groups(c, dt);
    bool again = true;
    for (int round = 0; round < MOST_ROUNDS && again; round++) {
        if (self) {
            self_shorten(c, dt);
        }
        if (obstacles) {
            obstacle_shorten(c, dt);
        }
        apply_scales(c);
        contact_move_changed_groups(c, dt);
        again = c->changed_count > 0 && self && self_check(c, dt);
        again = (c->changed_count > 0 && obstacles && obstacle_check(c, dt)) || again;
    }
    if (again) { /* standing still is always legal */
        for (int i = 0; i < c->def->vertex_count; i++) {
            contact_shorten(c, i, 0.0);
        }
        apply_scales(c);
        contact_move_changed_groups(c, dt);
        if (self) {
            self_check(c, dt);
        }
        obstacle_check(c, dt);
    }
}

/* the velocities that the guard changed, to the lanes; were there any? */
static bool write_changed(Contact *c) {
    bool some = c->changed_count > 0;
    for (int k = 0; k < c->changed_count; k++) {
        int place = c->changed[k], slot = c->view.slot[place];
        for (int a = 0; a < 3; a++) {
            c->view.lanes->v[a][slot] = c->v[3 * place + a];
        }
        c->is_changed[place] = 0;
    }
    c->changed_count = 0;
    return some;
}

/* May this step be made without looking? When a proof ends, another is tried, and then lists are
 * made. */
static bool passes_quietly(Contact *c, double dt) {
    if (!c->quiet.holds) {
        return false;
    }
    if (quiet_has_room(c, dt)) {
        return true;
    }
    if (quiet_prove(c, dt) && quiet_has_room(c, dt)) {
        return true;
    }
    c->quiet.holds = false;
    make_lists(c, dt);
    return false;
}

bool contact_repel(Contact *c, double dt) {
    bool changed = false;
    if (c->impulses && !c->quiet.holds) {
        double start = clock_seconds();
        refresh(c, dt);
        impulses_repel(c, dt);
        changed = write_changed(c);
        c->statistics.seconds += clock_seconds() - start;
    }
    return changed;
}

/* paths of groups and of pairs of groups lead on by the motion of this step; what it took is counted */
static void advance_and_count(Contact *c) {
    int count = 1;
    ParallelLoop loops[3] = {contact_losses_loop(c)};
    if (c->def->obstacle_count > 0) {
        loops[count++] = obstacle_advance_loop(c);
    }
    if (c->pairs_wanted) {
        loops[count++] = self_advance_loop(c);
    }
    parallel_for_all(loops, count);
    if (c->pairs_wanted) {
        self_advanced(c);
    }
    contact_sum_losses(c);
}

bool contact_guard(Contact *c, double dt) {
    if (passes_quietly(c, dt)) {
        if (c->def->obstacle_count > 0) {
            obstacle_move(c, dt);
        }
        return false;
    }
    double start = clock_seconds();
    refresh(c, dt);
    if (c->impulses) {
        impulses_guard(c, dt);
    } else {
        guard_by_planes(c, dt);
    }
    if (c->def->obstacle_count > 0) {
        obstacle_move(c, dt);
    }
    advance_and_count(c);
    bool changed = write_changed(c);
    c->statistics.seconds += clock_seconds() - start;
    return changed;
}

bool contact_asks_relative(const Contact *c) { return c->quiet.holds && c->quiet.close; }

void contact_drifted(Contact *c, const ContactSpeeds *speeds, double dt) {
    if (c->quiet.holds && !quiet_spend(c, speeds, dt)) {
        c->statistics.rejected = true;
    }
}

const ContactStatistics *contact_statistics(const Contact *c) { return &c->statistics; }

double contact_energy(Contact *c, double dt) {
    if (c->impulses) {
        return 0.0;
    }
    double energy = c->pairs_wanted ? self_energy(c, dt) : 0.0;
    return energy + (c->def->obstacle_count > 0 ? obstacle_energy(c, dt) : 0.0);
}
