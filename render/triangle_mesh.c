/* Normals for the triangles of a mesh: smooth where it is round, sharp at its creases. */
#include <math.h>

#include "render/solid_mesh.h"

/* Which triangles meet at each vertex: rows of `list`, as in a sparse matrix. */
typedef struct Fans {
    int *begin; /* (vertex_count + 1) */
    int *list;  /* (3 triangle_count) */
} Fans;

static Fans find_fans(const StateMesh *mesh, Arena *arena) {
    Fans fans = {arena_push(arena, int, mesh->vertex_count + 1),
                 arena_push(arena, int, 3 * mesh->triangle_count)};
    int *filled = arena_push(arena, int, mesh->vertex_count);
    for (int i = 0; i < 3 * mesh->triangle_count; i++) {
        fans.begin[mesh->triangles[i] + 1]++;
    }
    for (int v = 0; v < mesh->vertex_count; v++) {
        fans.begin[v + 1] += fans.begin[v];
    }
    for (int i = 0; i < 3 * mesh->triangle_count; i++) {
        int v = mesh->triangles[i];
        fans.list[fans.begin[v] + filled[v]++] = i / 3;
    }
    return fans;
}

/* twice the area, along the normal */
static Vec3 area_of(const StateMesh *mesh, const double *vertices, int triangle) {
    Vec3 p[3];
    for (int k = 0; k < 3; k++) {
        p[k] = vec3_load(vertices + 3 * (size_t)mesh->triangles[3 * triangle + k]);
    }
    return vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
}

static Vec3 corner_normal(const Fans *fans, const Vec3 *areas, int vertex, int triangle) {
    const double least = cos(SOLID_MESH_CREASE * PI / 180.0);
    Vec3 own = vec3_unit(areas[triangle], vec3(0, 0, 1)), sum = {0, 0, 0};
    for (int i = fans->begin[vertex]; i < fans->begin[vertex + 1]; i++) {
        Vec3 area = areas[fans->list[i]];
        if (vec3_dot(area, own) >= least * vec3_length(area)) {
            sum = vec3_add(sum, area);
        }
    }
    return vec3_unit(sum, own);
}

SolidMesh solid_mesh_from_triangles(const StateMesh *mesh, const double *vertices, Arena *arena) {
    SolidMesh out = {.vertex_count = 3 * mesh->triangle_count,
                     .triangle_count = mesh->triangle_count,
                     .low = {INFINITY, INFINITY, INFINITY},
                     .high = {-INFINITY, -INFINITY, -INFINITY}};
    out.vertices = arena_push(arena, SolidVertex, out.vertex_count);
    out.triangles = arena_push(arena, uint32_t, 3 * out.triangle_count);
    Vec3 *areas = arena_push(arena, Vec3, mesh->triangle_count);
    Fans fans = find_fans(mesh, arena);
    for (int i = 0; i < mesh->triangle_count; i++) {
        areas[i] = area_of(mesh, vertices, i);
    }
    for (int i = 0; i < out.vertex_count; i++) {
        int vertex = mesh->triangles[i];
        const double *p = vertices + 3 * (size_t)vertex;
        Vec3 n = corner_normal(&fans, areas, vertex, i / 3);
        out.triangles[i] = (uint32_t)i;
        out.vertices[i] = (SolidVertex){{(float)p[0], (float)p[1], (float)p[2]},
                                        {(float)n.x, (float)n.y, (float)n.z}};
        for (int k = 0; k < 3; k++) {
            out.low[k] = fminf(out.low[k], (float)p[k]);
            out.high[k] = fmaxf(out.high[k], (float)p[k]);
        }
    }
    return out;
}
