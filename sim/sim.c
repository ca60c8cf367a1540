#include "sim/sim.h"

#include <math.h>
#include <string.h>

#include "sim/base/clock.h"
#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "sim/layout.h"
#include "sim/reach.h"

SimOptions sim_options_default(void) { return (SimOptions){.threads = 1}; }

static uint64_t run_hash(const Scene *scene, const SimOptions *options) {
    uint64_t key[2] = {scene->hash, options->seed};
    return hash_bytes(key, sizeof key);
}

/* of a simulation whose stepper has no data yet */
static bool give_up(Sim *sim) {
    sim->stepper = NULL;
    sim_destroy(sim);
    return false;
}

bool sim_create(Sim *sim, const Scene *scene, const SimOptions *options, Error *error) {
    *sim = (Sim){.scene = scene, .options = *options, .hash = run_hash(scene, options)};
    parallel_set_threads(options->threads);
    if (!system_create(&sim->system, scene, options->seed, &sim->arena, error) ||
        !reach_check(&sim->system, error)) {
        sim_destroy(sim);
        return false;
    }
    sim->stepper = stepper_choose(&sim->system, &sim->stepper_why);
    if (!sim->stepper) {
        error_set(error, EXIT_BAD_INPUT, "no stepper is called '%s'", scene->solver.stepper);
        stepper_place(scene, error);
        sim_destroy(sim);
        return false;
    }
    if (sim->system.history_count > 0 && !sim->stepper->history) {
        error_set(error, EXIT_BAD_INPUT,
                  "stepper '%s' does not follow the path that 'hysteresis' remembers; use central, "
                  "bdf2 or backward_euler",
                  sim->stepper->name);
        stepper_place(scene, error);
        return give_up(sim);
    }
    for (int c = 0; c < sim->system.cloth_count && !sim->stepper->limits; c++) {
        const Cloth *cloth = &sim->system.cloths[c];
        if (cloth->spring_limit_count > 0 || cloth->def->repel) {
            error_set(error, EXIT_BAD_INPUT, "'%s' needs the stepper central, not %s",
                      cloth->def->repel ? "repel" : "limit_rounds", sim->stepper->name);
            stepper_place(scene, error);
            return give_up(sim);
        }
    }
    if (!sim->stepper->create(&sim->system, &sim->stepper_data, error)) {
        return give_up(sim);
    }
    sim->state = state_allocate(&sim->system, &sim->arena);
    sim->packed = arena_push(&sim->arena, double, 9 * sim->system.node_count);
    state_start(&sim->system, &sim->state);
    if (!start_make_legal(&sim->system, &sim->state, &sim->moves, error)) {
        sim_destroy(sim);
        return false;
    }
    sim->statistics.smallest_gap = sim->total.smallest_gap = INFINITY;
    sim->statistics.smallest_self_gap = sim->total.smallest_self_gap = INFINITY;
    return true;
}

void sim_destroy(Sim *sim) {
    if (sim->stepper && sim->stepper->destroy && sim->stepper_data) {
        sim->stepper->destroy(sim->stepper_data);
    }
    Arena arena = sim->arena;
    arena_free(&arena);
    *sim = (Sim){0};
}

static void measure_energies(Sim *sim) {
    const System *system = &sim->system;
    ArenaMark mark = arena_mark(&sim->arena);
    unsigned char *held = arena_push(&sim->arena, unsigned char, system->place_count);
    system_mark_held(system, sim->state.time, held);
    sim->statistics.kinetic = system_kinetic_energy(system, sim->state.v, held);
    if (isnan(sim->statistics.elastic)) { /* steppers that need it say it */
        sim->statistics.elastic = system_elastic_energy(system, sim->state.x);
    }
    sim->statistics.gravity = system_gravity_energy(system, sim->state.x, held);
    sim->statistics.stretch = system_stretch(system, sim->state.x, &sim->stretched);
    double *scratch = arena_push(&sim->arena, double, 3 * system->place_count);
    int place;
    sim->statistics.behind = system_behind(system, sim->state.x, sim->state.time, scratch, &place);
    for (sim->behind = 0; place >= system->first[sim->behind + 1];) {
        sim->behind++;
    }
    arena_rewind(&sim->arena, mark);
}

