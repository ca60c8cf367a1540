/* measure.h: numbers out of the frames of a run. Nothing here draws.
 *
 * Crossings: which triangles of the surface s = W x cross each other or reach inside an obstacle,
 * by the exact check of sim/geom/crossing.h, which knows nothing of how contact is found. Judged are the
 * triangles that contact sees, or those that are drawn.
 */
#ifndef TOILE_RENDER_MEASURE_H
#define TOILE_RENDER_MEASURE_H

#include "render/resample.h"
#include "sim/state/state.h"

#define MEASURE_PLACE_SIZE 256

typedef struct MeasureCrossings {
    int64_t cloth;                  /* pairs of triangles, of one cloth or of two */
    int64_t obstacles;              /* triangles inside an obstacle, all obstacles together */
    int64_t *obstacle;              /* (obstacle_count) the same for each */
    char place[MEASURE_PLACE_SIZE]; /* where the first one is, in words: cloth, (u, v) [m] */
} MeasureCrossings;

/* Counts for one frame; `obstacle` lives in arena, which also serves as scratch. The check is exact
 * for cloth with cloth; solids are measured to CROSSING_RESOLUTION.
 * Errors: EXIT_BAD_INPUT when a number of the frame is not finite. */
bool measure_crossings(const StateHeader *header, const StateLayout *layout,
                       const StateFrame *frame, Arena *arena, MeasureCrossings *found,
                       Error *error);

/* The same for the surface that the resampler draws, cloth with cloth only: obstacles count 0. Where
 * panels are sewn together, each is drawn by itself between the nodes of the seam. */
bool measure_drawn(const StateHeader *header, const StateLayout *layout, const StateFrame *frame,
                   Resampler *resampler, Arena *arena, MeasureCrossings *found, Error *error);

#endif
