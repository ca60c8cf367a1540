/* cells.h: the sub-domains around nodes: one cell per node, tiling the panel, as a list of
 * straight edges. Rectangles on lattices; on scattered nodes the Voronoi cells (duals of the
 * Delaunay triangles; where a triangle is obtuse its centroid stands for its circumcentre, so
 * that every cell stays inside the panel). */
#ifndef TOILE_MODEL_CELLS_H
#define TOILE_MODEL_CELLS_H

#include "sim/model/panel.h"

typedef struct CellEdge {
    int left, right;  /* cells on both sides; right = -1 on the panel's border */
    double middle[2]; /* [m] */
    double along[2];  /* [m] from its start to its end; the left cell lies to the left */
    double normal[2]; /* unit, out of the left cell */
    double length;    /* [m] */
} CellEdge;

typedef struct Cells {
    int edge_count;
    CellEdge *edges;
    double *area;        /* [m2] (node_count) */
    double (*moment)[3]; /* [m2] (node_count) second moments 11, 12, 22 about the centroid / area */
} Cells;

Cells cells_create(const Panel *panel, Arena *arena);

#endif
