/* layout.h: a system as header and layout of the states file. */
#ifndef TOILE_LAYOUT_H
#define TOILE_LAYOUT_H

#include "sim/sim.h"

StateHeader layout_header(const Sim *sim, Arena *arena);
/* Vertices of all meshes that move by themselves, [m] (*count x 3), each at the time [s] of its
 * obstacle: times (obstacle_count). */
const double *layout_moved(const Scene *scene, const double *times, Arena *arena, int *count);
StateLayout layout_make(const System *system, Arena *arena);

#endif
