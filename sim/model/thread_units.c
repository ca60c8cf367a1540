#include "sim/model/thread_units.h"

#include <math.h>
#include <string.h>

#define SMALLEST_TURN 1e-9 /* [rad] below it a unit is flat */

/* ---- bend ---- */

typedef struct Bend {
    Vec3 t[2];         /* directions of both segments */
    double inverse[2]; /* [1/m] 1 / their lengths */
    bool short_one[2]; /* t is no unit vector */
    Vec3 kv;           /* [1/m] (t+ - t-)/s */
    double k, K;       /* [1/m] |kv|, the curvature that counts */
    double dK, d2K;    /* derivatives of K by k */
} Bend;

static void bend_of(const ThreadUnits *u, const BendUnit *unit, const double *x, Bend *b) {
    Vec3 a = vec3_load(x + 3 * unit->node[0]), c = vec3_load(x + 3 * unit->node[2]);
    Vec3 middle = vec3_load(x + 3 * unit->node[1]);
    Vec3 edge[2] = {vec3_sub(middle, a), vec3_sub(c, middle)};
    for (int e = 0; e < 2; e++) {
        /* a wall has half the length of a thread's unit */
        double length = vec3_length(edge[e]);
        double shortest = THREAD_SHORTEST * u->spacing[unit->axis];
        b->short_one[e] = length < shortest;
        b->inverse[e] = 1.0 / fmax(length, shortest);
        b->t[e] = vec3_scale(b->inverse[e], edge[e]);
    }
    double s = unit->length;
    b->kv = vec3_scale(1.0 / s, vec3_sub(b->t[1], b->t[0]));
    b->k = vec3_length(b->kv);
    b->K = b->k, b->dK = 1.0, b->d2K = 0.0;
    if (u->sine) {
        return;
    }
    double sine = 0.5 * s * b->k, most = sin(THREAD_SHARPEST_HALF),
           kept = sine < most ? sine : most;
    b->dK = 1.0 / sqrt(1.0 - kept * kept); /* 1 / cos(psi/2) */
    b->K = 2.0 / s * (asin(kept) + (sine - kept) * b->dK);
    b->d2K = sine < most ? 0.5 * s * sine * b->dK * b->dK * b->dK : 0.0;
}

/* (I - t t') m / length */
static Vec3 across(const Bend *b, int e, Vec3 m) {
    if (b->short_one[e]) {
        return vec3_scale(b->inverse[e], m);
    }
    return vec3_scale(b->inverse[e], vec3_axpy(m, -vec3_dot(m, b->t[e]), b->t[e]));
}

static void add_to(double *gradient, int node, Vec3 g) {
    double *at = gradient + 3 * (size_t)node;
    at[0] += g.x, at[1] += g.y, at[2] += g.z;
}

static void add_bend_gradient(const ThreadUnits *u, const BendUnit *unit, const double *x,
                              double *gradient) {
    Bend b;
    bend_of(u, unit, x, &b);
    if (b.k * unit->length < SMALLEST_TURN) {
        return;
    }
    double moment = yarn_value(&u->bend[unit->axis], b.K, NULL);
    double share = unit->area * moment * b.dK / (unit->length * b.k);
    Vec3 m = vec3_scale(share, b.kv), first = across(&b, 0, m), second = across(&b, 1, m);
    add_to(gradient, unit->node[0], first);
    add_to(gradient, unit->node[1], vec3_scale(-1.0, vec3_add(first, second)));
    add_to(gradient, unit->node[2], second);
}

/* d kv / d node, times s */
static void bend_rows(const Bend *b, double j[3][3][3]) {
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            double p[2];
            for (int e = 0; e < 2; e++) {
                const double t[3] = {b->t[e].x, b->t[e].y, b->t[e].z};
                double along = b->short_one[e] ? 0.0 : t[r] * t[c];
                p[e] = b->inverse[e] * ((r == c) - along);
            }
            j[0][r][c] = p[0], j[1][r][c] = -(p[0] + p[1]), j[2][r][c] = p[1];
        }
    }
}

