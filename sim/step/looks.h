/* looks.h: looks at the motion of all cloth, that contact asks for where nothing is near (ContactMotion). */
#ifndef TOILE_STEP_LOOKS_H
#define TOILE_STEP_LOOKS_H

#include "sim/base/vector.h"
#include "sim/contact/contact.h"
#include "sim/geom/box_tree.h"
#include "sim/model/sweep.h"
#include "sim/step/system.h"

/* Of the nodes of rows row_begin .. row_end - 1 of a lattice; the same for every width. */
typedef struct LookKernel {
    /* Largest v.v [m2/s2]. */
    double (*fastest)(const SweepLattice *lattice, const Lanes *lanes, int row_begin, int row_end);
    /* Largest squares of the difference of x - from, or of x alone, at two nodes next to each other along
     * u and along v: those rows, and up to the row that follows. */
    void (*spread)(const SweepLattice *lattice, double *const x[3], double *const from[3],
                   int row_begin, int row_end, double most[2]);
    /* Box of x - from in those rows. */
    Box (*moved)(const SweepLattice *lattice, double *const x[3], double *const from[3],
                 int row_begin, int row_end);
    /* out = x + ahead v, of so many slots. */
    void (*lead)(double *const x[3], double *const v[3], double *const out[3], double ahead,
                 int count);
} LookKernel;

extern const LookKernel look_kernel_scalar, look_kernel_sse2, look_kernel_avx2, look_kernel_avx512;

const LookKernel *looks_kernel(VectorWidth width);

typedef struct Looks {
    const System *system;
    const LookKernel *kernel;
    const Lanes *lanes;
    const int *slot;              /* (place_count) */
    const SweepLattice *lattices; /* (cloth_count) with first slots; nu = 0: none */
    const int *grain;             /* (cloth_count) rows of a chunk */
    double (*chunk_most)[2];      /* squares, of the chunks of one cloth */
    Box *chunk_box;               /* [m] likewise */
    double *marked[3];            /* [m] (slot_count) positions from which spreads count */
} Looks;

Looks looks_create(const System *system, const Lanes *lanes, const int *slot,
                   const SweepLattice *lattices, const int *grain);

/* `looks` stays where it is while this is in use. */
ContactMotion looks_motion(Looks *looks);

#endif
