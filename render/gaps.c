#include "render/gaps.h"

#include <math.h>

#include "sim/base/clock.h"
#include "sim/geom/box_tree.h"
#include "sim/geom/closest.h"
#include "sim/geom/smooth.h"

/* a node at other cloth, or the foot of a node on a solid */
typedef struct GapPoint {
    Vec3 place;
    int cloth, node;
    bool foot;
    double distance; /* [m] to the nearest triangle; INFINITY */
    int triangle;
    double at[2]; /* [m] material place there */
} GapPoint;

typedef struct Search {
    const StateLayout *layout;
    const double *surface; /* [m] (vertex_count x 3) */
    double reach;
    GapPoint *points;
    int count;
    double *spacing, *period; /* [m] (cloth_count) */
} Search;

/* [m] mean distance of neighbours of a cloth, and its extent along u where it is closed */
static double spacing_of(const StateLayout *layout, int cloth, double *period) {
    int begin = layout->node_begin[cloth], end = layout->node_begin[cloth + 1];
    double area = 0.0, low = INFINITY, high = -INFINITY;
    for (int t = layout->triangle_begin[cloth]; t < layout->triangle_begin[cloth + 1]; t++) {
        const int32_t *c = layout->triangles + 3 * (size_t)t;
        const double *a = layout->vertex_material + 2 * (size_t)c[0];
        const double *b = layout->vertex_material + 2 * (size_t)c[1];
        const double *d = layout->vertex_material + 2 * (size_t)c[2];
        area += 0.5 * fabs((b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]));
    }
    for (int i = begin; i < end; i++) {
        low = fmin(low, layout->material[2 * i]), high = fmax(high, layout->material[2 * i]);
    }
    const int32_t *lattice = layout->lattice + 4 * (size_t)cloth;
    *period = lattice[2] ? (high - low) * lattice[0] / (lattice[0] - 1) : 0.0;
    if (lattice[0] > 1) {
        const double *first = layout->material + 2 * (size_t)begin;
        return 0.5 * (fabs(first[2] - first[0]) + fabs(first[2 * lattice[0] + 1] - first[1]));
    }
    return sqrt(area / (end - begin));
}

double gaps_spacing(const StateLayout *layout) {
    double sum = 0.0, period;
    for (int c = 0; c < layout->cloth_count; c++) {
        sum += spacing_of(layout, c, &period) / layout->cloth_count;
    }
    return sum;
}

static int cloth_of(const StateLayout *layout, int triangle) {
    int cloth = 0;
    while (triangle >= layout->triangle_begin[cloth + 1]) {
        cloth++;
    }
    return cloth;
}

/* the nodes, and their feet on solids */
static int find_points(const StateHeader *header, const StateLayout *layout,
                       const StateFrame *frame, double reach, GapPoint *points) {
    int count = 0;
    for (int c = 0; c < layout->cloth_count; c++) {
        for (int i = layout->node_begin[c]; i < layout->node_begin[c + 1]; i++) {
            GapPoint point = {.place = vec3_load(frame->x + 3 * (size_t)i),
                              .cloth = c,
                              .node = i,
                              .distance = INFINITY};
            points[count++] = point;
            for (int o = 0; o < header->obstacle_count; o++) {
                Vec3 normal, p = pose_unapply(frame->pose[o], point.place);
                double d = header->obstacles[o].mesh
                               ? INFINITY
                               : solid_distance(&header->obstacles[o].solid, p, &normal);
                point.foot = true;
                if (d < reach) {
                    point.place = pose_apply(frame->pose[o], vec3_axpy(p, -d, normal));
                    points[count++] = point;
                }
                point.place = vec3_load(frame->x + 3 * (size_t)i);
            }
        }
    }
    return count;
}

/* is a material place too near to the point's own node to count? */
static bool is_neighbour(const Search *s, const GapPoint *point, int cloth, const double at[2]) {
    if (point->foot || cloth != point->cloth) {
        return false;
    }
    const double *own = s->layout->material + 2 * (size_t)point->node;
    double u = fabs(at[0] - own[0]), period = s->period[cloth];
    u = period > 0.0 ? fmin(u, fabs(period - u)) : u;
    return hypot(u, at[1] - own[1]) < GAPS_APART * s->spacing[cloth];
}

static void meet(int a, int b, void *context) {
    Search *s = context;
    if (a >= s->count || b < s->count) {
        return;
    }
    GapPoint *point = &s->points[a];
    int t = b - s->count, cloth = cloth_of(s->layout, t);
    const int32_t *c = s->layout->triangles + 3 * (size_t)t;
    if (point->foot && cloth != point->cloth) {
        return;
    }
    double w[3], at[2] = {0, 0};
    Vec3 nearest = {0, 0, 0};
    closest_on_triangle(point->place, vec3_load(s->surface + 3 * (size_t)c[0]),
                        vec3_load(s->surface + 3 * (size_t)c[1]),
                        vec3_load(s->surface + 3 * (size_t)c[2]), w);
    const double *first = s->layout->vertex_material + 2 * (size_t)c[0];
    double period = s->period[cloth];
    for (int k = 0; k < 3; k++) {
        const double *uv = s->layout->vertex_material + 2 * (size_t)c[k];
        double u = uv[0]; /* corners across the seam */
        u += period > 0.0 && u - first[0] > 0.5 * period ? -period : 0.0;
        u += period > 0.0 && first[0] - u > 0.5 * period ? period : 0.0;
        at[0] += w[k] * u, at[1] += w[k] * uv[1];
        nearest = vec3_axpy(nearest, w[k], vec3_load(s->surface + 3 * (size_t)c[k]));
    }
    double distance = vec3_length(vec3_sub(point->place, nearest));
    if (distance < point->distance && distance < s->reach && !is_neighbour(s, point, cloth, at)) {
        point->distance = distance;
        point->triangle = t;
        point->at[0] = at[0], point->at[1] = at[1];
    }
}

