/* inertia.h: selective mass scaling of a lattice cloth on the explicit road. The shortest waves of the
 * lattice, of which a drape shows nothing but which bound the step, get more inertia than they have.
 *
 * With M the masses of the nodes and L1, L2 minus the second differences along rows and columns, mirrored
 * at free borders (so that M L is symmetric), the inverse mass matrix is
 *   W = S M^-1,   S = (1 - g L1^2)(1 - g L2^2),
 * symmetric and positive: a reciprocal mass matrix (Tkachuk and Bischoff 2013; the scaling: Olovsson,
 * Simonsson and Unosson 2005). L1 and L2 vanish on what is linear, so momentum, gravity and every equilibrium
 * stay as they are; a wave of n nodes is slower by g/2 (2 pi / n)^4, 0.4 % for n = 10, where the lattice
 * itself is 1.6 % slow. The fastest waves are 1.52 times slower, and so much longer is the stable step.
 *
 * S acts on what a kick changes in the velocities. Held nodes keep theirs. What the guard of contact and
 * the inertia of crowded vertices do is not spread, which is no longer passive in the energy of W^-1:
 * cloth that lies on itself keeps its own inertia (central.c). */
#ifndef TOILE_STEP_INERTIA_H
#define TOILE_STEP_INERTIA_H

#include "sim/base/vector.h"
#include "sim/geom/lanes.h"
#include "sim/model/sweep.h"
#include "sim/step/steer.h"

#define INERTIA_BLOCK 8 /* nodes of a row that are spread together */

/* Changes of velocities of one lattice. */
typedef struct InertiaChange {
    const SweepLattice *lattice;
    double *const *moved; /* [m/s] (3) lanes: the changes */
    double *const *v;     /* [m/s] (3) lanes, with `share` of them */
    double share;
} InertiaChange;

/* v += S moved - share moved, of nodes begin .. end - 1 of row j, a multiple of INERTIA_BLOCK but at the end of
 * the row. Reads moved in two rows and two nodes more on every side. `buffer`: a row. */
typedef void InertiaKernel(const InertiaChange *change, int j, int begin, int end, double *buffer);

extern InertiaKernel *const inertia_kernel_scalar,
    *const inertia_kernel_sse2, *const inertia_kernel_avx2, *const inertia_kernel_avx512;

/* Which blocks of a lattice hold a node that changed. */
typedef struct InertiaBlocks {
    int columns;         /* blocks of a row */
    unsigned char *some; /* (nv) 1: of this row */
    unsigned char *one;  /* (nv x columns) */
} InertiaBlocks;

InertiaBlocks inertia_blocks_create(const SweepLattice *lattice, Arena *arena);
/* Rows first .. end - 1: zero in the blocks of `lane` that hold one, which then hold none. */
void inertia_blocks_clear(InertiaBlocks *blocks, const SweepLattice *lattice, double *const lane[3],
                          int first, int end);

static inline void inertia_blocks_mark(InertiaBlocks *blocks, int i, int j) {
    blocks->some[j] = blocks->one[j * blocks->columns + i / INERTIA_BLOCK] = 1;
}

/* Of all cloths. */
typedef struct Inertia {
    InertiaKernel *kernel;
    double *moved[3];  /* [m/s] (slot_count) by the kick */
    double *pulled[3]; /* [m/s] (slot_count) by sides_hold, of the last step */
    double *search[3], *residual[3], *solution[3]; /* [m/s] (slot_count) of inertia_hidden */
    double *row_sums;                              /* (nv of the largest lattice) */
    double *kept[3];    /* [m/s] (held_count) velocities of what is held */
    int *held;          /* (held_count) slots, cloth by cloth */
    int *held_first;    /* (cloth_count + 1) */
    double *buffers;    /* a row for each chunk */
    size_t buffer_size; /* [double] */
} Inertia;

/* `chunks`: most of one lattice. */
Inertia inertia_create(const System *system, int slot_count, size_t chunks);

/* An interval begins; `slot`: (place_count). */
void inertia_begin(Inertia *inertia, const Steer *steer, const int *slot);

/* After a kick that left its changes in inertia->moved: spreads those of cloth c; `grain` rows a thread takes
 * at once. */
void inertia_spread(Inertia *inertia, const SweepLattice *lattice, const Lanes *lanes, int c,
                    int grain);

/* The same for inertia->pulled, of which velocities have `share`, in the blocks that hold a change. */
void inertia_spread_blocks(Inertia *inertia, const SweepLattice *lattice, const Lanes *lanes, int c,
                           double share, const InertiaBlocks *blocks, int grain);

/* Velocities that belong to true inertia become those of the same momentum under scaled inertia. */
void inertia_enter(Inertia *inertia, const SweepLattice *lattice, const Lanes *lanes, int c,
                   int grain);

/* [J] kinetic energy of cloth c under scaled inertia, beyond that of its masses: (v' W^-1 v - v' M v) / 2 of
 * the nodes that are free, by conjugate gradients. */
double inertia_hidden(Inertia *inertia, const SweepLattice *lattice, const Lanes *lanes, int c,
                      int grain);

#endif
