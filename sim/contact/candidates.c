#include "sim/contact/candidates.h"

#include <math.h>
#include <string.h>

#include "sim/contact/constants.h"
#include "sim/contact/lists.h"

Candidates candidates_create(const ContactDef *def, Arena *arena) {
    Candidates c = {.def = def, .arena = arena};
    c.places = places_create(def, arena);
    const Surface *surface = &c.places.surface;
    c.boxes = arena_push(arena, Box, c.places.count);
    c.middles = arena_push(arena, Vec3, c.places.count);
    c.radii = arena_push(arena, double, c.places.count);
    c.from = arena_push(arena, Pose, def->obstacle_count);
    c.to = arena_push(arena, Pose, def->obstacle_count);
    c.distances = arena_push(arena, double, def->vertex_count);
    c.motions = arena_push(arena, double, def->vertex_count);
    c.flatness = flatness_create(surface, arena);
    c.lattice_groups = arena_push(arena, int, surface->group_count);
    for (int g = 0; g < surface->group_count; g++) {
        c.lattice_groups[c.lattice_group_count] = g;
        c.lattice_group_count += surface->panels[surface->groups[g].panel].nu > 0;
    }
    c.groups = arena_push(arena, Box, surface->group_count);
    c.rooms = arena_push(arena, double, surface->group_count);
    c.cells = arena_push(arena, Box, surface->cell_count);
    c.boxed = arena_push(arena, long, surface->group_count);
    Vec3 *centres = arena_push(arena, Vec3, surface->group_count);
    for (int g = 0; g < surface->group_count; g++) {
        const int *place = surface->group_vertices + surface->groups[g].vertex_begin;
        centres[g] = vec3_load(c.places.x + 3 * (size_t)*place);
    }
    c.tree = box_tree_create(centres, surface->group_count, arena);
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
    const SurfacePanel *panel = surface_panel(&c->places.surface, place[0]);
    const SurfacePanel *other = surface_panel(&c->places.surface, place[3]);
    double dhat = 0.5 * (panel->distance + other->distance);
    if (other != panel || panel->nu > 0) {
        return dhat;
    }
    Pair pair = {.kind = kind, .place = {place[0], place[1], place[2], place[3]}};
    return pair_rest_limit(panel, &pair, dhat);
}

/* Are the two features farther apart than the reach, seen along the line between their middles? That
 * is a lower bound of their distance, and cheap. */