static void add_up(Statistics *total, const Statistics *frame) {
    total->asleep += frame->asleep;
    total->steps += frame->steps;
    total->retries += frame->retries;
    total->newton_iterations += frame->newton_iterations;
    total->factorisations += frame->factorisations;
    total->work += frame->work;
    total->truncations += frame->truncations;
    total->impulses += frame->impulses;
    total->lag = fmax(total->lag, frame->lag);
    total->stretch = fmax(total->stretch, frame->stretch);
    total->behind = fmax(total->behind, frame->behind);
    total->smallest_gap = fmin(total->smallest_gap, frame->smallest_gap);
    total->smallest_self_gap = fmin(total->smallest_self_gap, frame->smallest_self_gap);
    total->rebuilds += frame->rebuilds;
    total->rounds += frame->rounds;
    total->zones += frame->zones;
    total->zone_vertices += frame->zone_vertices;
    total->friction += frame->friction;
    total->damping += frame->damping;
    total->fabric += frame->fabric;
    total->drag += frame->drag;
    total->numerical += frame->numerical;
    total->guard += frame->guard;
    total->sides += frame->sides;
    total->step_length = frame->step_length > 0.0 ? frame->step_length : total->step_length;
    total->cpu += frame->cpu;
    total->seconds += frame->seconds;
    total->contact_seconds += frame->contact_seconds;
    total->search_seconds += frame->search_seconds;
}

/* obstacles wait for pinched cloth, but not for ever */
static bool keeps_up(const Sim *sim, Error *error) {
    double most = sim->scene->solver.lag;
    for (int o = 0; o < sim->scene->obstacle_count; o++) {
        double lag = sim->state.time - sim->state.contact.clocks[o];
        if (lag > most) {
            return error_set(error, EXIT_DIFFERS,
                             "t = %.4g s: obstacle '%s' is %.3g s behind its motion, since pinched "
                             "cloth does not let it move; 'solver: lag' allows %.3g s",
                             sim->state.time, sim->scene->obstacles[o].name, lag, most);
        }
    }
    return true;
}

/* debug builds judge every frame by the exact check */
static bool is_legal(const Sim *sim, Error *error) {
#ifdef TOILE_JUDGE
    long crossings = sim->system.contact.self ? system_crossings(&sim->system, &sim->state) : 0;
    if (crossings > 0) {
        return error_set(error, EXIT_DIFFERS, "t = %.4g s: %ld pairs of triangles cross",
                         sim->state.time, crossings);
    }
#else
    (void)sim, (void)error;
#endif
    return true;
}

bool sim_advance(Sim *sim, Error *error) {
    double start = clock_process_seconds(), start_clock = clock_seconds();
    double time_end = (sim->frame + 1) / sim->scene->film.rate;
    sim->statistics =
        (Statistics){.elastic = NAN, .smallest_gap = INFINITY, .smallest_self_gap = INFINITY};
    if (!sim->stepper->advance(&sim->system, sim->stepper_data, &sim->state, time_end,
                               &sim->statistics, error)) {
        return false;
    }
    if (!keeps_up(sim, error) || !is_legal(sim, error)) {
        return false;
    }
    sim->frame++;
    measure_energies(sim);
    sim->statistics.cpu = clock_process_seconds() - start;
    sim->statistics.seconds = clock_seconds() - start_clock;
    add_up(&sim->total, &sim->statistics);
    return true;
}

bool sim_write_start(const Sim *sim, StateWriter *writer, Error *error) {
    Arena arena = {0};
    StateHeader header = layout_header(sim, &arena);
    StateLayout layout = layout_make(&sim->system, &arena);
    bool ok =
        state_write_header(writer, &header, error) && state_write_layout(writer, &layout, error);
    arena_free(&arena);
    return ok;
}

