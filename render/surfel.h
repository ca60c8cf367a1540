/* surfel.h: points of a surface that cover it, and where they end.
 *
 * Each vertex of a resampled surface is a surfel: a disc in the panel that the derivatives of the
 * surface turn into an ellipse in space, so that stretched or sheared cloth has no holes. Near the
 * border of the panel a disc is cut by one or two straight lines, so that the cloth ends in a line
 * [Zwicker et al. 2004: Perspective accurate splatting; sharp features by clip lines].
 */
#ifndef TOILE_RENDER_SURFEL_H
#define TOILE_RENDER_SURFEL_H

#include "render/resample.h"

/* What stays the same for all frames; read by splat.vert.glsl as SURFEL_FLOATS numbers. */
struct Surfel {
    float uv[2]; /* [m] from the panel's corner */
    /* [m] in the panel; 0: another surfel lies in the same place; below 0: not drawn in this frame */
    float radius;
    float cut; /* 0: a whole disc; inside is where both lines say so: 1, where either does: 2 */
    float line[2][3]; /* a, b, c: inside is where a u + b v + c >= 0 */
};
#define SURFEL_FLOATS 10
_Static_assert(sizeof(struct Surfel) == SURFEL_FLOATS * sizeof(float), "see splat.vert.glsl");

/* Fills surface->surfels from uv and fine triangles of the surface and the border of the layout. */
/* Fills surface->bends for a new frame: slopes of the normals on the triangles, averaged at the vertices by area. With them
 * normals are linear in a disc, without them the discs would show as facets. */
void surfel_bend(Surface *surface, Arena *scratch);

/* Leaves sharp folds to triangles, which discs would overlook: hides moved vertices and lists the triangles
 * around them in surface->folds. any: are there moved ones? */
void surfel_fold(Surface *surface, bool any);

void surfel_fill(const StateLayout *layout, Surface *surface);

#endif
