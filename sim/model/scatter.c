#include "sim/model/scatter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/memory.h"
#include "sim/geom/delaunay.h"
#include "sim/model/cells.h"
#include "sim/model/garment.h"

/* of the spacing, besides the random shift: inner nodes start that far from the border. With more,
 * nodes that do not follow the border leave gaps, where stiff cloth locks (0.6: three times the
 * error on a lattice turned by 22.5 degrees) */
#define BORDER_CLEARANCE 0.45
#define RELAXATIONS 25 /* Lloyd steps: more hardly moves the nodes */
/* of the spacing: random shift before relaxing. 0.3 leaves dislocations that no relaxation heals,
 * and doubles the error of stiff cloth */
#define ROUGHNESS 0.15

typedef struct Seeds {
    double *points; /* (count x 2): border nodes loop after loop, then inner nodes */
    int count, capacity;
    const ShapeDef *shape;
} Seeds;

static void push(Seeds *s, double u, double v) {
    if (s->count == s->capacity) {
        s->capacity = s->capacity ? 2 * s->capacity : 1024;
        s->points = memory_resize(s->points, 2 * (size_t)s->capacity * sizeof *s->points);
    }
    s->points[2 * s->count] = u;
    s->points[2 * s->count++ + 1] = v;
}

static double wished_spacing(const ClothDef *def) {
    double accurate = panel_accurate_spacing(def);
    if (accurate > 0.0 || def->spacing > 0.0) {
        return accurate > 0.0 ? accurate : def->spacing;
    }
    double extents[2];
    shape_extents(&def->shape, extents);
    return extents[0] / fmax(2.0, def->nodes[0] - 1.0);
}

static int estimate_nodes(const ClothDef *def) {
    double h = wished_spacing(def);
    return (int)fmin(1e9, 1.2 * shape_area(&def->shape) / (h * h));
}

static void push_circle(Seeds *s, double radius, double spacing, double direction) {
    int count = (int)fmax(8.0, round(2.0 * PI * radius / spacing));
    for (int k = 0; k < count; k++) {
        double angle = direction * 2.0 * PI * k / count;
        push(s, radius * cos(angle), radius * sin(angle));
    }
}

static void push_side(Seeds *s, const double *a, const double *b, int count) {
    for (int k = 0; k < count; k++) {
        double t = (double)k / count;
        push(s, a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]));
    }
}

/* pieces of each side of a loop */
static void divide_loop(const double *outline, int begin, int end, double spacing, int *count) {
    for (int i = begin; i < end; i++) {
        const double *a = outline + 2 * i, *b = outline + 2 * (i + 1 < end ? i + 1 : begin);
        count[i] = (int)fmax(1.0, round(hypot(b[0] - a[0], b[1] - a[1]) / spacing));
    }
}

/* border nodes; fills the panel's loops */
static void make_border(const ClothDef *def, double h, Seeds *s, Panel *p, Arena *arena) {
    const ShapeDef *shape = &def->shape;
    double corners[8] = {0, 0, shape->width, 0, shape->width, shape->height, 0, shape->height};
    int rectangle_begin[2] = {0, 4};
    bool garment = shape->kind == SHAPE_GARMENT, polygon = garment || shape->kind == SHAPE_POLYGON;
    const double *outline = polygon ? shape->outline : corners;
    const int *begin = polygon ? shape->loop_begin : rectangle_begin;
    bool round_shape = shape->kind == SHAPE_DISC || shape->kind == SHAPE_ANNULUS;
    p->loop_count = polygon ? shape->loop_count : shape->kind == SHAPE_ANNULUS ? 2 : 1;
    int sides = round_shape ? 0 : begin[p->loop_count];
    int *count = arena_push(arena, int, sides), *corner = arena_push(arena, int, sides);
    p->outline_begin = arena_push(arena, int, p->loop_count + 1);
    for (int l = 0; l < p->loop_count && !round_shape; l++) {
        divide_loop(outline, begin[l], begin[l + 1], h, count);
    }
    if (garment) {
        garment_divide_seams(shape, h, count);
        p->corner = corner;
    }
    for (int l = 0; l < p->loop_count; l++) {
        if (round_shape) {
            push_circle(s, l == 0 ? shape->radius : shape->inner_radius, h, l == 0 ? 1.0 : -1.0);
        } else {
            for (int i = begin[l]; i < begin[l + 1]; i++) {
                int next = i + 1 < begin[l + 1] ? i + 1 : begin[l];
                corner[i] = s->count;
                push_side(s, outline + 2 * i, outline + 2 * next, count[i]);
            }
        }
        p->outline_begin[l + 1] = s->count;
    }
    p->outline = arena_push(arena, double, 2 * s->count);
    ASSERT(s->points);
    memcpy(p->outline, s->points, 2 * (size_t)s->count * sizeof(double));
}

