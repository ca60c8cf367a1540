/* What a drape is without a picture: areas, slices, rim, strain, kinetic energy. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/drape_parts.h"

#define GRAVITY 9.81 /* [m/s2] */

static const double slice_depths[DRAPE_SLICES] = {0.015, 0.020, 0.025}; /* [m] */
static const double percentiles[DRAPE_PERCENTILES] = {0.0, 0.05, 0.5, 0.95, 1.0};

/* Twice the signed area of a triangle on the panel. */
static double flat_area(const FieldMesh *mesh, const int32_t *corner) {
    const double *a = mesh->uv + 2 * (size_t)corner[0];
    double d[2][2];
    for (int k = 0; k < 2; k++) {
        const double *b = mesh->uv + 2 * (size_t)corner[k + 1];
        d[k][0] = b[0] - a[0];
        d[k][1] = b[1] - a[1];
        if (mesh->period > 0.0) {
            d[k][0] -= mesh->period * round(d[k][0] / mesh->period);
        }
    }
    return d[0][0] * d[1][1] - d[1][0] * d[0][1];
}

double drape_flat_area(const FieldMesh *mesh) {
    double sum = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        sum += 0.5 * fabs(flat_area(mesh, mesh->triangles + 3 * (size_t)t));
    }
    return sum;
}

double drape_kinetic(const DrapePart *part, double radius) {
    double energy = 0.0, area = 0.0;
    for (int t = 0; t < part->mesh.triangle_count; t++) {
        const int32_t *corner = part->mesh.triangles + 3 * (size_t)t;
        double weight = fabs(flat_area(&part->mesh, corner));
        for (int k = 0; k < 3; k++) {
            Vec3 v = vec3_load(part->v + 3 * (size_t)corner[k]);
            energy += 0.5 * weight * vec3_dot(v, v);
            area += weight;
        }
    }
    return area > 0.0 ? energy / (area * GRAVITY * radius) : 0.0;
}

void drape_measure_outline(const double *r, double radius, Harmonics *harmonics, Nodes *nodes,
                           int *most, int *least) {
    double smooth[CONTOUR_RAYS];
    *harmonics = harmonics_find(r, CONTOUR_RAYS);
    harmonics_draw(harmonics, CONTOUR_NODE_HARMONICS, smooth);
    *nodes = contour_find_nodes(smooth, DRAPE_PROMINENCE * radius);
    *most = contour_find_nodes(smooth, 0.02 * radius).count;
    *least = contour_find_nodes(smooth, 0.045 * radius).count;
}

/* ---- slices ---- */

/* The cut of a triangle with the plane z = height; p, q from the middle. False: none. */
static bool cut_triangle(double x[3][3], double height, double p[2], double q[2]) {
    int count = 0;
    double ends[3][2];
    for (int k = 0; k < 3; k++) {
        const double *a = x[k], *b = x[(k + 1) % 3];
        if ((a[2] < height) != (b[2] < height)) {
            double part = (height - a[2]) / (b[2] - a[2]);
            ends[count][0] = a[0] + part * (b[0] - a[0]);
            ends[count++][1] = a[1] + part * (b[1] - a[1]);
        }
    }
    if (count == 2) {
        memcpy(p, ends[0], sizeof ends[0]);
        memcpy(q, ends[1], sizeof ends[1]);
    }
    return count == 2;
}

static void finish_slice(const double *r, double depth, double radius, DrapeSlice *slice) {
    *slice = (DrapeSlice){depth, 0.0, INFINITY, 0.0, 0, 0};
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        slice->missed += r[i] == 0.0;
        slice->low = fmin(slice->low, r[i]);
        slice->high = fmax(slice->high, r[i]);
        slice->mean += r[i] / CONTOUR_RAYS;
    }
    if (slice->missed > 0) { /* part of the rim is above the plane */
        slice->mean = slice->low = slice->high = NAN;
        return;
    }
    Harmonics harmonics;
    Nodes nodes;
    int most, least;
    drape_measure_outline(r, radius, &harmonics, &nodes, &most, &least);
    slice->nodes = nodes.count;
}

