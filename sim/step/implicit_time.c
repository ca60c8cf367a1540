/* implicit_time.c: BDF2 and backward Euler with a few mixed-point Newton iterations a step. */
#include <math.h>
#include <string.h>

#include "sim/step/explicit.h"
#include "sim/step/implicit.h"
#include "sim/step/stepper.h"

#ifdef __OPTIMIZE__
#define CHECK_LEGAL(implicit, from, to) ((void)0)
#else /* debug builds: nothing crosses in any state that is accepted, if nothing did before */
#define CHECK_LEGAL(implicit, from, to)                                                            \
    ASSERT(implicit_count_crossings(implicit, to) == 0 ||                                          \
           implicit_count_crossings(implicit, from) > 0)
#endif

#define USUAL_STEP (1.0 / 60.0) /* [s] 1 % on a 1 s swing by BDF2 with two iterations */
#define SETTLED_SHARE 1e-3      /* of the weight: a residual at which iterations stop early */
#define SINGLE_ITERATION 1      /* backward Euler with one iteration never gains energy */
/* with contact */
#define CONTACT_SETTLED_SHARE                                                                      \
    1e-4 /* of the weight: residual of a step; 1e-3 makes friction creep */
#define CONTACT_SETTLED_MOVE                                                                       \
    3e-4                          /* of the contact distance, of any place: settled too, where edges
                                      come and go between two contacts; 3e-3 hides a pull that is 1 %
                                      above friction */
#define CONTACT_LEAST_SHARE 0.5   /* ... if the clamp left so much of that motion */
#define CONTACT_ITERATIONS 20     /* then a shorter step is tried */
#define CONTACT_LONGEST_MOVE 0.18 /* of the size, of any place in one iteration */
#define CONTACT_UNSETTLED 1       /* halvings; more do not help where contacts come and go */
#define CONTACT_HALVINGS 4        /* then a step that gains energy is taken: it is legal */
#define GOOD_STEPS 4              /* after which a step that was halved is doubled */
/* of weight x size: energy that rounding may add to cloth at rest */
#define ENERGY_FLOOR 1e-9

typedef struct ImplicitTime {
    Implicit *implicit;
    bool second_order;
    State trial;
    double *x_hat, *v_hat, *dx, *gradient; /* (place_count x 3) */
    unsigned char *held, *euler;
    BarrierReport contacts;   /* of the last trial */
    double contact_energy[2]; /* [J] at its start and end */
    double lost;              /* [J] in it: what it had and was given, and has not */
    double drag;              /* [J] of that, by mass damping and air */
} ImplicitTime;

static bool create(const System *system, void **data, bool second_order, Error *error) {
    (void)error;
    ImplicitTime *time = arena_push(system->arena, ImplicitTime, 1);
    int n = 3 * system->place_count;
    time->implicit = implicit_create(system);
    time->second_order = second_order;
    time->trial = state_allocate(system, system->arena);
    time->x_hat = arena_push(system->arena, double, n);
    time->v_hat = arena_push(system->arena, double, n);
    time->dx = arena_push(system->arena, double, n);
    time->gradient = arena_push(system->arena, double, n);
    time->held = arena_push(system->arena, unsigned char, system->place_count);
    time->euler = arena_push(system->arena, unsigned char, system->place_count);
    *data = time;
    return true;
}

static bool create_bdf2(const System *system, void **data, Error *error) {
    return create(system, data, true, error);
}

static bool create_backward_euler(const System *system, void **data, Error *error) {
    return create(system, data, false, error);
}

static void destroy(void *data) { implicit_destroy(((ImplicitTime *)data)->implicit); }

/* x_hat, v_hat and coefficients of one step from `state` */
static ImplicitTerms discretise(const ImplicitTime *t, const System *system, const State *s,
                                double dt, bool bdf2) {
    int n = 3 * system->place_count;
    for (int k = 0; k < n; k++) {
        if (bdf2 && !t->euler[k / 3]) {
            t->x_hat[k] = (4.0 * s->x[k] - s->x_before[k]) / 3.0 +
                          (8.0 * s->v[k] - 2.0 * s->v_before[k]) * dt / 9.0;
            t->v_hat[k] = (s->x_before[k] - 4.0 * s->x[k]) / (2.0 * dt);
        } else {
            t->x_hat[k] = s->x[k] + dt * s->v[k];
            t->v_hat[k] = -s->x[k] / dt;
        }
    }
    return (ImplicitTerms){.acceleration = bdf2 ? 2.25 / (dt * dt) : 1.0 / (dt * dt),
                           .x_hat = t->x_hat,
                           .velocity = bdf2 ? 1.5 / dt : 1.0 / dt,
                           .v_hat = t->v_hat,
                           .euler = bdf2 ? t->euler : NULL,
                           .step = dt};
}

