/* drift.h: x += dt v of all cloth, and how fast it was (sweep.h). */
#ifndef TOILE_STEP_DRIFT_H
#define TOILE_STEP_DRIFT_H

#include "sim/contact/contact.h"
#include "sim/model/sweep.h"
#include "sim/step/system.h"

typedef struct Drift {
    const System *system;
    const SweepKernel *kernel;
    const SweepLattice *lattices; /* (cloth_count) with first slots; nu = 0: no sweep */
    const int *grain;             /* (cloth_count) rows of a chunk */
    const Lanes *lanes;
    const int *slot;         /* (place_count) */
    SweepSpeed *chunk_speed; /* of the chunks of one cloth */
} Drift;

/* What is given stays where it is. */
Drift drift_create(const System *system, const SweepLattice *lattices, const int *grain,
                   const Lanes *lanes, const int *slot);

/* Also of held places and ghosts, whose velocities lead to their targets. Lanes where bending and stretch are taken
 * are ahead by `bent` and `stretched` [s] (cloth_count). `frames`: speeds are those of every row in its own. */
ContactSpeeds drift_all(const Drift *drift, double dt, const double *bent, const double *stretched,
                        bool frames);

#endif