/* nodes without ghosts: x to the first third of packed, v and the forces of contacts to the others */
static void pack(Sim *sim) {
    const System *system = &sim->system;
    double *x = sim->packed, *v = sim->packed + 3 * (size_t)system->node_count;
    double *force = v + 3 * (size_t)system->node_count;
    for (int c = 0; c < system->cloth_count; c++) {
        size_t from = 3 * (size_t)system->first[c];
        size_t count = 3 * (size_t)system->cloths[c].node_count;
        memcpy(x, sim->state.x + from, count * sizeof *x);
        memcpy(v, sim->state.v + from, count * sizeof *v);
        if (sim->state.contact_force) {
            memcpy(force, sim->state.contact_force + from, count * sizeof *force);
        }
        x += count, v += count, force += count;
    }
}

uint64_t sim_state_hash(const Sim *sim) {
    size_t bytes = 3 * (size_t)sim->system.place_count * sizeof(double);
    uint64_t parts[2] = {hash_bytes(sim->state.x, bytes), hash_bytes(sim->state.v, bytes)};
    return hash_bytes(parts, sizeof parts);
}

/* what a stepper needs beyond x and v: name, memory in the state, count of doubles */
typedef struct Kept {
    const char *name;
    double *data;
    int64_t count;
} Kept;

enum { KEPT_COUNT = 15 };
/* the states file keeps a PairMemory as so many doubles, bit by bit */
#define PAIR_DOUBLES ((int64_t)(sizeof(PairMemory) / sizeof(double)))

static void list_kept(const Sim *sim, Kept kept[KEPT_COUNT]) {
    const State *s = &sim->state;
    int64_t places = 3 * (int64_t)sim->system.place_count;
    int64_t obstacles = sim->system.contact.obstacle_count;
    bool ghosts = sim->system.place_count > sim->system.node_count;
    bool before = s->step_before > 0.0;
    Kept all[KEPT_COUNT] = {
        {"step.before", (double *)&s->step_before, 1},
        {"step.x", s->x, ghosts ? places : 0},
        {"step.v", s->v, ghosts ? places : 0},
        {"step.x_before", s->x_before, before ? places : 0},
        {"step.v_before", s->v_before, before ? places : 0},
        {"step.calm", (double *)&s->calm, 1},
        {"step.scaled", (double *)&s->scaled, 1},
        {"step.hidden", (double *)&s->hidden, 1},
        {"step.approach", (double *)&s->contact.approach, 1},
        {"step.unguarded", (double *)&s->unguarded, 1},
        {"step.stiffness", (double *)&s->contact.stiffness, 1},
        {"step.solid_stiffness", (double *)&s->contact.solid_stiffness, 1},
        {"step.clocks", s->contact.clocks, obstacles},
        {"step.bristles", s->contact.bristles, places * obstacles},
        {"step.history", s->history, sim->system.history_count},
    };
    memcpy(kept, all, sizeof all);
}

bool sim_write_frame(Sim *sim, StateWriter *writer, Error *error) {
    pack(sim);
    StateFrame frame = {.frame = sim->frame,
                        .time = sim->state.time,
                        .x = sim->packed,
                        .v = sim->packed + 3 * (size_t)sim->system.node_count,
                        .pose_count = sim->system.contact.obstacle_count,
                        .pose = sim->state.contact.poses};
    frame.contact_force =
        sim->state.contact_force ? sim->packed + 6 * (size_t)sim->system.node_count : NULL;
    Arena arena = {0};
    frame.moved = layout_moved(sim->scene, sim->state.contact.clocks, &arena, &frame.moved_count);
    Kept kept[KEPT_COUNT];
    list_kept(sim, kept);
    const ContactMemory *contact = &sim->state.contact;
    int32_t counts[2] = {contact->touch_count, contact->pair_count};
    StateArray extra[KEPT_COUNT + 4] = {
        {"statistics", STATE_U8, 1, (int64_t)strlen(statistic_names), statistic_names},
        {"stat", STATE_F64, 1, STATISTIC_COUNT, &sim->statistics},
        {"step.counts", STATE_I32, 1, 2, counts},
        {"step.pairs", STATE_F64, 1, PAIR_DOUBLES * (int64_t)counts[1], contact->pairs},
    };
    for (int i = 0; i < KEPT_COUNT; i++) {
        extra[4 + i] = (StateArray){"", STATE_F64, 1, kept[i].count, kept[i].data};
        strcpy(extra[4 + i].name, kept[i].name);
    }
    bool ok =
        state_write_frame(writer, &frame, sim->system.node_count, extra, KEPT_COUNT + 4, error);
    arena_free(&arena);
    return ok;
}

