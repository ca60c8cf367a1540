/* thread_units.h: the units of particles (Breen, House, Wozny 1994): three nodes of a thread that
 * bend, four of a cell that shear. Each unit counts once in the energy.
 *
 *   bend:    k = |t+ - t-| / s, t the directions of both segments; energy A w W(K), W the work of
 *            the measured moment; K = psi/s by the turn psi ("angle"), or K = k, the curvature of
 *            the circle through three points ("sine", as the paper has it)
 *   trellis: S = u.v = sin(phi), u, v the mean directions of the threads of a cell; energy A W(phi)
 */
#ifndef TOILE_MODEL_THREAD_UNITS_H
#define TOILE_MODEL_THREAD_UNITS_H

#include "sim/model/model.h"
#include "sim/model/yarn.h"

/* where forces must stay finite for explicit steps: segments shorter than this share of the rest
 * length count as vectors, not as directions; folds sharper than this half turn go on linearly */
#define THREAD_SHORTEST 0.5
#define THREAD_SHARPEST_HALF 1.2 /* [rad] */
#define THREAD_CLOSED 1.2        /* [rad] shear of a cell, likewise */

typedef struct BendUnit {
    int node[3]; /* along the thread; only the first may be a ghost: a wall, over half a length */
    int axis;    /* 0 warp, 1 weft */
    double length, area; /* [m] s, [m2] A w */
} BendUnit;

typedef struct ThreadUnits {
    int bend_count, cell_count, node_limit;
    int wall_begin; /* bends from here on are walls */
    bool sine;
    BendUnit *bends;
    int (*cells)[4];              /* nodes 00, 10, 01, 11 */
    double cell_area, spacing[2]; /* [m2], [m] along warp and weft */
    YarnCurve bend[2];
    TrellisCurve trellis;
    BlockPlace (*bend_places)[6]; /* lower pairs 00, 10, 11, 20, 21, 22; base -1: a ghost */
    BlockPlace (*cell_places)[10];
} ThreadUnits;

/* Errors: EXIT_BAD_INPUT when a measured curve of the fabric does not rise any more without the
 * friction that `hysteresis: true` has beside it, or its shear moment falls. */
bool thread_units_create(const Cloth *cloth, ThreadUnits *units, Arena *arena, Error *error);
double thread_units_energy(const ThreadUnits *units, const double *x);
/* dE/dx of the walls alone; thread_rows.h has the others */
void thread_units_add_wall_gradient(const ThreadUnits *units, const double *x, double *gradient);
/* [N/m] d2W/dS2 of the shear of a cell */
double thread_units_shear_stiffness(const ThreadUnits *units, double sine);
int thread_units_couple(const ThreadUnits *units, int *pairs);
void thread_units_bind(ThreadUnits *units, const BlockMatrix *matrix, int first, Arena *arena);
/* positive semidefinite; what forces do to second derivatives of directions is left out */
void thread_units_add_hessian(const ThreadUnits *units, const double *x, double *values);

#endif
