#include "sim/step/inertia.h"

#include <string.h>

#include "sim/base/parallel.h"

#define REACH 2 /* rows */

/* of conjugate gradients: of the square of the first residual; the condition number is 25 */
#define HIDDEN_TOLERANCE 1e-6
#define HIDDEN_ITERATIONS 60

static ptrdiff_t row_start(const SweepLattice *l, int j) {
    return l->first + (ptrdiff_t)j * l->stride;
}

InertiaBlocks inertia_blocks_create(const SweepLattice *l, Arena *arena) {
    int columns = (l->nu + INERTIA_BLOCK - 1) / INERTIA_BLOCK;
    return (InertiaBlocks){columns, arena_push(arena, unsigned char, l->nv),
                           arena_push(arena, unsigned char, l->nv *columns)};
}

void inertia_blocks_clear(InertiaBlocks *blocks, const SweepLattice *l, double *const lane[3],
                          int first, int end) {
    for (int j = first; j < end; j++) {
        unsigned char *one = blocks->one + (size_t)j * (size_t)blocks->columns;
        for (int b = 0; b < blocks->columns && blocks->some[j]; b++) {
            int i = b * INERTIA_BLOCK, left = l->nu - i;
            size_t count = (size_t)(left < INERTIA_BLOCK ? left : INERTIA_BLOCK);
            for (int a = 0; a < 3 && one[b]; a++) {
                memset(lane[a] + row_start(l, j) + i, 0, count * sizeof(double));
            }
            one[b] = 0;
        }
        blocks->some[j] = 0;
    }
}

Inertia inertia_create(const System *system, int slot_count, size_t chunks) {
    static InertiaKernel *const *const kernels[] = {&inertia_kernel_scalar, &inertia_kernel_sse2,
                                                    &inertia_kernel_avx2, &inertia_kernel_avx512};
    Inertia inertia = {.kernel = *kernels[vector_best()],
                       .held = arena_push(system->arena, int, system->place_count),
                       .held_first = arena_push(system->arena, int, system->cloth_count + 1)};
    for (int a = 0; a < 3; a++) {
        inertia.moved[a] = arena_push(system->arena, double, slot_count);
        inertia.pulled[a] = arena_push(system->arena, double, slot_count);
        inertia.search[a] = arena_push(system->arena, double, slot_count);
        inertia.residual[a] = arena_push(system->arena, double, slot_count);
        inertia.solution[a] = arena_push(system->arena, double, slot_count);
        inertia.kept[a] = arena_push(system->arena, double, system->place_count);
    }
    int rows = 1;
    for (int c = 0; c < system->cloth_count; c++) {
        const SweepLattice *l = system->cloths[c].lattice;
        size_t stride = l ? (size_t)l->stride : 0;
        rows = l && l->nv > rows ? l->nv : rows;
        inertia.buffer_size = stride > inertia.buffer_size ? stride : inertia.buffer_size;
    }
    inertia.buffer_size += LANE_MARGIN;
    inertia.row_sums = arena_push(system->arena, double, rows);
    inertia.buffers = arena_push(system->arena, double, chunks *inertia.buffer_size);
    return inertia;
}

void inertia_begin(Inertia *inertia, const Steer *steer, const int *slot) {
    const System *system = steer->system;
    int at = 0;
    for (int c = 0; c < system->cloth_count; c++) {
        inertia->held_first[c] = at;
        int end = system->first[c] + system->cloths[c].node_count;
        for (int i = system->first[c]; i < end; i++) {
            inertia->held[at] = slot[i];
            at += steer->held[i] != 0;
        }
    }
    inertia->held_first[system->cloth_count] = at;
}

static void clear_held(const Inertia *inertia, double *const lane[3], int c) {
    for (int k = inertia->held_first[c]; k < inertia->held_first[c + 1]; k++) {
        for (int a = 0; a < 3; a++) {
            lane[a][inertia->held[k]] = 0.0;
        }
    }
}

static void keep_held(const Inertia *inertia, const Lanes *lanes, int c) {
    for (int k = inertia->held_first[c]; k < inertia->held_first[c + 1]; k++) {
        for (int a = 0; a < 3; a++) {
            inertia->kept[a][k] = lanes->v[a][inertia->held[k]];
        }
    }
}

static void restore_held(const Inertia *inertia, const Lanes *lanes, int c) {
    for (int k = inertia->held_first[c]; k < inertia->held_first[c + 1]; k++) {
        for (int a = 0; a < 3; a++) {
            lanes->v[a][inertia->held[k]] = inertia->kept[a][k];
        }
    }
}

