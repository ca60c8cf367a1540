#include "sim/geom/untangle.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/geom/box_tree.h"

#define MOST_ROUNDS 100 /* what parts at all takes some ten */

/* An edge of a triangle; face[1] is -1 at a rim. */
typedef struct Edge {
    int end[2]; /* the smaller first */
    int face[2];
} Edge;

/* An edge that pierces a triangle. */
typedef struct Pierced {
    int edge, triangle;
} Pierced;

typedef struct Tangle {
    const CrossingMesh *mesh;
    Arena *arena;
    double *x, gap;
    Edge *edges;
    int edge_count;
    int *edge_of; /* (triangle_count x 3) edge from corner k to the next */
    BoxTree tree;
    Box *boxes; /* (triangle_count) */
    Pierced *found;
    int found_count, found_room;
    bool *pierces; /* (edge_count) */
    int *rim;      /* (vertex_count) edges to the nearest rim */
    int *sheet;    /* (vertex_count) a vertex that stands for all it is joined to */
    int *piece;    /* (vertex_count) towards the vertex that stands for the piece */
    int *size;     /* (vertex_count) of the piece that this vertex stands for */
    long *lean;    /* (vertex_count) of the sheet that this vertex stands for: see weigh_sheets */
    Vec3 *back;    /* [m] (vertex_count) longest way to the other side */
} Tangle;

static Vec3 place(const Tangle *t, int vertex) { return vec3_load(t->x + 3 * (size_t)vertex); }

static const int32_t *corners(const Tangle *t, int triangle) {
    return t->mesh->triangles + 3 * (size_t)triangle;
}

/* ---- edges ---- */

typedef struct HalfEdge {
    int low, high, triangle, side;
} HalfEdge;

static int compare_halves(const void *a, const void *b) {
    const HalfEdge *p = a, *q = b;
    if (p->low != q->low) {
        return p->low < q->low ? -1 : 1;
    }
    if (p->high != q->high) {
        return p->high < q->high ? -1 : 1;
    }
    return p->triangle < q->triangle ? -1 : p->triangle > q->triangle;
}

static void find_edges(Tangle *t) {
    int count = 3 * t->mesh->triangle_count;
    HalfEdge *halves = arena_push(t->arena, HalfEdge, count);
    for (int k = 0; k < count; k++) {
        int a = t->mesh->triangles[k], b = t->mesh->triangles[k - k % 3 + (k + 1) % 3];
        halves[k] = (HalfEdge){a < b ? a : b, a < b ? b : a, k / 3, k % 3};
    }
    qsort(halves, (size_t)count, sizeof *halves, compare_halves);
    t->edges = arena_push(t->arena, Edge, count);
    t->edge_of = arena_push(t->arena, int, count);
    for (int k = 0; k < count; k++) {
        const HalfEdge *half = &halves[k];
        Edge *last = t->edge_count > 0 ? &t->edges[t->edge_count - 1] : NULL;
        if (last && last->end[0] == half->low && last->end[1] == half->high) {
            last->face[1] = half->triangle;
        } else {
            t->edges[t->edge_count++] = (Edge){{half->low, half->high}, {half->triangle, -1}};
        }
        t->edge_of[3 * half->triangle + half->side] = t->edge_count - 1;
    }
}

/* ---- one crossing ---- */

static Vec3 normal_of(const Tangle *t, int triangle) {
    const int32_t *c = corners(t, triangle);
    Vec3 a = place(t, c[0]);
    Vec3 n = vec3_cross(vec3_sub(place(t, c[1]), a), vec3_sub(place(t, c[2]), a));
    double size = vec3_length(n);
    return size > 0.0 ? vec3_scale(1.0 / size, n) : vec3(0, 0, 0);
}

/* ---- pieces ---- */

static int piece_of(const Tangle *t, int vertex) {
    while (t->piece[vertex] != vertex) {
        vertex = t->piece[vertex] = t->piece[t->piece[vertex]];
    }
    return vertex;
}

/* joins what edges join, but those that pierce something */
static void join(Tangle *t) {
    for (int v = 0; v < t->mesh->vertex_count; v++) {
        t->piece[v] = v;
    }
    for (int k = 0; k < t->edge_count; k++) {
        if (!t->pierces[k]) {
            t->piece[piece_of(t, t->edges[k].end[1])] = piece_of(t, t->edges[k].end[0]);
        }
    }
}

static void find_pieces(Tangle *t) {
    memset(t->pierces, 0, (size_t)t->edge_count * sizeof *t->pierces);
    for (int k = 0; k < t->found_count; k++) {
        t->pierces[t->found[k].edge] = true;
    }
    join(t);
    memset(t->size, 0, (size_t)t->mesh->vertex_count * sizeof *t->size);
    for (int v = 0; v < t->mesh->vertex_count; v++) {
        t->size[piece_of(t, v)]++;
    }
}

