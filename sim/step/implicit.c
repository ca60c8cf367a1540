#include "sim/step/implicit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/memory.h"
#include "sim/contact/constants.h"
#include "sim/step/air.h"

#define TURN_SAMPLES 8 /* of the turn of an obstacle in an output interval */

struct Implicit {
    const System *system;
    BlockMatrix matrix;
    Factor *factor;
    BlockPlace *diagonal; /* (place_count) */
    double *stress;       /* of all cloths, one after the other */
    Arena scratch;
    /* of the solve at work */
    ImplicitTerms terms;
    const State *start; /* of the step: obstacles, bristles, positions */
    const unsigned char *held;
    Barrier *barrier;       /* NULL: nothing can meet anything */
    unsigned char *clamped; /* (place_count) by any motion of the solve */
    AirFace *faces;         /* (face_count) of all cloths at the start; NULL: no air on faces */
    int face_count;
    double *air_start; /* [m] (place_count x 3) likewise */
    AirStep air;       /* of the solve at work; count 0 where time stands still */
};

static int *couple_all(const System *system, int *pair_count) {
    *pair_count = 0;
    for (int c = 0; c < system->cloth_count; c++) {
        *pair_count += system->cloths[c].model->couple(&system->cloths[c], NULL);
    }
    int *pairs = memory_new((2 * (size_t)*pair_count + 1) * sizeof *pairs), *at = pairs;
    for (int c = 0; c < system->cloth_count; c++) {
        int count = system->cloths[c].model->couple(&system->cloths[c], at);
        for (int k = 0; k < 2 * count; k++) {
            at[k] += system->first[c];
        }
        at += 2 * count;
    }
    return pairs;
}

static void create_faces(Implicit *im) {
    const System *system = im->system;
    for (int c = 0; c < system->cloth_count && air_has_faces(&system->scene->air); c++) {
        im->face_count += system->cloths[c].panel.triangle_count;
    }
    if (im->face_count > 0) {
        im->faces = arena_push(system->arena, AirFace, im->face_count);
        im->air_start = arena_push(system->arena, double, 3 * system->place_count);
    }
}

/* as they are at the start of a step */
static void find_faces(Implicit *im, const State *start) {
    const System *system = im->system;
    AirFace *faces = im->faces;
    for (int c = 0; c < system->cloth_count && faces; c++) {
        size_t at = 3 * (size_t)system->first[c];
        faces += air_find_faces(&system->scene->air, &system->cloths[c], system->first[c],
                                start->x + at, start->v + at, faces);
    }
    if (im->faces) {
        memcpy(im->air_start, start->x, 3 * (size_t)system->place_count * sizeof *start->x);
    }
}

Implicit *implicit_create(const System *system) {
    Implicit *implicit = memory_zeroed(1, sizeof *implicit);
    implicit->system = system;
    int pair_count, strains = 0;
    int *pairs = couple_all(system, &pair_count);
    implicit->matrix = block_matrix_create(system->place_count, pairs, pair_count, system->arena);
    free(pairs);
    for (int c = 0; c < system->cloth_count; c++) {
        Cloth *cloth = &system->cloths[c];
        cloth->model->bind_hessian(cloth, &implicit->matrix, system->first[c], system->arena);
        strains += cloth->strain_count;
    }
    implicit->stress = arena_push(system->arena, double, strains);
    implicit->diagonal = arena_push(system->arena, BlockPlace, system->place_count);
    for (int i = 0; i < system->place_count; i++) {
        implicit->diagonal[i] = block_matrix_place(&implicit->matrix, i, i);
    }
    create_faces(implicit);
    if (system_has_contact(system)) {
        implicit->clamped = arena_push(system->arena, unsigned char, system->place_count);
        implicit->barrier = barrier_create(&system->contact, system->arena);
    }
    implicit->factor = factor_create(&implicit->matrix);
    return implicit;
}

void implicit_destroy(Implicit *implicit) {
    factor_free(implicit->factor);
    arena_free(&implicit->scratch);
    free(implicit);
}

double implicit_nonzeros(const Implicit *implicit) { return factor_nonzeros(implicit->factor); }

void implicit_begin(Implicit *im, const unsigned char *held, const State *start) {
    im->held = held;
    im->start = start;
    find_faces(im, start);
    if (im->barrier) {
        barrier_begin(im->barrier, &start->contact, start->x, held);
        memset(im->clamped, 0, (size_t)im->system->place_count);
    }
}

double implicit_air_work(const Implicit *im, const double *x) { return air_step_work(&im->air, x); }

int implicit_count_crossings(const Implicit *im, const double *x) {
    return im->barrier ? barrier_count_crossings(im->barrier, x) : 0;
}

void implicit_drive(Implicit *im, double time_end, double dt) {
    if (im->barrier) {
        barrier_drive(im->barrier, time_end, dt);
    }
}

