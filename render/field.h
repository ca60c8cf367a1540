/* field.h: what a moving surface does at its vertices: normal, strain, curvature.
 *
 * The mesh carries material coordinates (u along warp, v along weft, [m]). In each triangle the
 * position is linear in (u, v), with derivatives x_u, x_v; the numbers of a vertex are means over
 * its triangles, weighted by their areas on the panel. First order in the size of a triangle.
 *
 *   strain      |x_u| - 1, |x_v| - 1, and the shear angle asin(x_u . x_v / |x_u| |x_v|) [rad]
 *   error       how wrong the strain may be: a triangle has one strain e, the means at its corners a linear one e*;
 *               eta^2 is the mean over the triangle of |e* - e|^2, |e|^2 = warp^2 + weft^2 + shear^2 / 2, and a
 *               vertex has the root of its triangles' mean [Zienkiewicz and Zhu 1987, Int. J. Numer. Meth. Eng. 24].
 *               Of first order in h: 0 where the strain is the same everywhere
 *   curvature   -n_u . x_u, -n_v . x_v, -(n_u . x_v + n_v . x_u) / 2 [1/m], n the unit normal of the
 *               face side: positive where the cloth curves towards it
 */
#ifndef TOILE_RENDER_FIELD_H
#define TOILE_RENDER_FIELD_H

#include <stdint.h>

#include "sim/base/arena.h"
#include "sim/state/state.h"

typedef struct FieldMesh {
    int vertex_count, triangle_count;
    const double *uv;         /* [m] (vertex_count x 2) */
    const int32_t *triangles; /* (triangle_count x 3), anticlockwise seen from the face side */
    double period;            /* [m] of u, where the panel closes on itself; 0: it does not */
} FieldMesh;

/* The surface of one cloth, with vertex numbers from 0. */
FieldMesh field_mesh_create(const StateLayout *layout, int cloth, Arena *arena);

typedef struct Field {
    double *normal;    /* unit (vertex_count x 3) */
    double *strain;    /* (vertex_count x 3) warp, weft, shear [rad] */
    double *curvature; /* [1/m] (vertex_count x 3) warp, weft, twist */
    double *weight;    /* [m2] (vertex_count) scratch */
} Field;

Field field_create(int vertex_count, Arena *arena);

/* x: [m] (vertex_count x 3). Vertices without a triangle get zeros. */
void field_find_normals(const FieldMesh *mesh, const double *x, Field *field);
/* error: (vertex_count); fills the rest too. */
void field_find_errors(const FieldMesh *mesh, const double *x, Field *field, double *error);
/* area: [m2] (vertex_count) of the panel: a vertex has a third of each of its triangles. */
void field_find_areas(const FieldMesh *mesh, double *area);
/* All but the error. */
void field_compute(const FieldMesh *mesh, const double *x, Field *field);

#endif
