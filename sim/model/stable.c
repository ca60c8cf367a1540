#include "sim/model/stable.h"

#include <math.h>
#include <string.h>

double stable_step_by_power(const Cloth *cloth) {
    enum { ITERATIONS = 300 };      /* 4000 give the same */
    const double difference = 1e-6; /* of the spacing */
    Arena arena = {0};
    int count = 3 * (cloth->node_count + cloth->ghost_count);
    double *x = arena_push(&arena, double, count), *d = arena_push(&arena, double, count);
    double *moved = arena_push(&arena, double, count), *g = arena_push(&arena, double, count);
    double *g0 = arena_push(&arena, double, count);
    cloth_start(cloth, x);
    cloth->model->add_gradient(cloth, x, g0);
    double lambda = 0.0, scale = difference * cloth->panel.h1;
    for (int i = 0; i < 3 * cloth->node_count; i++) {
        d[i] = (i % 3 == 0 ? 1.0 : 0.5) * (i / 3 % 2 ? -1.0 : 1.0) + 0.3 * sin(1.7 * i);
    }
    for (int k = 0; k < ITERATIONS; k++) {
        double norm = 0.0;
        for (int i = 0; i < 3 * cloth->node_count; i++) {
            norm = fmax(norm, fabs(d[i]));
        }
        memset(g, 0, (size_t)count * sizeof *g);
        for (int i = 0; i < count; i++) {
            d[i] /= norm;
            moved[i] = x[i] + scale * d[i];
        }
        cloth->model->add_gradient(cloth, moved, g);
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
    return 2.0 / sqrt(lambda);
}

SweepLattice damping_limits(const Cloth *cloth) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    return (SweepLattice){.h1 = p->h1,
                          .h2 = p->h2,
                          .c11 = m->c11,
                          .c22 = m->c22,
                          .d11 = m->d11,
                          .d12 = m->d12,
                          .d22 = m->d22,
                          .d66 = m->d66};
}
