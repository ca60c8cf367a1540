#include "sim/step/stochastic.h"

#include <math.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/step/stepper.h"

/* of a node's next move: 0.4 of the moves stay when 1.2^0.4 0.88^0.6 = 1 */
#define WIDER 1.2
#define NARROWER 0.886
#define NARROWEST 1e-12      /* of the size */
#define STEP_SHARE 0.3       /* of force dt^2 / mass, as stiffness holds a node back */
#define STREAM 1994          /* of random numbers */
#define FIRST_THRESHOLD 1e-5 /* of weight x size: breaks symmetry, and is nothing beside a drape */
#define COOLING 0.98         /* a sweep */
#define ROUND 200            /* sweeps between two looks */
#define SETTLED 1e-7 /* of weight x size: a round that lowers the energy by less is the last */
#define MOST_SWEEPS 20000

/* ---- nodes that may move together ---- */

/* nodes that share a unit with node i: other[begin[i]] .. other[begin[i + 1] - 1] */
static void find_neighbours(const Cloth *cloth, int **begin, int **other, Arena *scratch) {
    int count = 2 * cloth->model->couple(cloth, NULL);
    int *pairs = arena_push(scratch, int, count), *at = arena_push(scratch, int, cloth->node_count);
    *begin = arena_push(scratch, int, cloth->node_count + 1);
    *other = arena_push(scratch, int, count);
    cloth->model->couple(cloth, pairs);
    for (int k = 0; k < count; k++) {
        (*begin)[pairs[k] + 1]++;
    }
    for (int i = 0; i < cloth->node_count; i++) {
        (*begin)[i + 1] += (*begin)[i];
        at[i] = (*begin)[i];
    }
    for (int k = 0; k < count; k++) {
        (*other)[at[pairs[k]]++] = pairs[k ^ 1];
    }
}

/* the first colour that no neighbour has */
static void find_colours(Stochastic *s, int c, Arena *scratch) {
    const Cloth *cloth = &s->system->cloths[c];
    int *begin, *other, *taken = arena_push(scratch, int, cloth->node_count + 1);
    int *colour = s->colour + s->system->first[c];
    find_neighbours(cloth, &begin, &other, scratch);
    for (int i = 0; i < cloth->node_count; i++) {
        for (int k = begin[i]; k < begin[i + 1]; k++) {
            if (other[k] < i) {
                taken[colour[other[k]]] = i + 1;
            }
        }
        while (taken[colour[i]] == i + 1) {
            colour[i]++;
        }
        s->colours = colour[i] >= s->colours ? colour[i] + 1 : s->colours;
    }
}

Stochastic *stochastic_create(const System *system) {
    Stochastic *s = arena_push(system->arena, Stochastic, 1);
    int n = system->place_count;
    Arena scratch = {0};
    s->system = system;
    s->colour = arena_push(system->arena, int, n);
    s->held = arena_push(system->arena, unsigned char, n);
    s->weightless = arena_push(system->arena, unsigned char, n);
    s->amplitude = arena_push(system->arena, double, n);
    s->gradient = arena_push(system->arena, double, 3 * n);
    s->after = arena_push(system->arena, double, 3 * n);
    s->x = arena_push(system->arena, double, 3 * n);
    s->start = arena_push(system->arena, double, 3 * n);
    for (int c = 0; c < system->cloth_count; c++) {
        find_colours(s, c, &scratch);
    }
    arena_free(&scratch);
    return s;
}

void stochastic_begin(Stochastic *s, double widest, uint64_t seed) {
    s->moves = seed;
    for (int i = 0; i < s->system->place_count; i++) {
        s->amplitude[i] = widest;
    }
}

uint64_t stochastic_seed(double time) { return hash_bytes(&time, sizeof time) >> 16; }

/* ---- a sweep ---- */

double stochastic_energy(const Stochastic *s, const double *x) {
    double apart = 0.0;
    for (int k = 0; s->anchor && k < 3 * s->system->place_count; k++) {
        double d = x[k] - s->anchor[k];
        apart += s->held[k / 3] ? 0.0 : s->system->mass[k / 3] * d * d;
    }
    return system_elastic_energy(s->system, x) +
           system_gravity_energy(s->system, x, s->weightless) + 0.5 * s->anchor_stiffness * apart;
}

static void find_gradient(const Stochastic *s, const double *x, double *gradient) {
    const System *system = s->system;
    const Vec3 g = system->scene->gravity;
    const double down[3] = {g.x, g.y, g.z};
    for (int k = 0; k < 3 * system->place_count; k++) {
        gradient[k] = s->weightless[k / 3] ? 0.0 : -system->mass[k / 3] * down[k % 3];
        if (s->anchor) {
            gradient[k] += s->anchor_stiffness * system->mass[k / 3] * (x[k] - s->anchor[k]);
        }
    }
    system_add_gradient(system, x, gradient);
}

void stochastic_begin_step(Stochastic *s, double dt, const double *x) {
    find_gradient(s, x, s->gradient);
    for (int i = 0; i < s->system->place_count; i++) {
        double force = vec3_length(vec3_load(s->gradient + 3 * i)), mass = s->system->mass[i];
        double moved = mass > 0.0 ? STEP_SHARE * force * dt * dt / mass : 0.0;
        s->amplitude[i] = fmax(moved, NARROWEST * s->system->size);
    }
}