static bool load_kept(Sim *sim, const StateReader *reader, const char *wanted, Error *error) {
    Kept kept[KEPT_COUNT];
    list_kept(sim, kept);
    for (int i = 0; i < KEPT_COUNT; i++) {
        if (wanted ? strcmp(kept[i].name, wanted) != 0 : i == 0) {
            continue;
        }
        const StateArray *array = state_frame_array(reader, kept[i].name, STATE_F64, 1);
        if (!array || array->count != kept[i].count) {
            return error_set(error, EXIT_BAD_INPUT,
                             "the frame cannot be resumed: '%s' does not fit this scene",
                             kept[i].name);
        }
        memcpy(kept[i].data, array->data, (size_t)array->count * sizeof(double));
    }
    return true;
}

static bool load_pairs(Sim *sim, const StateReader *reader, Error *error) {
    ContactMemory *contact = &sim->state.contact;
    const StateArray *counts = state_frame_array(reader, "step.counts", STATE_I32, 1);
    const StateArray *pairs = state_frame_array(reader, "step.pairs", STATE_F64, 1);
    const int32_t *count = counts && counts->count == 2 ? counts->data : NULL;
    if (!count || !pairs || count[0] < 0 || count[1] < count[0] || count[1] > contact->pair_room ||
        pairs->count != PAIR_DOUBLES * count[1]) {
        return error_set(error, EXIT_BAD_INPUT,
                         "the frame cannot be resumed: 'step.pairs' does not fit this scene");
    }
    contact->touch_count = count[0];
    contact->pair_count = count[1];
    memcpy(contact->pairs, pairs->data, (size_t)pairs->count * sizeof(double));
    return true;
}

bool sim_load_frame(Sim *sim, StateReader *reader, int index, Error *error) {
    StateFrame frame;
    StateLayout layout;
    if (state_header(reader)->scene_hash != sim->hash) {
        return error_set(error, EXIT_BAD_INPUT, "the run was made from another scene or seed");
    }
    if (!state_read_frame(reader, index, &frame, &layout, NULL, error)) {
        return false;
    }
    if (layout.node_count != sim->system.node_count ||
        frame.pose_count != sim->system.contact.obstacle_count) {
        return error_set(error, EXIT_BAD_INPUT, "the run has another layout");
    }
    const double *x = frame.x, *v = frame.v, *force = frame.contact_force;
    for (int c = 0; c < sim->system.cloth_count; c++) {
        size_t to = 3 * (size_t)sim->system.first[c];
        size_t count = 3 * (size_t)sim->system.cloths[c].node_count;
        memcpy(sim->state.x + to, x, count * sizeof *x);
        memcpy(sim->state.v + to, v, count * sizeof *v);
        if (sim->state.contact_force && force) { /* cloth that sleeps keeps them */
            memcpy(sim->state.contact_force + to, force, count * sizeof *force);
            force += count;
        }
        x += count, v += count;
    }
    memcpy(sim->state.contact.poses, frame.pose, (size_t)frame.pose_count * sizeof *frame.pose);
    sim->state.time = frame.time;
    sim->frame = frame.frame;
    /* step.before decides which arrays there are */
    return load_kept(sim, reader, "step.before", error) && load_kept(sim, reader, NULL, error) &&
           load_pairs(sim, reader, error);
}
