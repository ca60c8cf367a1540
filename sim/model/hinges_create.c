/* hinges_create.c: edges and elements of a triangle mesh. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/memory.h"
#include "sim/model/hinges.h"

/* ---- edges ---- */

typedef struct HalfEdge {
    int low, high; /* nodes */
    int triangle, side;
} HalfEdge;

static int compare(const void *a, const void *b) {
    const HalfEdge *x = a, *y = b;
    if (x->low != y->low) {
        return x->low - y->low;
    }
    return x->high != y->high ? x->high - y->high : x->triangle - y->triangle;
}

void hinges_difference(const Panel *p, int a, int b, double d[2]) {
    d[0] = p->vertex_material[2 * b] - p->vertex_material[2 * a];
    d[1] = p->vertex_material[2 * b + 1] - p->vertex_material[2 * a + 1];
    if (p->wrap) {
        double width = p->h1 * p->nu;
        d[0] -= width * round(d[0] / width);
    }
}

static double triangle_area(const Panel *p, const int *n) {
    double u[2], v[2];
    hinges_difference(p, n[0], n[1], u);
    hinges_difference(p, n[0], n[2], v);
    return 0.5 * (u[0] * v[1] - u[1] * v[0]);
}

/* the ghost behind a clamped border edge at one of its ends; -1: it is free */
static int ghost_behind(const Cloth *cloth, int node, const double normal[2]) {
    for (int g = 0; g < cloth->ghost_count; g++) {
        const Ghost *ghost = &cloth->ghosts[g];
        double along = ghost->out[0] * normal[0] + ghost->out[1] * normal[1];
        if (ghost->border == node && (ghost->side < 0 || along > 0.99)) {
            return cloth->node_count + g;
        }
    }
    return -1;
}

/* The turn of an edge at rest. On a lattice the cylinder bends at the edges across it only, both
 * triangles of a cell stay in one plane; on other meshes all edges share the curvature. */
static double rest_turn(const Panel *p, const HingeEdge *e, double area) {
    const double *m = e->side[0].normal, *k = p->rest_curvature;
    double along[2] = {m[0] * m[0], m[1] * m[1]};
    if (p->nu == 0) {
        return (k[0] * along[0] + k[1] * along[1]) * area / e->side[0].length;
    }
    int axis = along[0] > 1.0 - 1e-9 ? 0 : along[1] > 1.0 - 1e-9 ? 1 : -1;
    if (axis < 0) {
        return 0.0;
    }
    double h = axis == 0 ? p->h1 : p->h2;
    /* a sleeve states the second difference of its polygon, 2 sin(turn/2)/h */
    return p->wrap && axis == 0 ? 2.0 * asin(0.5 * h * k[0]) : h * k[axis];
}

/* length and normal of an edge on the plane of one of its triangles; way 1: along the triangle */
static void see_edge(const Panel *p, const int *n, int side, double way, HingeEdge *e, int at) {
    double along[2];
    hinges_difference(p, n[side], n[(side + 1) % 3], along);
    double length = hypot(along[0], along[1]);
    e->side[at].length = length;
    e->side[at].normal[0] = way * along[1] / length;
    e->side[at].normal[1] = -way * along[0] / length;
}

static HingeEdge make_edge(const Cloth *cloth, const int *triangles, const HalfEdge *half,
                           bool shared) {
    const Panel *p = &cloth->panel;
    const int *n = triangles + 3 * half->triangle;
    HingeEdge e = {.triangle = {half->triangle, -1}, .director = -1};
    for (int k = 0; k < 3; k++) {
        e.node[k] = panel_node(p, n[(half->side + k) % 3]);
    }
    e.node[3] = e.node[4] = -1;
    see_edge(p, n, half->side, 1.0, &e, 0);
    double area = triangle_area(p, n);
    if (shared) {
        const int *other = triangles + 3 * half[1].triangle;
        e.triangle[1] = half[1].triangle;
        e.node[3] = panel_node(p, other[(half[1].side + 2) % 3]);
        see_edge(p, other, half[1].side, -1.0, &e, 1);
        area += triangle_area(p, other);
    } else {
        e.node[3] = ghost_behind(cloth, e.node[0], e.side[0].normal);
        e.node[4] = ghost_behind(cloth, e.node[1], e.side[0].normal);
        e.wall = e.node[3] >= 0 && e.node[4] >= 0;
    }
    e.rest = shared || e.wall ? rest_turn(p, &e, area) : 0.0;
    e.rest *= e.wall ? 0.5 : 1.0; /* over half a length */
    return e;
}

