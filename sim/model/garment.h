/* garment.h: panels sewn together: seams of equal nodes on both sides, and where a garment starts. */
#ifndef TOILE_MODEL_GARMENT_H
#define TOILE_MODEL_GARMENT_H

#include "sim/model/panel.h"

/* Both sides of a seam get the same number of pieces, that of their mean length. count: (points of the
 * outline) pieces of the side from each corner. */
void garment_divide_seams(const ShapeDef *shape, double spacing, int *count);

/* The panel of a place: they stand side by side along u. */
int garment_panel_at(const ShapeDef *shape, double u);

/* Sews a panel whose nodes are still the vertices of its triangles, and places it: every panel in its
 * share of a ring around the axis z that is as wide, at every depth below the top, as all panels
 * together; the ring's top is at z = 0. Gores whose sides would meet in a point, and rectangles, start
 * all but free of strain.
 * Errors: EXIT_BAD_INPUT when the panels form no ring, a seam joins what starts more than a spacing
 * apart, or an edge would belong to three triangles or turn its face inward. */
bool garment_sew(const ClothDef *def, Arena *arena, Panel *panel, Error *error);

enum { GARMENT_TOP = 1, GARMENT_BOTTOM = 2 }; /* Panel.ends */

/* Marks the nodes that have that end; returns how many. */
int garment_select(const Panel *panel, unsigned char end, unsigned char *marks);

#endif
