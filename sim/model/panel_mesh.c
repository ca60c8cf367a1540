#include "sim/model/panel_mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/memory.h"

/* of the mean area of triangles: less is none */
#define LEAST_AREA 1e-9

/* ---- (u, v) ---- */

static double area_in_uv(const Panel *p, int t) {
    const int *n = p->vertex_triangles + 3 * t;
    const double *a = p->vertex_material + 2 * n[0], *b = p->vertex_material + 2 * n[1],
                 *c = p->vertex_material + 2 * n[2];
    return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

static int find_root(int *parent, int i) {
    while (parent[i] != i) {
        i = parent[i] = parent[parent[i]];
    }
    return i;
}

/* chart[i]: a vertex of the chart of vertex i; triangles that share vertices are one chart */
static void find_charts(const Panel *p, int *chart) {
    for (int i = 0; i < p->vertex_count; i++) {
        chart[i] = i;
    }
    for (int k = 0; k < 3 * p->triangle_count; k++) {
        int a = find_root(chart, p->vertex_triangles[k]);
        int b = find_root(chart, p->vertex_triangles[k / 3 * 3 + (k + 1) % 3]);
        chart[a > b ? a : b] = a > b ? b : a;
    }
    for (int i = 0; i < p->vertex_count; i++) {
        chart[i] = find_root(chart, i);
    }
}

/* all triangles anticlockwise: mirrors charts that are turned over, in u about their middle */
static bool turn_charts(const ClothDef *def, Panel *p, Error *error) {
    size_t count = (size_t)p->vertex_count;
    int *chart = memory_new(count * sizeof *chart);
    signed char *side = memory_zeroed(count, 1); /* of a chart, by its first vertex */
    double mean = 0.0, *material = (double *)p->vertex_material;
    find_charts(p, chart);
    for (int t = 0; t < p->triangle_count; t++) {
        mean += fabs(area_in_uv(p, t)) / p->triangle_count;
    }
    bool ok = true;
    for (int t = 0; t < p->triangle_count && ok; t++) {
        double area = area_in_uv(p, t);
        signed char sign = area > 0.0 ? 1 : -1, *its = &side[chart[p->vertex_triangles[3 * t]]];
        ok = fabs(area) > LEAST_AREA * mean && (*its == 0 || *its == sign);
        *its = sign;
        if (!ok) {
            error_set(error, EXIT_BAD_INPUT,
                      "cloth '%s': triangle %d of the mesh %s in its texture coordinates",
                      def->name, t,
                      fabs(area) > LEAST_AREA * mean ? "is turned over" : "has no area");
        }
    }
    for (int i = 0; i < p->vertex_count && ok; i++) {
        material[2 * i] = side[chart[i]] < 0 ? -material[2 * i] : material[2 * i];
    }
    free(chart);
    free(side);
    return ok;
}

/* ---- nodes ---- */

/* vertices in one place are one node, by an open hash table */
static void weld(const double *places, Panel *p, Arena *arena) {
    size_t size = 16;
    while (size < 2 * (size_t)p->vertex_count) {
        size *= 2;
    }
    int *table = memory_zeroed(size, sizeof *table); /* vertex + 1 */
    int *node = arena_push(arena, int, p->vertex_count);
    for (int i = 0; i < p->vertex_count; i++) {
        const double *at = places + 3 * (size_t)i;
        double key[3] = {at[0] + 0.0, at[1] + 0.0, at[2] + 0.0}; /* -0 is 0 */
        size_t slot = (size_t)hash_bytes(key, sizeof key) & (size - 1);
        while (table[slot] && (places[3 * (size_t)(table[slot] - 1)] != at[0] ||
                               places[3 * (size_t)(table[slot] - 1) + 1] != at[1] ||
                               places[3 * (size_t)(table[slot] - 1) + 2] != at[2])) {
            slot = (slot + 1) & (size - 1);
        }
        if (!table[slot]) {
            table[slot] = i + 1;
            node[i] = p->node_count++;
        } else {
            node[i] = node[table[slot] - 1];
        }
    }
    free(table);
    p->vertex_node = node;
}

static void fill_nodes(const double *places, Panel *p, Arena *arena) {
    int *triangles = arena_push(arena, int, 3 * p->triangle_count);
    double total = 0.0;
    p->material = arena_push(arena, double, 2 * p->node_count);
    p->start = arena_push(arena, double, 3 * p->node_count);
    p->area = arena_push(arena, double, p->node_count);
    for (int i = p->vertex_count - 1; i >= 0; i--) { /* the first vertex of a node comes last */
        int node = p->vertex_node[i];
        memcpy(p->material + 2 * node, p->vertex_material + 2 * i, 2 * sizeof(double));
        memcpy(p->start + 3 * node, places + 3 * (size_t)i, 3 * sizeof(double));
    }
    for (int k = 0; k < 3 * p->triangle_count; k++) {
        double third = area_in_uv(p, k / 3) / 3.0;
        triangles[k] = p->vertex_node[p->vertex_triangles[k]];
        p->area[triangles[k]] += third;
        total += third;
    }
    p->triangles = triangles;
    p->h1 = p->h2 = sqrt(total / p->node_count);
}

/* ---- edges ---- */

typedef struct Edge {
    int low, high, from; /* ends; where it starts in its triangle */
} Edge;

static int compare_edges(const void *a, const void *b) {
    const Edge *x = a, *y = b;
    if (x->low != y->low || x->high != y->high) {
        return x->low != y->low ? x->low - y->low : x->high - y->high;
    }
    return x->from - y->from;
}

static Edge *sorted_edges(const int *triangles, int triangle_count) {
    int count = 3 * triangle_count;
    Edge *edges = memory_new((size_t)count * sizeof *edges);
    for (int k = 0; k < count; k++) {
        int a = triangles[k], b = triangles[k / 3 * 3 + (k + 1) % 3];
        edges[k] = (Edge){a < b ? a : b, a < b ? b : a, a};
    }
    qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    return edges;
}

/* how many edges from k on join the same two ends */
static int same_edges(const Edge *edges, int k, int count) {
    int n = 1;
    while (k + n < count && edges[k + n].low == edges[k].low &&
           edges[k + n].high == edges[k].high) {
        n++;
    }
    return n;
}

/* every edge of the welded mesh has one triangle or two that agree; marks the free border */
static bool check_edges(const ClothDef *def, Panel *p, Arena *arena, Error *error) {
    int count = 3 * p->triangle_count;
    Edge *edges = sorted_edges(p->triangles, p->triangle_count);
    unsigned char *free_node = memory_zeroed((size_t)p->node_count, 1);
    unsigned char *ends = arena_push(arena, unsigned char, p->vertex_count);
    bool ok = true;
    for (int k = 0, n; k < count && ok; k += n) {
        n = same_edges(edges, k, count);
        ok = edges[k].low != edges[k].high && n <= 2 &&
             (n == 1 || edges[k].from != edges[k + 1].from);
        if (n == 1) {
            free_node[edges[k].low] = free_node[edges[k].high] = PANEL_FREE_BORDER;
        }
    }
    for (int i = 0; i < p->vertex_count; i++) {
        ends[i] = free_node[p->vertex_node[i]];
    }
    p->ends = ends;
    free(edges);
    free(free_node);
    return ok || error_set(error, EXIT_BAD_INPUT,
                           "cloth '%s': the mesh is no cloth: an edge has more than two triangles, "
                           "no length, or two that disagree about the outside",
                           def->name);
}

/* The outlines of the charts, as loops of border edges in (u, v). next[a]: the vertex after a; where
 * two charts touch in a vertex only one of them is followed there. */
static void find_outlines(Panel *p, Arena *arena) {
    int count = 3 * p->triangle_count, points = 0;
    Edge *edges = sorted_edges(p->vertex_triangles, p->triangle_count);
    int *next = memory_new((size_t)p->vertex_count * sizeof *next);
    memset(next, -1, (size_t)p->vertex_count * sizeof *next);
    for (int k = 0, n; k < count; k += n) {
        n = same_edges(edges, k, count);
        if (n == 1) {
            next[edges[k].from] = edges[k].from == edges[k].low ? edges[k].high : edges[k].low;
            points++;
        }
    }
    p->outline_begin = arena_push(arena, int, points + 1);
    p->outline = arena_push(arena, double, 2 * points);
    points = 0;
    for (int i = 0; i < p->vertex_count; i++) {
        int start = points;
        for (int at = i; at >= 0 && next[at] >= 0;) {
            int following = next[at];
            memcpy(p->outline + 2 * points++, p->vertex_material + 2 * at, 2 * sizeof(double));
            next[at] = -1;
            at = following;
        }
        if (points - start >= 3) {
            p->outline_begin[++p->loop_count] = points;
        } else {
            points = start;
        }
    }
    free(edges);
    free(next);
}

bool panel_from_mesh(const ClothDef *def, Arena *arena, Panel *p, Error *error) {
    const MeshDef *mesh = def->shape.mesh;
    const double *uv = mesh->frames + 3 * (size_t)mesh->vertex_count;
    double *material = arena_push(arena, double, 2 * mesh->vertex_count);
    int *triangles = arena_push(arena, int, 3 * mesh->triangle_count);
    for (int i = 0; i < mesh->vertex_count; i++) {
        memcpy(material + 2 * i, uv + 3 * (size_t)i, 2 * sizeof(double));
    }
    for (int k = 0; k < 3 * mesh->triangle_count; k++) {
        triangles[k] = mesh->triangles[k];
    }
    p->vertex_count = mesh->vertex_count;
    p->triangle_count = mesh->triangle_count;
    p->vertex_material = material;
    p->vertex_triangles = triangles;
    if (!turn_charts(def, p, error)) {
        return false;
    }
    weld(mesh->frames, p, arena);
    fill_nodes(mesh->frames, p, arena);
    if (!check_edges(def, p, arena, error)) {
        return false;
    }
    find_outlines(p, arena);
    return true;
}
