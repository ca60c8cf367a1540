/* untangle.h: a mesh that crosses itself is pulled apart.
 *
 * The lines along which it crosses part it into pieces: what can be reached along edges that pierce
 * nothing. Where a line closes or runs from rim to rim the smaller piece has gone through, and comes back
 * vertex by vertex, each to the other side of the triangle that its edge pierces (global intersection
 * analysis: Baraff, Witkin, Kass, Untangling cloth, 2003). Where a line ends within a sheet it parts nothing,
 * and what lies towards the nearer rim comes back. */
#ifndef TOILE_GEOM_UNTANGLE_H
#define TOILE_GEOM_UNTANGLE_H

#include "sim/geom/crossing.h"

typedef struct Untangled {
    bool done;  /* nothing crosses now */
    int moved;  /* vertices */
    double way; /* [m] of the one that moved most, at any time */
} Untangled;

/* Moves the vertices x [m] (vertex_count x 3), which are also those of the mesh, until they are some `gap`
 * [m] apart, each by at most `most` [m]; held (vertex_count): 1 stays. When it is not done x is as it was.
 * `scratch` is left as it was found. */
Untangled untangle(const CrossingMesh *mesh, const unsigned char *held, double gap, double most,
                   double *x, Arena *scratch);

#endif
