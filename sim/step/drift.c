#include "sim/step/drift.h"

#include <math.h>

#include "sim/base/parallel.h"

/* a drift repeats nothing: chunks are parts of those of the kick */
#define DRIFT_PARTS 3

static int grain_of(const Drift *d, int c) { return (d->grain[c] + DRIFT_PARTS - 1) / DRIFT_PARTS; }

Drift drift_create(const System *system, const SweepLattice *lattices, const int *grain,
                   const Lanes *lanes, const int *slot) {
    Drift d = {system, sweep_kernel_best(), lattices, grain, lanes, slot, NULL};
    int chunks = 1;
    for (int c = 0; c < system->cloth_count; c++) {
        if (lattices[c].nu > 0) {
            int own = parallel_chunk_count(lattices[c].nv, grain_of(&d, c));
            chunks = own > chunks ? own : chunks;
        }
    }
    d.chunk_speed = arena_push(system->arena, SweepSpeed, chunks);
    return d;
}

typedef struct DriftJob {
    const Drift *drift;
    const SweepLattice *lattice;
    SweepDrift one;
} DriftJob;

static void drift_chunk(int chunk, int first, int end, void *context) {
    DriftJob *job = context;
    job->drift->chunk_speed[chunk] =
        job->drift->kernel->drift(job->lattice, job->drift->lanes, &job->one, first, end);
}

/* ghosts of a lattice, or all nodes of other cloth */
static double drift_place(const Drift *d, int place, const SweepDrift *one) {
    const Lanes *l = d->lanes;
    int slot = d->slot[place];
    double square = 0.0;
    for (int a = 0; a < 3; a++) {
        double v = l->v[a][slot], *x = &l->x[a][slot];
        *x += one->dt * v;
        square += v * v;
        if (l->bent[a] != l->x[a]) {
            l->bent[a][slot] = *x + one->bent * v;
        }
        if (l->stretched[a] != l->x[a]) {
            l->stretched[a][slot] = *x + one->stretched * v;
        }
    }
    return square;
}

/* [m2/s2] of the fastest; places from `first` on, up to those of the next cloth */
static double drift_places(const Drift *d, int c, int first, const SweepDrift *one) {
    double square = 0.0;
    for (int i = first; i < d->system->first[c + 1]; i++) {
        square = max2(drift_place(d, i, one), square);
    }
    return square;
}

/* [m/s] of all cloth in a drift; of frames, see sweep.h */
typedef struct Drifted {
    double within, relative; /* in a frame; of two nodes next to each other */
    Box frames;
} Drifted;

static void add_speeds(Drifted *all, const SweepSpeed *speed, int count) {
    double within = 0.0, shear = 0.0;
    for (int k = 0; k < count; k++) {
        within = max2(speed[k].within, within), shear = max2(speed[k].shear, shear);
        all->frames = box_union(all->frames, speed[k].frames);
    }
    within = sqrt(within);
    all->within = max2(within, all->within);
    all->relative = max2(2.0 * within + sqrt(shear), all->relative);
}

static ContactSpeeds speeds_of(const Drifted *all) {
    Vec3 low = all->frames.low, high = all->frames.high;
    Vec3 most = {max2(-low.x, high.x), max2(-low.y, high.y), max2(-low.z, high.z)};
    return (ContactSpeeds){.fastest = all->within + vec3_length(most),
                           .mutual = 2.0 * all->within + vec3_length(vec3_sub(high, low)),
                           .relative = all->relative};
}

ContactSpeeds drift_all(const Drift *d, double dt, const double *bent, const double *stretched,
                        bool frames) {
    Drifted all = {0.0, 0.0, box_empty()};
    double ghosts = 0.0;
    for (int c = 0; c < d->system->cloth_count; c++) {
        const SweepLattice *l = &d->lattices[c];
        SweepDrift one = {dt, bent[c], stretched[c], frames};
        int first = d->system->first[c];
        if (l->nu > 0) {
            DriftJob job = {d, l, one};
            parallel_for(l->nv, grain_of(d, c), drift_chunk, &job);
            add_speeds(&all, d->chunk_speed, parallel_chunk_count(l->nv, grain_of(d, c)));
            first += d->system->cloths[c].node_count;
            ghosts = max2(drift_places(d, c, first, &one), ghosts);
            sweep_wrap_rows(l, d->lanes->x);
            sweep_wrap_rows(l, d->lanes->bent);
            sweep_wrap_rows(l, d->lanes->stretched);
        } else {
            SweepSpeed speed = {drift_places(d, c, first, &one), {{0, 0, 0}, {0, 0, 0}}, 0.0};
            add_speeds(&all, &speed, 1);
        }
    }
    ContactSpeeds speeds = speeds_of(&all);
    speeds.fastest = max2(sqrt(ghosts), speeds.fastest);
    return speeds;
}
