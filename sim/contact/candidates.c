#include "sim/contact/candidates.h"

#include <string.h>

#include "sim/contact/constants.h"

Candidates candidates_create(const ContactDef *def, Arena *arena) {
    Candidates c = {.def = def, .arena = arena};
    c.surface = surface_create(def->panels, def->panel_count, def->start, arena);
    c.swept = arena_push(arena, Box, def->vertex_count);
    c.cells = arena_push(arena, Box, c.surface.cell_count);
    c.distances = arena_push(arena, double, def->vertex_count);
    c.motions = arena_push(arena, double, def->vertex_count);
    Vec3 *centres = arena_push(arena, Vec3, c.surface.cell_count);
    for (int i = 0; i < c.surface.cell_count; i++) {
        const int *corner = c.surface.triangles + 3 * (size_t)c.surface.cells[i].triangle[0];
        for (int k = 0; k < 3; k++) {
            centres[i] =
                vec3_axpy(centres[i], 1.0 / 3.0, vec3_load(def->start + 3 * (size_t)corner[k]));
        }
    }
    c.tree = box_tree_create(centres, c.surface.cell_count, arena);
    return c;
}

static void add(Candidates *c, Candidate item) {
    if (c->count == c->room) {
        c->room = 2 * c->room + 4096;
        c->items = arena_grow(c->arena, Candidate, c->items, c->count, c->room);
    }
    c->items[c->count++] = item;
}

/* ---- cloth with cloth ---- */

/* contact distance of a pair; neighbours of one scattered panel may be nearer at rest */
static double pair_distance(const Candidates *c, PairKind kind, const int place[4]) {
    const ContactDef *def = c->def;
    double dhat = 0.5 * (def->vertex_distance[place[0]] + def->vertex_distance[place[3]]);
    const SurfacePanel *panel = surface_panel(&c->surface, place[0]);
    if (surface_panel(&c->surface, place[3]) != panel || panel->nu > 0) {
        return dhat;
    }
    Pair pair = {.kind = kind, .place = {place[0], place[1], place[2], place[3]}};
    return pair_rest_limit(panel, &pair, dhat);
}

static void add_pair(Candidates *c, PairKind kind, int p, int q, int r, int s) {
    Candidate item = {.obstacle = -1, .kind = kind, .place = {p, q, r, s}};
    item.dhat = pair_distance(c, kind, item.place);
    add(c, item);
}

static Box box_of(const Candidates *c, const int *places, int count) {
    Box box = c->swept[places[0]];
    for (int k = 1; k < count; k++) {
        box = box_union(box, c->swept[places[k]]);
    }
    return box;
}

static void meet_faces(Candidates *c, const SurfaceCell *owner, const SurfaceCell *faces) {
    double reach = c->def->distance;
    for (int f = 0; f < faces->triangle_count; f++) {
        const int *t = c->surface.triangles + 3 * (size_t)faces->triangle[f];
        Box box = box_of(c, t, 3);
        for (int k = 0; k < owner->vertex_count; k++) {
            int v = owner->vertex[k];
            bool apart = v != t[0] && v != t[1] && v != t[2];
            if (apart && box_near(&c->swept[v], &box, reach)) {
                add_pair(c, PAIR_FACE, v, t[0], t[1], t[2]);
            }
        }
    }
}

static void meet_edges(Candidates *c, const SurfaceCell *a, const SurfaceCell *b) {
    double reach = c->def->distance;
    for (int i = 0; i < a->edge_count; i++) {
        const int *e = c->surface.edges + 2 * (size_t)a->edge[i];
        Box box = box_of(c, e, 2);
        for (int j = a == b ? i + 1 : 0; j < b->edge_count; j++) {
            const int *f = c->surface.edges + 2 * (size_t)b->edge[j];
            bool apart = e[0] != f[0] && e[0] != f[1] && e[1] != f[0] && e[1] != f[1];
            Box other = box_of(c, f, 2);
            if (apart && box_near(&box, &other, reach)) {
                add_pair(c, PAIR_EDGES, e[0], e[1], f[0], f[1]);
            }
        }
    }
}

static void meet_cells(int a, int b, void *context) {
    Candidates *c = context;
    const SurfaceCell *p = &c->surface.cells[a], *q = &c->surface.cells[b];
    meet_faces(c, p, q);
    if (a != b) {
        meet_faces(c, q, p);
    }
    meet_edges(c, p, q);
}

static void find_pairs(Candidates *c) {
    for (int i = 0; i < c->surface.cell_count; i++) {
        const SurfaceCell *cell = &c->surface.cells[i];
        c->cells[i] = box_empty();
        for (int k = 0; k < cell->triangle_count; k++) {
            Box box = box_of(c, c->surface.triangles + 3 * (size_t)cell->triangle[k], 3);
            c->cells[i] = box_union(c->cells[i], box);
        }
    }
    box_tree_refit(&c->tree, c->cells);
    for (int i = 0; i < c->surface.cell_count; i++) {
        meet_cells(i, i, c);
    }
    box_tree_pairs(&c->tree, c->def->distance, meet_cells, c);
}

/* ---- cloth with obstacles ---- */

static void find_touches(Candidates *c, Pose pose, Pose to, int obstacle, const double *x,
                         const double *dx) {
    const ContactDef *def = c->def;
    const Solid *solid = &def->obstacles[obstacle].solid;
    for (int i = 0; i < def->vertex_count; i++) {
        Vec3 normal, at = vec3_load(x + 3 * (size_t)i), y = pose_unapply(pose, at);
        Vec3 end = dx ? vec3_add(at, vec3_load(dx + 3 * (size_t)i)) : at;
        c->distances[i] = solid_distance(solid, y, &normal);
        c->motions[i] = vec3_length(vec3_sub(pose_unapply(to, end), y));
    }
    for (int t = 0; t < c->surface.triangle_count; t++) {
        const int *corner = c->surface.triangles + 3 * (size_t)t;
        double bound = -INFINITY, farthest = 0.0;
        for (int k = 0; k < 3; k++) { /* no point of the triangle is farther from a corner */
            Vec3 p = vec3_load(x + 3 * (size_t)corner[k]);
            double longest = 0.0;
            for (int m = 0; m < 3; m++) {
                Vec3 side = vec3_sub(vec3_load(x + 3 * (size_t)corner[m]), p);
                longest = fmax(longest, vec3_dot(side, side));
            }
            bound = fmax(bound, c->distances[corner[k]] - sqrt(longest));
            farthest = fmax(farthest, c->motions[corner[k]]);
        }
        double dhat = def->vertex_distance[corner[0]];
        if (bound - farthest < dhat) {
            add(c, (Candidate){.obstacle = obstacle,
                               .place = {corner[0], corner[1], corner[2], -1},
                               .dhat = dhat});
        }
    }
}

void candidates_find(Candidates *c, const Pose *poses, const Pose *to, const double *x,
                     const double *dx) {
    c->count = 0;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        find_touches(c, poses[o], to[o], o, x, dx);
    }
    if (!c->def->self) {
        return;
    }
    for (int i = 0; i < c->def->vertex_count; i++) {
        Vec3 p = vec3_load(x + 3 * (size_t)i);
        c->swept[i] = (Box){p, p};
        if (dx) {
            box_add(&c->swept[i], vec3_add(p, vec3_load(dx + 3 * (size_t)i)));
        }
    }
    find_pairs(c);
}
