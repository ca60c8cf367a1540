/* Scattered cloths: around each surface vertex i the surface is an RBF interpolant I_i of the
 * vertices near it on the panel (sim/geom/rbf.h, rbf_resample). Inside a triangle the three are
 * blended with weights b_i^2 / sum b^2 (b: barycentric), a partition of unity: a point on an edge
 * knows only the two ends of the edge, so the surface is continuous, and it passes through every
 * vertex. Derivatives are blended in the same way, so normals are continuous too.
 * Everything but the positions is fixed by the layout: a sample is a row of numbers times the
 * vertices that its triangle sees. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/apart.h"
#include "render/resample.h"
#include "sim/base/error.h"
#include "sim/geom/rbf.h"

#define MOST_LEVELS 64                      /* pieces along the edge of a triangle */
#define PATCH_NODES 40                      /* rings are added around a vertex up to this many */
#define COLUMNS_MOST (3 * STENCIL_CAPACITY) /* vertices that a triangle sees */
#define PARTS 3                             /* of a row: position, slope along u, along v */

typedef struct ScatteredPlan {
    int vertex_count, triangle_count;
    int level;                /* pieces along an edge: 1 or even */
    const int32_t *triangles; /* (triangle_count x 3), numbers from 0 */
    const double *material;   /* [m] (vertex_count x 2) */
    double area;              /* [m2] */
    int *column_begin;        /* (triangle_count + 1) */
    int *column;              /* vertices that a triangle sees, ascending */
    double *row; /* (samples of a triangle x its columns x PARTS), one triangle after the other */
} ScatteredPlan;

/* What is needed while rows are made. */
typedef struct Builder {
    ScatteredPlan *plan;
    double spacing;             /* [m] mean distance of vertices */
    int *fan_begin, *fan;       /* triangles around each vertex */
    int *stencil_begin, *nodes; /* vertices in the stencil of each vertex */
    Arena scratch;
} Builder;

static int samples_of(const ScatteredPlan *plan) {
    return (plan->level + 1) * (plan->level + 2) / 2;
}

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

static int add_once(int *list, int count, int vertex) {
    for (int i = 0; i < count; i++) {
        if (list[i] == vertex) {
            return count;
        }
    }
    if (count < STENCIL_CAPACITY) {
        list[count++] = vertex;
    }
    return count;
}

/* Rings of neighbours around a vertex. They follow the triangles, so a stencil never reaches
 * across a slit or a hole to cloth that is near on the panel only. */
static int find_patch(const Builder *builder, int centre, int list[STENCIL_CAPACITY]) {
    int count = 1, ring = 0;
    list[0] = centre;
    while (count < PATCH_NODES && ring < count) {
        int end = count;
        for (; ring < end; ring++) {
            for (int i = builder->fan_begin[list[ring]]; i < builder->fan_begin[list[ring] + 1];
                 i++) {
                for (int k = 0; k < 3; k++) {
                    int vertex = builder->plan->triangles[3 * builder->fan[i] + k];
                    count = add_once(list, count, vertex);
                }
            }
        }
    }
    return count;
}

/* The stencil of a vertex, with the numbers of the cloth's vertices; lives in scratch. */
static RbfStencil find_stencil(Builder *builder, int centre) {
    int list[STENCIL_CAPACITY];
    int count = find_patch(builder, centre, list);
    double *points = arena_push(&builder->scratch, double, 2 * count);
    const double *material = builder->plan->material;
    for (int i = 0; i < count; i++) {
        memcpy(points + 2 * i, material + 2 * list[i], 2 * sizeof *points);
    }
    PointGrid grid = points_grid(points, count, builder->spacing, &builder->scratch);
    RbfStencil stencil = rbf_stencil(&grid, rbf_resample, material + 2 * centre, &builder->scratch);
    for (int i = 0; i < stencil.count; i++) {
        stencil.nodes[i] = list[stencil.nodes[i]];
    }
    return stencil;
}

static bool is_used(const Builder *builder, int vertex) {
    return builder->fan_begin[vertex + 1] > builder->fan_begin[vertex];
}

