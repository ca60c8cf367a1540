/* Cubic B-spline interpolation on a lattice [Unser, Aldroubi, Eden 1993: B-spline signal
 * processing]. The coefficients c solve (c_{i-1} + 4 c_i + c_{i+1}) / 6 = x_i, so that the surface
 * passes through the nodes; at a free border the third derivative vanishes, which makes
 * quadratics exact. */
#include <math.h>
#include <string.h>

#include "render/apart.h"
#include "render/resample.h"
#include "sim/base/error.h"

#define TAPS 4
#define POLE -0.26794919243112270647 /* sqrt(3) - 2, of the interpolation filter */
#define MOST_CELLS 8192              /* along one direction */

typedef struct Tap {
    int first;          /* padded coefficient number */
    double value[TAPS]; /* B-spline weights */
    double slope[TAPS]; /* their derivatives [1/m] */
} Tap;

typedef struct LatticePlan {
    int count[2];  /* nodes along u, v */
    int stride[2]; /* node number = stride[0] i + stride[1] j */
    bool around;
    const int32_t *triangles;  /* (triangle_count x 3) of the layout, */
    int first, triangle_count; /* its first vertex; while plans are made */
    bool
        *falls; /* (cells between nodes) the diagonal goes from the right below to the left above */
    int level;  /* fine cells along the side of a cell between nodes */
    int padded[2];        /* coefficients along u, v: one more before, one or two after */
    int cells[2];         /* fine cells along u, v */
    Tap *taps[2];         /* (cells + 1) */
    float *place[2];      /* [m] (cells + 1) from the panel's corner */
    double *coefficients; /* [m] (padded[1] x padded[0] x 3) */
    double *line;         /* scratch (longest count x 2) */
    double *columns;      /* (padded[1] x (cells[0] + 1) x 6): value and u slope */
} LatticePlan;

/* Cells between nodes along an axis. */
static int interval_count(const LatticePlan *plan, int axis) {
    return plan->count[axis] - (axis == 0 && plan->around ? 0 : 1);
}

