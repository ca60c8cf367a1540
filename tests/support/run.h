/* run.h: a Bench (strips.h) that a stepper moves. */
#ifndef TOILE_TESTS_RUN_H
#define TOILE_TESTS_RUN_H

#include "tests/support/strips.h"

typedef struct Run {
    Bench bench; /* to be built by the test */
    const Stepper *stepper;
    void *data; /* of the stepper */
    State state;
    unsigned char *held;   /* (place_count) at t = 0 */
    Statistics statistics; /* since run_start */
} Run;

/* Stands at t = 0 with the stepper of that name; step [s] 0: its own choice. Fails the test when it refuses. */
void run_start(Run *run, const char *stepper, double step);
/* To `time` [s] in one interval. Fails the test when the stepper gives up. */
void run_to(Run *run, double time);
void run_end(Run *run);

/* [J] kinetic and elastic energy and that of gravity, with what scaled inertia hides. */
double run_energy(const Run *run);

#endif
