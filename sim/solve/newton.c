#include "sim/solve/newton.h"

#include <math.h>
#include <string.h>

/* share of the mean diagonal added when a positive semidefinite tangent still fails; x 10 each */
#define SHIFT_FIRST 1e-6
#define SHIFT_TRIES 6
/* conjugate gradients: error left in the norm of the preconditioner, and most rounds */
#define LEFT_OUT_TOLERANCE 1e-2
#define LEFT_OUT_ITERATIONS 60
/* a step is shortened when the force along it has turned round to more than this share of what it
 * was; 0.1 asks for more gradients, 0.9 for more iterations */
#define TURNED_SHARE 0.5
#define SHORTEST_CUT 0.1
#define LONGEST_CUT 0.8
#define CUT_TRIES 8
#define DESCENT_TRIES 12 /* halvings of a step that must lower the energy */

NewtonParams newton_default(void) {
    return (NewtonParams){.max_iterations = 16, .min_iterations = 1, .longest_move = INFINITY};
}

static double free_norm(const NewtonProblem *p, double *gradient) {
    double sum = 0.0;
    for (int i = 0; i < p->node_count; i++) {
        for (int c = 0; c < 3; c++) {
            double *g = &gradient[3 * i + c];
            *g = p->fixed[i] ? 0.0 : *g;
            sum += *g * *g;
        }
    }
    return sqrt(sum);
}

/* rows and columns of fixed nodes become those of the unit matrix times the mean diagonal */
static double fix_nodes(const NewtonProblem *p, const unsigned char *fixed_in_order) {
    BlockMatrix *m = p->matrix;
    double trace = 0.0;
    for (int j = 0; j < m->node_count; j++) {
        for (int c = 0; c < 3; c++) {
            trace += m->values[m->scalar_start[3 * j + c] + c];
        }
    }
    double mean = trace / (3.0 * m->node_count);
    for (int j = 0; j < m->node_count; j++) {
        int length = 3 * (m->column_start[j + 1] - m->column_start[j]);
        for (int k = m->column_start[j]; k < m->column_start[j + 1]; k++) {
            if (!fixed_in_order[j] && !fixed_in_order[m->row[k]]) {
                continue;
            }
            double *block = m->values + m->scalar_start[3 * j] + 3 * (k - m->column_start[j]);
            for (int c = 0; c < 3; c++) {
                for (int r = 0; r < 3; r++) {
                    block[c * length + r] = m->row[k] == j && r == c ? mean : 0.0;
                }
            }
        }
    }
    return mean;
}

static void add_shift(BlockMatrix *m, double shift) {
    for (int j = 0; j < m->node_count; j++) {
        for (int c = 0; c < 3; c++) {
            m->values[m->scalar_start[3 * j + c] + c] += shift;
        }
    }
}

/* exact tangent, then its positive semidefinite part, then shifts of the diagonal */
static bool factorise(const NewtonProblem *p, bool definite, const double *x,
                      const unsigned char *fixed_in_order, NewtonReport *report) {
    for (int attempt = definite; attempt < 2 + SHIFT_TRIES; attempt++) {
        p->tangent(p->context, x, attempt > 0);
        double mean = fix_nodes(p, fixed_in_order);
        if (attempt > 1) {
            add_shift(p->matrix, mean * SHIFT_FIRST * pow(10.0, attempt - 2));
        }
        report->factorisations++;
        if (factor_numeric(p->factor, p->matrix) == FACTOR_OK) {
            return true;
        }
    }
    return false;
}