void drape_slice(const Surface *surface, const SurfacePart *part, Drape *drape) {
    double r[DRAPE_SLICES][CONTOUR_RAYS] = {{0}};
    const double *middle = drape->support.centre;
    const uint32_t *triangles = surface->fine + 3 * (size_t)part->fine_begin;
    drape->area_signed = 0.0;
    for (size_t t = 0; t < (size_t)part->fine_count; t++) {
        double x[3][3], p[2], q[2];
        for (size_t k = 0; k < 3; k++) {
            const float *at = surface->vertices[triangles[3 * t + k]].position;
            for (int c = 0; c < 3; c++) {
                x[k][c] = at[c] - (c < 2 ? middle[c] : 0.0);
            }
        }
        drape->area_signed += 0.5 * ((x[1][0] - x[0][0]) * (x[2][1] - x[0][1]) -
                                     (x[2][0] - x[0][0]) * (x[1][1] - x[0][1]));
        for (int s = 0; s < DRAPE_SLICES; s++) {
            if (cut_triangle(x, drape->support.plane - slice_depths[s], p, q)) {
                contour_add_segment(r[s], drape->warp, p, q);
            }
        }
    }
    drape->area_signed = fabs(drape->area_signed); /* whichever side is up */
    for (int s = 0; s < DRAPE_SLICES; s++) {
        finish_slice(r[s], slice_depths[s], drape->specimen, &drape->slices[s]);
    }
}

/* ---- the rim ---- */

/* For each vertex the next one along the border, -1 inside. Edges of one triangle only are border:
 * those whose reverse is not there. */
static void find_border(const FieldMesh *mesh, int *next, Arena *arena) {
    int *begin = arena_push(arena, int, mesh->vertex_count + 1);
    int *other = arena_push(arena, int, 3 * (size_t)mesh->triangle_count);
    int corners = 3 * mesh->triangle_count;
    for (int i = 0; i < corners; i++) {
        begin[mesh->triangles[i] + 1]++;
    }
    for (int i = 0; i < mesh->vertex_count; i++) {
        begin[i + 1] += begin[i];
        next[i] = -1;
    }
    int *fill = arena_push(arena, int, mesh->vertex_count);
    for (int i = 0; i < corners; i++) {
        int a = mesh->triangles[i], b = mesh->triangles[i % 3 == 2 ? i - 2 : i + 1];
        other[begin[a] + fill[a]++] = b;
    }
    for (int a = 0; a < mesh->vertex_count; a++) {
        for (int i = begin[a]; i < begin[a + 1]; i++) {
            int b = other[i];
            bool reverse = false;
            for (int j = begin[b]; j < begin[b + 1]; j++) {
                reverse = reverse || other[j] == a;
            }
            next[a] = reverse ? next[a] : b;
        }
    }
}

/* Follows the border from `first`; marks it in next. Lengths on the panel and in space [m]; vertices
 * of the loop into loop (vertex_count). */
static int follow(const DrapePart *part, int first, int *next, int *loop, double length[2]) {
    int count = 0;
    length[0] = length[1] = 0.0;
    for (int a = first; next[a] >= 0;) {
        int b = next[a];
        double du = part->mesh.uv[2 * (size_t)b] - part->mesh.uv[2 * (size_t)a];
        double dv = part->mesh.uv[2 * (size_t)b + 1] - part->mesh.uv[2 * (size_t)a + 1];
        if (part->mesh.period > 0.0) {
            du -= part->mesh.period * round(du / part->mesh.period);
        }
        length[0] += hypot(du, dv);
        length[1] += vec3_length(
            vec3_sub(vec3_load(part->x + 3 * (size_t)b), vec3_load(part->x + 3 * (size_t)a)));
        loop[count++] = a;
        next[a] = -2;
        a = b;
    }
    return count;
}

