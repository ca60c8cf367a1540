#include <stddef.h>
#include <string.h>

#include "sim/step/stepper.h"

volatile int step_interrupted = 0;

/* one line a stepper */
#define STEPPERS(STEPPER)                                                                          \
    STEPPER(central)                                                                               \
    STEPPER(bdf2)                                                                                  \
    STEPPER(backward_euler)                                                                        \
    STEPPER(static)                                                                                \
    STEPPER(symplectic_euler)                                                                      \
    STEPPER(forward_euler)                                                                         \
    STEPPER(midpoint)                                                                              \
    STEPPER(rk4)                                                                                   \
    STEPPER(rk45)                                                                                  \
    STEPPER(one_solve)                                                                             \
    STEPPER(relaxation)

#define DECLARE(name) extern const Stepper stepper_##name;
#define LIST(name) &stepper_##name,
STEPPERS(DECLARE)
const Stepper *const steppers[] = {STEPPERS(LIST) NULL};

/* [m2/s2] explicit pays below this wave speed squared of the membrane (explicit.md 7) */
#define AUTO_STIFFEST 2e6
/* the same for lattices without a vectorised sweep, whose explicit steps cost 5 times as much;
 * springs swing as fast by either road at 4e5 (make bench SUITE=swing) */
#define AUTO_STIFFEST_PLAIN 2e5

const Stepper *stepper_find(const char *name) {
    for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
        if (strcmp((*stepper)->name, name) == 0) {
            return *stepper;
        }
    }
    return NULL;
}

const Stepper *stepper_choose(const System *system, const char **why) {
    const char *name = system->scene->solver.stepper;
    if (strcmp(name, "auto") != 0) {
        *why = "the scene asks for it";
        return stepper_find(name);
    }
    double stiffest = 0.0;
    bool moving_obstacle = false, scattered = false;
    for (int c = 0; c < system->cloth_count; c++) {
        const Material *m = &system->cloths[c].material;
        double wave = (m->c11 > m->c22 ? m->c11 : m->c22) / m->density;
        double share = system->cloths[c].lattice ? 1.0 : AUTO_STIFFEST / AUTO_STIFFEST_PLAIN;
        stiffest = wave * share > stiffest ? wave * share : stiffest;
        scattered = scattered || system->cloths[c].panel.nu == 0;
    }
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        moving_obstacle = moving_obstacle || system->contact.obstacles[o].moves;
    }
    if (moving_obstacle) {
        *why = "an obstacle moves: short explicit steps follow it closely";
        return &stepper_central;
    }
    if (stiffest > AUTO_STIFFEST) {
        *why = "the cloth is so stiff that explicit steps would be too short";
        return &stepper_bdf2;
    }
    if (scattered) {
        *why = "scattered nodes have no vectorised sweep and shorter explicit steps";
        return &stepper_bdf2;
    }
    *why = "motion of a lattice at real cloth stiffness: explicit steps cost least";
    return &stepper_central;
}
