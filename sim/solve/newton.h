/* newton.h: mixed-point Newton for energies whose strains are quadratic in the unknowns.
 *
 * Newton on the mixed (stress, displacement) equations with the stresses eliminated: the
 * geometric stiffness is taken from the stress that the last linear step predicted, not from
 * the stress at the new point. The energy may rise on the way, unless steps are `cut`. On stiff cloth it
 * needs 5 to 15 factorisations where plain Newton needs hundreds (Magisano, Leonetti,
 * Garcea 2017).
 *
 * This file knows unknowns, not cloth: the problem is a set of callbacks.
 */
#ifndef TOILE_SOLVE_NEWTON_H
#define TOILE_SOLVE_NEWTON_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/solve/factor.h"

typedef struct NewtonProblem {
    void *context;
    int node_count;
    const unsigned char *fixed; /* (node_count) 1: not moved */
    BlockMatrix *matrix;
    Factor *factor;
    /* gradient of the objective at x; (node_count x 3) */
    void (*gradient)(void *context, const double *x, double *gradient);
    /* fills matrix->values at x with the kept stress; `definite`: positive semidefinite parts */
    void (*tangent)(void *context, const double *x, bool definite);
    /* keeps the stress at x (dx NULL) or the one predicted for x by the step dx */
    void (*keep_stress)(void *context, const double *x, const double *dx);
    /* changes the step where it would leave what is allowed (contact) and returns the smallest
     * share of it that was left; NULL: never */
    double (*limit_step)(void *context, const double *x, double *dx);
    /* y += what the tangent leaves out for the sake of its pattern, times p: then the step is found
     * by conjugate gradients with the factor as preconditioner. False: nothing. NULL: never */
    bool (*add_left_out)(void *context, const double *p, double *y);
    /* objective at x, without what has no potential (friction); for `descend` */
    double (*energy)(void *context, const double *x);
} NewtonProblem;

typedef struct NewtonParams {
    int max_iterations;  /* 16 */
    int min_iterations;  /* 1 */
    double tolerance;    /* [N] largest |gradient|_2 accepted; no usual value: 1e-6 weight */
    double longest_move; /* [m] of any node in one iteration; INFINITY */
    double short_move;   /* [m] no node moved farther in an iteration: converged; 0 */
    double least_share;  /* ... if limit_step left at least so much of it; 0 */
    bool definite;       /* positive semidefinite tangents from the start; false */
    bool plain;          /* ordinary Newton: stress at the new point; false */
    bool cut;     /* ends a step where the force along it vanishes, if it turned round and the
                            residual rose: for forces with kinks, as friction is; false */
    bool descend; /* halves a step until the energy does not rise, else ends where it is: safe
                            and slow; false */
} NewtonParams;

typedef enum NewtonStatus {
    NEWTON_CONVERGED,
    NEWTON_STOPPED,  /* max_iterations reached, everything finite */
    NEWTON_DIVERGED, /* a number is no longer finite: x is as before the last iteration */
    NEWTON_SINGULAR  /* no factorisation even with a shifted diagonal */
} NewtonStatus;

typedef struct NewtonReport {
    NewtonStatus status;
    int iterations, factorisations;
    double residual; /* [N] |gradient|_2 over free nodes at the end */
} NewtonReport;

NewtonParams newton_default(void);

/* Improves x in place. `first_dx`: the step that led to x (its stress is predicted), or NULL. */
NewtonReport newton_solve(const NewtonProblem *problem, const NewtonParams *params,
                          const double *first_dx, double *x, Arena *scratch);

#endif