static bool seen_apart(const Candidates *c, const int place[4], int first, double reach) {
    Vec3 middle[2] = {{0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < 4; k++) {
        double share = 1.0 / (k < first ? first : 4 - first);
        middle[k >= first] = vec3_axpy(middle[k >= first], share, c->middles[place[k]]);
    }
    Vec3 along = vec3_sub(middle[1], middle[0]);
    double end[2] = {-INFINITY, INFINITY};
    for (int k = 0; k < 4; k++) {
        double at = vec3_dot(along, c->middles[place[k]]);
        end[k >= first] = k < first ? fmax(end[0], at) : fmin(end[1], at);
    }
    double gap = end[1] - end[0];
    return gap > 0.0 && gap * gap > reach * reach * vec3_dot(along, along);
}

static void add_pair(Candidates *c, PairKind kind, int p, int q, int r, int s) {
    Candidate item = {.obstacle = -1, .kind = kind, .place = {p, q, r, s}};
    int first = kind == PAIR_FACE ? 1 : 2;
    double reach = c->def->distance, most[2] = {0.0, 0.0};
    for (int k = 0; k < 4; k++) {
        most[k >= first] = fmax(most[k >= first], c->radii[item.place[k]]);
    }
    reach += most[0] + most[1];
    if (seen_apart(c, item.place, first, reach)) {
        return;
    }
    Points points = {&c->middles[0].x};
    Pair pair = {.kind = kind, .place = {p, q, r, s}};
    pair_evaluate(&points, &pair);
    if (pair.distance <= reach) {
        item.dhat = pair_distance(c, kind, item.place);
        add(c, item);
    }
}

static Box box_of(const Candidates *c, const int *places, int count) {
    Box box = c->boxes[places[0]];
    for (int k = 1; k < count; k++) {
        box = box_union(box, c->boxes[places[k]]);
    }
    return box;
}

static void meet_faces(Candidates *c, const SurfaceCell *owner, const SurfaceCell *faces) {
    double reach = c->def->distance;
    for (int f = 0; f < faces->triangle_count; f++) {
        const int *t = c->places.surface.triangles + 3 * (size_t)faces->triangle[f];
        Box box = box_of(c, t, 3);
        for (int k = 0; k < owner->vertex_count; k++) {
            int v = owner->vertex[k];
            bool apart = v != t[0] && v != t[1] && v != t[2];
            if (apart && box_near(&c->boxes[v], &box, reach)) {
                add_pair(c, PAIR_FACE, v, t[0], t[1], t[2]);
            }
        }
    }
}

static void meet_edges(Candidates *c, const SurfaceCell *a, const SurfaceCell *b) {
    double reach = c->def->distance;
    for (int i = 0; i < a->edge_count; i++) {
        const int *e = c->places.surface.edges + 2 * (size_t)a->edge[i];
        Box box = box_of(c, e, 2);
        for (int j = a == b ? i + 1 : 0; j < b->edge_count; j++) {
            const int *f = c->places.surface.edges + 2 * (size_t)b->edge[j];
            bool apart = e[0] != f[0] && e[0] != f[1] && e[1] != f[0] && e[1] != f[1];
            Box other = box_of(c, f, 2);
            if (apart && box_near(&box, &other, reach)) {
                add_pair(c, PAIR_EDGES, e[0], e[1], f[0], f[1]);
            }
        }
    }
}

static void meet_cells(Candidates *c, int a, int b) {
    const SurfaceCell *p = &c->places.surface.cells[a], *q = &c->places.surface.cells[b];
    meet_faces(c, p, q);
    if (a != b) {
        meet_faces(c, q, p);
    }
    meet_edges(c, p, q);
}

static void box_cells(Candidates *c, int group) {
    if (c->boxed[group] == c->stamp) {
        return;
    }
    c->boxed[group] = c->stamp;
    for (int i = c->places.surface.groups[group].cell_begin;
         i < c->places.surface.groups[group].cell_end; i++) {
        const SurfaceCell *cell = &c->places.surface.cells[i];
        c->cells[i] = box_empty();
        for (int k = 0; k < cell->triangle_count; k++) {
            Box box = box_of(c, c->places.surface.triangles + 3 * (size_t)cell->triangle[k], 3);
            c->cells[i] = box_union(c->cells[i], box);
        }
    }
}

static void meet_groups(int a, int b, void *context) {
    Candidates *c = context;
    const SurfaceGroup *p = &c->places.surface.groups[a], *q = &c->places.surface.groups[b];
    double reach = c->def->distance;
    bool mesh_a = c->places.surface.panels[p->panel].obstacle;
    bool mesh_b = c->places.surface.panels[q->panel].obstacle;
    if ((mesh_a && mesh_b) || !(mesh_a || mesh_b || c->def->self)) {
        return;
    }
    if (flatness_distance(&c->flatness, &c->places.surface, a, b) >
        reach + c->rooms[a] + c->rooms[b]) {
        return;
    }
    box_cells(c, a);
    box_cells(c, b);
    for (int i = p->cell_begin; i < p->cell_end; i++) {
        for (int j = a == b ? i : q->cell_begin; j < q->cell_end; j++) {
            if (box_near(&c->cells[i], &c->cells[j], reach)) {
                meet_cells(c, i, j);
            }
        }
    }
}

static void find_pairs(Candidates *c) {
    for (int g = 0; g < c->places.surface.group_count; g++) {
        const SurfaceGroup *group = &c->places.surface.groups[g];
        c->groups[g] = box_empty();
        c->rooms[g] = 0.0;
        for (int k = group->vertex_begin; k < group->vertex_end; k++) {
            int vertex = c->places.surface.group_vertices[k];
            c->groups[g] = box_union(c->groups[g], c->boxes[vertex]);
            c->rooms[g] = fmax(c->rooms[g], c->radii[vertex]);
        }
    }
    Points middles = {&c->middles[0].x};
    flatness_fit(&c->flatness, &c->places.surface, &middles, c->lattice_groups,
                 c->lattice_group_count);
    box_tree_refit(&c->tree, c->groups);
    for (int g = 0; g < c->places.surface.group_count; g++) {
        meet_groups(g, g, c);
    }
    box_tree_pairs(&c->tree, c->def->distance, meet_groups, c);
}

/* ---- cloth with obstacles ---- */

static void find_touches(Candidates *c, int obstacle) {
    const ContactDef *def = c->def;
    const Solid *solid = &def->obstacles[obstacle].solid;
    for (int i = 0; i < def->vertex_count; i++) {
        Vec3 normal, y = pose_unapply(c->from[obstacle], c->middles[i]);
        Vec3 end = pose_unapply(c->to[obstacle], c->middles[i]);
        c->distances[i] = solid_distance(solid, y, &normal);
        c->motions[i] = vec3_length(vec3_sub(end, y)) + c->radii[i];
    }
    for (int t = 0; t < c->places.surface.triangle_count; t++) {
        const int *corner = c->places.surface.triangles + 3 * (size_t)t;
        double bound = -INFINITY, farthest = 0.0;
        if (corner[0] >= def->vertex_count) {
            break; /* meshes come last */
        }
        for (int k = 0; k < 3; k++) { /* no point of the triangle is farther from a corner */
            Vec3 p = c->middles[corner[k]];
            double longest = 0.0;
            for (int m = 0; m < 3; m++) {
                Vec3 side = vec3_sub(c->middles[corner[m]], p);
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

/* ---- the list ---- */

void candidates_forget(Candidates *c) { c->known = false; }

static bool same_pose(const Pose *a, const Pose *b) { return memcmp(a, b, sizeof *a) == 0; }

static bool box_holds(const Box *box, Vec3 p) {
    return box->low.x <= p.x && p.x <= box->high.x && box->low.y <= p.y && p.y <= box->high.y &&
           box->low.z <= p.z && p.z <= box->high.z;
}

static Vec3 end_of(const double *x, const double *dx, int vertex) {
    Vec3 at = vec3_load(x + 3 * (size_t)vertex);
    return dx ? vec3_add(at, vec3_load(dx + 3 * (size_t)vertex)) : at;
}

/* does the list hold for this motion? */
static bool serves(const Candidates *c, const Pose *poses, const Pose *to, const double *x,
                   const double *dx) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        bool here = same_pose(&poses[o], &c->from[o]) || same_pose(&poses[o], &c->to[o]);
        if (!here || !(same_pose(&to[o], &c->from[o]) || same_pose(&to[o], &c->to[o]))) {
            return false;
        }
    }
    for (int i = 0; i < c->places.count; i++) {
        if (!box_holds(&c->boxes[i], end_of(x, NULL, i)) ||
            !box_holds(&c->boxes[i], end_of(x, dx, i))) {
            return false;
        }
    }
    return true;
}

static void make_boxes(Candidates *c, const double *x, const double *dx) {
    double margin = CONTACT_LIST_MARGIN * c->def->distance;
    for (int i = 0; i < c->places.count; i++) {
        Vec3 p = end_of(x, NULL, i), room = vec3(margin, margin, margin);
        Box box = {p, p};
        box_add(&box, end_of(x, dx, i));
        c->boxes[i] = (Box){vec3_sub(box.low, room), vec3_add(box.high, room)};
        c->middles[i] = vec3_scale(0.5, vec3_add(box.low, box.high));
        c->radii[i] = vec3_length(vec3_sub(c->boxes[i].high, c->middles[i]));
    }
}

void candidates_find(Candidates *c, const Pose *poses, const Pose *to, const double *x,
                     const double *dx) {
    if (c->known && serves(c, poses, to, x, dx)) {
        return;
    }
    size_t bytes = (size_t)c->def->obstacle_count * sizeof *c->from;
    memcpy(c->from, poses, bytes);
    memcpy(c->to, to, bytes);
    make_boxes(c, x, dx);
    c->stamp++;
    c->known = true;
    c->count = 0;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        if (!c->def->obstacles[o].mesh) {
            find_touches(c, o);
        }
    }
    if (c->def->self || c->places.meshes) {
        find_pairs(c);
    }
}
