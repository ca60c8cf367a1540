#include "sim/contact/flatness.h"

#include <math.h>

#include "sim/contact/quiet_blocks.h"

#define LEAST_GRAPH 0.01 /* slope that rounding does not reach */

Flatness flatness_create(const Surface *surface, Arena *arena) {
    Flatness f = {.kernel = quiet_blocks_kernel(vector_best()),
                  .altitude = arena_push(arena, double, surface->panel_count),
                  .slopes = arena_push(arena, Slopes, surface->group_count)};
    for (int p = 0; p < surface->panel_count; p++) {
        const SurfacePanel *panel = &surface->panels[p];
        f.altitude[p] = panel->nu > 0 ? surface_lattice_altitude(panel) : 0.0;
    }
    return f;
}

/* Group g as block k of `blocks`, from the origin of `fit` on. */
static void place_group(const Surface *surface, const Points *x, int g, const SlopeFit *fit,
                        SlopeBlocks *blocks, int k) {
    const SurfaceGroup *group = &surface->groups[g];
    const SurfacePanel *panel = &surface->panels[group->panel];
    int first[2] = {group->block[0] * SURFACE_BLOCK, group->block[1] * SURFACE_BLOCK};
    int cells[2] = {quiet_blocks_cells(panel, group->block, 0),
                    quiet_blocks_cells(panel, group->block, 1)};
    blocks->cells[0][k] = (float)cells[0], blocks->cells[1][k] = (float)cells[1];
    for (int n = 0; n < SLOPE_NODES * SLOPE_NODES; n++) {
        int m = n / SLOPE_NODES, c = n % SLOPE_NODES;
        int i = first[0] + (c < cells[0] ? c : cells[0]), j = m < cells[1] ? m : cells[1];
        int node = (first[1] + j) * panel->nu + (i < panel->nu ? i : i - panel->nu);
        const double *at = x->x + 3 * (long)(panel->first + node);
        for (int a = 0; a < 3; a++) {
            blocks->node[m][c][a][k] = (float)(at[a] - fit->origin[a]);
        }
    }
}

/* up to SLOPE_BATCH groups of one panel */
static void fit_batch(const Flatness *f, const Surface *surface, const Points *x, const int *groups,
                      int count) {
    const SurfaceGroup *first = &surface->groups[groups[0]];
    const SurfacePanel *panel = &surface->panels[first->panel];
    Vec3 origin = point_at(x, surface->group_vertices[first->vertex_begin]);
    SlopeBlocks blocks;
    SlopeFit fit = {.h = {panel->h1, panel->h2}, .origin = {origin.x, origin.y, origin.z}};
    slope_blocks_begin(&blocks, &fit);
    for (int k = 0; k < count; k++) {
        place_group(surface, x, groups[k], &fit, &blocks, k);
    }
    f->kernel->fit(&fit);
    for (int k = 0; k < count; k++) {
        f->slopes[groups[k]] = slope_field_at(&fit.slopes, k);
    }
}

void flatness_fit(const Flatness *f, const Surface *surface, const Points *x, const int *groups,
                  int count) {
    for (int first = 0, end = 0; first < count; first = end) {
        int panel = surface->groups[groups[first]].panel;
        for (end = first; end < count && end < first + SLOPE_BATCH; end++) {
            if (surface->groups[groups[end]].panel != panel) {
                break;
            }
        }
        fit_batch(f, surface, x, groups + first, end - first);
    }
}

double flatness_stretch(Vec3 a, Vec3 b) {
    double p = vec3_dot(a, a), q = vec3_dot(b, b), r = vec3_dot(a, b);
    double least = 0.5 * (p + q) - sqrt(0.25 * (p - q) * (p - q) + r * r);
    return sqrt(fmax(least, 0.0));
}

/* dx/du (axis 0), dx/dv (axis 1) from a node of a lattice to the next */
static Vec3 gradient_at(const SurfacePanel *panel, const Points *x, int axis, int node) {
    int at = panel->first + node, step = axis == 0 ? 1 : panel->nu;
    double h = axis == 0 ? panel->h1 : panel->h2;
    return vec3_scale(1.0 / h, vec3_sub(point_at(x, at + step), point_at(x, at)));
}

static bool has_next(const SurfacePanel *panel, int axis, int node) {
    return axis == 0 ? (node + 1) % panel->nu != 0 : node + panel->nu < panel->nu * panel->nv;
}

bool flatness_is_graph(const SurfacePanel *panel, const Points *x) {
    int nodes = panel->nu * panel->nv;
    if (nodes == 0 || panel->wrap) {
        return false;
    }
    Vec3 mean[2] = {{0, 0, 0}, {0, 0, 0}};
    double square[2] = {0.0, 0.0};
    for (int k = 0; k < 2 * nodes; k++) {
        if (has_next(panel, k % 2, k / 2)) {
            mean[k % 2] = vec3_add(mean[k % 2], gradient_at(panel, x, k % 2, k / 2));
        }
    }
    mean[0] = vec3_scale(1.0 / (nodes - panel->nv), mean[0]);
    mean[1] = vec3_scale(1.0 / (nodes - panel->nu), mean[1]);
    Vec3 normal = vec3_unit(vec3_cross(mean[0], mean[1]), vec3(0, 0, 1));
    for (int k = 0; k < 2 * nodes; k++) {
        if (has_next(panel, k % 2, k / 2)) {
            Vec3 d = vec3_sub(gradient_at(panel, x, k % 2, k / 2), mean[k % 2]);
            d = vec3_axpy(d, -vec3_dot(d, normal), normal);
            square[k % 2] = max2(square[k % 2], vec3_dot(d, d));
        }
    }
    return flatness_stretch(mean[0], mean[1]) > sqrt(square[0] + square[1]) + LEAST_GRAPH;
}

int flatness_groups(const Surface *surface, int first, int second, int group[4]) {
    const SurfaceGroup *a = &surface->groups[first], *b = &surface->groups[second];
    const SurfacePanel *panel = &surface->panels[a->panel];
    if (a->panel != b->panel || panel->nu == 0) {
        return 0;
    }
    const int *blocks = surface->blocks + 2 * a->panel;
    int right = flatness_step(a->block[0], b->block[0], blocks[0], panel->wrap);
    int up = flatness_step(a->block[1], b->block[1], blocks[1], false);
    if (right == 2 || up == 2) {
        return 0;
    }
    int count = 0;
    for (int k = 0; k < 4; k++) {
        if ((k & 1 && right == 0) || (k & 2 && up == 0)) {
            continue;
        }
        int i = k & 1 ? b->block[0] : a->block[0], j = k & 2 ? b->block[1] : a->block[1];
        group[count++] = surface->first_group[a->panel] + j * blocks[0] + i;
    }
    return count;
}

double flatness_distance(const Flatness *f, const Surface *surface, int first, int second) {
    int group[4], count = flatness_groups(surface, first, second, group);
    if (count == 0) {
        return 0.0;
    }
    const Slopes *part[4];
    for (int k = 0; k < count; k++) {
        part[k] = &f->slopes[group[k]];
    }
    return slopes_least(part, count) * f->altitude[surface->groups[first].panel];
}
