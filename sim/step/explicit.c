#include "sim/step/explicit.h"

#include <math.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/step/air.h"
#include "sim/step/bounds.h"
#include "sim/step/damping.h"
#include "sim/step/drift.h"
#include "sim/step/impulse.h"
#include "sim/step/lead.h"
#include "sim/step/looks.h"
#include "sim/step/steer.h"
#include "sim/step/stepper.h"

/* nodes a thread takes at once, some 10 us; with fewer, starting the threads costs more than they
 * save, and each chunk repeats a row of cells and two of moments */
#define NODE_GRAIN 1000
/* An interval ends where energy of so many times what is at hand came from nowhere: it will be refused, and
 * lists of what nearly meets at such speeds would fill the memory. Speeds between positions alone may make it
 * three times as much. */
#define BURST_SHARE 5.0
#define BURST_STEP 1.25  /* of its speed: lists grow with a power of it */
#define BURST_LEAST 0.01 /* of its size: how high that lifts the cloth, where nothing is at hand */
/* ... or where a step is so many times the limit of the cloth as it is stretched: where handles pull, most of what is
 * at hand is theirs, and the energy says so too late. */
#define BURST_LIMITS 1.2

struct Explicit {
    const System *system;
    const SweepKernel *kernel;
    Lanes lanes;
    int *slot;              /* (place_count) */
    SweepLattice *lattices; /* (cloth_count) with first slots; nu = 0: no sweep */
    double *buffers;        /* row buffers, one set a chunk */
    size_t buffer_size;     /* [double] of one chunk */
    Drift drift;
    size_t chunks;        /* most of one cloth */
    int *grain;           /* (cloth_count) rows of a chunk */
    double *x, *gradient; /* (place_count x 3) for cloths without a sweep */
    double *ahead[2];     /* [m] (place_count x 3) likewise: bent, stretched */
    Steer steer;          /* what handles hold */
    Bounds bounds;
    Contact *contact; /* NULL: nothing can touch */
    Looks looks;      /* that it asks for */
    Lead bending, membrane;
    Damping damping; /* the book of it */
    double damped;   /* [J] of this interval: by mass damping, of cloths without a sweep */
    double air_work; /* [J] of this interval, on faces */
    double limit[2]; /* [s] with true and with scaled inertia */
    double elastic;  /* [J] at the end of the last interval */
    Impulse impulse; /* of contacts in this interval */
};

static void place_lattice(Explicit *e, int c, int *slots) {
    const System *system = e->system;
    const Cloth *cloth = &system->cloths[c];
    SweepLattice *l = &e->lattices[c];
    *l = *cloth->lattice;
    /* one free row below and above for ghosts */
    l->first = *slots + l->stride + LANE_MARGIN;
    int *slot = e->slot + system->first[c];
    for (int i = 0; i < cloth->node_count; i++) {
        slot[i] = l->first + i / l->nu * l->stride + i % l->nu;
    }
    int outside[4] = {-1, 1, -l->stride, l->stride};
    for (int g = 0; g < cloth->ghost_count; g++) {
        slot[cloth->node_count + g] =
            slot[cloth->ghosts[g].border] + outside[cloth->ghosts[g].side];
    }
    *slots += (l->nv + 2) * l->stride + LANE_MARGIN;
}

/* rows a chunk: all of them for one thread */
static int row_grain(const SweepLattice *l) {
    int threads = parallel_threads();
    int share = (l->nv + threads - 1) / threads, least = (NODE_GRAIN + l->nu - 1) / l->nu;
    return share > least ? share : least;
}

