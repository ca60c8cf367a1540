#include "sim/step/inertia.h"

#include <string.h>

#include "sim/base/parallel.h"

#define REACH 2 /* rows */

/* of conjugate gradients: of the square of the first residual; the condition number is 25 */
#define HIDDEN_TOLERANCE 1e-6
#define HIDDEN_ITERATIONS 60

InertiaBlocks inertia_blocks_create(const SweepLattice *l, Arena *arena) {
    int columns = (l->nu + INERTIA_BLOCK - 1) / INERTIA_BLOCK;
    return (InertiaBlocks){columns, arena_push(arena, unsigned char, l->nv),
                           arena_push(arena, unsigned char, l->nv *columns)};
}

void inertia_blocks_clear(InertiaBlocks *blocks, int row_count) {
    size_t columns = (size_t)blocks->columns;
    for (int j = 0; j < row_count; j++) {
        if (blocks->some[j]) {
            blocks->some[j] = 0;
            memset(blocks->one + (size_t)j * columns, 0, columns);
        }
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
    for (int c = 0; c < system->cloth_count; c++) {
        const SweepLattice *l = system->cloths[c].lattice;
        size_t stride = l ? (size_t)l->stride : 0;
        inertia.buffer_size = stride > inertia.buffer_size ? stride : inertia.buffer_size;
    }
    inertia.buffer_size += LANE_MARGIN;
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

/* what is held changes by nothing */
void inertia_spread(Inertia *inertia, const SweepLattice *l, const Lanes *lanes, int c, int grain) {
    keep_held(inertia, lanes, c);
    clear_held(inertia, inertia->moved, c);
    spread(inertia, l, inertia->moved, lanes->v, 1.0, NULL, grain);
    restore_held(inertia, lanes, c);
}

static void clear_blocks(const Inertia *inertia, const SweepLattice *l,
                         const InertiaBlocks *blocks) {
    for (int k = 0; k < l->nv * blocks->columns; k++) {
        int j = k / blocks->columns, i = k % blocks->columns * INERTIA_BLOCK;
        int count = i + INERTIA_BLOCK < l->nu ? INERTIA_BLOCK : l->nu - i;
        for (int a = 0; a < 3 && blocks->one[k]; a++) {
            memset(inertia->pulled[a] + l->first + (ptrdiff_t)j * l->stride + i, 0,
                   (size_t)count * sizeof(double));
        }
    }
}

void inertia_spread_blocks(Inertia *inertia, const SweepLattice *l, const Lanes *lanes, int c,
                           double share, const InertiaBlocks *blocks, int grain) {
    keep_held(inertia, lanes, c);
    clear_held(inertia, inertia->pulled, c);
    spread(inertia, l, inertia->pulled, lanes->v, share, blocks, grain);
    restore_held(inertia, lanes, c);
    clear_blocks(inertia, l, blocks);
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

/* sum of a M b */
static double product(const SweepLattice *l, const double *weight, double *const a[3],
                      double *const b[3]) {
    double sum = 0.0;
    for (int j = 0; j < l->nv; j++) {
        ptrdiff_t at = l->first + (ptrdiff_t)j * l->stride;
        for (ptrdiff_t s = at; s < at + l->nu; s++) {
            sum += (a[0][s] * b[0][s] + a[1][s] * b[1][s] + a[2][s] * b[2][s]) / weight[s];
        }
    }
    return sum;
}

/* y += factor x */
static void add_rows(const SweepLattice *l, double factor, double *const x[3], double *const y[3]) {
    for (int j = 0; j < l->nv; j++) {
        ptrdiff_t at = l->first + (ptrdiff_t)j * l->stride;
        for (int a = 0; a < 3; a++) {
            for (ptrdiff_t s = at; s < at + l->nu; s++) {
                y[a][s] += factor * x[a][s];
            }
        }
    }
}

/* inertia->moved = S x of the free nodes; x is zero at held ones */
static void spread_free(const Inertia *inertia, const SweepLattice *l, double *const x[3], int c,
                        int grain) {
    for (int a = 0; a < 3; a++) {
        memset(inertia->moved[a] + l->first, 0, (size_t)l->nv * (size_t)l->stride * sizeof(double));
    }
    spread(inertia, l, x, inertia->moved, 0.0, NULL, grain);
    clear_held(inertia, inertia->moved, c);
}

double inertia_hidden(Inertia *inertia, const SweepLattice *l, const Lanes *lanes, int c,
                      int grain) {
    double *const *u = inertia->solution, *const *r = inertia->residual,
                  *const *p = inertia->search;
    const double *weight = lanes->weight;
    copy_rows(l, lanes->v, u);
    clear_held(inertia, u, c);
    copy_rows(l, u, r);
    spread_free(inertia, l, u, c, grain);
    add_rows(l, -1.0, inertia->moved, r);
    copy_rows(l, r, p);
    double square = product(l, weight, r, r), enough = HIDDEN_TOLERANCE * square;
    for (int k = 0; k < HIDDEN_ITERATIONS && square > enough; k++) {
        spread_free(inertia, l, p, c, grain);
        double length = square / product(l, weight, p, inertia->moved), before = square;
        add_rows(l, length, p, u);
        add_rows(l, -length, inertia->moved, r);
        square = product(l, weight, r, r);
        for (int a = 0; a < 3; a++) { /* p = r + square / before p */
            for (ptrdiff_t s = l->first; s < l->first + (ptrdiff_t)l->nv * l->stride; s++) {
                p[a][s] = r[a][s] + square / before * p[a][s];
            }
        }
    }
    copy_rows(l, lanes->v, p);
    clear_held(inertia, p, c);
    return 0.5 * (product(l, weight, p, u) - product(l, weight, p, p));
}
