#include "sim/step/implicit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
};

static int *couple_all(const System *system, int *pair_count) {
    *pair_count = 0;
    for (int c = 0; c < system->cloth_count; c++) {
        *pair_count += system->cloths[c].model->couple(&system->cloths[c], NULL);
    }
    int *pairs = malloc((2 * (size_t)*pair_count + 1) * sizeof *pairs), *at = pairs;
    ASSERT(pairs);
    for (int c = 0; c < system->cloth_count; c++) {
        int count = system->cloths[c].model->couple(&system->cloths[c], at);
        for (int k = 0; k < 2 * count; k++) {
            at[k] += system->first[c];
        }
        at += 2 * count;
    }
    return pairs;
}

Implicit *implicit_create(const System *system) {
    Implicit *implicit = calloc(1, sizeof *implicit);
    ASSERT(implicit);
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
    implicit->factor = factor_create(&implicit->matrix);
    return implicit;
}

void implicit_destroy(Implicit *implicit) {
    factor_free(implicit->factor);
    arena_free(&implicit->scratch);
    free(implicit);
}

double implicit_factor_bytes(const Implicit *implicit) { return factor_bytes(implicit->factor); }
double implicit_nonzeros(const Implicit *implicit) { return factor_nonzeros(implicit->factor); }

static void contact_at(const Implicit *im, int place, const double *x, double *force, double *block,
                       double *next) {
    const ContactDef *def = &im->system->contact;
    if (def->obstacle_count == 0 || def->mass[place] == 0.0 || im->held[place]) {
        return;
    }
    Vec3 now = vec3_load(x + 3 * (size_t)place);
    Vec3 moved = vec3_sub(now, vec3_load(im->start->x + 3 * (size_t)place));
    size_t memory = 3 * (size_t)place * (size_t)def->obstacle_count;
    contact_at_vertex(def, im->start->contact.poses, place, now, moved,
                      im->start->contact.bristles + memory, force, block, next);
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
        double mass = system->mass[i], force[3] = {0};
        contact_at(im, i, x, force, NULL, NULL);
        for (int c = 0; c < 3; c++) {
            int k = 3 * i + c;
            double a = im->terms.acceleration;
            double inertia = a > 0.0 ? a * mass * (x[k] - im->terms.x_hat[k]) : 0.0;
            double v =
                im->terms.velocity > 0.0 ? im->terms.velocity * x[k] + im->terms.v_hat[k] : 0.0;
            double drag = im->terms.velocity > 0.0 ? system->damping[i] * mass * v : 0.0;
            double blown = air->drag * system->area[i] * wind[c];
            g[k] += inertia + drag - blown - mass * pull[c] - force[c];
        }
    }
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
        double d = im->terms.acceleration + im->terms.velocity * system->damping[i];
        block_add_diagonal(values, im->diagonal[i], d * system->mass[i]);
        if (system->contact.obstacle_count > 0) {
            double block[9] = {0};
            contact_at(im, i, x, NULL, block, NULL);
            block_add(values, im->diagonal[i], block);
        }
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

/* every place stays on its side of the tangent planes of the obstacles: the part of its step
 * that would cross is taken off, so that cloth slides instead of locking */
static void limit_step(void *context, const double *x, double *dx) {
    const Implicit *im = context;
    const ContactDef *def = &im->system->contact;
    for (int i = 0; i < im->system->place_count; i++) {
        if (def->mass[i] == 0.0 || im->held[i]) {
            continue;
        }
        for (int o = 0; o < def->obstacle_count; o++) {
            Vec3 local, p = pose_unapply(im->start->contact.poses[o], vec3_load(x + 3 * i));
            double distance = solid_distance(&def->obstacles[o].solid, p, &local);
            Vec3 normal = quat_rotate(im->start->contact.poses[o].turn, local),
                 d = vec3_load(dx + 3 * i);
            double room = contact_room(def->vertex_distance[i], distance),
                   approach = -vec3_dot(d, normal);
            if (approach > room) {
                vec3_store(dx + 3 * i, vec3_axpy(d, approach - room, normal));
            }
        }
    }
}

NewtonProblem implicit_problem(Implicit *im, const ImplicitTerms *terms, const unsigned char *held,
                               const State *start) {
    im->terms = *terms;
    im->held = held;
    im->start = start;
    return (NewtonProblem){.context = im,
                           .node_count = im->system->place_count,
                           .fixed = held,
                           .matrix = &im->matrix,
                           .factor = im->factor,
                           .gradient = gradient,
                           .tangent = tangent,
                           .keep_stress = keep_stress,
                           .limit_step = im->system->contact.obstacle_count ? limit_step : NULL};
}

NewtonReport implicit_solve(Implicit *im, const ImplicitTerms *terms, const unsigned char *held,
                            const State *start, const NewtonParams *params, const double *first_dx,
                            double *x) {
    NewtonProblem problem = implicit_problem(im, terms, held, start);
    return newton_solve(&problem, params, first_dx, x, &im->scratch);
}

void implicit_store_bristles(Implicit *im, const double *x, State *state) {
    size_t obstacles = (size_t)im->system->contact.obstacle_count;
    ArenaMark mark = arena_mark(&im->scratch);
    double *next = arena_push(&im->scratch, double, 3 * obstacles);
    for (int i = 0; i < im->system->place_count && obstacles > 0; i++) {
        memset(next, 0, 3 * obstacles * sizeof *next);
        contact_at(im, i, x, NULL, NULL, next);
        memcpy(state->contact.bristles + 3 * (size_t)i * obstacles, next,
               3 * obstacles * sizeof *next);
    }
    arena_rewind(&im->scratch, mark);
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
