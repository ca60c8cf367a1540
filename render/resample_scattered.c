/* Scattered cloths: around each surface vertex i the surface is the quadratic
 *   T_i(a) = s_i + g_i . d + d' H_i d / 2,  d = a - a_i  in material coordinates a = (u, v),
 * fitted by weighted least squares to the two rings of neighbours. Inside a triangle the three
 * are blended with weights b_i^2 / sum b^2 (b: barycentric), whose derivatives vanish across
 * the opposite edge; the normal blends the gradients, so it is continuous everywhere. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/resample.h"
#include "sim/base/error.h"

#define TERMS 5            /* u, v, u^2 / 2, u v, v^2 / 2 */
#define RIDGE 1e-7         /* of the largest pivot: keeps degenerate neighbourhoods solvable */
#define MOST_NEIGHBOURS 48 /* of one vertex */
#define MOST_LEVELS 64     /* pieces along the edge of a triangle */

typedef struct ScatteredPlan {
    int vertex_count, triangle_count;
    int level;                /* pieces along an edge: 1 or even */
    const int32_t *triangles; /* (triangle_count x 3), numbers from 0 */
    const double *material;   /* [m] (vertex_count x 2) */
    int *row_begin;           /* (vertex_count + 1) neighbours of each vertex */
    int *neighbour;           /* (row_begin[vertex_count]) */
    double *row;    /* (row_begin[vertex_count] x TERMS): coefficient = sum row (s_j - s_i) */
    double *taylor; /* (vertex_count x TERMS x 3) of this frame */
} ScatteredPlan;

static int add_neighbour(int *list, int count, int vertex, int centre) {
    if (vertex == centre || count == MOST_NEIGHBOURS) {
        return count;
    }
    for (int i = 0; i < count; i++) {
        if (list[i] == vertex) {
            return count;
        }
    }
    list[count] = vertex;
    return count + 1;
}

/* Triangles around each vertex: begin (vertex_count + 1), member. */
static void find_fans(const ScatteredPlan *plan, int *begin, int *member) {
    for (int i = 0; i < 3 * plan->triangle_count; i++) {
        begin[plan->triangles[i] + 1]++;
    }
    for (int i = 0; i < plan->vertex_count; i++) {
        begin[i + 1] += begin[i];
    }
    for (int i = 3 * plan->triangle_count - 1; i >= 0; i--) {
        member[--begin[plan->triangles[i] + 1]] = i / 3;
    }
    for (int i = 0; i < plan->vertex_count; i++) { /* undo the shift of the counting down */
        begin[i] = begin[i + 1];
    }
    begin[plan->vertex_count] = 3 * plan->triangle_count;
}

static int find_rings(const ScatteredPlan *plan, const int *begin, const int *member, int centre,
                      int *list) {
    int count = 0;
    for (int i = begin[centre]; i < begin[centre + 1]; i++) {
        for (int k = 0; k < 3; k++) {
            count = add_neighbour(list, count, plan->triangles[3 * member[i] + k], centre);
        }
    }
    int first_ring = count;
    for (int n = 0; n < first_ring; n++) {
        for (int i = begin[list[n]]; i < begin[list[n] + 1]; i++) {
            for (int k = 0; k < 3; k++) {
                count = add_neighbour(list, count, plan->triangles[3 * member[i] + k], centre);
            }
        }
    }
    return count;
}

static void terms_at(double u, double v, double out[TERMS]) {
    out[0] = u, out[1] = v, out[2] = 0.5 * u * u, out[3] = u * v, out[4] = 0.5 * v * v;
}

