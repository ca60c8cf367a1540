/* between.h: the scene between two frames, for pictures with motion blur.
 *
 * Nodes go along the cubic that has the positions and velocities of both frames; obstacles and
 * vertices of moving meshes go straight, turns along the shorter way.
 */
#ifndef TOILE_RENDER_BETWEEN_H
#define TOILE_RENDER_BETWEEN_H

#include "sim/base/arena.h"
#include "sim/state/state.h"

/* A copy of a frame that outlives the next reading; lives in arena. */
StateFrame between_copy(const StateFrame *frame, int node_count, Arena *arena);

/* The frame at part 0..1 of the way from a to b, which have the same layout; lives in arena. */
StateFrame between_frames(const StateFrame *a, const StateFrame *b, int node_count, double part,
                          Arena *arena);

#endif