typedef struct InertiaJob {
    const Inertia *inertia;
    InertiaChange change;
    const InertiaBlocks *blocks; /* NULL: every block changed */
} InertiaJob;

/* does a change in blocks b - 1 .. b + 1 of a row reach block b of row j? */
static bool reaches(const InertiaBlocks *blocks, int row_count, int j, int b) {
    int low = b > 0 ? b - 1 : b, high = b + 1 < blocks->columns ? b + 1 : b;
    int begin = j > REACH ? j - REACH : 0;
    for (int row = begin; row <= j + REACH && row < row_count; row++) {
        const unsigned char *one = blocks->one + (size_t)row * (size_t)blocks->columns;
        if (blocks->some[row] && (one[low] | one[b] | one[high])) {
            return true;
        }
    }
    return false;
}

static bool reaches_row(const InertiaBlocks *blocks, int row_count, int j) {
    unsigned char some = 0;
    for (int row = j > REACH ? j - REACH : 0; row <= j + REACH && row < row_count; row++) {
        some |= blocks->some[row];
    }
    return some;
}

/* the blocks of a row in runs; a wrapped row as a whole, since its ends meet */
static void spread_row(const Inertia *inertia, const InertiaChange *change,
                       const InertiaBlocks *blocks, int j, double *buffer) {
    const SweepLattice *l = change->lattice;
    if (l->wrap) {
        inertia->kernel(change, j, 0, l->nu, buffer);
        return;
    }
    for (int b = 0, begin = 0; b <= blocks->columns; b++) {
        if (b < blocks->columns && reaches(blocks, l->nv, j, b)) {
            continue;
        }
        int end = b * INERTIA_BLOCK < l->nu ? b * INERTIA_BLOCK : l->nu;
        if (end > begin) {
            inertia->kernel(change, j, begin, end, buffer);
        }
        begin = (b + 1) * INERTIA_BLOCK;
    }
}

static void spread_chunk(int chunk, int first, int end, void *context) {
    const InertiaJob *job = context;
    const SweepLattice *l = job->change.lattice;
    double *buffer = job->inertia->buffers + job->inertia->buffer_size * (size_t)chunk;
    for (int j = first; j < end; j++) {
        if (!job->blocks) {
            job->inertia->kernel(&job->change, j, 0, l->nu, buffer);
        } else if (reaches_row(job->blocks, l->nv, j)) {
            spread_row(job->inertia, &job->change, job->blocks, j, buffer);
        }
    }
}

/* v += S moved - share moved, where a change of `blocks` reaches, or everywhere */
static void spread(const Inertia *inertia, const SweepLattice *l, double *const moved[3],
                   double *const v[3], double share, const InertiaBlocks *blocks, int grain) {
    InertiaJob job = {inertia, {l, moved, v, share}, blocks};
    parallel_for(l->nv, grain, spread_chunk, &job);
}

/* the same for cloth c; what is held changes by nothing */
static void spread_cloth(const Inertia *inertia, const SweepLattice *l, double *const moved[3],
                         const Lanes *lanes, int c, double share, const InertiaBlocks *blocks,
                         int grain) {
    keep_held(inertia, lanes, c);
    clear_held(inertia, moved, c);
    spread(inertia, l, moved, lanes->v, share, blocks, grain);
    restore_held(inertia, lanes, c);
}

void inertia_spread(Inertia *inertia, const SweepLattice *l, const Lanes *lanes, int c, int grain) {
    spread_cloth(inertia, l, inertia->moved, lanes, c, 1.0, NULL, grain);
}

void inertia_spread_blocks(Inertia *inertia, const SweepLattice *l, const Lanes *lanes, int c,
                           double share, const InertiaBlocks *blocks, int grain) {
    spread_cloth(inertia, l, inertia->pulled, lanes, c, share, blocks, grain);
}

static void copy_rows(const SweepLattice *l, double *const from[3], double *const to[3]) {
    size_t at = (size_t)l->first, count = (size_t)l->nv * (size_t)l->stride;
    for (int a = 0; a < 3; a++) {
        memcpy(to[a] + at, from[a] + at, count * sizeof(double));
    }
}

void inertia_enter(Inertia *inertia, const SweepLattice *l, const Lanes *lanes, int c, int grain) {
    copy_rows(l, lanes->v, inertia->search);
    keep_held(inertia, lanes, c);
    spread(inertia, l, inertia->search, lanes->v, 1.0, NULL, grain);
    restore_held(inertia, lanes, c);
}

