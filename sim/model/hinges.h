/* hinges.h: bending of triangle meshes by the angles between neighbouring triangles.
 *
 * An edge turns by theta (zero when flat, positive when its outer corners rise along the normal).
 * An element measures curvatures k = sum over its edges of c (theta - theta0) and stores
 * A/2 k' D k. Three kinds of elements:
 *   tensor: a triangle with its three edges, c = l w/A (m1 m1, m2 m2, 2 m1 m2), m the edge's normal
 *           in the cloth, w the triangle's share of the edge. On lattices with one diagonal and on
 *           equilateral meshes exact for uniform curvature;
 *   morley: the same with w = 1/2 and a free scalar psi per inner edge, c (theta - theta0 +- psi),
 *           + left, - right of it: how far the slope across the edge is from the mean of both sides.
 *           Exact for uniform curvature, and a plate, on any mesh. psi has no mass: it is where the
 *           energy is least, which a constant matrix says. The tangent is that of `tensor`, which holds
 *           psi at (2 w - 1) (theta - theta0) and so is never softer: in time steps as many iterations
 *           as with three more unknowns a node, each a third as long;
 *   hinge:  one edge, with the rigidity across it, B(m) l^2/(A1 + A2): what is usually called
 *           bending, and no plate: up to 3 times too stiff by direction, and no better when refined.
 * A free border edge has no moment across it: D is condensed. A clamped one turns against the wall,
 * over half a length: full share, and no psi.
 */
#ifndef TOILE_MODEL_HINGES_H
#define TOILE_MODEL_HINGES_H

#include "sim/model/model.h"
#include "sim/solve/triangular.h"

typedef struct HingeEdge {
    int node[5];     /* ends, opposite corners left and right; a wall: two ghosts on the right; else
                         the last is -1 */
    int triangle[2]; /* left, right; -1: border */
    bool wall;       /* clamped border */
    int director;    /* its psi; -1: none */
    struct {
        double length;    /* [m] at rest */
        double normal[2]; /* unit, from the left to the right triangle, in the cloth */
    } side[2];   /* as the left and the right triangle see it: on a seam two places of the cloth */
    double rest; /* [rad] theta0 */
} HingeEdge;

enum { HINGE_NODES = 6 };

typedef struct HingeElement {
    int edge_count, edge[3];
    double c[3][3];          /* of each edge */
    double side[3];          /* of each edge: sign of its psi; 0: it has none */
    double tangent[3];       /* of each edge: c in the tangent / c */
    double d[6];             /* A times D11 D12 D13 D22 D23 D33 */
    int node_count;          /* unknowns only */
    int node[HINGE_NODES];   /* (node_count) */
    signed char local[3][4]; /* edge corners among them; -1: a ghost */
    int place;               /* first of node_count (node_count + 1) / 2 places */
} HingeElement;

/* An edge at some x. */
typedef struct HingeTurn {
    Vec3 up[2];     /* [1/m] unit normals of both triangles / their heights */
    double foot[2]; /* of the heights, along the edge, 0 .. 1 */
    double angle;   /* [rad] theta - theta0 */
} HingeTurn;

typedef struct Hinges {
    int edge_count, element_count;
    HingeEdge *edges;
    HingeElement *elements;
    HingeTurn *turns; /* (edge_count) of the last call */
    double *moment;   /* [N m] (edge_count) */
    int director_count;
    double *director;       /* [rad] (director_count) psi of the last call */
    Triangular elimination; /* of psi */
    BlockPlace *places;
} Hinges;

/* `triangles`: (triangle_count x 3) vertices, anticlockwise in material space. Two triangles with
 * two nodes in common share an edge. `kind`: tensor, morley or hinge. False: triangles so thin that
 * morley's psi cannot be found. */
bool hinges_create(const Cloth *cloth, const int *triangles, int triangle_count, BendingKind kind,
                   Arena *arena, Hinges *hinges);

/* [m] from vertex a to b in material space; the nearest image on a sleeve */
void hinges_difference(const Panel *panel, int a, int b, double d[2]);

/* director: the psi of least energy at turns[].angle */
void hinges_find_directors(const Hinges *hinges);
double hinges_energy(const Hinges *hinges, const double *x);
void hinges_add_gradient(const Hinges *hinges, const double *x, double *gradient);
int hinges_couple(const Hinges *hinges, int *pairs);
void hinges_bind(Hinges *hinges, const BlockMatrix *matrix, int first, Arena *arena);
/* J'DJ; what the moments do to the second derivative of the angles is left out. */
void hinges_add_hessian(const Hinges *hinges, const double *x, double *values);

#endif
