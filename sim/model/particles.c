/* particles.c: interacting particles at the crossings of threads (Breen, House, Wozny 1994), from
 * measured curves.
 *
 * Kept: energies of stretching, bending and trellising from the Kawabata curves of warp and weft.
 * Corrected: each unit counts once; the energy of bending is the work of the measured moment, not
 * M K/2, which holds for straight lines only; border threads own half a width; the trellis unit is
 * the cell, which sees what crossings are blind to. Threads are linear springs; the twist of a cell
 * has the stiffness of the fabric, of which the paper knows nothing; contact replaces the force that
 * kept particles a spacing apart. As published on demand: that force (`repel`), and threads whose
 * energy grows with the fifth power of the stretch (`threads: breen`), as stiff at 1 % as the line.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/model/mlpg.h"
#include "sim/model/repel.h"
#include "sim/model/spring_net.h"
#include "sim/model/stable.h"
#include "sim/model/thread_rows.h"

#define FIFTH_AT 0.01 /* stretch at which the tension of both laws is the same */

typedef struct Particles {
    SpringKind kinds[4]; /* 2 axis + border */
    SpringNet threads;
    ThreadUnits units;
    Bending twist;
    ThreadRows *rows; /* forces of all these but the walls, and threads of the fifth power */
    Repel *repel;     /* NULL: none */
} Particles;

static void create_threads(Cloth *cloth, Particles *s, Arena *arena) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    double h[2] = {p->h1, p->h2}, modulus[2] = {m->c11, m->c22};
    for (int k = 0; k < 4; k++) {
        int axis = k / 2;
        double width = h[1 - axis] * (k % 2 ? 0.5 : 1.0);
        s->kinds[k] = spring_kind(h[axis], modulus[axis] * width / h[axis], NULL, 0.0);
    }
    s->threads = (SpringNet){.kinds = s->kinds,
                             .springs = arena_push(arena, Spring, 2 * p->node_count),
                             .node_limit = cloth->node_count};
    for (int axis = 0; axis < 2; axis++) {
        spring_net_add_threads(&s->threads, p, axis, 1, 2 * axis);
    }
}

/* the part of the bending samples that twists */
static void create_twist(const Cloth *cloth, Particles *s, Arena *arena) {
    Cloth twisted = *cloth;
    BendingSamples samples;
    twisted.material.d11 = twisted.material.d12 = twisted.material.d22 = 0.0;
    mlpg_lattice_bending(&twisted, &samples, arena);
    s->twist = bending_create(&samples, cloth->node_count + cloth->ghost_count, cloth->node_count,
                              NULL, arena);
}

static const char *note(const Cloth *cloth, Arena *arena) {
    const Material *m = &cloth->material;
    char text[160];
    snprintf(text, sizeof text, "particles have no Poisson ratio, the fabric %.2g; D12 is left out",
             m->c12 / m->c22);
    return arena_strdup(arena, text);
}

/* [J] C0 with the tension of the line at FIFTH_AT */
static double fifth_of(const SpringKind *kind) {
    return kind->stiffness * kind->rest * kind->rest * FIFTH_AT / (5.0 * pow(FIFTH_AT, 4.0));
}

/* what the paper has and toile leaves out by default */
static void create_published(Cloth *cloth, Particles *s, Arena *arena) {
    const Panel *p = &cloth->panel;
    for (int k = 0; k < 4 && cloth->def->fifth_power; k++) {
        s->kinds[k].fifth = fifth_of(&s->kinds[k]);
    }
    if (cloth->def->repel) {
        double strength = sqrt(fifth_of(&s->kinds[0]) * fifth_of(&s->kinds[2]));
        s->repel = repel_create(p, strength, p->start, arena);
    }
}

static bool create(Cloth *cloth, Arena *arena, Error *error) {
    const Panel *p = &cloth->panel;
    if (p->rest_curvature[0] != 0.0 || p->rest_curvature[1] != 0.0) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': particles know flat cloth only, without rest curvature",
                         cloth->def->name);
    }
    Particles *s = arena_push(arena, Particles, 1);
    Material *m = &cloth->material;
    cloth->data = s;
    cloth->note = note(cloth, arena);
    double poisson = m->c12 * m->c12 / (m->c11 * m->c22);
    m->c11 *= 1.0 - poisson, m->c22 *= 1.0 - poisson; /* Young's moduli */
    m->c12 = m->d12 = 0.0;
    create_threads(cloth, s, arena);
    if (!thread_units_create(cloth, &s->units, arena, error)) {
        return false;
    }
    create_twist(cloth, s, arena);
    create_published(cloth, s, arena);
    bool line = !cloth->def->fifth_power;
    double stiffness[2] = {line ? s->kinds[0].stiffness : 0.0, line ? s->kinds[2].stiffness : 0.0};
    s->rows = thread_rows_create(p, &s->units, stiffness, 4.0 * m->d66, arena);
    cloth->strain_count = s->threads.spring_count;
    for (int i = 0; i < cloth->node_count; i++) {
        cloth->mass[i] = m->density * p->area[i];
    }
    return true;
}

