/* Hysteresis: elements, virtual Kawabata testers for all models, memory of states. */
#include <stdlib.h>
#include <string.h>

#include "sim/model/yarn.h"
#include "sim/model/yarn_friction.h"
#include "sim/step/stepper.h"
#include "sim/tester_loop.h"
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
    const FrictionLaw law = {step, onset, 1.0};
    double forces[2];
    for (int fine = 0; fine < 2; fine++) {
        double slips[FRICTION_ELEMENTS] = {0}, q = 0.0;
        int count = fine ? 500 : 25;
        const double turns[4] = {0.0, 250.0, -250.0, 100.0};
        for (int leg = 0; leg < 3; leg++) {
            for (int k = 1; k <= count; k++) {
                q = turns[leg] + (turns[leg + 1] - turns[leg]) * k / count;
                yarn_friction_slip(law, q, slips);
            }
        }
        forces[fine] = yarn_friction_force(law, slips, q, NULL, NULL);
        double before = forces[fine];
        for (int k = 0; k < 100; k++) {
            yarn_friction_slip(law, 97.0, slips);
            yarn_friction_slip(law, 100.0, slips);
        }
        CHECK_NEAR(yarn_friction_force(law, slips, q, NULL, NULL), before, 1e-10 * step);
    }
    CHECK_NEAR(forces[1], forces[0], 1e-12 * step);
    CHECK_NEAR(forces[0], step, 1e-12 * step);
    /* the virgin curve is the first branch of the yarn curve */
    YarnCurve curve = {.step = step, .onset = onset};
    double slips[FRICTION_ELEMENTS] = {0}, worst = 0.0;
    for (double q = 0.0; q < 60.0; q += 0.5) {
        double force = yarn_friction_force(law, slips, q, NULL, NULL);
        worst = fmax(worst, fabs(force - yarn_value(&curve, q, NULL)) / step);
    }
    CHECK_AT_MOST(worst, 1.0 / (4 * FRICTION_ELEMENTS * FRICTION_ELEMENTS));
}

/* potential, force and tangent belong together */
static void test_potential(void **unused) {
    (void)unused;
    const FrictionLaw law = {1e-3, 30.0, 1.3};
    double slips[FRICTION_ELEMENTS] = {1.0, -4.0, 7.0, 3.0};
    for (double q = -80.3; q < 80.0; q += 7.7) {
        double e[2] = {0}, tangent = 0.0, d = 1e-4, f[2];
        double force = yarn_friction_force(law, slips, q, NULL, &tangent);
        f[0] = yarn_friction_force(law, slips, q - d, &e[0], NULL);
        f[1] = yarn_friction_force(law, slips, q + d, &e[1], NULL);
        CHECK_NEAR(force, (e[1] - e[0]) / (2 * d), 1e-9);
        CHECK_NEAR(tangent, (f[1] - f[0]) / (2 * d), 1e-10);
    }
}

/* ---- virtual testers ---- */

/* B, 2HB, residual curvature and G, 2HG of the loops against those of the fabric */
static void check_loops(const char *model, const char *name, int count) {
    Arena arena = {0};
    Error error = {0};
    Fabric f;
    TesterLoop bend, shear;
    assert_true(fabric_read(name, &arena, &f, &error));
    assert_true(tester_run(TESTER_BENDING, &f, model, count, &arena, &bend, &error));
    assert_true(tester_run(TESTER_SHEAR, &f, model, count, &arena, &shear, &error));
    double b = f.bend_warp.value, share = 2.0 * b / (b + f.bend_weft.value);
    double hb = f.bend_hysteresis.value * share;
    print_message("  %s, %s: B %.4g (%.4g), 2HB %.4g (%.4g), residual %.4g (%.4g) /m\n", model,
                  name, bend.slope, b, bend.width, hb, bend.residual, 0.5 * hb / b);
    print_message("      G %.4g (%.4g), 2HG %.4g (%.4g), 2HG5 %.4g (%.4g) N/m\n", shear.slope,
                  f.shear.value, shear.width, f.shear_hysteresis.value, shear.width5,
                  f.shear_hysteresis5.value);
    CHECK_AT_MOST(fabs(bend.slope / b - 1.0), 0.01);
    CHECK_AT_MOST(fabs(bend.width / hb - 1.0), 0.01);
    CHECK_AT_MOST(fabs(bend.residual / (0.5 * hb / b) - 1.0), 0.02);
    CHECK_AT_MOST(fabs(shear.slope / f.shear.value - 1.0), 0.01);
    CHECK_AT_MOST(fabs(shear.width / f.shear_hysteresis.value - 1.0), 0.02);
    CHECK_AT_MOST(fabs(shear.width5 / f.shear_hysteresis5.value - 1.0), 0.02);
    arena_free(&arena);
}