static void search_triangles(Search *s, Arena *scratch) {
    int triangles = s->layout->triangle_count, items = s->count + triangles;
    Box *boxes = arena_push(scratch, Box, items);
    Vec3 *centres = arena_push(scratch, Vec3, items);
    for (int i = 0; i < items; i++) {
        boxes[i] = box_empty();
        for (int k = 0; k < (i < s->count ? 1 : 3); k++) {
            const int32_t *c = s->layout->triangles + 3 * (size_t)(i < s->count ? 0 : i - s->count);
            box_add(&boxes[i],
                    i < s->count ? s->points[i].place : vec3_load(s->surface + 3 * (size_t)c[k]));
        }
        centres[i] = vec3_scale(0.5, vec3_add(boxes[i].low, boxes[i].high));
    }
    BoxTree tree = box_tree_create(centres, items, scratch);
    box_tree_refit(&tree, boxes);
    box_tree_pairs(&tree, s->reach, meet, s);
}

/* the smooth gap of one point, and whether it changed sides */
static void project(const Search *s, const SmoothSurface *smooth, const double *x, int index,
                    GapSides *sides, Arena *scratch, Gaps *gaps) {
    const GapPoint *point = &s->points[index];
    int cloth = cloth_of(s->layout, point->triangle);
    const double *nodes = x + 3 * (size_t)s->layout->node_begin[cloth];
    SmoothPoint found;
    if (!smooth_project(&smooth[cloth], nodes, point->place, point->at, scratch, &found) ||
        !found.inside) {
        gaps->outside++;
        return;
    }
    /* feet have no place of their own from one frame to the next: the node tells the side */
    signed char side = (signed char)(found.gap < 0.0 ? -1 : 1);
    bool crossed = false;
    if (!point->foot) {
        crossed = sides->cloth[point->node] == cloth && sides->side[point->node] == -side;
        sides->cloth[point->node] = cloth;
        sides->side[point->node] = crossed ? -side : side;
    }
    double gap = fabs(found.gap), off = fabs(gap - point->distance);
    gaps->crossed += crossed;
    gaps->smooth = fmin(gaps->smooth, crossed ? -gap : gap);
    gaps->mean += off * off;
    gaps->most = fmax(gaps->most, off);
}

Gaps gaps_measure(const StateHeader *header, const StateLayout *layout, const StateFrame *frame,
                  double reach, Arena *scratch, GapSides *sides, Arena *kept) {
    Gaps gaps = {.triangles = INFINITY, .smooth = INFINITY};
    ArenaMark mark = arena_mark(scratch);
    double *surface = arena_push(scratch, double, 3 * layout->vertex_count);
    int most = layout->node_count * (1 + header->obstacle_count);
    Search s = {.layout = layout,
                .surface = surface,
                .reach = reach,
                .points = arena_push(scratch, GapPoint, most),
                .spacing = arena_push(scratch, double, layout->cloth_count),
                .period = arena_push(scratch, double, layout->cloth_count)};
    SmoothSurface *smooth = arena_push(scratch, SmoothSurface, layout->cloth_count);
    if (sides->count != layout->node_count) {
        sides->count = layout->node_count;
        sides->cloth = arena_push(kept, int, layout->node_count);
        sides->side = arena_push(kept, signed char, layout->node_count);
        for (int i = 0; i < layout->node_count; i++) {
            sides->cloth[i] = -1;
        }
    }
    for (int c = 0; c < layout->cloth_count; c++) {
        int begin = layout->node_begin[c], count = layout->node_begin[c + 1] - begin;
        s.spacing[c] = spacing_of(layout, c, &s.period[c]);
        smooth[c] = smooth_create(layout->material + 2 * (size_t)begin, count, s.spacing[c],
                                  s.period[c], scratch);
    }
    double start = clock_process_seconds();
    state_surface(layout, frame->x, surface);
    s.count = find_points(header, layout, frame, reach, s.points);
    search_triangles(&s, scratch);
    double middle = clock_process_seconds();
    for (int i = 0; i < s.count; i++) {
        if (isfinite(s.points[i].distance)) {
            gaps.points++;
            gaps.triangles = fmin(gaps.triangles, s.points[i].distance);
            project(&s, smooth, frame->x, i, sides, scratch, &gaps);
        } else if (!s.points[i].foot) {
            sides->cloth[s.points[i].node] = -1;
        }
    }
    int inside = gaps.points - gaps.outside;
    gaps.mean = inside > 0 ? sqrt(gaps.mean / inside) : 0.0;
    gaps.seconds[0] = middle - start, gaps.seconds[1] = clock_process_seconds() - middle;
    arena_rewind(scratch, mark);
    return gaps;
}
