/* strips.h: strips, plates and sheets with known answers, solved by the implicit road. */
#ifndef TOILE_TESTS_STRIPS_H
#define TOILE_TESTS_STRIPS_H

#include "sim/step/implicit.h"
#include "sim/step/stepper.h"
#include "sim/step/system.h"

/* How the nodes of a strip are laid out. */
typedef enum StripNodes { STRIP_LATTICE, STRIP_JITTER, STRIP_TURNED, STRIP_LLOYD } StripNodes;

/* A strip of length 1 m clamped at its left end, bent by its own weight. */
typedef struct StripCase {
    double gamma;     /* rho g L^3 / D */
    double stiffness; /* S = Eh L^2 / D */
    int nodes;        /* along the strip */
    StripNodes layout;
    int across;    /* 0: 5 on lattices, 9 on scattered nodes */
    uint64_t seed; /* of scattered nodes; 0: 3 */
    BendingKind bending;
    bool plain_newton;
    const char *model;   /* NULL: mlpg */
    BuckleKind buckling; /* of springs */
} StripCase;

typedef struct StripResult {
    double tip_x, tip_drop; /* of the length */
    double error;           /* distance from the exact tip / length */
    int iterations;
    NewtonStatus status;
} StripResult;

StripResult strip_solve(const StripCase *strip);

/* The same by kinetic damping, for forces with kinks; at most `steps` explicit steps. */
StripResult strip_relax(const StripCase *strip, int steps);

/* Exact tip of the heavy elastica (reach, drop) for some gamma from 0.1 to 1000. */
void strip_exact(double gamma, double tip[2]);

/* A system with everything that belongs to it; do not move it once made. */
typedef struct Bench {
    Arena arena;
    ClothDef cloth;
    Scene scene;
    HandleDef handles[2];
    System system;
} Bench;

/* Builds bench->system from bench->cloth, scene and the first handle_count handles. */
void bench_build(Bench *bench, int handle_count);
void bench_build_seeded(Bench *bench, int handle_count, uint64_t seed);

/* The swing: 1 m sheet, pinned at two corners of its upper edge, released at 60 degrees,
 * Eh 1000 N/m, D 1e-3 N m, 0.2 kg/m2, no damping. */
void swing_make(Bench *bench, int nodes, SidesKind sides);

/* First `count` elastic frequencies of a free plate with nu = 0.3, in units sqrt(D/rho)/L^2. */
void plate_frequencies(const char *model, int nodes, int count, double *frequencies);

#endif
