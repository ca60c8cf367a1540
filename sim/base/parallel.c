#include "sim/base/parallel.h"

#include <omp.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/base/clock.h"
#include "sim/base/error.h"

#define SPINS 6000        /* of a worker before it sleeps: some 0.1 ms, the serial part of a step */
#define LOOK_LOOPS 512    /* from one look at the clock to the next, some 10 ms */
#define LEAST_PATIENCE 16 /* looks until the other way is tried again */
#define LONGER 4          /* times that when it was no better */
#define MOST_PATIENCE 128 /* ... at most; two seconds */
#define BETTER 0.92       /* of the time of the way at hand */
#define SUM_BLOCK 4096    /* numbers that are kept at once, on the stack */
#define CHUNK_BITS 24     /* of the number of a chunk in Team.word */
#define CHUNK_MASK (((uint64_t)1 << CHUNK_BITS) - 1)

/* With the workers or alone: whichever is quicker, tried one after the other. Other programs may want the
 * processors, or two of them may be one. */
typedef struct Pace {
    bool alone;
    int loops, looks; /* since the last look; since the last trial */
    int patience;     /* looks until the next: one the other way between two this way */
    double start;     /* [s] of this look */
    double took[2];   /* [s] the last look before the trial; the trial */
} Pace;

#define CACHE_LINE                                                                                 \
    64 /* [byte] what one thread writes while others wait for something else lies apart */

/* The loop at hand and who waits for the next. Chunks are claimed, not dealt: a worker that is late or
 * asleep is not waited for. */
typedef struct Team {
    /* number of the loop; behind the last chunk that is free, the first */
    _Alignas(CACHE_LINE) _Atomic uint64_t word;
    ParallelBody *body; /* of this loop, as what follows; fixed until all chunks are done */
    void *context;
    int count, grain;
    _Alignas(CACHE_LINE) _Atomic uint64_t done; /* chunks, by workers, in all loops */
    pthread_mutex_t lock;                       /* of those that sleep */
    pthread_cond_t wake;
    atomic_int sleepers;
    int workers;
    uint64_t expected; /* chunks that workers have done in all when this loop is over */
    Pace pace;
} Team;

static Team team = {.lock = PTHREAD_MUTEX_INITIALIZER,
                    .wake = PTHREAD_COND_INITIALIZER,
                    .pace = {.patience = LEAST_PATIENCE}};
static int threads = 1;
static _Thread_local bool inside; /* a loop: one within it is the caller's own */

void parallel_set_threads(int thread_count) {
    ASSERT(thread_count >= 1);
    threads = thread_count;
    team.pace = (Pace){.patience = LEAST_PATIENCE};
}

int parallel_threads(void) { return threads; }

static void rest_a_little(void) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

static void run_chunk(ParallelBody *body, int chunk, int count, int grain, void *context) {
    int first = chunk * grain, end = first + grain < count ? first + grain : count;
    body(chunk, first, end, context);
}

/* Some chunks, first .. end - 1; none: end = first. */
typedef struct Claim {
    int first, end;
} Claim;

/* The next chunks: half of this thread's share of what is left, or one. The caller takes them from the front,
 * workers from the back: from loop to loop each meets the same things, which stay in its cache. */
static Claim claim(bool front) {
    uint64_t word = atomic_load(&team.word);
    for (;;) {
        uint64_t next = word & CHUNK_MASK, end = word >> CHUNK_BITS & CHUNK_MASK;
        if (next >= end) {
            return (Claim){0, 0};
        }
        uint64_t share = (end - next) / (2 * (uint64_t)threads), count = share > 1 ? share : 1;
        uint64_t less = front ? word + count : word - (count << CHUNK_BITS);
        if (atomic_compare_exchange_weak(&team.word, &word, less)) {
            int first = (int)(front ? next : end - count);
            return (Claim){first, first + (int)count};
        }
    }
}

/* returns how many */
static int run_claimed(bool front) {
    int count = 0;
    for (Claim mine = claim(front); mine.first < mine.end; mine = claim(front)) {
        for (int chunk = mine.first; chunk < mine.end; chunk++, count++) {
            run_chunk(team.body, chunk, team.count, team.grain, team.context);
        }
    }
    return count;
}

static uint64_t loop_number(uint64_t word) { return word >> 2 * CHUNK_BITS; }

static void await_loop(uint64_t last) {
    for (int k = 0; k < SPINS; k++) {
        if (loop_number(atomic_load(&team.word)) != last) {
            return;
        }
        rest_a_little();
    }
    pthread_mutex_lock(&team.lock);
    atomic_fetch_add(&team.sleepers, 1);
    while (loop_number(atomic_load(&team.word)) == last) {
        pthread_cond_wait(&team.wake, &team.lock);
    }
    atomic_fetch_sub(&team.sleepers, 1);
    pthread_mutex_unlock(&team.lock);
}

static void *work(void *unused) {
    (void)unused;
    inside = true;
    for (;;) {
        uint64_t last = loop_number(atomic_load(&team.word));
        int count = run_claimed(false);
        if (count > 0) {
            atomic_fetch_add(&team.done, (uint64_t)count);
        }
        await_loop(last);
    }
    return NULL;
}