double implicit_obstacle_work(const Implicit *im) {
    return im->barrier ? barrier_work(im->barrier) : 0.0;
}

double implicit_friction(const Implicit *im) {
    return im->barrier ? barrier_friction(im->barrier) : 0.0;
}

bool implicit_has_contact(const Implicit *im) { return im->barrier != NULL; }

bool implicit_add_clamped(const Implicit *im, unsigned char *flags) {
    bool any = false;
    for (int i = 0; im->barrier && i < im->system->place_count; i++) {
        flags[i] = flags[i] || im->clamped[i];
        any = any || im->clamped[i];
    }
    return any;
}

double implicit_clamp(Implicit *im, const double *x, double *dx, unsigned char *changed) {
    const unsigned char *clamped;
    if (!im->barrier) {
        return 1.0;
    }
    double smallest = barrier_clamp(im->barrier, x, dx, &clamped);
    for (int i = 0; changed && i < im->system->place_count; i++) {
        changed[i] = changed[i] || clamped[i];
    }
    return smallest;
}

double implicit_contacts(Implicit *im, const double *x, unsigned char *touching,
                         BarrierReport *report) {
    if (!im->barrier) {
        return 0.0;
    }
    *report = barrier_look(im->barrier, x);
    if (touching) {
        barrier_mark(im->barrier, touching);
    }
    return barrier_energy(im->barrier);
}

/* of one place */
static void rates(const ImplicitTerms *terms, int place, double *acceleration, double *velocity) {
    bool euler = terms->euler && terms->euler[place];
    *acceleration = euler ? 1.0 / (terms->step * terms->step) : terms->acceleration;
    *velocity = euler ? 1.0 / terms->step : terms->velocity;
}

static void gradient(void *context, const double *x, double *g) {
    const Implicit *im = context;
    const System *system = im->system;
    const AirDef *air = &system->scene->air;
    Vec3 gravity = system->scene->gravity;
    double pull[3] = {gravity.x, gravity.y, gravity.z};
    double wind[3] = {air->wind.x, air->wind.y, air->wind.z};
    memset(g, 0, 3 * (size_t)system->place_count * sizeof *g);
    system_add_gradient(system, x, g);
    for (int i = 0; i < system->place_count; i++) {
        double mass = system->mass[i], a, velocity;
        rates(&im->terms, i, &a, &velocity);
        for (int c = 0; c < 3; c++) {
            int k = 3 * i + c;
            double inertia = a > 0.0 ? a * mass * (x[k] - im->terms.x_hat[k]) : 0.0;
            double v = velocity > 0.0 ? velocity * x[k] + im->terms.v_hat[k] : 0.0;
            double drag = velocity > 0.0 ? system->damping[i] * mass * v : 0.0;
            double blown = air->drag * system->area[i] * wind[c];
            g[k] += inertia + drag - blown - mass * pull[c];
        }
    }
    air_step_add_gradient(&im->air, x, g);
    if (im->barrier) {
        barrier_look(im->barrier, x);
        barrier_add_gradient(im->barrier, g);
    }
}

/* the potential of `gradient`, without friction */
static double energy(void *context, const double *x) {
    const Implicit *im = context;
    const System *system = im->system;
    const AirDef *air = &system->scene->air;
    Vec3 gravity = system->scene->gravity;
    double sum = system_elastic_energy(system, x) + air_step_energy(&im->air, x);
    for (int i = 0; i < system->place_count; i++) {
        double mass = im->held[i] ? 0.0 : system->mass[i], a, velocity;
        Vec3 at = vec3_load(x + 3 * i);
        rates(&im->terms, i, &a, &velocity);
        sum -= mass * vec3_dot(gravity, at) + air->drag * system->area[i] * vec3_dot(air->wind, at);
        for (int c = 0; c < 3 && mass > 0.0; c++) {
            int k = 3 * i + c;
            double apart = a > 0.0 ? x[k] - im->terms.x_hat[k] : 0.0;
            double drag =
                velocity > 0.0 ? (0.5 * velocity * x[k] + im->terms.v_hat[k]) * x[k] : 0.0;
            sum += mass * (0.5 * a * apart * apart + system->damping[i] * drag);
        }
    }
    if (im->barrier) {
        barrier_look(im->barrier, x);
        sum += barrier_energy(im->barrier);
    }
    return sum;
}

/* block (a, b) of the contact stiffness, if the cloth has it */
static bool add_contact_block(void *context, int a, int b, const double block[9]) {
    Implicit *im = context;
    BlockPlace place;
    if (!block_matrix_find(&im->matrix, a, b, &place)) {
        return false;
    }
    block_add(im->matrix.values, place, block);
    return true;
}

