/* central.c: velocity Verlet (central difference), the explicit road; and symplectic Euler, which
 * takes whole kicks. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/step/explicit.h"
#include "sim/step/stepper.h"

/* v dt <= this share of the contact distance, or impacts are stopped by the guard alone */
#define CONTACT_COURANT 0.25

/* Rest: kinetic energy / (weight * size) of the net motion of an interval, and of the motion at its
 * end, where vertices between layers and at sharp edges may still tremble on the spot, by some microns; and for
 * how long. */
#define CALM_ENERGY 3e-9
#define CALM_TREMBLE 1e-5
#define CALM_SECONDS 0.5

/* Inertia is scaled where steps become so much longer. */
#define SCALING_LEAST_GAIN 1.15
/* ... when the guard has rested for so long [s]; an interval is done again without where it changes so many
 * velocities in a step */
#define SCALING_AFTER 0.05
#define SCALING_MOST_GUARDED 0.1
/* ... and where it rises by so much of the energy */
#define SCALING_TOLERANCE 0.05

/* Crowded vertices have more inertia, which comes and goes: in cloth that moves it may give energy. An interval
 * that has so much of its energy from there is done again with steps that such cloth bears. */
#define CROWDED_MOST_GIVEN 0.05

/* [s] after either: inertia stays true, and steps are those that crowded cloth bears */
#define CAUTION 10.0

/* A step is at most so many times `courant` of the limit of the cloth as it is stretched: the tension of some
 * 10 % takes what courant 0.8 leaves to contacts. */
#define STRETCHED_SHARE 1.125

/* of the stability limit: what is faster is stopped by the guard, without bounce */
#define LEAST_CONTACT_SHARE 0.15

typedef struct Central {
    Explicit *engine;
    State trial;
    unsigned char *held; /* (place_count) */
    bool symplectic_euler;
} Central;

static bool create(const System *system, void **data, Error *error) {
    (void)error;
    Central *central = arena_push(system->arena, Central, 1);
    central->engine = explicit_create(system);
    central->held = arena_push(system->arena, unsigned char, system->place_count);
    central->trial = state_allocate(system, system->arena);
    *data = central;
    return true;
}

static bool create_symplectic_euler(const System *system, void **data, Error *error) {
    bool ok = create(system, data, error);
    ((Central *)*data)->symplectic_euler = true;
    return ok;
}

static double box_point_distance(Vec3 low, Vec3 high, Vec3 p) {
    Vec3 out = {fmax(fmax(low.x - p.x, p.x - high.x), 0.0),
                fmax(fmax(low.y - p.y, p.y - high.y), 0.0),
                fmax(fmax(low.z - p.z, p.z - high.z), 0.0)};
    return vec3_length(out);
}

/* [m/s] how fast a vertex that can reach an obstacle within the interval goes for it */
static double approach_speed(const System *system, const State *state, double interval) {
    double fastest = 0.0, gain = vec3_length(system->scene->gravity) * interval;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        Pose now = state->contact.poses[o];
        Pose next = contact_pose(obstacle, state->contact.clocks[o] + interval);
        Vec3 low = {0, 0, 0}, high = {0, 0, 0};
        if (obstacle->mesh) {
            low = vec3_load(obstacle->mesh->low), high = vec3_load(obstacle->mesh->high);
        }
        for (int i = 0; i < system->place_count; i++) {
            Vec3 normal, x = vec3_load(state->x + 3 * i), p = pose_unapply(now, x);
            Vec3 carried = vec3_sub(pose_apply(next, p), x);
            Vec3 v = vec3_axpy(vec3_load(state->v + 3 * i), -1.0 / interval, carried);
            double distance, speed;
            if (obstacle->mesh) { /* near its box it may go for it in any direction */
                distance = box_point_distance(low, high, p);
                speed = gain + vec3_length(v);
            } else {
                distance = solid_distance(&obstacle->solid, p, &normal);
                speed = gain - vec3_dot(v, quat_rotate(now.turn, normal));
            }
            if (distance < speed * interval + system->contact.distance) {
                fastest = fmax(fastest, speed);
            }
        }
    }
    return fastest;
}

/* impacts are stopped by the law when nothing comes nearer in a step than a share of its range */
static double contact_step(const System *system, const State *state, double interval) {
    double speed = fmax(state->contact.approach, approach_speed(system, state, interval));
    return CONTACT_COURANT * system->contact.distance / fmax(speed, 1e-9);
}

static bool is_good(const System *system, const ExplicitResult *result, double tolerance) {
    double scale = result->energy_scale, work = result->work + result->blown;
    if (system->contact.impulses) {
        /* without a potential: as if cloth were lifted through the layer; and what repulsions between
         * two obstacles give to one of them is not the cloth's */
        scale += system->weight * system->contact.distance;
        work = fmax(work, 0.0);
    }
    double allowed = work + tolerance * scale;
    return result->finite && !result->contact.rejected && result->energy_gain <= allowed;
}

/* [s] at which crowded vertices give no energy */
static double bearable_step(const System *system, const State *state) {
    return contact_longest_step(&system->contact, &state->contact);
}

