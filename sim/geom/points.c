#include "sim/geom/points.h"

#include <math.h>
#include <stdlib.h>

#include "sim/base/error.h"

#define TIE 1e-6          /* relative distance within which points count as equally far */
#define CELL_SPACINGS 2.0 /* size of a grid cell */

static int cell_of(const PointGrid *g, double value, int axis) {
    int cell = (int)floor((value - g->low[axis]) / (CELL_SPACINGS * g->spacing));
    return cell < 0 ? 0 : cell >= g->cells[axis] ? g->cells[axis] - 1 : cell;
}

static int cell_index(const PointGrid *g, const double *p) {
    return cell_of(g, p[1], 1) * g->cells[0] + cell_of(g, p[0], 0);
}

PointGrid points_grid(const double *points, int count, double spacing, Arena *arena) {
    PointGrid g = {.count = count, .points = points, .spacing = spacing};
    double high[2] = {-INFINITY, -INFINITY};
    g.low[0] = g.low[1] = INFINITY;
    for (int i = 0; i < 2 * count; i++) {
        g.low[i % 2] = fmin(g.low[i % 2], points[i]);
        high[i % 2] = fmax(high[i % 2], points[i]);
    }
    for (int axis = 0; axis < 2; axis++) {
        double extent = (high[axis] - g.low[axis]) / (CELL_SPACINGS * spacing);
        g.cells[axis] = 1 + (int)fmin(extent, 1e4);
    }
    g.begin = arena_push(arena, int, g.cells[0] * g.cells[1] + 1);
    g.index = arena_push(arena, int, count);
    for (int i = 0; i < count; i++) {
        g.begin[cell_index(&g, points + 2 * i) + 1]++;
    }
    for (int c = 0; c < g.cells[0] * g.cells[1]; c++) {
        g.begin[c + 1] += g.begin[c];
    }
    int *fill = arena_push(arena, int, g.cells[0] * g.cells[1]);
    for (int i = 0; i < count; i++) {
        int c = cell_index(&g, points + 2 * i);
        g.index[g.begin[c] + fill[c]++] = i;
    }
    return g;
}

typedef struct Candidate {
    double square;
    int node;
} Candidate;

static int compare_candidates(const void *a, const void *b) {
    const Candidate *x = a, *y = b;
    if (x->square != y->square) {
        return x->square < y->square ? -1 : 1;
    }
    return x->node - y->node;
}

/* all points in the cells within `ring` cells of `at`; those inside `*radius` are certain */
static int collect(const PointGrid *g, const double at[2], int ring, Candidate *found,
                   int capacity) {
    int cu = cell_of(g, at[0], 0), cv = cell_of(g, at[1], 1), count = 0;
    for (int v = cv - ring; v <= cv + ring; v++) {
        for (int u = cu - ring; u <= cu + ring; u++) {
            if (u < 0 || v < 0 || u >= g->cells[0] || v >= g->cells[1]) {
                continue;
            }
            int c = v * g->cells[0] + u;
            for (int k = g->begin[c]; k < g->begin[c + 1] && count < capacity; k++) {
                const double *p = g->points + 2 * (size_t)g->index[k];
                double du = p[0] - at[0], dv = p[1] - at[1];
                found[count++] = (Candidate){du * du + dv * dv, g->index[k]};
            }
        }
    }
    return count;
}

int points_nearest(const PointGrid *g, const double at[2], int wanted,
                   int nodes[STENCIL_CAPACITY]) {
    enum { CAPACITY = 4096 };
    Candidate found[CAPACITY];
    int most = g->cells[0] > g->cells[1] ? g->cells[0] : g->cells[1];
    wanted = wanted > g->count ? g->count : wanted;
    for (int ring = 1;; ring++) {
        int count = collect(g, at, ring, found, CAPACITY);
        double certain = ring * CELL_SPACINGS * g->spacing * (1.0 - 1e-9);
        qsort(found, (size_t)count, sizeof *found, compare_candidates);
        bool all = ring > most;
        if (count < wanted ||
            (!all && found[wanted - 1].square * (1.0 + 4.0 * TIE) > certain * certain)) {
            ASSERT(!all);
            continue;
        }
        double limit = found[wanted - 1].square * (1.0 + 2.0 * TIE);
        int taken = 0;
        while (taken < count && taken < STENCIL_CAPACITY &&
               (taken < wanted || found[taken].square <= limit)) {
            nodes[taken] = found[taken].node;
            taken++;
        }
        return taken;
    }
}