static void place_all(Explicit *e) {
    const System *system = e->system;
    int slots = 0;
    size_t widest = 0, chunks = 1;
    e->slot = arena_push(system->arena, int, system->place_count);
    e->lattices = arena_push(system->arena, SweepLattice, system->cloth_count);
    e->grain = arena_push(system->arena, int, system->cloth_count);
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        int *slot = e->slot + system->first[c];
        if (cloth->lattice) {
            place_lattice(e, c, &slots);
            e->grain[c] = row_grain(cloth->lattice);
            size_t row_chunks = (size_t)parallel_chunk_count(cloth->lattice->nv, e->grain[c]);
            chunks = row_chunks > chunks ? row_chunks : chunks;
            size_t stride = (size_t)cloth->lattice->stride;
            widest = stride > widest ? stride : widest;
        } else {
            for (int i = 0; i < cloth->node_count + cloth->ghost_count; i++) {
                slot[i] = slots++;
            }
        }
    }
    e->lanes = lanes_create(slots, system->arena);
    e->buffer_size = SWEEP_BUFFER_ROWS * widest + LANE_MARGIN;
    e->buffers = arena_push(system->arena, double, e->buffer_size *chunks);
    e->chunks = chunks;
}

Explicit *explicit_create(const System *system) {
    Explicit *e = arena_push(system->arena, Explicit, 1);
    e->system = system;
    e->kernel = sweep_kernel_best();
    place_all(e);
    e->drift = drift_create(system, e->lattices, e->grain, &e->lanes, e->slot);
    e->x = arena_push(system->arena, double, 3 * system->place_count);
    e->gradient = arena_push(system->arena, double, 3 * system->place_count);
    e->ahead[0] = arena_push(system->arena, double, 3 * system->place_count);
    e->ahead[1] = arena_push(system->arena, double, 3 * system->place_count);
    e->steer = steer_create(system);
    e->bounds = bounds_create(&e->steer, e->lattices, e->grain, &e->lanes, e->slot, e->chunks);
    if (system_has_contact(system)) {
        e->contact = contact_create(&system->contact, system->arena);
        e->looks = looks_create(system, &e->lanes, e->slot, e->lattices, e->grain);
    }
    e->limit[0] = system_stable_step(system);
    e->limit[1] = system_scaled_step(system);
    const Fastest *fastest = lead_find_fastest(system);
    e->bending = lead_create(system, e->lanes.slot_count, false, fastest);
    e->membrane = lead_create(system, e->lanes.slot_count, true, fastest);
    e->damping = damping_create(system, &(DampingView){.kernel = e->kernel,
                                                       .lattices = e->lattices,
                                                       .grain = e->grain,
                                                       .lanes = &e->lanes,
                                                       .slot = e->slot,
                                                       .buffers = e->buffers,
                                                       .buffer_size = e->buffer_size,
                                                       .place = {e->x, e->ahead[0], e->ahead[1]},
                                                       .gradient = e->gradient,
                                                       .held = e->steer.held,
                                                       .bending = &e->bending,
                                                       .membrane = &e->membrane});
    return e;
}

double explicit_limit(const Explicit *e, bool scaled) { return e->limit[scaled]; }

/* Returns whether all positions are those that the lanes hold. */
static bool load(Explicit *e, const State *state) {
    bool same = true;
    for (int i = 0; i < e->system->place_count; i++) {
        int slot = e->slot[i];
        double mass = e->system->mass[i];
        for (int c = 0; c < 3; c++) {
            same = same && e->lanes.x[c][slot] == state->x[3 * i + c];
            e->lanes.x[c][slot] = state->x[3 * i + c];
            e->lanes.v[c][slot] = state->v[3 * i + c];
            e->lanes.f[c][slot] = 0.0;
        }
        e->lanes.weight[slot] = mass > 0.0 ? 1.0 / mass : 0.0;
    }
    return same;
}

static void gather(const Explicit *e, int first, int end, double *const lane[3], double *out) {
    for (int i = first; i < end; i++, out += 3) {
        for (int c = 0; c < 3; c++) {
            out[c] = lane[c][e->slot[i]];
        }
    }
}

typedef struct KickJob {
    Explicit *e;
    const SweepLattice *lattice;
    SweepKick kick;
} KickJob;

