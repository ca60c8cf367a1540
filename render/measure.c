#include "render/measure.h"

#include "sim/geom/crossing.h"

/* "sheet at (0.120, 0.300) m": the middle of a triangle on its panel */
static void describe(const StateHeader *header, const StateLayout *layout, int triangle, char *text,
                     size_t size) {
    int cloth = 0;
    while (cloth + 1 < layout->cloth_count && triangle >= layout->triangle_begin[cloth + 1]) {
        cloth++;
    }
    double middle[2] = {0, 0};
    for (int k = 0; k < 3; k++) {
        const double *uv =
            layout->vertex_material + 2 * (size_t)layout->triangles[3 * triangle + k];
        middle[0] += uv[0] / 3.0;
        middle[1] += uv[1] / 3.0;
    }
    snprintf(text, size, "%s at (%.4f, %.4f) m", header->cloths[cloth].name, middle[0], middle[1]);
}

static void count_cloth(const StateHeader *header, const StateLayout *layout,
                        const CrossingMesh *mesh, Arena *arena, MeasureCrossings *found) {
    Crossings pairs = crossing_count_self(mesh, arena);
    found->cloth = pairs.count;
    if (pairs.count > 0) {
        char one[MEASURE_PLACE_SIZE / 2 - 8], other[MEASURE_PLACE_SIZE / 2 - 8];
        describe(header, layout, pairs.first[0], one, sizeof one);
        describe(header, layout, pairs.first[1], other, sizeof other);
        snprintf(found->place, sizeof found->place, "%s and %s", one, other);
    }
}

/* Cloths that are inside as a whole: no triangle crosses, so one vertex tells. */
static void add_swallowed(const StateLayout *layout, const CrossingMesh *cloth,
                          const CrossingMesh *mesh, Crossings *found) {
    for (int c = 0; c < layout->cloth_count; c++) {
        int begin = layout->triangle_begin[c], end = layout->triangle_begin[c + 1];
        const double *vertex = cloth->vertices + 3 * (size_t)layout->vertex_begin[c];
        if (end > begin && crossing_point_inside(mesh, vertex)) {
            found->first[0] = found->count ? found->first[0] : begin;
            found->count += end - begin;
        }
    }
}

/* the mesh of an obstacle where it is in this frame */
static Crossings count_mesh(const StateLayout *layout, const CrossingMesh *cloth,
                            const StateMesh *mesh, const double *vertices, Pose pose,
                            Arena *arena) {
    double *placed = arena_push(arena, double, 3 * (size_t)mesh->vertex_count);
    for (int i = 0; i < mesh->vertex_count; i++) {
        vec3_store(placed + 3 * (size_t)i, pose_apply(pose, vec3_load(vertices + 3 * (size_t)i)));
    }
    CrossingMesh other = {mesh->vertex_count, mesh->triangle_count, placed, mesh->triangles};
    Crossings found = crossing_count_between(cloth, &other, arena);
    if (found.count == 0 && mesh->closed) {
        add_swallowed(layout, cloth, &other, &found);
    }
    return found;
}

static void count_obstacle(const StateHeader *header, const StateLayout *layout,
                           const CrossingMesh *mesh, const StateFrame *frame, int index,
                           Arena *arena, MeasureCrossings *found) {
    const StateObstacle *obstacle = &header->obstacles[index];
    Pose pose = frame->pose[index];
    Crossings inside = obstacle->mesh
                           ? count_mesh(layout, mesh, obstacle->mesh,
                                        state_mesh_vertices(header, frame, index), pose, arena)
                           : crossing_count_solid(mesh, &obstacle->solid, pose);
    found->obstacle[index] = inside.count;
    found->obstacles += inside.count;
    if (inside.count > 0 && !found->place[0]) {
        char one[MEASURE_PLACE_SIZE / 2];
        describe(header, layout, inside.first[0], one, sizeof one);
        snprintf(found->place, sizeof found->place, "%s in %s", one, obstacle->name);
    }
}

/* Triangles by which cloth is judged: vertices that are one node, as along a seam, are one. */
static const int32_t *join_seams(const StateLayout *l, Arena *arena) {
    if (l->w_count != l->vertex_count) {
        return l->triangles;
    }
    int32_t *first = arena_push(arena, int32_t, l->node_count); /* vertex of a node, + 1 */
    int32_t *triangles = arena_push(arena, int32_t, 3 * (size_t)l->triangle_count);
    for (int i = l->vertex_count - 1; i >= 0; i--) {
        if (l->w_start[i + 1] - l->w_start[i] != 1 || l->w_value[l->w_start[i]] != 1.0) {
            return l->triangles;
        }
        first[l->w_column[l->w_start[i]]] = i + 1;
    }
    for (int k = 0; k < 3 * l->triangle_count; k++) {
        triangles[k] = first[l->w_column[l->w_start[l->triangles[k]]]] - 1;
    }
    return triangles;
}

bool measure_crossings(const StateHeader *header, const StateLayout *layout,
                       const StateFrame *frame, Arena *arena, MeasureCrossings *found,
                       Error *error) {
    *found = (MeasureCrossings){.obstacle = arena_push(arena, int64_t, header->obstacle_count)};
    ArenaMark mark = arena_mark(arena);
    double *surface = arena_push(arena, double, 3 * layout->vertex_count);
    state_surface(layout, frame->x, surface);
    CrossingMesh mesh = {layout->vertex_count, layout->triangle_count, surface,
                         join_seams(layout, arena)};
    const char *damage = crossing_find_damage(&mesh);
    if (damage) {
        return error_set(error, EXIT_BAD_INPUT, "frame %d: %s", frame->frame, damage);
    }
    count_cloth(header, layout, &mesh, arena, found);
    for (int i = 0; i < header->obstacle_count; i++) {
        count_obstacle(header, layout, &mesh, frame, i, arena, found);
    }
    arena_rewind(arena, mark);
    return true;
}
