/* sweep.h: the explicit step of a lattice cloth in one pass over its rows.
 *
 * Forces of the low-order membrane (one sample per cell, with bounded hourglass) and of the
 * 13-point quadratic bending, and the kick v += dt f / m, row by row with a few row buffers.
 * Every operation is elementwise along a row, so the bits do not depend on the vector width,
 * nor on how the rows are dealt to threads. Formulas: mlpg.h.
 */
#ifndef TOILE_MODEL_SWEEP_H
#define TOILE_MODEL_SWEEP_H

#include <stdbool.h>

#include "sim/base/vec.h"
#include "sim/geom/box_tree.h"
#include "sim/geom/lanes.h"

/* One lattice and its constants; shared by all variants. */
typedef struct SweepLattice {
    int nu, nv, stride;
    int first;                 /* slot of node (0, 0) */
    bool wrap;                 /* u runs around */
    bool clamp[4];             /* left, right, bottom, top: ghost nodes outside hold the slope */
    double h1, h2;             /* [m] spacing along u, v */
    double c11, c12, c22, c66; /* [N/m] membrane */
    double d11, d12, d22, d66; /* [N m] bending */
    double hourglass;          /* [N/m] k_h */
    bool bounded;              /* sides of cells (side_bound.h), which the sweep leaves to others */
    bool rest;                 /* the sweep adds the moments of the rest curvature (wrapped only) */
    double rest1, rest2;       /* [1/m] rest curvature along u, v */
    bool scaled;               /* selective mass scaling (sim/step/inertia.h) */
} SweepLattice;

/* g of inertia.h: the longer the step, the slower waves of a few nodes; 1/16 would stop the shortest. */
#define SWEEP_MASS_SCALING 0.05
#define SWEEP_LEAST_SCALED 5 /* nodes along u and v */

/* A side may be longer than its rest length and than the cell's own stretch, or shorter than both, by this
 * share. */
#define SWEEP_SIDE_EXCESS 0.02

/* Cells with a side that is beyond. */
typedef struct SweepSides {
    unsigned char *row;  /* (nv) 1: this row of cells holds one; NULL: not asked for */
    unsigned char *cell; /* (nu x nv) of such rows: 1 for the cell right above node i */
} SweepSides;

/* What one kick does besides the forces: v <- (v + dt (f / m + push)) * keep. */
typedef struct SweepKick {
    double dt;            /* [s]; v += dt f / m */
    Vec3 push;            /* [m/s2] gravity and wind drag */
    double keep;          /* 1 / (1 + dt * (damping + drag / density)) */
    SweepSides sides;     /* out */
    double *const *moved; /* [m/s] (3) lanes, out: the changes of v; NULL: not asked for */
} SweepKick;

typedef struct SweepDrift {
    double dt;              /* [s] */
    double bent, stretched; /* [s] by which lanes->bent, lanes->stretched are ahead of the new x */
    bool frames;            /* every row in its own frame? */
} SweepDrift;

/* How fast nodes are: every row in a frame that moves with the mean of two of its nodes, or stands. */
typedef struct SweepSpeed {
    double within; /* [m2/s2] largest square in those frames */
    Box frames;    /* [m/s] of the velocities of frames */
    double shear;  /* [m2/s2] of a frame against that of the next row */
} SweepSpeed;

/* Row buffers for one thread; (SWEEP_BUFFER_ROWS x stride). */
#define SWEEP_BUFFER_ROWS 64

typedef struct SweepKernel {
    const char *name; /* scalar, sse2, avx2, avx512 */
    /* Kicks the nodes of rows row_begin .. row_end - 1. Reads x everywhere, writes only v. */
    void (*kick)(const SweepLattice *lattice, const Lanes *lanes, const SweepKick *kick,
                 int row_begin, int row_end, double *buffer);
    /* x += dt v for those rows, and where bending and stretch are taken. The last row is compared with
     * the one that follows. */
    SweepSpeed (*drift)(const SweepLattice *lattice, const Lanes *lanes, const SweepDrift *drift,
                        int row_begin, int row_end);
    /* Marks the cells that a kick would. */
    void (*mark)(const SweepLattice *lattice, const Lanes *lanes, const SweepSides *sides,
                 int row_begin, int row_end, double *buffer);
} SweepKernel;

/* All variants that this program holds, NULL-terminated; the scalar one first. */
extern const SweepKernel *const sweep_kernels[];

bool sweep_kernel_runs_here(const SweepKernel *kernel); /* does the processor know it? */
const SweepKernel *sweep_kernel_best(void);             /* of vector_best() */

/* Copies the first and last two nodes of every row of a wrapped lattice outside. */
void sweep_wrap_rows(const SweepLattice *lattice, double *const x[3]);

/* [s] stability limit: 1 / sqrt(1/d1^2 + 1/d2^2) of the membrane and bending limits,
 * for `density` [kg/m2]; 1.52 times longer when scaled. */
double sweep_stable_step(const SweepLattice *lattice, double density);

/* 1 / the square of what is left of the stable step at x [m] (nu x nv x 3); 1 without strain. Of the membrane
 * c11 becomes c11 g11 + c66 g12^2 / g11 + the largest tension, g the metric of the stiffest cell; likewise
 * c22. */
double sweep_stiffening(const SweepLattice *lattice, const double *x);

/* [1/s2] squares of the fastest angular frequencies of bending and of the membrane, each alone. */
typedef struct Fastest {
    double bending, membrane;
} Fastest;

Fastest sweep_fastest(const SweepLattice *lattice, double density);

#endif