static void tangent(void *context, const double *x, bool definite) {
    Implicit *im = context;
    const System *system = im->system;
    double *values = im->matrix.values;
    memset(values, 0, 9 * (size_t)block_matrix_block_count(&im->matrix) * sizeof *values);
    const double *stress = im->stress;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        cloth->model->add_hessian(cloth, x + 3 * (size_t)system->first[c], stress, definite,
                                  values);
        stress += cloth->strain_count;
    }
    for (int i = 0; i < system->place_count; i++) {
        double a, velocity;
        rates(&im->terms, i, &a, &velocity);
        block_add_diagonal(values, im->diagonal[i],
                           (a + velocity * system->damping[i]) * system->mass[i]);
    }
    air_step_add_hessian(&im->air, &im->matrix);
    if (im->barrier) {
        barrier_add_stiffness(im->barrier, add_contact_block, im);
    }
}

static void keep_stress(void *context, const double *x, const double *dx) {
    Implicit *im = context;
    double *stress = im->stress;
    for (int c = 0; c < im->system->cloth_count; c++) {
        const Cloth *cloth = &im->system->cloths[c];
        size_t at = 3 * (size_t)im->system->first[c];
        if (dx) {
            cloth->model->predict_stress(cloth, x + at, dx + at, stress);
        } else {
            cloth->model->stress(cloth, x + at, stress);
        }
        stress += cloth->strain_count;
    }
}

static double limit_step(void *context, const double *x, double *dx) {
    Implicit *im = context;
    return implicit_clamp(im, x, dx, im->clamped);
}

static bool add_left_out(void *context, const double *p, double *y) {
    const Implicit *im = context;
    return barrier_add_lumped(im->barrier, p, y);
}

static NewtonProblem problem_of(Implicit *im, const ImplicitTerms *terms) {
    im->terms = *terms;
    im->air = (AirStep){.faces = im->faces,
                        .count = terms->velocity > 0.0 ? im->face_count : 0,
                        .wind = im->system->scene->air.wind,
                        .dt = terms->step,
                        .start = im->air_start};
    return (NewtonProblem){.context = im,
                           .node_count = im->system->place_count,
                           .fixed = im->held,
                           .matrix = &im->matrix,
                           .factor = im->factor,
                           .gradient = gradient,
                           .tangent = tangent,
                           .keep_stress = keep_stress,
                           .energy = energy,
                           .limit_step = im->barrier ? limit_step : NULL,
                           .add_left_out = im->barrier ? add_left_out : NULL};
}

NewtonProblem implicit_problem(Implicit *im, const ImplicitTerms *terms, const unsigned char *held,
                               const State *start) {
    implicit_begin(im, held, start);
    return problem_of(im, terms);
}

NewtonReport implicit_solve(Implicit *im, const ImplicitTerms *terms, const NewtonParams *params,
                            const double *first_dx, double *x) {
    NewtonProblem problem = problem_of(im, terms);
    return newton_solve(&problem, params, first_dx, x, &im->scratch);
}

void implicit_store_contact(Implicit *im, const double *x, State *state) {
    if (im->barrier) {
        barrier_look(im->barrier, x);
        barrier_end(im->barrier, &state->contact);
    }
    if (im->barrier && state->contact_force) { /* minus the gradient */
        int count = 3 * im->system->place_count;
        memset(state->contact_force, 0, (size_t)count * sizeof *state->contact_force);
        barrier_add_gradient(im->barrier, state->contact_force);
        for (int i = 0; i < count; i++) {
            state->contact_force[i] = -state->contact_force[i];
        }
    }
}

double implicit_residual(Implicit *im, const unsigned char *held, const State *start,
                         const double *x) {
    ImplicitTerms terms = {0};
    NewtonProblem problem = implicit_problem(im, &terms, held, start);
    ArenaMark mark = arena_mark(&im->scratch);
    double *g = arena_push(&im->scratch, double, 3 * im->system->place_count), sum = 0.0;
    problem.gradient(im, x, g);
    for (int i = 0; i < 3 * im->system->place_count; i++) {
        sum += held[i / 3] ? 0.0 : g[i] * g[i];
    }
    arena_rewind(&im->scratch, mark);
    return sqrt(sum);
}

double implicit_turns(const System *system, double from, double to) {
    double most = 0.0;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        double sum = 0.0;
        for (int k = 0; obstacle->moves && k < TURN_SAMPLES; k++) {
            double step = (to - from) / TURN_SAMPLES, at = from + k * step;
            Quat a = contact_pose(obstacle, at).turn, b = contact_pose(obstacle, at + step).turn;
            double c = fabs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z);
            sum += 2.0 * acos(fmin(c, 1.0));
        }
        most = fmax(most, sum);
    }
    return most / CONTACT_MOST_TURN;
}