/* Height along the rim at equal steps of its vertices' lengths in space. */
static void sample_heights(const DrapePart *part, const int *loop, int count, double length,
                           double *z) {
    double at = 0.0;
    int ray = 0;
    for (int i = 0; i < count; i++) {
        const double *a = part->x + 3 * (size_t)loop[i];
        const double *b = part->x + 3 * (size_t)loop[(i + 1) % count];
        double piece = vec3_length(vec3_sub(vec3_load(b), vec3_load(a)));
        while (ray < CONTOUR_RAYS && ray * length / CONTOUR_RAYS <= at + piece) {
            double t = piece > 0.0 ? (ray * length / CONTOUR_RAYS - at) / piece : 0.0;
            z[ray++] = a[2] + t * (b[2] - a[2]);
        }
        at += piece;
    }
    for (; ray < CONTOUR_RAYS; ray++) {
        z[ray] = part->x[3 * (size_t)loop[0] + 2];
    }
}

static void measure_rim(const DrapePart *part, Arena *arena, Drape *drape) {
    int *next = arena_push(arena, int, part->mesh.vertex_count);
    int *loop = arena_push(arena, int, part->mesh.vertex_count);
    int *best = arena_push(arena, int, part->mesh.vertex_count), best_count = 0;
    double longest[2] = {0.0, 0.0};
    find_border(&part->mesh, next, arena);
    for (int i = 0; i < part->mesh.vertex_count; i++) {
        double length[2];
        int count = next[i] >= 0 ? follow(part, i, next, loop, length) : 0;
        if (count > 0 && length[0] > longest[0]) {
            memcpy(longest, length, sizeof longest);
            memcpy(best, loop, sizeof *loop * (size_t)count);
            best_count = count;
        }
    }
    if (best_count == 0) {
        return;
    }
    double z[CONTOUR_RAYS];
    sample_heights(part, best, best_count, longest[1], z);
    drape->rim_stretch = longest[1] / longest[0] - 1.0;
    drape->rim_low = INFINITY;
    drape->rim_high = -INFINITY;
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double over = z[i] - drape->support.plane;
        drape->rim_mean += over / CONTOUR_RAYS;
        drape->rim_low = fmin(drape->rim_low, over);
        drape->rim_high = fmax(drape->rim_high, over);
    }
    Harmonics harmonics;
    Nodes nodes;
    int most, least;
    drape_measure_outline(z, drape->specimen, &harmonics, &nodes, &most, &least);
    drape->rim_nodes = nodes.count;
    for (int i = 0; i < nodes.count; i++) {
        drape->rim_fold_depth += nodes.depth[i] / nodes.count;
    }
}

/* ---- strain ---- */

static int compare_numbers(const void *a, const void *b) {
    double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

static void find_percentiles(const double *strain, int component, int count, Arena *arena,
                             double out[DRAPE_PERCENTILES]) {
    double *values = arena_push(arena, double, count);
    for (int i = 0; i < count; i++) {
        values[i] = strain[3 * (size_t)i + (size_t)component];
    }
    qsort(values, (size_t)count, sizeof *values, compare_numbers);
    for (int k = 0; k < DRAPE_PERCENTILES; k++) {
        out[k] = values[(int)lround(percentiles[k] * (count - 1))];
    }
}

void drape_measure_mesh(const DrapePart *part, Arena *arena, Drape *drape) {
    Field field = field_create(part->mesh.vertex_count, arena);
    field_compute(&part->mesh, part->x, &field);
    for (int k = 0; k < 3; k++) {
        find_percentiles(field.strain, k, part->mesh.vertex_count, arena, drape->strain[k]);
    }
    double area = 0.0;
    for (int t = 0; t < part->mesh.triangle_count; t++) {
        const int32_t *corner = part->mesh.triangles + 3 * (size_t)t;
        Vec3 a = vec3_load(part->x + 3 * (size_t)corner[0]);
        Vec3 ab = vec3_sub(vec3_load(part->x + 3 * (size_t)corner[1]), a);
        Vec3 ac = vec3_sub(vec3_load(part->x + 3 * (size_t)corner[2]), a);
        area += 0.5 * vec3_length(vec3_cross(ab, ac));
    }
    drape->area_strain = area / drape->area_specimen - 1.0;
    drape->kinetic = drape_kinetic(part, drape->specimen);
    measure_rim(part, arena, drape);
}
