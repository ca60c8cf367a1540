#include "render/surfel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"

#define OVERLAP 1.02        /* radius over what would just leave no hole: larger ones cost more */
#define SAME_PLACE 0.02     /* of the radius: nearer surfels are one */
#define SAME_DIRECTION 0.02 /* sine between lines that cut like one */

typedef struct Segment {
    double a[2], b[2]; /* [m] from the panel's corner; the cloth lies on the left */
} Segment;

typedef struct Border {
    Segment *segments;
    int count;
} Border;

/* ---- the border of a panel ---- */

typedef struct Edge {
    int32_t low, high; /* vertex numbers, sorted */
    int32_t from, to;  /* as the triangle has them */
} Edge;

static int compare_edges(const void *a, const void *b) {
    const Edge *x = a, *y = b;
    return x->low != y->low ? (x->low > y->low) - (x->low < y->low)
                            : (x->high > y->high) - (x->high < y->high);
}

static Edge edge_of(int32_t from, int32_t to) {
    return (Edge){from < to ? from : to, from < to ? to : from, from, to};
}

/* Edges that belong to one triangle only. */
static Border find_edges(const StateLayout *layout, int cloth, const SurfacePart *part,
                         Arena *arena) {
    int begin = layout->triangle_begin[cloth], end = layout->triangle_begin[cloth + 1];
    int count = 3 * (end - begin);
    Edge *edges = arena_push(arena, Edge, (size_t)count);
    Border border = {arena_push(arena, Segment, (size_t)count), 0};
    for (int t = begin; t < end; t++) {
        const int32_t *corner = layout->triangles + 3 * (size_t)t;
        for (int k = 0; k < 3; k++) {
            edges[3 * (t - begin) + k] = edge_of(corner[k], corner[(k + 1) % 3]);
        }
    }
    qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    for (int i = 0; i < count; i++) {
        bool shared = (i > 0 && compare_edges(&edges[i], &edges[i - 1]) == 0) ||
                      (i + 1 < count && compare_edges(&edges[i], &edges[i + 1]) == 0);
        if (!shared) {
            Segment *segment = &border.segments[border.count++];
            for (int k = 0; k < 2; k++) {
                segment->a[k] =
                    layout->vertex_material[2 * (size_t)edges[i].from + k] - part->corner[k];
                segment->b[k] =
                    layout->vertex_material[2 * (size_t)edges[i].to + k] - part->corner[k];
            }
        }
    }
    return border;
}

/* A lattice is a rectangle; where it closes on itself, both ends of u meet in a line too. */
static Border find_sides(const SurfacePart *part, Arena *arena) {
    double w = part->size[0], h = part->size[1];
    const Segment sides[4] = {
        {{0, 0}, {w, 0}}, {{w, 0}, {w, h}}, {{w, h}, {0, h}}, {{0, h}, {0, 0}}};
    Border border = {arena_push(arena, Segment, 4), 4};
    memcpy(border.segments, sides, sizeof sides);
    return border;
}

static Border find_border(const StateLayout *layout, int cloth, const SurfacePart *part,
                          Arena *arena) {
    const int32_t *lattice = layout->lattice + 4 * (size_t)cloth;
    bool is_lattice = lattice[0] >= 2 && lattice[1] >= 2;
    return is_lattice ? find_sides(part, arena) : find_edges(layout, cloth, part, arena);
}

/* ---- clip lines ---- */

static double distance_to(const Segment *s, const double p[2]) {
    double d[2] = {s->b[0] - s->a[0], s->b[1] - s->a[1]}, q[2] = {p[0] - s->a[0], p[1] - s->a[1]};
    double length = d[0] * d[0] + d[1] * d[1];
    double t = length > 0.0 ? (q[0] * d[0] + q[1] * d[1]) / length : 0.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return hypot(q[0] - t * d[0], q[1] - t * d[1]);
}

static void line_of(const Segment *s, double line[3]) {
    double d[2] = {s->b[0] - s->a[0], s->b[1] - s->a[1]}, length = hypot(d[0], d[1]);
    line[0] = length > 0.0 ? -d[1] / length : 0.0;
    line[1] = length > 0.0 ? d[0] / length : 0.0;
    line[2] = length > 0.0 ? -(line[0] * s->a[0] + line[1] * s->a[1]) : 1.0;
}

static double side_of(const double line[3], const double p[2]) {
    return line[0] * p[0] + line[1] * p[1] + line[2];
}

