/* apart_parts.h: inside of apart.h. */
#ifndef TOILE_RENDER_APART_PARTS_H
#define TOILE_RENDER_APART_PARTS_H

#include "render/apart.h"
#include "sim/geom/box_tree.h"

/* What a frame says about a triangle. */
typedef struct ApartTriangle {
    Vec3 corner[3], normal; /* [m]; unit */
    double reach;           /* [m] largest |e| */
    double rise, fall;      /* [m] largest e along the normal and against it */
    double slope;           /* bound of |d(g e)/ds| at g = 1 */
    double most;            /* g of the triangle */
    int sewn; /* sides and corners that are part of a seam, see apart_seams.c; for good */
} ApartTriangle;

/* Sides of two triangles that are one edge. */
typedef struct ApartSeam {
    int triangle[2], side[2];
} ApartSeam;

struct Apart {
    int triangle_count, vertex_count;
    bool derivatives;    /* in the vertices, in place of normal and tangent */
    const Piece *pieces; /* (triangle_count) */
    const int32_t *join; /* (vertex_count) vertices that are one node, as along a seam, are one */
    ApartTriangle *triangles; /* (triangle_count) */
    int *first_leave;         /* (triangle_count + 1) of each triangle in `leaves` */
    float *leaves;            /* [m] e of the drawn vertices (first_leave[triangle_count] x 3) */
    double *most;             /* g (vertex_count) of the joined vertices */
    /* [m] (triangle_count) u, v of the second and third corner from the first */
    double (*sides)[4];
    Vec3 (*frames)[2]; /* (vertex_count) mean derivatives along u and v of the triangles around */
    double *areas;     /* [m2] (vertex_count) twice their area on the panel */
    int seam_count;
    ApartSeam *seams; /* (seam_count) */
    BoxTree tree;
    Box *boxes; /* (triangle_count) */
};

static inline int piece_vertex_count(const Piece *p) { return (p->level + 1) * (p->level + 2) / 2; }

static inline int piece_vertex(const Piece *p, int i, int j) {
    return p->origin + i * p->step[0] + j * p->step[1] - (p->packed ? j * (j - 1) / 2 : 0);
}

static inline float *apart_leaves(const Apart *apart, int t) {
    return apart->leaves + 3 * (size_t)apart->first_leave[t];
}

/* apart_pairs.c: a bound of |d(g e)/ds| on a triangle at g <= 1. */
double apart_slope(const Apart *apart, int t);

/* The gradient of g e at g = 1 on a triangle, when all is seen along one direction. */
typedef struct ApartStrain {
    double loss; /* largest share of a length lost; from 1 on the surface may fold over */
    double size; /* bound of its norm */
} ApartStrain;

/* apart_pairs.c; off: the direction, unit. */
ApartStrain apart_strain(const Apart *apart, int t, Vec3 off);

/* g that keeps a loss below 1, with some margin. */
double apart_share(double loss);

/* apart_pairs.c: lowers `most` of two triangles whose boxes meet. */
void apart_limit(Apart *apart, int a, int b);

/* apart_seams.c: finds them; brings e on both sides to the mean; is a drawn vertex on one? */
void apart_find_seams(Apart *apart, Arena *arena);
void apart_sew(Apart *apart);
bool apart_is_sewn(const Apart *apart, int t, int i, int j);

#endif
