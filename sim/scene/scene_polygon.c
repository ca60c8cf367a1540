#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define MOST_POINTS 20000 /* of one polygon, holes included */
#define MOST_HOLES 1000
#define SAME_POINT 1e-9 /* [m] */

/* Points while they are read: flat arrays over all loops. */
typedef struct Outline {
    int point_count, loop_count;
    double *points;      /* [m] (point_count x 2) */
    const Yaml **values; /* (point_count) where each was written */
    int *next;           /* (point_count) successor on its loop */
    int *loop_begin;     /* (loop_count + 1) */
} Outline;

static const double *point(const Outline *outline, int i) { return outline->points + 2 * i; }

static bool same(const double *p, const double *q) {
    return fabs(p[0] - q[0]) < SAME_POINT && fabs(p[1] - q[1]) < SAME_POINT;
}

/* twice the area of the triangle p q r, positive when anticlockwise */
static double cross(const double *p, const double *q, const double *r) {
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}

static bool read_loop(Reader *reader, const Yaml *list, Outline *outline) {
    int begin = outline->point_count;
    if (list->kind != YAML_LIST || list->count < 3) {
        return schema_error(reader, list,
                            "an outline wants a list of at least 3 points [u, v], "
                            "found %s",
                            list->kind == YAML_LIST ? "fewer"
                                                    : yaml_describe(list, reader->report));
    }
    if (begin + list->count > MOST_POINTS) {
        return schema_error(reader, list, "an outline of more than %d points", MOST_POINTS);
    }
    for (const Yaml *value = list->first; value; value = value->next) {
        double *p = outline->points + 2 * outline->point_count;
        if (!schema_read_vector(reader, "outline", "m", SCENE_FARTHEST, value, p, 2)) {
            return false;
        }
        outline->values[outline->point_count++] = value;
    }
    if (same(point(outline, begin), point(outline, outline->point_count - 1))) {
        outline->point_count--; /* written as a closed line */
    }
    if (outline->point_count - begin < 3) {
        return schema_error(reader, list, "an outline needs at least 3 different points");
    }
    for (int i = begin; i < outline->point_count; i++) {
        outline->next[i] = i + 1 < outline->point_count ? i + 1 : begin;
    }
    outline->loop_begin[++outline->loop_count] = outline->point_count;
    return true;
}

static double twice_area(const Outline *outline, int loop) {
    int begin = outline->loop_begin[loop], end = outline->loop_begin[loop + 1];
    double sum = 0.0;
    for (int i = begin + 1; i + 1 < end; i++) {
        sum += cross(point(outline, begin), point(outline, i), point(outline, i + 1));
    }
    return sum;
}

/* outer outline anticlockwise, holes clockwise */
static void orient(Outline *outline) {
    for (int loop = 0; loop < outline->loop_count; loop++) {
        if ((twice_area(outline, loop) > 0.0) == (loop == 0)) {
            continue;
        }
        int first = outline->loop_begin[loop] + 1, last = outline->loop_begin[loop + 1] - 1;
        for (; first < last; first++, last--) {
            double p[2];
            memcpy(p, point(outline, first), sizeof p);
            memcpy(outline->points + 2 * first, point(outline, last), sizeof p);
            memcpy(outline->points + 2 * last, p, sizeof p);
        }
    }
}

/* Do two edges that share no point touch? */
static bool edges_touch(const double *a, const double *b, const double *c, const double *d) {
    for (int k = 0; k < 2; k++) {
        if (fmax(a[k], b[k]) < fmin(c[k], d[k]) || fmax(c[k], d[k]) < fmin(a[k], b[k])) {
            return false;
        }
    }
    double c_side = cross(a, b, c), d_side = cross(a, b, d);
    double a_side = cross(c, d, a), b_side = cross(c, d, b);
    return c_side * d_side <= 0.0 && a_side * b_side <= 0.0;
}

typedef struct Edge {
    double low, high; /* [m] range of u */
    int start;
} Edge;

static int compare_edges(const void *a, const void *b) {
    const Edge *p = a, *q = b;
    if (p->low != q->low) {
        return p->low < q->low ? -1 : 1;
    }
    return (p->start > q->start) - (p->start < q->start);
}

static bool complain_pair(Reader *reader, const Outline *outline, int a, int b) {
    int first = a < b ? a : b, second = a < b ? b : a;
    const double *p = point(outline, first), *q = point(outline, second);
    return schema_error(reader, outline->values[second],
                        "the outline crosses itself: the edge from [%g, %g] (line %d) meets the "
                        "edge from [%g, %g]",
                        p[0], p[1], outline->values[first]->place.line, q[0], q[1]);
}

/* edges sorted by their lower u: each is compared with those that start before it ends */
static bool check_crossings(Reader *reader, const Outline *outline) {
    int count = outline->point_count;
    Edge *edges = arena_push(reader->arena, Edge, count);
    for (int i = 0; i < count; i++) {
        double p = point(outline, i)[0], q = point(outline, outline->next[i])[0];
        edges[i] = (Edge){fmin(p, q), fmax(p, q), i};
    }
    qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    for (int i = 0; i < count; i++) {
        for (int j = i + 1; j < count && edges[j].low <= edges[i].high; j++) {
            int a = edges[i].start, b = edges[j].start;
            int a_end = outline->next[a], b_end = outline->next[b];
            if (a_end != b && b_end != a &&
                edges_touch(point(outline, a), point(outline, a_end), point(outline, b),
                            point(outline, b_end))) {
                return complain_pair(reader, outline, a, b);
            }
        }
    }
    return true;
}