static void plan_taps(LatticePlan *plan, int axis, double spacing, Arena *arena) {
    int cells = plan->cells[axis], intervals = interval_count(plan, axis);
    plan->taps[axis] = arena_push(arena, Tap, cells + 1);
    plan->place[axis] = arena_push(arena, float, cells + 1);
    for (int i = 0; i <= cells; i++) {
        double at = (double)intervals * i / cells;
        int first = i < cells ? i / plan->level : intervals - 1;
        double t = at - first, r = 1.0 - t, d = 1.0 / spacing;
        plan->place[axis][i] = (float)(at * spacing);
        plan->taps[axis][i] = (Tap){
            .first = first, /* padded: coefficient -1 is number 0 */
            .value = {r * r * r / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                      (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0, t * t * t / 6.0},
            .slope = {-0.5 * r * r * d, (1.5 * t - 2.0) * t * d, (2.0 - 1.5 * r) * r * d,
                      0.5 * t * t * d},
        };
    }
}

/* Which index runs fastest is told by the material coordinates. */
static void find_strides(LatticePlan *plan, const double *material) {
    bool u_first = fabs(material[2] - material[0]) > fabs(material[3] - material[1]);
    plan->stride[0] = u_first ? 1 : plan->count[1];
    plan->stride[1] = u_first ? plan->count[0] : 1;
}

/* wanted: fine cells along a cell between nodes */
static int choose_level(const LatticePlan *plan, double wanted) {
    int longest = interval_count(plan, 0) > interval_count(plan, 1) ? interval_count(plan, 0)
                                                                    : interval_count(plan, 1);
    int most = MOST_CELLS / longest > 1 ? MOST_CELLS / longest : 1;
    return wanted <= 1.0 ? 1 : wanted >= most ? most : (int)ceil(wanted);
}

static int coarse_lines(const LatticePlan *plan, int axis) {
    int intervals = interval_count(plan, axis), n = plan->level;
    return n == 1 ? (intervals + 1) / 2 : intervals * ((n + 1) / 2);
}

static void *lattice_plan(const StateLayout *layout, int cloth, double cell, Arena *arena,
                          SurfacePart *part) {
    const int32_t *lattice = layout->lattice + 4 * cloth;
    const double *material = layout->material + 2 * layout->node_begin[cloth];
    LatticePlan *plan = arena_push(arena, LatticePlan, 1);
    plan->count[0] = lattice[0], plan->count[1] = lattice[1];
    plan->around = lattice[2] == 1;
    find_strides(plan, material);
    double spacing[2];
    for (int axis = 0; axis < 2; axis++) {
        int intervals = plan->count[axis] - 1;
        const double *last = material + 2 * plan->stride[axis] * intervals;
        spacing[axis] = (last[axis] - material[axis]) / intervals;
        intervals += axis == 0 && plan->around;
        part->corner[axis] = material[axis];
        part->size[axis] = spacing[axis] * intervals;
    }
    plan->level = choose_level(plan, sqrt(fabs(spacing[0] * spacing[1])) / cell);
    for (int axis = 0; axis < 2; axis++) {
        plan->cells[axis] = plan->level * interval_count(plan, axis);
        plan_taps(plan, axis, spacing[axis], arena);
    }
    int *padded = plan->padded;
    padded[0] = plan->count[0] + (plan->around ? 3 : 2);
    padded[1] = plan->count[1] + 2;
    int longest = padded[0] > padded[1] ? padded[0] : padded[1];
    plan->coefficients = arena_push(arena, double, 3 * padded[0] * padded[1]);
    plan->line = arena_push(arena, double, 2 * longest);
    plan->columns = arena_push(arena, double, 6 * padded[1] * (plan->cells[0] + 1));
    part->vertex_count = (plan->cells[0] + 1) * (plan->cells[1] + 1);
    part->fine_count = 2 * plan->cells[0] * plan->cells[1];
    part->coarse_count = 2 * coarse_lines(plan, 0) * coarse_lines(plan, 1);
    part->around = plan->around;
    part->rectangle = true;
    plan->first = layout->vertex_begin[cloth];
    plan->triangle_count = layout->triangle_begin[cloth + 1] - layout->triangle_begin[cloth];
    plan->triangles = plan->triangle_count > 0
                          ? layout->triangles + 3 * (size_t)layout->triangle_begin[cloth]
                          : NULL;
    return plan;
}

/* Half of a cell between nodes. */
typedef struct Half {
    int cell[2];  /* along u, v */
    int at[3][2]; /* the corners from there: 0 or 1 */
    int right;    /* the corner where both sides of the cell meet */
} Half;

/* False: these vertices are not half of a cell. */
static bool find_half(const LatticePlan *plan, const int32_t corner[3], Half *half) {
    int axis_count = plan->stride[0] == 1 ? plan->count[0] : plan->count[1], spread[2];
    for (int k = 0; k < 3; k++) {
        int fast = corner[k] % axis_count, slow = corner[k] / axis_count;
        half->at[k][0] = plan->stride[0] == 1 ? fast : slow;
        half->at[k][1] = plan->stride[0] == 1 ? slow : fast;
    }
    for (int axis = 0; axis < 2; axis++) {
        int low = half->at[0][axis], high = low;
        for (int k = 1; k < 3; k++) {
            low = half->at[k][axis] < low ? half->at[k][axis] : low;
            high = half->at[k][axis] > high ? half->at[k][axis] : high;
        }
        if (axis == 0 && plan->around && high - low > 1) { /* across the seam */
            low = high;
        }
        half->cell[axis] = low;
        spread[axis] = 0;
        for (int k = 0; k < 3; k++) {
            int from = half->at[k][axis] - low;
            half->at[k][axis] = from < 0 ? from + plan->count[axis] : from;
            spread[axis] |= 1 << half->at[k][axis];
            if (half->at[k][axis] > 1) {
                return false;
            }
        }
    }
    for (int k = 0; k < 3; k++) {
        const int *own = half->at[k], *one = half->at[(k + 1) % 3], *two = half->at[(k + 2) % 3];
        if ((own[0] == one[0]) != (own[1] == one[1]) && (own[0] == two[0]) != (own[1] == two[1]) &&
            (own[0] == one[0]) != (own[0] == two[0])) {
            half->right = k;
        }
    }
    return spread[0] == 3 && spread[1] == 3;
}

static bool is_falling(const Half *half) {
    const int *right = half->at[half->right];
    return right[0] == right[1];
}

/* The diagonals of the layout's triangles; without triangles they alternate. */
static void lattice_prepare(void *plan_data, Arena *arena) {
    LatticePlan *plan = plan_data;
    int columns = interval_count(plan, 0), rows = interval_count(plan, 1);
    plan->falls = arena_push(arena, bool, (size_t)columns *(size_t)rows);
    for (int j = 0; j < rows; j++) {
        for (int i = 0; i < columns; i++) {
            plan->falls[j * columns + i] = (i + j) & 1;
        }
    }
    for (int t = 0; t < plan->triangle_count; t++) {
        int32_t corner[3];
        Half half;
        for (int k = 0; k < 3; k++) {
            corner[k] = plan->triangles[3 * (size_t)t + (size_t)k] - plan->first;
        }
        if (find_half(plan, corner, &half)) {
            plan->falls[half.cell[1] * columns + half.cell[0]] = is_falling(&half);
        }
    }
    plan->triangles = NULL;
}

/* The corner where both sides meet comes first. */
static bool lattice_place(const void *plan_data, const SurfacePart *part, const int32_t *triangles,
                          int count, Piece *pieces) {
    const LatticePlan *plan = plan_data;
    int row = plan->cells[0] + 1, n = plan->level;
    for (int t = 0; t < count; t++) {
        Piece *piece = &pieces[t];
        int at[3];
        Half half;
        if (!find_half(plan, triangles + 3 * (size_t)t, &half)) {
            return false;
        }
        for (int k = 0; k < 3; k++) {
            int turned = (half.right + k) % 3;
            piece->corner[k] = triangles[3 * (size_t)t + (size_t)turned];
            at[k] = (half.cell[1] + half.at[turned][1]) * row + half.cell[0] + half.at[turned][0];
        }
        int column = n * (half.cell[0] + half.at[half.right][0]);
        int line = n * (half.cell[1] + half.at[half.right][1]);
        piece->origin = part->vertex_begin + line * row + column;
        piece->step[0] = at[1] - at[0];
        piece->step[1] = at[2] - at[0];
        piece->level = n;
        piece->packed = false;
    }
    return true;
}

/* The line of vertices after line i. Coarse cells of two fine ones end with the cells between nodes too, so
 * that the shadow is that of the same folds; but for cells that are not cut. */
static int next_line(const LatticePlan *plan, int axis, int i, bool coarse) {
    int left = plan->level == 1 ? plan->cells[axis] - i : plan->level - i % plan->level;
    return i + (coarse && left > 1 ? 2 : 1);
}

/* Two triangles a cell, anticlockwise seen from the face; the diagonals are those of the cells between
 * nodes. */
static uint32_t *connect_grid(const LatticePlan *plan, uint32_t base, bool coarse, uint32_t *out) {
    uint32_t row = (uint32_t)plan->cells[0] + 1;
    int columns = interval_count(plan, 0), n = plan->level;
    for (int j = 0, above = 0; j < plan->cells[1]; j = above) {
        above = next_line(plan, 1, j, coarse);
        for (int i = 0, beside = 0; i < plan->cells[0]; i = beside) {
            beside = next_line(plan, 0, i, coarse);
            uint32_t a = base + (uint32_t)j * row + (uint32_t)i;
            uint32_t b = a + (uint32_t)(beside - i), c = a + (uint32_t)(above - j) * row;
            uint32_t d = c + (uint32_t)(beside - i);
            uint32_t rising[6] = {a, b, d, a, d, c}, falling[6] = {a, b, c, b, d, c};
            memcpy(out, plan->falls[j / n * columns + i / n] ? falling : rising, sizeof rising);
            out += 6;
        }
    }
    return out;
}

static void lattice_connect(const void *plan_data, Surface *surface, const SurfacePart *part) {
    const LatticePlan *plan = plan_data;
    float *uv = surface->uv + 2 * part->vertex_begin;
    for (int j = 0; j <= plan->cells[1]; j++) {
        for (int i = 0; i <= plan->cells[0]; i++) {
            *uv++ = plan->place[0][i];
            *uv++ = plan->place[1][j];
        }
    }
    uint32_t base = (uint32_t)part->vertex_begin;
    connect_grid(plan, base, false, surface->fine + 3 * part->fine_begin);
    connect_grid(plan, base, true, surface->coarse + 3 * part->coarse_begin);
}

/* Coefficients of a closed line of n values, in place. */
static void filter_closed(double *f, int n) {
    double power = 1.0, sum = 0.0;
    for (int k = 0; k < n; k++, power *= POLE) {
        sum += power * f[(n - k) % n];
    }
    f[0] = sum / (1.0 - power);
    for (int i = 1; i < n; i++) {
        f[i] += POLE * f[i - 1];
    }
    power = 1.0, sum = 0.0;
    for (int k = 0; k < n; k++, power *= POLE) {
        sum += power * f[(n - 1 + k) % n];
    }
    f[n - 1] = -POLE * sum / (1.0 - power);
    for (int i = n - 2; i >= 0; i--) {
        f[i] = POLE * (f[i + 1] - f[i]);
    }
    for (int i = 0; i < n; i++) {
        f[i] *= 6.0;
    }
}

/* Coefficients of an open line of n values, in place; pivots: scratch (n). Rows: c0 - c1 =
 * f0 - f1; c_{i-1} + 4 c_i + c_{i+1} = 6 f_i; c_{n-1} - c_{n-2} = f_{n-1} - f_{n-2}. */
static void filter_open(double *f, double *pivots, int n) {
    if (n < 3) {
        return; /* a linear function is its own coefficients */
    }
    double last = f[n - 1] - f[n - 2];
    pivots[0] = -1.0; /* of the elimination: c_i = f_i - pivots_i c_{i+1} */
    f[0] = f[0] - f[1];
    for (int i = 1; i < n - 1; i++) {
        double inverse = 1.0 / (4.0 - pivots[i - 1]);
        pivots[i] = inverse;
        f[i] = (6.0 * f[i] - f[i - 1]) * inverse;
    }
    f[n - 1] = (last + f[n - 2]) / (1.0 + pivots[n - 2]);
    for (int i = n - 2; i >= 0; i--) {
        f[i] -= pivots[i] * f[i + 1];
    }
}

/* Interpolating coefficients along one line of `count` values `step` apart; also its padding. */
static void filter_line(double *at, ptrdiff_t step, int count, bool closed, double *scratch) {
    for (int i = 0; i < count; i++) {
        scratch[i] = at[step * (i + 1)];
    }
    if (closed) {
        filter_closed(scratch, count);
    } else {
        filter_open(scratch, scratch + count, count);
    }
    for (int i = 0; i < count; i++) {
        at[step * (i + 1)] = scratch[i];
    }
    const double *c = scratch, *e = scratch + count - 1;
    if (closed) {
        at[0] = e[0];
        at[step * (count + 1)] = c[0];
        at[step * (count + 2)] = c[1 % count];
    } else if (count < 3) {
        at[0] = 2.0 * c[0] - c[1];
        at[step * (count + 1)] = 2.0 * e[0] - e[-1];
    } else {
        at[0] = 3.0 * (c[0] - c[1]) + c[2];
        at[step * (count + 1)] = 3.0 * (e[0] - e[-1]) + e[-2];
    }
}

static void find_coefficients(LatticePlan *plan, const double *x) {
    int nu = plan->count[0], nv = plan->count[1];
    ptrdiff_t row = 3 * (ptrdiff_t)plan->padded[0];
    for (int j = 0; j < nv; j++) {
        for (int i = 0; i < nu; i++) {
            memcpy(plan->coefficients + row * (j + 1) + 3 * (i + 1),
                   x + 3 * (plan->stride[0] * i + plan->stride[1] * j), 3 * sizeof *x);
        }
        for (int k = 0; k < 3; k++) {
            filter_line(plan->coefficients + row * (j + 1) + k, 3, nu, plan->around, plan->line);
        }
    }
    for (int i = 0; i < row; i++) {
        filter_line(plan->coefficients + i, row, nv, false, plan->line);
    }
}

/* Value and slope along u in every padded row, at every fine column. */
static void evaluate_rows(LatticePlan *plan) {
    int columns = plan->cells[0] + 1;
    for (int j = 0; j < plan->padded[1]; j++) {
        const double *row = plan->coefficients + 3 * (ptrdiff_t)plan->padded[0] * j;
        double *out = plan->columns + 6 * (ptrdiff_t)columns * j;
        for (int i = 0; i < columns; i++, out += 6) {
            const Tap *tap = &plan->taps[0][i];
            const double *c = row + 3 * tap->first;
            for (int k = 0; k < 3; k++) {
                out[k] = tap->value[0] * c[k] + tap->value[1] * c[3 + k] +
                         tap->value[2] * c[6 + k] + tap->value[3] * c[9 + k];
                out[3 + k] = tap->slope[0] * c[k] + tap->slope[1] * c[3 + k] +
                             tap->slope[2] * c[6 + k] + tap->slope[3] * c[9 + k];
            }
        }
    }
}

static void evaluate_columns(const LatticePlan *plan, bool derivatives, SurfaceVertex *vertex) {
    ptrdiff_t columns = plan->cells[0] + 1, row = 6 * columns;
    for (int j = 0; j <= plan->cells[1]; j++) {
        const Tap *tap = &plan->taps[1][j];
        const double *a = plan->columns + row * tap->first;
        for (ptrdiff_t i = 0; i < columns; i++, a += 6, vertex++) {
            double du[3], dv[3];
            for (int k = 0; k < 3; k++) {
                const double *p = a + k, *q = a + 3 + k;
                double at = tap->value[0] * p[0] + tap->value[1] * p[row] +
                            tap->value[2] * p[2 * row] + tap->value[3] * p[3 * row];
                du[k] = tap->value[0] * q[0] + tap->value[1] * q[row] + tap->value[2] * q[2 * row] +
                        tap->value[3] * q[3 * row];
                dv[k] = tap->slope[0] * p[0] + tap->slope[1] * p[row] + tap->slope[2] * p[2 * row] +
                        tap->slope[3] * p[3 * row];
                vertex->position[k] = (float)at;
            }
            resample_set_frame(vertex, du, dv, derivatives);
        }
    }
}

static void lattice_evaluate(void *plan_data, const double *x, const double *s, bool derivatives,
                             SurfaceVertex *vertices) {
    (void)s; /* the nodes of a lattice lie on the surface */
    LatticePlan *plan = plan_data;
    find_coefficients(plan, x);
    evaluate_rows(plan);
    evaluate_columns(plan, derivatives, vertices);
}

const ResampleKind resample_lattice = {"lattice",       lattice_plan,  lattice_prepare,
                                       lattice_connect, lattice_place, lattice_evaluate};