static double dot(const double *a, const double *b, int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* y = tangent x with what it leaves out; fixed nodes stay out */
static void apply(const NewtonProblem *p, const double *x, double *y) {
    block_matrix_multiply(p->matrix, x, y);
    p->add_left_out(p->context, x, y);
    for (int i = 0; i < 3 * p->node_count; i++) {
        y[i] = p->fixed[i / 3] ? 0.0 : y[i];
    }
}

/* dx from right = -gradient */
static void solve(const NewtonProblem *p, double *right, double *dx, Arena *scratch) {
    int n = 3 * p->node_count;
    factor_solve(p->factor, p->matrix, right, dx);
    ArenaMark mark = arena_mark(scratch);
    double *y = arena_push(scratch, double, n), *z = arena_push(scratch, double, n);
    if (!p->add_left_out || !p->add_left_out(p->context, dx, y)) {
        arena_rewind(scratch, mark);
        return;
    }
    double *along = arena_push(scratch, double, n);
    double start = dot(right, dx, n), before = 0.0;
    apply(p, dx, y);
    for (int i = 0; i < n; i++) {
        right[i] = p->fixed[i / 3] ? 0.0 : right[i] - y[i];
    }
    for (int k = 0; k < LEFT_OUT_ITERATIONS; k++) {
        factor_solve(p->factor, p->matrix, right, z);
        double now = dot(right, z, n);
        if (!(now > LEFT_OUT_TOLERANCE * LEFT_OUT_TOLERANCE * start)) {
            break;
        }
        for (int i = 0; i < n; i++) {
            along[i] = z[i] + (k > 0 ? now / before : 0.0) * along[i];
        }
        apply(p, along, y);
        double step = now / dot(along, y, n);
        for (int i = 0; i < n; i++) {
            dx[i] += step * along[i];
            right[i] -= step * y[i];
        }
        before = now;
    }
    arena_rewind(scratch, mark);
}

/* false when the step is not finite */
static bool cap_step(const NewtonProblem *p, double longest_move, double *dx) {
    double longest = 0.0;
    for (int i = 0; i < p->node_count; i++) {
        double *d = dx + 3 * i;
        if (p->fixed[i]) {
            d[0] = d[1] = d[2] = 0.0;
        }
        double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (!isfinite(square)) {
            return false;
        }
        longest = fmax(longest, square);
    }
    longest = sqrt(longest);
    for (int i = 0; longest > longest_move && i < 3 * p->node_count; i++) {
        dx[i] *= longest_move / longest;
    }
    return true;
}

/* The last step dx led to x, where the gradient is known; `slope` was the derivative along dx at its
 * start. Where that derivative has turned round the step ends where it vanishes, by regula falsi.
 * A step only gets shorter, so that it stays allowed. */
static bool cut_step(const NewtonProblem *p, double slope, double *x, double *dx, double *gradient,
                     NewtonReport *report) {
    int n = 3 * p->node_count;
    bool cut = false;
    for (int k = 0; k < CUT_TRIES; k++) {
        double turned = dot(gradient, dx, n);
        if (!(slope < 0.0 && turned > -TURNED_SHARE * slope)) {
            break;
        }
        cut = true;
        double share = fmin(fmax(slope / (slope - turned), SHORTEST_CUT), LONGEST_CUT);
        for (int i = 0; i < n; i++) {
            x[i] -= (1.0 - share) * dx[i];
            dx[i] *= share;
        }
        slope *= share;
        p->gradient(p->context, x, gradient);
        report->residual = free_norm(p, gradient);
    }
    return cut;
}

/* x += dx, halved until the energy does not rise; false: it does, and x stays */
static bool descend(const NewtonProblem *p, double *x, double *dx) {
    int n = 3 * p->node_count;
    double before = p->energy(p->context, x);
    for (int k = 0; k < DESCENT_TRIES; k++) {
        for (int i = 0; i < n; i++) {
            x[i] += dx[i];
        }
        if (p->energy(p->context, x) <= before) {
            return true;
        }
        for (int i = 0; i < n; i++) {
            x[i] -= dx[i];
            dx[i] *= 0.5;
        }
    }
    return false;
}

static double longest_of(const double *dx, int node_count) {
    double longest = 0.0;
    for (int i = 0; i < node_count; i++) {
        longest = fmax(longest, dot(dx + 3 * (size_t)i, dx + 3 * (size_t)i, 3));
    }
    return sqrt(longest);
}

typedef struct Work {
    double *gradient, *right, *dx; /* (node_count x 3) */
    unsigned char *fixed_in_order; /* (node_count) */
    Arena *scratch;
} Work;

static bool is_done(const NewtonParams *params, const NewtonReport *report, double moved,
                    double share) {
    if (report->iterations < params->min_iterations || !isfinite(report->residual)) {
        return false;
    }
    return report->residual <= params->tolerance ||
           (moved <= params->short_move && share >= params->least_share);
}

static NewtonStatus iterate(const NewtonProblem *p, const NewtonParams *params, double *x,
                            const Work *w, NewtonReport *report) {
    double moved = INFINITY, share = 1.0, slope = 0.0, before = 0.0;
    int n = 3 * p->node_count;
    for (report->iterations = 0;; report->iterations++) {
        p->gradient(p->context, x, w->gradient);
        report->residual = free_norm(p, w->gradient);
        if (params->cut && report->residual > before &&
            cut_step(p, slope, x, w->dx, w->gradient, report)) {
            p->keep_stress(p->context, x, params->plain ? NULL : w->dx);
        }
        if (is_done(params, report, moved, share)) {
            return NEWTON_CONVERGED;
        }
        if (report->iterations >= params->max_iterations) {
            return isfinite(report->residual) ? NEWTON_STOPPED : NEWTON_DIVERGED;
        }
        if (!factorise(p, params->definite, x, w->fixed_in_order, report)) {
            return NEWTON_SINGULAR;
        }
        for (int i = 0; i < n; i++) {
            w->right[i] = -w->gradient[i];
        }
        solve(p, w->right, w->dx, w->scratch);
        if (!cap_step(p, params->longest_move, w->dx)) {
            return NEWTON_DIVERGED;
        }
        moved = longest_of(w->dx, p->node_count);
        share = p->limit_step ? p->limit_step(p->context, x, w->dx) : 1.0;
        slope = dot(w->gradient, w->dx, n);
        before = report->residual;
        if (params->descend) {
            if (!descend(p, x, w->dx)) {
                return NEWTON_STOPPED;
            }
        } else {
            for (int i = 0; i < n; i++) {
                x[i] += w->dx[i];
            }
        }
        p->keep_stress(p->context, x, params->plain ? NULL : w->dx);
    }
}

NewtonReport newton_solve(const NewtonProblem *p, const NewtonParams *params,
                          const double *first_dx, double *x, Arena *scratch) {
    ArenaMark mark = arena_mark(scratch);
    NewtonReport report = {0};
    int n = 3 * p->node_count;
    Work work = {.gradient = arena_push(scratch, double, n),
                 .right = arena_push(scratch, double, n),
                 .dx = arena_push(scratch, double, n),
                 .fixed_in_order = arena_push(scratch, unsigned char, p->node_count),
                 .scratch = scratch};
    for (int i = 0; i < p->node_count; i++) {
        work.fixed_in_order[p->matrix->order[i]] = p->fixed[i];
    }
    p->keep_stress(p->context, x, params->plain ? NULL : first_dx);
    report.status = iterate(p, params, x, &work, &report);
    arena_rewind(scratch, mark);
    return report;
}
