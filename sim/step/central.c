/* central.c: velocity Verlet (central difference), the explicit road. */
#include <math.h>
#include <stdio.h>

#include "sim/step/explicit.h"
#include "sim/step/stepper.h"

/* v dt <= this share of the contact distance, or impacts are stopped by the guard alone */
#define CONTACT_COURANT 0.25

/* of the stability limit: what is faster is stopped by the guard, without bounce */
#define LEAST_CONTACT_SHARE 0.15

typedef struct Central {
    Explicit *engine;
    State trial;
} Central;

static bool create(const System *system, void **data, Error *error) {
    (void)error;
    Central *central = arena_push(system->arena, Central, 1);
    central->engine = explicit_create(system);
    central->trial = state_allocate(system, system->arena);
    *data = central;
    return true;
}

/* [m/s] how fast a vertex that can reach an obstacle within the interval goes for it */
static double approach_speed(const System *system, const State *state, double interval) {
    double fastest = 0.0, gain = vec3_length(system->scene->gravity) * interval;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        Pose now = state->contact.poses[o];
        Pose next = contact_pose(obstacle, state->contact.clocks[o] + interval);
        for (int i = 0; i < system->place_count; i++) {
            Vec3 normal, x = vec3_load(state->x + 3 * i), p = pose_unapply(now, x);
            double distance = solid_distance(&obstacle->solid, p, &normal);
            Vec3 carried = vec3_sub(pose_apply(next, p), x);
            Vec3 v = vec3_axpy(vec3_load(state->v + 3 * i), -1.0 / interval, carried);
            double speed = gain - vec3_dot(v, quat_rotate(now.turn, normal));
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

static bool gained_too_much(const ExplicitResult *result) {
    double allowed = result->work + STEP_ENERGY_TOLERANCE * result->energy_scale;
    return result->energy_gain > allowed;
}

static void record(const System *system, const State *state, const ExplicitRun *run,
                   const ExplicitResult *result, Statistics *s) {
    s->steps += result->steps;
    s->step_length = run->dt;
    s->work += result->work;
    s->contact = result->contact_energy;
    s->truncations += result->contact.truncations;
    s->impulses += result->contact.impulses;
    s->smallest_gap = fmin(s->smallest_gap, result->contact.smallest_gap);
    s->smallest_self_gap = fmin(s->smallest_self_gap, result->contact.smallest_self_gap);
    s->pairs = result->contact.pairs / result->steps;
    s->evaluations = result->contact.evaluations / result->steps;
    s->rebuilds += result->contact.rebuilds;
    s->friction += result->contact.friction;
    s->damping += result->contact.damping;
    s->guard += result->contact.guard;
    s->approach = result->contact.approach;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        s->lag = fmax(s->lag, state->time - state->contact.clocks[o]);
    }
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    Central *central = data;
    const SolverDef *solver = &system->scene->solver;
    double interval = time_end - state->time;
    double longest = solver->courant * explicit_limit(central->engine);
    if (solver->step > 0.0) {
        longest = fmin(longest, solver->step);
    }
    longest = fmin(longest, fmax(contact_step(system, state, interval),
                                 LEAST_CONTACT_SHARE * explicit_limit(central->engine)));
    longest *= state->contact.shrink > 0.0 ? state->contact.shrink : 1.0;
    ExplicitResult result = {0};
    for (int halvings = 0; halvings <= STEP_MAX_HALVINGS; halvings++) {
        ExplicitRun run = {.steps = (int)fmax(1.0, ceil(interval / longest - 1e-9))};
        run.dt = interval / run.steps;
        state_copy(system, &central->trial, state);
        result = explicit_interval(central->engine, &run, &central->trial);
        if (step_interrupted) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        if (result.finite && !gained_too_much(&result)) {
            state_copy(system, state, &central->trial);
            state->time = time_end;
            state->step_before = 0.0;
            record(system, state, &run, &result, statistics);
            return true;
        }
        statistics->retries++;
        longest = 0.5 * run.dt;
    }
    return error_set(
        error, EXIT_DIFFERS,
        "central: no step down to %.2g s keeps the energy from t = %g s on (it rose by "
        "%.3g J more than the work done)",
        longest, state->time, result.energy_gain - result.work);
}

const Stepper stepper_central = {
    .name = "central",
    .about = "central differences (velocity Verlet) at 0.8 of the stability limit",
    .create = create,
    .advance = advance,
};
