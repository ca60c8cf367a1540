/* lanes.h: positions, velocities and forces as one array per component, so that loops over
 * them vectorise. A place in the arrays is a *slot*.
 *
 * The nodes of a lattice lie row after row (u runs fastest) with free slots around every row:
 * node (i, j) has slot first + j * stride + i, and slots i = -2 .. nu + 1 of every row, and the
 * rows -1 and nv, can be read. A wrapped lattice keeps copies of its first and last two nodes
 * there; a clamped border keeps its ghost nodes there. The margin after a row is the one before the
 * next. Scattered nodes lie densely. */
#ifndef TOILE_GEOM_LANES_H
#define TOILE_GEOM_LANES_H

#include "sim/base/arena.h"

#define LANE_MARGIN 8 /* free slots before the first node of a row; a multiple of 8 */

typedef struct Lanes {
    int slot_count;
    double *x[3];    /* [m] */
    double *bent[3]; /* [m] where the curvature is taken: x, or a little ahead of it (damping) */
    double *stretched[3]; /* [m] where the stretch is taken, likewise */
    double *v[3];         /* [m/s] */
    double *f[3];         /* [N] forces from outside the cloth models; zero when nothing acts */
    double *weight;       /* [1/kg] inverse inertia in a kick; 0 in free slots */
} Lanes;

static inline int lanes_row_stride(int nu) { return (nu + LANE_MARGIN + 7) / 8 * 8; }

static inline Lanes lanes_create(int slot_count, Arena *arena) {
    Lanes lanes = {.slot_count = slot_count};
    for (int c = 0; c < 3; c++) {
        lanes.x[c] = arena_push(arena, double, slot_count);
        lanes.bent[c] = lanes.stretched[c] = lanes.x[c];
        lanes.v[c] = arena_push(arena, double, slot_count);
        lanes.f[c] = arena_push(arena, double, slot_count);
    }
    lanes.weight = arena_push(arena, double, slot_count);
    return lanes;
}

#endif
