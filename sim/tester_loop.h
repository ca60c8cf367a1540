/* tester_loop.h: testers that move a specimen as one, with hysteresis, quasi-statically:
 *
 *   bending: 1 cm between walls that turn, curvature 0, 2.5, -2.5, 2.5 per cm; moment per width;
 *   shear:   20 x 5 cm whose threads keep their length, 0, 8, -8, 8 degrees; force per width;
 *   picture: a frame of hinged bars, 20 x 20 cm, 0, 40, 0 degrees of shear. A crosshead pulls one
 *            diagonal d = 2 L cos(45 deg - phi/2) with P = W'(phi) / (dd/dphi); the bars carry, per
 *            side (Cao et al. 2008, Composites A 39, 1037), F/L = P / (2 L cos(45 deg - phi/2))
 *            = W'(phi) / (L^2 cos phi), which is the force of the shear tester. No wrinkles.
 *
 * Poses are homogeneous, which is an equilibrium of the inside; forces are work over motion. */
#ifndef TOILE_SIM_TESTER_LOOP_H
#define TOILE_SIM_TESTER_LOOP_H

#include "sim/base/arena.h"
#include "sim/base/error.h"
#include "sim/scene/fabric.h"

#define TESTER_FRAME_SIDE 0.2 /* [m] L of the picture frame */

typedef enum TesterKind { TESTER_BENDING, TESTER_SHEAR, TESTER_PICTURE } TesterKind;

typedef struct TesterLoop {
    int count, branches; /* steps of a branch; 3, or there and back 2 */
    double *at;          /* [1/m] or [rad] (branches count) */
    double *force;       /* [N] moment per width, or [N/m] */
    double slope;  /* B [N m], K 50 .. 150 /m; or G [N/m], 0.5 .. 2.5 degrees; mean of both ways */
    double width;  /* 2HB [N] at 100 /m; or 2HG [N/m] at 0.5 degrees */
    double width5; /* 2HG5 [N/m] at 5 degrees; 0 for bending */
    double residual; /* [1/m] or [rad] that is left when the force is gone */
} TesterLoop;

/* `count`: a multiple of 160. Errors: EXIT_BAD_INPUT when the model cannot be made of the fabric. */
bool tester_run(TesterKind kind, const Fabric *fabric, const char *model, int count, Arena *arena,
                TesterLoop *loop, Error *error);

/* Largest distance of the first loading from the measured curve of the fabric, at its points within
 * the loop, over the curve; NAN: it has none. */
double tester_curve_error(TesterKind kind, const Fabric *fabric, const TesterLoop *loop);

/* [N] or [N/m] what the numbers of the fabric (its measured curve, where it has one) say at that
 * place of a branch: yarns slip as in yarn.h, and over twice the way after a turn.
 * NAN beyond what was measured: the curve, or shear beyond 8 degrees. */
double tester_expected(TesterKind kind, const Fabric *fabric, int branch, double at);

#endif