/* vertices of the smallest piece that a triangle belongs to; no bound when it lies in one */
static int smallest_at(const Tangle *t, int triangle) {
    const int32_t *c = corners(t, triangle);
    int piece[3] = {piece_of(t, c[0]), piece_of(t, c[1]), piece_of(t, c[2])}, least = INT_MAX;
    bool one = piece[0] == piece[1] && piece[1] == piece[2];
    for (int k = 0; k < 3 && !one; k++) {
        least = t->size[piece[k]] < least ? t->size[piece[k]] : least;
    }
    return least;
}

/* the end of the edge in the smaller piece goes to the side of the other end */
static void bring_back(Tangle *t, const Edge *edge, int triangle, int lost) {
    Vec3 normal = normal_of(t, triangle), origin = place(t, corners(t, triangle)[0]);
    double here = vec3_dot(vec3_sub(place(t, edge->end[lost]), origin), normal);
    double there = vec3_dot(vec3_sub(place(t, edge->end[1 - lost]), origin), normal);
    Vec3 way = vec3_scale(copysign(t->gap, there) - here, normal),
         *back = &t->back[edge->end[lost]];
    *back = vec3_dot(way, way) > vec3_dot(*back, *back) ? way : *back;
}

/* of an edge and a triangle, how much farther from a rim the triangle is */
static int lead(const Tangle *t, const Pierced *pierced) {
    const int *end = t->edges[pierced->edge].end;
    const int32_t *c = corners(t, pierced->triangle);
    int own = t->rim[end[0]] < t->rim[end[1]] ? t->rim[end[0]] : t->rim[end[1]], other = INT_MAX;
    for (int k = 0; k < 3; k++) {
        other = t->rim[c[k]] < other ? t->rim[c[k]] : other;
    }
    return other - own;
}

static int sheet_of_edge(const Tangle *t, const Pierced *pierced) {
    return t->sheet[t->edges[pierced->edge].end[0]];
}

static int sheet_of_triangle(const Tangle *t, const Pierced *pierced) {
    return t->sheet[corners(t, pierced->triangle)[0]];
}

/* Where lines do not part a sheet, the sheet comes back whose rim is nearer over all its crossings. */
static void weigh_sheets(Tangle *t) {
    memset(t->lean, 0, (size_t)t->mesh->vertex_count * sizeof *t->lean);
    for (int k = 0; k < t->found_count; k++) {
        t->lean[sheet_of_edge(t, &t->found[k])] += lead(t, &t->found[k]);
        t->lean[sheet_of_triangle(t, &t->found[k])] -= lead(t, &t->found[k]);
    }
}

static bool comes_back(const Tangle *t, const Pierced *pierced) {
    int own = sheet_of_edge(t, pierced), other = sheet_of_triangle(t, pierced);
    if (own == other) {
        return lead(t, pierced) >= 0;
    }
    return t->lean[own] != t->lean[other] ? t->lean[own] > t->lean[other] : own < other;
}

static void resolve(Tangle *t, const Pierced *pierced) {
    const Edge *edge = &t->edges[pierced->edge];
    int a = piece_of(t, edge->end[0]), b = piece_of(t, edge->end[1]);
    if (a != b) {
        int lost = t->size[b] < t->size[a] ? 1 : 0;
        if (t->size[lost ? b : a] <= smallest_at(t, pierced->triangle)) {
            bring_back(t, edge, pierced->triangle, lost);
        } /* else an edge of that piece pierces something here */
        return;
    }
    if (comes_back(t, pierced)) {
        bring_back(t, edge, pierced->triangle, t->rim[edge->end[1]] < t->rim[edge->end[0]] ? 1 : 0);
    }
}

/* ---- finding ---- */

static void meet_edge(Tangle *t, int edge_number, int owner, int triangle) {
    const Edge *edge = &t->edges[edge_number];
    const int32_t *c = corners(t, triangle);
    if (edge->face[0] != owner) { /* once, with its first triangle */
        return;
    }
    CrossingTriangle pierced;
    for (int k = 0; k < 3; k++) {
        if (c[k] == edge->end[0] || c[k] == edge->end[1]) {
            return;
        }
        pierced.corner[k] = t->x + 3 * (size_t)c[k];
    }
    if (crossing_segment(t->x + 3 * (size_t)edge->end[0], t->x + 3 * (size_t)edge->end[1],
                         &pierced)) {
        if (t->found_count == t->found_room) {
            t->found_room = 2 * t->found_room + 256;
            t->found = arena_grow(t->arena, Pierced, t->found, t->found_count, t->found_room);
        }
        t->found[t->found_count++] = (Pierced){edge_number, triangle};
    }
}

