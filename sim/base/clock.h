/* clock.h: where the time goes. */
#ifndef TOILE_BASE_CLOCK_H
#define TOILE_BASE_CLOCK_H

#include <time.h>

/* [s] of a clock that only runs forward; some 30 ns a call */
static inline double clock_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* [s] that all threads of this process have computed */
static inline double clock_process_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

#endif