/* A w [ (M' K'^2 + M K'') n n' + M K'/k (I - n n') ] / s^2 in kv */
static void bend_stiffness(const ThreadUnits *u, const BendUnit *unit, const Bend *b,
                           double c[3][3]) {
    double slope, moment = yarn_value(&u->bend[unit->axis], b->K, &slope);
    bool flat = b->k * unit->length < SMALLEST_TURN;
    double along = slope * b->dK * b->dK + moment * b->d2K;
    double aside = flat ? along : moment * b->dK / b->k;
    double scale = unit->area / (unit->length * unit->length);
    Vec3 n = flat ? vec3(0, 0, 0) : vec3_scale(1.0 / b->k, b->kv);
    const double d[3] = {n.x, n.y, n.z};
    for (int r = 0; r < 3; r++) {
        for (int s = 0; s < 3; s++) {
            c[r][s] = scale * ((r == s ? aside : 0.0) + (along - aside) * d[r] * d[s]);
        }
    }
}

static void add_bend_hessian(const ThreadUnits *u, const BendUnit *unit, const BlockPlace *places,
                             const double *x, double *values) {
    Bend b;
    double j[3][3][3], c[3][3];
    bend_of(u, unit, x, &b);
    bend_rows(&b, j);
    bend_stiffness(u, unit, &b, c);
    for (int p = 0, place = 0; p < 3; p++) {
        double half[3][3] = {{0}}; /* j_p' c */
        for (int k = 0; k < 27; k++) {
            int row = k / 9, column = k / 3 % 3, i = k % 3;
            half[row][column] += j[p][i][row] * c[i][column];
        }
        for (int q = 0; q <= p; q++, place++) {
            double block[9] = {0};
            for (int k = 0; k < 27; k++) {
                int row = k / 9, column = k / 3 % 3, i = k % 3;
                block[3 * row + column] += half[row][i] * j[q][i][column];
            }
            if (places[place].base >= 0) {
                block_add(values, places[place], block);
            }
        }
    }
}

/* ---- trellis ---- */

typedef struct Cell {
    double sine; /* S */
    Vec3 d[2];   /* [1/m] dS/dF1, dS/dF2 */
} Cell;

/* [N/m] W, dW/dS, d2W/dS2 at |S| */
typedef struct CellWork {
    double work, pull, stiffen;
} CellWork;

static const double cell_sign[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}};

/* W and its derivatives by S = sin(phi); quadratic beyond THREAD_CLOSED, as 1/cos(phi) has no bound */
static CellWork find_work(const TrellisCurve *curve, double sine) {
    double most = sin(THREAD_CLOSED), over = sine > most ? sine - most : 0.0, s = sine - over;
    double phi = asin(s), c = sqrt(1.0 - s * s), slope, tau = trellis_moment(curve, phi, &slope);
    CellWork w = {.stiffen = fmax(slope, 0.0) / (c * c) + tau * s / (c * c * c)};
    w.pull = tau / c + w.stiffen * over;
    w.work = trellis_work(curve, phi) + (tau / c + 0.5 * w.stiffen * over) * over;
    return w;
}

double thread_units_shear_stiffness(const ThreadUnits *u, double sine) {
    return find_work(&u->trellis, sine).stiffen;
}

static void cell_of(const ThreadUnits *u, const int *nodes, const double *x, Cell *cell) {
    Vec3 f[2] = {{0, 0, 0}, {0, 0, 0}};
    double length[2];
    bool short_one[2];
    for (int axis = 0; axis < 2; axis++) {
        for (int k = 0; k < 4; k++) {
            f[axis] = vec3_axpy(f[axis], cell_sign[k][axis], vec3_load(x + 3 * nodes[k]));
        }
        double size = vec3_length(f[axis]), shortest = THREAD_SHORTEST * u->spacing[axis];
        short_one[axis] = size < shortest;
        length[axis] = fmax(size, shortest);
        f[axis] = vec3_scale(1.0 / length[axis], f[axis]);
    }
    double s = cell->sine = fmax(-1.0, fmin(vec3_dot(f[0], f[1]), 1.0));
    for (int axis = 0; axis < 2; axis++) {
        double along = short_one[axis] ? 0.0 : s;
        cell->d[axis] = vec3_scale(1.0 / length[axis], vec3_axpy(f[1 - axis], -along, f[axis]));
    }
}

