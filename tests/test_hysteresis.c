/* Hysteresis: elements, virtual Kawabata testers for all models, memory of states. */
#include <stdlib.h>
#include <string.h>

#include "sim/model/yarn.h"
#include "sim/model/yarn_friction.h"
#include "sim/step/stepper.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

static const char *const fabrics[] = {
    "canvas",         "cotton-broadcloth", "cotton-plain",    "cotton-poplin",
    "denim",          "polyester-faille",  "polyester-plain", "polyester-tropical",
    "silk-charmeuse", "wool-coating",      "wool-tropical",   NULL};

/* the same branch for any step; a closed loop; 100 small cycles at a bias leave the force alone */
static void test_elements(void **unused) {
    (void)unused;
    const double step = 0.6e-3, onset = 30.0;
    double forces[2];
    for (int fine = 0; fine < 2; fine++) {
        double slips[FRICTION_ELEMENTS] = {0}, q = 0.0;
        int count = fine ? 500 : 25;
        const double turns[4] = {0.0, 250.0, -250.0, 100.0};
        for (int leg = 0; leg < 3; leg++) {
            for (int k = 1; k <= count; k++) {
                q = turns[leg] + (turns[leg + 1] - turns[leg]) * k / count;
                yarn_friction_slip(step, onset, q, slips);
            }
        }
        forces[fine] = yarn_friction_force(step, onset, slips, q, NULL, NULL);
        double before = forces[fine];
        for (int k = 0; k < 100; k++) {
            yarn_friction_slip(step, onset, 97.0, slips);
            yarn_friction_slip(step, onset, 100.0, slips);
        }
        CHECK_NEAR(yarn_friction_force(step, onset, slips, q, NULL, NULL), before, 1e-10 * step);
    }
    CHECK_NEAR(forces[1], forces[0], 1e-12 * step);
    CHECK_NEAR(forces[0], step, 1e-12 * step);
    /* the virgin curve is the first branch of the yarn curve */
    YarnCurve curve = {0.0, step, onset};
    double slips[FRICTION_ELEMENTS] = {0}, worst = 0.0;
    for (double q = 0.0; q < 60.0; q += 0.5) {
        double force = yarn_friction_force(step, onset, slips, q, NULL, NULL);
        worst = fmax(worst, fabs(force - yarn_value(&curve, q, NULL)) / step);
    }
    CHECK_AT_MOST(worst, 1.0 / (4 * FRICTION_ELEMENTS * FRICTION_ELEMENTS));
}

/* potential, force and tangent belong together */
static void test_potential(void **unused) {
    (void)unused;
    double slips[FRICTION_ELEMENTS] = {1.0, -4.0, 7.0, 3.0};
    for (double q = -80.3; q < 80.0; q += 7.7) {
        double e[2] = {0}, tangent = 0.0, d = 1e-4, f[2];
        double force = yarn_friction_force(1e-3, 30.0, slips, q, NULL, &tangent);
        f[0] = yarn_friction_force(1e-3, 30.0, slips, q - d, &e[0], NULL);
        f[1] = yarn_friction_force(1e-3, 30.0, slips, q + d, &e[1], NULL);
        CHECK_NEAR(force, (e[1] - e[0]) / (2 * d), 1e-9);
        CHECK_NEAR(tangent, (f[1] - f[0]) / (2 * d), 1e-10);
    }
}

/* ---- virtual testers ---- */

enum { SEGMENTS = 10 };

/* 1 cm between walls, bent to a uniform curvature by turning them */
static void bend(const Cloth *cloth, double turn, double *x) {
    const Panel *p = &cloth->panel;
    double h = p->h1, at[2] = {0, 0};
    for (int i = -1; i <= p->nu; i++) {
        for (int j = 0; j < p->nv; j++) {
            int place = j * p->nu + i;
            for (int g = 0; g < cloth->ghost_count; g++) {
                const Ghost *ghost = &cloth->ghosts[g];
                if (ghost->border / p->nu == j &&
                    ((i < 0 && ghost->side == 0) || (i == p->nu && ghost->side == 1))) {
                    place = cloth->node_count + g;
                }
            }
            vec3_store(x + 3 * place, vec3(at[0], p->h2 * j, at[1]));
        }
        /* a wall turns half as much as a node */
        double share = i < 0 ? 0.0 : i >= SEGMENTS ? SEGMENTS : i + 0.5;
        at[0] += h * cos(turn / SEGMENTS * share), at[1] += h * sin(turn / SEGMENTS * share);
    }
}

static void shear(const Cloth *cloth, double phi, double *x) {
    for (int i = 0; i < cloth->node_count; i++) {
        const double *uv = cloth->panel.material + 2 * i;
        vec3_store(x + 3 * i, vec3(uv[0] + uv[1] * sin(phi), uv[1] * cos(phi), 0));
    }
}

typedef void Pose2(const Cloth *cloth, double q, double *x);

