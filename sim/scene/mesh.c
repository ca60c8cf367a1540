#include "sim/scene/mesh.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/hash.h"
#include "sim/base/vec.h"

/* A triangle has no area when its height is below this part of its longest edge: no normal could be
 * told from rounding in single precision, which files use. */
#define FLATTEST 1e-7

void mesh_positions(const MeshDef *mesh, double time, double *positions) {
    size_t count = 3 * (size_t)mesh->vertex_count;
    double place = fmin(fmax(time * mesh->frame_rate, 0.0), mesh->frame_count - 1.0);
    if (mesh->frame_count <= 1 || !isfinite(place)) {
        memcpy(positions, mesh->vertices, count * sizeof *positions);
        return;
    }
    int before = (int)place;
    double part = place - before;
    const double *a = mesh->frames + count * (size_t)before;
    const double *b = before + 1 < mesh->frame_count ? a + count : a;
    for (size_t i = 0; i < count; i++) {
        positions[i] = part > 0.0 ? a[i] + part * (b[i] - a[i]) : a[i];
    }
}

static void note(MeshDef *mesh, Arena *arena, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static void note(MeshDef *mesh, Arena *arena, const char *format, ...) {
    char text[200];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (mesh->note_count < MESH_MOST_NOTES) {
        mesh->notes[mesh->note_count++] = arena_strdup(arena, text);
    }
}

/* ---- joining ---- */

static bool same_vertex(const MeshDef *mesh, int a, int b) {
    size_t stride = 3 * (size_t)mesh->vertex_count;
    for (int f = 0; f < mesh->frame_count; f++) {
        const double *p = mesh->frames + stride * (size_t)f;
        for (int k = 0; k < 3; k++) {
            if (p[3 * (size_t)a + (size_t)k] != p[3 * (size_t)b + (size_t)k]) {
                return false;
            }
        }
    }
    return true;
}

/* twin[i]: the first vertex that lies where i does in all frames, by an open hash table */
static void find_twins(const MeshDef *mesh, int *twin, Arena *scratch) {
    size_t size = 16;
    while (size < 2 * (size_t)mesh->vertex_count) {
        size *= 2;
    }
    int *table = arena_push(scratch, int, size); /* vertex + 1 */
    for (int i = 0; i < mesh->vertex_count; i++) {
        double p[3];
        for (int k = 0; k < 3; k++) {
            p[k] = mesh->frames[3 * (size_t)i + (size_t)k] + 0.0; /* -0 is 0 */
        }
        size_t at = (size_t)hash_bytes(p, sizeof p) & (size - 1);
        while (table[at] && !same_vertex(mesh, table[at] - 1, i)) {
            at = (at + 1) & (size - 1);
        }
        table[at] = table[at] ? table[at] : i + 1;
        twin[i] = table[at] - 1;
    }
}

static bool has_area(const MeshDef *mesh, const int32_t *t) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
        return false;
    }
    Vec3 p[3];
    double longest = 0.0;
    for (int k = 0; k < 3; k++) {
        p[k] = vec3_load(mesh->frames + 3 * (size_t)t[k]);
    }
    for (int k = 0; k < 3; k++) {
        longest = fmax(longest, vec3_length(vec3_sub(p[(k + 1) % 3], p[k])));
    }
    double area = vec3_length(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])));
    return area > FLATTEST * longest * longest;
}

/* Copies what is used, under new numbers. */
static void compact(MeshDef *mesh, const int32_t *kept, int kept_count, Arena *arena,
                    Arena *scratch) {
    int *number = arena_push(scratch, int, mesh->vertex_count); /* new number + 1 */
    int32_t *triangles = arena_push(arena, int32_t, 3 * kept_count);
    int count = 0;
    for (int i = 0; i < 3 * kept_count; i++) {
        int old = kept[i];
        number[old] = number[old] ? number[old] : ++count;
        triangles[i] = number[old] - 1;
    }
    double *frames = arena_push(arena, double, 3 * (size_t)count * (size_t)mesh->frame_count);
    for (int f = 0; f < mesh->frame_count; f++) {
        const double *from = mesh->frames + 3 * (size_t)mesh->vertex_count * (size_t)f;
        double *to = frames + 3 * (size_t)count * (size_t)f;
        for (int i = 0; i < mesh->vertex_count; i++) {
            if (number[i]) {
                memcpy(to + 3 * (size_t)(number[i] - 1), from + 3 * (size_t)i, 3 * sizeof *to);
            }
        }
    }
    mesh->vertex_count = count;
    mesh->triangle_count = kept_count;
    mesh->triangles = triangles;
    mesh->frames = mesh->vertices = frames;
}

/* ---- edges and pieces ---- */

typedef struct Edge {
    int low, high, triangle;
    bool forward; /* the triangle runs from low to high */
} Edge;

static int compare_edges(const void *a, const void *b) {
    const Edge *p = a, *q = b;
    if (p->low != q->low) {
        return p->low < q->low ? -1 : 1;
    }
    if (p->high != q->high) {
        return p->high < q->high ? -1 : 1;
    }
    return (p->triangle > q->triangle) - (p->triangle < q->triangle);
}

static Edge *list_edges(const MeshDef *mesh, Arena *scratch) {
    Edge *edges = arena_push(scratch, Edge, 3 * mesh->triangle_count);
    for (int i = 0; i < 3 * mesh->triangle_count; i++) {
        int a = mesh->triangles[i], b = mesh->triangles[i - i % 3 + (i + 1) % 3];
        edges[i] = (Edge){a < b ? a : b, a < b ? b : a, i / 3, a < b};
    }
    qsort(edges, 3 * (size_t)mesh->triangle_count, sizeof *edges, compare_edges);
    return edges;
}