/* dS / d node k */
static Vec3 cell_row(const Cell *cell, int k) {
    return vec3_axpy(vec3_scale(cell_sign[k][0], cell->d[0]), cell_sign[k][1], cell->d[1]);
}

static void add_cell_hessian(const ThreadUnits *u, const int *nodes, const BlockPlace *places,
                             const double *x, double *values) {
    Cell cell;
    cell_of(u, nodes, x, &cell);
    double stiffness = u->cell_area * find_work(&u->trellis, fabs(cell.sine)).stiffen;
    for (int p = 0, place = 0; p < 4; p++) {
        Vec3 a = cell_row(&cell, p);
        const double left[3] = {a.x, a.y, a.z};
        for (int q = 0; q <= p; q++, place++) {
            Vec3 b = cell_row(&cell, q);
            const double right[3] = {b.x, b.y, b.z};
            double block[9];
            for (int k = 0; k < 9; k++) {
                block[k] = stiffness * left[k / 3] * right[k % 3];
            }
            block_add(values, places[place], block);
        }
    }
}

/* ---- all ---- */

double thread_units_energy(const ThreadUnits *u, const double *x) {
    double energy = 0.0;
    for (int i = 0; i < u->bend_count; i++) {
        const BendUnit *unit = &u->bends[i];
        Bend b;
        bend_of(u, unit, x, &b);
        energy += unit->area * yarn_work(&u->bend[unit->axis], b.K);
    }
    for (int i = 0; i < u->cell_count; i++) {
        Cell cell;
        cell_of(u, u->cells[i], x, &cell);
        energy += u->cell_area * find_work(&u->trellis, fabs(cell.sine)).work;
    }
    return energy;
}

void thread_units_add_wall_gradient(const ThreadUnits *u, const double *x, double *gradient) {
    for (int i = u->wall_begin; i < u->bend_count; i++) {
        add_bend_gradient(u, &u->bends[i], x, gradient);
    }
}

void thread_units_add_hessian(const ThreadUnits *u, const double *x, double *values) {
    for (int i = 0; i < u->bend_count; i++) {
        add_bend_hessian(u, &u->bends[i], u->bend_places[i], x, values);
    }
    for (int i = 0; i < u->cell_count; i++) {
        add_cell_hessian(u, u->cells[i], u->cell_places[i], x, values);
    }
}

int thread_units_couple(const ThreadUnits *u, int *pairs) {
    int count = 0;
    for (int i = 0; i < u->bend_count; i++) {
        count += block_pairs(u->bends[i].node, 3, u->node_limit, pairs ? pairs + 2 * count : NULL);
    }
    for (int i = 0; i < u->cell_count; i++) {
        count += block_pairs(u->cells[i], 4, u->node_limit, pairs ? pairs + 2 * count : NULL);
    }
    return count;
}

void thread_units_bind(ThreadUnits *u, const BlockMatrix *matrix, int first, Arena *arena) {
    u->bend_places =
        (BlockPlace(*)[6])arena_alloc(arena, sizeof(BlockPlace[6]) * (size_t)u->bend_count);
    u->cell_places =
        (BlockPlace(*)[10])arena_alloc(arena, sizeof(BlockPlace[10]) * (size_t)u->cell_count);
    for (int i = 0; i < u->bend_count; i++) {
        block_places(matrix, u->bends[i].node, 3, u->node_limit, first, u->bend_places[i]);
    }
    for (int i = 0; i < u->cell_count; i++) {
        block_places(matrix, u->cells[i], 4, u->node_limit, first, u->cell_places[i]);
    }
}