/* Inverse of a symmetric positive matrix with a small ridge, by Gauss-Jordan. */
static void invert(double a[TERMS][TERMS], double inverse[TERMS][TERMS]) {
    double largest = 0.0;
    for (int i = 0; i < TERMS; i++) {
        largest = fmax(largest, a[i][i]);
    }
    for (int i = 0; i < TERMS; i++) {
        a[i][i] += RIDGE * largest + 1e-300;
        for (int j = 0; j < TERMS; j++) {
            inverse[i][j] = i == j;
        }
    }
    for (int p = 0; p < TERMS; p++) {
        double scale = 1.0 / a[p][p];
        for (int j = 0; j < TERMS; j++) {
            a[p][j] *= scale, inverse[p][j] *= scale;
        }
        for (int i = 0; i < TERMS; i++) {
            double factor = a[i][p];
            for (int j = 0; i != p && j < TERMS; j++) {
                a[i][j] -= factor * a[p][j], inverse[i][j] -= factor * inverse[p][j];
            }
        }
    }
}

/* Rows of the least-squares fit around one vertex. */
static void fit_rows(const ScatteredPlan *plan, int centre, const int *list, int count,
                     double *rows) {
    const double *middle = plan->material + 2 * centre;
    double size = 0.0, normal[TERMS][TERMS] = {{0}}, inverse[TERMS][TERMS], term[TERMS];
    for (int n = 0; n < count; n++) {
        const double *a = plan->material + 2 * list[n];
        size = fmax(size, hypot(a[0] - middle[0], a[1] - middle[1]));
    }
    for (int pass = 0; pass < 2; pass++) {
        for (int n = 0; n < count; n++) {
            const double *a = plan->material + 2 * list[n];
            double u = (a[0] - middle[0]) / size, v = (a[1] - middle[1]) / size;
            double weight = 1.0 / ((u * u + v * v) * (u * u + v * v) + 1e-12);
            terms_at(u, v, term);
            for (int i = 0; i < TERMS; i++) {
                double sum = 0.0;
                for (int j = 0; j < TERMS; j++) {
                    normal[i][j] += pass == 0 ? weight * term[i] * term[j] : 0.0;
                    sum += pass == 1 ? inverse[i][j] * term[j] : 0.0;
                }
                rows[TERMS * n + i] = weight * sum / (i < 2 ? size : size * size);
            }
        }
        if (pass == 0) {
            invert(normal, inverse);
        }
    }
}

static void plan_rows(ScatteredPlan *plan, Arena *arena) {
    int *begin = arena_push(arena, int, plan->vertex_count + 1);
    int *member = arena_push(arena, int, 3 * plan->triangle_count);
    find_fans(plan, begin, member);
    int list[MOST_NEIGHBOURS];
    plan->row_begin = arena_push(arena, int, plan->vertex_count + 1);
    for (int i = 0; i < plan->vertex_count; i++) {
        plan->row_begin[i + 1] = plan->row_begin[i] + find_rings(plan, begin, member, i, list);
    }
    int total = plan->row_begin[plan->vertex_count];
    plan->neighbour = arena_push(arena, int, total);
    plan->row = arena_push(arena, double, TERMS *total);
    for (int i = 0; i < plan->vertex_count; i++) {
        int *mine = plan->neighbour + plan->row_begin[i];
        int count = find_rings(plan, begin, member, i, mine);
        fit_rows(plan, i, mine, count, plan->row + TERMS * plan->row_begin[i]);
    }
}

static double measure_panel(const ScatteredPlan *plan, SurfacePart *part) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, area = 0.0;
    for (int i = 0; i < 2 * plan->vertex_count; i++) {
        low[i & 1] = fmin(low[i & 1], plan->material[i]);
        high[i & 1] = fmax(high[i & 1], plan->material[i]);
    }
    for (int i = 0; i < plan->triangle_count; i++) {
        const int32_t *t = plan->triangles + 3 * i;
        const double *a = plan->material + 2 * t[0], *b = plan->material + 2 * t[1];
        const double *c = plan->material + 2 * t[2];
        area += 0.5 * fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
    }
    for (int k = 0; k < 2; k++) {
        part->corner[k] = low[k];
        part->size[k] = fmax(high[k] - low[k], 1e-9);
    }
    part->rectangle = area > 0.99 * part->size[0] * part->size[1];
    return area;
}

