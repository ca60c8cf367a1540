/* surface.h: what contact sees: triangles of all cloths, cut into cells and groups.
 *
 * A *cell* is two triangles with a common edge (or one that found no partner). Every vertex and
 * edge is owned by the first cell that has it, so that pairs of cells give each pair of features
 * once. A *group* is up to 9 neighbouring cells: 3 x 3 on a lattice. */
#ifndef TOILE_CONTACT_SURFACE_H
#define TOILE_CONTACT_SURFACE_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/geom/box_tree.h"

#define SURFACE_BLOCK 3 /* cells along a side of a lattice group; 2 and 4 cost up to a fifth more */
#define SURFACE_GROUP_CELLS (SURFACE_BLOCK * SURFACE_BLOCK)

/* Positions of places. */
typedef struct Points {
    const double *x; /* [m] (places x 3) */
} Points;

static inline Vec3 point_at(const Points *p, int place) {
    return vec3_load(p->x + 3 * (long)place);
}

/* One cloth as it comes from its panel. */
typedef struct SurfacePanel {
    int first;              /* place of its first vertex */
    int vertex_count;       /* all the same places in a row */
    int triangle_count;     /* ... */
    const int *triangles;   /* (triangle_count x 3) from 0 */
    const double *material; /* [m] (vertex_count x 2) */
    int nu, nv;             /* lattice, or 0 0 */
    bool wrap;              /* u runs around */
    double h1, h2;          /* [m] spacing */
    double distance;        /* [m] contact distance of this cloth */
    double mass;            /* [kg] mean of a vertex */
    bool obstacle, still;   /* a mesh, moved by a programme; one that never moves */
} SurfacePanel;

typedef struct SurfaceCell {
    int triangle[2], corner[4]; /* places */
    int vertex[4];              /* owned ones of them */
    int edge[5];                /* owned edges */
    unsigned char triangle_count, corner_count, vertex_count, edge_count;
} SurfaceCell;

typedef struct SurfaceGroup {
    int panel;
    int cell_begin, cell_end;
    int vertex_begin, vertex_end; /* of group_vertices: all vertices of its triangles */
    int block[2];                 /* along u, v on a lattice; -1 elsewhere */
} SurfaceGroup;

typedef struct Surface {
    int panel_count;
    const SurfacePanel *panels;
    int triangle_count, edge_count, cell_count, group_count;
    int *triangles; /* (triangle_count x 3) places */
    int *edges;     /* (edge_count x 2) places, smaller first */
    /* (triangle_count x 3) edge from corner k to the next; -1: an earlier triangle has it */
    int *sides;
    SurfaceCell *cells;
    SurfaceGroup *groups;
    int *group_vertices;
    int *first_group; /* (panel_count + 1) */
    int *panel_of;    /* (places) */
    int *blocks;      /* (panel_count x 2) groups along u, v of a lattice; 0 elsewhere */
} Surface;

/* start: [m] (places x 3); panels stay borrowed. */
Surface surface_create(const SurfacePanel *panels, int panel_count, const double *start,
                       Arena *arena);

static inline const SurfacePanel *surface_panel(const Surface *surface, int place) {
    return &surface->panels[surface->panel_of[place]];
}

/* [m] shortest material distance of two features of a lattice without a common vertex. */
double surface_lattice_altitude(const SurfacePanel *panel);

#endif
