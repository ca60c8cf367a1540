/* sides.h: the bound on the sides of cells (sim/model/side_bound.h) on the explicit road.
 *
 * Its energy is integrated by backward Euler, so that its stiffness is not bounded by the step: after
 * the kick, sequential impulses with clamped sums make
 *   impulse = dt k (excess + dt growth).
 * They keep momentum and, being implicit in a potential, add no energy, however the inertia of
 * crowded vertices changes in the kick; an explicit law did (mlpg.md). */
#ifndef TOILE_STEP_SIDES_H
#define TOILE_STEP_SIDES_H

#include "sim/base/arena.h"
#include "sim/geom/lanes.h"
#include "sim/model/side_bound.h"

/* A side of a cell that is too long. */
typedef struct LongSide {
    int slot[4];        /* from and to of the side, then of the one across the cell */
    double mobility[4]; /* [1/kg] of those nodes */
    Vec3 slope[2];      /* of the excess, by the vectors along both sides */
    double excess;      /* [m] */
    double most;        /* [m] at which it yields */
    double stiffness;   /* [N/m] */
    double before;      /* [m/s] growth of the excess before the kick */
    double impulse;     /* [N s] of this kick */
} LongSide;

/* The sides of one cloth. All zero: a cloth without any. */
typedef struct Sides {
    const SweepLattice *lattice;
    SweepSides seen; /* by the last kick */
    LongSide *list;  /* (count) in this kick */
    int count, room;
    Arena *arena;
} Sides;

/* All zero when the sides of the lattice are free. */
Sides sides_create(const SweepLattice *lattice, Arena *arena);

/* Before a kick: lists the sides of the cells that the last kick saw, or of all; `held` (nu x nv) nodes
 * have no mobility. */
void sides_find(Sides *sides, const Lanes *lanes, const unsigned char *held, bool all);

/* [J] stored in the sides of the list. */
double sides_energy(const Sides *sides);

/* After a kick of `share` dt, before a drift of dt: changes lanes->v. */
void sides_hold(Sides *sides, const Lanes *lanes, double dt, double share);

/* With the velocities of the drift: the work [J] that was done on the bound, its force times the mean of
 * the velocities before the kick and now (to first order in dt where an interval halves the kick). */
double sides_work(const Sides *sides, const Lanes *lanes);

#endif