/* did they give much in this interval? */
static bool is_fed(const ExplicitResult *result) {
    double given = -result->contact.guard - result->contact.stiffened;
    return given > CROWDED_MOST_GIVEN * result->energy_scale;
}

/* [s] what contact and the scene allow */
static double allowed_step(const System *system, const Central *central, const State *state,
                           double interval) {
    double given = system->scene->solver.step, longest = given > 0.0 ? given : INFINITY;
    if (system->contact.impulses) { /* which stop impacts of any speed */
        return longest;
    }
    double least = LEAST_CONTACT_SHARE * explicit_limit(central->engine, false);
    longest = fmin(longest, fmax(contact_step(system, state, interval), least));
    return state->unguarded < 0.0 ? fmin(longest, bearable_step(system, state)) : longest;
}

/* what stretch leaves of the stability limit */
static double stretched_share(const System *system, const Central *central, const State *state) {
    double stable = explicit_limit(central->engine, false);
    return fmin(1.0, STRETCHED_SHARE / sqrt(system_stiffening(system, state->x, stable)));
}

/* May inertia be scaled in an interval? Not where cloth is crowded, since that acts on single vertices; nor
 * is it of use where other bounds on the step are shorter. */
static bool scales(const System *system, const Central *central, const State *state,
                   double allowed) {
    double limit = explicit_limit(central->engine, false);
    double scaled = explicit_limit(central->engine, true);
    double gain = fmin(allowed / system->scene->solver.courant, scaled) / limit;
    return gain > SCALING_LEAST_GAIN && state->unguarded >= SCALING_AFTER &&
           !contact_is_crowded(&system->contact, &state->contact);
}

/* velocities that the guard changed */
static double guarded(const ExplicitResult *result) {
    return result->contact.impulses + result->contact.truncations;
}

/* [s] until scaling may be tried again if negative, else for how long the guard has rested; `spoilt`: scaling
 * spoilt this interval */
static double unguarded_after(const State *state, const ExplicitResult *result, bool spoilt,
                              double interval) {
    if (spoilt) {
        return -CAUTION;
    }
    return guarded(result) > 0.0 ? fmin(state->unguarded, 0.0) : state->unguarded + interval;
}

#define MUCH_STRETCH                                                                               \
    0.1 /* more may be why it stops: no step helps a handle that pulls cloth apart */

/* Why no step did; `state`: the last that was good. */
static bool say_why(const System *system, const Central *central, const State *state,
                    double shortest, const ExplicitResult *result, Error *error) {
    const char *name = central->symplectic_euler ? "symplectic_euler" : "central";
    char stretched[120] = "";
    int cloth;
    double stretch = system_stretch(system, state->x, &cloth);
    if (stretch > MUCH_STRETCH) {
        snprintf(stretched, sizeof stretched, "; cloth '%.40s' is stretched by %.0f %% then",
                 system->cloths[cloth].def->name, 100.0 * stretch);
    }
    if (result->contact.rejected && system->contact.impulses) {
        return error_set(error, EXIT_DIFFERS,
                         "%s: no step down to %.2g s parts the cloth by impulses from t = %g s on: "
                         "impact zones would glue more than 2 %% of it; 'contact: penalty' may%s",
                         name, shortest, state->time, stretched);
    }
    if (result->contact.rejected) {
        return error_set(error, EXIT_DIFFERS,
                         "%s: no step down to %.2g s is so short that nothing leaps in it, from "
                         "t = %g s on%s",
                         name, shortest, state->time, stretched);
    }
    if (!result->finite) {
        return error_set(
            error, EXIT_DIFFERS,
            "%s: no step down to %.2g s keeps the cloth from bursting, from t = %g s on%s", name,
            shortest, state->time, stretched);
    }
    return error_set(error, EXIT_DIFFERS,
                     "%s: no step down to %.2g s keeps the energy from t = %g s on (it rose by "
                     "%.3g J more than the work done)%s",
                     name, shortest, state->time,
                     result->energy_gain - result->work - result->blown, stretched);
}

static void record(const System *system, const State *state, const ExplicitRun *run,
                   const ExplicitResult *result, Statistics *s) {
    s->steps += result->steps;
    s->step_length = run->dt;
    s->work += result->work;
    s->contact = result->contact_energy;
    s->elastic = result->elastic;
    s->truncations += result->contact.truncations;
    s->impulses += result->contact.impulses;
    s->smallest_gap = fmin(s->smallest_gap, result->contact.smallest_gap);
    s->smallest_self_gap = fmin(s->smallest_self_gap, result->contact.smallest_self_gap);
    s->pairs = result->contact.pairs / result->steps;
    s->evaluations = result->contact.evaluations / result->steps;
    s->rebuilds += result->contact.rebuilds;
    s->rounds += result->contact.rounds;
    s->zones += result->contact.zones;
    s->zone_vertices += result->contact.zone_vertices;
    s->friction += result->contact.friction;
    s->damping += result->contact.damping;
    s->guard += result->contact.guard;
    s->sides += result->sides;
    s->numerical += result->inertia;
    s->fabric += result->fabric;
    s->drag += result->drag;
    s->approach = result->contact.approach;
    s->contact_seconds += result->contact.seconds;
    s->search_seconds += result->contact.search_seconds;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        s->lag = fmax(s->lag, state->time - state->contact.clocks[o]);
    }
}