/* are the inner nodes on a square lattice (turned or jittered), and stay there? */
static bool is_square(const ClothDef *def) { return def->jitter > 0.0 || isfinite(def->grid_turn); }

static bool has_room(const Panel *p, const double point[2], double room) {
    return loops_contain(p->outline, p->outline_begin, p->loop_count, point) &&
           loops_distance(p->outline, p->outline_begin, p->loop_count, point) > room;
}

/* a square lattice turned about the middle */
static void make_turned(double turn, double h, const double low[2], const double high[2],
                        const Panel *p, Seeds *s) {
    int reach = (int)(hypot(high[0] - low[0], high[1] - low[1]) / h) + 1;
    for (int j = -reach; j <= reach; j++) {
        for (int i = -reach; i <= reach; i++) {
            double point[2] = {0.5 * (low[0] + high[0]) + h * (i * cos(turn) - j * sin(turn)),
                               0.5 * (low[1] + high[1]) + h * (i * sin(turn) + j * cos(turn))};
            if (has_room(p, point, BORDER_CLEARANCE * h)) {
                push(s, point[0], point[1]);
            }
        }
    }
}

/* inner nodes: a jittered or turned square lattice, or a roughened triangular one to be relaxed */
static void make_inside(const ClothDef *def, double h, uint64_t seed, const Panel *p, Seeds *s) {
    bool square = is_square(def);
    double row = square ? h : 0.5 * sqrt(3.0) * h, rough = square ? def->jitter : ROUGHNESS;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    int border = s->count;
    for (int i = 0; i < 2 * border; i++) {
        low[i % 2] = fmin(low[i % 2], p->outline[i]);
        high[i % 2] = fmax(high[i % 2], p->outline[i]);
    }
    if (isfinite(def->grid_turn)) {
        make_turned(def->grid_turn, h, low, high, p, s);
        return;
    }
    int rows = (int)((high[1] - low[1]) / row) + 2, columns = (int)((high[0] - low[0]) / h) + 2;
    uint64_t number = 0;
    for (int j = 0; j < rows; j++) {
        for (int i = 0; i < columns; i++, number += 2) {
            double shift = square || j % 2 == 0 ? 0.0 : 0.5 * h;
            double point[2] = {low[0] + i * h + shift, low[1] + j * row};
            if (has_room(p, point, (BORDER_CLEARANCE + rough) * h)) {
                push(s, point[0] + rough * h * hash_random(seed, number),
                     point[1] + rough * h * hash_random(seed, number + 1));
            }
        }
    }
}

/* Points around a panel, so that its straight sides are inside the hull: Qhull joins the facets of
 * rows of points on the hull. Not evenly spaced: no two of them on one circle with a side. */
#define FENCE_POSTS 11
static int add_fence(double *points, int count) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 2 * count; i++) {
        low[i % 2] = fmin(low[i % 2], points[i]);
        high[i % 2] = fmax(high[i % 2], points[i]);
    }
    double size = hypot(high[0] - low[0], high[1] - low[1]);
    for (int k = 0; k < FENCE_POSTS; k++) {
        double angle = 2.0 * PI * k / FENCE_POSTS + 0.1, away = size * (1.0 + 0.03 * k);
        points[2 * (count + k)] = 0.5 * (low[0] + high[0]) + away * cos(angle);
        points[2 * (count + k) + 1] = 0.5 * (low[1] + high[1]) + away * sin(angle);
    }
    return count + FENCE_POSTS;
}