static int find_root(int *parent, int i) {
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

/* What the edges say about each piece (triangles joined by edges). */
typedef struct Pieces {
    int *parent;    /* (triangle_count) union-find */
    bool *open;     /* (triangle_count) by root: has a border, a crowded or a twisted edge */
    double *volume; /* [m3] (triangle_count) by root, six times */
    int border, crowded, twisted;
} Pieces;

static Pieces find_pieces(const MeshDef *mesh, Arena *scratch) {
    int count = mesh->triangle_count;
    const Edge *edges = list_edges(mesh, scratch);
    Pieces pieces = {.parent = arena_push(scratch, int, count),
                     .open = arena_push(scratch, bool, count),
                     .volume = arena_push(scratch, double, count)};
    bool *open = arena_push(scratch, bool, count);
    for (int i = 0; i < count; i++) {
        pieces.parent[i] = i;
    }
    for (int i = 0, next; i < 3 * count; i = next) {
        next = i + 1;
        while (next < 3 * count && edges[next].low == edges[i].low &&
               edges[next].high == edges[i].high) {
            int a = find_root(pieces.parent, edges[i].triangle);
            pieces.parent[find_root(pieces.parent, edges[next].triangle)] = a;
            next++;
        }
        bool crowded = next - i > 2, border = next - i == 1;
        bool twisted = next - i == 2 && edges[i].forward == edges[i + 1].forward;
        pieces.border += border, pieces.crowded += crowded, pieces.twisted += twisted;
        open[edges[i].triangle] |= border || crowded || twisted;
    }
    Vec3 origin = vec3_load(mesh->vertices);
    for (int i = 0; i < count; i++) {
        int root = find_root(pieces.parent, i);
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            p[k] = vec3_sub(vec3_load(mesh->vertices + 3 * (size_t)mesh->triangles[3 * i + k]),
                            origin);
        }
        pieces.open[root] |= open[i];
        pieces.volume[root] += vec3_dot(p[0], vec3_cross(p[1], p[2]));
    }
    return pieces;
}

static void turn_pieces(MeshDef *mesh, Arena *arena, Arena *scratch) {
    Pieces pieces = find_pieces(mesh, scratch);
    int32_t *triangles = arena_push(arena, int32_t, 3 * mesh->triangle_count);
    memcpy(triangles, mesh->triangles, 3 * (size_t)mesh->triangle_count * sizeof *triangles);
    int turned = 0, piece_count = 0;
    for (int i = 0; i < mesh->triangle_count; i++) {
        int root = find_root(pieces.parent, i);
        piece_count += root == i;
        if (!pieces.open[root] && pieces.volume[root] < 0.0) {
            int32_t keep = triangles[3 * i + 1];
            triangles[3 * i + 1] = triangles[3 * i + 2];
            triangles[3 * i + 2] = keep;
            turned += root == i;
        }
    }
    mesh->triangles = triangles;
    mesh->closed = pieces.border + pieces.crowded + pieces.twisted == 0;
    if (turned > 0) {
        note(mesh, arena, "%d of %d pieces were inside out and have been turned", turned,
             piece_count);
    }
    if (pieces.border > 0) {
        note(mesh, arena, "it is open: %d edges have one triangle only, so it has no inside",
             pieces.border);
    }
    if (pieces.crowded > 0) {
        note(mesh, arena, "it is no surface everywhere: %d edges have more than two triangles",
             pieces.crowded);
    }
    if (pieces.twisted > 0) {
        note(mesh, arena, "neighbours disagree about the outside at %d edges", pieces.twisted);
    }
}

static void find_box(MeshDef *mesh) {
    for (int k = 0; k < 3; k++) {
        mesh->low[k] = INFINITY, mesh->high[k] = -INFINITY;
    }
    for (size_t i = 0; i < (size_t)mesh->vertex_count * (size_t)mesh->frame_count; i++) {
        for (size_t k = 0; k < 3; k++) {
            mesh->low[k] = fmin(mesh->low[k], mesh->frames[3 * i + k]);
            mesh->high[k] = fmax(mesh->high[k], mesh->frames[3 * i + k]);
        }
    }
}

bool mesh_clean(MeshDef *mesh, Arena *arena) {
    Arena scratch = {0};
    int *twin = arena_push(&scratch, int, mesh->vertex_count);
    int32_t *kept = arena_push(&scratch, int32_t, 3 * mesh->triangle_count);
    int count = 0;
    find_twins(mesh, twin, &scratch);
    for (int i = 0; i < mesh->triangle_count; i++) {
        int32_t *t = kept + 3 * count;
        for (int k = 0; k < 3; k++) {
            t[k] = twin[mesh->triangles[3 * i + k]];
        }
        count += has_area(mesh, t);
    }
    if (count < mesh->triangle_count) {
        note(mesh, arena, "%d triangles without area were left out", mesh->triangle_count - count);
    }
    if (count > 0) {
        compact(mesh, kept, count, arena, &scratch);
        turn_pieces(mesh, arena, &scratch);
        find_box(mesh);
        size_t numbers = 3 * (size_t)mesh->vertex_count * (size_t)mesh->frame_count;
        uint64_t parts[3] = {
            hash_bytes(mesh->frames, numbers * sizeof(double)),
            hash_bytes(mesh->triangles, 3 * (size_t)mesh->triangle_count * sizeof(int32_t)),
            (uint64_t)(mesh->frame_rate * 1e6)};
        mesh->hash = hash_bytes(parts, sizeof parts);
    }
    arena_free(&scratch);
    return count > 0;
}