static void kick_chunk(int chunk, int first, int end, void *context) {
    KickJob *job = context;
    double *buffer = job->e->buffers + job->e->buffer_size * (size_t)chunk;
    job->e->kernel->kick(job->lattice, &job->e->lanes, &job->kick, first, end, buffer);
}

/* forces of one cloth by its model, -gradient, into lanes->f */
static void add_model_force(Explicit *e, int c,
                            void (*add)(const Cloth *cloth, const double *x, double *gradient)) {
    const Cloth *cloth = &e->system->cloths[c];
    int first = e->system->first[c], count = cloth->node_count + cloth->ghost_count;
    memset(e->gradient, 0, 3 * (size_t)count * sizeof *e->gradient);
    gather(e, first, first + count, e->lanes.x, e->x);
    if (cloth->model->commit) { /* every step of an interval counts */
        cloth->model->commit(&e->system->cloths[c], e->x);
    }
    if (e->lattices[c].nu == 0 && cloth->model->fastest) {
        gather(e, first, first + count, e->lanes.bent, e->ahead[0]);
        gather(e, first, first + count, e->lanes.stretched, e->ahead[1]);
        cloth->model->add_damped_gradient(cloth, e->ahead[1], e->ahead[0], e->gradient);
    } else {
        add(cloth, e->x, e->gradient);
    }
    for (int i = 0; i < count; i++) {
        for (int a = 0; a < 3; a++) {
            e->lanes.f[a][e->slot[first + i]] -= e->gradient[3 * i + a];
        }
    }
}

static void clear_force(Explicit *e, int c) {
    int first = e->system->first[c];
    for (int i = first; i < e->system->first[c + 1]; i++) {
        for (int a = 0; a < 3; a++) {
            e->lanes.f[a][e->slot[i]] = 0.0;
        }
    }
}

static SweepKick kick_of(const Explicit *e, int c, double dt) {
    const Scene *scene = e->system->scene;
    double damping = e->system->damping[e->system->first[c]];
    double drag = scene->air.drag / e->system->cloths[c].material.density;
    return (SweepKick){.dt = dt,
                       .push = vec3_axpy(scene->gravity, drag, scene->air.wind),
                       .keep = 1.0 / (1.0 + dt * damping)};
}

static void kick_scattered(Explicit *e, int c, const SweepKick *kick) {
    double push[3] = {kick->push.x, kick->push.y, kick->push.z};
    double lost = 1.0 / (kick->keep * kick->keep) - 1.0;
    for (int i = e->system->first[c]; i < e->system->first[c + 1]; i++) {
        int slot = e->slot[i];
        double weight = e->lanes.weight[slot], square = 0.0;
        for (int a = 0; a < 3; a++) {
            double *v = &e->lanes.v[a][slot];
            double force = e->lanes.f[a][slot];
            *v = (*v + (kick->dt * weight * force + kick->dt * push[a])) * kick->keep;
            square += *v * *v;
        }
        bool counts = weight > 0.0 && !e->steer.held[i]; /* a handle's work is without it */
        e->damped += counts ? 0.5 * lost * e->system->mass[i] * square : 0.0;
    }
}

/* damping of the fabrics for steps of dt */
static void set_damping(Explicit *e, const ExplicitRun *run) {
    for (int c = 0; c < e->system->cloth_count; c++) {
        const ClothDef *def = e->system->cloths[c].def;
        e->bending.wished[c] = run->kinetic_damping ? 0.0 : def->bending_damping;
        e->membrane.wished[c] = run->kinetic_damping ? 0.0 : def->membrane_damping;
    }
    lead_start(&e->bending, e->system, e->lattices, run->dt, e->lanes.x, e->lanes.bent);
    lead_start(&e->membrane, e->system, e->lattices, run->dt, e->lanes.x, e->lanes.stretched);
}