/* triangles whose centroid is inside the panel; *count grows by them */
static bool triangulate_piece(const double *points, int own, int fenced, const int *number,
                              const Panel *p, Arena *arena, int *triangles, int *count) {
    int *found, all;
    if (!delaunay_triangulate(points, fenced, arena, &found, &all)) {
        return false;
    }
    for (int t = 0; t < all; t++) {
        const int *n = found + 3 * t;
        double centroid[2];
        if (n[0] >= own || n[1] >= own || n[2] >= own) {
            continue; /* of the fence */
        }
        for (int c = 0; c < 2; c++) {
            centroid[c] =
                (points[2 * n[0] + c] + points[2 * n[1] + c] + points[2 * n[2] + c]) / 3.0;
        }
        if (loops_contain(p->outline, p->outline_begin, p->loop_count, centroid)) {
            for (int k = 0; k < 3; k++) {
                triangles[3 * *count + k] = number[n[k]];
            }
            ++*count;
        }
    }
    return true;
}

/* The panels of a garment one by one: equal panels side by side are full of points on one circle. */
static bool triangulate(const Seeds *s, const Panel *p, Arena *arena, int **triangles, int *count) {
    const GarmentDef *garment = s->shape->garment;
    bool fence = garment || s->shape->kind == SHAPE_POLYGON;
    int pieces = garment ? garment->panel_count : 1;
    double *points = arena_push(arena, double, 2 * (s->count + FENCE_POSTS));
    int *number = arena_push(arena, int, s->count);
    *triangles = arena_push(arena, int, 6 * s->count); /* fewer than twice the points */
    *count = 0;
    for (int piece = 0; piece < pieces; piece++) {
        int own = 0;
        for (int i = 0; i < s->count; i++) {
            if (garment && garment_panel_at(s->shape, s->points[2 * i]) != piece) {
                continue;
            }
            memcpy(points + 2 * own, s->points + 2 * i, 2 * sizeof *points);
            number[own++] = i;
        }
        int fenced = fence ? add_fence(points, own) : own;
        if (!triangulate_piece(points, own, fenced, number, p, arena, *triangles, count)) {
            return false;
        }
    }
    return true;
}

/* one Lloyd step: every inner node moves to the centroid of its triangles' area */
static bool lloyd_step(Seeds *s, const Panel *p, int border) {
    Arena scratch = {0};
    int *triangles, count;
    bool ok = triangulate(s, p, &scratch, &triangles, &count);
    double *sum = arena_push(&scratch, double, 3 * s->count);
    for (int t = 0; ok && t < count; t++) {
        const int *n = triangles + 3 * t;
        const double *a = s->points + 2 * n[0], *b = s->points + 2 * n[1],
                     *c = s->points + 2 * n[2];
        double area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        for (int k = 0; k < 3; k++) {
            sum[3 * n[k]] += area * (a[0] + b[0] + c[0]) / 3.0;
            sum[3 * n[k] + 1] += area * (a[1] + b[1] + c[1]) / 3.0;
            sum[3 * n[k] + 2] += area;
        }
    }
    for (int i = border; ok && i < s->count; i++) {
        if (sum[3 * i + 2] > 0.0) {
            s->points[2 * i] = sum[3 * i] / sum[3 * i + 2];
            s->points[2 * i + 1] = sum[3 * i + 1] / sum[3 * i + 2];
        }
    }
    arena_free(&scratch);
    return ok;
}