/* dE/dq at q with the history as it is; then q is accepted */
static double drive(Cloth *cloth, Pose2 *pose, double q, double step, double *x) {
    double energy[2];
    for (int k = 0; k < 2; k++) {
        pose(cloth, q + (k ? step : -step), x);
        energy[k] = cloth->model->energy(cloth, x);
    }
    pose(cloth, q, x);
    cloth->model->commit(cloth, x);
    return (energy[1] - energy[0]) / (2 * step);
}

/* forces at `count` places on the way from one end to the other */
static void branch(Cloth *cloth, Pose2 *pose, double from, double to, int count, double step,
                   double *x, double *forces) {
    for (int k = 1; k <= count; k++) {
        forces[k] = drive(cloth, pose, from + (to - from) * k / count, step, x);
    }
}

static void make_specimen(Arena *arena, Cloth *cloth, ClothDef *def, const char *model,
                          const char *fabric, bool bending) {
    Error error = {0};
    *def = bending ? cloths_rectangle(0.01, 0.002, SEGMENTS + 1, 3, cloths_orthotropic())
                   : cloths_rectangle(0.2, 0.05, 21, 6, cloths_orthotropic());
    HandleDef walls[2] = {handle_default(), handle_default()};
    assert_true(fabric_read(fabric, arena, &def->fabric, &error));
    def->fabric.bend_poisson.value = 0.0;
    def->model = model;
    def->hysteresis = true;
    walls[0].kind = walls[1].kind = HANDLE_CLAMP;
    walls[0].region = REGION_LEFT, walls[1].region = REGION_RIGHT;
    if (!cloth_create(cloth, def, walls, bending ? 2 : 0, 1, arena, &error)) {
        fail_msg("%s", error.text);
    }
}

/* loop 0, 2.5, -2.5, 2.5 per cm: B, 2HB at 1 per cm, residual curvature */
static void bending_loop(const char *model, const char *fabric, int count) {
    Arena arena = {0};
    Cloth cloth;
    ClothDef def;
    make_specimen(&arena, &cloth, &def, model, fabric, true);
    double *x = arena_push(&arena, double, 3 * (cloth.node_count + cloth.ghost_count));
    double *down = arena_push(&arena, double, count + 1),
           *up = arena_push(&arena, double, count + 1);
    const double end = 2.5; /* rad: 250 /m on 1 cm */
    branch(&cloth, bend, 0.0, end, count, 1e-4, x, down);
    double top = down[count];
    branch(&cloth, bend, end, -end, count, 1e-4, x, down);
    branch(&cloth, bend, -end, end, count, 1e-4, x, up);
    down[0] = top, up[0] = down[count];
    double width = 0.002, residual = 0.0;
    /* place k of `down` is at curvature 250 (1 - 2 k/count) /m */
    int k1 = count * 3 / 10, k05 = count * 4 / 10, k15 = count * 2 / 10;
    double b = 0.5 * ((down[k15] - down[k05]) + (up[count - k15] - up[count - k05])) / width / 100;
    double hb = (up[count - k1] - down[k1]) / width;
    for (int k = 0; k < count; k++) {
        if (down[k] > 0.0 && down[k + 1] <= 0.0) {
            double share = down[k] / (down[k] - down[k + 1]);
            residual = 250.0 * (1.0 - 2.0 * (k + share) / count);
        }
    }
    const Fabric *f = &def.fabric;
    double mean = 0.5 * (f->bend_warp.value + f->bend_weft.value);
    double exact_hb = f->bend_hysteresis.value * f->bend_warp.value / mean;
    print_message("  %s, %s: B %.4g (%.4g), 2HB %.4g (%.4g), residual %.4g (%.4g) /m\n", model,
                  fabric, b, f->bend_warp.value, hb, exact_hb, residual,
                  0.5 * exact_hb / f->bend_warp.value);
    CHECK_AT_MOST(fabs(b / f->bend_warp.value - 1.0), 0.01);
    CHECK_AT_MOST(fabs(hb / exact_hb - 1.0), 0.01);
    CHECK_AT_MOST(fabs(residual * f->bend_warp.value / (0.5 * exact_hb) - 1.0), 0.02);
    arena_free(&arena);
}

/* loop +-8 degrees: G by the mean slope of both branches, 2HG at half a degree */
static void shear_loop(const char *model, const char *fabric) {
    Arena arena = {0};
    Cloth cloth;
    ClothDef def;
    make_specimen(&arena, &cloth, &def, model, fabric, false);
    enum { COUNT = 160 }; /* a tenth of a degree */
    double *x = arena_push(&arena, double, 3 * cloth.node_count), f[3][COUNT + 1];
    double end = 8 * PI / 180, area = 0.01;
    branch(&cloth, shear, 0.0, end, COUNT, 1e-5, x, f[0]);
    branch(&cloth, shear, end, -end, COUNT, 1e-5, x, f[1]);
    branch(&cloth, shear, -end, end, COUNT, 1e-5, x, f[2]);
    int low = COUNT / 2 + 5, high = COUNT / 2 + 25; /* 0.5, 2.5 degrees */
    double c[2] = {area * cos(0.5 * PI / 180), area * cos(2.5 * PI / 180)};
    double rise = (f[2][high] + f[1][COUNT - high]) / c[1] - (f[2][low] + f[1][COUNT - low]) / c[0];
    double g = 0.5 * rise / (2 * PI / 180), hg = (f[2][low] - f[1][COUNT - low]) / c[0];
    const Fabric *fab = &def.fabric;
    print_message("  %s, %s: G %.4g (%.4g), 2HG %.4g (%.4g) N/m\n", model, fabric, g,
                  fab->shear.value, hg, fab->shear_hysteresis.value);
    CHECK_AT_MOST(fabs(g / fab->shear.value - 1.0), 0.01);
    CHECK_AT_MOST(fabs(hg / fab->shear_hysteresis.value - 1.0), 0.02);
    arena_free(&arena);
}

