#include "sim/step/damping.h"

#include <math.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/parallel.h"

#define STREAM 0x64616d70 /* of random numbers */

Damping damping_create(const System *system, const DampingView *view) {
    Damping d = {.system = system, .view = *view, .ahead = *view->lanes};
    int slots = view->lanes->slot_count, rows = 0;
    for (int a = 0; a < 3; a++) {
        d.ahead.v[a] = arena_push(system->arena, double, slots);
        d.ahead.f[a] = arena_push(system->arena, double, slots);
        d.before[a] = arena_push(system->arena, double, slots);
    }
    d.ahead.weight = arena_push(system->arena, double, slots);
    for (int s = 0; s < slots; s++) {
        d.ahead.weight[s] = 1.0;
    }
    for (int c = 0; c < system->cloth_count; c++) {
        rows = view->lattices[c].nv > rows ? view->lattices[c].nv : rows;
    }
    d.rows[0] = arena_push(system->arena, double, rows);
    d.rows[1] = arena_push(system->arena, double, rows);
    return d;
}

void damping_start(Damping *d, double time, double dt, int steps) {
    d->first = lround(time / dt);
    d->step = d->measured = 0;
    d->steps = steps;
    d->fabric = d->drag = 0.0;
    for (int a = 0; a < 3; a++) {
        d->ahead.bent[a] = d->view.lanes->bent[a];
        d->ahead.stretched[a] = d->view.lanes->stretched[a];
    }
}

static bool in_fabric(const Damping *d, int c) {
    return d->view.bending->time[c] > 0.0 || d->view.membrane->time[c] > 0.0;
}

static bool by_mass(const Damping *d, int c) {
    return d->system->damping[d->system->first[c]] > 0.0;
}

typedef struct RowJob {
    Damping *d;
    int cloth;
    const Lanes *lanes;
    double dt;
} RowJob;

static void add_forces(int chunk, int first, int end, void *context) {
    const RowJob *job = context;
    const DampingView *view = &job->d->view;
    SweepKick kick = {.dt = job->dt, .keep = 1.0};
    view->kernel->kick(&view->lattices[job->cloth], job->lanes, &kick, first, end,
                       view->buffers + view->buffer_size * (size_t)chunk);
}

/* f(ahead) - f(x) of a lattice */
static void find_by_sweep(Damping *d, int c) {
    const SweepLattice *l = &d->view.lattices[c];
    Lanes here = d->ahead;
    for (int a = 0; a < 3; a++) {
        here.bent[a] = here.stretched[a] = here.x[a];
    }
    RowJob jobs[2] = {{d, c, &d->ahead, 1.0}, {d, c, &here, -1.0}};
    for (int k = 0; k < 2; k++) {
        parallel_for(l->nv, d->view.grain[c], add_forces, &jobs[k]);
    }
}

static void gather(const Damping *d, int c, double *const lane[3], double *out) {
    for (int i = d->system->first[c]; i < d->system->first[c + 1]; i++, out += 3) {
        for (int a = 0; a < 3; a++) {
            out[a] = lane[a][d->view.slot[i]];
        }
    }
}

/* the same by the model */
static void find_by_model(Damping *d, int c) {
    const Cloth *cloth = &d->system->cloths[c];
    int first = d->system->first[c], count = d->system->first[c + 1] - first;
    double *g = d->view.gradient, *const *place = d->view.place;
    gather(d, c, d->ahead.x, place[0]);
    gather(d, c, d->ahead.bent, place[1]);
    gather(d, c, d->ahead.stretched, place[2]);
    memset(g, 0, 3 * (size_t)count * sizeof *g);
    cloth->model->add_damped_gradient(cloth, place[2], place[1], g);
    for (int k = 0; k < 3 * count; k++) {
        g[k] = -g[k];
    }
    cloth->model->add_gradient(cloth, place[0], g);
    for (int k = 0; k < 3 * count; k++) {
        d->ahead.v[k % 3][d->view.slot[first + k / 3]] = g[k];
    }
}

/* is this step measured? */
static bool draws_step(Damping *d) {
    int spans = (d->steps + DAMPING_SPAN - 1) / DAMPING_SPAN;
    spans = spans > DAMPING_LEAST_SPANS ? spans : DAMPING_LEAST_SPANS;
    int span = (d->steps + spans - 1) / spans, at = d->step++, first = at - at % span;
    int count = first + span < d->steps ? span : d->steps - first;
    if (at == first) {
        double drawn = 0.5 + 0.5 * hash_random(STREAM, (uint64_t)(d->first + first));
        d->measured = first + (int)(count * drawn);
    }
    d->span = at == d->measured ? count : 0;
    return d->span > 0;
}

void damping_before(Damping *d) {
    const System *system = d->system;
    if (!draws_step(d)) {
        return;
    }
    size_t bytes = (size_t)d->view.lanes->slot_count * sizeof(double);
    for (int a = 0; a < 3; a++) {
        memset(d->ahead.v[a], 0, bytes);
        memcpy(d->before[a], d->view.lanes->v[a], bytes);
    }
    for (int c = 0; c < system->cloth_count; c++) {
        if (!in_fabric(d, c)) {
            continue;
        }
        if (d->view.lattices[c].nu > 0) {
            find_by_sweep(d, c);
        } else {
            find_by_model(d, c);
        }
    }
}

/* [J] of one place in a step of dt */
static void add_work(const Damping *d, int c, int place, double dt, double *fabric, double *drag) {
    const System *system = d->system;
    const AirDef *air = &system->scene->air;
    double wind[3] = {air->wind.x, air->wind.y, air->wind.z}, mass = system->mass[place];
    double damping = system->damping[place], blown = air->drag / system->cloths[c].material.density;
    int s = d->view.slot[place];
    mass = d->view.held[place] ? 0.0 : mass;
    for (int a = 0; a < 3; a++) {
        double v = d->view.lanes->v[a][s], mean = 0.5 * (d->before[a][s] + v);
        *fabric -= dt * d->ahead.v[a][s] * mean;
        *drag += dt * mass * (damping * v - blown * wind[a]) * mean;
    }
}

static void count_rows(int chunk, int first, int end, void *context) {
    (void)chunk;
    const RowJob *job = context;
    const Damping *d = job->d;
    const SweepLattice *l = &d->view.lattices[job->cloth];
    for (int j = first; j < end; j++) {
        double fabric = 0.0, drag = 0.0;
        for (int i = 0; i < l->nu; i++) {
            int place = d->system->first[job->cloth] + j * l->nu + i;
            add_work(d, job->cloth, place, job->dt, &fabric, &drag);
        }
        d->rows[0][j] = fabric;
        d->rows[1][j] = drag;
    }
}

void damping_after(Damping *d, double dt) {
    const System *system = d->system;
    double fabric = 0.0, drag = 0.0;
    for (int c = 0; c < system->cloth_count && d->span > 0; c++) {
        const SweepLattice *l = &d->view.lattices[c];
        if (!in_fabric(d, c) && !by_mass(d, c)) {
            continue;
        }
        if (l->nu > 0) {
            RowJob job = {.d = d, .cloth = c, .dt = dt};
            parallel_for(l->nv, d->view.grain[c], count_rows, &job);
            for (int j = 0; j < l->nv; j++) {
                fabric += d->rows[0][j];
                drag += d->rows[1][j];
            }
        } else {
            for (int i = system->first[c]; i < system->first[c + 1]; i++) {
                add_work(d, c, i, dt, &fabric, &drag);
            }
        }
    }
    d->fabric += d->span * fabric;
    d->drag += d->span * drag;
}
