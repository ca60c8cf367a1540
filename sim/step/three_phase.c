/* three_phase.c: the dynamics of Breen, House, Wozny (1994, section 3). A step of dt has three phases:
 *   1. every particle falls alone, under gravity in a viscous medium of rate d:
 *        v1 = u + (v - u) exp(-d dt),  u = g / d,  x1 = x + dt v1
 *   2. a fixed number of sweeps of random moves (stochastic.h) lowers the energy of the fabric, from x1
 *      to x2
 *   3. the velocity follows: v = (x2 - x) / dt
 *
 * x1 takes the velocity of the end: then cloth at rest, x2 = x, has v = 0, and free fall the right v; its
 * height is that of symplectic Euler. What phase 2 lowers is one of two energies (`second_phase`).
 *
 * inertia:  W(x) + sum m |x - x1|^2 / (2 dt^2). Its least place is the step of backward Euler, so that the
 *   motion is that of the cloth, up to what the sweeps leave undone. They start from x1 or x, where it is
 *   lower: then W(x2) + m |x2 - x1|^2 / (2 dt^2) <= W(x) + m |v1|^2 / 2.
 * breen:  (3.1) of the paper, W(x) with gravity, without which hanging cloth would rest where the sweeps
 *   outweigh a step's fall and not where its weight does. It knows no time: how far phase 2 goes hangs on
 *   the number of sweeps alone, which must therefore be fixed, and the velocities of phase 3 on the step.
 *   Only where cloth comes to rest is right; with too few sweeps it explodes.
 *
 * Cloth that nothing holds has no lowest place: there gravity is for phase 1 alone. Moves one at a time do
 * not keep momentum; no force within cloth can change it, so what they moved the centre of mass of such
 * cloth is taken off again. An interval that gained energy is done again with half the step. */
#include <math.h>
#include <string.h>

#include "sim/step/stepper.h"
#include "sim/step/stochastic.h"

#define ENERGY_FLOOR 1e-3 /* of weight x size: what the first fall of flat cloth turns over */
#define THRESHOLD 1e-9    /* of weight x size, in the first sweep of a step; 0 in the last */

typedef struct ThreePhase {
    Stochastic *sweeps;
    State trial;
    double usual_step;     /* [s] */
    double *before;        /* [m] (place_count x 3) at the start of a step */
    double *start;         /* [m] (place_count x 3) where sweeps may start */
    double *gradient;      /* [N] (place_count x 3) */
    double work;           /* [J] of handles, in this interval */
    double *after_first;   /* [m] (place_count x 3) after phase 1 */
    unsigned char *judged; /* (place_count) held when an interval begins: not in its energies */
    unsigned char *hangs;  /* (cloth_count) something holds it */
} ThreePhase;

static bool create(const System *system, void **data, Error *error) {
    const AirDef *air = &system->scene->air;
    if (system_has_contact(system) || air_has_faces(air) || vec3_length(air->wind) > 0.0) {
        return stepper_refuse(system, "three_phase", "obstacles, wind, air on faces", NULL, error);
    }
    ThreePhase *p = arena_push(system->arena, ThreePhase, 1);
    p->sweeps = stochastic_create(system);
    p->trial = state_allocate(system, system->arena);
    p->usual_step = system->scene->solver.courant * system_stable_step(system);
    p->before = arena_push(system->arena, double, 3 * system->place_count);
    p->start = arena_push(system->arena, double, 3 * system->place_count);
    p->gradient = arena_push(system->arena, double, 3 * system->place_count);
    p->after_first = arena_push(system->arena, double, 3 * system->place_count);
    p->judged = arena_push(system->arena, unsigned char, system->place_count);
    p->hangs = arena_push(system->arena, unsigned char, system->cloth_count);
    *data = p;
    return true;
}

/* what handles hold at `time` */
static void find_held(ThreePhase *p, const System *system, double time) {
    Stochastic *s = p->sweeps;
    system_mark_held(system, time, s->held);
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        int first = system->first[c];
        p->hangs[c] = 0;
        for (int i = 0; i < cloth->node_count; i++) {
            p->hangs[c] |= s->held[first + i];
        }
        for (int i = first; i < system->first[c + 1]; i++) {
            s->weightless[i] = s->held[i] || !p->hangs[c] || !system->scene->solver.breen;
        }
    }
}

/* phase 1 */
static void fall(ThreePhase *p, const System *system, double dt) {
    const double g[3] = {system->scene->gravity.x, system->scene->gravity.y,
                         system->scene->gravity.z};
    for (int i = 0; i < system->place_count; i++) {
        double d = system->damping[i], lost = -expm1(-d * dt);
        double time = d > 0.0 ? lost / d : dt; /* of the fall that the medium leaves */
        for (int k = 3 * i; k < 3 * i + 3 && !p->sweeps->held[i]; k++) {
            double v = p->trial.v[k] * (1.0 - lost) + time * g[k % 3];
            p->trial.x[k] += dt * v;
        }
    }
    system_place_held(system, p->trial.time + dt, p->trial.x);
}

