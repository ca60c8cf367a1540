#include "sim/layout.h"

#include <stdio.h>
#include <string.h>

static const StateMesh *mesh_of(const MeshDef *def, Arena *arena) {
    StateMesh *mesh = arena_push(arena, StateMesh, 1);
    *mesh = (StateMesh){.vertex_count = def->vertex_count,
                        .triangle_count = def->triangle_count,
                        .vertices = def->vertices,
                        .triangles = def->triangles,
                        .moves = def->frame_count > 1,
                        .closed = def->closed};
    return mesh;
}

const double *layout_moved(const Scene *scene, const double *times, Arena *arena, int *count) {
    int total = 0;
    for (int o = 0; o < scene->obstacle_count; o++) {
        const MeshDef *mesh = scene->obstacles[o].mesh;
        total += mesh && mesh->frame_count > 1 ? mesh->vertex_count : 0;
    }
    double *moved = arena_push(arena, double, 3 * (size_t)total), *at = moved;
    for (int o = 0; o < scene->obstacle_count; o++) {
        const MeshDef *mesh = scene->obstacles[o].mesh;
        if (mesh && mesh->frame_count > 1) {
            mesh_positions(mesh, times[o], at);
            at += 3 * (size_t)mesh->vertex_count;
        }
    }
    *count = total;
    return moved;
}

StateHeader layout_header(const Sim *sim, Arena *arena) {
    const Scene *scene = sim->scene;
    StateCloth *cloths = arena_push(arena, StateCloth, scene->cloth_count);
    for (int c = 0; c < scene->cloth_count; c++) {
        const ClothDef *def = &scene->cloths[c];
        snprintf(cloths[c].name, STATE_WORD_SIZE, "%s", def->name);
        snprintf(cloths[c].fabric, STATE_WORD_SIZE, "%s", def->fabric.name);
        snprintf(cloths[c].look, STATE_WORD_SIZE, "%s", def->look);
        cloths[c].print = def->print;
        cloths[c].thickness = sim->system.cloths[c].material.thickness;
    }
    StateObstacle *obstacles = arena_push(arena, StateObstacle, scene->obstacle_count);
    for (int o = 0; o < scene->obstacle_count; o++) {
        const ObstacleDef *def = &scene->obstacles[o];
        snprintf(obstacles[o].name, STATE_WORD_SIZE, "%s", def->name);
        snprintf(obstacles[o].look, STATE_WORD_SIZE, "%s", def->look);
        obstacles[o].solid = def->solid;
        obstacles[o].mesh = def->mesh ? mesh_of(def->mesh, arena) : NULL;
    }
    return (StateHeader){.program = "toile " TOILE_VERSION,
                         .scene_path = scene->path,
                         .scene_text = scene->text,
                         .scene_hash = sim->hash,
                         .film = scene->film,
                         .cloth_count = scene->cloth_count,
                         .cloths = cloths,
                         .obstacle_count = scene->obstacle_count,
                         .obstacles = obstacles};
}

/* running totals of nodes, vertices, triangles, loops over the cloths */
static void fill_ranges(const System *system, int32_t *nodes, int32_t *vertices, int32_t *triangles,
                        int32_t *loops) {
    for (int c = 0; c < system->cloth_count; c++) {
        const Panel *p = &system->cloths[c].panel;
        nodes[c + 1] = nodes[c] + p->node_count;
        vertices[c + 1] = vertices[c] + p->vertex_count;
        triangles[c + 1] = triangles[c] + p->triangle_count;
        loops[c + 1] = loops[c] + p->loop_count;
    }
}

static void fill_cloth(const System *system, int c, StateLayout *l, double *material, double *rest,
                       int32_t *triangles, int32_t *lattice) {
    const Cloth *cloth = &system->cloths[c];
    const Panel *p = &cloth->panel;
    int first = l->node_begin[c], first_triangle = l->triangle_begin[c];
    int32_t shape[4] = {p->nu, p->nv, p->wrap, 0};
    memcpy(lattice + 4 * c, shape, sizeof shape);
    memcpy(material + 2 * first, p->material, 2 * (size_t)p->node_count * sizeof(double));
    for (int i = 0; i < p->node_count; i++) {
        vec3_store(rest + 3 * (first + i),
                   pose_apply(cloth->def->pose, vec3_load(p->start + 3 * i)));
    }
    for (int k = 0; k < 3 * p->triangle_count; k++) {
        triangles[3 * first_triangle + k] = l->vertex_begin[c] + p->vertex_triangles[k];
    }
}