static void meet(int a, int b, void *context) {
    Tangle *t = context;
    for (int k = 0; k < 3; k++) {
        meet_edge(t, t->edge_of[3 * a + k], a, b);
        meet_edge(t, t->edge_of[3 * b + k], b, a);
    }
}

/* ---- rounds ---- */

static void box_triangles(Tangle *t) {
    for (int k = 0; k < t->mesh->triangle_count; k++) {
        t->boxes[k] = box_empty();
        for (int m = 0; m < 3; m++) {
            box_add(&t->boxes[k], place(t, corners(t, k)[m]));
        }
    }
}

/* edges to the rim: rounds over all edges until nothing changes */
static void find_rims(Tangle *t) {
    for (int v = 0; v < t->mesh->vertex_count; v++) {
        t->rim[v] = t->mesh->vertex_count;
    }
    for (int k = 0; k < t->edge_count; k++) {
        if (t->edges[k].face[1] < 0) {
            t->rim[t->edges[k].end[0]] = t->rim[t->edges[k].end[1]] = 0;
        }
    }
    for (bool again = true; again;) {
        again = false;
        for (int k = 0; k < t->edge_count; k++) {
            const int *end = t->edges[k].end;
            for (int m = 0; m < 2; m++) {
                if (t->rim[end[m]] > t->rim[end[1 - m]] + 1) {
                    t->rim[end[m]] = t->rim[end[1 - m]] + 1;
                    again = true;
                }
            }
        }
    }
}

static void find_sheets(Tangle *t) {
    join(t);
    for (int v = 0; v < t->mesh->vertex_count; v++) {
        t->sheet[v] = piece_of(t, v);
    }
}

static void start(Tangle *t) {
    int triangles = t->mesh->triangle_count, vertices = t->mesh->vertex_count;
    find_edges(t);
    t->boxes = arena_push(t->arena, Box, triangles);
    t->pierces = arena_push(t->arena, bool, t->edge_count);
    t->piece = arena_push(t->arena, int, vertices);
    t->rim = arena_push(t->arena, int, vertices);
    t->sheet = arena_push(t->arena, int, vertices);
    t->size = arena_push(t->arena, int, vertices);
    t->lean = arena_push(t->arena, long, vertices);
    t->back = arena_push(t->arena, Vec3, vertices);
    box_triangles(t);
    Vec3 *centres = arena_push(t->arena, Vec3, triangles);
    for (int k = 0; k < triangles; k++) {
        centres[k] = vec3_scale(0.5, vec3_add(t->boxes[k].low, t->boxes[k].high));
    }
    t->tree = box_tree_create(centres, triangles, t->arena);
    find_rims(t);
    find_sheets(t);
}

static int find_crossings(Tangle *t) {
    t->found_count = 0;
    box_triangles(t);
    box_tree_refit(&t->tree, t->boxes);
    box_tree_pairs(&t->tree, 0.0, meet, t);
    return t->found_count;
}

static void move(Tangle *t, const unsigned char *held) {
    size_t bytes = (size_t)t->mesh->vertex_count * sizeof(Vec3);
    memset(t->back, 0, bytes);
    find_pieces(t);
    weigh_sheets(t);
    for (int k = 0; k < t->found_count; k++) {
        resolve(t, &t->found[k]);
    }
    for (int v = 0; v < t->mesh->vertex_count; v++) {
        if (!held[v]) {
            vec3_store(t->x + 3 * (size_t)v, vec3_add(place(t, v), t->back[v]));
        }
    }
}

/* how many are elsewhere now, and how far */
static void measure(const Tangle *t, const double *before, Untangled *result) {
    result->moved = 0;
    for (int v = 0; v < t->mesh->vertex_count; v++) {
        double way = vec3_length(vec3_sub(place(t, v), vec3_load(before + 3 * (size_t)v)));
        result->moved += way > 0.0;
        result->way = fmax(result->way, way);
    }
}

Untangled untangle(const CrossingMesh *mesh, const unsigned char *held, double gap, double most,
                   double *x, Arena *scratch) {
    Untangled result = {0};
    ArenaMark mark = arena_mark(scratch);
    Tangle t = {.mesh = mesh, .arena = scratch, .x = x, .gap = gap};
    size_t bytes = 3 * (size_t)mesh->vertex_count * sizeof *x;
    double *before = arena_push(scratch, double, 3 * mesh->vertex_count);
    memcpy(before, x, bytes);
    start(&t);
    for (int round = 0; round < MOST_ROUNDS && result.way <= most && find_crossings(&t) > 0;
         round++) {
        move(&t, held);
        measure(&t, before, &result);
    }
    result.done = result.way <= most && crossing_count_self(mesh, scratch).count == 0;
    if (!result.done) {
        memcpy(x, before, bytes);
    }
    arena_rewind(scratch, mark);
    return result;
}
