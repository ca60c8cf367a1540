/* side_bound.h: a bound on the sides of a lattice's cells (`sides: bounded`).
 *
 * A cell is sampled once (mlpg.md), so its sides are free to differ from the strain that it sees: at a
 * point load, as at the corner of a box, sides would stretch by a fifth while their cells stay within a
 * hundredth. With l the length of a side, h its length at rest and s the stretched one of its cell,
 * a = SWEEP_SIDE_EXCESS,
 *   excess = l - (1 + a) max(h, s)   of a side that is too long,
 *            (1 - a) min(h, s) - l   of one that is too short;   W = k/2 excess^2   where excess > 0,
 * once for each side of each cell. k is a few times the stiffness of half the cell; a cell that
 * stretches as a whole meets no bound. From `most` on, a share of h, the force stays as it is: where
 * cloth is wrung so hard that its cells cannot follow, sides yield, and press no harder on contacts. */
#ifndef TOILE_MODEL_SIDE_BOUND_H
#define TOILE_MODEL_SIDE_BOUND_H

#include <math.h>

#include "sim/base/vec.h"
#include "sim/model/strain.h"
#include "sim/model/sweep.h"

/* k over the stiffness of half a cell */
#define SIDE_BOUND_STIFFNESS 3.0
/* excess over the spacing at which sides yield */
#define SIDE_BOUND_MOST 0.02

/* A side that is too long or too short. Slopes are by the vectors along it and along the side across the cell. */
typedef struct SideExcess {
    double excess; /* [m] */
    double most;   /* [m] at which it yields */
    double sign;   /* 1: too long, -1: too short */
    /* the bound over the stretched side of the cell; 0: it does not move with the cell */
    double of_cell;
    Vec3 slope[2];
} SideExcess;

/* [N/m] k of sides along u (axis 0) or v (axis 1). */
static inline double side_bound_stiffness(const SweepLattice *l, int axis) {
    double half = axis == 0 ? l->c11 * l->h2 / l->h1 : l->c22 * l->h1 / l->h2;
    return SIDE_BOUND_STIFFNESS * 0.5 * half;
}

/* [m] excess at which sides of that spacing yield. */
static inline double side_bound_most(double spacing) { return SIDE_BOUND_MOST * spacing; }

/* Corners of a cell (00, 10, 01, 11) from which to which a side runs, then those of the side across; two
 * along u, then two along v. */
extern const int side_bound_corners[4][4];

/* Is a side too long or too short? `square` [m2] of its length, `of_cell` of the mean of it and the one
 * across, `rest` of the spacing. */
static inline bool side_bound_is_exceeded(double square, double of_cell, double rest) {
    const double longer = 1.0 + SWEEP_SIDE_EXCESS, shorter = 1.0 - SWEEP_SIDE_EXCESS;
    bool is_long = square > longer * longer * max2(rest, of_cell);
    bool is_short = square < shorter * shorter * min2(rest, of_cell);
    return is_long | is_short;
}

/* By how much: `own` [m] along it, `mean` that of it and the one across, `spacing` at rest. */
static inline SideExcess side_bound_excess(Vec3 own, Vec3 mean, double spacing) {
    double square = vec3_dot(own, own), of_cell = vec3_dot(mean, mean), rest = spacing * spacing;
    double sign = square > rest ? 1.0 : -1.0, length = sqrt(square);
    double share = sign > 0.0 ? 1.0 + SWEEP_SIDE_EXCESS : 1.0 - SWEEP_SIDE_EXCESS;
    bool moves = sign * of_cell > sign * rest; /* with the stretched side of the cell */
    double stretched = moves ? sqrt(of_cell) : spacing;
    SideExcess found = {.excess = sign * (length - share * stretched),
                        .most = side_bound_most(spacing),
                        .sign = sign,
                        .of_cell = moves ? share : 0.0,
                        .slope[1] =
                            vec3_scale(moves ? -0.5 * sign * share / stretched : 0.0, mean)};
    found.slope[0] = vec3_axpy(found.slope[1], length > 0.0 ? sign / length : 0.0, own);
    return found;
}

static inline bool side_bound_exceeded(Vec3 own, Vec3 mean, double spacing, SideExcess *out) {
    if (!side_bound_is_exceeded(vec3_dot(own, own), vec3_dot(mean, mean), spacing * spacing)) {
        return false;
    }
    *out = side_bound_excess(own, mean, spacing);
    return out->excess > 0.0;
}

/* W, its gradient and Hessian over the cells of a membrane (strain_lattice); `definite` leaves the
 * negative part of the Hessian out. */
double side_bound_energy(const SweepLattice *lattice, const StrainSamples *cells, const double *x);
void side_bound_add_gradient(const SweepLattice *lattice, const StrainSamples *cells,
                             const double *x, double *gradient);
void side_bound_add_hessian(const SweepLattice *lattice, const StrainSamples *cells,
                            const double *x, bool definite, double *values);

#endif
