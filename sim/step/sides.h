/* sides.h: the bound on the sides of cells (sim/model/side_bound.h) on the explicit road.
 *
 * Its energy is integrated by backward Euler, so that its stiffness is not bounded by the step:
 *   impulse = dt k (excess + dt growth).
 * The part that is right where nothing moves is a force of the kick; the rest, which resists growth, is
 * made by sequential impulses with clamped sums after it. They keep momentum and, being implicit in a
 * potential, add no energy, however the inertia of crowded vertices changes in the kick; an explicit law did
 * (mlpg.md). Scaled inertia (inertia.h) spreads the forces with the kick, the impulses on their own. */
#ifndef TOILE_STEP_SIDES_H
#define TOILE_STEP_SIDES_H

#include "sim/base/arena.h"
#include "sim/geom/lanes.h"
#include "sim/model/side_bound.h"
#include "sim/step/inertia.h"

/* What scaled inertia leaves of the mobility of nodes that one side pulls: 0.35 by its stencil, 0.5 with all sides
 * parallel to it. With more the impulses are too weak for the stiffness of the forces, with less too strong where
 * many sides grow together; either shakes cloth at rest. */
#define SIDES_SCALED_MOBILITY 0.45

/* A side of a cell that is too long or too short. */
typedef struct BoundSide {
    int slot[4];        /* from and to of the side, then of the one across the cell */
    double mobility[4]; /* [1/kg] of those nodes */
    Vec3 slope[2];      /* of the excess, by the vectors along both sides */
    double excess;      /* [m] */
    double most;        /* [m] at which it yields */
    double stiffness;   /* [N/m] */
    double before;      /* [m/s] growth of the excess before the kick */
    double impulse;     /* [N s] of this kick */
} BoundSide;

/* A side of the list with a node that a handle holds. */
typedef struct HeldSide {
    int side;
    double before; /* [m/s] growth of its excess by such nodes before the kick */
} HeldSide;

/* [J] */
typedef struct SidesWork {
    double taken;   /* that was done on the bound */
    double handles; /* that handles did for it: with their nodes, which it cannot move */
} SidesWork;

/* Those of some rows of cells, which a thread works on by itself: all but the last row of each share has
 * no node in common with another. Room for one row of cells. */
typedef struct SidesShare {
    /* (count) `inner` of them of rows that are its own, then those of the last row */
    BoundSide *list;
    int count, inner, room;
    HeldSide *held; /* (held_count) */
    int held_count;
    bool full;           /* there are more: the room grows, and its rows are looked at again */
    SidesWork work;      /* of those listed before */
    int *cells, *beyond; /* (nu), (4 nu) columns; 4 column + side */
    double *buffer;      /* a row */
} SidesShare;

/* The sides of one cloth. All zero: a cloth without any. */
typedef struct Sides {
    const SweepLattice *lattice;
    const SweepKernel *kernel;
    SweepSides seen;        /* by the last kick */
    SidesShare *shares;     /* (share_count) */
    int share_count, count; /* sides of all of them */
    InertiaBlocks blocks;   /* of nodes that sides_hold changes, on a scaled lattice */
    double *pulled[3];      /* [m/s] lanes of what it changes there, until sides_find */
    Arena *arena;
} Sides;

/* All zero when the sides of the lattice are free. */
Sides sides_create(const SweepLattice *lattice, double *const pulled[3], Arena *arena);

/* Before a kick of `kick_time` [s]: lists the sides of the cells that the last kick saw, or of all, and adds
 * their forces to lanes->f; 0: none. `held` (nu x nv) nodes have no mobility. Returns sides_work of those
 * listed before. */
SidesWork sides_find(Sides *sides, const Lanes *lanes, const unsigned char *held, bool all,
                     double kick_time);

/* [J] stored in the sides of the list. */
double sides_energy(const Sides *sides);

/* After a kick of `share` dt, before a drift of dt: takes the forces back and changes lanes->v, on a scaled
 * lattice by SIDES_SCALED_MOBILITY of the changes that it leaves in `pulled`, to be spread. */
void sides_hold(Sides *sides, const Lanes *lanes, double dt, double share);

/* With the velocities of the drift: the work on the bound, its force times the mean of
 * the velocities before the kick and now (to first order in dt where an interval halves the kick). */
SidesWork sides_work(const Sides *sides, const Lanes *lanes);

/* None is listed any more. */
void sides_forget(Sides *sides);

#endif