static void test_testers(void **unused) {
    (void)unused;
    for (const ClothModel *const *model = cloth_models; *model; model++) {
        for (int k = 0; fabrics[k]; k++) {
            bending_loop((*model)->name, fabrics[k], 200);
            shear_loop((*model)->name, fabrics[k]);
        }
        bending_loop((*model)->name, fabrics[0], 100); /* steps twice as long: the same loop */
    }
}

/* looking at energies and forces leaves the history alone; a step taken back leaves no trace */
static void test_memory(void **unused) {
    (void)unused;
    Bench b = {0};
    b.cloth = cloths_rectangle(0.1, 0.1, 8, 8, cloths_orthotropic());
    b.cloth.hysteresis = true;
    b.cloth.model = "triangles";
    b.scene = cloths_scene(&b.cloth);
    bench_build(&b, 0);
    State state = state_allocate(&b.system, &b.arena), kept = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    size_t bytes = (size_t)b.system.history_count * sizeof(double);
    assert_true(b.system.history_count > 0);
    cloths_shake(state.x, b.system.place_count, 2e-3, 5);
    system_load_history(&b.system, &state);
    system_commit(&b.system, &state);
    state_copy(&b.system, &kept, &state);
    double *g = arena_push(&b.arena, double, 3 * b.system.place_count);
    cloths_shake(state.x, b.system.place_count, 2e-3, 6);
    system_elastic_energy(&b.system, state.x);
    system_add_gradient(&b.system, state.x, g);
    system_store_history(&b.system, &state);
    assert_memory_equal(state.history, kept.history, bytes);
    system_commit(&b.system, &state);
    assert_memory_not_equal(state.history, kept.history, bytes);
    system_load_history(&b.system, &kept);
    system_store_history(&b.system, &state);
    assert_memory_equal(state.history, kept.history, bytes);
    arena_free(&b.arena);
}

/* A strip that was bent by a load and let go keeps a bend, the same for both roads; without
 * hysteresis it is straight again. */
static double bend_left(const char *stepper, bool hysteresis) {
    Bench b = {0};
    Error error = {0};
    b.cloth = cloths_rectangle(0.06, 0.02, 13, 5, cloths_fabric(0.2, 400.0, 0.2, 2e-5, 0.0));
    b.cloth.hysteresis = hysteresis;
    b.cloth.model = "particles";
    b.cloth.fabric.bend_hysteresis.value = hysteresis ? 1.2e-3 : 0.0;
    b.cloth.fabric.bend_onset.value = 15.0;
    b.cloth.damping = 20.0;
    b.scene = cloths_scene(&b.cloth);
    b.scene.solver.self_contact = false;
    b.scene.solver.stepper = stepper;
    b.scene.solver.step = strcmp(stepper, "central") ? 1e-3 : 0.0;
    b.handles[0] = handle_default();
    b.handles[0].kind = HANDLE_CLAMP;
    b.handles[0].region = REGION_LEFT;
    bench_build(&b, 1);
    const Stepper *s = stepper_find(stepper);
    void *data;
    assert_true(s->history && s->create(&b.system, &data, &error));
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    Statistics statistics = {.smallest_gap = INFINITY};
    for (int f = 1; f <= 60; f++) {
        /* heavy for half a second, weightless after */
        b.scene.gravity = vec3(0, 0, f <= 15 ? -9.81 : 0.0);
        if (!s->advance(&b.system, data, &state, f / 30.0, &statistics, &error)) {
            fail_msg("%s", error.text);
        }
    }
    double tip = state.x[3 * 12 + 2];
    if (s->destroy) {
        s->destroy(data);
    }
    arena_free(&b.arena);
    return tip;
}

static void test_bend_left(void **unused) {
    (void)unused;
    double elastic = bend_left("central", false), explicit = bend_left("central", true);
    double implicit = bend_left("bdf2", true);
    print_message("  tip after the load: elastic %.3g mm, explicit %.4g mm, implicit %.4g mm\n",
                  1e3 * elastic, 1e3 * explicit, 1e3 * implicit);
    CHECK_AT_MOST(fabs(elastic), 1e-4);
    CHECK_AT_MOST(explicit, -2e-3);
    CHECK_NEAR(implicit, explicit, 0.03 * fabs(explicit));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_elements),  cmocka_unit_test(test_potential),
        cmocka_unit_test(test_testers),   cmocka_unit_test(test_memory),
        cmocka_unit_test(test_bend_left),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