static void place_nodes(const ClothDef *def, const Seeds *s, Panel *p, Arena *arena) {
    p->node_count = s->count;
    p->material = arena_push(arena, double, 2 * s->count);
    p->start = arena_push(arena, double, 3 * s->count);
    memcpy(p->material, s->points, 2 * (size_t)s->count * sizeof(double));
    bool corner_origin = def->shape.kind == SHAPE_RECTANGLE;
    double centre[2] = {corner_origin ? 0.5 * def->shape.width : 0.0,
                        corner_origin ? 0.5 * def->shape.height : 0.0};
    for (int i = 0; i < s->count; i++) {
        p->start[3 * i] = p->material[2 * i] - centre[0];
        p->start[3 * i + 1] = p->material[2 * i + 1] - centre[1];
    }
    p->rest_curvature[0] = def->shape.rest_curvature[0];
    p->rest_curvature[1] = def->shape.rest_curvature[1];
}

/* does the mesh fill the outline? */
static bool check_area(const ClothDef *def, Panel *p, Arena *arena, Error *error) {
    double outline = loops_area(p->outline, p->outline_begin, p->loop_count), sum = 0.0;
    Cells cells = cells_create(p, arena);
    bool positive = true;
    for (int i = 0; i < p->node_count; i++) {
        sum += cells.area[i];
        positive = positive && cells.area[i] > 0.0;
    }
    p->area = cells.area;
    if (!positive || fabs(sum - outline) > 1e-9 * outline) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': the outline cannot be filled at a spacing of %.3g m; try a "
                         "smaller one",
                         def->name, p->h1);
    }
    return true;
}

bool scatter_create(const ClothDef *def, uint64_t seed, Arena *arena, Panel *p, Error *error) {
    Seeds s = {.shape = &def->shape};
    double h = wished_spacing(def);
    p->h1 = p->h2 = h;
    if (estimate_nodes(def) > PANEL_MOST_NODES) {
        return error_set(error, EXIT_BAD_INPUT, "cloth '%s': more than %d nodes", def->name,
                         PANEL_MOST_NODES);
    }
    make_border(def, h, &s, p, arena);
    int border = s.count;
    make_inside(def, h, seed, p, &s);
    bool ok = true;
    for (int k = 0; ok && k < RELAXATIONS && !is_square(def); k++) {
        ok = lloyd_step(&s, p, border);
    }
    ok = ok && triangulate(&s, p, arena, &p->triangles, &p->triangle_count);
    if (ok) {
        place_nodes(def, &s, p, arena);
        ok = check_area(def, p, arena, error);
    } else {
        error_set(error, EXIT_BAD_INPUT, "cloth '%s': the outline encloses no area", def->name);
    }
    free(s.points);
    return ok;
}

bool scatter_in_region(const Panel *p, RegionKind region, int node) {
    int outer = p->outline_begin[1], border = p->outline_begin[p->loop_count];
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 2 * outer; i++) {
        low[i % 2] = fmin(low[i % 2], p->outline[i]);
        high[i % 2] = fmax(high[i % 2], p->outline[i]);
    }
    const double *x = p->material + 2 * (size_t)node;
    double close = 1e-6 * p->h1;
    bool at[4] = {x[0]<low[0] + close, x[0]> high[0] - close,
                  x[1]<low[1] + close, x[1]> high[1] - close};
    switch (region) {
    case REGION_BORDER:
        return node < outer;
    case REGION_INNER:
        return node >= outer && node < border;
    case REGION_MIDLINE:
        return fabs(x[1] - 0.5 * (low[1] + high[1])) < 0.5 * p->h1;
    case REGION_LEFT:
    case REGION_RIGHT:
    case REGION_BOTTOM:
    case REGION_TOP:
        return node < outer && at[region - REGION_LEFT];
    case REGION_BOTTOM_LEFT:
        return node < outer && at[2] && at[0];
    case REGION_BOTTOM_RIGHT:
        return node < outer && at[2] && at[1];
    case REGION_TOP_LEFT:
        return node < outer && at[3] && at[0];
    case REGION_TOP_RIGHT:
        return node < outer && at[3] && at[1];
    default:
        return false;
    }
}