static void create_edges(const Cloth *cloth, const int *triangles, int count, Hinges *h,
                         Arena *arena) {
    HalfEdge *halves = memory_new(3 * (size_t)count * sizeof *halves);
    for (int k = 0; k < 3 * count; k++) {
        int a = panel_node(&cloth->panel, triangles[k]);
        int b = panel_node(&cloth->panel, triangles[k / 3 * 3 + (k + 1) % 3]);
        halves[k] = (HalfEdge){a < b ? a : b, a < b ? b : a, k / 3, k % 3};
    }
    qsort(halves, 3 * (size_t)count, sizeof *halves, compare);
    h->edges = arena_push(arena, HingeEdge, 3 * count);
    for (int k = 0; k < 3 * count; k++) {
        bool shared = k + 1 < 3 * count && halves[k].low == halves[k + 1].low &&
                      halves[k].high == halves[k + 1].high;
        h->edges[h->edge_count++] = make_edge(cloth, triangles, &halves[k], shared);
        k += shared;
    }
    free(halves);
}

/* ---- elements ---- */

/* (m1 m1, m2 m2, 2 m1 m2): curvature across an edge, and the moment across it */
static void across(const HingeEdge *e, int side, double p[3]) {
    const double *m = e->side[side].normal;
    p[0] = m[0] * m[0], p[1] = m[1] * m[1], p[2] = 2.0 * m[0] * m[1];
}

static double quadratic(const double d[6], const double p[3], const double q[3]) {
    return p[0] * (d[0] * q[0] + d[1] * q[1] + d[2] * q[2]) +
           p[1] * (d[1] * q[0] + d[3] * q[1] + d[4] * q[2]) +
           p[2] * (d[2] * q[0] + d[4] * q[1] + d[5] * q[2]);
}

/* takes the curvature across a free edge out of D: D - D p (p'D p)^-1 p'D */
static void condense(double d[6], const double p[3]) {
    const double *row[3] = {(double[3]){1, 0, 0}, (double[3]){0, 1, 0}, (double[3]){0, 0, 1}};
    double dp[3], pdp = quadratic(d, p, p);
    for (int r = 0; r < 3; r++) {
        dp[r] = quadratic(d, row[r], p);
    }
    double size = d[0] + d[3] + d[5]; /* after two free edges nothing is left but rounding */
    for (int r = 0, k = 0; r < 3 && pdp > 1e-12 * size; r++) {
        for (int c = r; c < 3; c++, k++) {
            d[k] -= dp[r] * dp[c] / pdp;
        }
    }
}

static int local_node(HingeElement *el, int node) {
    for (int k = 0; k < el->node_count; k++) {
        if (el->node[k] == node) {
            return k;
        }
    }
    ASSERT(el->node_count < HINGE_NODES);
    el->node[el->node_count] = node;
    return el->node_count++;
}

static void add_edge(const Cloth *cloth, const Hinges *h, HingeElement *el, int edge) {
    int at = el->edge_count++;
    el->edge[at] = edge;
    for (int k = 0; k < 4; k++) {
        int node = h->edges[edge].node[k];
        el->local[at][k] =
            node < cloth->node_count ? (signed char)local_node(el, node) : (signed char)-1;
    }
}

static bool turns(const HingeEdge *e) { return e->triangle[1] >= 0 || e->wall; }

static void create_hinges(const Cloth *cloth, const double *area, Hinges *h) {
    const Material *m = &cloth->material;
    double d[6] = {m->d11, m->d12, 0.0, m->d22, 0.0, m->d66};
    for (int k = 0; k < h->edge_count; k++) {
        const HingeEdge *e = &h->edges[k];
        if (!turns(e)) {
            continue;
        }
        double p[3], both = area[e->triangle[0]] + (e->wall ? 0.0 : area[e->triangle[1]]);
        HingeElement *el = &h->elements[h->element_count++];
        for (int side = 0; side < (e->wall ? 1 : 2); side++) {
            double length = e->side[side].length;
            across(e, side, p);
            el->d[0] += (e->wall ? 1.0 : 0.5) * quadratic(d, p, p) * length * length / both;
        }
        el->c[0][0] = el->tangent[0] = 1.0;
        add_edge(cloth, h, el, k);
    }
}

