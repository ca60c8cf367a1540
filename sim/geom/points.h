/* points.h: scattered points in the plane and the stencils around a place. */
#ifndef TOILE_GEOM_POINTS_H
#define TOILE_GEOM_POINTS_H

#include "sim/base/arena.h"

#define STENCIL_CAPACITY 96 /* nodes in one stencil; ties on a lattice stay far below */

typedef struct PointGrid {
    int count;
    const double *points; /* (count x 2), borrowed */
    double spacing;       /* mean distance of neighbours, the length unit of stencils */
    double low[2];
    int cells[2];
    int *begin; /* (cells[0] * cells[1] + 1) */
    int *index; /* (count) */
} PointGrid;

PointGrid points_grid(const double *points, int count, double spacing, Arena *arena);

/* The `wanted` points nearest to `at`, plus every point at the same distance as the last one
 * (relative 1e-6: tie-broken stencils on a lattice are lopsided), sorted by
 * distance, then number. Returns how many. */
int points_nearest(const PointGrid *grid, const double at[2], int wanted,
                   int nodes[STENCIL_CAPACITY]);

#endif
