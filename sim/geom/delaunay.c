/* delaunay.c: the only file that knows Qhull. */
#include "sim/geom/delaunay.h"

#include <libqhull_r/libqhull_r.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double cross(const double *a, const double *b, const double *c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static int compare_triangles(const void *a, const void *b) {
    const int *x = a, *y = b;
    for (int k = 0; k < 3; k++) {
        if (x[k] != y[k]) {
            return x[k] - y[k];
        }
    }
    return 0;
}

/* smallest number first, anticlockwise kept */
static void normalise(const double *points, int *t) {
    if (cross(points + 2 * t[0], points + 2 * t[1], points + 2 * t[2]) < 0.0) {
        int swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
    while (t[0] > t[1] || t[0] > t[2]) {
        int first = t[0];
        t[0] = t[1], t[1] = t[2], t[2] = first;
    }
}

static int read_facets(qhT *qh, const double *points, int *triangles) {
    int count = 0;
    facetT *facet;
    FORALLfacets {
        if (facet->upperdelaunay || !facet->simplicial) {
            continue;
        }
        vertexT *vertex, **vertexp;
        int corner = 0;
        FOREACHvertex_(facet->vertices) {
            if (corner < 3) {
                triangles[3 * count + corner++] = qh_pointid(qh, vertex->point);
            }
        }
        normalise(points, triangles + 3 * count);
        count++;
    }
    qsort(triangles, (size_t)count, 3 * sizeof *triangles, compare_triangles);
    return count;
}

bool delaunay_triangulate(const double *points, int count, Arena *arena, int **triangles,
                          int *triangle_count) {
    if (count < 3) {
        return false;
    }
    qhT state, *qh = &state;
    double *copy = arena_push(arena, double, 2 * count);
    memcpy(copy, points, 2 * (size_t)count * sizeof *copy);
    FILE *nowhere = fopen("/dev/null", "w");
    char options[] = "qhull d Qt Qbb Qc";
    qh_zero(qh, nowhere);
    int code = qh_new_qhull(qh, 2, count, copy, False, options, nowhere, nowhere);
    if (code == 0) {
        *triangles = arena_push(arena, int, 3 * qh->num_facets);
        *triangle_count = read_facets(qh, points, *triangles);
    }
    qh_freeqhull(qh, !qh_ALL);
    int current, total;
    qh_memfreeshort(qh, &current, &total);
    if (nowhere) {
        fclose(nowhere);
    }
    return code == 0;
}

bool loops_contain(const double *points, const int *begin, int loop_count, const double p[2]) {
    bool inside = false;
    for (int l = 0; l < loop_count; l++) {
        for (int i = begin[l], j = begin[l + 1] - 1; i < begin[l + 1]; j = i++) {
            const double *a = points + 2 * i, *b = points + 2 * j;
            if ((a[1] > p[1]) != (b[1] > p[1]) &&
                p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]) {
                inside = !inside;
            }
        }
    }
    return inside;
}

double loops_distance(const double *points, const int *begin, int loop_count, const double p[2]) {
    double least = INFINITY;
    for (int l = 0; l < loop_count; l++) {
        for (int i = begin[l], j = begin[l + 1] - 1; i < begin[l + 1]; j = i++) {
            const double *a = points + 2 * i, *b = points + 2 * j;
            double eu = b[0] - a[0], ev = b[1] - a[1], square = eu * eu + ev * ev;
            double t = square > 0 ? ((p[0] - a[0]) * eu + (p[1] - a[1]) * ev) / square : 0.0;
            t = fmin(1.0, fmax(0.0, t));
            least = fmin(least, hypot(a[0] + t * eu - p[0], a[1] + t * ev - p[1]));
        }
    }
    return least;
}

double loops_area(const double *points, const int *begin, int loop_count) {
    double area = 0.0;
    for (int l = 0; l < loop_count; l++) {
        for (int i = begin[l], j = begin[l + 1] - 1; i < begin[l + 1]; j = i++) {
            area += 0.5 * (points[2 * j] * points[2 * i + 1] - points[2 * i] * points[2 * j + 1]);
        }
    }
    return area;
}
