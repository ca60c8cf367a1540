#include "sim/model/thread_rows.h"

#include <math.h>
#include <string.h>

#include "sim/base/quad.h"
#include "sim/geom/lanes.h"

#define ROW_LOOP _Pragma("omp simd")
#define INLINE __attribute__((always_inline)) /* into the clone for each kind of vectors */
#define TINY 1e-300 /* keeps 0/0 out where two nodes are in one place, or a unit is flat */

/* x, y, z of one row; slots -1 .. nu can be read */
typedef struct Row3 {
    double *c[3];
} Row3;

/* edges of one row of nodes along a thread, or from one row to the next across */
typedef struct Edges {
    Row3 e, t, g;     /* [m] edge; direction (thread_units.c: or shorter); [N] dE/d(edge) */
    double *inverse;  /* [1/m] 1 / length */
    double *straight; /* 1: t is a unit vector; 0: it counts as a vector */
} Edges;

/* constants of threads along one axis */
typedef struct Thread {
    double h, shortest;        /* [m] rest length, shortest that has a direction */
    double stiffness;          /* [N/m] of inner springs */
    double area;               /* [m2] of inner bends */
    double first, bend;        /* [N m], [N m2] M = (first - bend K) K before the onset */
    double slope, step, onset; /* M = step + slope K beyond */
    double sharpest;           /* sine of the half turn where K goes on linearly */
    const YarnTable *table;    /* M(K) in place of the above; NULL */
} Thread;

struct ThreadRows {
    int nu, nv, stride;
    bool wrap, sine;
    Thread thread[2];
    TrellisCurve trellis;
    double cell_area, shear_first, shear_bend;
    double measured, closed, closed_stiffen; /* sines; [N/m] d2W/dS2 beyond `closed` */
    double twist;                            /* [N/m] on the twist vector of a cell */
    double *width[3];   /* (stride) 0.5 on border threads, or 1: within a row; in the first and last
                         row; across rows */
    Row3 x[2], bent[2]; /* node rows j, j + 1 */
    Edges warp[2], weft[2]; /* of rows j, j + 1; from j - 1, from j */
    Row3 m1, m2[2];         /* [N] of the units at row j; at j - 1, j */
    Row3 low, high;         /* [N] cells on the weft edges left and right */
    Row3 sum;               /* [N] dE/dx of row j - 1, without the edges from it */
};

/* ---- set-up ---- */

static double *push_row(const ThreadRows *r, Arena *arena) {
    return arena_push(arena, double, r->stride + LANE_MARGIN) + LANE_MARGIN;
}

static Row3 push_row3(const ThreadRows *r, Arena *arena) {
    return (Row3){{push_row(r, arena), push_row(r, arena), push_row(r, arena)}};
}

static Edges push_edges(const ThreadRows *r, Arena *arena) {
    return (Edges){push_row3(r, arena), push_row3(r, arena), push_row3(r, arena),
                   push_row(r, arena), push_row(r, arena)};
}

static void push_rows(ThreadRows *r, Arena *arena) {
    for (int k = 0; k < 3; k++) {
        r->width[k] = push_row(r, arena);
    }
    for (int k = 0; k < 2; k++) {
        r->x[k] = push_row3(r, arena), r->bent[k] = push_row3(r, arena);
        r->warp[k] = push_edges(r, arena), r->weft[k] = push_edges(r, arena);
        r->m2[k] = push_row3(r, arena);
    }
    r->m1 = push_row3(r, arena);
    r->low = push_row3(r, arena), r->high = push_row3(r, arena);
    r->sum = push_row3(r, arena);
}

static Thread thread_of(const ThreadUnits *u, int axis, double stiffness) {
    const YarnCurve *c = &u->bend[axis];
    return (Thread){.h = u->spacing[axis],
                    .shortest = THREAD_SHORTEST * u->spacing[axis],
                    .stiffness = stiffness,
                    .area = u->cell_area,
                    .first = c->slope + 2.0 * c->step / c->onset,
                    .bend = c->step / (c->onset * c->onset),
                    .slope = c->slope,
                    .step = c->step,
                    .onset = c->onset,
                    .sharpest = sin(THREAD_SHARPEST_HALF),
                    .table = c->table};
}

