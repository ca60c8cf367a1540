#include "sim/model/stable.h"

#include <math.h>
#include <string.h>

#define STEP_ITERATIONS 300    /* 4000 give the same */
#define DAMPING_ITERATIONS 100 /* within some percent, of a bound that has room */
#define DIFFERENCE 1e-6        /* of the spacing */

typedef enum Part { PART_ALL, PART_BENDING, PART_MEMBRANE } Part;

/* at x + change of what is looked at, at x of the rest */
static void part_gradient(const Cloth *cloth, Part part, const double *x, const double *moved,
                          double *gradient, int count) {
    memset(gradient, 0, (size_t)count * sizeof *gradient);
    if (part == PART_ALL) {
        cloth->model->add_gradient(cloth, moved, gradient);
    } else {
        cloth->model->add_damped_gradient(cloth, part == PART_MEMBRANE ? moved : x,
                                          part == PART_BENDING ? moved : x, gradient);
    }
}

/* [1/s2] the square of the fastest angular frequency at the start, by the power method on differences of
 * the gradient */
static double fastest2(const Cloth *cloth, Part part, int iterations) {
    Arena arena = {0};
    int count = 3 * (cloth->node_count + cloth->ghost_count);
    double *x = arena_push(&arena, double, count), *d = arena_push(&arena, double, count);
    double *moved = arena_push(&arena, double, count), *g = arena_push(&arena, double, count);
    double *g0 = arena_push(&arena, double, count);
    cloth_start(cloth, x);
    part_gradient(cloth, part, x, x, g0, count);
    double lambda = 0.0, scale = DIFFERENCE * cloth->panel.h1;
    for (int i = 0; i < 3 * cloth->node_count; i++) {
        d[i] = (i % 3 == 0 ? 1.0 : 0.5) * (i / 3 % 2 ? -1.0 : 1.0) + 0.3 * sin(1.7 * i);
    }
    for (int k = 0; k < iterations; k++) {
        double norm = 0.0;
        for (int i = 0; i < 3 * cloth->node_count; i++) {
            norm = fmax(norm, fabs(d[i]));
        }
        for (int i = 0; i < count; i++) {
            d[i] /= norm;
            moved[i] = x[i] + scale * d[i];
        }
        part_gradient(cloth, part, x, moved, g, count);
        double dd = 0.0, dkd = 0.0;
        for (int i = 0; i < 3 * cloth->node_count; i++) {
            double kd = (g[i] - g0[i]) / (scale * cloth->mass[i / 3]);
            dkd += cloth->mass[i / 3] * d[i] * kd;
            dd += cloth->mass[i / 3] * d[i] * d[i];
            d[i] = kd;
        }
        lambda = dkd / dd;
    }
    arena_free(&arena);
    return lambda;
}

double stable_step_by_power(const Cloth *cloth) {
    return 2.0 / sqrt(fastest2(cloth, PART_ALL, STEP_ITERATIONS));
}

Fastest fastest_of_lattice(const Cloth *cloth, double d11, double d22) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    SweepLattice lattice = {.h1 = p->h1,
                            .h2 = p->h2,
                            .c11 = m->c11,
                            .c22 = m->c22,
                            .d11 = d11,
                            .d12 = m->d12,
                            .d22 = d22,
                            .d66 = m->d66};
    return sweep_fastest(&lattice, m->density);
}

Fastest fastest_by_power(const Cloth *cloth) {
    double bending = cloth->def->bending_damping, membrane = cloth->def->membrane_damping;
    return (Fastest){bending > 0.0 ? fastest2(cloth, PART_BENDING, DAMPING_ITERATIONS) : 0.0,
                     membrane > 0.0 ? fastest2(cloth, PART_MEMBRANE, DAMPING_ITERATIONS) : 0.0};
}