/* do handles and obstacles stand still until `time_end`, and does none let go? */
static bool is_undisturbed(const System *system, const State *state, double time_end) {
    for (int h = 0; h < system->handle_count; h++) {
        const HandleDef *def = system->handles[h].def;
        bool lets_go = def->release > state->time - CALM_SECONDS && def->release <= time_end;
        if (lets_go || motion_end(&def->motion) > state->time - CALM_SECONDS) {
            return false;
        }
    }
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        if (obstacle->moves && contact_motion_end(obstacle) > state->contact.clocks[o]) {
            return false;
        }
    }
    return true;
}

/* cloth that has come to rest stays there until something moves it */
static bool sleeps(const System *system, State *state, double time_end) {
    if (state->calm < CALM_SECONDS || !is_undisturbed(system, state, time_end)) {
        return false;
    }
    memset(state->v, 0, 3 * (size_t)system->place_count * sizeof *state->v);
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        state->contact.clocks[o] = time_end;
    }
    state->contact.approach = 0.0;
    state->time = time_end;
    return true;
}

/* [J] kinetic energy of a straight motion to the positions of `end` */
static double net_kinetic_energy(const System *system, const State *start, const State *end,
                                 const unsigned char *held, double interval) {
    double energy = 0.0;
    for (int i = 0; i < system->place_count; i++) {
        Vec3 moved = vec3_sub(vec3_load(end->x + 3 * i), vec3_load(start->x + 3 * i));
        energy += held[i] ? 0.0 : 0.5 * system->mass[i] * vec3_dot(moved, moved);
    }
    return energy / (interval * interval);
}

/* [s] for which nothing has moved at `end` of an interval */
static double calm_after(const System *system, Central *central, const State *start,
                         const State *end, double interval) {
    system_mark_held(system, end->time, central->held);
    double net = net_kinetic_energy(system, start, end, central->held, interval);
    double kinetic = system_kinetic_energy(system, end->v, central->held);
    double scale = system->weight * system->size;
    bool calm = net <= CALM_ENERGY * scale && kinetic <= CALM_TREMBLE * scale;
    return calm ? start->calm + interval : 0.0;
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    Central *central = data;
    if (sleeps(system, state, time_end)) {
        statistics->asleep = 1.0;
        return true;
    }
    double interval = time_end - state->time;
    double allowed = allowed_step(system, central, state, interval);
    bool scaled = scales(system, central, state, allowed);
    double courant = system->scene->solver.courant * stretched_share(system, central, state);
    double longest = fmin(allowed, courant * explicit_limit(central->engine, scaled));
    ExplicitResult result = {0};
    bool spoilt = false;
    for (int halvings = 0; halvings <= STEP_MAX_HALVINGS; halvings++) {
        ExplicitRun run = {.steps = (int)fmax(1.0, ceil(interval / longest - 1e-9))};
        run.dt = interval / run.steps;
        run.scaled = scaled && run.dt > courant * explicit_limit(central->engine, false);
        run.symplectic_euler = central->symplectic_euler;
        state_copy(system, &central->trial, state);
        result = explicit_interval(central->engine, &run, &central->trial);
        if (step_interrupted) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        bool good =
            is_good(system, &result, run.scaled ? SCALING_TOLERANCE : STEP_ENERGY_TOLERANCE);
        bool busy = guarded(&result) > SCALING_MOST_GUARDED * result.steps;
        if (run.scaled && (!good || busy)) {
            scaled = false;
            spoilt = spoilt || !good;
            longest = fmin(longest, courant * explicit_limit(central->engine, false));
            statistics->retries++;
            continue;
        }
        double bearable = bearable_step(system, state);
        if (good && run.dt > bearable && is_fed(&result)) {
            spoilt = true;
            longest = fmin(longest, bearable);
            statistics->retries++;
            continue;
        }
        if (good) {
            double calm = calm_after(system, central, state, &central->trial, interval);
            state_copy(system, state, &central->trial);
            state->time = time_end;
            state->step_before = 0.0;
            state->calm = calm;
            state->unguarded = unguarded_after(state, &result, spoilt, interval);
            record(system, state, &run, &result, statistics);
            return true;
        }
        statistics->retries++;
        longest = 0.5 * run.dt;
    }
    return say_why(system, central, state, longest, &result, error);
}

const Stepper stepper_central = {
    .name = "central",
    .about = "central differences (velocity Verlet) at 0.8 of the stability limit",
    .scales = true,
    .limits = true,
    .history = true,
    .create = create,
    .advance = advance,
};

const Stepper stepper_symplectic_euler = {
    .name = "symplectic_euler",
    .about = "whole kicks and drifts in turn, first order, with contact",
    .scales = true,
    .limits = true,
    .history = true,
    .create = create_symplectic_euler,
    .advance = advance,
};
