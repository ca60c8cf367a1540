/* bounds.h: what a kick of the explicit road is subject to before it becomes motion: scaled inertia
 * (inertia.h), bounds on the sides of cells (sides.h) and limits of springs (limit.h), of all cloths. */
#ifndef TOILE_STEP_BOUNDS_H
#define TOILE_STEP_BOUNDS_H

#include "sim/step/inertia.h"
#include "sim/step/limit.h"
#include "sim/step/sides.h"

typedef struct Bounds {
    const Steer *steer;
    const SweepLattice *lattices; /* (cloth_count) nu = 0: no sweep */
    const int *grain;             /* (cloth_count) rows a thread takes at once */
    const Lanes *lanes;
    Sides *sides;  /* (cloth_count) all zero where they are free */
    Limit *limits; /* (cloth_count) of springs; all zero where there is none */
    Inertia inertia;
    double taken;   /* [J] of this interval: work on the bounds, and what sides held at its start */
    double handles; /* [J] of it, by the nodes that handles hold */
} Bounds;

/* slot: (place_count); `chunks` of rows, at most. */
Bounds bounds_create(const Steer *steer, const SweepLattice *lattices, const int *grain,
                     const Lanes *lanes, const int *slot, size_t chunks);

/* An interval begins, and ends: returns what the bounds took [J]. `enters`: with scaled inertia, after true. */
void bounds_begin(Bounds *bounds, const int *slot, bool enters);
double bounds_end(Bounds *bounds);

/* [J] kinetic energy under scaled inertia, beyond that of the masses. */
double bounds_hidden(Bounds *bounds);

/* Before a kick of `kick_time` [s], with its inertia: adds forces to lanes->f; `all`: not only of the sides that
 * the last kick saw. Counts what the kick before took. */
void bounds_find(Bounds *bounds, bool all, double kick_time);
/* After it: spreads what the kick left in inertia.moved. */
void bounds_spread(Bounds *bounds);

/* After both, of a kick of `share` dt: takes the forces back; no side and no spring grows beyond its bound
 * in a drift of dt. */
void bounds_hold(Bounds *bounds, double dt, double share);

/* At the end of an interval, with the velocities of the last drift: counts what the last kick took. */
void bounds_count(Bounds *bounds);

#endif