static void kick(Explicit *e, double dt) {
    for (int c = 0; c < e->system->cloth_count; c++) {
        const Cloth *cloth = &e->system->cloths[c];
        SweepKick kick_one = kick_of(e, c, dt);
        bool air = air_has_faces(&e->system->scene->air);
        if (air) {
            e->air_work += dt * air_add_push(&e->system->scene->air, cloth, &e->lanes,
                                             e->slot + e->system->first[c]);
        }
        if (e->lattices[c].nu > 0) {
            bool rest =
                cloth->model->add_rest_gradient && !cloth->lattice->rest &&
                (cloth->panel.rest_curvature[0] != 0.0 || cloth->panel.rest_curvature[1] != 0.0);
            if (rest) {
                add_model_force(e, c, cloth->model->add_rest_gradient);
            }
            kick_one.sides = e->bounds.sides[c].seen;
            kick_one.moved = e->lattices[c].scaled ? e->bounds.inertia.moved : NULL;
            KickJob job = {e, &e->lattices[c], kick_one};
            parallel_for(e->lattices[c].nv, e->grain[c], kick_chunk, &job);
            if (rest || air) {
                clear_force(e, c);
            }
            if (e->steer.turns[c] && cloth->ghost_count > 0) {
                gather(e, e->system->first[c], e->system->first[c + 1], e->lanes.x, e->x);
                steer_find_forces(&e->steer, c, e->x, e->gradient);
            }
        } else {
            add_model_force(e, c, cloth->model->add_gradient);
            kick_scattered(e, c, &kick_one);
            steer_take_forces(&e->steer, &e->lanes, e->slot, c);
            clear_force(e, c);
        }
    }
}

/* takes held places to their targets; returns the work [J] */
static double steer_held(Explicit *e, double dt, double kick_dt, double time_end) {
    double work = 0.0;
    steer_place_targets(&e->steer, time_end);
    for (int c = 0; c < e->system->cloth_count; c++) {
        SweepKick one = kick_of(e, c, kick_dt);
        steer_cloth(&e->steer, &e->lanes, e->slot, c, &one, dt, &work);
    }
    return work;
}

static double kinetic_now(const Explicit *e) {
    double energy = 0.0;
    for (int i = 0; i < e->system->place_count; i++) {
        int s = e->slot[i];
        double x = e->lanes.v[0][s], y = e->lanes.v[1][s], z = e->lanes.v[2][s];
        energy += e->steer.held[i] ? 0.0 : 0.5 * e->system->mass[i] * (x * x + y * y + z * z);
    }
    return energy;
}

static void stop_all(Explicit *e) {
    for (int c = 0; c < 3; c++) {
        memset(e->lanes.v[c], 0, (size_t)e->lanes.slot_count * sizeof(double));
    }
}

/* one kick, with the contacts of this instant */
static void kick_with_contact(Explicit *e, double dt, double share, double time_end, bool all) {
    if (e->contact) {
        contact_forces(e->contact, dt, share, time_end);
    }
    impulse_add(&e->impulse, e->system, &e->lanes, e->slot, share * dt);
    bounds_find(&e->bounds, all, share * dt);
    kick(e, share * dt);
    bounds_spread(&e->bounds);
    if (e->contact) {
        contact_clear(e->contact, vec3_scale(share * dt, e->system->scene->gravity));
    }
}

/* What impulses change is what they push; the guard of the force law only keeps apart. Adds to the work of
 * handles, [J]. */
static void change_by_contact(Explicit *e, bool (*change)(Contact *, double), double dt,
                              double *work) {
    bool pushes = e->system->contact.impulses;
    if (e->contact && pushes) {
        impulse_add_momentum(&e->impulse, e->system, &e->lanes, e->slot, -1.0);
    }
    if (e->contact && change(e->contact, dt)) {
        steer_changed(&e->steer, &e->lanes, e->slot, dt, work);
    }
    if (e->contact && pushes) {
        impulse_add_momentum(&e->impulse, e->system, &e->lanes, e->slot, 1.0);
    }
}

