/* stochastic.h: energies lowered by moves of single nodes, against the gradient there and at random
 * (Breen, House, Wozny 1994, second phase), for steppers `stochastic` and `three_phase`.
 *
 * A sweep offers every free node one move. Nodes that share no unit of a model move together, as
 * single ones would: the change of energy of each is its own, (g_i(x) + g_i(x'))/2 . d_i. A move stays
 * when it raises the energy by no more than threshold / nodes (threshold accepting; Dueck, Scheuer 1990),
 * so that a sweep raises it by no more than the threshold; one that did, as the trapezoid is no exact
 * integral, is taken back whole. */
#ifndef TOILE_STEP_STOCHASTIC_H
#define TOILE_STEP_STOCHASTIC_H

#include "sim/step/system.h"

typedef struct Stochastic {
    const System *system;
    int colours;               /* classes of nodes that share no unit */
    int *colour;               /* (place_count) -1: never moves */
    unsigned char *held;       /* (place_count) */
    unsigned char *weightless; /* (place_count) whose height costs nothing: held ones, at least */
    /* a spring from every node to its own place, s m |x - anchor|^2 / 2; NULL: none */
    const double *anchor;     /* [m] (place_count x 3) */
    double anchor_stiffness;  /* [1/s2] s */
    double *amplitude;        /* [m] (place_count) of the next move */
    double *gradient, *after; /* [N] (place_count x 3) */
    double *x, *start;        /* [m] (place_count x 3) tried; at the start of a sweep */
    uint64_t moves;           /* offered so far, which number the random ones */
} Stochastic;

Stochastic *stochastic_create(const System *system);
/* Before sweeps of a new configuration, with `held` and `weightless` set: amplitudes as wide as `widest`
 * [m], the numbers from `seed`. */
void stochastic_begin(Stochastic *stochastic, double widest, uint64_t seed);
/* The same for a step of dt from x [m] (place_count x 3): as wide as the force of the moment moves a node
 * in it. Numbers go on. */
void stochastic_begin_step(Stochastic *stochastic, double dt, const double *x);
double stochastic_energy(const Stochastic *stochastic, const double *x); /* [J] */
/* One sweep; x (place_count x 3) is changed. Returns the energy after it [J], `energy` being that
 * before: energy + threshold at most. */
double stochastic_sweep(Stochastic *stochastic, double threshold, double energy, double *x);
uint64_t stochastic_seed(double time); /* for what begins at a time [s] */

#endif
