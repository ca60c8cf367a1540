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
    Looks l = {system, looks_kernel(vector_best()), lanes, slot, lattices, grain, NULL, NULL,
               {NULL}};
    int chunks = 1;
    for (int c = 0; c < system->cloth_count; c++) {
        if (lattices[c].nu > 0) {
            int own = parallel_chunk_count(lattices[c].nv, grain[c]);
            chunks = own > chunks ? own : chunks;
        }
    }
    l.chunk_most = (double(*)[2])arena_push(system->arena, double, 2 * chunks);
    l.chunk_box = arena_push(system->arena, Box, chunks);
    for (int a = 0; a < 3; a++) {
        l.marked[a] = arena_push(system->arena, double, lanes->slot_count);
    }
    return l;
}

/* [m2] or [m2/s2] square of the difference of x - from at two places, or of x alone */
static double square_apart(const Looks *l, double *const x[3], double *const from[3], int a,
                           int b) {
    double square = 0.0;
    int s = l->slot[a], t = l->slot[b];
    for (int k = 0; k < 3; k++) {
        double d = x[k][t] - x[k][s], before = from ? from[k][t] - from[k][s] : 0.0;
        square += (d - before) * (d - before);
    }
    return square;
}

/* as LookKernel.spread, of cloth on a lattice that no sweep moves */
static void spread_of_other(const Looks *l, int c, double *const x[3], double *const from[3],
                            double most[2]) {
    const Panel *panel = &l->system->cloths[c].panel;
    most[0] = most[1] = 0.0;
    for (int k = 0; k < panel->nu * panel->nv; k++) {
        int i = k % panel->nu, at = l->system->first[c] + k, row = at - i;
        if (i + 1 < panel->nu || panel->wrap) {
            int right = i + 1 < panel->nu ? at + 1 : row;
            most[0] = max2(most[0], square_apart(l, x, from, at, right));
        }
        if (k + panel->nu < panel->nu * panel->nv) {
            most[1] = max2(most[1], square_apart(l, x, from, at, at + panel->nu));
        }
    }
}

typedef struct LookJob {
    Looks *looks;
    const SweepLattice *lattice;
} LookJob;

/* largest values of the chunks of a cloth that a sweep moves */
static void most_of_chunks(Looks *l, int c, ParallelBody *body, double most[2]) {
    const SweepLattice *lattice = &l->lattices[c];
    LookJob job = {l, lattice};
    most[0] = most[1] = 0.0;
    parallel_for(lattice->nv, l->grain[c], body, &job);
    for (int k = 0; k < parallel_chunk_count(lattice->nv, l->grain[c]); k++) {
        most[0] = max2(l->chunk_most[k][0], most[0]);
        most[1] = max2(l->chunk_most[k][1], most[1]);
    }
}

static void fastest_chunk(int chunk, int first, int end, void *context) {
    LookJob *job = context;
    Looks *l = job->looks;
    l->chunk_most[chunk][0] = l->kernel->fastest(job->lattice, l->lanes, first, end);
    l->chunk_most[chunk][1] = 0.0;
}

static double fastest_now(void *owner) {
    Looks *l = owner;
    double fastest = 0.0;
    for (int c = 0; c < l->system->cloth_count; c++) {
        double most[2];
        if (l->lattices[c].nu > 0) {
            most_of_chunks(l, c, fastest_chunk, most);
            fastest = max2(fastest, most[0]);
            continue;
        }
        for (int i = l->system->first[c]; i < l->system->first[c + 1]; i++) {
            int s = l->slot[i];
            double x = l->lanes->v[0][s], y = l->lanes->v[1][s], z = l->lanes->v[2][s];
            fastest = max2(fastest, x * x + y * y + z * z);
        }
    }
    return sqrt(fastest);
}

static double *const *mark_places(void *owner, double ahead) {
    Looks *l = owner;
    l->kernel->lead(l->lanes->x, l->lanes->v, l->marked, ahead, l->lanes->slot_count);
    for (int c = 0; c < l->system->cloth_count && ahead > 0.0; c++) {
        sweep_wrap_rows(&l->lattices[c], l->marked);
    }
    return l->marked;
}

/* ContactMotion.spread of x - from, or of x; `body` finds it on the lattices of sweeps */
static double spread_of_all(Looks *l, ParallelBody *body, double *const x[3],
                            double *const from[3]) {
    double square = 0.0;
    for (int c = 0; c < l->system->cloth_count; c++) {
        const Panel *panel = &l->system->cloths[c].panel;
        double most[2];
        if (panel->nu == 0) {
            continue;
        }
        if (l->lattices[c].nu > 0) {
            most_of_chunks(l, c, body, most);
        } else {
            spread_of_other(l, c, x, from, most);
        }
        double u = 1.0 / (panel->h1 * panel->h1), v = 1.0 / (panel->h2 * panel->h2);
        square = max2(square, (most[0] * u + most[1] * v) / (u + v));
    }
    return sqrt(square);
}

static void spread_chunk(int chunk, int first, int end, void *context) {
    LookJob *job = context;
    Looks *l = job->looks;
    l->kernel->spread(job->lattice, l->lanes->x, l->marked, first, end, l->chunk_most[chunk]);
}

static double spread_now(void *owner) {
    Looks *l = owner;
    return spread_of_all(l, spread_chunk, l->lanes->x, l->marked);
}

static void moved_chunk(int chunk, int first, int end, void *context) {
    LookJob *job = context;
    Looks *l = job->looks;
    l->chunk_box[chunk] = l->kernel->moved(job->lattice, l->lanes->x, l->marked, first, end);
}

/* adds x - marked of a cloth that no sweep moves */
static void box_other(const Looks *l, int c, Box *box) {
    double *const *x = l->lanes->x, *const *from = l->marked;
    int first = l->system->first[c];
    for (int i = first; i < first + l->system->cloths[c].node_count; i++) {
        int s = l->slot[i];
        box_add(box, vec3(x[0][s] - from[0][s], x[1][s] - from[1][s], x[2][s] - from[2][s]));
    }
}

static double mutual_now(void *owner) {
    Looks *l = owner;
    Box box = box_empty();
    for (int c = 0; c < l->system->cloth_count; c++) {
        const SweepLattice *lattice = &l->lattices[c];
        if (lattice->nu == 0) {
            box_other(l, c, &box);
            continue;
        }
        LookJob job = {l, lattice};
        parallel_for(lattice->nv, l->grain[c], moved_chunk, &job);
        for (int k = 0; k < parallel_chunk_count(lattice->nv, l->grain[c]); k++) {
            box = box_union(box, l->chunk_box[k]);
        }
    }
    return vec3_length(vec3_sub(box.high, box.low));
}

static void relative_chunk(int chunk, int first, int end, void *context) {
    LookJob *job = context;
    Looks *l = job->looks;
    l->kernel->spread(job->lattice, l->lanes->v, NULL, first, end, l->chunk_most[chunk]);
}

static double relative_now(void *owner) {
    Looks *l = owner;
    for (int c = 0; c < l->system->cloth_count; c++) {
        sweep_wrap_rows(&l->lattices[c], l->lanes->v);
    }
    return spread_of_all(l, relative_chunk, l->lanes->v, NULL);
}

ContactMotion looks_motion(Looks *looks) {
    bool framed = true;
    for (int c = 0; c < looks->system->cloth_count; c++) {
        framed = framed && (looks->lattices[c].nu > 0 || looks->system->cloths[c].panel.nu == 0);
    }
    return (ContactMotion){fastest_now,  mark_places, spread_now, mutual_now,
                           relative_now, framed,      looks};
}