/* How one step is made. */
typedef struct Way {
    bool bdf2;
    bool safe; /* from standing still downhill in energy: backward Euler that way never gains any */
    int iterations;
} Way;

/* predictor x + dt v with handles at their targets, as far as contact lets it; marks the places
 * that it stops */
static void predict(ImplicitTime *t, const System *system, const State *from, double dt, bool safe,
                    double *x) {
    int n = 3 * system->place_count;
    for (int k = 0; k < n; k++) {
        x[k] = from->x[k] + (safe ? 0.0 : dt * from->v[k]);
    }
    system_place_held(system, from->time + dt, x);
    for (int k = 0; k < n; k++) {
        t->dx[k] = x[k] - from->x[k];
    }
    implicit_begin(t->implicit, t->held, from);
    implicit_drive(t->implicit, from->time + dt, dt);
    implicit_clamp(t->implicit, from->x, t->dx, t->euler);
    for (int k = 0; k < n; k++) {
        x[k] = from->x[k] + t->dx[k];
    }
}

static double total_energy(const ImplicitTime *t, const System *system, const State *s) {
    return system_kinetic_energy(system, s->v, t->held) + system_elastic_energy(system, s->x) +
           system_gravity_energy(system, s->x, t->held);
}

/* work of the handles: internal force on held places times their motion */
static double handle_work(const ImplicitTime *t, const System *system, const State *from,
                          const State *to) {
    double work = 0.0;
    for (int end = 0; end < 2; end++) {
        memset(t->gradient, 0, 3 * (size_t)system->place_count * sizeof(double));
        system_add_gradient(system, end == 0 ? from->x : to->x, t->gradient);
        for (int i = 0; i < 3 * system->place_count; i++) {
            work += t->held[i / 3] ? 0.5 * t->gradient[i] * (to->x[i] - from->x[i]) : 0.0;
        }
    }
    return work;
}

static bool any_euler(const ImplicitTime *t, const System *system) {
    return memchr(t->euler, 1, (size_t)system->place_count) != NULL;
}

static NewtonReport solve(ImplicitTime *t, const System *system, const State *from, double dt,
                          const Way *way, State *to) {
    NewtonParams params = newton_default();
    params.max_iterations = way->iterations;
    params.tolerance = SETTLED_SHARE * system->weight;
    predict(t, system, from, dt, way->safe, to->x);
    if (any_euler(t, system)) {
        params.definite = true;
        params.plain = true; /* predicted stress is no bound where contacts come and go */
        params.cut = !way->safe;
        params.descend = way->safe;
        params.short_move = CONTACT_SETTLED_MOVE * system->contact.distance;
        params.least_share = CONTACT_LEAST_SHARE;
        params.tolerance = CONTACT_SETTLED_SHARE * system->weight;
        params.max_iterations =
            way->iterations > CONTACT_ITERATIONS ? way->iterations : CONTACT_ITERATIONS;
        params.longest_move = CONTACT_LONGEST_MOVE * system->size;
    }
    ImplicitTerms terms = discretise(t, system, from, dt, way->bdf2);
    NewtonReport report = implicit_solve(t->implicit, &terms, &params, t->dx, to->x);
    for (int k = 0; k < 3 * system->place_count; k++) {
        bool euler = terms.euler && terms.euler[k / 3];
        to->v[k] = (euler ? 1.0 / dt : terms.velocity) * to->x[k] + t->v_hat[k];
    }
    return report;
}

/* Places that touch at the start, or that the clamp stops, take backward Euler.
 * A step that finds its first contact on the way is solved again with them. */
