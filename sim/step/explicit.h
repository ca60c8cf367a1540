/* explicit.h: the engine of the explicit road: kick, guard, drift.
 *
 * An interval is velocity Verlet: half a kick, then drift and kick in turn, half a kick at the
 * end, so that positions and velocities belong to the same instant at both ends and the step
 * may change from one interval to the next. */
#ifndef TOILE_STEP_EXPLICIT_H
#define TOILE_STEP_EXPLICIT_H

#include "sim/step/system.h"

typedef struct Explicit Explicit;

/* How to run an interval. */
typedef struct ExplicitRun {
    int steps;
    double dt;             /* [s] */
    bool scaled;           /* inertia (inertia.h) */
    bool symplectic_euler; /* whole kicks, each before its drift: first order */
    bool kinetic_damping;  /* all velocities to zero whenever the kinetic energy falls */
    double kinetic_target; /* [J] kinetic damping stops when the energy at a kill is below */
} ExplicitRun;

typedef struct ExplicitResult {
    bool finite;
    double work;         /* [J] done by handles on the cloth */
    double energy_gain;  /* [J] change of kinetic + elastic + gravity + contact energy, and what
                              mass damping took from cloths without a sweep */
    double energy_scale; /* [J] of the energies at hand, for judging the gain */
    double sides;        /* [J] taken out by the bound on sides (sides.h) */
    /* [J] hidden from the kinetic energy by scaled inertia, and lost as that begins or ends */
    double inertia;
    double fabric, drag; /* [J] taken out by damping (damping.h), and by air less what it gave */
    double blown;        /* [J] that the air gave on faces */
    double contact_energy, elastic; /* [J] at the end */
    double fastest;                 /* [m/s] at any time */
    int steps;
    double last_kill; /* [J] kinetic energy when it was taken away last, by kinetic damping */
    ContactStatistics contact;
} ExplicitResult;

Explicit *explicit_create(const System *system);

/* [s] the longest stable step at the start, before the Courant factor, with true or scaled inertia. */
double explicit_limit(const Explicit *engine, bool scaled);

/* Advances the state in place; the caller keeps a copy to go back to. */
ExplicitResult explicit_interval(Explicit *engine, const ExplicitRun *run, State *state);

#endif