static double energy(const Cloth *cloth, const double *x) {
    const Particles *s = cloth->data;
    return spring_net_energy(&s->threads, x) + thread_units_energy(&s->units, x) +
           bending_energy(&s->twist, x) + (s->repel ? repel_energy(s->repel, x) : 0.0);
}

static void add_damped_gradient(const Cloth *cloth, const double *stretched, const double *bent,
                                double *gradient) {
    const Particles *s = cloth->data;
    thread_rows_add_gradient(s->rows, stretched, bent, gradient);
    thread_units_add_wall_gradient(&s->units, bent, gradient);
    if (cloth->def->fifth_power) {
        spring_net_add_gradient(&s->threads, stretched, gradient);
    }
    if (s->repel) {
        repel_add_gradient(s->repel, stretched, gradient);
    }
}

static Fastest fastest(const Cloth *cloth) {
    const Particles *s = cloth->data;
    return fastest_of_lattice(cloth, yarn_stiffest(&s->units.bend[0]),
                              yarn_stiffest(&s->units.bend[1]));
}

static void add_gradient(const Cloth *cloth, const double *x, double *gradient) {
    add_damped_gradient(cloth, x, x, gradient);
}

static void stress(const Cloth *cloth, const double *x, double *out) {
    const Particles *s = cloth->data;
    spring_net_tension(&s->threads, x, out);
}

static void predict_stress(const Cloth *cloth, const double *x_new, const double *dx, double *out) {
    const Particles *s = cloth->data;
    spring_net_predict(&s->threads, x_new, dx, out);
}

static int couple(const Cloth *cloth, int *pairs) {
    const Particles *s = cloth->data;
    int count = spring_net_couple(&s->threads, pairs);
    count += thread_units_couple(&s->units, pairs ? pairs + 2 * count : NULL);
    return count + bending_couple(&s->twist, pairs ? pairs + 2 * count : NULL);
}

static void bind_hessian(Cloth *cloth, const BlockMatrix *matrix, int first, Arena *arena) {
    Particles *s = cloth->data;
    spring_net_bind(&s->threads, matrix, first, arena);
    thread_units_bind(&s->units, matrix, first, arena);
    bending_bind(&s->twist, matrix, first, arena);
}

static void add_hessian(const Cloth *cloth, const double *x, const double *sigma, bool definite,
                        double *values) {
    const Particles *s = cloth->data;
    spring_net_add_hessian(&s->threads, x, sigma, definite, values);
    thread_units_add_hessian(&s->units, x, values);
    bending_add_hessian(&s->twist, x, values);
}

/* of the fifth power: as far as FIFTH_AT, where it is four times as stiff as the line */
static double stable_step(const Cloth *cloth) {
    if (!cloth->def->fifth_power) {
        return stable_step_by_power(cloth);
    }
    Cloth line = *cloth;
    Particles as_line = *(const Particles *)cloth->data;
    line.data = &as_line;
    SpringKind kinds[4];
    memcpy(kinds, as_line.kinds, sizeof kinds);
    for (int k = 0; k < 4; k++) {
        kinds[k].fifth = 0.0;
    }
    as_line.threads.kinds = kinds;
    return 0.5 * stable_step_by_power(&line);
}

const ClothModel cloth_model_particles = {
    .name = "particles",
    .about = "threads of particles with measured curves (Breen, House, Wozny 1994)",
    .lattice_bendings = 1u << BENDING_ANGLE | 1u << BENDING_SINE,
    .create = create,
    .energy = energy,
    .add_gradient = add_gradient,
    .add_damped_gradient = add_damped_gradient,
    .fastest = fastest,
    .stress = stress,
    .predict_stress = predict_stress,
    .couple = couple,
    .add_hessian = add_hessian,
    .bind_hessian = bind_hessian,
    .stable_step = stable_step,
};