static NewtonReport try_step(ImplicitTime *t, const System *system, const State *from, double dt,
                             const Way *way, State *to) {
    system_mark_held(system, from->time + dt, t->held);
    implicit_begin(t->implicit, t->held, from);
    memset(t->euler, 0, (size_t)system->place_count);
    t->contact_energy[0] = implicit_contacts(t->implicit, from->x, t->euler, &t->contacts);
    if (way->safe) {
        memset(t->euler, 1, (size_t)system->place_count);
    }
    NewtonReport report = solve(t, system, from, dt, way, to);
    if (implicit_has_contact(t->implicit) && !any_euler(t, system)) {
        implicit_contacts(t->implicit, to->x, t->euler, &t->contacts);
        if (implicit_add_clamped(t->implicit, t->euler) || t->contacts.contacts > 0) {
            NewtonReport first = report;
            report = solve(t, system, from, dt, way, to);
            report.iterations += first.iterations;
            report.factorisations += first.factorisations;
        }
    }
    implicit_store_contact(t->implicit, to->x, to);
    t->contact_energy[1] = implicit_contacts(t->implicit, to->x, NULL, &t->contacts);
    to->time = from->time + dt;
    return report;
}

/* [J] taken by mass damping and drag, less what the wind does */
static double drag_work(const ImplicitTime *t, const System *system, const State *from,
                        const State *to) {
    const AirDef *air = &system->scene->air;
    double wind[3] = {air->wind.x, air->wind.y, air->wind.z}, work = 0.0;
    for (int i = 0; i < system->place_count; i++) {
        for (int a = 0; a < 3 && !t->held[i]; a++) {
            int k = 3 * i + a;
            double force = system->damping[i] * system->mass[i] * to->v[k] -
                           air->drag * system->area[i] * wind[a];
            work += force * (to->x[k] - from->x[k]);
        }
    }
    return work - implicit_air_work(t->implicit, to->x);
}

static bool good(ImplicitTime *t, const System *system, const State *from, const State *to,
                 const NewtonReport *report, double *work) {
    if (report->status == NEWTON_DIVERGED || report->status == NEWTON_SINGULAR) {
        return false;
    }
    double before = t->contact_energy[0] + total_energy(t, system, from);
    double after = t->contact_energy[1] + total_energy(t, system, to);
    double scale =
        system_kinetic_energy(system, to->v, t->held) + system_elastic_energy(system, to->x);
    *work = handle_work(t, system, from, to) + implicit_obstacle_work(t->implicit);
    t->lost = before + *work - after;
    t->drag = drag_work(t, system, from, to);
    return isfinite(after) && after - before <= *work + fmax(0.0, -t->drag) +
                                                    STEP_ENERGY_TOLERANCE * scale +
                                                    ENERGY_FLOOR * system->weight * system->size;
}

static bool in_contact(const ImplicitTime *t, const System *system) {
    return t->contacts.contacts > 0 || any_euler(t, system);
}

/* with contact a step must have settled, as far as shorter ones do */
static bool acceptable(ImplicitTime *t, const System *system, const State *from,
                       const NewtonReport *report, int halvings, double *work) {
    bool keeps_energy = good(t, system, from, &t->trial, report, work);
    return keeps_energy && (!in_contact(t, system) || report->status == NEWTON_CONVERGED ||
                            halvings >= CONTACT_UNSETTLED);
}

/* the last resort with contact: legal, finite, without energy of its own */
static bool step_safely(ImplicitTime *t, const System *system, const State *state, double dt,
                        NewtonReport *report, double *work) {
    Way way = {.safe = true, .iterations = CONTACT_ITERATIONS};
    state_copy(system, &t->trial, state);
    *report = try_step(t, system, state, dt, &way, &t->trial);
    good(t, system, state, &t->trial, report, work);
    return report->status != NEWTON_DIVERGED && report->status != NEWTON_SINGULAR &&
           isfinite(total_energy(t, system, &t->trial));
}

static void count_contacts(const ImplicitTime *t, Statistics *statistics) {
    if (!implicit_has_contact(t->implicit)) {
        return;
    }
    statistics->pairs += t->contacts.contacts;
    statistics->smallest_gap = fmin(statistics->smallest_gap, t->contacts.smallest_gap);
    statistics->smallest_self_gap =
        fmin(statistics->smallest_self_gap, t->contacts.smallest_self_gap);
}

static void count_iterations(Statistics *statistics, const NewtonReport *report) {
    statistics->newton_iterations += report->iterations;
    statistics->factorisations += report->factorisations;
    statistics->residual = report->residual;
}

