/* inside.h: is a place on the cloth, from its nodes alone?
 *
 * The paper (Yuan et al. 2008, section 5) takes det N, N the interpolation matrix of the nearest nodes, to be
 * positive inside and to vanish outside, after Li, Qian, Liu and Belytschko (2001). For the
 * augmented RBF matrix that is not so: it depends on the nodes only, not on the place, is as
 * large on both sides of a border, and misjudges a third of all places. Li et al. speak of the
 * weighted moment matrix,
 *   M(x) = sum_I w(|x - X_I| / rho) p p',  p = (1, (x - X_I) / rho),
 * with Wendland's C2 weight, whose determinant does fall steeply across a border, but cuts convex
 * corners by 0.28 spacings. Its first moments alone, the offset of the weighted mean of the nodes
 * from the place, need no density of nodes and cut them by 0.13; re-entrant
 * corners are filled by 0.4. Outlines are known for every panel, and loops_contain is exact; this
 * is for nodes without an outline. */
#ifndef TOILE_GEOM_INSIDE_H
#define TOILE_GEOM_INSIDE_H

#include <stdbool.h>

#include "sim/geom/points.h"

/* |sum w (X_I - x)| / (rho sum w) at `at`; infinite out of reach of all nodes. */
double inside_offset(const PointGrid *grid, const double at[2]);

/* Is the offset below its value on a border? */
bool inside_contains(const PointGrid *grid, const double at[2]);

#endif