static void list_stencils(Builder *builder) {
    int count = builder->plan->vertex_count;
    builder->stencil_begin = arena_push(&builder->scratch, int, count + 1);
    builder->nodes = arena_push(&builder->scratch, int, STENCIL_CAPACITY *count);
    for (int i = 0; i < count; i++) {
        int begin = builder->stencil_begin[i];
        builder->stencil_begin[i + 1] = begin;
        if (is_used(builder, i)) {
            ArenaMark mark = arena_mark(&builder->scratch);
            RbfStencil stencil = find_stencil(builder, i);
            memcpy(builder->nodes + begin, stencil.nodes,
                   (size_t)stencil.count * sizeof *stencil.nodes);
            builder->stencil_begin[i + 1] += stencil.count;
            arena_rewind(&builder->scratch, mark);
        }
    }
}

static int compare_numbers(const void *a, const void *b) {
    return *(const int *)a - *(const int *)b;
}

/* Ascending vertices of the three stencils of a triangle. */
static int merge_columns(const Builder *builder, int triangle, int columns[COLUMNS_MOST]) {
    int count = 0, kept = 0;
    for (int k = 0; k < 3; k++) {
        int vertex = builder->plan->triangles[3 * triangle + k];
        int begin = builder->stencil_begin[vertex], end = builder->stencil_begin[vertex + 1];
        memcpy(columns + count, builder->nodes + begin, (size_t)(end - begin) * sizeof *columns);
        count += end - begin;
    }
    qsort(columns, (size_t)count, sizeof *columns, compare_numbers);
    for (int i = 0; i < count; i++) {
        if (kept == 0 || columns[i] != columns[kept - 1]) {
            columns[kept++] = columns[i];
        }
    }
    return kept;
}

static void list_columns(Builder *builder, Arena *arena) {
    ScatteredPlan *plan = builder->plan;
    int columns[COLUMNS_MOST];
    plan->column_begin = arena_push(arena, int, plan->triangle_count + 1);
    for (int t = 0; t < plan->triangle_count; t++) {
        plan->column_begin[t + 1] = plan->column_begin[t] + merge_columns(builder, t, columns);
    }
    int total = plan->column_begin[plan->triangle_count];
    plan->column = arena_push(arena, int, total);
    for (int t = 0; t < plan->triangle_count; t++) {
        int count = merge_columns(builder, t, columns);
        memcpy(plan->column + plan->column_begin[t], columns, (size_t)count * sizeof *columns);
    }
    plan->row = arena_push(arena, double, (size_t)total *(size_t)samples_of(plan) * PARTS);
}

/* Barycentric coordinates and material place of sample (i, j) of a triangle. Sums run over the
 * corners in ascending order: a sample on an edge has the same bits in both triangles. */
static void find_place(const ScatteredPlan *plan, int triangle, int i, int j, double b[3],
                       double at[2]) {
    const int32_t *corner = plan->triangles + 3 * triangle;
    int n = plan->level, order[3] = {0, 1, 2};
    b[0] = (double)(n - i - j) / n, b[1] = (double)i / n, b[2] = (double)j / n;
    for (int pass = 0; pass < 3; pass++) {
        int p = pass == 1 ? 1 : 0;
        if (corner[order[p]] > corner[order[p + 1]]) {
            int swapped = order[p];
            order[p] = order[p + 1], order[p + 1] = swapped;
        }
    }
    at[0] = at[1] = 0.0;
    double total = 0.0;
    for (int c = 0; c < 3; c++) {
        at[0] += b[order[c]] * plan->material[2 * corner[order[c]]];
        at[1] += b[order[c]] * plan->material[2 * corner[order[c]] + 1];
        total += b[order[c]] * b[order[c]];
    }
    for (int c = 0; c < 3; c++) {
        b[c] = b[c] * b[c] / total;
    }
}

/* Adds what the stencil of a corner says about every sample of a triangle. */
static void add_corner(Builder *builder, const RbfStencil *stencil, int triangle, int corner) {
    static const RbfFunctional parts[PARTS] = {RBF_VALUE, RBF_D1, RBF_D2};
    ScatteredPlan *plan = builder->plan;
    int begin = plan->column_begin[triangle], count = plan->column_begin[triangle + 1] - begin;
    int place[STENCIL_CAPACITY]; /* of the stencil's vertices among the columns */
    for (int k = 0; k < stencil->count; k++) {
        const int *found = bsearch(&stencil->nodes[k], plan->column + begin, (size_t)count,
                                   sizeof *plan->column, compare_numbers);
        place[k] = (int)(found - (plan->column + begin));
    }
    double *row = plan->row + (size_t)begin * (size_t)samples_of(plan) * PARTS;
    for (int j = 0; j <= plan->level; j++) {
        for (int i = 0; i + j <= plan->level; i++, row += PARTS * count) {
            double weight[3], at[2], part[PARTS][STENCIL_CAPACITY];
            find_place(plan, triangle, i, j, weight, at);
            if (weight[corner] == 0.0) {
                continue;
            }
            rbf_rows(stencil, at, PARTS, parts, part);
            for (int k = 0; k < stencil->count; k++) {
                for (int p = 0; p < PARTS; p++) {
                    row[PARTS * place[k] + p] += weight[corner] * part[p][k];
                }
            }
        }
    }
}

