/* A strip on its edge, held at one end, buckles sideways under its own weight where bending and twist
 * together no longer carry it: what twist stiffness does each model really have? */
#include <lapacke.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

/* the strip of lateral buckling: W/L = 0.2, clamped at its left end, its weight in its plane */
static void make_blade(Bench *b, const char *model, BendingKind bending, int along, int across) {
    b->cloth = cloths_rectangle(1.0, 0.2, along + 1, across + 1,
                                cloths_fabric(1.0 / 9.81, 1e6, 0.0, 1.0, 0.0));
    b->cloth.model = model;
    b->cloth.bending = bending;
    b->scene = cloths_scene(&b->cloth);
    b->scene.gravity = vec3(0, -9.81, 0);
    b->handles[0] = handle_default();
    b->handles[0].kind = HANDLE_CLAMP;
    b->handles[0].region = REGION_LEFT;
    bench_build(b, 1);
}

/* k (count x count): force across the plane at the free nodes by their motion across it */
static void stiffness_across(const Cloth *cloth, const int *nodes, int count, double *x, double *g,
                             double *k) {
    for (int j = 0; j < count; j++) {
        double *z = &x[3 * nodes[j] + 2], step = 1e-7;
        *z = step;
        memset(g, 0, 3 * (size_t)(cloth->node_count + cloth->ghost_count) * sizeof *g);
        cloth->model->add_gradient(cloth, x, g);
        *z = 0.0;
        for (int i = 0; i < count; i++) {
            k[i * count + j] = g[3 * nodes[i] + 2] / step;
        }
    }
}

/* rho g L^3/D where bending plus stress turns singular; the stress is that of gamma = 1 */
static double buckling_load(const char *model, BendingKind bending, int along, int across) {
    Bench b = {0};
    make_blade(&b, model, bending, along, across);
    const Cloth *cloth = &b.system.cloths[0];
    State state = state_allocate(&b.system, &b.arena);
    unsigned char *held = arena_push(&b.arena, unsigned char, b.system.place_count);
    state_start(&b.system, &state);
    system_mark_held(&b.system, 0.0, held);
    int *nodes = arena_push(&b.arena, int, cloth->node_count), m = 0;
    for (int i = 0; i < cloth->node_count; i++) {
        nodes[m] = i;
        m += !held[i];
    }
    double *g = arena_push(&b.arena, double, 3 * b.system.place_count);
    double *flat = arena_push(&b.arena, double, m *m), *w = arena_push(&b.arena, double, m);
    double *loaded = arena_push(&b.arena, double, m *m);
    stiffness_across(cloth, nodes, m, state.x, g, flat);
    Implicit *implicit = implicit_create(&b.system);
    ImplicitTerms terms = {0};
    NewtonParams params = newton_default();
    params.tolerance = 1e-7;
    implicit_begin(implicit, held, &state);
    NewtonReport report = implicit_solve(implicit, &terms, &params, NULL, state.x);
    assert_int_equal(report.status, NEWTON_CONVERGED);
    implicit_destroy(implicit);
    stiffness_across(cloth, nodes, m, state.x, g, loaded);
    for (int i = 0; i < m * m; i++) {
        loaded[i] = flat[i] - loaded[i];
    }
    assert_int_equal(LAPACKE_dsygv(LAPACK_ROW_MAJOR, 1, 'N', 'U', m, loaded, m, flat, m, w), 0);
    double critical = 1.0 / w[m - 1];
    arena_free(&b.arena);
    return critical;
}

typedef struct Expected {
    const char *model;
    BendingKind bending;
    double low[2], high[2]; /* load / exact one, at 20 x 4 and at 40 x 8 cells */
} Expected;

/* hinges are no plate, and no refinement makes them one */
static const Expected expected[] = {
    {"mlpg", BENDING_STENCIL, {0.975, 0.993}, {1.025, 1.007}},
    {"springs", BENDING_STENCIL, {0.975, 0.993}, {1.025, 1.007}},
    {"triangles", BENDING_TENSOR, {0.975, 0.993}, {1.025, 1.007}},
    {"triangles", BENDING_HINGE, {1.8, 1.83}, {1.9, 1.9}},
    {"particles", BENDING_ANGLE, {0.975, 0.993}, {1.025, 1.007}},
    {"particles", BENDING_SINE, {0.975, 0.993}, {1.025, 1.007}},
};

/* a narrow strip buckles at a load that goes with the square root of its twist stiffness */
static void test_lateral_buckling(void **unused) {
    (void)unused;
    const double exact = 20.642; /* rho g L^3 / D at W/L = 0.2, nu = 0, by p = 5 B-splines */
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        const Expected *e = &expected[i];
        double share[2];
        for (int k = 0; k < 2; k++) {
            share[k] = buckling_load(e->model, e->bending, 20 << k, 4 << k) / exact;
        }
        print_message("  %s %s: %+.2f, %+.2f %%; twist stiffness %.2f, %.2f of the fabric's\n",
                      e->model, bending_words[e->bending], 100 * (share[0] - 1),
                      100 * (share[1] - 1), share[0] * share[0], share[1] * share[1]);
        for (int k = 0; k < 2; k++) {
            CHECK_AT_MOST(e->low[k], share[k]);
            CHECK_AT_MOST(share[k], e->high[k]);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lateral_buckling)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
