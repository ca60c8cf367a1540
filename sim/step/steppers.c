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
    STEPPER(relaxation)                                                                            \
    STEPPER(stochastic)                                                                            \
    STEPPER(three_phase)

#define DECLARE(name) extern const Stepper stepper_##name;
#define LIST(name) &stepper_##name,
STEPPERS(DECLARE)
const Stepper *const steppers[] = {STEPPERS(LIST) NULL};

const Stepper *stepper_find(const char *name) {
    for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
        if (strcmp((*stepper)->name, name) == 0) {
            return *stepper;
        }
    }
    return NULL;
}

bool stepper_place(const Scene *scene, Error *error) {
    return error_place(error, scene->solver.where ? scene->solver.where : scene->path);
}

bool stepper_refuse(const System *system, const char *name, const char *without,
                    const char *instead, Error *error) {
    error_set(error, EXIT_BAD_INPUT,
              "stepper '%s' moves free cloth only, without %s and with 'solver: {self_contact: "
              "false}'%s%s%s",
              name, without, instead ? "; '" : "", instead ? instead : "",
              instead ? "' has contact" : "");
    return stepper_place(system->scene, error);
}

bool stepper_stands_wind(const System *system, const char *name, Error *error) {
    const AirDef *air = &system->scene->air;
    if (!air_has_faces(air) || vec3_length(air->wind) == 0.0) {
        return true;
    }
    error_set(error, EXIT_BAD_INPUT,
              "stepper '%s' looks for rest, which wind on faces ('air: normal_drag', 'density') "
              "does not leave; use central or bdf2, or 'air: drag' alone",
              name);
    return stepper_place(system->scene, error);
}
