/* layout.h: a system as header and layout of the states file. */
#ifndef TOILE_LAYOUT_H
#define TOILE_LAYOUT_H

#include "sim/sim.h"

StateHeader layout_header(const Sim *sim, Arena *arena);
StateLayout layout_make(const System *system, Arena *arena);

#endif
