/* panel.h: the rest state of one cloth: its nodes, triangles and outlines in material space.
 *
 * Lattice nodes are numbered row after row: node (i, j) is j * nu + i; u runs along warp. */
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
    double *material; /* [m] (node_count x 2) */
    double *start;    /* [m] (node_count x 3) start positions in the panel's own frame */
    double *area;     /* [m2] (node_count) share of the panel */
    int triangle_count;
    int *triangles; /* (triangle_count x 3) anticlockwise in material space */
    int loop_count;
    int *outline_begin;       /* (loop_count + 1) */
    double *outline;          /* [m] (points x 2) */
    double rest_curvature[2]; /* [1/m] along u, along v */
} Panel;

/* Errors: EXIT_BAD_INPUT when the shape cannot be meshed. */
bool panel_create(const ClothDef *def, uint64_t seed, Arena *arena, Panel *panel, Error *error);

/* Marks the nodes of a handle's region with 1; returns how many. */
int panel_select(const Panel *panel, const HandleDef *handle, unsigned char *marks);

/* [m] the spacing that a cloth asks for by `accuracy`: the tip error of heavy cantilevers with
 * rho g L^3 / D = 1 .. 1000 stays below 20 % (h / c)^2, c the bending length of the softer
 * direction (test_mlpg.c compares promise and truth). 0 when the cloth does not ask. */
double panel_accurate_spacing(const ClothDef *def);

/* Number of nodes that panel_create would make, for estimates. */
int panel_node_estimate(const ClothDef *def);

#endif