ThreadRows *thread_rows_create(const Panel *p, const ThreadUnits *u, const double stiffness[2],
                               double twist, Arena *arena) {
    ThreadRows *r = arena_push(arena, ThreadRows, 1);
    const YarnCurve *shear = &u->trellis.force;
    *r = (ThreadRows){.nu = p->nu,
                      .nv = p->nv,
                      .stride = lanes_row_stride(p->nu + 1),
                      .wrap = p->wrap,
                      .sine = u->sine,
                      .trellis = u->trellis,
                      .cell_area = u->cell_area,
                      .shear_first = shear->slope + 2.0 * shear->step / shear->onset,
                      .shear_bend = shear->step / (shear->onset * shear->onset),
                      .measured = sin(u->trellis.measured),
                      .closed = sin(THREAD_CLOSED),
                      .closed_stiffen = thread_units_shear_stiffness(u, sin(THREAD_CLOSED)),
                      .twist = twist / u->cell_area};
    push_rows(r, arena);
    for (int axis = 0; axis < 2; axis++) {
        r->thread[axis] = thread_of(u, axis, stiffness[axis]);
    }
    for (int i = 0; i < r->stride; i++) {
        r->width[0][i] = 1.0, r->width[1][i] = 0.5;
        r->width[2][i] = !p->wrap && (i == 0 || i == p->nu - 1) ? 0.5 : 1.0;
    }
    return r;
}

/* ---- numbers ---- */

static inline Vec3 take(const Row3 *row, int i) {
    return vec3(row->c[0][i], row->c[1][i], row->c[2][i]);
}

static inline void put(const Row3 *row, int i, Vec3 a) {
    row->c[0][i] = a.x, row->c[1][i] = a.y, row->c[2][i] = a.z;
}

static inline void put_sum(const Row3 *row, int i, Vec3 a) {
    row->c[0][i] += a.x, row->c[1][i] += a.y, row->c[2][i] += a.z;
}

/* asin on 0 .. 1 within 2 units in the last place, by the rational fit of Sun's fdlibm (e_asin.c) */
INLINE static inline double arc_sine(double x) {
    double square = x * x, rest = 0.5 * (1.0 - x); /* asin x = pi/2 - 2 asin sqrt(rest) */
    double z = square < rest ? square : rest, s = sqrt(z);
    double p = 7.91534994289814532176e-04 + z * 3.47933107596021167570e-05;
    p = z * (1.66666666666666657415e-01 +
             z * (-3.25565818622400915405e-01 +
                  z * (2.01212532134862925881e-01 + z * (-4.00555345006794114027e-02 + z * p))));
    double q = -6.88283971605453293030e-01 + z * 7.70381505559019352791e-02;
    q = 1.0 + z * (-2.40339491173441421878e+00 + z * (2.02094576023350569471e+00 + z * q));
    double a = s + s * (p / q), other = 1.57079632679489661923 - 2.0 * a;
    return x < 0.5 ? a : other;
}

/* A M dK/dk / (h k): what kv is to be multiplied with */
INLINE static inline double bend_share(const Thread *t, bool sine_law, bool tabled, double k) {
    double sine = 0.5 * t->h * k, kept = sine < t->sharpest ? sine : t->sharpest;
    double dK = sine_law ? 1.0 : 1.0 / sqrt(1.0 - kept * kept);
    double K = sine_law ? k : 2.0 / t->h * (arc_sine(kept) + (sine - kept) * dK);
    double before = (t->first - t->bend * K) * K, beyond = t->step + t->slope * K, slope;
    double moment = tabled ? yarn_table_value(t->table, K, &slope) : K < t->onset ? before : beyond;
    return t->area * moment * dK / (t->h * (k + TINY));
}

