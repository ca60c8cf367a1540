#include "sim/solve/newton.h"

#include <math.h>
#include <string.h>

/* share of the mean diagonal added when a positive semidefinite tangent still fails; x 10 each */
#define SHIFT_FIRST 1e-6
#define SHIFT_TRIES 6

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
static bool factorise(const NewtonProblem *p, const double *x, const unsigned char *fixed_in_order,
                      NewtonReport *report) {
    for (int attempt = 0; attempt < 2 + SHIFT_TRIES; attempt++) {
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

static NewtonStatus iterate(const NewtonProblem *p, const NewtonParams *params, double *x,
                            double *gradient, double *dx, const unsigned char *fixed_in_order,
                            NewtonReport *report) {
    for (report->iterations = 0;; report->iterations++) {
        p->gradient(p->context, x, gradient);
        report->residual = free_norm(p, gradient);
        if (report->residual <= params->tolerance && report->iterations >= params->min_iterations) {
            return NEWTON_CONVERGED;
        }
        if (report->iterations >= params->max_iterations) {
            return isfinite(report->residual) ? NEWTON_STOPPED : NEWTON_DIVERGED;
        }
        if (!factorise(p, x, fixed_in_order, report)) {
            return NEWTON_SINGULAR;
        }
        for (int i = 0; i < 3 * p->node_count; i++) {
            gradient[i] = -gradient[i];
        }
        factor_solve(p->factor, p->matrix, gradient, dx);
        if (!cap_step(p, params->longest_move, dx)) {
            return NEWTON_DIVERGED;
        }
        if (p->limit_step) {
            p->limit_step(p->context, x, dx);
        }
        for (int i = 0; i < 3 * p->node_count; i++) {
            x[i] += dx[i];
        }
        p->keep_stress(p->context, x, params->plain ? NULL : dx);
    }
}

NewtonReport newton_solve(const NewtonProblem *p, const NewtonParams *params,
                          const double *first_dx, double *x, Arena *scratch) {
    ArenaMark mark = arena_mark(scratch);
    NewtonReport report = {0};
    double *gradient = arena_push(scratch, double, 3 * p->node_count);
    double *dx = arena_push(scratch, double, 3 * p->node_count);
    unsigned char *fixed_in_order = arena_push(scratch, unsigned char, p->node_count);
    for (int i = 0; i < p->node_count; i++) {
        fixed_in_order[p->matrix->order[i]] = p->fixed[i];
    }
    p->keep_stress(p->context, x, params->plain ? NULL : first_dx);
    report.status = iterate(p, params, x, gradient, dx, fixed_in_order, &report);
    arena_rewind(scratch, mark);
    return report;
}
