#include "render/resample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/apart.h"
#include "render/surfel.h"
#include "sim/base/error.h"
#include "sim/base/memory.h"

#define CELL_PIXELS 1.75 /* [px] width of a cell: smaller ones waste the rasteriser */
#define SPLAT_PIXELS 2.5 /* [px] the same of surfels: each carries its slopes, so fewer do */
#define SPLAT_SHARE                                                                                \
    0.55 /* of the triangles that would be allowed: keeps their cost near a mesh's */
#define SMALLEST_CELL 5e-5   /* [m] of a surface whose number of triangles is given */
#define CELL_GROWTH 1.04     /* cells grow by this until the surface is under the cap */
#define CELL_GROWTH_MOST 300 /* steps: a cloth that is large by itself is drawn as it is */

struct Resampler {
    Arena arena;
    const ResampleKind **kinds; /* (part_count) */
    void **plans;               /* (part_count) */
    double *s;                  /* [m] (layout vertex_count x 3) */
    bool derivatives;           /* in the vertices, for splats */
    Apart *apart;               /* NULL: smooth everywhere */
    Surface surface;
};

static const ResampleKind *kind_of(const StateLayout *layout, int cloth) {
    const int32_t *lattice = layout->lattice + 4 * cloth;
    int nodes = layout->node_begin[cloth + 1] - layout->node_begin[cloth];
    bool is_lattice = lattice[0] >= 2 && lattice[1] >= 2 && lattice[0] * lattice[1] == nodes;
    return is_lattice ? &resample_lattice : &resample_scattered;
}

static int plan_parts(Resampler *resampler, const StateLayout *layout, double cell) {
    int triangles = 0;
    for (int i = 0; i < layout->cloth_count; i++) {
        SurfacePart *part = &resampler->surface.parts[i];
        resampler->kinds[i] = kind_of(layout, i);
        resampler->plans[i] = resampler->kinds[i]->plan(layout, i, cell, &resampler->arena, part);
        triangles += part->fine_count;
    }
    return triangles;
}

static void place_parts(Surface *surface) {
    for (int i = 0; i < surface->part_count; i++) {
        SurfacePart *part = &surface->parts[i];
        part->vertex_begin = surface->vertex_count;
        part->fine_begin = surface->fine_count;
        part->coarse_begin = surface->coarse_count;
        surface->vertex_count += part->vertex_count;
        surface->fine_count += part->fine_count;
        surface->coarse_count += part->coarse_count;
    }
}

/* NULL where it could change nothing: drawn are the simulated triangles, or they are not known. */
static Apart *create_apart(const Resampler *resampler, const StateLayout *layout, Arena *arena) {
    Piece *pieces = arena_push(arena, Piece, layout->triangle_count);
    bool follows = false;
    for (int i = 0; i < layout->cloth_count; i++) {
        int begin = layout->triangle_begin[i], count = layout->triangle_begin[i + 1] - begin;
        int32_t *corner = arena_push(arena, int32_t, 3 * (size_t)count);
        for (int k = 0; k < 3 * count; k++) {
            corner[k] = layout->triangles[3 * (size_t)begin + k] - layout->vertex_begin[i];
            pieces[begin + k / 3].corner[k % 3] = corner[k];
        }
        if (resample_takes_values(layout, i) &&
            resampler->kinds[i]->place(resampler->plans[i], &resampler->surface.parts[i], corner,
                                       count, pieces + begin)) {
            follows = follows || layout->w_count > 0 || (count > 0 && pieces[begin].level > 1);
        } else {
            for (int t = 0; t < count; t++) {
                pieces[begin + t].level = 0;
            }
        }
        for (int k = 0; k < 3 * count; k++) {
            pieces[begin + k / 3].corner[k % 3] += layout->vertex_begin[i];
        }
    }
    return follows ? apart_create(layout, resampler->surface.parts, pieces, arena) : NULL;
}

Resampler *resample_create(const StateLayout *layout, const ResampleDef *def) {
    Resampler *resampler = memory_zeroed(1, sizeof *resampler);
    Arena *arena = &resampler->arena;
    Surface *surface = &resampler->surface;
    surface->part_count = layout->cloth_count;
    surface->parts = arena_push(arena, SurfacePart, layout->cloth_count);
    resampler->kinds = arena_push(arena, const ResampleKind *, layout->cloth_count);
    resampler->plans = arena_push(arena, void *, layout->cloth_count);
    resampler->s = arena_push(arena, double, 3 * layout->vertex_count);
    double cell = def->triangles > 0
                      ? SMALLEST_CELL
                      : (def->splats ? SPLAT_PIXELS : CELL_PIXELS) / def->pixels_per_metre;
    double most =
        def->triangles > 0 ? def->triangles : def->triangle_cap * (def->splats ? SPLAT_SHARE : 1.0);
    ArenaMark mark = arena_mark(arena);
    for (int i = 0; i < CELL_GROWTH_MOST; i++) {
        arena_rewind(arena, mark);
        if (plan_parts(resampler, layout, cell) <= most) {
            break;
        }
        cell *= CELL_GROWTH;
    }
    place_parts(surface);
    surface->vertices = arena_push(arena, SurfaceVertex, surface->vertex_count);
    surface->uv = arena_push(arena, float, 2 * surface->vertex_count);
    surface->moved = arena_push(arena, unsigned char, surface->vertex_count);
    surface->values = def->values ? arena_push(arena, float, surface->vertex_count) : NULL;
    surface->fine = arena_push(arena, uint32_t, 3 * surface->fine_count);
    surface->coarse = arena_push(arena, uint32_t, 3 * surface->coarse_count);
    for (int i = 0; i < surface->part_count; i++) {
        if (resampler->kinds[i]->prepare) {
            resampler->kinds[i]->prepare(resampler->plans[i], arena);
        }
        resampler->kinds[i]->connect(resampler->plans[i], surface, &surface->parts[i]);
    }
    resampler->apart = def->crossing ? NULL : create_apart(resampler, layout, arena);
    resampler->derivatives = def->splats;
    if (def->splats) {
        surface->surfels = arena_push(arena, Surfel, surface->vertex_count);
        surface->bends = arena_push(arena, float, 6 * surface->vertex_count);
        surface->folds = arena_push(arena, uint32_t, 3 * surface->fine_count);
        surface->slopes = def->values ? arena_push(arena, float, 2 * surface->vertex_count) : NULL;
        surfel_fill(layout, surface);
    }
    return resampler;
}