/* dW/dS of a cell, S = |sin(phi)|; the curves of yarn.h */
INLINE static inline double cell_pull(const ThreadRows *r, bool tabled, double sine) {
    const TrellisCurve *c = &r->trellis;
    double s = sine < r->closed ? sine : r->closed, phi = arc_sine(s);
    double sticks = (r->shear_first - r->shear_bend * phi) * phi;
    double slips = c->force.step + c->force.slope * phi;
    double measured = phi < c->force.onset ? sticks : slips, slope;
    measured = tabled ? yarn_table_value(c->force.table, phi, &slope) : measured;
    double in = phi < c->from ? phi : c->from, d = in - c->measured;
    double closing = c->end[0] + c->last[1] * (phi - in) +
                     c->end[1] * (SHEAR_LOCK - c->measured) * d / (SHEAR_LOCK - in);
    double beyond = closing / sqrt(1.0 - s * s) + r->closed_stiffen * (sine - s);
    double first =
        sine <= r->measured ? 1.0 : 0.0; /* roots must not stand in branches of vector code */
    return first * measured + (1.0 - first) * beyond;
}

/* ---- rows ---- */

/* edges from `a` to `b` (slot i + shift), with the force of their springs */
QUADS static void find_edges(const ThreadRows *r, const Thread *thread, const Row3 *a,
                             const Row3 *b, int shift, const double *width, const Edges *edges) {
    const Thread t = *thread; /* copies: the loop does not write them */
    const Edges out = *edges;
    ROW_LOOP
    for (int i = 0; i < r->nu + 1; i++) {
        Vec3 e = vec3_sub(take(b, i + shift), take(a, i));
        double length = vec3_length(e), inverse = 1.0 / (length + TINY);
        bool straight = length >= t.shortest;
        put(&out.e, i, e);
        put(&out.g, i, vec3_scale(width[i] * t.stiffness * (length - t.h) * inverse, e));
        inverse = straight ? inverse : 1.0 / t.shortest;
        put(&out.t, i, vec3_scale(inverse, e));
        out.inverse[i] = inverse;
        out.straight[i] = straight ? 1.0 : 0.0;
    }
}

/* directions alone, of other places */
QUADS static void find_directions(const ThreadRows *r, const Thread *thread, const Row3 *a,
                                  const Row3 *b, int shift, const Edges *edges) {
    const Thread t = *thread;
    const Edges out = *edges;
    ROW_LOOP
    for (int i = 0; i < r->nu + 1; i++) {
        Vec3 e = vec3_sub(take(b, i + shift), take(a, i));
        double length = vec3_length(e), inverse = 1.0 / (length + TINY);
        bool straight = length >= t.shortest;
        inverse = straight ? inverse : 1.0 / t.shortest;
        put(&out.t, i, vec3_scale(inverse, e));
        out.inverse[i] = inverse;
        out.straight[i] = straight ? 1.0 : 0.0;
    }
}

INLINE static inline void moments(const ThreadRows *r, const Thread *t, bool sine_law, bool tabled,
                                  const Row3 *t1, const Row3 *t2, int shift, const double *width,
                                  const Row3 *m) {
    const Thread own = *t; /* which the loop does not write */
    double to_kv = 1.0 / own.h;
    ROW_LOOP
    for (int i = 0; i < r->nu + 1; i++) {
        Vec3 kv = vec3_scale(to_kv, vec3_sub(take(t2, i), take(t1, i + shift)));
        put(m, i, vec3_scale(width[i] * bend_share(&own, sine_law, tabled, vec3_length(kv)), kv));
    }
}

/* m of the units between edges t1[i + shift] and t2[i] */
QUADS static void find_moments(const ThreadRows *r, const Thread *t, const Row3 *t1, const Row3 *t2,
                               int shift, const double *width, const Row3 *m) {
    if (r->sine) {
        moments(r, t, true, false, t1, t2, shift, width, m);
    } else {
        moments(r, t, false, false, t1, t2, shift, width, m);
    }
}

QUADS static void find_table_moments(const ThreadRows *r, const Thread *t, const Row3 *t1,
                                     const Row3 *t2, int shift, const double *width,
                                     const Row3 *m) {
    moments(r, t, r->sine, true, t1, t2, shift, width, m);
}

typedef void Moments(const ThreadRows *r, const Thread *t, const Row3 *t1, const Row3 *t2,
                     int shift, const double *width, const Row3 *m);

static Moments *moments_of(const Thread *t) { return t->table ? find_table_moments : find_moments; }

