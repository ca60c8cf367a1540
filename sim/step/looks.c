#include "sim/step/looks.h"

#include <math.h>
#include <string.h>

#include "sim/base/parallel.h"

const LookKernel *looks_kernel(VectorWidth width) {
    static const LookKernel *const kernels[] = {&look_kernel_scalar, &look_kernel_sse2,
                                                &look_kernel_avx2, &look_kernel_avx512};
    return kernels[width];
}

Looks looks_create(const System *system, const Lanes *lanes, const int *slot,
                   const SweepLattice *lattices, const int *grain) {
    Looks l = {system, looks_kernel(vector_best()), lanes, slot, lattices, grain, NULL, {NULL}};
    int chunks = 1;
    for (int c = 0; c < system->cloth_count; c++) {
        if (lattices[c].nu > 0) {
            int own = parallel_chunk_count(lattices[c].nv, grain[c]);
            chunks = own > chunks ? own : chunks;
        }
    }
    l.chunk_most = arena_push(system->arena, double, chunks);
    for (int a = 0; a < 3; a++) {
        l.marked[a] = arena_push(system->arena, double, lanes->slot_count);
    }
    return l;
}

typedef struct LookJob {
    Looks *looks;
    const SweepLattice *lattice;
} LookJob;

/* root of the largest value of a chunk over all lattices */
static double most_of_chunks(Looks *l, ParallelBody *body) {
    double most = 0.0;
    for (int c = 0; c < l->system->cloth_count; c++) {
        const SweepLattice *lattice = &l->lattices[c];
        if (lattice->nu > 0) {
            LookJob job = {l, lattice};
            parallel_for(lattice->nv, l->grain[c], body, &job);
            for (int k = 0; k < parallel_chunk_count(lattice->nv, l->grain[c]); k++) {
                most = max2(l->chunk_most[k], most);
            }
        }
    }
    return sqrt(most);
}

static void fastest_chunk(int chunk, int first, int end, void *context) {
    LookJob *job = context;
    Looks *l = job->looks;
    l->chunk_most[chunk] = l->kernel->fastest(job->lattice, l->lanes, first, end);
}

static double fastest_now(void *owner) {
    Looks *l = owner;
    double fastest = most_of_chunks(l, fastest_chunk), other = 0.0;
    for (int c = 0; c < l->system->cloth_count; c++) {
        int first = l->system->first[c], end = l->system->first[c + 1];
        for (int i = first; l->lattices[c].nu == 0 && i < end; i++) {
            int s = l->slot[i];
            double x = l->lanes->v[0][s], y = l->lanes->v[1][s], z = l->lanes->v[2][s];
            other = max2(other, x * x + y * y + z * z);
        }
    }
    return max2(fastest, sqrt(other));
}

static void mark_places(void *owner) {
    Looks *l = owner;
    for (int a = 0; a < 3; a++) {
        memcpy(l->marked[a], l->lanes->x[a], (size_t)l->lanes->slot_count * sizeof(double));
    }
}

static void spread_chunk(int chunk, int first, int end, void *context) {
    LookJob *job = context;
    Looks *l = job->looks;
    l->chunk_most[chunk] = l->kernel->spread(job->lattice, l->lanes->x, l->marked, first, end);
}

static double spread_now(void *owner) { return most_of_chunks(owner, spread_chunk); }

static void relative_chunk(int chunk, int first, int end, void *context) {
    LookJob *job = context;
    Looks *l = job->looks;
    l->chunk_most[chunk] = l->kernel->spread(job->lattice, l->lanes->v, NULL, first, end);
}

static double relative_now(void *owner) {
    Looks *l = owner;
    for (int c = 0; c < l->system->cloth_count; c++) {
        sweep_wrap_rows(&l->lattices[c], l->lanes->v);
    }
    return most_of_chunks(l, relative_chunk);
}

ContactMotion looks_motion(Looks *looks) {
    return (ContactMotion){fastest_now, mark_places, spread_now, relative_now, looks};
}