/* drift that crosses nothing */
static double guarded_drift(Explicit *e, double dt, double *work) {
    change_by_contact(e, contact_guard, dt, work);
    bool frames = e->contact && contact_asks_relative(e->contact);
    ContactSpeeds speeds = drift_all(&e->drift, dt, e->bending.time, e->membrane.time, frames);
    if (e->contact) {
        contact_drifted(e->contact, &speeds, dt);
    }
    return speeds.fastest;
}

/* kinetic damping: true when a kill happened at an energy below the target */
static bool kill_at_peak(Explicit *e, const ExplicitRun *run, double *kinetic_before,
                         ExplicitResult *result, double *share) {
    double kinetic = kinetic_now(e);
    bool fell = kinetic < *kinetic_before;
    *share = 1.0;
    if (fell) {
        stop_all(e);
        result->last_kill = *kinetic_before;
        *share = 0.5; /* velocities live at half steps: a full kick would pump */
    }
    *kinetic_before = fell ? 0.0 : kinetic;
    return fell && result->last_kill < run->kinetic_target;
}

/* Asked whenever the fastest has become faster by BURST_STEP. `before` [J]: at the start. */
static bool bursts(Explicit *e, const ExplicitRun *run, const ExplicitResult *result,
                   double before) {
    const System *system = e->system;
    gather(e, 0, system->place_count, e->lanes.x, e->x);
    double limits = run->dt / e->limit[run->scaled];
    double square = limits * limits * system_stiffening(system, e->x, e->limit[0]);
    double now = kinetic_now(e) + system_gravity_energy(system, e->x, e->steer.held);
    double given = fabs(result->work) + fabs(e->air_work);
    given += e->contact ? fabs(contact_statistics(e->contact)->work) : 0.0;
    double at_hand = result->energy_scale + given + BURST_LEAST * system->weight * system->size;
    return square > BURST_LIMITS * BURST_LIMITS || now - before > BURST_SHARE * at_hand;
}

static void run_steps(Explicit *e, const ExplicitRun *run, const State *state, double before,
                      ExplicitResult *result) {
    double share = run->symplectic_euler ? 1.0 : 0.5, kinetic = 0.0, asked = 0.0;
    for (int s = 0; s < run->steps && !step_interrupted; s++) {
        double time_end = run->kinetic_damping ? state->time : state->time + (s + 1) * run->dt;
        damping_before(&e->damping);
        kick_with_contact(e, run->dt, share, time_end, s == 0);
        result->work += steer_held(e, run->dt, share * run->dt, time_end);
        if (e->system->contact.impulses) {
            change_by_contact(e, contact_repel, run->dt, &result->work);
        }
        bounds_hold(&e->bounds, run->dt, share);
        share = 1.0;
        result->steps++;
        if (run->kinetic_damping && kill_at_peak(e, run, &kinetic, result, &share)) {
            break;
        }
        double fastest = guarded_drift(e, run->dt, &result->work);
        damping_after(&e->damping, run->dt);
        if (e->contact && contact_statistics(e->contact)->rejected) {
            return;
        }
        result->fastest = fmax(result->fastest, fastest);
        if (fastest > BURST_STEP * asked && !run->kinetic_damping) {
            asked = fastest;
            result->fastest = bursts(e, run, result, before) ? INFINITY : result->fastest;
        }
        if (!isfinite(result->fastest) || !isfinite(fastest)) {
            return;
        }
    }
    if (!run->kinetic_damping && !run->symplectic_euler) {
        kick_with_contact(e, run->dt, 0.5, state->time + (run->steps + 1) * run->dt, false);
        bounds_hold(&e->bounds, run->dt, 0.5);
    }
    bounds_count(&e->bounds);
    if (run->kinetic_damping) {
        stop_all(e);
    }
}

