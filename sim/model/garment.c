#include "sim/model/garment.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/memory.h"

#define RING_STEPS 400  /* depths at which the ring is known */
#define OVAL_STEPS 1440 /* pieces of its cross-section; a multiple of 4 */

#define PARALLEL 1e-6 /* widening / depth of sides that never meet */
#define FLATTEST 0.05 /* least fall of the ring / depth: wider hems would lie flat, or fold */

/* ---- seams ---- */

/* the side of the outline between two neighbouring corners; *forward: it runs from a to b */
static int side_between(const ShapeDef *shape, int panel, int a, int b, bool *forward) {
    int loop = shape->garment->panels[panel].loop_begin;
    int begin = shape->loop_begin[loop], count = shape->loop_begin[loop + 1] - begin;
    *forward = begin + (a - begin + 1) % count == b;
    return *forward ? a : b;
}

static double side_length(const ShapeDef *shape, int a, int b) {
    const double *p = shape->outline + 2 * a, *q = shape->outline + 2 * b;
    return hypot(q[0] - p[0], q[1] - p[1]);
}

void garment_divide_seams(const ShapeDef *shape, double spacing, int *count) {
    for (int s = 0; s < shape->garment->seam_count; s++) {
        const GarmentSeam *seam = &shape->garment->seams[s];
        for (int k = 0; k + 1 < seam->corner_count; k++) {
            double mean = 0.0;
            int side[2];
            for (int r = 0; r < 2; r++) {
                bool forward;
                int a = seam->corner[r][k], b = seam->corner[r][k + 1];
                side[r] = side_between(shape, seam->panel[r], a, b, &forward);
                mean += 0.5 * side_length(shape, a, b);
            }
            count[side[0]] = count[side[1]] = (int)fmax(1.0, round(mean / spacing));
        }
    }
}

static int find_root(int *parent, int vertex) {
    while (parent[vertex] != vertex) {
        vertex = parent[vertex] = parent[parent[vertex]];
    }
    return vertex;
}

/* the vertices of one side of a seam from corner a to corner b, both ends too; returns how many */
static int list_side(const ShapeDef *shape, const Panel *p, int panel, int a, int b, int *list) {
    bool forward;
    side_between(shape, panel, a, b, &forward);
    int from = p->corner[forward ? a : b], to = p->corner[forward ? b : a];
    int loop = shape->garment->panels[panel].loop_begin;
    int end = to > from ? to : p->outline_begin[loop + 1]; /* the last side of a loop ends at its
                                                              first vertex */
    int count = end - from + 1;
    for (int i = 0; i < count; i++) {
        list[forward ? i : count - 1 - i] = from + i == end ? to : from + i;
    }
    return count;
}

/* vertex_node: vertices that are sewn, directly or through others, are one node */
static void join_seams(const ShapeDef *shape, Panel *p, Arena *arena) {
    int *parent = arena_push(arena, int, p->vertex_count);
    int *node = arena_push(arena, int, p->vertex_count);
    int *rows[2] = {memory_new((size_t)p->vertex_count * sizeof(int)),
                    memory_new((size_t)p->vertex_count * sizeof(int))};
    for (int i = 0; i < p->vertex_count; i++) {
        parent[i] = i;
    }
    for (int s = 0; s < shape->garment->seam_count; s++) {
        const GarmentSeam *seam = &shape->garment->seams[s];
        for (int k = 0; k + 1 < seam->corner_count; k++) {
            int count[2];
            for (int r = 0; r < 2; r++) {
                count[r] = list_side(shape, p, seam->panel[r], seam->corner[r][k],
                                     seam->corner[r][k + 1], rows[r]);
            }
            ASSERT(count[0] == count[1]);
            for (int i = 0; i < count[0]; i++) {
                int a = find_root(parent, rows[0][i]), b = find_root(parent, rows[1][i]);
                parent[a > b ? a : b] = a > b ? b : a;
            }
        }
    }
    free(rows[0]);
    free(rows[1]);
    p->node_count = 0;
    for (int i = 0; i < p->vertex_count; i++) { /* a root comes before the rest of its vertices */
        int root = find_root(parent, i);
        node[i] = root == i ? p->node_count++ : node[root];
    }
    p->vertex_node = node;
}