/* `side` 0, 1: the element of its left, right triangle */
static void add_to_triangle(const Cloth *cloth, const double *area, const Hinges *h, int edge,
                            int side, bool morley) {
    const HingeEdge *e = &h->edges[edge];
    int triangle = e->triangle[side], other = e->triangle[1 - side];
    HingeElement *el = &h->elements[triangle];
    double p[3], mine = area[triangle];
    across(e, side, p);
    if (!turns(e)) {
        condense(el->d, p);
        return;
    }
    double tensor = e->wall ? 1.0 : mine / (mine + area[other]);
    double share = morley && !e->wall ? 0.5 : tensor;
    el->side[el->edge_count] = e->wall || !morley ? 0.0 : side == 0 ? 1.0 : -1.0;
    el->tangent[el->edge_count] = tensor / share;
    for (int k = 0; k < 3; k++) {
        el->c[el->edge_count][k] = e->side[side].length * share / mine * p[k];
    }
    add_edge(cloth, h, el, edge);
}

static void create_tensors(const Cloth *cloth, const double *area, int count, bool morley,
                           Hinges *h) {
    const Material *m = &cloth->material;
    for (int t = 0; t < count; t++) {
        double d[6] = {m->d11, m->d12, 0.0, m->d22, 0.0, m->d66};
        for (int k = 0; k < 6; k++) {
            h->elements[t].d[k] = area[t] * d[k];
        }
    }
    h->element_count = count;
    for (int k = 0; k < h->edge_count; k++) {
        for (int side = 0; side < 2; side++) {
            if (h->edges[k].triangle[side] >= 0) {
                add_to_triangle(cloth, area, h, k, side, morley);
            }
        }
    }
}

/* edges that turn come first; the others were needed for `condense` only */
static void drop_free_edges(Hinges *h, Arena *arena) {
    int *kept = arena_push(arena, int, h->edge_count), count = 0;
    for (int k = 0; k < h->edge_count; k++) {
        kept[k] = count;
        if (turns(&h->edges[k])) {
            h->edges[count++] = h->edges[k];
        }
    }
    h->edge_count = count;
    for (int i = 0; i < h->element_count; i++) {
        for (int e = 0; e < h->elements[i].edge_count; e++) {
            h->elements[i].edge[e] = kept[h->elements[i].edge[e]];
        }
    }
}

/* second derivative of the energy by all psi, which is constant: d (A/2 k'Dk) = side c D c side */
static bool create_directors(Hinges *h, Arena *arena) {
    for (int k = 0; k < h->edge_count; k++) {
        if (!h->edges[k].wall) {
            h->edges[k].director = h->director_count++;
        }
    }
    TriangularEntry *entries = arena_push(arena, TriangularEntry, 6 * h->element_count);
    int count = 0;
    for (int i = 0; i < h->element_count; i++) {
        const HingeElement *el = &h->elements[i];
        for (int e = 0; e < el->edge_count; e++) {
            for (int f = 0; f <= e; f++) {
                double value = el->side[e] * el->side[f] * quadratic(el->d, el->c[e], el->c[f]);
                int a = h->edges[el->edge[e]].director, b = h->edges[el->edge[f]].director;
                if (a >= 0 && b >= 0) {
                    entries[count++] = (TriangularEntry){a > b ? a : b, a > b ? b : a, value};
                }
            }
        }
    }
    h->director = arena_push(arena, double, h->director_count);
    return triangular_create(h->director_count, entries, count, arena, &h->elimination);
}

bool hinges_create(const Cloth *cloth, const int *triangles, int triangle_count, BendingKind kind,
                   Arena *arena, Hinges *hinges) {
    Hinges h = {0};
    bool each = kind == BENDING_HINGE, morley = kind == BENDING_MORLEY;
    create_edges(cloth, triangles, triangle_count, &h, arena);
    h.elements = arena_push(arena, HingeElement, each ? h.edge_count : triangle_count);
    h.turns = arena_push(arena, HingeTurn, h.edge_count);
    h.moment = arena_push(arena, double, h.edge_count);
    double *area = arena_push(arena, double, triangle_count);
    for (int t = 0; t < triangle_count; t++) {
        area[t] = triangle_area(&cloth->panel, triangles + 3 * t);
    }
    if (each) {
        create_hinges(cloth, area, &h);
    } else {
        create_tensors(cloth, area, triangle_count, morley, &h);
    }
    drop_free_edges(&h, arena);
    bool solvable = !morley || create_directors(&h, arena);
    *hinges = h;
    return solvable;
}
