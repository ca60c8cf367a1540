#include "sim/model/cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/memory.h"

static void add_edge(Cells *cells, int left, int right, const double from[2], const double to[2]) {
    double along[2] = {to[0] - from[0], to[1] - from[1]}, length = hypot(along[0], along[1]);
    if (length == 0.0) {
        return;
    }
    cells->edges[cells->edge_count++] =
        (CellEdge){.left = left,
                   .right = right,
                   .middle = {0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])},
                   .along = {along[0], along[1]},
                   .normal = {along[1] / length, -along[0] / length},
                   .length = length};
}

/* areas and moments from the edges: triangles from the node to each edge */
static void integrate(const Panel *p, Cells *cells) {
    double(*first)[2] = memory_zeroed((size_t)p->node_count, sizeof *first);
    for (int e = 0; e < cells->edge_count; e++) {
        const CellEdge *edge = &cells->edges[e];
        for (int side = 0; side < 2; side++) {
            int node = side == 0 ? edge->left : edge->right;
            if (node < 0) {
                continue;
            }
            const double *x = p->material + 2 * (size_t)node;
            double sign = side == 0 ? 1.0 : -1.0, d[2][2];
            for (int end = 0; end < 2; end++) {
                for (int c = 0; c < 2; c++) {
                    d[end][c] = edge->middle[c] + (end - 0.5) * edge->along[c] - x[c];
                    double width = c == 0 ? p->h1 * p->nu : 0.0; /* wrapped cells: nearest image */
                    if (p->wrap && c == 0) {
                        d[end][c] -= width * round(d[end][c] / width);
                    }
                }
            }
            double area = 0.5 * sign * (d[0][0] * d[1][1] - d[0][1] * d[1][0]);
            cells->area[node] += area;
            for (int c = 0; c < 2; c++) {
                first[node][c] += area * (d[0][c] + d[1][c]) / 3.0;
            }
            for (int k = 0; k < 3; k++) {
                int a = k == 2, b = k >= 1;
                cells->moment[node][k] += area / 12.0 *
                                          (2.0 * d[0][a] * d[0][b] + 2.0 * d[1][a] * d[1][b] +
                                           d[0][a] * d[1][b] + d[1][a] * d[0][b]);
            }
        }
    }
    for (int i = 0; i < p->node_count; i++) {
        for (int k = 0; k < 3; k++) {
            int a = k == 2, b = k >= 1;
            double centre = first[i][a] * first[i][b] / cells->area[i];
            cells->moment[i][k] = (cells->moment[i][k] - centre) / cells->area[i];
        }
    }
    free(first);
}

static Cells allocate(const Panel *p, int edges, Arena *arena) {
    return (Cells){.edges = arena_push(arena, CellEdge, edges),
                   .area = arena_push(arena, double, p->node_count),
                   .moment =
                       (double(*)[3])arena_alloc(arena, sizeof(double[3]) * (size_t)p->node_count)};
}

static double clamp_to(double value, double high) { return fmin(high, fmax(0.0, value)); }

static Cells lattice_cells(const Panel *p, Arena *arena) {
    Cells cells = allocate(p, 3 * p->node_count + 2 * (p->nu + p->nv), arena);
    double width = p->wrap ? INFINITY : p->h1 * (p->nu - 1), height = p->h2 * (p->nv - 1);
    for (int j = 0; j < p->nv; j++) {
        for (int i = 0; i < p->nu; i++) {
            int node = j * p->nu + i;
            double u = p->h1 * i, v = p->h2 * j;
            double left = p->wrap ? u - 0.5 * p->h1 : clamp_to(u - 0.5 * p->h1, width);
            double right = p->wrap ? u + 0.5 * p->h1 : clamp_to(u + 0.5 * p->h1, width);
            double low = clamp_to(v - 0.5 * p->h2, height),
                   high = clamp_to(v + 0.5 * p->h2, height);
            double a[2] = {left, low}, b[2] = {right, low}, c[2] = {right, high},
                   d[2] = {left, high};
            bool last_u = !p->wrap && i == p->nu - 1, last_v = j == p->nv - 1;
            add_edge(&cells, node, last_u ? -1 : j * p->nu + (i + 1) % p->nu, b, c);
            add_edge(&cells, node, last_v ? -1 : node + p->nu, c, d);
            if (!p->wrap && i == 0) {
                add_edge(&cells, node, -1, d, a);
            }
            if (j == 0) {
                add_edge(&cells, node, -1, a, b);
            }
        }
    }
    return cells;
}

