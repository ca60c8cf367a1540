/* crossing.h: which triangles cross, decided without rounding (predicates of exact.h).
 *
 * A judge of simulations, and therefore independent of everything that finds contacts: its own
 * tree of boxes, its own tests.
 *
 *   - Triangles are closed sets of points: touching counts, coplanar overlap counts.
 *   - Two triangles of a mesh that share vertices (by number) cross when they have more in common
 *     than the corner or the edge that they share. Sharing alone does not count.
 *   - A triangle without area is the segment, or the point, that its corners span.
 *
 * Solids have no exact surface in doubles: there the test is numerical, to the two lengths below.
 *
 * Vertices must be finite; crossing_find_damage says. Cost: 5,000 triangles of a draped sheet some
 * 5 ms. Thread-safe.
 */
#ifndef TOILE_GEOM_CROSSING_H
#define TOILE_GEOM_CROSSING_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/base/arena.h"
#include "sim/geom/solid.h"

typedef struct CrossingMesh {
    int vertex_count, triangle_count;
    const double *vertices;   /* [m] (vertex_count x 3) */
    const int32_t *triangles; /* (triangle_count x 3) */
} CrossingMesh;

typedef struct Crossings {
    int64_t count; /* pairs; with a solid: triangles */
    int first[2];  /* the pair that comes first in the order of triangle numbers; -1 -1: none.
                    * With a solid only first[0]. */
} Crossings;

/* First vertex that is not finite, or first triangle with a vertex number out of range, in words;
 * NULL when the mesh can be tested. The words are valid until the next call in this thread. */
const char *crossing_find_damage(const CrossingMesh *mesh);

/* Pairs of triangles of one mesh that cross. `scratch` is left as it was found. */
Crossings crossing_count_self(const CrossingMesh *mesh, Arena *scratch);

/* Pairs (triangle of a, triangle of b) that cross; vertex numbers of the two have nothing to do
 * with each other. */
Crossings crossing_count_between(const CrossingMesh *a, const CrossingMesh *b, Arena *scratch);

/* Is `point` inside the closed mesh: do its triangles wind around it? Exact, by the signs with which
 * a segment to a far point goes through them. Meant for meshes that the point does not touch. */
bool crossing_point_inside(const CrossingMesh *mesh, const double point[3]);

/* A triangle is inside a solid when it has a point deeper than this: poses and distances carry
 * rounding of 1e-15 of a coordinate, and a cloth may rest on a solid exactly. */
#define CROSSING_DEPTH 1e-12 /* [m] */
/* The deepest point is searched until it is known so well: a triangle that reaches inside by less
 * may be missed. */
#define CROSSING_RESOLUTION 1e-10 /* [m] */

/* Triangles of the mesh that reach inside the solid at this pose. */
Crossings crossing_count_solid(const CrossingMesh *mesh, const Solid *solid, Pose pose);

/* ---- single tests, exact ---- */

/* Corners of a triangle, borrowed. */
typedef struct CrossingTriangle {
    const double *corner[3];
} CrossingTriangle;

/* Triangles that share no vertex. */
bool crossing_triangles(const CrossingTriangle *a, const CrossingTriangle *b);

/* Triangles that share `shared` vertices (0 to 3): the first so many corners of both. */
bool crossing_triangles_sharing(const CrossingTriangle *a, const CrossingTriangle *b, int shared);

/* The closed segment pq and the closed triangle. */
bool crossing_segment(const double p[3], const double q[3], const CrossingTriangle *triangle);

#endif