static void *scattered_plan(const StateLayout *layout, int cloth, double cell, Arena *arena,
                            SurfacePart *part) {
    int first = layout->vertex_begin[cloth], begin = layout->triangle_begin[cloth];
    ScatteredPlan *plan = arena_push(arena, ScatteredPlan, 1);
    plan->vertex_count = layout->vertex_begin[cloth + 1] - first;
    plan->triangle_count = layout->triangle_begin[cloth + 1] - begin;
    int32_t *triangles = arena_push(arena, int32_t, 3 * plan->triangle_count);
    for (int i = 0; i < 3 * plan->triangle_count; i++) {
        triangles[i] = layout->triangles[3 * begin + i] - first;
        ASSERT(triangles[i] >= 0 && triangles[i] < plan->vertex_count);
    }
    plan->triangles = triangles;
    double *material = arena_push(arena, double, 2 * plan->vertex_count);
    memcpy(material, layout->vertex_material + 2 * first,
           2 * (size_t)plan->vertex_count * sizeof *material);
    plan->material = material;
    double area = measure_panel(plan, part);
    double wanted = 2.0 * area / (cell * cell) / fmax(plan->triangle_count, 1);
    int level = wanted > 1.5 ? 2 * (int)ceil(0.5 * sqrt(wanted)) : 1;
    plan->level = level < MOST_LEVELS ? level : MOST_LEVELS;
    plan_rows(plan, arena);
    plan->taylor = arena_push(arena, double, 3 * TERMS * plan->vertex_count);
    int n = plan->level, coarse = n > 1 ? n / 2 : 1;
    part->vertex_count = plan->triangle_count * (n + 1) * (n + 2) / 2;
    part->fine_count = plan->triangle_count * n * n;
    part->coarse_count = plan->triangle_count * coarse * coarse;
    part->around = false;
    return plan;
}

/* Number of grid vertex (i, j), i + j <= n, in a triangle cut n times: rows of constant j. */
static uint32_t grid_number(int n, int i, int j) {
    return (uint32_t)(j * (n + 1) - j * (j - 1) / 2 + i);
}

static uint32_t *connect_triangle(int n, int step, uint32_t base, uint32_t *out) {
    for (int j = 0; j < n; j += step) {
        for (int i = 0; i + j < n; i += step) {
            *out++ = base + grid_number(n, i, j);
            *out++ = base + grid_number(n, i + step, j);
            *out++ = base + grid_number(n, i, j + step);
            if (i + j + step < n) {
                *out++ = base + grid_number(n, i + step, j);
                *out++ = base + grid_number(n, i + step, j + step);
                *out++ = base + grid_number(n, i, j + step);
            }
        }
    }
    return out;
}

static void scattered_connect(const void *plan_data, Surface *surface, const SurfacePart *part) {
    const ScatteredPlan *plan = plan_data;
    int n = plan->level, per_triangle = (n + 1) * (n + 2) / 2;
    float *uv = surface->uv + 2 * part->vertex_begin;
    uint32_t *fine = surface->fine + 3 * part->fine_begin;
    uint32_t *coarse = surface->coarse + 3 * part->coarse_begin;
    for (int t = 0; t < plan->triangle_count; t++) {
        const int32_t *corner = plan->triangles + 3 * t;
        uint32_t base = (uint32_t)(part->vertex_begin + t * per_triangle);
        fine = connect_triangle(n, 1, base, fine);
        coarse = connect_triangle(n, n > 1 ? 2 : 1, base, coarse);
        for (int j = 0; j <= n; j++) {
            for (int i = 0; i + j <= n; i++) {
                double b[3] = {(double)(n - i - j) / n, (double)i / n, (double)j / n};
                for (int k = 0; k < 2; k++) {
                    double a = b[0] * plan->material[2 * corner[0] + k] +
                               b[1] * plan->material[2 * corner[1] + k] +
                               b[2] * plan->material[2 * corner[2] + k];
                    *uv++ = (float)(a - part->corner[k]);
                }
            }
        }
    }
}