static void test_testers(void **unused) {
    (void)unused;
    for (const ClothModel *const *model = cloth_models; *model; model++) {
        for (int k = 0; fabrics[k]; k++) {
            check_loops((*model)->name, fabrics[k], 320);
        }
        check_loops((*model)->name, fabrics[0], 160); /* steps twice as long: the same loop */
    }
}

/* The tester loads a fabric with measured curves along them, with its hysteresis beside. The curves:
 * friction that sets in faster than the usual polynomial, elasticity that stiffens. */
static void test_curves(void **unused) {
    (void)unused;
    enum { POINTS = 7 };
    static const double bends[POINTS] = {5, 10, 20, 40, 80, 150, 250};
    static const double shears[POINTS] = {0.25, 0.5, 1, 2, 4, 6, 8};
    for (int k = 0; fabrics[k]; k++) {
        Arena arena = {0};
        Error error = {0};
        Fabric f;
        TesterLoop bend, shear;
        double at[2][POINTS], value[2][POINTS];
        assert_true(fabric_read(fabrics[k], &arena, &f, &error));
        double b = f.bend_warp.value, g = f.shear.value, hg = 0.5 * f.shear_hysteresis.value;
        double hb = f.bend_hysteresis.value * b / (b + f.bend_weft.value);
        for (int i = 0; i < POINTS; i++) {
            double K = at[0][i] = bends[i], phi = at[1][i] = shears[i] * PI / 180.0;
            double onset = f.bend_onset.value;
            value[0][i] = hb * (1.0 - exp(-2.5 * K / onset)) + b * K * (1.0 + K * K / 1e5);
            value[1][i] = hg * (1.0 - exp(-phi / 0.003)) + g * phi * (1.0 + 40.0 * phi * phi);
        }
        f.curves[FABRIC_CURVE_WARP] = (FabricCurve){POINTS, at[0], value[0]};
        f.curves[FABRIC_CURVE_SHEAR] = (FabricCurve){POINTS, at[1], value[1]};
        bool made = tester_run(TESTER_BENDING, &f, "particles", 320, &arena, &bend, &error) &&
                    tester_run(TESTER_SHEAR, &f, "particles", 320, &arena, &shear, &error);
        if (!made) {
            fail_msg("%s: %s", fabrics[k], error.text);
        }
        double off[2] = {tester_curve_error(TESTER_BENDING, &f, &bend),
                         tester_curve_error(TESTER_SHEAR, &f, &shear)};
        print_message("  %s: bending within %.2g %%, shear within %.2g %%\n", fabrics[k],
                      100 * off[0], 100 * off[1]);
        CHECK_AT_MOST(off[0], 0.01);
        CHECK_AT_MOST(off[1], 0.01);
        /* 2HB stays what the fabric says */
        CHECK_AT_MOST(fabs(bend.width / (2.0 * hb) - 1.0), 0.01);
        f.curves[FABRIC_CURVE_WARP].count = 0;
        assert_true(isnan(tester_curve_error(TESTER_BENDING, &f, &bend)));
        arena_free(&arena);
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
        cmocka_unit_test(test_elements), cmocka_unit_test(test_potential),
        cmocka_unit_test(test_testers),  cmocka_unit_test(test_curves),
        cmocka_unit_test(test_memory),   cmocka_unit_test(test_bend_left),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
