/* inside.h: is a place on the cloth, from its nodes alone?
 *
 * The paper (000 section 5) takes det N, N the interpolation matrix of the nearest nodes, to be
 * positive inside and to vanish outside, after Li, Qian, Liu and Belytschko (2001). For the
 * augmented RBF matrix that is not so: it depends on the nodes only, not on the place, is as
 * large on both sides of a border, and misjudges a third of all places. Li et al. speak of the
 * weighted moment matrix,
 *   M(x) = sum_I w(|x - X_I| / rho) p p',  p = (1, (x - X_I) / rho),
 * with Wendland's C2 weight; its determinant does fall steeply across a border (mlpg.md section
 * 8). Convex corners are cut short by 0.3 spacings, re-entrant ones filled by 0.6. Outlines are
 * known for every panel, and loops_contain is exact; this is for nodes without an outline. */
#ifndef TOILE_GEOM_INSIDE_H
#define TOILE_GEOM_INSIDE_H

#include <stdbool.h>

#include "sim/geom/points.h"

/* det M at `at`, for one node in each spacing^2 (the grid's); 0 far outside. */
double inside_determinant(const PointGrid *grid, const double at[2]);

/* Is det M above its value on a border? */
bool inside_contains(const PointGrid *grid, const double at[2]);

#endif
