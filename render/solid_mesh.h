/* solid_mesh.h: triangles and smooth normals of a solid, in the solid's own frame. */
#ifndef TOILE_RENDER_SOLID_MESH_H
#define TOILE_RENDER_SOLID_MESH_H

#include <stdint.h>

#include "sim/base/arena.h"
#include "sim/geom/solid.h"

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

#endif
