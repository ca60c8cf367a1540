/* static.c: equilibrium at every output time. Kinetic damping brings the cloth near when it
 * starts far away, mixed-point Newton finishes; where that does not converge (snap, several
 * minima) implicit pseudo-time steps go on until it does. */
#include <math.h>
#include <string.h>

#include "sim/step/explicit.h"
#include "sim/step/implicit.h"
#include "sim/step/stepper.h"

#define EQUILIBRIUM 1e-6     /* of the weight: residual of an equilibrium */
#define NEWTON_ITERATIONS 24 /* of one attempt */
#define RELAX_STEPS 4000     /* explicit steps of one relaxation */
#define RELAX_TARGET 1e-9    /* kinetic energy at a kill / (weight * size): relaxed */
#define PSEUDO_STEP 0.02     /* [s] first pseudo-time step */
#define PSEUDO_STEPS 400     /* before giving up */
#define LONGEST_MOVE 0.3     /* of the size, of any node in one pseudo-time iteration */
#define APPROACH_STEPS                                                                             \
    200 /* of handles and obstacles towards their places, if contact stops them */
#define APPROACH_ITERATIONS 8
#define ARRIVED 1e-9 /* of the size: how near its place a held node must come */

typedef struct Static {
    Implicit *implicit;
    Explicit *engine; /* NULL: no lattice, no relaxation */
    State trial, kept;
    double *x_hat, *dx; /* (place_count x 3) */
    unsigned char *held;
} Static;

static bool create(const System *system, void **data, Error *error) {
    if (!stepper_stands_wind(system, "static", error)) {
        return false;
    }
    Static *s = arena_push(system->arena, Static, 1);
    s->implicit = implicit_create(system);
    s->engine = explicit_create(system);
    s->trial = state_allocate(system, system->arena);
    s->kept = state_allocate(system, system->arena);
    s->x_hat = arena_push(system->arena, double, 3 * system->place_count);
    s->dx = arena_push(system->arena, double, 3 * system->place_count);
    s->held = arena_push(system->arena, unsigned char, system->place_count);
    *data = s;
    return true;
}

static void destroy(void *data) { implicit_destroy(((Static *)data)->implicit); }

static void count(Statistics *statistics, const NewtonReport *report) {
    statistics->newton_iterations += report->iterations;
    statistics->factorisations += report->factorisations;
    statistics->residual = report->residual;
}

/* straight to equilibrium from the trial state; true when it got there */
static bool try_newton(Static *s, const System *system, Statistics *statistics) {
    NewtonParams params = newton_default();
    ImplicitTerms terms = {0};
    params.max_iterations = NEWTON_ITERATIONS;
    params.min_iterations = 0;
    params.tolerance = EQUILIBRIUM * system->weight;
    params.cut = implicit_has_contact(s->implicit);
    state_copy(system, &s->kept, &s->trial);
    implicit_begin(s->implicit, s->held, &s->kept);
    NewtonReport report = implicit_solve(s->implicit, &terms, &params, NULL, s->trial.x);
    count(statistics, &report);
    if (report.status == NEWTON_CONVERGED) {
        return true;
    }
    state_copy(system, &s->trial, &s->kept);
    return false;
}

static void relax(Static *s, const System *system, Statistics *statistics) {
    double dt = system->scene->solver.courant * explicit_limit(s->engine, false);
    ExplicitRun run = {.steps = RELAX_STEPS,
                       .dt = dt,
                       .kinetic_damping = true,
                       .kinetic_target = RELAX_TARGET * system->weight * system->size};
    state_copy(system, &s->kept, &s->trial);
    ExplicitResult result = explicit_interval(s->engine, &run, &s->trial);
    statistics->steps += result.steps;
    if (!result.finite) {
        state_copy(system, &s->trial, &s->kept);
    }
}

/* minimises 1/(2 dt^2) |x - x_n|_M^2 + W - f.x step by step; dt grows while it goes well */
static bool pseudo_time(Static *s, const System *system, Statistics *statistics) {
    double dt = PSEUDO_STEP;
    size_t bytes = 3 * (size_t)system->place_count * sizeof(double);
    for (int k = 0; k < PSEUDO_STEPS && !step_interrupted; k++) {
        NewtonParams params = newton_default();
        params.tolerance = EQUILIBRIUM * system->weight;
        params.longest_move = LONGEST_MOVE * system->size;
        params.cut = implicit_has_contact(s->implicit);
        memcpy(s->x_hat, s->trial.x, bytes);
        ImplicitTerms terms = {.acceleration = 1.0 / (dt * dt), .x_hat = s->x_hat};
        state_copy(system, &s->kept, &s->trial);
        implicit_begin(s->implicit, s->held, &s->kept);
        NewtonReport report = implicit_solve(s->implicit, &terms, &params, NULL, s->trial.x);
        count(statistics, &report);
        bool good = report.status == NEWTON_CONVERGED ||
                    (report.status == NEWTON_STOPPED && report.residual < 1e-2 * system->weight);
        if (!good) {
            state_copy(system, &s->trial, &s->kept);
            dt *= 0.4;
            continue;
        }
        implicit_store_contact(s->implicit, s->trial.x, &s->trial);
        if (implicit_residual(s->implicit, s->held, &s->trial, s->trial.x) <=
            EQUILIBRIUM * system->weight) {
            return true;
        }
        dt *= report.iterations <= 6 ? 2.0 : report.iterations > 10 ? 0.6 : 1.0;
    }
    return false;
}