static void find_taylor(ScatteredPlan *plan, const double *s) {
    memset(plan->taylor, 0, 3 * TERMS * (size_t)plan->vertex_count * sizeof *plan->taylor);
    for (int i = 0; i < plan->vertex_count; i++) {
        double *taylor = plan->taylor + 3 * TERMS * i;
        for (int n = plan->row_begin[i]; n < plan->row_begin[i + 1]; n++) {
            const double *row = plan->row + TERMS * n, *other = s + 3 * plan->neighbour[n];
            for (int k = 0; k < 3; k++) {
                double d = other[k] - s[3 * i + k];
                for (int term = 0; term < TERMS; term++) {
                    taylor[3 * term + k] += row[term] * d;
                }
            }
        }
    }
}

/* The blended surface at barycentric coordinates b of corners in ascending order, so that a
 * vertex on an edge has the same bits in both triangles. */
static void blend(const ScatteredPlan *plan, const double *s, const int corner[3],
                  const double b[3], SurfaceVertex *vertex) {
    double a[2] = {0}, total = 0.0, at[3] = {0}, du[3] = {0}, dv[3] = {0};
    for (int c = 0; c < 3; c++) {
        a[0] += b[c] * plan->material[2 * corner[c]];
        a[1] += b[c] * plan->material[2 * corner[c] + 1];
        total += b[c] * b[c];
    }
    for (int c = 0; c < 3; c++) {
        const double *t = plan->taylor + 3 * TERMS * corner[c], *origin = s + 3 * corner[c];
        double w = b[c] * b[c] / total;
        double u = a[0] - plan->material[2 * corner[c]];
        double v = a[1] - plan->material[2 * corner[c] + 1];
        for (int k = 0; k < 3; k++) {
            double uu = t[6 + k], uv = t[9 + k], vv = t[12 + k];
            double slope_u = t[k] + uu * u + uv * v, slope_v = t[3 + k] + uv * u + vv * v;
            at[k] += w * (origin[k] + 0.5 * ((t[k] + slope_u) * u + (t[3 + k] + slope_v) * v));
            du[k] += w * slope_u;
            dv[k] += w * slope_v;
        }
    }
    for (int k = 0; k < 3; k++) {
        vertex->position[k] = (float)at[k];
    }
    resample_set_frame(vertex, du, dv);
}

static void scattered_evaluate(void *plan_data, const double *x, const double *s,
                               SurfaceVertex *vertices) {
    (void)x;
    ScatteredPlan *plan = plan_data;
    find_taylor(plan, s);
    int n = plan->level;
    for (int t = 0; t < plan->triangle_count; t++) {
        const int32_t *corner = plan->triangles + 3 * t;
        int order[3] = {0, 1, 2}; /* corners by number */
        for (int i = 0; i < 3; i++) {
            int p = i == 1 ? 1 : 0;
            if (corner[order[p]] > corner[order[p + 1]]) {
                int swapped = order[p];
                order[p] = order[p + 1], order[p + 1] = swapped;
            }
        }
        int sorted[3] = {corner[order[0]], corner[order[1]], corner[order[2]]};
        for (int j = 0; j <= n; j++) {
            for (int i = 0; i + j <= n; i++) {
                double b[3] = {(double)(n - i - j) / n, (double)i / n, (double)j / n};
                blend(plan, s, sorted, (double[3]){b[order[0]], b[order[1]], b[order[2]]},
                      vertices++);
            }
        }
    }
}

const ResampleKind resample_scattered = {"scattered", scattered_plan, scattered_connect,
                                         scattered_evaluate};