/* signals are the caller's */
static void hire(void) {
    if (team.workers >= threads - 1) {
        return;
    }
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    while (team.workers < threads - 1) {
        pthread_t thread;
        if (pthread_create(&thread, NULL, work, NULL) != 0) {
            threads = team.workers + 1; /* fewer do as well */
            break;
        }
        pthread_detach(thread);
        team.workers++;
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
}

/* until all chunks are done; a worker that lost its processor keeps its chunk */
static void await_workers(void) {
    for (long k = 0; atomic_load(&team.done) != team.expected; k++) {
        if (k < SPINS) {
            rest_a_little();
        } else {
            sched_yield();
        }
    }
}

static void look_at_clock(Pace *pace) {
    double now = clock_seconds(), took = now - pace->start;
    int trial = ++pace->looks - pace->patience; /* looks of it that are over */
    pace->start = now;
    pace->loops = 0;
    if (trial == 0 || trial == 1) {
        pace->took[trial] = took;
        pace->alone = !pace->alone;
    } else if (trial == 2) {
        bool better = pace->took[1] < BETTER * 0.5 * (pace->took[0] + took);
        int longer =
            LONGER * pace->patience < MOST_PATIENCE ? LONGER * pace->patience : MOST_PATIENCE;
        pace->alone = pace->alone != better;
        pace->patience = better ? LEAST_PATIENCE : longer;
        pace->looks = 0;
    }
}

static bool is_alone(Pace *pace) {
    if (++pace->loops >= LOOK_LOOPS) {
        look_at_clock(pace);
    }
    return pace->alone;
}

void parallel_for(int count, int grain, ParallelBody *body, void *context) {
    int chunk_count = parallel_chunk_count(count, grain);
    if (threads == 1 || chunk_count <= 1 || inside || is_alone(&team.pace)) {
        for (int chunk = 0; chunk < chunk_count; chunk++) {
            run_chunk(body, chunk, count, grain, context);
        }
        return;
    }
    ASSERT((uint64_t)chunk_count <= CHUNK_MASK);
    hire();
    team.body = body, team.context = context, team.count = count, team.grain = grain;
    uint64_t number =
        loop_number(atomic_load(&team.word)) + 1; /* the first chunk is the caller's */
    atomic_store(&team.word, number << 2 * CHUNK_BITS | (uint64_t)chunk_count << CHUNK_BITS | 1);
    if (atomic_load(&team.sleepers) > 0) {
        pthread_mutex_lock(&team.lock);
        pthread_cond_broadcast(&team.wake);
        pthread_mutex_unlock(&team.lock);
    }
    inside = true;
    run_chunk(body, 0, count, grain, context);
    int own = 1 + run_claimed(true);
    inside = false;
    team.expected += (uint64_t)(chunk_count - own);
    await_workers();
}

typedef struct AllJob {
    const ParallelLoop *loops;
    struct {
        int loop, chunk;
    } order[PARALLEL_MOST_CHUNKS];
} AllJob;

static void all_chunk(int chunk, int first, int end, void *context) {
    (void)first, (void)end;
    const AllJob *job = context;
    const ParallelLoop *loop = &job->loops[job->order[chunk].loop];
    run_chunk(loop->body, job->order[chunk].chunk, loop->count, loop->grain, loop->context);
}

static int chunks_of(const ParallelLoop *loop) {
    return parallel_chunk_count(loop->count, loop->grain);
}

/* chunks of all loops by the place of their middle in the loop; returns how many */
static int order_chunks(AllJob *job, int loop_count, int total) {
    int done[PARALLEL_MOST_LOOPS] = {0};
    for (int n = 0; n < total; n++) {
        int next = 0;
        for (int k = 1; k < loop_count; k++) {
            int chunks = chunks_of(&job->loops[k]), other = chunks_of(&job->loops[next]);
            bool before =
                done[next] == other || (2 * done[k] + 1) * other < (2 * done[next] + 1) * chunks;
            next = done[k] < chunks && before ? k : next;
        }
        job->order[n].loop = next;
        job->order[n].chunk = done[next]++;
    }
    return total;
}

void parallel_for_all(const ParallelLoop *loops, int loop_count) {
    int total = 0;
    ASSERT(loop_count <= PARALLEL_MOST_LOOPS);
    for (int k = 0; k < loop_count; k++) {
        total += chunks_of(&loops[k]);
    }
    if (threads == 1 || inside || total > PARALLEL_MOST_CHUNKS) {
        for (int k = 0; k < loop_count; k++) {
            parallel_for(loops[k].count, loops[k].grain, loops[k].body, loops[k].context);
        }
        return;
    }
    AllJob job = {.loops = loops};
    parallel_for(order_chunks(&job, loop_count, total), 1, all_chunk, &job);
}

int parallel_close_up(int *list, const int *found, int count, int grain) {
    int sum = 0;
    for (int k = 0; k < parallel_chunk_count(count, grain); k++) {
        memmove(list + sum, list + (size_t)k * (size_t)grain, (size_t)found[k] * sizeof *list);
        sum += found[k];
    }
    return sum;
}

typedef struct SumJob {
    ParallelTerms *terms;
    const void *context;
    int begin;   /* the first of this block */
    double *out; /* (SUM_BLOCK) */
} SumJob;

static void sum_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const SumJob *job = context;
    job->terms(job->begin + first, job->begin + end, job->context, job->out + first);
}

double parallel_sum(double sum, int count, int grain, ParallelTerms *terms, const void *context) {
    double out[SUM_BLOCK] = {0};
    SumJob job = {terms, context, 0, out};
    for (; job.begin < count; job.begin += SUM_BLOCK) {
        int block = count - job.begin < SUM_BLOCK ? count - job.begin : SUM_BLOCK;
        parallel_for(block, grain, sum_chunk, &job);
        for (int k = 0; k < block; k++) {
            sum += out[k];
        }
    }
    return sum;
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