/* The nearest segment within the radius whose direction differs from `other`'s; -1: none. */
static int nearest_segment(const Border *border, const double p[2], double radius,
                           const double *other) {
    int nearest = -1;
    double least = radius;
    for (int i = 0; i < border->count; i++) {
        double line[3], distance = distance_to(&border->segments[i], p);
        if (distance >= least) {
            continue;
        }
        line_of(&border->segments[i], line);
        double sine = other ? line[0] * other[1] - line[1] * other[0] : 1.0;
        bool opposite = other && line[0] * other[0] + line[1] * other[1] < 0.0;
        if (fabs(sine) > SAME_DIRECTION || opposite) {
            least = distance;
            nearest = i;
        }
    }
    return nearest;
}

static void set_line(float out[3], const double line[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = (float)line[k];
    }
}

static void clip(Surfel *surfel, const Border *border) {
    const double everywhere[3] = {0, 0, 1};
    double p[2] = {(double)surfel->uv[0], (double)surfel->uv[1]}, first[3], second[3];
    double radius = (double)surfel->radius;
    set_line(surfel->line[0], everywhere);
    set_line(surfel->line[1], everywhere);
    int one = nearest_segment(border, p, radius, NULL);
    if (one < 0) {
        return;
    }
    surfel->cut = 1.0f;
    line_of(&border->segments[one], first);
    set_line(surfel->line[0], first);
    int two = nearest_segment(border, p, radius, first);
    if (two >= 0) {
        const Segment *s = &border->segments[two];
        double middle[2] = {0.5 * (s->a[0] + s->b[0]), 0.5 * (s->a[1] + s->b[1])};
        line_of(s, second);
        set_line(surfel->line[1], second);
        surfel->cut = side_of(first, middle) < 0.0 ? 2.0f : 1.0f;
    }
}

/* ---- radii ---- */

/* The largest distance of a point of the triangle from its nearest corner. */
static double cover_of(const float *a, const float *b, const float *c) {
    double x = hypot((double)(b[0] - a[0]), (double)(b[1] - a[1]));
    double y = hypot((double)(c[0] - b[0]), (double)(c[1] - b[1]));
    double z = hypot((double)(a[0] - c[0]), (double)(a[1] - c[1]));
    double longest = fmax(x, fmax(y, z)), others = x * x + y * y + z * z - longest * longest;
    double area =
        0.5 * fabs((double)((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])));
    bool obtuse = longest * longest >= others;
    return obtuse || area <= 0.0 ? 0.5 * longest : x * y * z / (4.0 * area);
}

static void find_radii(Surface *surface) {
    for (int t = 0; t < surface->fine_count; t++) {
        const uint32_t *corner = surface->fine + 3 * (size_t)t;
        float radius = (float)(OVERLAP * cover_of(surface->uv + 2 * (size_t)corner[0],
                                                  surface->uv + 2 * (size_t)corner[1],
                                                  surface->uv + 2 * (size_t)corner[2]));
        for (int k = 0; k < 3; k++) {
            Surfel *surfel = &surface->surfels[corner[k]];
            surfel->radius = radius > surfel->radius ? radius : surfel->radius;
        }
    }
}

typedef struct Place {
    int64_t at[2]; /* in steps of SAME_PLACE */
    Surfel *surfel;
} Place;

static int compare_places(const void *a, const void *b) {
    const Place *x = a, *y = b;
    for (int k = 0; k < 2; k++) {
        if (x->at[k] != y->at[k]) {
            return x->at[k] > y->at[k] ? 1 : -1;
        }
    }
    return (x->surfel > y->surfel) - (x->surfel < y->surfel);
}

/* Triangles of a scattered cloth have samples of their own along shared edges: one is enough. */
static void drop_doubles(Surfel *surfels, int count, Arena *arena) {
    Place *places = arena_push(arena, Place, (size_t)count);
    double step = 0.0;
    for (int i = 0; i < count; i++) {
        step = fmax(step, SAME_PLACE * (double)surfels[i].radius);
    }
    for (int i = 0; i < count; i++) {
        places[i].surfel = &surfels[i];
        for (int k = 0; k < 2; k++) {
            places[i].at[k] = llround((double)surfels[i].uv[k] / fmax(step, 1e-12));
        }
    }
    qsort(places, (size_t)count, sizeof *places, compare_places);
    for (int i = 1, kept = 0; i < count; i++) {
        if (places[i].at[0] == places[kept].at[0] && places[i].at[1] == places[kept].at[1]) {
            Surfel *one = places[kept].surfel, *other = places[i].surfel;
            one->radius = other->radius > one->radius ? other->radius : one->radius;
            other->radius = 0.0f;
        } else {
            kept = i;
        }
    }
}

