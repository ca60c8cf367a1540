/* one_solve.c: backward Euler with a single linear solve a step, from where the cloth stands:
 *     (M/dt2 + K) dx = M v/dt + f(x)
 * (Baraff, Witkin 1998). First order and strongly damping; for comparison. Free cloth only. */
#include <math.h>
#include <string.h>

#include "sim/step/implicit.h"
#include "sim/step/stepper.h"

#define USUAL_STEP (1.0 / 60.0) /* [s] */

typedef struct OneSolve {
    Implicit *implicit;
    State trial;
    double *x_hat, *v_hat; /* (place_count x 3) */
    unsigned char *held;
} OneSolve;

static bool create(const System *system, void **data, Error *error) {
    if (system_has_contact(system)) {
        return stepper_refuse(system, "one_solve", "obstacles", "backward_euler", error);
    }
    OneSolve *o = arena_push(system->arena, OneSolve, 1);
    o->implicit = implicit_create(system);
    o->trial = state_allocate(system, system->arena);
    o->x_hat = arena_push(system->arena, double, 3 * system->place_count);
    o->v_hat = arena_push(system->arena, double, 3 * system->place_count);
    o->held = arena_push(system->arena, unsigned char, system->place_count);
    *data = o;
    return true;
}

static void destroy(void *data) { implicit_destroy(((OneSolve *)data)->implicit); }

static bool take_step(OneSolve *o, const System *system, double dt, Statistics *statistics) {
    State *s = &o->trial;
    int n = 3 * system->place_count;
    for (int k = 0; k < n; k++) {
        o->x_hat[k] = s->x[k] + dt * s->v[k];
        o->v_hat[k] = -s->x[k] / dt;
    }
    ImplicitTerms terms = {.acceleration = 1.0 / (dt * dt),
                           .x_hat = o->x_hat,
                           .velocity = 1.0 / dt,
                           .step = dt,
                           .v_hat = o->v_hat};
    NewtonParams params = newton_default();
    params.max_iterations = 1;
    params.tolerance = 0.0;
    system_mark_held(system, s->time + dt, o->held);
    implicit_begin(o->implicit, o->held, s);
    system_place_held(system, s->time + dt, s->x);
    NewtonReport report = implicit_solve(o->implicit, &terms, &params, NULL, s->x);
    for (int k = 0; k < n; k++) {
        s->v[k] = s->x[k] / dt + o->v_hat[k];
    }
    s->time += dt;
    statistics->steps++;
    statistics->step_length = dt;
    statistics->newton_iterations += report.iterations;
    statistics->factorisations += report.factorisations;
    statistics->residual = report.residual;
    return report.status != NEWTON_DIVERGED && report.status != NEWTON_SINGULAR;
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    OneSolve *o = data;
    double interval = time_end - state->time;
    double wished = system->scene->solver.step > 0.0 ? system->scene->solver.step : USUAL_STEP;
    int steps = (int)fmax(1.0, ceil(interval / wished - 1e-9));
    for (int halvings = 0; halvings <= STEP_MAX_HALVINGS; halvings++, steps *= 2) {
        state_copy(system, &o->trial, state);
        bool good = true;
        for (int k = 0; k < steps && good && !step_interrupted; k++) {
            good = take_step(o, system, interval / steps, statistics);
        }
        if (step_interrupted) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        if (good && isfinite(system_elastic_energy(system, o->trial.x))) {
            state_copy(system, state, &o->trial);
            state->time = time_end;
            state->step_before = 0.0;
            return true;
        }
        statistics->retries++;
    }
    return error_set(error, EXIT_DIFFERS, "one_solve: no step down to %.2g s succeeds at t = %g s",
                     interval / steps, state->time);
}

const Stepper stepper_one_solve = {
    .name = "one_solve",
    .about = "backward Euler, one linear solve from where it stands (Baraff, Witkin 1998)",
    .implicit = true,
    .create = create,
    .advance = advance,
    .destroy = destroy,
};
