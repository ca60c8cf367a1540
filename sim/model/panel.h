/* panel.h: the rest state of one cloth: its nodes, triangles and outlines in material space.
 *
 * Lattice nodes are numbered row after row: node (i, j) is j * nu + i; u runs along warp.
 *
 * A garment has more vertices than nodes: along a seam a node is one vertex of each panel, with a
 * place (u, v) on each. Elsewhere vertices are nodes. */
#ifndef TOILE_MODEL_PANEL_H
#define TOILE_MODEL_PANEL_H

#include "sim/base/arena.h"
#include "sim/base/error.h"
#include "sim/scene/scene.h"

#define PANEL_MOST_NODES 4000000 /* of one cloth */

typedef struct Panel {
    int nu, nv;    /* lattice; 0, 0 for scattered nodes */
    bool wrap;     /* u runs around: node (nu, j) is node (0, j) */
    double h1, h2; /* [m] lattice spacing; scattered: mean spacing in both */
    int node_count;
    double *material; /* [m] (node_count x 2); on a seam that of one of its vertices */
    double *start;    /* [m] (node_count x 3) start positions in the panel's own frame */
    double *area;     /* [m2] (node_count) share of the panel */
    int triangle_count;
    int *triangles; /* (triangle_count x 3) nodes, anticlockwise in material space */
    int vertex_count;
    const int *vertex_node;        /* (vertex_count); NULL: vertex i is node i */
    const double *vertex_material; /* [m] (vertex_count x 2) */
    const int *vertex_triangles;   /* (triangle_count x 3) vertices */
    const int *corner; /* (points of the shape's outline) their vertices; NULL but for garments */
    const unsigned char *ends; /* (vertex_count) of a garment: 1 along the top of a panel, 2 along
                                  its bottom; of a mesh: 4 along a free border */
    int loop_count;
    int *outline_begin;       /* (loop_count + 1) */
    double *outline;          /* [m] (points x 2) */
    double rest_curvature[2]; /* [1/m] along u, along v */
} Panel;

/* Errors: EXIT_BAD_INPUT when the shape cannot be meshed. */
bool panel_create(const ClothDef *def, uint64_t seed, Arena *arena, Panel *panel, Error *error);

static inline int panel_node(const Panel *panel, int vertex) {
    return panel->vertex_node ? panel->vertex_node[vertex] : vertex;
}

/* Marks the nodes of a handle's region with 1; returns how many. */
int panel_select(const Panel *panel, const HandleDef *handle, unsigned char *marks);

/* [m] the spacing that a cloth asks for by `accuracy`: the tip error of heavy cantilevers with
 * rho g L^3 / D = 1 .. 1000 stays below 20 % (h / c)^2, c the bending length of the softer
 * direction (test_mlpg.c compares promise and truth). 0 when the cloth does not ask. */
double panel_accurate_spacing(const ClothDef *def);

#endif
