/* tester.h: virtual Kawabata testers: `toile test bending FABRIC`, `toile test shear FABRIC`.
 *
 * Any fabric and any model goes through the loop of the machine, with hysteresis, quasi-statically:
 *   bending: 1 cm between walls that turn, curvature 0, 2.5, -2.5, 2.5 per cm; moment per width;
 *   shear:   20 x 5 cm whose threads keep their length, 0, 8, -8, 8 degrees; force per width. */
#ifndef TOILE_SIM_TESTER_H
#define TOILE_SIM_TESTER_H

#include <stdio.h>

#include "sim/base/arena.h"
#include "sim/base/error.h"
#include "sim/scene/fabric.h"

typedef enum TesterKind { TESTER_BENDING, TESTER_SHEAR } TesterKind;

typedef struct TesterLoop {
    int count;     /* steps of a branch */
    double *at;    /* [1/m] or [rad] (3 count) */
    double *force; /* [N] moment per width, or [N/m] */
    double slope;  /* B [N m], K 50 .. 150 /m; or G [N/m], 0.5 .. 2.5 degrees; mean of both ways */
    double width;  /* 2HB [N] at 100 /m; or 2HG [N/m] at 0.5 degrees */
    double width5; /* 2HG5 [N/m] at 5 degrees; shear only */
    double residual; /* [1/m] or [rad] that is left when the force is gone */
} TesterLoop;

/* `count`: a multiple of 160. Errors: EXIT_BAD_INPUT when the model cannot be made of the fabric. */
bool tester_run(TesterKind kind, const Fabric *fabric, const char *model, int count, Arena *arena,
                TesterLoop *loop, Error *error);

/* Largest distance of the first loading from the measured curve of the fabric, at its points within
 * the loop, over the curve; NAN: it has none. */
double tester_curve_error(TesterKind kind, const Fabric *fabric, const TesterLoop *loop);

/* The loop as CSV on out, its numbers beside those of the fabric on stderr; `json`: the numbers alone
 * on out. test: "bending" or "shear". */
bool tester_print(const char *test, const char *fabric, const char *model, bool json, FILE *out,
                  Error *error);

#endif