static bool moves_now(const Stochastic *s, int i, int colour) {
    return s->colour[i] == colour && !s->held[i] && s->system->mass[i] > 0.0;
}

/* nodes of one colour, each on its own */
static void move_colour(Stochastic *s, int colour, double threshold, double *x) {
    const System *system = s->system;
    memcpy(s->x, x, 3 * (size_t)system->place_count * sizeof *x);
    find_gradient(s, x, s->gradient);
    for (int i = 0; i < system->place_count; i++) {
        if (!moves_now(s, i, colour)) {
            continue;
        }
        Vec3 g = vec3_load(s->gradient + 3 * i), d;
        double size = vec3_length(g), random[3];
        for (int c = 0; c < 3; c++) {
            random[c] = hash_random(STREAM, s->moves++);
        }
        d = vec3_axpy(vec3_load(random), size > 0.0 ? -1.0 / size : 0.0, g);
        vec3_store(s->x + 3 * i, vec3_axpy(vec3_load(x + 3 * i), s->amplitude[i], d));
    }
    find_gradient(s, s->x, s->after);
    for (int i = 0; i < system->place_count; i++) {
        if (!moves_now(s, i, colour)) {
            continue;
        }
        double change = 0.0;
        for (int k = 3 * i; k < 3 * i + 3; k++) {
            change += 0.5 * (s->gradient[k] + s->after[k]) * (s->x[k] - x[k]);
        }
        bool stays = change <= threshold; /* false for what is no number */
        s->amplitude[i] *= stays ? WIDER : NARROWER;
        s->amplitude[i] = fmax(s->amplitude[i], NARROWEST * system->size);
        if (stays) {
            memcpy(x + 3 * i, s->x + 3 * i, 3 * sizeof *x);
        }
    }
}

double stochastic_sweep(Stochastic *s, double threshold, double energy, double *x) {
    size_t bytes = 3 * (size_t)s->system->place_count * sizeof *x;
    memcpy(s->start, x, bytes);
    for (int colour = 0; colour < s->colours; colour++) {
        move_colour(s, colour, threshold / s->system->node_count, x);
    }
    double now = stochastic_energy(s, x);
    if (now <= energy + threshold) {
        return now;
    }
    memcpy(x, s->start, bytes);
    for (int i = 0; i < s->system->place_count; i++) {
        s->amplitude[i] *= NARROWER;
    }
    return energy;
}

/* ---- stochastic: near an equilibrium ---- */

typedef struct Minimiser {
    Stochastic *sweeps;
    State trial;
} Minimiser;

static bool create(const System *system, void **data, Error *error) {
    if (system_has_contact(system) || vec3_length(system->scene->air.wind) > 0.0) {
        return stepper_refuse(system, "stochastic", "obstacles, wind", NULL, error);
    }
    Minimiser *p = arena_push(system->arena, Minimiser, 1);
    p->sweeps = stochastic_create(system);
    p->trial = state_allocate(system, system->arena);
    *data = p;
    return true;
}

/* moves start at a tenth of the mean distance of nodes, whatever they are */
static double first_amplitude(const System *system) {
    return 0.1 * system->size / sqrt(system->node_count);
}

static bool advance(const System *system, void *data, State *state, double time_end,
                    Statistics *statistics, Error *error) {
    Minimiser *p = data;
    Stochastic *s = p->sweeps;
    double scale = system->weight * system->size, threshold = FIRST_THRESHOLD * scale;
    state_copy(system, &p->trial, state);
    system_mark_held(system, time_end, s->held);
    memcpy(s->weightless, s->held, (size_t)system->place_count);
    system_place_held(system, time_end, p->trial.x);
    stochastic_begin(s, first_amplitude(system), stochastic_seed(time_end));
    double energy = stochastic_energy(s, p->trial.x), round = INFINITY;
    int sweep = 0;
    for (; sweep < MOST_SWEEPS && isfinite(energy) && !step_interrupted;
         sweep++, threshold *= COOLING) {
        if (sweep % ROUND == 0 && sweep > 0) {
            if (round - energy < SETTLED * scale && sweep > ROUND) {
                break;
            }
            round = energy;
        }
        energy = stochastic_sweep(s, threshold, energy, p->trial.x);
    }
    if (step_interrupted) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    if (!isfinite(energy)) {
        return error_set(error, EXIT_DIFFERS, "stochastic: the energy at t = %g s is no number",
                         time_end);
    }
    statistics->steps += sweep;
    statistics->step_length = time_end - state->time;
    memset(p->trial.v, 0, 3 * (size_t)system->place_count * sizeof(double));
    p->trial.time = time_end;
    state_copy(system, state, &p->trial);
    return true;
}

const Stepper stepper_stochastic = {
    .name = "stochastic",
    .about = "near equilibrium at every output time by random moves of nodes (Breen et al. 1994)",
    .create = create,
    .advance = advance,
};
