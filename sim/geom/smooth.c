#include "sim/geom/smooth.h"

#include <math.h>

#include "sim/geom/inside.h"

#define MOST_ITERATIONS 20
#define CLOSE 1e-9        /* of the spacing: converged */
#define LONGEST_STEP 0.5  /* of the spacing */
#define STENCIL_HOLDS 0.5 /* of the spacing: farther from its centre another stencil is taken */
#define LEAST_CURVE 0.1 /* of the metric: less than that is no minimum to go to by Newton's steps */
#define OVERLAP 6.0     /* spacings by which a closed panel goes on */

SmoothSurface smooth_create(const double *material, int count, double spacing, double period,
                            Arena *arena) {
    SmoothSurface s = {.node = arena_push(arena, int, 3 * count)};
    double *points = arena_push(arena, double, 6 * count);
    double low = INFINITY;
    int total = 0;
    for (int i = 0; i < count; i++) {
        low = material[2 * i] < low ? material[2 * i] : low;
    }
    for (int turn = 0; turn < (period > 0.0 ? 3 : 1); turn++) {
        double shift = turn == 0 ? 0.0 : turn == 1 ? -period : period;
        for (int i = 0; i < count; i++) {
            double u = material[2 * i] + shift - low;
            if (turn == 0 || (u > -OVERLAP * spacing && u < period + OVERLAP * spacing)) {
                points[2 * total] = u + low, points[2 * total + 1] = material[2 * i + 1];
                s.node[total++] = i;
            }
        }
    }
    s.grid = points_grid(points, total, spacing, arena);
    return s;
}

typedef struct Local {
    Vec3 place, d[2], dd[3]; /* x, its slopes, and 11, 12, 22 */
} Local;

static Local evaluate(const SmoothSurface *s, const double *x, const RbfStencil *stencil,
                      const double at[2]) {
    const RbfFunctional kinds[6] = {RBF_VALUE, RBF_D1, RBF_D2, RBF_D11, RBF_D12, RBF_D22};
    double weights[6][STENCIL_CAPACITY];
    Vec3 sum[6] = {{0, 0, 0}};
    rbf_rows(stencil, at, 6, kinds, weights);
    for (int f = 0; f < 6; f++) {
        for (int i = 0; i < stencil->count; i++) {
            int node = s->node[stencil->nodes[i]];
            sum[f] = vec3_axpy(sum[f], weights[f][i], vec3_load(x + 3 * (size_t)node));
        }
    }
    return (Local){sum[0], {sum[1], sum[2]}, {sum[3], sum[4], sum[5]}};
}

/* Newton's step of |x - p|^2 / 2, or that of Gauss and Newton where there is no minimum ahead */
static bool step_of(const Local *l, Vec3 p, double step[2]) {
    Vec3 off = vec3_sub(l->place, p);
    double g[2] = {vec3_dot(l->d[0], off), vec3_dot(l->d[1], off)};
    double a = vec3_dot(l->d[0], l->d[0]), b = vec3_dot(l->d[0], l->d[1]);
    double c = vec3_dot(l->d[1], l->d[1]), metric = a * c - b * b;
    double aa = a + vec3_dot(l->dd[0], off), bb = b + vec3_dot(l->dd[1], off);
    double cc = c + vec3_dot(l->dd[2], off), determinant = aa * cc - bb * bb;
    if (aa < LEAST_CURVE * a || determinant < LEAST_CURVE * metric) {
        aa = a, bb = b, cc = c, determinant = metric;
    }
    step[0] = -(cc * g[0] - bb * g[1]) / determinant;
    step[1] = -(aa * g[1] - bb * g[0]) / determinant;
    return isfinite(step[0]) && isfinite(step[1]);
}

bool smooth_project(const SmoothSurface *s, const double *x, Vec3 p, const double start[2],
                    Arena *scratch, SmoothPoint *found) {
    double spacing = s->grid.spacing, at[2] = {start[0], start[1]}, step[2];
    ArenaMark mark = arena_mark(scratch);
    RbfStencil stencil = rbf_stencil(&s->grid, rbf_resample, at, scratch);
    bool near = false;
    for (int k = 0; k < MOST_ITERATIONS && !near; k++) {
        if (hypot(at[0] - stencil.centre[0], at[1] - stencil.centre[1]) > STENCIL_HOLDS * spacing) {
            arena_rewind(scratch, mark);
            stencil = rbf_stencil(&s->grid, rbf_resample, at, scratch);
        }
        Local l = evaluate(s, x, &stencil, at);
        if (!step_of(&l, p, step)) {
            break;
        }
        double length = hypot(step[0], step[1]);
        double share = length > LONGEST_STEP * spacing ? LONGEST_STEP * spacing / length : 1.0;
        at[0] += share * step[0], at[1] += share * step[1];
        near = length < CLOSE * spacing;
    }
    if (near) {
        Local l = evaluate(s, x, &stencil, at);
        found->at[0] = at[0], found->at[1] = at[1];
        found->place = l.place;
        Vec3 normal = vec3_cross(l.d[0], l.d[1]);
        found->normal = vec3_scale(1.0 / vec3_length(normal), normal);
        found->gap = vec3_dot(found->normal, vec3_sub(p, l.place));
        found->inside = inside_contains(&s->grid, at);
    }
    arena_rewind(scratch, mark);
    return near;
}
