#include "sim/contact/places.h"

#include <math.h>
#include <string.h>

static void count_places(Places *p, const ContactDef *def, Arena *arena, int *meshes) {
    p->mesh_first = arena_push(arena, int, def->obstacle_count + 1);
    p->count = def->vertex_count;
    *meshes = 0;
    for (int o = 0; o < def->obstacle_count; o++) {
        const MeshDef *mesh = def->obstacles[o].mesh;
        p->mesh_first[o] = p->count;
        p->count += mesh ? mesh->vertex_count : 0;
        *meshes += mesh != NULL;
    }
    p->mesh_first[def->obstacle_count] = p->count;
    p->meshes = *meshes > 0;
}

Places places_create(const ContactDef *def, Arena *arena) {
    Places places = {0};
    int meshes, p = def->panel_count;
    count_places(&places, def, arena, &meshes);
    int count = def->panel_count + meshes;
    SurfacePanel *panels = arena_push(arena, SurfacePanel, count);
    places.obstacle_of = arena_push(arena, int, count);
    memset(places.obstacle_of, -1, (size_t)count * sizeof *places.obstacle_of);
    memcpy(panels, def->panels, (size_t)def->panel_count * sizeof *panels);
    places.x = arena_push(arena, double, 3 * places.count);
    memcpy(places.x, def->start, 3 * (size_t)def->vertex_count * sizeof *places.x);
    for (int o = 0; o < def->obstacle_count; o++) {
        const ContactObstacle *obstacle = &def->obstacles[o];
        if (!obstacle->mesh) {
            continue;
        }
        memcpy(places.x + 3 * (size_t)places.mesh_first[o], obstacle->mesh->vertices,
               3 * (size_t)obstacle->mesh->vertex_count * sizeof *places.x);
        places.obstacle_of[p] = o;
        panels[p++] = (SurfacePanel){.first = places.mesh_first[o],
                                     .vertex_count = obstacle->mesh->vertex_count,
                                     .triangle_count = obstacle->mesh->triangle_count,
                                     .triangles = obstacle->mesh->triangles,
                                     .distance = def->distance,
                                     .mass = INFINITY,
                                     .obstacle = true,
                                     .still = !obstacle->moves};
    }
    places.surface = surface_create(panels, count, places.x, arena);
    return places;
}

void places_pose(const ContactObstacle *obstacle, Pose pose, double clock, double *x) {
    mesh_positions(obstacle->mesh, clock, x);
    for (int i = 0; i < obstacle->mesh->vertex_count; i++) {
        vec3_store(x + 3 * i, pose_apply(pose, vec3_load(x + 3 * i)));
    }
}
