/* start.h: contact keeps apart what is apart, so a simulation has to start so. */
#ifndef TOILE_START_H
#define TOILE_START_H

#include "sim/step/system.h"

/* Vertices that were moved before the first step. */
typedef struct StartMoves {
    int untangled, pushed_out; /* from other cloth; out of solids */
} StartMoves;

/* Pulls apart cloth that crosses cloth and moves it out of solids, then has the exact check judge the
 * start. False (EXIT_BAD_INPUT) with the place on the panel when cloth still crosses itself, other cloth
 * or an obstacle, or would have to move by more than ten contact distances. */
bool start_make_legal(const System *system, State *state, StartMoves *moves, Error *error);

#endif
