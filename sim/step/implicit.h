/* implicit.h: one implicit problem for all implicit steppers:
 *
 *   minimise over the free nodes   a/2 |x - x_hat|_M^2 + W(x) - f.x + damping + contact,
 *
 * with a = 1/dt^2 (backward Euler), 9/(4 dt^2) (BDF2), 0 (static); solved by mixed-point Newton.
 * Held places and ghosts are prescribed. */
#ifndef TOILE_STEP_IMPLICIT_H
#define TOILE_STEP_IMPLICIT_H

#include "sim/solve/newton.h"
#include "sim/step/system.h"

typedef struct Implicit Implicit;

/* The time discretisation of one step: acceleration a (x - x_hat), velocity c x + v_hat. */
typedef struct ImplicitTerms {
    double acceleration; /* [1/s2] a */
    const double *x_hat; /* [m] (place_count x 3), unused when a = 0 */
    double velocity;     /* [1/s] c */
    const double *v_hat; /* [m/s] (place_count x 3), unused when c = 0 */
} ImplicitTerms;

/* Makes pattern, order and symbolic factorisation. */
Implicit *implicit_create(const System *system);
void implicit_destroy(Implicit *implicit);

/* Solves for x from the start value in x; `first_dx`: see newton_solve. held: (place_count);
 * start: the state at the start of the step, for contact and friction. */
NewtonReport implicit_solve(Implicit *implicit, const ImplicitTerms *terms,
                            const unsigned char *held, const State *start,
                            const NewtonParams *params, const double *first_dx, double *x);

/* [N] |gradient|_2 of the static problem over free places, at x. */
double implicit_residual(Implicit *implicit, const unsigned char *held, const State *start,
                         const double *x);

/* What the friction memory becomes when x is accepted; `state` may be the start of the step. */
void implicit_store_bristles(Implicit *implicit, const double *x, State *state);

double implicit_factor_bytes(const Implicit *implicit); /* [byte] */
double implicit_nonzeros(const Implicit *implicit);     /* of the factor */
/* The pieces of one iteration, for benchmarks: each runs once at x. */
NewtonProblem implicit_problem(Implicit *implicit, const ImplicitTerms *terms,
                               const unsigned char *held, const State *start);

#endif
