/* choose.c: the rule of `stepper: auto`: the road that costs less, where both keep a film right
 * (make bench SUITE=auto), and equilibrium at once where only the end is seen. */
#include "sim/step/choose.h"

#include <math.h>
#include <string.h>

#include "sim/step/stepper.h"

/* ---- cost ---- */

/* [ns] per node and explicit step */
#define SWEEP_NS 17.0  /* of a lattice with a vectorised sweep, whole */
#define BESIDE_NS 20.0 /* of any other: all but its forces */
#define SCATTERED_NS 200.0
#define UNKNOWN_NS 100.0  /* forces of a model that is not in the table */
#define FRICTION_NS 250.0 /* of yarns that stick and slip */
#define OBSTACLE_NS 200.0
#define SELF_NS 12.0         /* flat panels: nothing is near */
#define SELF_WRAPPED_NS 75.0 /* sleeves: the other side always is */
/* implicit: an iteration is a factorisation; ITERATIONS_EXTRA counts those that are taken back */
#define FACTOR_NS 400.0 /* times nodes^1.35: 17 ms at 2601 nodes */
#define FACTOR_POWER 1.35
#define FACTOR_SCATTERED 9.5 /* fuller matrices, longer rows */
#define ITERATIONS_EXTRA 1.5
#define ITERATIONS_CONTACT 10.0 /* times more where cloth meets an obstacle */

static const struct {
    const char *model;
    double ns; /* forces, per node */
} forces[] = {{"springs", 50.0}, {"particles", 31.0}, {"triangles", 156.0}, {"mlpg", 31.0}};

static double forces_ns(const Cloth *cloth) {
    if (cloth->panel.nu == 0 && strcmp(cloth->model->name, "mlpg") == 0) {
        return SCATTERED_NS;
    }
    for (size_t k = 0; k < sizeof forces / sizeof *forces; k++) {
        if (strcmp(forces[k].model, cloth->model->name) == 0) {
            return forces[k].ns;
        }
    }
    return UNKNOWN_NS;
}

static double explicit_ns(const System *system, const Cloth *cloth) {
    double ns = cloth->lattice ? SWEEP_NS : BESIDE_NS + forces_ns(cloth);
    ns += cloth->friction ? FRICTION_NS : 0.0;
    ns += system->contact.obstacle_count > 0 ? OBSTACLE_NS : 0.0;
    return ns + (!system->contact.self ? 0.0 : cloth->panel.wrap ? SELF_WRAPPED_NS : SELF_NS);
}

double choose_explicit_cost(const System *system) {
    double ns = 0.0;
    for (int c = 0; c < system->cloth_count; c++) {
        ns += system->cloths[c].node_count * explicit_ns(system, &system->cloths[c]);
    }
    return 1e-9 * ns;
}

double choose_implicit_cost(const System *system) {
    double ns = 0.0;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        ns += FACTOR_NS * pow(cloth->node_count, FACTOR_POWER) *
              (cloth->panel.nu > 0 ? 1.0 : FACTOR_SCATTERED);
    }
    ns *= ITERATIONS_EXTRA * system->scene->solver.newton_iterations;
    return 1e-9 * ns * (system->contact.obstacle_count > 0 ? ITERATIONS_CONTACT : 1.0);
}

/* ---- the rule ---- */

/* Implicit steps are right to 1 % where explicit ones are to 0.01 %, and know no damping inside the
 * fabric: explicit ones must cost so much more before they are given up */
#define WORTH_ERROR 1.3
#define WORTH_DAMPING 4.0
/* amplitude / amplitude at the start below which cloth counts as settled: exp(-this) */
#define SETTLED 8.0

/* Does the film show nothing between its first and its last frame, long after all motion has died
 * away? Only where one equilibrium is as good as the path to it: no contact, no memory. */
static bool shows_equilibrium_only(const System *system) {
    const Scene *scene = system->scene;
    double gravity = vec3_length(scene->gravity), seconds = 1.0 / scene->film.rate;
    if (scene->film.frame_count != 2 || system_has_contact(system) || system->handle_count == 0 ||
        vec3_length(scene->air.wind) > 0.0) {
        return false;
    }
    for (int h = 0; h < system->handle_count; h++) {
        const HandleDef *def = system->handles[h].def;
        if (motion_end(&def->motion) > 0.0 || isfinite(def->release)) {
            return false;
        }
    }
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        /* a pendulum as long as the scene dies like exp(-c t/2), or creeps like exp(-w^2 t/c) */
        double damping = cloth->def->damping, slow = gravity / system->size;
        if (damping <= 0.0 || cloth->friction ||
            fmin(0.5 * damping, slow / damping) * seconds < SETTLED) {
            return false;
        }
    }
    return true;
}

static double implicit_worth(const System *system) {
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        bool knows = cloth->lattice || cloth->model->fastest;
        if (knows && (cloth->def->bending_damping > 0.0 || cloth->def->membrane_damping > 0.0)) {
            return WORTH_DAMPING;
        }
    }
    return WORTH_ERROR;
}

static bool obstacle_moves(const System *system) {
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        if (system->contact.obstacles[o].moves) {
            return true;
        }
    }
    return false;
}

const Stepper *stepper_choose(const System *system, const char **why) {
    const SolverDef *solver = &system->scene->solver;
    if (strcmp(solver->stepper, "auto") != 0) {
        *why = "the scene asks for it";
        return stepper_find(solver->stepper);
    }
    if (obstacle_moves(system)) {
        *why = "an obstacle moves: short explicit steps follow it closely";
        return &stepper_central;
    }
    if (system->contact.impulses) {
        *why = "contact by impulses needs explicit steps";
        return &stepper_central;
    }
    if (shows_equilibrium_only(system)) {
        *why = "the film shows but the end, long after the cloth has settled";
        return &stepper_static;
    }
    double limit = solver->courant * system_scaled_step(system);
    bool shorter = solver->step > 0.0 && solver->step < limit;
    double explicit_rate = choose_explicit_cost(system) / (shorter ? solver->step : limit);
    double long_step = solver->step > 0.0 ? solver->step : CHOOSE_IMPLICIT_STEP;
    if (explicit_rate > implicit_worth(system) * choose_implicit_cost(system) / long_step) {
        *why = "explicit steps would be so short that a few long implicit ones cost less";
        return &stepper_bdf2;
    }
    *why = "explicit steps cost least at this stiffness";
    return &stepper_central;
}