/* one motion of handles and obstacles towards their places, as far as contact lets them; true when
 * all got there */
static bool approach_once(Static *s, const System *system, double time_end) {
    double *x = s->trial.x, farthest = 0.0;
    memcpy(s->x_hat, x, 3 * (size_t)system->place_count * sizeof *x);
    system_place_held(system, time_end, s->x_hat);
    for (int k = 0; k < 3 * system->place_count; k++) {
        s->dx[k] = s->x_hat[k] - x[k];
    }
    state_copy(system, &s->kept, &s->trial);
    implicit_begin(s->implicit, s->held, &s->kept);
    implicit_drive(s->implicit, time_end, INFINITY);
    implicit_clamp(s->implicit, s->kept.x, s->dx, NULL);
    for (int k = 0; k < 3 * system->place_count; k++) {
        x[k] += s->dx[k];
        farthest = s->held[k / 3] ? fmax(farthest, fabs(s->x_hat[k] - x[k])) : farthest;
    }
    implicit_store_contact(s->implicit, x, &s->trial);
    bool arrived = farthest <= ARRIVED * system->size;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        arrived = arrived && (!obstacle->moves || s->trial.contact.clocks[o] >= time_end);
    }
    return arrived;
}

/* handles and obstacles to their places of time_end; what is in their way yields */
static bool approach_to(Static *s, const System *system, double time_end, Statistics *statistics) {
    if (!implicit_has_contact(s->implicit)) {
        system_place_held(system, time_end, s->trial.x);
        return true;
    }
    for (int k = 0; k < APPROACH_STEPS && !step_interrupted; k++) {
        if (approach_once(s, system, time_end)) {
            return true;
        }
        NewtonParams params = newton_default();
        params.max_iterations = APPROACH_ITERATIONS;
        params.tolerance = EQUILIBRIUM * system->weight;
        params.longest_move = LONGEST_MOVE * system->size;
        params.definite = params.plain = params.cut = true;
        memcpy(s->x_hat, s->trial.x, 3 * (size_t)system->place_count * sizeof(double));
        ImplicitTerms terms = {.acceleration = 1.0 / (PSEUDO_STEP * PSEUDO_STEP),
                               .x_hat = s->x_hat};
        state_copy(system, &s->kept, &s->trial);
        implicit_begin(s->implicit, s->held, &s->kept);
        NewtonReport report = implicit_solve(s->implicit, &terms, &params, NULL, s->trial.x);
        count(statistics, &report);
        if (report.status == NEWTON_DIVERGED || report.status == NEWTON_SINGULAR) {
            return false;
        }
        implicit_store_contact(s->implicit, s->trial.x, &s->trial);
    }
    return false;
}

/* ... in as many motions as the turns of the obstacles need */
static bool approach(Static *s, const System *system, double from, double time_end,
                     Statistics *statistics) {
    int pieces = (int)fmax(1.0, ceil(implicit_turns(system, from, time_end)));
    bool arrived = true;
    for (int k = 1; k <= pieces && arrived; k++) {
        double time = k < pieces ? from + k * (time_end - from) / pieces : time_end;
        arrived = approach_to(s, system, time, statistics);
    }
    return arrived;
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    Static *s = data;
    state_copy(system, &s->trial, state);
    s->trial.time = time_end;
    system_mark_held(system, time_end, s->held);
    memset(s->trial.v, 0, 3 * (size_t)system->place_count * sizeof(double));
    if (!approach(s, system, state->time, time_end, statistics) && !step_interrupted) {
        return error_set(error, EXIT_DIFFERS,
                         "static: cloth in contact keeps handles or obstacles from where they "
                         "belong at t = %g s",
                         time_end);
    }
    bool done = try_newton(s, system, statistics);
    for (int round = 0; round < 2 && !done && !step_interrupted; round++) {
        relax(s, system, statistics);
        done = try_newton(s, system, statistics);
    }
    done = done || pseudo_time(s, system, statistics);
    if (step_interrupted) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    if (!done) {
        double residual = implicit_residual(s->implicit, s->held, state, state->x);
        return error_set(error, EXIT_DIFFERS,
                         "static: no equilibrium found at t = %g s; where it started the forces "
                         "were out of balance by %.2g of the weight",
                         time_end, residual / system->weight);
    }
    implicit_store_contact(s->implicit, s->trial.x, &s->trial);
    state_copy(system, state, &s->trial);
    return true;
}

const Stepper stepper_static = {
    .name = "static",
    .about = "equilibrium at every output time: kinetic damping, then mixed-point Newton",
    .implicit = true,
    .create = create,
    .advance = advance,
    .destroy = destroy,
};