/* Vertices come in ascending order, so the corners of a triangle do, too. */
static void scattered_prepare(void *plan_data, Arena *arena) {
    ScatteredPlan *plan = plan_data;
    Builder builder = {
        .plan = plan, .spacing = sqrt(plan->area / fmax(plan->vertex_count, 1)), .scratch = {0}};
    builder.fan_begin = arena_push(&builder.scratch, int, plan->vertex_count + 1);
    builder.fan = arena_push(&builder.scratch, int, 3 * plan->triangle_count);
    find_fans(plan, builder.fan_begin, builder.fan);
    list_stencils(&builder);
    list_columns(&builder, arena);
    for (int i = 0; i < plan->vertex_count; i++) {
        if (!is_used(&builder, i)) {
            continue;
        }
        ArenaMark mark = arena_mark(&builder.scratch);
        RbfStencil stencil = find_stencil(&builder, i);
        for (int f = builder.fan_begin[i]; f < builder.fan_begin[i + 1]; f++) {
            const int32_t *corner = plan->triangles + 3 * builder.fan[f];
            int k = corner[0] == i ? 0 : corner[1] == i ? 1 : 2;
            add_corner(&builder, &stencil, builder.fan[f], k);
        }
        arena_rewind(&builder.scratch, mark);
    }
    arena_free(&builder.scratch);
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
    plan->area = measure_panel(plan, part);
    double wanted = 2.0 * plan->area / (cell * cell) / fmax(plan->triangle_count, 1);
    int level = wanted > 1.5 ? 2 * (int)ceil(0.5 * sqrt(wanted)) : 1;
    plan->level = level < MOST_LEVELS ? level : MOST_LEVELS;
    int n = plan->level, coarse = n > 1 ? n / 2 : 1;
    part->vertex_count = plan->triangle_count * samples_of(plan);
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
    int n = plan->level, per_triangle = samples_of(plan);
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

static bool scattered_place(const void *plan_data, const SurfacePart *part,
                            const int32_t *triangles, int count, Piece *pieces) {
    const ScatteredPlan *plan = plan_data;
    (void)triangles; /* its own */
    for (int t = 0; t < count; t++) {
        pieces[t].origin = part->vertex_begin + t * samples_of(plan);
        pieces[t].step[0] = 1, pieces[t].step[1] = plan->level + 1;
        pieces[t].level = plan->level;
        pieces[t].packed = true;
    }
    return true;
}

static void evaluate_sample(const double *row, double (*near)[3], int count, bool derivatives,
                            SurfaceVertex *vertex) {
    double sum[PARTS][3] = {{0}};
    for (int c = 0; c < count; c++) {
        for (int p = 0; p < PARTS; p++) {
            double weight = row[PARTS * c + p];
            sum[p][0] += weight * near[c][0];
            sum[p][1] += weight * near[c][1];
            sum[p][2] += weight * near[c][2];
        }
    }
    for (int k = 0; k < 3; k++) {
        vertex->position[k] = (float)sum[0][k];
    }
    resample_set_frame(vertex, sum[1], sum[2], derivatives);
}

static void scattered_evaluate(void *plan_data, const double *x, const double *s, bool derivatives,
                               SurfaceVertex *vertices) {
    (void)x;
    const ScatteredPlan *plan = plan_data;
    const double *row = plan->row;
    for (int t = 0; t < plan->triangle_count; t++) {
        double near[COLUMNS_MOST][3];
        int begin = plan->column_begin[t], count = plan->column_begin[t + 1] - begin;
        for (int c = 0; c < count; c++) {
            memcpy(near[c], s + 3 * plan->column[begin + c], sizeof near[c]);
        }
        for (int i = 0; i < samples_of(plan); i++, row += PARTS * count) {
            evaluate_sample(row, near, count, derivatives, vertices++);
        }
    }
}

const ResampleKind resample_scattered = {"scattered",       scattered_plan,  scattered_prepare,
                                         scattered_connect, scattered_place, scattered_evaluate};
