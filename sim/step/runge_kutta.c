/* runge_kutta.c: explicit Runge-Kutta steppers from their tableaux, for comparison: forward Euler,
 * midpoint, the classical fourth order, and Dormand-Prince 5(4) with error control.
 *
 * They follow free cloth: held nodes, weight, air drag and damping, but no contact, whose guards
 * belong to the other steppers. Each has a limit, as a share of that of central differences, from
 * where its polynomial leaves the unit circle on the imaginary axis; forward Euler and midpoint
 * leave it at once, and take so short steps that what they gain stays small. */
#include <math.h>
#include <string.h>

#include "sim/step/air.h"
#include "sim/step/stepper.h"

enum { MOST_STAGES = 7 };

typedef struct Tableau {
    int stages;
    double c[MOST_STAGES];
    double a[MOST_STAGES][MOST_STAGES];
    double b[MOST_STAGES];
    double e[MOST_STAGES]; /* b minus that of the embedded solution; all 0: no error control */
    double limit;          /* longest step / stability limit of central differences */
} Tableau;

static const Tableau forward_euler = {.stages = 1, .b = {1}, .limit = 0.01};
static const Tableau midpoint = {
    .stages = 2, .c = {0, 0.5}, .a = {{0}, {0.5}}, .b = {0, 1}, .limit = 0.1};
static const Tableau rk4 = {.stages = 4,
                            .c = {0, 0.5, 0.5, 1},
                            .a = {{0}, {0.5}, {0, 0.5}, {0, 0, 1}},
                            .b = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6},
                            .limit = 1.414}; /* 2 sqrt(2) against 2 */