/* g += P (m of the start - m of the end) */
QUADS static void add_moments(const ThreadRows *r, const Row3 *start, const Row3 *end, int shift,
                              const Edges *edges) {
    ROW_LOOP
    for (int i = 0; i < r->nu + 1; i++) {
        Vec3 m = vec3_sub(take(start, i), take(end, i + shift)), t = take(&edges->t, i);
        double along = edges->straight[i] * vec3_dot(m, t);
        put_sum(&edges->g, i, vec3_scale(edges->inverse[i], vec3_axpy(m, -along, t)));
    }
}

INLINE static inline void cells(const ThreadRows *r, bool tabled, const Edges *below,
                                const Edges *above, const Edges *sides) {
    const Row3 *low = &r->low, *high = &r->high;
    double shortest1 = r->thread[0].shortest, shortest2 = r->thread[1].shortest;
    double half_area = 0.5 * r->cell_area, twist = r->twist;
    ROW_LOOP
    for (int i = 0; i < r->nu; i++) {
        Vec3 left = take(&sides->e, i), right = take(&sides->e, i + 1);
        Vec3 f1 = vec3_scale(0.5, vec3_add(take(&below->e, i), take(&above->e, i)));
        Vec3 f2 = vec3_scale(0.5, vec3_add(left, right));
        double l1 = vec3_length(f1), l2 = vec3_length(f2);
        double inverse1 = 1.0 / (l1 < shortest1 ? shortest1 : l1);
        double inverse2 = 1.0 / (l2 < shortest2 ? shortest2 : l2);
        f1 = vec3_scale(inverse1, f1), f2 = vec3_scale(inverse2, f2);
        double s = vec3_dot(f1, f2), size = s < 0.0 ? -s : s;
        size = size < 1.0 ? size : 1.0;
        double pull = half_area * cell_pull(r, tabled, size);
        pull = s < 0.0 ? -pull : pull, s = s < 0.0 ? -size : size;
        Vec3 d1 = vec3_axpy(f2, l1 < shortest1 ? 0.0 : -s, f1);
        Vec3 d2 = vec3_axpy(f1, l2 < shortest2 ? 0.0 : -s, f2);
        d1 = vec3_scale(pull * inverse1, d1), d2 = vec3_scale(pull * inverse2, d2);
        Vec3 turn = vec3_scale(twist, vec3_sub(right, left));
        put_sum(&below->g, i, d1), put_sum(&above->g, i, d1);
        put(low, i, vec3_sub(d2, turn)), put(high, i, vec3_add(d2, turn));
    }
}

/* shear and twist of the cells between rows j and j + 1 */
QUADS static void find_cells(const ThreadRows *r, const Edges *below, const Edges *above,
                             const Edges *sides) {
    cells(r, false, below, above, sides);
}

QUADS static void find_table_cells(const ThreadRows *r, const Edges *below, const Edges *above,
                                   const Edges *sides) {
    cells(r, true, below, above, sides);
}

/* g += row[i + shift] */
QUADS static void add_row(const ThreadRows *r, const Row3 *row, int shift, const Row3 *g) {
    ROW_LOOP
    for (int i = 0; i < r->nu; i++) {
        put_sum(g, i, take(row, i + shift));
    }
}

/* sum = edges that end here - edges that start here, along the row */
QUADS static void sum_row(const ThreadRows *r, const Row3 *g, const Row3 *sum) {
    ROW_LOOP
    for (int i = 0; i < r->nu; i++) {
        put(sum, i, vec3_sub(take(g, i - 1), take(g, i)));
    }
}

/* what stands before the first and behind the last of `count` */
static void close_row(const ThreadRows *r, const Row3 *row, int count) {
    for (int c = 0; c < 3; c++) {
        double *at = row->c[c];
        at[-1] = r->wrap ? at[count - 1] : 0.0;
        at[count] = r->wrap ? at[0] : 0.0;
    }
}

static void clear(const ThreadRows *r, const Row3 *row) {
    for (int c = 0; c < 3; c++) {
        memset(row->c[c], 0, (size_t)r->stride * sizeof(double));
    }
}

static void load_row(const ThreadRows *r, const double *x, int j, const Row3 *row) {
    const double *from = x + 3 * (size_t)j * (size_t)r->nu;
    for (int i = 0; i < r->nu; i++) {
        row->c[0][i] = from[3 * i], row->c[1][i] = from[3 * i + 1], row->c[2][i] = from[3 * i + 2];
    }
    close_row(r, row, r->nu);
}