/* ---- the ring ---- */

typedef struct Ring {
    const ShapeDef *shape;
    const int **left, **right;     /* (panel_count) rows of corners */
    int *left_count, *right_count; /* (panel_count) */
    double *top;                   /* [m] (panel_count) largest v of a panel */
    double deepest;                /* [m] below the top of its panel */
    double around[RING_STEPS + 1]; /* [m] all widths together, by depth */
    double share[OVAL_STEPS + 1];  /* of the length of the cross-section, by angle */
    double perimeter;              /* of the cross-section / half its width */
} Ring;

static double mean_u(const ShapeDef *shape, const int *row, int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += shape->outline[2 * row[i]] / count;
    }
    return sum;
}

/* the seam from the right of panel p to the left of the next; false: there is none */
static bool find_next(Ring *ring, int p, int next) {
    const GarmentDef *garment = ring->shape->garment;
    double most = -INFINITY;
    for (int s = 0; s < garment->seam_count; s++) {
        const GarmentSeam *seam = &garment->seams[s];
        for (int r = 0; r < 2; r++) {
            double u = mean_u(ring->shape, seam->corner[r], seam->corner_count);
            if (seam->panel[r] == p && seam->panel[1 - r] == next && u > most) {
                most = u;
                ring->right[p] = seam->corner[r];
                ring->left[next] = seam->corner[1 - r];
                ring->right_count[p] = ring->left_count[next] = seam->corner_count;
            }
        }
    }
    return most > -INFINITY;
}

