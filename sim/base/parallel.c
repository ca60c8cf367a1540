#include "sim/base/parallel.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/base/error.h"

static int threads = 1;

void parallel_set_threads(int thread_count) {
    ASSERT(thread_count >= 1);
    threads = thread_count;
}

int parallel_threads(void) { return threads; }

void parallel_for(int count, int grain, ParallelBody *body, void *context) {
    int chunk_count = parallel_chunk_count(count, grain);
    if (threads == 1 || chunk_count <= 1) {
        for (int chunk = 0; chunk < chunk_count; chunk++) {
            int first = chunk * grain;
            int end = first + grain < count ? first + grain : count;
            body(chunk, first, end, context);
        }
        return;
    }
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int chunk = 0; chunk < chunk_count; chunk++) {
        int first = chunk * grain;
        int end = first + grain < count ? first + grain : count;
        body(chunk, first, end, context);
    }
}

int parallel_hold(void) {
    int levels = omp_get_max_active_levels();
    omp_set_max_active_levels(0);
    return levels;
}

void parallel_release(int levels) { omp_set_max_active_levels(levels); }

static int fix_variable(const char *name, const char *value) {
    const char *old = getenv(name);
    if (old && strcmp(old, value) == 0) {
        return 0;
    }
    setenv(name, value, 1);
    return 1;
}

void parallel_fix_environment(char **argv) {
    if (getenv("TOILE_ENVIRONMENT_FIXED")) {
        return;
    }
    int changed = fix_variable("OPENBLAS_NUM_THREADS", "1");
    changed += fix_variable("OMP_WAIT_POLICY", "passive");
    if (!changed) {
        return;
    }
    setenv("TOILE_ENVIRONMENT_FIXED", "1", 1);
    execv("/proc/self/exe", argv);
    /* without /proc the program still works, only slower on a busy machine */
}