/* circumcentre of an acute triangle, centroid of any other */
static void dual_point(const double *a, const double *b, const double *c, double out[2]) {
    double bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
    double bb = bx * bx + by * by, cc = cx * cx + cy * cy, bc = bx * cx + by * cy;
    double d = 2.0 * (bx * cy - by * cx);
    bool acute = bc >= 0.0 && bb - bc >= 0.0 && cc - bc >= 0.0;
    if (acute) {
        out[0] = a[0] + (cy * bb - by * cc) / d;
        out[1] = a[1] + (bx * cc - cx * bb) / d;
    } else {
        out[0] = a[0] + (bx + cx) / 3.0;
        out[1] = a[1] + (by + cy) / 3.0;
    }
}

typedef struct HalfEdge {
    int low, high; /* nodes */
    int triangle;
    bool forward; /* low -> high runs anticlockwise in the triangle */
} HalfEdge;

static int compare_half_edges(const void *a, const void *b) {
    const HalfEdge *x = a, *y = b;
    if (x->low != y->low) {
        return x->low - y->low;
    }
    return x->high != y->high ? x->high - y->high : x->triangle - y->triangle;
}

static HalfEdge *half_edges(const Panel *p) {
    HalfEdge *edges = memory_new(3 * (size_t)p->triangle_count * sizeof *edges);
    for (int t = 0; t < p->triangle_count; t++) {
        for (int k = 0; k < 3; k++) {
            int a = p->triangles[3 * t + k], b = p->triangles[3 * t + (k + 1) % 3];
            edges[3 * t + k] = (HalfEdge){a < b ? a : b, a < b ? b : a, t, a < b};
        }
    }
    qsort(edges, 3 * (size_t)p->triangle_count, sizeof *edges, compare_half_edges);
    return edges;
}

static Cells scattered_cells(const Panel *p, Arena *arena) {
    int count = 3 * p->triangle_count;
    Cells cells = allocate(p, 2 * count, arena);
    double(*dual)[2] = memory_new((size_t)p->triangle_count * sizeof *dual);
    HalfEdge *edges = half_edges(p);
    const double *x = p->material;
    for (int t = 0; t < p->triangle_count; t++) {
        const int *n = p->triangles + 3 * t;
        dual_point(x + 2 * n[0], x + 2 * n[1], x + 2 * n[2], dual[t]);
    }
    for (int e = 0; e < count; e++) {
        const HalfEdge *h = &edges[e];
        bool shared = e + 1 < count && edges[e + 1].low == h->low && edges[e + 1].high == h->high;
        int a = h->forward ? h->low : h->high, b = h->forward ? h->high : h->low;
        const double *xa = x + 2 * a, *xb = x + 2 * b;
        double middle[2] = {0.5 * (xa[0] + xb[0]), 0.5 * (xa[1] + xb[1])};
        const double *mine = dual[h->triangle];
        /* a -> b with the triangle on the left: cell a is left of the line middle -> dual */
        if (shared) {
            const double *other = dual[edges[e + 1].triangle];
            double bend = (middle[0] - other[0]) * (mine[1] - other[1]) -
                          (middle[1] - other[1]) * (mine[0] - other[0]);
            if (fabs(bend) < 1e-9 * p->h1 * p->h1) {
                add_edge(&cells, a, b, other, mine);
            } else {
                add_edge(&cells, a, b, other, middle);
                add_edge(&cells, a, b, middle, mine);
            }
            e++;
        } else {
            add_edge(&cells, a, b, middle, mine);
            add_edge(&cells, a, -1, xa, middle);
            add_edge(&cells, b, -1, middle, xb);
        }
    }
    free(edges);
    free(dual);
    return cells;
}

Cells cells_create(const Panel *p, Arena *arena) {
    Cells cells = p->nu > 0 ? lattice_cells(p, arena) : scattered_cells(p, arena);
    integrate(p, &cells);
    return cells;
}
