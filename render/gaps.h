/* gaps.h: how near cloth is to cloth and to solids, seen by two detections.
 *
 * - triangles: those that contact sees; the distance of a point to the nearest one.
 * - smooth: the surface of the shape functions, without triangles (Yuan et al. 2008, section 5; smooth.h):
 *   the point is projected, and counts when it projects inside the panel. A point that was on one side
 *   of the surface in the frame before, and is on the other now, has crossed.
 *
 * Points are nodes near other cloth, or near their own at least GAPS_APART spacings away in the panel;
 * and the points of solids that are nearest to a node. Meshes are not looked at.
 */
#ifndef TOILE_RENDER_GAPS_H
#define TOILE_RENDER_GAPS_H

#include "sim/state/state.h"

#define GAPS_APART 4.0

typedef struct Gaps {
    int points, outside; /* near; of them without a projection inside the panel */
    double triangles;    /* [m] least distance; INFINITY */
    double smooth;       /* [m] least, negative for what has crossed */
    double mean, most;   /* [m] difference of the two: root of the mean square, largest */
    int crossed;         /* points */
    double seconds[2];   /* [s] of the processor: triangles, smooth */
} Gaps;

/* Which side every point was on; one per run, filled by gaps_measure. */
typedef struct GapSides {
    int count;  /* nodes; 0 at first */
    int *cloth; /* (count) whose surface it was near; -1: none */
    signed char *side;
} GapSides;

/* Numbers of one frame; points farther than `reach` [m] are not near. `sides` lives in `kept`. */
Gaps gaps_measure(const StateHeader *header, const StateLayout *layout, const StateFrame *frame,
                  double reach, Arena *scratch, GapSides *sides, Arena *kept);

/* [m] mean distance of neighbours over all cloths: a reach that finds what is near. */
double gaps_spacing(const StateLayout *layout);

#endif
