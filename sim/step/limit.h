/* limit.h: Provot's (1995) inverse dynamics on the explicit road: no spring ends a step longer than its
 * limit.
 *
 * He moved both ends of such a spring together after the step. The same is done here by the velocities
 * that lead to the new positions, so that motion and velocity agree and contact sees the motion before
 * it happens: equal and opposite impulses along the spring, which keep momentum, in rounds over all
 * springs in a fixed order, from held nodes outwards. What neighbours leave undone grows with gravity
 * step^2: a limit of 10 % ends at 14, 11, 10.5 % with 1, 3, 10 rounds of 1 ms (a swing goes through 27,
 * 16, 12 % in between). It is no potential: a spring that is too long already is pulled in, whatever
 * that costs; the energy gate of the stepper sees it. */
#ifndef TOILE_STEP_LIMIT_H
#define TOILE_STEP_LIMIT_H

#include "sim/base/arena.h"
#include "sim/geom/lanes.h"
#include "sim/model/model.h"

/* Of one cloth. All zero: it has none. */
typedef struct Limit {
    int count, node_count, rounds;
    const SpringLimit *springs; /* (count) of the model */
    const int *slot;            /* (node_count) lanes of the nodes */
    unsigned char *held;        /* (node_count) seen last */
    int *order;                 /* (count) springs in a round */
    int *distance, *queue;      /* (node_count) springs from the nearest held node */
    int *begin, *neighbour;     /* (node_count + 1), (2 count) graph of the springs */
} Limit;

Limit limit_create(const Cloth *cloth, const int *slot, Arena *arena);

/* These nodes (node_count) are held from now on. */
void limit_see(Limit *limit, const unsigned char *held);

/* Before a drift of dt: changes lanes->v. Returns the kinetic energy [J] that it took, and adds what handles gave
 * with the nodes that they hold. */
double limit_hold(const Limit *limit, const Lanes *lanes, double dt, double *handles);

#endif
