#include "tests/bench/bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "sim/base/clock.h"
#include "sim/base/parallel.h"

static FILE *results;

static const BenchSuite *const suites[] = {
    &bench_cantilever, &bench_swing,   &bench_sweep, &bench_implicit, &bench_sleeve, &bench_contact,
    &bench_impulses,   &bench_threads, &bench_skip,  &bench_auto,     NULL};

static void write_number(double value) {
    if (isfinite(value)) {
        fprintf(results, "%.9g,", value);
    } else {
        fprintf(results, ",");
    }
}

void bench_write(BenchRow row) {
    const char *model = row.model ? row.model : "mlpg";
    fprintf(results, "%s,%s,%s,%s,%d,", row.suite, row.name, model, row.stepper, row.nodes);
    write_number(row.dt);
    fprintf(results, "%s,", row.quantity);
    write_number(row.value);
    write_number(row.reference);
    write_number(row.error);
    write_number(row.cpu);
    fprintf(results, "%s\n", row.note ? row.note : "");
    fflush(results);
    printf("%-10s %-20s %-9s %-16s n %-6d dt %-10.3g %-18s %-12.6g error %-10.3g cpu %-9.4g %s\n",
           row.suite, row.name, model, row.stepper, row.nodes, row.dt, row.quantity, row.value,
           row.error, row.cpu, row.note ? row.note : "");
    fflush(stdout);
}

double bench_cpu(void) { return clock_process_seconds(); }

double bench_peak_memory(const char *stepper) {
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        execl("/proc/self/exe", "bench", "--one-step", stepper, (char *)NULL);
        _exit(1);
    }
    int status;
    struct rusage usage;
    if (child < 0 || wait4(child, &status, 0, &usage) != child || status != 0) {
        return NAN;
    }
    return (double)usage.ru_maxrss / 1024.0;
}

int main(int argc, char **argv) {
    parallel_fix_environment(argv);
    if (argc == 3 && strcmp(argv[1], "--one-step") == 0) {
        bench_one_step(argv[2]);
        return 0;
    }
    const char *wanted = argc > 1 ? argv[1] : "all";
    results = fopen(argc > 2 ? argv[2] : "results.csv", "w");
    if (!results) {
        perror("bench");
        return 74;
    }
    fprintf(results,
            "suite,case,model,stepper,nodes,dt,quantity,value,reference,error,cpu_s,note\n");
    int ran = 0;
    for (const BenchSuite *const *suite = suites; *suite; suite++) {
        if (strcmp(wanted, "all") == 0 || strcmp(wanted, (*suite)->name) == 0) {
            printf("# %s: %s\n", (*suite)->name, (*suite)->about);
            (*suite)->run();
            ran++;
        }
    }
    fclose(results);
    if (!ran) {
        fprintf(stderr, "bench: no suite '%s'; there are: all", wanted);
        for (const BenchSuite *const *suite = suites; *suite; suite++) {
            fprintf(stderr, ", %s", (*suite)->name);
        }
        fputc('\n', stderr);
    }
    return ran ? 0 : 2;
}