/* ---- conjugate gradients for S u = v ---- */

typedef struct HiddenJob {
    Inertia *inertia;
    const SweepLattice *lattice;
    const double *weight;
    double length, ratio;        /* of a step along the search; of two residuals */
    double *const *a, *const *b; /* of a product */
} HiddenJob;

/* sums of a M b, row by row */
static void multiply_rows(int chunk, int first, int end, void *context) {
    (void)chunk;
    const HiddenJob *job = context;
    double *const *a = job->a, *const *b = job->b;
    for (int j = first; j < end; j++) {
        double sum = 0.0;
        ptrdiff_t at = row_start(job->lattice, j);
        for (ptrdiff_t s = at; s < at + job->lattice->nu; s++) {
            sum += (a[0][s] * b[0][s] + a[1][s] * b[1][s] + a[2][s] * b[2][s]) / job->weight[s];
        }
        job->inertia->row_sums[j] = sum;
    }
}

/* solution += length search, residual -= length S search */
static void step_rows(int chunk, int first, int end, void *context) {
    (void)chunk;
    const HiddenJob *job = context;
    const Inertia *inertia = job->inertia;
    for (int j = first; j < end; j++) {
        ptrdiff_t at = row_start(job->lattice, j);
        for (int a = 0; a < 3; a++) {
            for (ptrdiff_t s = at; s < at + job->lattice->nu; s++) {
                inertia->solution[a][s] += job->length * inertia->search[a][s];
                inertia->residual[a][s] -= job->length * inertia->moved[a][s];
            }
        }
    }
}

/* search = residual + ratio search; moved = 0 */
static void turn_rows(int chunk, int first, int end, void *context) {
    (void)chunk;
    const HiddenJob *job = context;
    const Inertia *inertia = job->inertia;
    for (int j = first; j < end; j++) {
        ptrdiff_t at = row_start(job->lattice, j);
        for (int a = 0; a < 3; a++) {
            for (ptrdiff_t s = at; s < at + job->lattice->stride; s++) {
                inertia->search[a][s] =
                    inertia->residual[a][s] + job->ratio * inertia->search[a][s];
                inertia->moved[a][s] = 0.0;
            }
        }
    }
}

static double product(HiddenJob *job, double *const a[3], double *const b[3], int grain) {
    job->a = a, job->b = b;
    parallel_for(job->lattice->nv, grain, multiply_rows, job);
    double sum = 0.0;
    for (int j = 0; j < job->lattice->nv; j++) {
        sum += job->inertia->row_sums[j];
    }
    return sum;
}

/* inertia->moved = S search of the free nodes; held ones do not move */
static void spread_search(HiddenJob *job, int c, int grain) {
    Inertia *inertia = job->inertia;
    spread(inertia, job->lattice, inertia->search, inertia->moved, 0.0, NULL, grain);
    clear_held(inertia, inertia->moved, c);
}

double inertia_hidden(Inertia *inertia, const SweepLattice *l, const Lanes *lanes, int c,
                      int grain) {
    double *const *u = inertia->solution, *const *r = inertia->residual,
                  *const *p = inertia->search, *const *q = inertia->moved;
    HiddenJob job = {.inertia = inertia, .lattice = l, .weight = lanes->weight};
    copy_rows(l, lanes->v, r);
    clear_held(inertia, r, c);
    parallel_for(l->nv, grain, turn_rows, &job); /* starts from u = v */
    spread_search(&job, c, grain);
    job.length = 1.0;
    parallel_for(l->nv, grain, step_rows, &job);
    copy_rows(l, p, u); /* the search was v itself */
    parallel_for(l->nv, grain, turn_rows, &job);
    double square = product(&job, r, r, grain), enough = HIDDEN_TOLERANCE * square;
    for (int k = 0; k < HIDDEN_ITERATIONS && square > enough; k++) {
        spread_search(&job, c, grain);
        double before = square;
        job.length = square / product(&job, p, q, grain);
        parallel_for(l->nv, grain, step_rows, &job);
        square = product(&job, r, r, grain);
        job.ratio = square / before;
        parallel_for(l->nv, grain, turn_rows, &job);
    }
    copy_rows(l, lanes->v, p);
    clear_held(inertia, p, c);
    return 0.5 * (product(&job, p, u, grain) - product(&job, p, p, grain));
}
