/* bench.h: run time against error. Each suite writes rows of
 * suite,case,model,stepper,nodes,dt,quantity,value,reference,error,cpu_s,note. */
#ifndef TOILE_TESTS_BENCH_H
#define TOILE_TESTS_BENCH_H

#include <stdio.h>

typedef struct BenchRow {
    const char *suite, *name, *stepper, *quantity;
    int nodes;
    double dt, value, reference, error, cpu;
    const char *note;
    const char *model; /* NULL: mlpg */
} BenchRow;

typedef struct BenchSuite {
    const char *name, *about;
    void (*run)(void);
} BenchSuite;

extern const BenchSuite bench_cantilever, bench_swing, bench_sweep, bench_implicit, bench_sleeve,
    bench_contact, bench_impulses, bench_threads, bench_skip, bench_auto;

void bench_write(BenchRow row); /* to the results file, and readable on stdout */
double bench_cpu(void);         /* [s] process CPU time */

/* Peak memory [MiB] of a new process that takes one step of a 100 x 100 cloth. */
double bench_peak_memory(const char *stepper);
void bench_one_step(const char *stepper); /* what that process does */

#endif
