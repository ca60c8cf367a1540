/* start.h: contact keeps apart what is apart, so a simulation has to start so. */
#ifndef TOILE_START_H
#define TOILE_START_H

#include "sim/step/system.h"

/* Moves cloth out of solids, then has the exact check judge the start. False (EXIT_BAD_INPUT) with
 * the place on the panel when cloth crosses itself, other cloth or an obstacle. *moved: vertices. */
bool start_make_legal(const System *system, State *state, int *moved, Error *error);

#endif
