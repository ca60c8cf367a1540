/* relaxation.c: dynamic relaxation: equilibrium at every output time without solving a matrix.
 *
 * Each place gets a fictitious mass from the rows of the stiffness, so that steps of length 1 are
 * stable everywhere; velocities are set to zero whenever the kinetic energy falls. For comparison
 * with `static`; free cloth only. */
#include <math.h>
#include <string.h>

#include "sim/step/implicit.h"
#include "sim/step/stepper.h"

/* mass / absolute row sum of the stiffness: 0.25 is the limit of stability for the K of the moment
 * (Gershgorin: largest frequency^2 <= 1 / share < 4); the rest is for what stiffens until the next
 * look at K: at 0.55 a sheet hung by two corners takes 30 times the steps */
#define MASS_SHARE 1.0
#define LOOK_EVERY 20    /* steps between two looks at K, at least */
#define EQUILIBRIUM 1e-6 /* of the weight: residual, as `static` has it */
#define MOST_STEPS 400000
/* Every rest must be lower than the one before. Where it is not, cloth has stiffened too much under
 * way: back to the rest before with heavier masses. */
#define HEAVIER 4.0
#define LIGHTER 0.5          /* towards the masses above, at every rest that is lower */
#define HEAVIEST 1e12        /* times the masses above: nothing helps */
#define ENERGY_ROUNDING 1e-9 /* of weight * size */

typedef struct Relaxation {
    Implicit *implicit;
    State trial;
    double *mass;     /* [N/m] per step^2; (place_count) */
    double *rest;     /* [m] (place_count x 3) positions of the last rest */
    double lowest;    /* [J] there */
    double heavier;   /* factor on the masses; 1 */
    double *gradient; /* [N] (place_count x 3) */
    unsigned char *held;
} Relaxation;

static bool create(const System *system, void **data, Error *error) {
    if (system_has_contact(system)) {
        return stepper_refuse(system, "relaxation", "obstacles", "static", error);
    }
    if (!stepper_stands_wind(system, "relaxation", error)) {
        return false;
    }
    Relaxation *r = arena_push(system->arena, Relaxation, 1);
    r->implicit = implicit_create(system);
    r->trial = state_allocate(system, system->arena);
    r->mass = arena_push(system->arena, double, system->place_count);
    r->rest = arena_push(system->arena, double, 3 * system->place_count);
    r->gradient = arena_push(system->arena, double, 3 * system->place_count);
    r->held = arena_push(system->arena, unsigned char, system->place_count);
    *data = r;
    return true;
}

static void destroy(void *data) { implicit_destroy(((Relaxation *)data)->implicit); }

/* r->mass from the largest absolute row sum of each place */
static void find_mass(Relaxation *r, const System *system, const NewtonProblem *problem) {
    const BlockMatrix *m = problem->matrix;
    problem->keep_stress(problem->context, r->trial.x, NULL);
    problem->tangent(problem->context, r->trial.x, true);
    double *sums = r->gradient; /* of scalar rows, in elimination order */
    memset(sums, 0, 3 * (size_t)m->node_count * sizeof *sums);
    for (int column = 0; column < 3 * m->node_count; column++) {
        for (int k = m->scalar_start[column]; k < m->scalar_start[column + 1]; k++) {
            int row = m->scalar_row[k];
            double size = fabs(m->values[k]);
            if (row >= column) {
                sums[row] += size;
                sums[column] += row > column ? size : 0.0;
            }
        }
    }
    for (int i = 0; i < system->place_count; i++) {
        const double *s = sums + 3 * m->order[i];
        r->mass[i] = MASS_SHARE * fmax(s[0], fmax(s[1], s[2]));
    }
}

/* One step of length 1; returns the kinetic energy, *residual of the start of the step [N]. From
 * rest the velocity after half a step is half a kick: a whole one starts outside the amplitude, and
 * a rest every three steps then drives the fast modes (by 8 % a time at frequency^2 = 0.9). */
static double take_step(Relaxation *r, const System *system, const NewtonProblem *problem,
                        bool from_rest, double *residual) {
    State *s = &r->trial;
    double kinetic = 0.0, sum = 0.0, kick = from_rest ? 0.5 : 1.0;
    problem->gradient(problem->context, s->x, r->gradient);
    for (int k = 0; k < 3 * system->place_count; k++) {
        if (r->held[k / 3]) {
            continue;
        }
        double g = r->gradient[k], mass = r->heavier * r->mass[k / 3];
        s->v[k] -= kick * g / mass;
        s->x[k] += s->v[k];
        kinetic += 0.5 * mass * s->v[k] * s->v[k];
        sum += g * g;
    }
    *residual = sqrt(sum);
    return kinetic;
}

/* The cloth rests where it is, if that is lower than the rest before; else it goes back there, *back.
 * False: nothing helps. */
static bool come_to_rest(Relaxation *r, const System *system, const NewtonProblem *problem,
                         bool *back) {
    size_t bytes = 3 * (size_t)system->place_count * sizeof(double);
    double now = problem->energy(problem->context, r->trial.x);
    *back = !(now <= r->lowest + ENERGY_ROUNDING * system->weight * system->size);
    memset(r->trial.v, 0, bytes);
    if (*back) {
        memcpy(r->trial.x, r->rest, bytes);
        r->heavier *= HEAVIER;
        return r->heavier <= HEAVIEST;
    }
    memcpy(r->rest, r->trial.x, bytes);
    r->lowest = now;
    r->heavier = fmax(1.0, LIGHTER * r->heavier);
    return true;
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    Relaxation *r = data;
    size_t bytes = 3 * (size_t)system->place_count * sizeof(double);
    double tolerance = EQUILIBRIUM * system->weight, residual = INFINITY, kinetic = 0.0;
    ImplicitTerms terms = {0};
    state_copy(system, &r->trial, state);
    memset(r->trial.v, 0, bytes);
    system_mark_held(system, time_end, r->held);
    system_place_held(system, time_end, r->trial.x);
    NewtonProblem problem = implicit_problem(r->implicit, &terms, r->held, &r->trial);
    int step = 0;
    int looked = -LOOK_EVERY;
    r->lowest = INFINITY;
    r->heavier = 1.0;
    bool back, good = come_to_rest(r, system, &problem, &back);
    for (; good && step < MOST_STEPS && residual > tolerance && !step_interrupted; step++) {
        /* only at rest: a mass that changes under way gives or takes energy */
        if (kinetic == 0.0 && step - looked >= LOOK_EVERY) {
            find_mass(r, system, &problem);
            looked = step;
        }
        double now = take_step(r, system, &problem, kinetic == 0.0, &residual);
        bool rests = !(now >= kinetic) || !isfinite(now);
        if (rests) {
            good = come_to_rest(r, system, &problem, &back);
            residual = back ? INFINITY : residual;
        }
        kinetic = rests ? 0.0 : now;
    }
    statistics->steps += step;
    statistics->residual = residual;
    if (step_interrupted) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    if (!(residual <= tolerance)) {
        return error_set(
            error, EXIT_DIFFERS,
            "relaxation: no equilibrium within %d steps at t = %g s; forces are out of "
            "balance by %.2g of the weight",
            step, time_end, residual / system->weight);
    }
    memset(r->trial.v, 0, bytes);
    state_copy(system, state, &r->trial);
    state->time = time_end;
    return true;
}

const Stepper stepper_relaxation = {
    .name = "relaxation",
    .about = "equilibrium at every output time by dynamic relaxation with mass scaling",
    .implicit = true,
    .create = create,
    .advance = advance,
    .destroy = destroy,
};
