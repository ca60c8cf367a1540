/* garment.h: flat panels sewn together into one cloth.
 *
 * The outlines of all panels stand in ShapeDef.outline, side by side along u, so that a place (u, v)
 * belongs to one panel; corner numbers count through them. A seam joins two rows of corners with the
 * same number of edges: what is sewn is one line of nodes, so a seam is closed from the start.
 * Panels form a ring, in their order; they start around the axis z, each in its share of the width. */
#ifndef TOILE_SCENE_GARMENT_H
#define TOILE_SCENE_GARMENT_H

#include <stdbool.h>

typedef struct GarmentPanel {
    const char *name;
    int loop_begin, loop_end; /* of the shape */
    bool reversed;            /* written clockwise */
} GarmentPanel;

typedef struct GarmentSeam {
    int panel[2];
    int corner_count;     /* of each row; at least 2 */
    const int *corner[2]; /* (corner_count) of the shape's outline, neighbours on it */
    int line;             /* of the scene file, for messages */
} GarmentSeam;

typedef struct GarmentDef {
    int panel_count, seam_count;
    GarmentPanel *panels;
    GarmentSeam *seams;
    const double *pattern; /* [m] the shape's outline with the u of each panel as written */
    double oval;           /* depth / width of the ring at the start; 1 */
} GarmentDef;

#endif
