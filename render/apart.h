/* apart.h: keeps a drawn surface from crossing itself where the simulated triangles do not.
 *
 * Contact keeps the triangles T of the surface s = W x apart; drawn is a smooth surface S through
 * their corners, which leaves them by e = S - T and in folds tighter than the node spacing passes
 * through its neighbours. Drawn vertices stand at T + g e, where g is linear on every triangle between
 * values from 0 to 1 at its corners: 1, the smooth surface to the bit, wherever the following allows it.
 * Each drawn triangle lies within one T, so that g = 0 draws T itself.
 *
 *   no common corner  the plane across the shortest way between two triangles parts all their drawn
 *                     vertices; it divides the way as the smooth surfaces would come over it. Nothing to
 *                     do where the way is longer than both |e| together.
 *   a common corner   the same, by the plane through the corner across the two nearest rays out of it:
 *                     e = 0 there, so that one plane can part what touches. Or |d(g e)/ds| less than
 *                     the sine of half the angle between the rays, in space or seen along the middle
 *                     of both normals; whichever leaves most.
 *   a common edge     seen along the middle of both normals the two lie side by side, each a plane map of
 *                     the other view. Such a map of a convex domain has no double points while the
 *                     symmetric part of its gradient is positive definite: that of d(g e)/ds, seen so, is
 *                     kept above -1. A triangle by itself the same, seen along its own normal.
 *
 * Sewn panels have a smooth surface each: on a seam e is the mean of both, so that they meet.
 *
 * Normals follow, from those of the smooth surface to those between the corners' mean normals: never facets.
 *
 * g of a triangle is the least of all its pairs, g of a corner the least of its triangles. Margins are
 * shares of these bounds, so that rounding has room. Surfaces that are nowhere near themselves cost
 * a walk through a tree of boxes.
 */
#ifndef TOILE_RENDER_APART_H
#define TOILE_RENDER_APART_H

#include "render/resample.h"

/* The drawn vertices of one triangle: number (i, j), i + j <= level, stands at the barycentric place
 * (level - i - j, i, j) / level and is origin + i step[0] + j step[1], less j (j - 1) / 2 when packed. */
struct Piece {
    int32_t corner[3]; /* surface vertices of the layout */
    int origin, step[2], level;
    bool packed;
};

typedef struct Apart Apart;

/* Everything lives in arena; of parts (cloth_count) only the panels are read. pieces: (layout
 * triangle_count), those of cloths that cannot be followed have level 0. */
Apart *apart_create(const StateLayout *layout, const SurfacePart *parts, const Piece *pieces,
                    Arena *arena);

/* Moves vertices of the smooth surface through s [m] (layout vertex_count x 3), with their normals or
 * derivatives, and notes in `moved` which. False: none. */
bool apart_move(Apart *apart, const double *s, bool derivatives, Surface *surface);

#endif
