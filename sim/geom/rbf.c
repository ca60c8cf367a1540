#include "sim/geom/rbf.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "sim/base/error.h"

/* smallest singular value of the scaled polynomial block; below it another distance shell is
 * added (else border stencils lose all accuracy) */
#define UNISOLVENT 0.25
#define DEGENERATE 1e-6 /* below it the nodes do not determine the polynomials */
#define MOST_POLYNOMIALS 10

const RbfKind rbf_lattice_edge = {3, 2, 8};
const RbfKind rbf_scattered_edge = {5, 2, 12};
const RbfKind rbf_resample = {5, 2, 16};
const RbfKind rbf_scattered_membrane = {7, 3, 24};

static int polynomial_count(int degree) { return (degree + 1) * (degree + 2) / 2; }

/* d^(a+b) / dx^a dy^b of x^i y^j */
static double monomial(double x, double y, int i, int j, int a, int b) {
    double value = 1.0;
    for (int k = 0; k < a; k++) {
        value *= i - k;
    }
    for (int k = 0; k < b; k++) {
        value *= j - k;
    }
    if (i < a || j < b) {
        return 0.0;
    }
    for (int k = 0; k < i - a; k++) {
        value *= x;
    }
    for (int k = 0; k < j - b; k++) {
        value *= y;
    }
    return value;
}

static const int orders[RBF_FUNCTIONAL_COUNT][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};

static void polynomials(int degree, const double p[2], RbfFunctional f, double *out) {
    int at = 0;
    for (int total = 0; total <= degree; total++) {
        for (int j = 0; j <= total; j++) {
            out[at++] = monomial(p[0], p[1], total - j, j, orders[f][0], orders[f][1]);
        }
    }
}

/* functional of r^n, n = 3, 5, 7, at the offset (x, y) from the node; pow() would be slow, and
 * differ between processors */
static double kernel(int n, double x, double y, RbfFunctional f) {
    double square = x * x + y * y, r = sqrt(square);
    double lowest = r > 0.0 ? 1.0 / r : 0.0, low = r; /* r^(n-4), r^(n-2) */
    for (int power = 3; power < n; power += 2) {
        lowest = low;
        low *= square;
    }
    switch (f) {
    case RBF_VALUE:
        return low * square;
    case RBF_D1:
        return n * low * x;
    case RBF_D2:
        return n * low * y;
    case RBF_D11:
        return n * low + n * (n - 2) * lowest * x * x;
    case RBF_D12:
        return n * (n - 2) * lowest * x * y;
    case RBF_D22:
        return n * low + n * (n - 2) * lowest * y * y;
    }
    return 0.0;
}

static void localise(RbfStencil *s, const PointGrid *grid) {
    for (int i = 0; i < s->count; i++) {
        for (int c = 0; c < 2; c++) {
            s->local[2 * i + c] =
                (grid->points[2 * (size_t)s->nodes[i] + (size_t)c] - s->centre[c]) / s->scale;
        }
    }
}

static double smallest_singular_value(const RbfStencil *s) {
    int m = polynomial_count(s->kind.degree);
    double block[STENCIL_CAPACITY * MOST_POLYNOMIALS], values[MOST_POLYNOMIALS];
    double superb[MOST_POLYNOMIALS];
    if (s->count < m) {
        return 0.0;
    }
    for (int i = 0; i < s->count; i++) {
        polynomials(s->kind.degree, s->local + 2 * i, RBF_VALUE, block + i * m);
    }
    int info = LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'N', 'N', s->count, m, block, m, values, NULL, 1,
                              NULL, 1, superb);
    return info == 0 ? values[m - 1] : 0.0;
}

static void factorise(RbfStencil *s, Arena *arena) {
    int m = polynomial_count(s->kind.degree), n = s->count + m;
    s->matrix = arena_push(arena, double, n *n);
    s->pivots = arena_push(arena, int, n);
    for (int i = 0; i < s->count; i++) {
        double *row = s->matrix + (size_t)i * (size_t)n;
        for (int j = 0; j < s->count; j++) {
            row[j] = kernel(s->kind.power, s->local[2 * i] - s->local[2 * j],
                            s->local[2 * i + 1] - s->local[2 * j + 1], RBF_VALUE);
        }
        polynomials(s->kind.degree, s->local + 2 * i, RBF_VALUE, row + s->count);
        for (int j = 0; j < m; j++) {
            s->matrix[(size_t)(s->count + j) * (size_t)n + (size_t)i] = row[s->count + j];
        }
    }
    /* the matrix is symmetric: columns are rows, which saves LAPACKE transposing */
    int info = LAPACKE_dgetrf(LAPACK_COL_MAJOR, n, n, s->matrix, n, s->pivots);
    ASSERT(info == 0);
}

RbfStencil rbf_stencil(const PointGrid *grid, RbfKind kind, const double centre[2], Arena *arena) {
    RbfStencil s = {.kind = kind, .centre = {centre[0], centre[1]}, .scale = grid->spacing};
    int wanted = kind.nodes;
    for (;;) {
        s.count = points_nearest(grid, centre, wanted, s.nodes);
        localise(&s, grid);
        s.inverse_size = smallest_singular_value(&s);
        bool all = s.count == grid->count || s.count + MOST_POLYNOMIALS >= STENCIL_CAPACITY;
        if (s.inverse_size >= UNISOLVENT || all) {
            break;
        }
        wanted = s.count + 1;
    }
    while (s.inverse_size < DEGENERATE && s.kind.degree > 0) {
        s.kind.degree--;
        s.kind.power = s.kind.power > 3 ? s.kind.power - 2 : 3;
        s.inverse_size = smallest_singular_value(&s);
    }
    factorise(&s, arena);
    return s;
}

void rbf_rows(const RbfStencil *s, const double at[2], int functional_count,
              const RbfFunctional *functionals, double (*weights)[STENCIL_CAPACITY]) {
    int m = polynomial_count(s->kind.degree), n = s->count + m;
    double p[2] = {(at[0] - s->centre[0]) / s->scale, (at[1] - s->centre[1]) / s->scale};
    double right[(STENCIL_CAPACITY + MOST_POLYNOMIALS) * RBF_FUNCTIONAL_COUNT];
    for (int f = 0; f < functional_count; f++) {
        double tail[MOST_POLYNOMIALS] = {0};
        for (int i = 0; i < s->count; i++) {
            right[f * n + i] = kernel(s->kind.power, p[0] - s->local[2 * i],
                                      p[1] - s->local[2 * i + 1], functionals[f]);
        }
        polynomials(s->kind.degree, p, functionals[f], tail);
        for (int j = 0; j < m; j++) {
            right[f * n + s->count + j] = tail[j];
        }
    }
    int info = LAPACKE_dgetrs(LAPACK_COL_MAJOR, 'N', n, functional_count, s->matrix, n, s->pivots,
                              right, n);
    ASSERT(info == 0);
    for (int f = 0; f < functional_count; f++) {
        int order = orders[functionals[f]][0] + orders[functionals[f]][1];
        double unscale = pow(s->scale, -order);
        for (int i = 0; i < s->count; i++) {
            weights[f][i] = unscale * right[f * n + i];
        }
    }
}