static void accept(ImplicitTime *t, const System *system, State *state, double dt, double work,
                   Statistics *statistics) {
    CHECK_LEGAL(t->implicit, state->x, t->trial.x);
    count_contacts(t, statistics);
    double friction = implicit_friction(t->implicit);
    statistics->drag += t->drag;
    statistics->friction += friction;
    statistics->numerical += t->lost - t->drag - friction;
    size_t bytes = 3 * (size_t)system->place_count * sizeof(double);
    memcpy(t->trial.x_before, state->x, bytes);
    memcpy(t->trial.v_before, state->v, bytes);
    t->trial.step_before = dt;
    state_copy(system, state, &t->trial);
    statistics->steps++;
    statistics->work += work;
}

/* one step of dt: BDF2 when it can, else backward Euler, else fails */
static bool step(ImplicitTime *t, const System *system, State *state, double dt, int halvings,
                 Statistics *statistics) {
    int iterations = system->scene->solver.newton_iterations;
    bool bdf2 = t->second_order && fabs(state->step_before - dt) <= 1e-9 * dt;
    for (int attempt = 0; attempt < 2; attempt++) {
        double work = 0.0;
        Way way = {.bdf2 = bdf2 && attempt == 0,
                   .iterations = attempt == 0 ? iterations : SINGLE_ITERATION};
        state_copy(system, &t->trial, state);
        NewtonReport report = try_step(t, system, state, dt, &way, &t->trial);
        count_iterations(statistics, &report);
        bool accepted = acceptable(t, system, state, &report, halvings, &work);
        bool contact = in_contact(t, system);
        if (!accepted && contact && halvings >= CONTACT_HALVINGS) {
            accepted = step_safely(t, system, state, dt, &report, &work);
            count_iterations(statistics, &report);
        }
        if (accepted) {
            accept(t, system, state, dt, work, statistics);
            return true;
        }
        statistics->retries++;
        if (contact) {
            break; /* there a shorter step helps, fewer iterations do not */
        }
    }
    return false;
}

/* What yarns that slip turn to heat is stored until they do. */
static void commit(const System *system, State *state, Statistics *statistics) {
    bool slips = system->history_count > 0;
    double stored = slips ? system_elastic_energy(system, state->x) : 0.0;
    system_commit(system, state);
    statistics->fabric += slips ? stored - system_elastic_energy(system, state->x) : 0.0;
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    ImplicitTime *t = data;
    double wished = system->scene->solver.step > 0.0 ? system->scene->solver.step : USUAL_STEP;
    double interval = time_end - state->time;
    double steps_wished = fmax(interval / wished, implicit_turns(system, state->time, time_end));
    int steps = (int)fmax(1.0, ceil(steps_wished - 1e-9));
    int halvings = 0, good_steps = 0;
    double dt = interval / steps;
    system_load_history(system, state);
    while (steps > 0) {
        if (step_interrupted) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        statistics->step_length = dt;
        if (step(t, system, state, dt, halvings, statistics)) {
            commit(system, state, statistics);
            steps--;
            if (++good_steps >= GOOD_STEPS && halvings > 0 && steps % 2 == 0) {
                dt *= 2.0, steps /= 2, halvings--, good_steps = 0;
            }
        } else if (halvings++ == STEP_MAX_HALVINGS) {
            return error_set(error, EXIT_DIFFERS,
                             "no implicit step down to %.2g s succeeds at t = %g s", dt,
                             state->time);
        } else {
            dt *= 0.5, steps *= 2, good_steps = 0;
        }
    }
    state->time = time_end;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        double *clock = &state->contact.clocks[o];
        *clock = system->contact.obstacles[o].moves ? *clock : time_end;
        statistics->lag = fmax(statistics->lag, time_end - *clock);
    }
    return true;
}

const Stepper stepper_bdf2 = {
    .name = "bdf2",
    .about = "second-order backward differences, two mixed-point Newton iterations a step",
    .implicit = true,
    .history = true,
    .create = create_bdf2,
    .advance = advance,
    .destroy = destroy,
};

const Stepper stepper_backward_euler = {
    .name = "backward_euler",
    .about = "first order, strongly damping; mixed-point Newton",
    .implicit = true,
    .history = true,
    .create = create_backward_euler,
    .advance = advance,
    .destroy = destroy,
};