static void fill_outlines(const System *system, StateLayout *l, Arena *arena) {
    int points = 0;
    for (int c = 0; c < system->cloth_count; c++) {
        const Panel *p = &system->cloths[c].panel;
        points += p->outline_begin[p->loop_count];
    }
    double *outline = arena_push(arena, double, 2 * points);
    int32_t *begin = arena_push(arena, int32_t, l->loop_count + 1);
    int at = 0;
    for (int c = 0; c < system->cloth_count; c++) {
        const Panel *p = &system->cloths[c].panel;
        int count = p->outline_begin[p->loop_count];
        memcpy(outline + 2 * at, p->outline, 2 * (size_t)count * sizeof *outline);
        for (int k = 0; k < p->loop_count; k++) {
            begin[l->loop_begin[c] + k + 1] = at + p->outline_begin[k + 1];
        }
        at += count;
    }
    l->outline_count = points;
    l->outline = outline;
    l->outline_begin = begin;
}

/* places of the vertices, and the rows of W: one node each, or the identity */
static void fill_vertices(const System *system, StateLayout *l, Arena *arena) {
    double *material = arena_push(arena, double, 2 * l->vertex_count);
    for (int c = 0; c < system->cloth_count; c++) {
        const Panel *p = &system->cloths[c].panel;
        memcpy(material + 2 * l->vertex_begin[c], p->vertex_material,
               2 * (size_t)p->vertex_count * sizeof *material);
    }
    l->vertex_material = material;
    if (l->vertex_count == l->node_count) {
        return;
    }
    int32_t *start = arena_push(arena, int32_t, l->vertex_count + 1);
    int32_t *column = arena_push(arena, int32_t, l->vertex_count);
    double *value = arena_push(arena, double, l->vertex_count);
    for (int c = 0; c < system->cloth_count; c++) {
        for (int i = l->vertex_begin[c]; i < l->vertex_begin[c + 1]; i++) {
            start[i + 1] = i + 1;
            column[i] =
                l->node_begin[c] + panel_node(&system->cloths[c].panel, i - l->vertex_begin[c]);
            value[i] = 1.0;
        }
    }
    l->w_count = l->vertex_count;
    l->w_start = start, l->w_column = column, l->w_value = value;
}

StateLayout layout_make(const System *system, Arena *arena) {
    int cloths = system->cloth_count;
    int32_t *nodes = arena_push(arena, int32_t, cloths + 1);
    int32_t *triangle_begin = arena_push(arena, int32_t, cloths + 1);
    int32_t *loops = arena_push(arena, int32_t, cloths + 1);
    int32_t *vertices = arena_push(arena, int32_t, cloths + 1);
    fill_ranges(system, nodes, vertices, triangle_begin, loops);
    StateLayout l = {.cloth_count = cloths,
                     .node_count = nodes[cloths],
                     .vertex_count = vertices[cloths],
                     .triangle_count = triangle_begin[cloths],
                     .node_begin = nodes,
                     .vertex_begin = vertices,
                     .triangle_begin = triangle_begin,
                     .loop_begin = loops,
                     .loop_count = loops[cloths]};
    double *material = arena_push(arena, double, 2 * l.node_count);
    double *rest = arena_push(arena, double, 3 * l.node_count);
    int32_t *triangles = arena_push(arena, int32_t, 3 * l.triangle_count);
    int32_t *lattice = arena_push(arena, int32_t, 4 * cloths);
    for (int c = 0; c < cloths; c++) {
        fill_cloth(system, c, &l, material, rest, triangles, lattice);
    }
    l.material = material;
    fill_vertices(system, &l, arena);
    l.rest = rest;
    l.triangles = triangles;
    l.lattice = lattice;
    fill_outlines(system, &l, arena);
    return l;
}
