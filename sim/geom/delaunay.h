/* delaunay.h: Delaunay triangles of points in the plane (Qhull). */
#ifndef TOILE_GEOM_DELAUNAY_H
#define TOILE_GEOM_DELAUNAY_H

#include <stdbool.h>

#include "sim/base/arena.h"

/* Triangles of the convex hull, anticlockwise, in a fixed order. False when the points do not
 * span a plane. `triangles` (3 ints each) is allocated from the arena. */
bool delaunay_triangulate(const double *points, int count, Arena *arena, int **triangles,
                          int *triangle_count);

/* Is p inside the closed loops (even-odd)? loops: points begin[l] .. begin[l + 1] - 1. */
bool loops_contain(const double *points, const int *begin, int loop_count, const double p[2]);

/* Distance of p from the nearest side of the loops. */
double loops_distance(const double *points, const int *begin, int loop_count, const double p[2]);

/* Area inside the loops: outer ones anticlockwise, holes clockwise. */
double loops_area(const double *points, const int *begin, int loop_count);

#endif