/* the centre of mass of free cloth back to where phase 1 left it */
static void keep_centre(ThreePhase *p, const System *system, int c) {
    Vec3 moved = {0, 0, 0};
    double mass = 0.0;
    for (int i = system->first[c]; i < system->first[c + 1]; i++) {
        Vec3 by = vec3_sub(vec3_load(p->trial.x + 3 * i), vec3_load(p->after_first + 3 * i));
        moved = vec3_axpy(moved, system->mass[i], by);
        mass += system->mass[i];
    }
    for (int i = system->first[c]; i < system->first[c + 1]; i++) {
        vec3_store(p->trial.x + 3 * i,
                   vec3_axpy(vec3_load(p->trial.x + 3 * i), -1.0 / mass, moved));
    }
}

/* phase 2; returns the energy [J] */
static double settle(ThreePhase *p, const System *system, double dt) {
    int sweeps = system->scene->solver.sweeps;
    size_t bytes = 3 * (size_t)system->place_count * sizeof(double);
    memcpy(p->after_first, p->trial.x, bytes);
    p->sweeps->anchor = system->scene->solver.breen ? NULL : p->after_first;
    p->sweeps->anchor_stiffness = 1.0 / (dt * dt);
    double most = THRESHOLD * system->weight * system->size;
    double energy = stochastic_energy(p->sweeps, p->trial.x);
    memcpy(p->start, p->before, bytes);
    system_place_held(system, p->trial.time + dt, p->start);
    double stay = stochastic_energy(p->sweeps, p->start);
    if (p->sweeps->anchor && !(energy <= stay)) {
        memcpy(p->trial.x, p->start, bytes);
        energy = stay;
    }
    stochastic_begin_step(p->sweeps, dt, p->trial.x);
    for (int k = 0; k < sweeps && isfinite(energy); k++) {
        double threshold = most * (sweeps - 1 - k) / sweeps;
        energy = stochastic_sweep(p->sweeps, threshold, energy, p->trial.x);
    }
    for (int c = 0; c < system->cloth_count; c++) {
        if (!p->hangs[c]) {
            keep_centre(p, system, c);
        }
    }
    return energy;
}

static bool take_step(ThreePhase *p, const System *system, double dt) {
    State *s = &p->trial;
    int n = 3 * system->place_count;
    memcpy(p->before, s->x, (size_t)n * sizeof *s->x);
    find_held(p, system, s->time + dt);
    fall(p, system, dt);
    double energy = settle(p, system, dt);
    memset(p->gradient, 0, (size_t)n * sizeof *p->gradient);
    system_add_gradient(system, s->x, p->gradient);
    for (int k = 0; k < n; k++) { /* phase 3 */
        double moved = s->x[k] - p->before[k];
        p->work += p->sweeps->held[k / 3] ? p->gradient[k] * moved : 0.0;
        s->v[k] = moved / dt;
    }
    s->time += dt;
    return isfinite(energy);
}

/* [J] and, in *scale, of what may turn over */
static double energy_of(const ThreePhase *p, const System *system, const State *s, double *scale) {
    double moving = system_kinetic_energy(system, s->v, p->judged);
    double elastic = system_elastic_energy(system, s->x);
    *scale = fmax(*scale, moving + elastic);
    return moving + elastic + system_gravity_energy(system, s->x, p->judged);
}

/* one interval; true when it is good */
static bool try_interval(ThreePhase *p, const System *system, const State *state, int steps,
                         double dt) {
    double scale = system->weight * system->size * ENERGY_FLOOR;
    state_copy(system, &p->trial, state);
    stochastic_begin(p->sweeps, 0.0, stochastic_seed(state->time));
    system_mark_held(system, state->time + dt, p->judged);
    double before = energy_of(p, system, state, &scale);
    p->work = 0.0;
    for (int k = 0; k < steps && !step_interrupted; k++) {
        if (!take_step(p, system, dt)) {
            return false;
        }
    }
    double after = energy_of(p, system, &p->trial, &scale);
    double allowed = STEP_ENERGY_TOLERANCE * scale;
    if (system->scene->solver.breen) { /* which keeps no energy: unless it explodes */
        allowed = fmax(scale, system->weight * system->size);
    }
    return after - before - p->work <= allowed;
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    ThreePhase *p = data;
    double interval = time_end - state->time;
    double wished = system->scene->solver.step > 0.0 ? system->scene->solver.step : p->usual_step;
    int steps = (int)fmax(1.0, ceil(interval / wished - 1e-9));
    for (int halvings = 0; halvings <= STEP_MAX_HALVINGS; halvings++, steps *= 2) {
        double dt = interval / steps;
        bool good = try_interval(p, system, state, steps, dt);
        if (step_interrupted) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        if (good) {
            statistics->steps += steps;
            statistics->step_length = dt;
            statistics->work += p->work;
            state_copy(system, state, &p->trial);
            state->time = time_end;
            state->step_before = 0.0;
            return true;
        }
        statistics->retries++;
    }
    return error_set(error, EXIT_DIFFERS,
                     "three_phase: no step down to %.2g s keeps the energy from t = %g s on",
                     2.0 * interval / steps, state->time);
}

const Stepper stepper_three_phase = {
    .name = "three_phase",
    .about = "free fall, random moves of nodes, velocity of both (Breen et al. 1994)",
    .sweep_cost = 25.0,
    .create = create,
    .advance = advance,
};
