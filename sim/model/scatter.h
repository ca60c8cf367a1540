/* scatter.h: panels with scattered nodes: discs, annuli, polygons, jittered rectangles. */
#ifndef TOILE_MODEL_SCATTER_H
#define TOILE_MODEL_SCATTER_H

#include "sim/model/panel.h"

/* Nodes on every outline at the panel's spacing, and inside on a triangular lattice that is
 * relaxed towards the centroids of its Voronoi cells; triangles by Delaunay.
 * Errors: EXIT_BAD_INPUT. */
bool scatter_create(const ClothDef *def, uint64_t seed, Arena *arena, Panel *panel, Error *error);

/* Is the node on that part of the border? Border nodes come first, loop after loop. */
bool scatter_in_region(const Panel *panel, RegionKind region, int node);

#endif
