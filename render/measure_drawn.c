/* Which triangles of the drawn surface cross. Vertices that are drawn twice, along the seam of a sleeve
 * and between the pieces of a scattered panel, are one. */
#include <math.h>
#include <stdlib.h>

#include "render/measure.h"
#include "render/resample.h"
#include "sim/geom/crossing.h"

#define SAME_PLACE 1e-6 /* of a panel: floats of one place on it differ by less */

typedef struct Twin {
    const Surface *surface;
    int part;
    uint32_t vertex;
} Twin;

static const float *place_of(const Twin *twin) {
    return twin->surface->vertices[twin->vertex].position;
}

static int compare_twins(const void *a, const void *b) {
    const float *p = place_of(a), *q = place_of(b);
    for (int k = 0; k < 3; k++) {
        if (p[k] != q[k]) {
            return p[k] < q[k] ? -1 : 1;
        }
    }
    const Twin *x = a, *y = b;
    return (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

/* Two vertices in one place: one place of a panel too, or on a seam? */
static bool are_one(const Twin *a, const Twin *b, bool sewn) {
    const SurfacePart *part = &a->surface->parts[a->part];
    const float *p = a->surface->uv + 2 * (size_t)a->vertex;
    const float *q = a->surface->uv + 2 * (size_t)b->vertex;
    double u = fabs((double)p[0] - (double)q[0]), v = fabs((double)p[1] - (double)q[1]);
    u = part->around ? fmin(u, fabs(part->size[0] - u)) : u;
    return sewn || (a->part == b->part && u <= SAME_PLACE * part->size[0] &&
                    v <= SAME_PLACE * part->size[1]);
}

/* (vertex_count) for each vertex the first that is the same one. */
static const int32_t *join_twins(const Surface *surface, bool sewn, Arena *arena) {
    int count = surface->vertex_count;
    int32_t *join = arena_push(arena, int32_t, count);
    Twin *twins = arena_push(arena, Twin, count);
    for (int i = 0; i < surface->part_count; i++) {
        const SurfacePart *part = &surface->parts[i];
        for (int k = part->vertex_begin; k < part->vertex_begin + part->vertex_count; k++) {
            twins[k] = (Twin){surface, i, (uint32_t)k};
            join[k] = k;
        }
    }
    qsort(twins, (size_t)count, sizeof *twins, compare_twins);
    for (int i = 1, begin = 0; i < count; i++) {
        const float *p = place_of(&twins[i]), *q = place_of(&twins[begin]);
        begin = p[0] == q[0] && p[1] == q[1] && p[2] == q[2] ? begin : i;
        for (int k = begin; k < i; k++) {
            if (are_one(&twins[k], &twins[i], sewn)) {
                join[twins[i].vertex] = join[twins[k].vertex];
                break;
            }
        }
    }
    return join;
}

static void describe(const StateHeader *header, const Surface *surface, int triangle, char *text,
                     size_t size) {
    int part = 0;
    double middle[2] = {0, 0};
    while (part + 1 < surface->part_count && triangle >= surface->parts[part + 1].fine_begin) {
        part++;
    }
    for (int k = 0; k < 6; k++) {
        uint32_t vertex = surface->fine[3 * (size_t)triangle + (size_t)k / 2];
        middle[k % 2] += (double)surface->uv[2 * (size_t)vertex + k % 2] / 3.0;
    }
    snprintf(text, size, "%s at (%.4f, %.4f) m", header->cloths[part].name,
             middle[0] + surface->parts[part].corner[0],
             middle[1] + surface->parts[part].corner[1]);
}

bool measure_drawn(const StateHeader *header, const StateLayout *layout, const StateFrame *frame,
                   Resampler *resampler, Arena *arena, MeasureCrossings *found, Error *error) {
    *found = (MeasureCrossings){.obstacle = arena_push(arena, int64_t, header->obstacle_count)};
    ArenaMark mark = arena_mark(arena);
    const Surface *surface = resample_frame(resampler, layout, frame->x);
    double *vertices = arena_push(arena, double, 3 * (size_t)surface->vertex_count);
    int32_t *triangles = arena_push(arena, int32_t, 3 * (size_t)surface->fine_count);
    const int32_t *join = join_twins(surface, layout->w_count != 0, arena);
    for (int i = 0; i < 3 * surface->vertex_count; i++) {
        vertices[i] = (double)surface->vertices[i / 3].position[i % 3];
    }
    for (int i = 0; i < 3 * surface->fine_count; i++) {
        triangles[i] = join[surface->fine[i]];
    }
    CrossingMesh mesh = {surface->vertex_count, surface->fine_count, vertices, triangles};
    const char *damage = crossing_find_damage(&mesh);
    if (damage) {
        return error_set(error, EXIT_BAD_INPUT, "frame %d: %s", frame->frame, damage);
    }
    Crossings pairs = crossing_count_self(&mesh, arena);
    found->cloth = pairs.count;
    if (pairs.count > 0) {
        char one[MEASURE_PLACE_SIZE / 2 - 8], other[MEASURE_PLACE_SIZE / 2 - 8];
        describe(header, surface, pairs.first[0], one, sizeof one);
        describe(header, surface, pairs.first[1], other, sizeof other);
        snprintf(found->place, sizeof found->place, "%s and %s", one, other);
    }
    arena_rewind(arena, mark);
    return true;
}
