/* parallel.h: loops over several threads that give the same bits for any thread count.
 *
 * A loop is cut into chunks of `grain` items, whatever the thread count; each chunk
 * writes only to places of its own; sums are taken over chunks in order afterwards.
 * Chunks are claimed: nobody waits for a thread that did not come. Now and then both ways are timed, and
 * the caller does all of it while that is quicker, as where other programs want the processors.
 * Thread-safety: one thread calls; a loop within a chunk is that chunk's own.
 */
#ifndef TOILE_BASE_PARALLEL_H
#define TOILE_BASE_PARALLEL_H

/* Works on items first .. end-1. `chunk` numbers the chunks from 0. */
typedef void ParallelBody(int chunk, int first, int end, void *context);

void parallel_set_threads(int thread_count); /* at least 1 */
int parallel_threads(void);

/* Calls body for every chunk of 0 .. count-1. A grain below some 10 us of work is not
 * worth a thread. */
void parallel_for(int count, int grain, ParallelBody *body, void *context);

typedef struct ParallelLoop {
    int count, grain;
    ParallelBody *body;
    void *context;
} ParallelLoop;

#define PARALLEL_MOST_LOOPS 4
/* of loops that are done together; more are done one loop after another */
#define PARALLEL_MOST_CHUNKS 128

/* Loops of which none needs another, started once: what lies alike in them is done by the same thread. */
void parallel_for_all(const ParallelLoop *loops, int loop_count);

static inline int parallel_chunk_count(int count, int grain) { return (count + grain - 1) / grain; }

/* For chunks that each left found[chunk] numbers in the list from their first item on: closes the gaps.
 * Returns how many numbers there are. */
int parallel_close_up(int *list, const int *found, int count, int grain);

/* Finds the numbers first .. end-1 of a sum: into out[0] and those that follow. */
typedef void ParallelTerms(int first, int end, const void *context, double *out);

/* `sum` and `count` numbers more, added in turn: the bits of one loop over all of them. */
double parallel_sum(double sum, int count, int grain, ParallelTerms *terms, const void *context);

/* Fixes the environment that OpenMP and OpenBLAS read when they are loaded: BLAS on one
 * thread, waiting threads sleep (a spinning thread makes a busy machine 20 times slower).
 * Starts the program again, once, when something had to be changed. */
void parallel_fix_environment(char **argv);

/* Between hold and release libraries that would open threads of their own run on the caller's.
 * parallel_release takes what parallel_hold returned. */
int parallel_hold(void);
void parallel_release(int levels);

#endif