static double total_energy(Explicit *e, double dt, const State *state, double elastic,
                           double *scale, double *contact) {
    double kinetic = system_kinetic_energy(e->system, state->v, e->steer.held);
    double gravity = system_gravity_energy(e->system, state->x, e->steer.held);
    *contact = e->contact ? contact_energy(e->contact, dt) : 0.0;
    *scale = fmax(*scale, kinetic + elastic + *contact);
    return kinetic + elastic + gravity + *contact;
}

static void store(Explicit *e, State *state, double time_end) {
    steer_end(&e->steer, &e->lanes, e->slot);
    gather(e, 0, e->system->place_count, e->lanes.x, state->x);
    gather(e, 0, e->system->place_count, e->lanes.v, state->v);
    state->time = time_end;
    system_store_history(e->system, state);
    if (e->contact) {
        contact_end(e->contact, &state->contact);
    }
    impulse_end(&e->impulse, e->system, state);
}

/* Inertia is scaled from now on, or no longer. Returns the kinetic energy [J] that the masses lose. What a
 * scene starts with are velocities, not momenta. */
static double begin_bounds(Explicit *e, const ExplicitRun *run, State *state) {
    bool begins = run->scaled && state->scaled == 0.0, enters = begins && state->time > 0.0;
    for (int c = 0; c < e->system->cloth_count; c++) {
        e->lattices[c].scaled = run->scaled && system_is_scalable(e->system, &e->system->cloths[c]);
    }
    double before = enters ? kinetic_now(e) : 0.0;
    bounds_begin(&e->bounds, e->slot, enters);
    state->hidden = begins ? bounds_hidden(&e->bounds) : run->scaled ? state->hidden : 0.0;
    state->scaled = run->scaled;
    return enters ? before - kinetic_now(e) : 0.0;
}

ExplicitResult explicit_interval(Explicit *e, const ExplicitRun *run, State *state) {
    ExplicitResult result = {.contact = {.smallest_gap = INFINITY, .smallest_self_gap = INFINITY}};
    bool continues = load(e, state);
    system_load_history(e->system, state);
    steer_begin(&e->steer, state);
    e->air_work = e->damped = 0.0;
    double spread = begin_bounds(e, run, state);
    set_damping(e, run);
    damping_start(&e->damping, state->time, run->dt, run->steps);
    /* puts ghosts, curvature and stretch in their places */
    drift_all(&e->drift, 0.0, e->bending.time, e->membrane.time, false);
    if (e->contact) {
        double longer = run->scaled ? e->limit[1] / e->limit[0] : 1.0;
        ContactView view = {
            &e->lanes, e->slot, e->steer.held, longer * longer, looks_motion(&e->looks), continues};
        contact_begin(e->contact, view, &state->contact, run->dt);
    }
    bool known = continues && e->system->history_count == 0;
    double elastic = known ? e->elastic : system_elastic_energy(e->system, state->x);
    double contact, *scale = &result.energy_scale;
    double before = total_energy(e, run->dt, state, elastic, scale, &contact);
    double hidden = state->hidden;
    before += hidden - spread;
    impulse_start(&e->impulse, e->system, state);
    run_steps(e, run, state, before, &result);
    store(e, state, state->time + (run->kinetic_damping ? 0.0 : run->steps * run->dt));
    e->elastic = result.elastic = system_elastic_energy(e->system, state->x);
    double after = total_energy(e, run->dt, state, e->elastic, scale, &result.contact_energy);
    state->hidden = bounds_hidden(&e->bounds);
    after += state->hidden;
    result.inertia = state->hidden - hidden + spread;
    result.finite = isfinite(after) && isfinite(result.fastest);
    result.sides = bounds_end(&e->bounds);
    result.fabric = e->damping.fabric;
    result.drag = e->damping.drag;
    if (e->contact) {
        result.contact = *contact_statistics(e->contact);
    }
    result.energy_gain = after - before + e->damped - result.contact.stiffened;
    result.work += result.contact.work + e->bounds.handles;
    result.drag -= e->air_work;
    result.blown = e->air_work;
    return result;
}