static const Tableau rk45 = {
    .stages = 7,
    .c = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1},
    .a = {{0},
          {1.0 / 5},
          {3.0 / 40, 9.0 / 40},
          {44.0 / 45, -56.0 / 15, 32.0 / 9},
          {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
          {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
          {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}},
    .b = {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
    .e = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40},
    .limit = 0.495}; /* 0.99 against 2 */

/* step control of rk45 */
#define CONTROL_SAFETY 0.9
#define CONTROL_LEAST 0.2 /* of the step before */
#define CONTROL_MOST 5.0

/* steps between two looks at the energy within an interval: one that has gained too much goes no
 * further, which the shortest steps of forward Euler would take minutes to */
#define JUDGE_EVERY 500

typedef struct RungeKutta {
    const Tableau *tableau;
    State trial;
    unsigned char *held;                               /* (place_count) */
    double *x, *v;                                     /* of a stage, of the new step */
    double *x_rate[MOST_STAGES], *v_rate[MOST_STAGES]; /* [m/s], [m/s2] (place_count x 3) */
    double *gradient, *gradient_before;                /* [N] */
    double *push;                                      /* [N] minus that of the air on faces */
    double power[MOST_STAGES];                         /* [W] that the air gives at each stage */
    double limit, step;                                /* [s] */
} RungeKutta;

static bool create(const System *system, const char *name, const Tableau *tableau, void **data,
                   Error *error) {
    if (system_has_contact(system)) {
        return stepper_refuse(system, name, "obstacles", "central", error);
    }
    RungeKutta *r = arena_push(system->arena, RungeKutta, 1);
    int n = 3 * system->place_count;
    r->tableau = tableau;
    r->trial = state_allocate(system, system->arena);
    r->held = arena_push(system->arena, unsigned char, system->place_count);
    r->x = arena_push(system->arena, double, n);
    r->v = arena_push(system->arena, double, n);
    r->gradient = arena_push(system->arena, double, n);
    r->gradient_before = arena_push(system->arena, double, n);
    r->push = arena_push(system->arena, double, n);
    for (int s = 0; s < tableau->stages; s++) {
        r->x_rate[s] = arena_push(system->arena, double, n);
        r->v_rate[s] = arena_push(system->arena, double, n);
    }
    r->limit = tableau->limit * system_stable_step(system);
    r->step = r->limit;
    *data = r;
    return true;
}

/* minus the push of the air on faces, into r->push; returns its power [W] */
static double find_push(RungeKutta *r, const System *system, const double *x, const double *v) {
    const AirDef *air = &system->scene->air;
    double power = 0.0;
    memset(r->push, 0, 3 * (size_t)system->place_count * sizeof *r->push);
    for (int c = 0; c < system->cloth_count && air_has_faces(air); c++) {
        size_t at = 3 * (size_t)system->first[c];
        power += air_add_gradient(air, &system->cloths[c], x + at, v + at, r->push + at);
    }
    return power;
}

/* rates at (x, v); those of held places are 0. Leaves the gradient in r->gradient. Returns the power [W]
 * that air gives. */
static double find_rates(RungeKutta *r, const System *system, const double *x, const double *v,
                         double *x_rate, double *v_rate) {
    const AirDef *air = &system->scene->air;
    double power = find_push(r, system, x, v);
    double g[3] = {system->scene->gravity.x, system->scene->gravity.y, system->scene->gravity.z};
    double wind[3] = {air->wind.x, air->wind.y, air->wind.z};
    memset(r->gradient, 0, 3 * (size_t)system->place_count * sizeof *r->gradient);
    system_add_gradient(system, x, r->gradient);
    for (int i = 0; i < system->place_count; i++) {
        for (int c = 0; c < 3; c++) {
            int k = 3 * i + c;
            double blown = air->drag * system->area[i] * wind[c];
            double force = blown - r->push[k] - r->gradient[k];
            bool held = r->held[i];
            power += held ? 0.0 : blown * v[k];
            x_rate[k] = held ? 0.0 : v[k];
            v_rate[k] = held ? 0.0 : g[c] + force / system->mass[i] - system->damping[i] * v[k];
        }
    }
    return power;
}

/* from + dt sum of weights times rates, into r->x and r->v; held places where they belong */
static void combine(RungeKutta *r, const System *system, const State *from, const double *weights,
                    int stages, double dt, double time) {
    for (int k = 0; k < 3 * system->place_count; k++) {
        double x = 0.0, v = 0.0;
        for (int s = 0; s < stages; s++) {
            x += weights[s] * r->x_rate[s][k];
            v += weights[s] * r->v_rate[s][k];
        }
        r->x[k] = from->x[k] + dt * x;
        r->v[k] = from->v[k] + dt * v;
    }
    system_place_held(system, time, r->x);
}

/* [m] how far the error of a step, by the embedded solution, puts a node wrong until the end of the
 * output interval: its position, or its velocity times `interval`. Positions alone would let the
 * fastest waves grow, which move by little. */
static double step_error(const RungeKutta *r, const System *system, double dt, double interval) {
    double worst = 0.0;
    for (int i = 0; i < system->place_count; i++) {
        double square[2] = {0.0, 0.0};
        for (int c = 0; c < 3; c++) {
            double x = 0.0, v = 0.0;
            for (int s = 0; s < r->tableau->stages; s++) {
                x += r->tableau->e[s] * r->x_rate[s][3 * i + c];
                v += r->tableau->e[s] * r->v_rate[s][3 * i + c];
            }
            square[0] += x * x, square[1] += interval * interval * v * v;
        }
        worst = max2(worst, max2(square[0], square[1]));
    }
    return dt * sqrt(worst);
}

/* one step from the trial state, into r->x and r->v */
static void take_stages(RungeKutta *r, const System *system, double dt) {
    const Tableau *t = r->tableau;
    const State *from = &r->trial;
    for (int s = 0; s < t->stages; s++) {
        const double *x = from->x, *v = from->v;
        if (s > 0) {
            combine(r, system, from, t->a[s], s, dt, from->time + t->c[s] * dt);
            x = r->x, v = r->v;
        }
        r->power[s] = find_rates(r, system, x, v, r->x_rate[s], r->v_rate[s]);
        if (s == 0) {
            memcpy(r->gradient_before, r->gradient,
                   3 * (size_t)system->place_count * sizeof *r->gradient);
        }
    }
    combine(r, system, from, t->b, t->stages, dt, from->time + dt);
}

/* [J] that air gave in the step */
static double air_work(const RungeKutta *r, double dt) {
    double work = 0.0;
    for (int k = 0; k < r->tableau->stages; k++) {
        work += dt * r->tableau->b[k] * r->power[k];
    }
    return work;
}

/* the step becomes the state; returns the work [J] that handles did in it, by the mean force */
static double accept(RungeKutta *r, const System *system, double dt) {
    State *s = &r->trial;
    double work = 0.0;
    memset(r->gradient, 0, 3 * (size_t)system->place_count * sizeof *r->gradient);
    bool moves = false;
    for (int k = 0; k < 3 * system->place_count; k++) {
        moves = moves || (r->held[k / 3] && r->x[k] != s->x[k]);
    }
    if (moves) {
        system_add_gradient(system, r->x, r->gradient);
    }
    for (int k = 0; k < 3 * system->place_count; k++) {
        if (r->held[k / 3]) {
            double moved = r->x[k] - s->x[k];
            work += 0.5 * (r->gradient[k] + r->gradient_before[k]) * moved;
            r->v[k] = moved / dt;
        }
    }
    memcpy(s->x, r->x, 3 * (size_t)system->place_count * sizeof *s->x);
    memcpy(s->v, r->v, 3 * (size_t)system->place_count * sizeof *s->v);
    s->time += dt;
    return work;
}

static double total_energy(const RungeKutta *r, const System *system, double *scale) {
    const State *s = &r->trial;
    double moving = system_kinetic_energy(system, s->v, r->held);
    double elastic = system_elastic_energy(system, s->x);
    *scale = fmax(*scale, moving + elastic);
    return moving + elastic + system_gravity_energy(system, s->x, r->held);
}

/* Steps of at most `longest` to time_end; *gain: energy beyond the work done, over that which may
 * come from nowhere. */
static bool run(RungeKutta *r, const System *system, double longest, double time_end,
                Statistics *statistics, double *gain) {
    bool controlled = r->tableau->e[0] != 0.0;
    double tolerance = system->scene->solver.tolerance, scale = 0.0, work = 0.0, blown = 0.0;
    double before = total_energy(r, system, &scale), shortest = 1e-6 * r->limit;
    double interval = time_end - r->trial.time;
    int taken = 0;
    *gain = 0.0;
    r->step = fmin(r->step, longest);
    while (r->trial.time < time_end && !step_interrupted) {
        double left = time_end - r->trial.time;
        double dt = controlled ? r->step : longest;
        dt = left / ceil(left / dt - 1e-9);
        bool last = dt >= left * (1.0 - 1e-9);
        take_stages(r, system, dt);
        statistics->steps++;
        statistics->step_length = dt;
        if (controlled) {
            double error = step_error(r, system, dt, interval);
            double factor = CONTROL_SAFETY * pow(tolerance / fmax(error, 1e-300), 0.2);
            factor = isfinite(error) ? fmin(CONTROL_MOST, fmax(CONTROL_LEAST, factor)) : 0.1;
            r->step = fmin(longest, dt * factor);
            if (!(error <= tolerance)) {
                statistics->retries++;
                if (r->step < shortest) {
                    return false;
                }
                continue;
            }
        }
        blown += air_work(r, dt);
        work += accept(r, system, dt);
        r->trial.time = last ? time_end : r->trial.time;
        if (++taken % JUDGE_EVERY == 0 || last) {
            double after = total_energy(r, system, &scale);
            *gain = after - before - work - blown - STEP_ENERGY_TOLERANCE * scale;
            if (!isfinite(after) || *gain > 0.0) {
                return false;
            }
        }
    }
    statistics->work += work;
    statistics->drag -= blown;
    return *gain <= 0.0;
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    RungeKutta *r = data;
    const SolverDef *solver = &system->scene->solver;
    double longest = solver->courant * r->limit, gain = 0.0, work = statistics->work;
    if (solver->step > 0.0) {
        longest = fmin(longest, solver->step);
    }
    for (int halvings = 0; halvings <= STEP_MAX_HALVINGS; halvings++) {
        state_copy(system, &r->trial, state);
        system_mark_held(system, state->time, r->held);
        bool good = run(r, system, longest, time_end, statistics, &gain);
        if (step_interrupted) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        if (good) {
            state_copy(system, state, &r->trial);
            return true;
        }
        statistics->retries++;
        statistics->work = work;
        longest *= 0.5;
    }
    return error_set(error, EXIT_DIFFERS,
                     "%s: no step down to %.2g s keeps the energy from t = %g s on",
                     solver->stepper, longest, state->time);
}

#define RUNGE_KUTTA(tableau, text)                                                                 \
    static bool create_##tableau(const System *system, void **data, Error *error) {                \
        return create(system, #tableau, &(tableau), data, error);                                  \
    }                                                                                              \
    const Stepper stepper_##tableau = {                                                            \
        .name = #tableau, .about = text, .create = create_##tableau, .advance = advance}

RUNGE_KUTTA(forward_euler, "forward Euler at 0.01 of the limit; always gains energy");
RUNGE_KUTTA(midpoint, "explicit midpoint at 0.1 of the limit; gains energy slowly");
RUNGE_KUTTA(rk4, "classical Runge-Kutta of fourth order");
RUNGE_KUTTA(rk45, "Dormand-Prince 5(4) with error control (solver: tolerance)");
