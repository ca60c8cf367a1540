/* smooth.h: the smooth surface through the nodes of a panel, x(u) = sum_I phi_I(u) x_I with the shape
 * functions of rbf.h, and where a point is on it.
 *
 * The paper's detection (Yuan et al. 2008, section 5): a node that moves from P to Q meets the cloth when both ends
 * project into the panel and lie on different sides of the surface. Projection is Newton's method on
 * |x(u) - p|^2 / 2; whether a place is on the panel is told by its nodes (inside.h). */
#ifndef TOILE_GEOM_SMOOTH_H
#define TOILE_GEOM_SMOOTH_H

#include <stdbool.h>

#include "sim/base/vec.h"
#include "sim/geom/rbf.h"

typedef struct SmoothSurface {
    PointGrid grid; /* nodes; of a panel that is closed along u, those near the ends twice */
    int *node;      /* (grid.count) which node a point of the grid is */
} SmoothSurface;

/* material: [m] (count x 2); spacing: [m] mean distance of neighbours; period: [m] along u, 0 where
 * the panel is not closed. */
SmoothSurface smooth_create(const double *material, int count, double spacing, double period,
                            Arena *arena);

typedef struct SmoothPoint {
    double at[2]; /* [m] material place of the projection */
    Vec3 place, normal;
    double gap;  /* [m] along the normal; negative behind the surface */
    bool inside; /* of the panel */
} SmoothPoint;

/* Projects p from the material place `start` on; x: [m] (count x 3). False: no projection near there. */
bool smooth_project(const SmoothSurface *surface, const double *x, Vec3 p, const double start[2],
                    Arena *scratch, SmoothPoint *found);

#endif
