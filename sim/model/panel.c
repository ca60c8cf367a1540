#include "sim/model/panel.h"

#include <math.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/model/garment.h"
#include "sim/model/panel_mesh.h"
#include "sim/model/scatter.h"

#define ERROR_AT_BENDING_LENGTH 0.2 /* relative error when the spacing is the bending length */
#define STANDARD_GRAVITY 9.80665    /* [m/s2] */

double panel_accurate_spacing(const ClothDef *def) {
    if (def->accuracy <= 0.0) {
        return 0.0;
    }
    Material m = fabric_material(&def->fabric);
    double length = cbrt(fmin(m.d11, m.d22) / (m.density * STANDARD_GRAVITY));
    return length * sqrt(def->accuracy / ERROR_AT_BENDING_LENGTH);
}

static void lattice_size(const ClothDef *def, int *nu, int *nv) {
    const ShapeDef *shape = &def->shape;
    bool sleeve = shape->kind == SHAPE_SLEEVE;
    double width = sleeve ? 2.0 * PI * shape->radius : shape->width;
    double height = sleeve ? shape->length : shape->height;
    *nu = def->nodes[0];
    *nv = def->nodes[1];
    double accurate = panel_accurate_spacing(def);
    double spacing = accurate > 0.0 ? accurate : def->spacing;
    if (spacing > 0.0) { /* rounded up, so that the spacing is at most the wished one */
        *nu = (int)fmin(1e6, fmax(3.0, ceil(width / spacing - 1e-6) + (sleeve ? 0.0 : 1.0)));
        *nv = (int)fmin(1e6, fmax(3.0, ceil(height / spacing - 1e-6) + 1.0));
    }
}

static bool is_lattice(const ClothDef *def) {
    return def->shape.kind == SHAPE_SLEEVE ||
           (def->shape.kind == SHAPE_RECTANGLE && !def->scattered);
}

/* two triangles a cell, diagonals alternate */
static void lattice_triangles(Panel *p, Arena *arena) {
    int cells = p->wrap ? p->nu : p->nu - 1;
    p->triangles = arena_push(arena, int, 6 * cells * (p->nv - 1));
    p->triangle_count = 2 * cells * (p->nv - 1);
    int *out = p->triangles;
    for (int j = 0; j + 1 < p->nv; j++) {
        for (int i = 0; i < cells; i++) {
            int right = (i + 1) % p->nu;
            int a = j * p->nu + i, b = j * p->nu + right;
            int c = a + p->nu, d = b + p->nu;
            int even[6] = {a, b, d, a, d, c}, odd[6] = {a, b, c, b, d, c};
            memcpy(out, (i + j) % 2 == 0 ? even : odd, sizeof even);
            out += 6;
        }
    }
}

static void lattice_outline(Panel *p, Arena *arena) {
    double width = p->h1 * (p->wrap ? p->nu : p->nu - 1), height = p->h2 * (p->nv - 1);
    double corners[8] = {0, 0, width, 0, width, height, 0, height};
    p->loop_count = 1;
    p->outline_begin = arena_push(arena, int, 2);
    p->outline_begin[1] = 4;
    p->outline = arena_push(arena, double, 8);
    memcpy(p->outline, corners, sizeof corners);
}

static Vec3 lattice_start(const Panel *p, int i, int j) {
    double u = p->h1 * i, v = p->h2 * j;
    if (!p->wrap) {
        return vec3(u - 0.5 * p->h1 * (p->nu - 1), v - 0.5 * p->h2 * (p->nv - 1), 0.0);
    }
    /* on the circle whose chords are h1, so that nothing is stretched at the start */
    double radius = 0.5 * p->h1 / sin(PI / p->nu), angle = 2.0 * PI * i / p->nu;
    return vec3(radius * cos(angle), radius * sin(angle), v - 0.5 * p->h2 * (p->nv - 1));
}

static bool lattice_create(const ClothDef *def, Arena *arena, Panel *p, Error *error) {
    const ShapeDef *shape = &def->shape;
    lattice_size(def, &p->nu, &p->nv);
    p->wrap = shape->kind == SHAPE_SLEEVE;
    if ((double)p->nu * p->nv > PANEL_MOST_NODES) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': %d x %d nodes; at most %d are possible", def->name, p->nu,
                         p->nv, PANEL_MOST_NODES);
    }
    if (p->nu < (p->wrap ? 5 : 3) || p->nv < 3) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': %d x %d nodes; at least 3 x 3 are needed, 5 x 3 for a sleeve",
                         def->name, p->nu, p->nv);
    }
    p->h1 = p->wrap ? 2.0 * PI * shape->radius / p->nu : shape->width / (p->nu - 1);
    p->h2 = (p->wrap ? shape->length : shape->height) / (p->nv - 1);
    p->node_count = p->nu * p->nv;
    p->material = arena_push(arena, double, 2 * p->node_count);
    p->start = arena_push(arena, double, 3 * p->node_count);
    p->area = arena_push(arena, double, p->node_count);
    for (int j = 0; j < p->nv; j++) {
        for (int i = 0; i < p->nu; i++) {
            int node = j * p->nu + i;
            bool border_u = !p->wrap && (i == 0 || i == p->nu - 1);
            bool border_v = j == 0 || j == p->nv - 1;
            p->material[2 * node] = p->h1 * i;
            p->material[2 * node + 1] = p->h2 * j;
            p->area[node] = p->h1 * p->h2 * (border_u ? 0.5 : 1.0) * (border_v ? 0.5 : 1.0);
            vec3_store(p->start + 3 * node, lattice_start(p, i, j));
        }
    }
    p->rest_curvature[0] = shape->rest_curvature[0];
    p->rest_curvature[1] = shape->rest_curvature[1];
    if (p->wrap && shape->rest_curved) {
        /* second difference of the inscribed polygon, so that the start is free of moments */
        p->rest_curvature[0] = -2.0 * sin(PI / p->nu) / p->h1;
    }
    lattice_triangles(p, arena);
    lattice_outline(p, arena);
    return true;
}

