/* stepper.h: the table of time steppers. A new stepper is one new file and one line in
 * steppers.c.
 *
 * A stepper advances the state by one output interval. It works on copies and commits only what
 * is good: an interval (explicit) or step (implicit) that fails, turns non-finite or gains more
 * energy than was put in is taken back and tried again with half the step. When that does not
 * help the state stays as it was and the error says why. */
#ifndef TOILE_STEP_STEPPER_H
#define TOILE_STEP_STEPPER_H

#include "sim/step/system.h"

typedef struct Stepper {
    const char *name, *about;
    bool implicit;     /* needs matrices */
    bool scales;       /* inertia, for longer steps (inertia.h) */
    double sweep_cost; /* of a sweep over that of a step of `central`; 0: does no sweeps */
    bool limits;       /* has springs with a limit, and `repel`; others refuse such cloth */
    bool history;      /* commits what cloth remembers, step by step; others refuse such cloth */
    /* Allocates what advance needs; *data is passed on. */
    bool (*create)(const System *system, void **data, Error *error);
    /* From state->time to time_end. Adds to *statistics. Errors: EXIT_DIFFERS with the reason. */
    bool (*advance)(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error);
    void (*destroy)(void *data); /* NULL: nothing outside the arena */
} Stepper;

extern const Stepper *const steppers[]; /* NULL-terminated */

const Stepper *stepper_find(const char *name);

/* The stepper that a scene asks for; for "auto" that of choose.c. *why: one sentence. */
const Stepper *stepper_choose(const System *system, const char **why);

/* Puts the place of the stepper in the scene before the text of an error. Returns false. */
bool stepper_place(const Scene *scene, Error *error);
/* For steppers that move free cloth: false, with the reason. `without`: "obstacles" and what else they
 * do not know; `instead`: a stepper that has contact, or NULL. */
bool stepper_refuse(const System *system, const char *name, const char *without,
                    const char *instead, Error *error);
/* For steppers that look for rest: false, with an error, where wind pushes on faces. */
bool stepper_stands_wind(const System *system, const char *name, Error *error);

/* Halvings of a step or an interval before a run gives up. */
#define STEP_MAX_HALVINGS 8
/* Share of the energy at hand that may appear from nowhere in one interval. Discrete energy of
 * the explicit scheme wobbles by some per cent; an instability doubles it within a few steps. */
#define STEP_ENERGY_TOLERANCE 0.1

/* A stepper may be stopped between intervals and inside long ones (Ctrl-C). */
extern volatile int step_interrupted;

extern const Stepper stepper_central, stepper_bdf2, stepper_backward_euler, stepper_static;

#endif