/* u of a seam at some v; above and below it its end pieces go on */
static double row_at(const Ring *ring, const int *row, int count, double v) {
    const double *x = ring->shape->outline;
    int nearest = 0;
    double least = INFINITY;
    for (int k = 0; k + 1 < count; k++) {
        double a = x[2 * row[k] + 1], b = x[2 * row[k + 1] + 1];
        double way = fmax(0.0, fmax(fmin(a, b) - v, v - fmax(a, b)));
        if (a != b && way < least) {
            least = way;
            nearest = k;
        }
    }
    const double *a = x + 2 * row[nearest], *b = x + 2 * row[nearest + 1];
    return a[1] == b[1] ? a[0] : a[0] + (v - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
}

static double left_at(const Ring *ring, int p, double depth) {
    return row_at(ring, ring->left[p], ring->left_count[p], ring->top[p] - depth);
}

/* A panel at some depth, as a part of a disc around the place where its sides would meet. */
typedef struct Sector {
    double middle; /* [m] u */
    double width;  /* [m] */
    double spread; /* [1/m] 1 / distance of that place above; negative: below; 0: parallel sides */
    double arc;    /* [m] length of the arc from side to side */
} Sector;

static double width_at(const Ring *ring, int p, double depth) {
    return row_at(ring, ring->right[p], ring->right_count[p], ring->top[p] - depth) -
           left_at(ring, p, depth);
}

static Sector sector_at(const Ring *ring, int p, double depth) {
    double step = ring->deepest / RING_STEPS;
    Sector s = {.width = width_at(ring, p, depth)};
    double wider =
        (width_at(ring, p, depth + step) - width_at(ring, p, depth - step)) / (2.0 * step);
    s.middle = left_at(ring, p, depth) + 0.5 * s.width;
    s.spread = fabs(wider) > PARALLEL ? wider / s.width : 0.0;
    s.arc = s.spread != 0.0 ? 2.0 * atan(0.5 * s.spread * s.width) / s.spread : s.width;
    return s;
}

static void measure_section(Ring *ring, double oval) {
    for (int k = 0; k < OVAL_STEPS; k++) {
        double a = 2.0 * PI * k / OVAL_STEPS, b = 2.0 * PI * (k + 1) / OVAL_STEPS;
        ring->share[k + 1] = ring->share[k] + hypot(cos(b) - cos(a), oval * (sin(b) - sin(a)));
    }
    ring->perimeter = ring->share[OVAL_STEPS];
    for (int k = 0; k <= OVAL_STEPS; k++) {
        ring->share[k] /= ring->perimeter;
    }
}

static void measure_depths(Ring *ring) {
    const ShapeDef *shape = ring->shape;
    for (int p = 0; p < shape->garment->panel_count; p++) {
        int loop = shape->garment->panels[p].loop_begin;
        double low = INFINITY;
        ring->top[p] = -INFINITY;
        for (int i = shape->loop_begin[loop]; i < shape->loop_begin[loop + 1]; i++) {
            ring->top[p] = fmax(ring->top[p], shape->outline[2 * i + 1]);
            low = fmin(low, shape->outline[2 * i + 1]);
        }
        ring->deepest = fmax(ring->deepest, ring->top[p] - low);
    }
}

/* circumference by depth */
static bool measure_ring(Ring *ring, const ClothDef *def, Error *error) {
    const GarmentDef *garment = def->shape.garment;
    double step = ring->deepest / RING_STEPS;
    for (int k = 0; k <= RING_STEPS; k++) {
        for (int p = 0; p < garment->panel_count; p++) {
            Sector sector = sector_at(ring, p, k * step);
            if (!(sector.width > 0.0)) {
                return error_set(error, EXIT_BAD_INPUT,
                                 "cloth '%s': the seams of panel '%s' with its neighbours leave no "
                                 "width %.3g m below its top; panels stand from left to right",
                                 def->name, garment->panels[p].name, k * step);
            }
            ring->around[k] += sector.arc;
        }
    }
    return true;
}

static bool make_ring(Ring *ring, const ClothDef *def, Arena *scratch, Error *error) {
    const GarmentDef *garment = def->shape.garment;
    int count = garment->panel_count;
    ring->shape = &def->shape;
    ring->left = arena_push(scratch, const int *, count);
    ring->right = arena_push(scratch, const int *, count);
    ring->left_count = arena_push(scratch, int, count);
    ring->right_count = arena_push(scratch, int, count);
    ring->top = arena_push(scratch, double, count);
    for (int p = 0; p < count; p++) {
        int next = (p + 1) % count;
        if (!find_next(ring, p, next)) {
            return error_set(error, EXIT_BAD_INPUT,
                             "cloth '%s': panel '%s' is not sewn to '%s': panels stand in a ring, "
                             "in the order in which they are listed",
                             def->name, garment->panels[p].name, garment->panels[next].name);
        }
    }
    measure_section(ring, garment->oval);
    measure_depths(ring);
    return measure_ring(ring, def, error);
}

/* the direction of a share of the cross-section from the axis, times radius / circumference */
static void ring_direction(const Ring *ring, double share, double q[2]) {
    int low = 0, high = OVAL_STEPS;
    share -= floor(share);
    while (high - low > 1) {
        int middle = (low + high) / 2;
        *(ring->share[middle] <= share ? &low : &high) = middle;
    }
    double piece = (share - ring->share[low]) / (ring->share[high] - ring->share[low]);
    double angle = 2.0 * PI * (low + piece) / OVAL_STEPS;
    q[0] = cos(angle) / ring->perimeter;
    q[1] = ring->shape->garment->oval * sin(angle) / ring->perimeter;
}

/* The place at a share of the circumference and a depth. Sections at all depths are alike, and each
 * meridian falls so that it keeps its length. */
static Vec3 ring_place(const Ring *ring, double share, double depth) {
    double step = ring->deepest / RING_STEPS, q[2], z = 0.0;
    double at = fmin(fmax(depth / step, 0.0), RING_STEPS);
    int last = (int)fmin(at, RING_STEPS - 1.0);
    ring_direction(ring, share, q);
    for (int k = 0; k <= last; k++) {
        double wider = hypot(q[0], q[1]) * (ring->around[k + 1] - ring->around[k]) / step;
        double part = k < last ? 1.0 : at - last;
        z -= part * step * fmax(FLATTEST, sqrt(fmax(0.0, 1.0 - wider * wider)));
    }
    double t = at - last, around = (1.0 - t) * ring->around[last] + t * ring->around[last + 1];
    return vec3(around * q[0], around * q[1], z);
}

/* A vertex of panel p; the middle of the first panel is at three quarters, on the side of -y. Lines of
 * equal depth on the ring are arcs around the place where the sides of the panel would meet. */
static Vec3 vertex_place(const Ring *ring, int p, const double uv[2]) {
    double depth = ring->top[p] - uv[1], around = 0.0, before = 0.0;
    for (int q = 0; q < ring->shape->garment->panel_count; q++) {
        Sector sector = sector_at(ring, q, depth);
        around += sector.arc;
        before += q < p ? sector.arc : q > p ? 0.0 : 0.5 * sector.arc;
        before -= q == 0 ? 0.5 * sector.arc : 0.0;
    }
    Sector own = sector_at(ring, p, depth);
    double off = uv[0] - own.middle, slope = own.spread * off;
    double fall = slope * off / (1.0 + sqrt(1.0 + slope * slope));
    double arc = own.spread != 0.0 ? atan(slope) / own.spread : off;
    return ring_place(ring, 0.75 + (before + arc) / around, depth + fall);
}

int garment_panel_at(const ShapeDef *shape, double u) {
    int p = shape->garment->panel_count - 1;
    for (; p > 0; p--) {
        int loop = shape->garment->panels[p].loop_begin;
        double low = INFINITY;
        for (int i = shape->loop_begin[loop]; i < shape->loop_begin[loop + 1]; i++) {
            low = fmin(low, shape->outline[2 * i]);
        }
        if (u >= low - 1e-9) {
            break;
        }
    }
    return p;
}

/* nodes start in the middle of their vertices, which must be near each other */
static bool place_nodes(const Ring *ring, const ClothDef *def, Panel *p, Arena *arena,
                        Error *error) {
    Vec3 *place = arena_push(arena, Vec3, p->vertex_count);
    int *count = arena_push(arena, int, p->node_count);
    p->start = arena_push(arena, double, 3 * p->node_count);
    for (int i = 0; i < p->vertex_count; i++) {
        const double *uv = p->vertex_material + 2 * i;
        double *x = p->start + 3 * p->vertex_node[i];
        place[i] = vertex_place(ring, garment_panel_at(ring->shape, uv[0]), uv);
        vec3_store(x, vec3_add(vec3_load(x), place[i]));
        count[p->vertex_node[i]]++;
    }
    double highest = -INFINITY;
    for (int i = 0; i < p->vertex_count; i++) {
        highest = fmax(highest, place[i].z);
    }
    for (int i = 0; i < p->node_count; i++) {
        Vec3 mean = vec3_scale(1.0 / count[i], vec3_load(p->start + 3 * i));
        vec3_store(p->start + 3 * i, vec3(mean.x, mean.y, mean.z - highest));
    }
    for (int i = 0; i < p->vertex_count; i++) {
        Vec3 node = vec3_load(p->start + 3 * p->vertex_node[i]);
        double way = vec3_length(vec3_sub(place[i], vec3(node.x, node.y, node.z + highest)));
        if (way > p->h1) {
            const ShapeDef *shape = &def->shape;
            int panel = garment_panel_at(shape, p->vertex_material[2 * i]);
            return error_set(error, EXIT_BAD_INPUT,
                             "cloth '%s': a seam of panel '%s' starts %.3g m from its other side, "
                             "more than the spacing of nodes; garments start as a ring",
                             def->name, shape->garment->panels[panel].name, way);
        }
    }
    return true;
}

/* the outline from one corner to another, anticlockwise */
static void mark_run(const Panel *p, int loop, int from, int to, unsigned char mark,
                     unsigned char *ends) {
    for (int i = p->corner[from];; i++) {
        i = i == p->outline_begin[loop + 1] ? p->outline_begin[loop] : i;
        ends[i] |= mark;
        if (i == p->corner[to]) {
            return;
        }
    }
}

/* the top of a panel runs from the upper end of its right seam to that of its left */
static void mark_ends(const Ring *ring, Panel *p, Arena *arena) {
    unsigned char *ends = arena_push(arena, unsigned char, p->vertex_count);
    const double *x = ring->shape->outline;
    for (int panel = 0; panel < ring->shape->garment->panel_count; panel++) {
        int loop = ring->shape->garment->panels[panel].loop_begin;
        const int *row[2] = {ring->left[panel], ring->right[panel]};
        int last[2] = {ring->left_count[panel] - 1, ring->right_count[panel] - 1}, up[2], low[2];
        for (int k = 0; k < 2; k++) {
            int a = row[k][0], b = row[k][last[k]];
            bool rises = x[2 * b + 1] > x[2 * a + 1];
            up[k] = rises ? b : a, low[k] = rises ? a : b;
        }
        mark_run(p, loop, up[1], up[0], GARMENT_TOP, ends);
        mark_run(p, loop, low[0], low[1], GARMENT_BOTTOM, ends);
    }
    p->ends = ends;
}

/* ---- the sewn mesh ---- */

typedef struct Edge {
    int low, high; /* nodes */
    bool forward;
} Edge;

static int compare_edges(const void *a, const void *b) {
    const Edge *x = a, *y = b;
    return x->low != y->low ? x->low - y->low : x->high - y->high;
}

/* every edge in at most two triangles, which see it in opposite directions */
static bool check_mesh(const ClothDef *def, const Panel *p, Error *error) {
    int count = 3 * p->triangle_count;
    Edge *edges = memory_new((size_t)count * sizeof *edges);
    bool ok = true;
    for (int k = 0; k < count; k++) {
        int a = p->triangles[k], b = p->triangles[k / 3 * 3 + (k + 1) % 3];
        edges[k] = (Edge){a < b ? a : b, a < b ? b : a, a < b};
        ok = ok && a != b;
    }
    qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    for (int k = 1; k < count && ok; k++) {
        bool same = compare_edges(&edges[k], &edges[k - 1]) == 0;
        bool third = k > 1 && compare_edges(&edges[k], &edges[k - 2]) == 0;
        ok = !same || (!third && edges[k].forward != edges[k - 1].forward);
    }
    free(edges);
    return ok || error_set(error, EXIT_BAD_INPUT,
                           "cloth '%s': a seam joins more than two edges, or face to back; both "
                           "rows of corners start at the same end",
                           def->name);
}

bool garment_sew(const ClothDef *def, Arena *arena, Panel *p, Error *error) {
    Ring *ring = arena_push(arena, Ring, 1);
    const double *vertex_area = p->area;
    int *triangles = arena_push(arena, int, 3 * p->triangle_count);
    p->vertex_count = p->node_count;
    p->vertex_material = p->material;
    p->vertex_triangles = p->triangles;
    join_seams(&def->shape, p, arena);
    p->triangles = triangles;
    p->material = arena_push(arena, double, 2 * p->node_count);
    p->area = arena_push(arena, double, p->node_count);
    for (int i = p->vertex_count - 1; i >= 0; i--) { /* the first vertex of a node comes last */
        int node = p->vertex_node[i];
        memcpy(p->material + 2 * node, p->vertex_material + 2 * i, 2 * sizeof(double));
        p->area[node] += vertex_area[i];
    }
    for (int k = 0; k < 3 * p->triangle_count; k++) {
        triangles[k] = p->vertex_node[p->vertex_triangles[k]];
    }
    if (!make_ring(ring, def, arena, error) || !place_nodes(ring, def, p, arena, error)) {
        return false;
    }
    mark_ends(ring, p, arena);
    return check_mesh(def, p, error);
}

int garment_select(const Panel *p, unsigned char end, unsigned char *marks) {
    int count = 0;
    for (int i = 0; i < p->vertex_count; i++) {
        int node = p->vertex_node[i];
        if (p->ends[i] & end) {
            count += !marks[node];
            marks[node] = 1;
        }
    }
    return count;
}