void surfel_fill(const StateLayout *layout, Surface *surface) {
    Arena scratch = {0};
    memset(surface->surfels, 0, sizeof *surface->surfels * (size_t)surface->vertex_count);
    for (int i = 0; i < surface->vertex_count; i++) {
        memcpy(surface->surfels[i].uv, surface->uv + 2 * (size_t)i, 2 * sizeof(float));
    }
    find_radii(surface);
    for (int i = 0; i < surface->part_count; i++) {
        const SurfacePart *part = &surface->parts[i];
        Surfel *surfels = surface->surfels + part->vertex_begin;
        ArenaMark mark = arena_mark(&scratch);
        Border border = find_border(layout, i, part, &scratch);
        if (!part->around) { /* both ends of u are needed: each fills its side of the seam */
            drop_doubles(surfels, part->vertex_count, &scratch);
        }
        for (int k = 0; k < part->vertex_count; k++) {
            if (surfels[k].radius > 0.0f) {
                clip(&surfels[k], &border);
            }
        }
        arena_rewind(&scratch, mark);
    }
    arena_free(&scratch);
}

/* ---- bends ---- */

static void find_normal(const SurfaceVertex *vertex, float n[3]) {
    const float *u = vertex->normal, *v = vertex->tangent; /* the derivatives along u and v */
    float x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2];
    float z = u[0] * v[1] - u[1] * v[0], length = sqrtf(x * x + y * y + z * z);
    float scale = length > 0.0f ? 1.0f / length : 0.0f;
    n[0] = scale * x, n[1] = scale * y, n[2] = scale * z;
}

/* Adds the slopes of the normal on a triangle, times twice its area on the panel. */
static void add_slopes(Surface *surface, const uint32_t *corner, const float *normals,
                       float *weights) {
    const float *a = surface->uv + 2 * (size_t)corner[0], *b = surface->uv + 2 * (size_t)corner[1];
    const float *c = surface->uv + 2 * (size_t)corner[2];
    float u1 = b[0] - a[0], v1 = b[1] - a[1], u2 = c[0] - a[0], v2 = c[1] - a[1];
    float area = u1 * v2 - u2 * v1, side = area < 0.0f ? -1.0f : 1.0f, slope[6];
    const float *n0 = normals + 3 * (size_t)corner[0], *n1 = normals + 3 * (size_t)corner[1];
    const float *n2 = normals + 3 * (size_t)corner[2];
    for (int k = 0; k < 3; k++) {
        float d1 = n1[k] - n0[k], d2 = n2[k] - n0[k];
        slope[k] = side * (v2 * d1 - v1 * d2);
        slope[3 + k] = side * (u1 * d2 - u2 * d1);
    }
    for (int k = 0; k < 3; k++) {
        float *bend = surface->bends + 6 * (size_t)corner[k];
        weights[corner[k]] += side * area;
        for (int i = 0; i < 6; i++) {
            bend[i] += slope[i];
        }
    }
}

void surfel_bend(Surface *surface, Arena *scratch) {
    size_t count = (size_t)surface->vertex_count;
    ArenaMark mark = arena_mark(scratch);
    float *normals = arena_push(scratch, float, 3 * count);
    float *weights = arena_push(scratch, float, count);
    memset(surface->bends, 0, 6 * sizeof *surface->bends * count);
    for (size_t i = 0; i < count; i++) {
        find_normal(&surface->vertices[i], normals + 3 * i);
    }
    for (int t = 0; t < surface->fine_count; t++) {
        add_slopes(surface, surface->fine + 3 * (size_t)t, normals, weights);
    }
    for (size_t i = 0; i < count; i++) {
        float scale = weights[i] > 0.0f ? 1.0f / weights[i] : 0.0f;
        for (int k = 0; k < 6; k++) {
            surface->bends[6 * i + (size_t)k] *= scale;
        }
    }
    arena_rewind(scratch, mark);
}

/* ---- folds ---- */

void surfel_fold(Surface *surface, bool any) {
    const unsigned char *moved = surface->moved;
    surface->fold_count = 0;
    for (int i = 0; i < surface->part_count; i++) {
        SurfacePart *part = &surface->parts[i];
        part->fold_begin = surface->fold_count;
        for (int t = part->fine_begin; any && t < part->fine_begin + part->fine_count; t++) {
            const uint32_t *corner = surface->fine + 3 * (size_t)t;
            if (moved[corner[0]] || moved[corner[1]] || moved[corner[2]]) {
                memcpy(surface->folds + 3 * (size_t)surface->fold_count++, corner,
                       3 * sizeof *corner);
            }
        }
        part->fold_count = surface->fold_count - part->fold_begin;
    }
    for (int i = 0; i < surface->vertex_count; i++) {
        float radius = fabsf(surface->surfels[i].radius);
        surface->surfels[i].radius = any && moved[i] ? -radius : radius;
    }
}
