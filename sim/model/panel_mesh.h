/* panel_mesh.h: a cloth out of a file (ShapeDef.mesh).
 *
 * Vertices are those of the file that differ in place or in (u, v); vertices in one place are one node:
 * that welds seams. A chart of the texture that is turned over there is mirrored, so that all
 * triangles are anticlockwise in (u, v); material constants know no difference. */
#ifndef TOILE_MODEL_PANEL_MESH_H
#define TOILE_MODEL_PANEL_MESH_H

#include "sim/model/panel.h"

/* Panel.ends of a mesh: nodes along a free border */
#define PANEL_FREE_BORDER 4

/* Errors: EXIT_BAD_INPUT when a triangle has no area in (u, v), neighbours of a chart disagree about
 * its upper side, an edge has more than two triangles, or two of them disagree about the outside. */
bool panel_from_mesh(const ClothDef *def, Arena *arena, Panel *panel, Error *error);

#endif
