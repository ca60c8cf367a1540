/* implicit.h: one implicit problem for all implicit steppers:
 *
 *   minimise over the free nodes   a/2 |x - x_hat|_M^2 + W(x) - f.x + damping + contact,
 *
 * with a = 1/dt^2 (backward Euler), 9/(4 dt^2) (BDF2), 0 (static); solved by mixed-point Newton.
 * Held places and ghosts are prescribed. */
#ifndef TOILE_STEP_IMPLICIT_H
#define TOILE_STEP_IMPLICIT_H

#include "sim/contact/barrier.h"
#include "sim/solve/newton.h"
#include "sim/step/system.h"

typedef struct Implicit Implicit;

/* The time discretisation of one step: acceleration a (x - x_hat), velocity c x + v_hat. */
typedef struct ImplicitTerms {
    double acceleration; /* [1/s2] a */
    const double *x_hat; /* [m] (place_count x 3), unused when a = 0 */
    double velocity;     /* [1/s] c */
    /* places that take backward Euler instead, with their own x_hat and v_hat; NULL: none */
    const unsigned char *euler; /* (place_count) */
    double step;                /* [s] of all, where c > 0; theirs: a = 1/step^2, c = 1/step */
    const double *v_hat;        /* [m/s] (place_count x 3), unused when c = 0 */
} ImplicitTerms;

/* Makes pattern, order and symbolic factorisation. */
Implicit *implicit_create(const System *system);
void implicit_destroy(Implicit *implicit);

/* A step starts at `start`: contacts and friction are those there. Before implicit_solve. */
void implicit_begin(Implicit *implicit, const unsigned char *held, const State *start);
/* The next implicit_clamp moves the obstacles too, see barrier_drive. */
void implicit_drive(Implicit *implicit, double time_end, double dt);
/* How many motions obstacles need at least to get from their places of one time to those of another. */
double implicit_turns(const System *system, double from, double to);
/* [J] done by obstacles on the cloth since the start of the step, at the contacts found last. */
double implicit_obstacle_work(const Implicit *implicit);
/* [J] that the air did on the faces of the cloth, by the solve that was last, until x. */
double implicit_air_work(const Implicit *implicit, const double *x);
/* [J] that friction took since then, by the forces of now. */
double implicit_friction(const Implicit *implicit);
/* Makes a motion from x legal; returns the smallest share of it that was left. Marks the places
 * whose motion was changed (NULL: do not mark). */
double implicit_clamp(Implicit *implicit, const double *x, double *dx, unsigned char *changed);
/* Contacts at x: marks places with a contact force (NULL: does not); returns their energy [J]. */
double implicit_contacts(Implicit *implicit, const double *x, unsigned char *touching,
                         BarrierReport *report);
bool implicit_has_contact(const Implicit *implicit);
/* Marks the places that the clamp changed during the last solve; true: there are some. */
bool implicit_add_clamped(const Implicit *implicit, unsigned char *flags);

/* Triangles that cross at x, by exact predicates; slow. */
int implicit_count_crossings(const Implicit *implicit, const double *x);

/* Solves for x from the start value in x; `first_dx`: see newton_solve. */
NewtonReport implicit_solve(Implicit *implicit, const ImplicitTerms *terms,
                            const NewtonParams *params, const double *first_dx, double *x);

/* [N] |gradient|_2 of the static problem over free places, at x. */
double implicit_residual(Implicit *implicit, const unsigned char *held, const State *start,
                         const double *x);

/* What the memory of contact becomes when x is accepted; `state` may be the start of the step. */
void implicit_store_contact(Implicit *implicit, const double *x, State *state);

double implicit_nonzeros(const Implicit *implicit); /* of the factor */
/* The pieces of one iteration, for benchmarks: each runs once at x. */
NewtonProblem implicit_problem(Implicit *implicit, const ImplicitTerms *terms,
                               const unsigned char *held, const State *start);

#endif
