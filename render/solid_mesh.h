/* solid_mesh.h: triangles and smooth normals of a solid or a mesh, in its own frame. */
#ifndef TOILE_RENDER_SOLID_MESH_H
#define TOILE_RENDER_SOLID_MESH_H

#include <stdint.h>

#include "sim/base/arena.h"
#include "sim/state/state.h"

typedef struct SolidVertex {
    float position[3]; /* [m] */
    float normal[3];   /* unit, outward */
} SolidVertex;

typedef struct SolidMesh {
    int vertex_count, triangle_count;
    SolidVertex *vertices; /* (vertex_count) */
    uint32_t *triangles;   /* (triangle_count x 3), anticlockwise from outside */
    float low[3], high[3]; /* [m] bounding box */
} SolidMesh;

/* plane_extent: [m] half the side of the square that stands for a plane. Sharp edges get a small
 * bevel that catches the light; it lies inside the solid. */
SolidMesh solid_mesh_create(const Solid *solid, double plane_extent, Arena *arena);

/* The triangles of a mesh with its vertices at `vertices` [m] (vertex_count x 3). Each triangle gets
 * three vertices of its own: normals are those of the triangles around a corner, weighted by area,
 * as far as they differ from the triangle's own by less than CREASE. */
#define SOLID_MESH_CREASE 40.0 /* [deg] */
SolidMesh solid_mesh_from_triangles(const StateMesh *mesh, const double *vertices, Arena *arena);

#endif