/* smooth noise out of the plane, so that symmetric scenes can choose a side */
static void add_noise(const ClothDef *def, uint64_t seed, Panel *p) {
    for (int node = 0; node < p->node_count && def->noise > 0.0; node++) {
        double *x = p->start + 3 * node;
        double shift = def->noise * hash_random(seed, (uint64_t)node);
        bool around = p->wrap || p->vertex_node;
        Vec3 away = around ? vec3_unit(vec3(x[0], x[1], 0), vec3(1, 0, 0)) : vec3(0, 0, 1);
        vec3_store(x, vec3_axpy(vec3_load(x), shift, away));
    }
}

bool panel_create(const ClothDef *def, uint64_t seed, Arena *arena, Panel *panel, Error *error) {
    *panel = (Panel){0};
    bool mesh = def->shape.kind == SHAPE_MESH;
    bool ok = mesh              ? panel_from_mesh(def, arena, panel, error)
              : is_lattice(def) ? lattice_create(def, arena, panel, error)
                                : scatter_create(def, seed, arena, panel, error);
    if (ok && def->shape.kind == SHAPE_GARMENT) {
        ok = garment_sew(def, arena, panel, error);
    } else if (ok && !mesh) {
        panel->vertex_count = panel->node_count;
        panel->vertex_material = panel->material;
        panel->vertex_triangles = panel->triangles;
    }
    if (ok) {
        add_noise(def, seed, panel);
    }
    return ok;
}

static bool lattice_in_region(const Panel *p, RegionKind region, int i, int j) {
    bool left = !p->wrap && i == 0, right = !p->wrap && i == p->nu - 1;
    bool bottom = j == 0, top = j == p->nv - 1;
    switch (region) {
    case REGION_LEFT:
        return left;
    case REGION_RIGHT:
        return right;
    case REGION_BOTTOM:
        return bottom;
    case REGION_TOP:
        return top;
    case REGION_BOTTOM_LEFT:
        return bottom && left;
    case REGION_BOTTOM_RIGHT:
        return bottom && right;
    case REGION_TOP_LEFT:
        return top && left;
    case REGION_TOP_RIGHT:
        return top && right;
    case REGION_MIDLINE:
        return j == (p->nv - 1) / 2;
    case REGION_BORDER:
        return left || right || bottom || top;
    default:
        return false;
    }
}

static int select_nearest(const Panel *p, const double point[2], unsigned char *marks) {
    int nearest = 0;
    double least = INFINITY;
    for (int node = 0; node < p->node_count; node++) {
        double du = p->material[2 * node] - point[0], dv = p->material[2 * node + 1] - point[1];
        if (du * du + dv * dv < least) {
            least = du * du + dv * dv;
            nearest = node;
        }
    }
    marks[nearest] = 1;
    return 1;
}

int panel_select(const Panel *p, const HandleDef *handle, unsigned char *marks) {
    if (handle->region == REGION_NEAREST) {
        return select_nearest(p, handle->point, marks);
    }
    if (p->vertex_node && handle->region == REGION_BORDER) {
        return garment_select(p, PANEL_FREE_BORDER, marks);
    }
    if (p->vertex_node && handle->region != REGION_ALL && handle->region != REGION_CIRCLE) {
        return garment_select(p, handle->region == REGION_TOP ? GARMENT_TOP : GARMENT_BOTTOM,
                              marks);
    }
    int count = 0;
    for (int node = 0; node < p->node_count; node++) {
        const double *uv = p->material + 2 * node;
        bool in = handle->region == REGION_ALL;
        if (handle->region == REGION_CIRCLE) {
            in = hypot(uv[0] - handle->point[0], uv[1] - handle->point[1]) <= handle->radius;
        } else if (p->nu > 0) {
            in = in || lattice_in_region(p, handle->region, node % p->nu, node / p->nu);
        } else {
            in = in || scatter_in_region(p, handle->region, node);
        }
        marks[node] |= in;
        count += in;
    }
    return count;
}