/* repeated points, and edges that run back over the edge before */
static bool check_corners(Reader *reader, const Outline *outline) {
    for (int i = 0; i < outline->point_count; i++) {
        int j = outline->next[i], k = outline->next[j];
        const double *p = point(outline, i), *q = point(outline, j), *r = point(outline, k);
        if (same(p, q)) {
            return schema_error(reader, outline->values[j], "the same point twice in a row");
        }
        double forward = (q[0] - p[0]) * (r[0] - q[0]) + (q[1] - p[1]) * (r[1] - q[1]);
        if (cross(p, q, r) == 0.0 && forward < 0.0) {
            return schema_error(reader, outline->values[j], "the outline turns back on itself");
        }
    }
    return true;
}

static bool loop_contains(const double *points, int begin, int end, const double *p) {
    bool inside = false;
    for (int i = begin, j = end - 1; i < end; j = i++) {
        const double *a = points + 2 * i, *b = points + 2 * j;
        if ((a[1] > p[1]) != (b[1] > p[1]) &&
            p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]) {
            inside = !inside;
        }
    }
    return inside;
}

/* holes inside the outer outline, and not within each other */
static bool check_holes(Reader *reader, const Outline *outline) {
    for (int hole = 1; hole < outline->loop_count; hole++) {
        int first = outline->loop_begin[hole];
        const double *p = point(outline, first);
        if (!loop_contains(outline->points, 0, outline->loop_begin[1], p)) {
            return schema_error(reader, outline->values[first], "this hole is not in the outline");
        }
        for (int other = 1; other < outline->loop_count; other++) {
            if (other != hole && loop_contains(outline->points, outline->loop_begin[other],
                                               outline->loop_begin[other + 1], p)) {
                return schema_error(reader, outline->values[first], "a hole within a hole");
            }
        }
    }
    return true;
}

static bool check_areas(Reader *reader, const Outline *outline) {
    for (int loop = 0; loop < outline->loop_count; loop++) {
        if (fabs(twice_area(outline, loop)) < 1e-8) {
            return schema_error(reader, outline->values[outline->loop_begin[loop]],
                                "the outline has no area");
        }
    }
    return true;
}

static int count_points(const Yaml *list) { return list->kind == YAML_LIST ? list->count : 0; }

static bool read_loops(Reader *reader, const Yaml *first, const Yaml *holes, Outline *outline) {
    bool ok = read_loop(reader, first, outline);
    if (holes && (holes->kind != YAML_LIST || holes->count > MOST_HOLES)) {
        return schema_error(reader, holes, "'holes' wants a list of at most %d outlines, found %s",
                            MOST_HOLES, yaml_describe(holes, reader->report));
    }
    for (const Yaml *hole = holes ? holes->first : NULL; hole && ok; hole = hole->next) {
        ok = read_loop(reader, hole, outline);
    }
    return ok;
}

bool polygon_read(Reader *reader, const Yaml *outline_value, const Yaml *holes, ShapeDef *shape) {
    int most = count_points(outline_value), loops = 1 + (holes ? count_points(holes) : 0);
    for (const Yaml *hole = holes ? holes->first : NULL; hole; hole = hole->next) {
        most += count_points(hole);
    }
    Outline outline = {.points = arena_push(reader->arena, double, 2 * most),
                       .values = arena_push(reader->arena, const Yaml *, most),
                       .next = arena_push(reader->arena, int, most),
                       .loop_begin = arena_push(reader->arena, int, loops + 1)};
    if (!read_loops(reader, outline_value, holes, &outline) || !check_corners(reader, &outline) ||
        !check_crossings(reader, &outline) || !check_areas(reader, &outline) ||
        !check_holes(reader, &outline)) {
        return false;
    }
    orient(&outline);
    shape->loop_count = outline.loop_count;
    shape->loop_begin = outline.loop_begin;
    shape->outline = outline.points;
    return true;
}

static double segment_distance(const double *a, const double *b, const double *p) {
    double ab[2] = {b[0] - a[0], b[1] - a[1]}, ap[2] = {p[0] - a[0], p[1] - a[1]};
    double square = ab[0] * ab[0] + ab[1] * ab[1];
    double t = square > 0.0 ? (ab[0] * ap[0] + ab[1] * ap[1]) / square : 0.0;
    t = fmax(0.0, fmin(1.0, t));
    return hypot(ap[0] - t * ab[0], ap[1] - t * ab[1]);
}

static double polygon_distance(const ShapeDef *shape, const double *p) {
    double nearest = INFINITY;
    bool inside = true;
    for (int loop = 0; loop < shape->loop_count; loop++) {
        int begin = shape->loop_begin[loop], end = shape->loop_begin[loop + 1];
        for (int i = begin, j = end - 1; i < end; j = i++) {
            double d = segment_distance(shape->outline + 2 * j, shape->outline + 2 * i, p);
            nearest = fmin(nearest, d);
        }
        inside = inside && loop_contains(shape->outline, begin, end, p) == (loop == 0);
    }
    return inside ? 0.0 : nearest;
}

double shape_distance(const ShapeDef *shape, const double p[2]) {
    double r = hypot(p[0], p[1]), extents[2];
    switch (shape->kind) {
    case SHAPE_RECTANGLE:
    case SHAPE_SLEEVE:
        shape_extents(shape, extents);
        return hypot(fmax(0.0, fmax(-p[0], p[0] - extents[0])),
                     fmax(0.0, fmax(-p[1], p[1] - extents[1])));
    case SHAPE_DISC:
        return fmax(0.0, r - shape->radius);
    case SHAPE_ANNULUS:
        return fmax(0.0, fmax(r - shape->radius, shape->inner_radius - r));
    case SHAPE_POLYGON:
        return polygon_distance(shape, p);
    case SHAPE_GARMENT: /* no place on these is given by (u, v) */
    case SHAPE_MESH:
        return 0.0;
    }
    return INFINITY;
}
