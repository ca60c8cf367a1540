/* impulse.h: what contacts push while an explicit interval runs, for the look that shows it.
 *
 * The forces of contacts swing from step to step; their mean over the interval carries what rests on
 * something. */
#ifndef TOILE_STEP_IMPULSE_H
#define TOILE_STEP_IMPULSE_H

#include "sim/geom/lanes.h"
#include "sim/step/system.h"

typedef struct Impulse {
    double *sum; /* [N s] (place_count x 3); NULL: nobody asks */
    double time; /* [s] that it covers */
} Impulse;

/* An interval of this state begins. */
void impulse_start(Impulse *impulse, const System *system, const State *state);
/* The forces of contacts, all that is in lanes->f now, act for so long [s]; slot: (place_count). */
void impulse_add(Impulse *impulse, const System *system, const Lanes *lanes, const int *slot,
                 double time);
/* What changes the velocities between a call with sign -1 and one with +1 pushed, too. */
void impulse_add_momentum(Impulse *impulse, const System *system, const Lanes *lanes,
                          const int *slot, double sign);
/* Their mean into state->contact_force. */
void impulse_end(const Impulse *impulse, const System *system, State *state);

#endif