void resample_destroy(Resampler *resampler) {
    if (resampler) {
        arena_free(&resampler->arena);
        free(resampler);
    }
}

static void find_box(Surface *surface) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < surface->vertex_count; i++) {
        for (int k = 0; k < 3; k++) {
            float p = surface->vertices[i].position[k];
            low[k] = p < low[k] ? p : low[k];
            high[k] = p > high[k] ? p : high[k];
        }
    }
    memcpy(surface->low, low, sizeof low);
    memcpy(surface->high, high, sizeof high);
}

const Surface *resample_frame(Resampler *resampler, const StateLayout *layout, const double *x) {
    Surface *surface = &resampler->surface;
    state_surface(layout, x, resampler->s);
    for (int i = 0; i < surface->part_count; i++) {
        const double *nodes = x + 3 * layout->node_begin[i];
        const double *vertices = resampler->s + 3 * layout->vertex_begin[i];
        resampler->kinds[i]->evaluate(resampler->plans[i], nodes, vertices, resampler->derivatives,
                                      surface->vertices + surface->parts[i].vertex_begin);
    }
    bool moved = resampler->apart &&
                 apart_move(resampler->apart, resampler->s, resampler->derivatives, surface);
    find_box(surface);
    if (surface->bends) {
        surfel_bend(surface, &resampler->arena);
    }
    if (surface->folds) {
        surfel_fold(surface, moved);
    }
    return surface;
}

bool resample_takes_values(const StateLayout *layout, int cloth) {
    int nodes = layout->node_begin[cloth + 1] - layout->node_begin[cloth];
    int vertices = layout->vertex_begin[cloth + 1] - layout->vertex_begin[cloth];
    return kind_of(layout, cloth) != &resample_lattice || nodes == vertices;
}

void resample_values(Resampler *resampler, const StateLayout *layout, int cloth,
                     const double *values) {
    Surface *surface = &resampler->surface;
    const SurfacePart *part = &surface->parts[cloth];
    int count = layout->vertex_begin[cloth + 1] - layout->vertex_begin[cloth];
    ASSERT(surface->values && resample_takes_values(layout, cloth));
    ArenaMark mark = arena_mark(&resampler->arena);
    double *points = arena_push(&resampler->arena, double, 3 * (size_t)count);
    SurfaceVertex *spread = arena_push(&resampler->arena, SurfaceVertex, part->vertex_count);
    for (int i = 0; i < count; i++) {
        points[3 * (size_t)i] = values[i];
    }
    resampler->kinds[cloth]->evaluate(resampler->plans[cloth], points, points, true, spread);
    for (int i = 0; i < part->vertex_count; i++) {
        int at = part->vertex_begin + i;
        surface->values[at] = spread[i].position[0];
        for (int k = 0; k < 2 && surface->slopes; k++) { /* derivatives stand there */
            surface->slopes[2 * at + k] = k == 0 ? spread[i].normal[0] : spread[i].tangent[0];
        }
    }
    arena_rewind(&resampler->arena, mark);
}

const Surface *resample_surface(const Resampler *resampler) { return &resampler->surface; }

void resample_set_frame(SurfaceVertex *vertex, const double du[3], const double dv[3],
                        bool derivatives) {
    if (derivatives) {
        for (int k = 0; k < 3; k++) {
            vertex->normal[k] = (float)du[k];
            vertex->tangent[k] = (float)dv[k];
        }
        return;
    }
    Vec3 u = vec3_unit(vec3_load(du), vec3(1, 0, 0));
    Vec3 v = vec3_unit(vec3_load(dv), vec3(0, 1, 0));
    Vec3 normal = vec3_unit(vec3_cross(u, v), vec3(0, 0, 1));
    vertex->normal[0] = (float)normal.x;
    vertex->normal[1] = (float)normal.y;
    vertex->normal[2] = (float)normal.z;
    vertex->tangent[0] = (float)u.x;
    vertex->tangent[1] = (float)u.y;
    vertex->tangent[2] = (float)u.z;
}