/* gradient += sum - g */
static void store_row(const ThreadRows *r, const Row3 *sum, const Row3 *g, int j,
                      double *gradient) {
    double *to = gradient + 3 * (size_t)j * (size_t)r->nu;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < r->nu; i++) {
            to[3 * i + c] += sum->c[c][i] - g->c[c][i];
        }
    }
}

/* ---- the pass over the rows ---- */

static const double *row_width(const ThreadRows *r, int j) {
    return r->width[j == 0 || j == r->nv - 1];
}

/* edges, springs; then the directions of bent threads where these are elsewhere */
static void find_warp(const ThreadRows *r, const double *x, const double *bent, int j) {
    const Row3 *at = &r->x[j % 2], *bent_at = &r->bent[j % 2];
    load_row(r, x, j, at);
    find_edges(r, &r->thread[0], at, at, 1, row_width(r, j), &r->warp[j % 2]);
    if (bent != x) {
        load_row(r, bent, j, bent_at);
        find_directions(r, &r->thread[0], bent_at, bent_at, 1, &r->warp[j % 2]);
    }
}

/* all between rows j and j + 1 but the bends of weft */
static void find_band(const ThreadRows *r, bool damped, int j) {
    const Edges *below = &r->warp[j % 2], *above = &r->warp[(j + 1) % 2], *sides = &r->weft[j % 2];
    find_edges(r, &r->thread[1], &r->x[j % 2], &r->x[(j + 1) % 2], 0, r->width[2], sides);
    if (damped) {
        find_directions(r, &r->thread[1], &r->bent[j % 2], &r->bent[(j + 1) % 2], 0, sides);
    }
    (r->trellis.force.table ? find_table_cells : find_cells)(r, below, above, sides);
    int cells = r->wrap ? r->nu : r->nu - 1;
    close_row(r, &r->low, cells), close_row(r, &r->high, cells);
    add_row(r, &r->low, 0, &sides->g);
    add_row(r, &r->high, -1, &sides->g);
}

/* finishes the edges along row j */
static void bend_warp(const ThreadRows *r, int j) {
    const Edges *edges = &r->warp[j % 2];
    const Row3 *m = &r->m1;
    close_row(r, &edges->t, r->wrap ? r->nu : r->nu - 1);
    moments_of (&r->thread[0])(r, &r->thread[0], &edges->t, &edges->t, -1, row_width(r, j), m);
    for (int c = 0; c < 3 && !r->wrap; c++) {
        m->c[c][0] = m->c[c][r->nu - 1] = 0.0;
    }
    close_row(r, m, r->nu);
    add_moments(r, m, m, 1, edges);
    close_row(r, &edges->g, r->wrap ? r->nu : r->nu - 1);
}

/* finishes the edges from row j - 1 to row j */
static void bend_weft(const ThreadRows *r, int j) {
    const Edges *before = &r->weft[(j + 1) % 2], *now = &r->weft[j % 2];
    const Row3 *m = &r->m2[j % 2];
    if (j > 0 && j + 1 < r->nv) {
        moments_of (&r->thread[1])(r, &r->thread[1], &before->t, &now->t, 0, r->width[2], m);
    } else {
        clear(r, m);
    }
    if (j > 0) {
        add_moments(r, &r->m2[(j + 1) % 2], m, 0, before);
    } else {
        clear(r, &before->g);
    }
}

void thread_rows_add_gradient(const ThreadRows *r, const double *x, const double *bent,
                              double *gradient) {
    find_warp(r, x, bent, 0);
    for (int j = 0; j < r->nv; j++) {
        if (j + 1 < r->nv) {
            find_warp(r, x, bent, j + 1);
            find_band(r, bent != x, j);
        }
        bend_warp(r, j);
        bend_weft(r, j);
        const Row3 *g = &r->weft[(j + 1) % 2].g;
        if (j > 0) {
            store_row(r, &r->sum, g, j - 1, gradient);
        }
        sum_row(r, &r->warp[j % 2].g, &r->sum);
        add_row(r, g, 0, &r->sum);
    }
    const Row3 *none = &r->m2[(r->nv - 1) % 2]; /* no unit bends at the last row */
    store_row(r, &r->sum, none, r->nv - 1, gradient);
}
