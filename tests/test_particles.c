/* Particles against the curves that they are made of, and the heavy elastica. */
#include <stdlib.h>
#include <string.h>

#include "sim/model/model.h"
#include "sim/model/yarn.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

static const YarnCurve bend = {11e-6, 0.6e-3, 30.0, NULL};
static const YarnCurve shear = {60.0, 0.7, SHEAR_ONSET, NULL};

/* value, slope and work belong together; beyond the onset the KES line */
static void test_yarn(void **unused) {
    (void)unused;
    for (int k = 0; k < 40; k++) {
        double at = 0.5 + 3.0 * k, step = 1e-4, slope;
        double value = yarn_value(&bend, at, &slope);
        double work = (yarn_work(&bend, at + step) - yarn_work(&bend, at - step)) / (2 * step);
        double change = yarn_value(&bend, at + step, NULL) - yarn_value(&bend, at - step, NULL);
        CHECK_NEAR(value, work, 1e-8 * value);
        CHECK_NEAR(slope, change / (2 * step), 1e-8 * slope + 1e-12);
    }
    /* the tester measures between 0.5 and 1.5 per cm: B by the slope, HB by the intercept */
    double m1 = yarn_value(&bend, 50.0, NULL), m2 = yarn_value(&bend, 150.0, NULL);
    CHECK_NEAR((m2 - m1) / 100.0, bend.slope, 1e-12 * bend.slope);
    CHECK_NEAR(m1 - 50.0 * bend.slope, bend.step, 1e-12 * bend.step);
    double below, above;
    yarn_value(&bend, 30.0 * (1 - 1e-13), &below);
    yarn_value(&bend, 30.0, &above);
    CHECK_NEAR(below, above, 1e-10 * above);
}

/* moment and slope go on at 8 degrees; the slope never falls beyond and stays finite */
static void test_trellis(void **unused) {
    (void)unused;
    TrellisCurve c = trellis_curve(shear, 4000.0);
    double e = SHEAR_MEASURED, moment[2], slopes[2];
    for (int k = 0; k < 2; k++) {
        moment[k] = trellis_moment(&c, e + (k ? 1e-12 : -1e-12), &slopes[k]);
    }
    CHECK_NEAR(moment[0], moment[1], 1e-10 * moment[0]);
    CHECK_NEAR(slopes[0], slopes[1], 1e-10 * slopes[0]);
    double before = 0.0;
    for (double phi = 1e-3; phi < 1.5; phi += 1e-3) {
        double slope, d = 1e-6, value = trellis_moment(&c, phi, &slope);
        double work = (trellis_work(&c, phi + d) - trellis_work(&c, phi - d)) / (2 * d);
        CHECK_NEAR(value, work, 1e-6 * value + 1e-8);
        if (phi > e + 1e-3) {
            CHECK_AT_MOST(before, slope * (1 + 1e-12));
            CHECK_AT_MOST(slope, 4000.0 * (1 + 1e-9));
        }
        before = slope;
    }
    /* without friction: moment / (G phi) at 20, 30, 45 degrees */
    TrellisCurve smooth = trellis_curve((YarnCurve){60.0, 0.0, SHEAR_ONSET, NULL}, 1e9);
    const double degrees[3] = {20, 30, 45}, ratios[3] = {1.1527, 1.4953, 2.9224};
    for (int k = 0; k < 3; k++) {
        double phi = degrees[k] * PI / 180;
        CHECK_NEAR(trellis_moment(&smooth, phi, NULL) / (60.0 * phi), ratios[k], 1e-4);
    }
}

/* a strip of 5 segments on 1 cm between walls, bent to a uniform curvature by turning the walls;
 * returns its energy */
static double bent_energy(const Cloth *cloth, double turn, double *x) {
    const Panel *p = &cloth->panel;
    double h = p->h1, at[2] = {0, 0};
    int segments = p->nu - 1;
    /* a wall turns half as much as a node; the first segment has turned that from the wall */
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
            vec3_store(x + 3 * place, vec3(at[0], h * j, at[1]));
        }
        double share = i < 0 ? 0.0 : i >= segments ? segments : i + 0.5;
        double angle = turn / segments * share;
        at[0] += h * cos(angle), at[1] += h * sin(angle);
    }
    return cloth->model->energy(cloth, x);
}

/* virtual bending tester over real fabrics: M(K) of the strip is the curve */
static void test_bending_tester(void **unused) {
    (void)unused;
    const char *names[4] = {"wool-tropical", "cotton-plain", "denim", "silk-charmeuse"};
    for (int k = 0; k < 8; k++) {
        Arena arena = {0};
        Error error = {0};
        Cloth cloth;
        ClothDef def = cloths_rectangle(0.01, 0.004, 6, 3, cloths_orthotropic());
        HandleDef walls[2] = {handle_default(), handle_default()};
        assert_true(fabric_read(names[k / 2], &arena, &def.fabric, &error));
        def.model = "particles";
        def.bending = k % 2 ? BENDING_SINE : BENDING_ANGLE;
        walls[0].kind = walls[1].kind = HANDLE_CLAMP;
        walls[0].region = REGION_LEFT, walls[1].region = REGION_RIGHT;
        assert_true(cloth_create(&cloth, &def, walls, 2, 1, &arena, &error));
        double *x = arena_push(&arena, double, 3 * (cloth.node_count + cloth.ghost_count));
        double mean = 0.5 * (def.fabric.bend_warp.value + def.fabric.bend_weft.value);
        double b = def.fabric.bend_warp.value, found[2], worst = 0.0;
        YarnCurve curve = {b, 0.5 * def.fabric.bend_hysteresis.value * b / mean,
                           def.fabric.bend_onset.value, NULL};
        const double curvatures[4] = {50, 100, 150, 250};
        for (int c = 0; c < 4; c++) {
            double turn = 0.01 * curvatures[c], step = 1e-4;
            double moment =
                (bent_energy(&cloth, turn + step, x) - bent_energy(&cloth, turn - step, x)) /
                (2 * step * 0.004);
            double exact = yarn_value(&curve, curvatures[c], NULL);
            worst = fmax(worst, fabs(moment / exact - 1.0));
            if (c % 2 == 0) {
                found[c / 2] = moment;
            }
        }
        print_message("  %s, %s: B %.4g of %.4g, M(K) within %.2g %%\n", names[k / 2],
                      bending_words[def.bending], (found[1] - found[0]) / 100.0, b, 100 * worst);
        if (k % 2 == 0) {
            CHECK_AT_MOST(worst, 1e-5);
            CHECK_NEAR((found[1] - found[0]) / 100.0, b, 1e-3 * b);
        } else { /* the circle through three points loses 4 % at 2.5 per cm */
            CHECK_AT_MOST(worst, 0.05);
            CHECK_AT_MOST(0.02, worst);
        }
        arena_free(&arena);
    }
}

/* virtual shear tester: threads of constant length, F(phi) = dE/dphi / (area cos(phi)) */
static void test_shear_tester(void **unused) {
    (void)unused;
    Arena arena = {0};
    Error error = {0};
    Cloth cloth;
    ClothDef def = cloths_rectangle(0.2, 0.05, 21, 6, cloths_orthotropic());
    assert_true(fabric_read("cotton-plain", &arena, &def.fabric, &error));
    def.model = "particles";
    assert_true(cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error));
    double *x = arena_push(&arena, double, 3 * cloth.node_count), step = 1e-5;
    YarnCurve curve = {def.fabric.shear.value, 0.5 * def.fabric.shear_hysteresis.value, SHEAR_ONSET,
                       NULL};
    double f[2] = {0, 0};
    for (int degree = -8; degree <= 8; degree++) {
        double phi = degree * PI / 180, energy[2];
        for (int k = 0; k < 2; k++) {
            double angle = phi + (k ? step : -step);
            for (int i = 0; i < cloth.node_count; i++) {
                const double *uv = cloth.panel.material + 2 * i;
                vec3_store(x + 3 * i, vec3(uv[0] + uv[1] * sin(angle), uv[1] * cos(angle), 0));
            }
            energy[k] = cloth.model->energy(&cloth, x);
        }
        double force = (energy[1] - energy[0]) / (2 * step * 0.01 * cos(phi));
        double exact = copysign(yarn_value(&curve, fabs(phi), NULL), phi);
        if (degree != 0) {
            CHECK_NEAR(force, exact, 1e-3 * fabs(exact));
        }
        f[0] = degree == 1 ? force : f[0];
        f[1] = degree == 7 ? force : f[1];
    }
    double g = (f[1] - f[0]) / (6 * PI / 180);
    print_message("  G %.4g of %.4g N/m\n", g, def.fabric.shear.value);
    CHECK_NEAR(g, def.fabric.shear.value, 0.01 * def.fabric.shear.value);
    arena_free(&arena);
}

/* tips of the heavy elastica, straight moment curve */
static void test_cantilever(void **unused) {
    (void)unused;
    const double gammas[4] = {1, 10, 100, 1000}, bars[4] = {4e-4, 2e-3, 5e-3, 1.2e-2};
    for (int g = 0; g < 4; g++) {
        double errors[3];
        for (int k = 0; k < 3; k++) {
            bool far = gammas[g] >= 100; /* where Newton from flat may stray */
            StripCase c = {.gamma = gammas[g],
                           .stiffness = far ? 1e6 : 1e8,
                           .nodes = 1 + (20 << k),
                           .model = "particles"};
            StripResult r = far ? strip_relax(&c, 300000) : strip_solve(&c);
            errors[k] = r.error;
            print_message("  gamma %g, %d segments: %.3g %% (%d, status %d)\n", gammas[g], 20 << k,
                          100 * r.error, r.iterations, (int)r.status);
        }
        CHECK_AT_MOST(errors[0], bars[g]);
        if (gammas[g] < 100) { /* beyond, the cloth of kinetic damping stretches by 1e-4 */
            CHECK_AT_MOST(1.9, log2(errors[1] / errors[2]));
        }
    }
}

/* Crumpled at random: edges shorter than half, folds sharper than the law knows, closed cells; the
 * force is the slope of the energy there too. Two steps: kinks may lie under one. */
static void check_crumpled(BendingKind bending) {
    ClothDef def = cloths_rectangle(0.12, 0.1, 7, 6, cloths_orthotropic());
    def.model = "particles", def.bending = bending;
    Arena arena = {0};
    Cloth cloth;
    Error error = {0};
    assert_true(cloth_create(&cloth, &def, NULL, 0, 7, &arena, &error));
    int n = 3 * cloth.node_count;
    double *x = arena_push(&arena, double, n), *g = arena_push(&arena, double, n);
    cloth_start(&cloth, x);
    for (int i = 0; i < n; i++) {
        x[i] *= 0.3;
    }
    cloths_shake(x, cloth.node_count, 0.5 * cloth.panel.h1, 3);
    double shortest = INFINITY, sharpest = 0.0, size = 0.0;
    for (int i = 1; i + 1 < cloth.node_count; i++) {
        if (i % cloth.panel.nu == 0 || i % cloth.panel.nu == cloth.panel.nu - 1) {
            continue;
        }
        Vec3 a = vec3_load(x + 3 * i - 3), b = vec3_load(x + 3 * i), c = vec3_load(x + 3 * i + 3);
        Vec3 t = vec3_sub(b, a), u = vec3_sub(c, b);
        shortest = fmin(shortest, vec3_length(t) / cloth.panel.h1);
        sharpest = fmax(sharpest, acos(vec3_dot(t, u) / (vec3_length(t) * vec3_length(u))));
    }
    CHECK_AT_MOST(shortest, 0.5);
    CHECK_AT_MOST(2.4, sharpest);
    cloth.model->add_gradient(&cloth, x, g);
    for (int i = 0; i < n; i++) {
        size = fmax(size, fabs(g[i]));
    }
    for (int i = 0; i < n; i++) {
        double error_at[2], at = x[i];
        for (int k = 0; k < 2; k++) {
            double step = k ? 1e-8 : 1e-7;
            x[i] = at + step;
            double high = cloth.model->energy(&cloth, x);
            x[i] = at - step;
            error_at[k] = fabs((high - cloth.model->energy(&cloth, x)) / (2 * step) - g[i]);
            x[i] = at;
        }
        CHECK_AT_MOST(fmin(error_at[0], error_at[1]), 1e-6 * size);
    }
    arena_free(&arena);
}

static void test_crumpled(void **unused) {
    (void)unused;
    check_crumpled(BENDING_ANGLE);
    check_crumpled(BENDING_SINE);
}

/* a softening curve that stiffens again, as woven cloth does */
static const double points[2][5] = {{5, 12, 30, 90, 200}, {0.2e-3, 0.35e-3, 0.55e-3, 1.3e-3, 4e-3}};

static void test_table(void **unused) {
    (void)unused;
    YarnTable t, straight;
    assert_int_equal(yarn_table_create(5, points[0], points[1], &t), -1);
    double slope, before = 0.0, step = 1e-3, stiffest = 0.0, cosine = 0.0, scale = 200.0;
    for (int k = 0; k < 5; k++) {
        CHECK_NEAR(yarn_table_value(&t, points[0][k], &slope), points[1][k], 1e-18);
    }
    CHECK_NEAR(yarn_table_value(&t, 0.0, &stiffest), 0.0, 0.0);
    for (double at = 0.0205; at < 300.0; at += 0.05) { /* it rises; slope, value, work agree */
        double value = yarn_table_value(&t, at, &slope), unused_slope;
        double low = yarn_table_value(&t, at - step, &unused_slope);
        double high = yarn_table_value(&t, at + step, &unused_slope);
        double work = yarn_table_work(&t, at + step) - yarn_table_work(&t, at - step);
        assert_true(value > before && slope >= 0.0);
        CHECK_NEAR((high - low) / (2 * step), slope, 1e-9);
        CHECK_NEAR(work / (2 * step), value, 1e-9);
        before = value, stiffest = fmax(stiffest, slope);
    }
    CHECK_NEAR(yarn_table_stiffest(&t) / stiffest, 1.0, 1e-5);
    CHECK_NEAR(yarn_table_value(&t, 300.0, &slope), 4e-3 + 100 * 2.7e-3 / 110, 1e-15);
    /* work of a moment about crossings, on a table of angles; midpoint rule of 1e5 parts */
    double angles[5];
    for (int k = 0; k < 5; k++) {
        angles[k] = points[0][k] / scale * 0.15;
    }
    assert_int_equal(yarn_table_create(5, angles, points[1], &t), -1);
    for (int i = 0; i < 100000; i++) {
        double at = 0.14 * (i + 0.5) / 100000;
        cosine += yarn_table_value(&t, at, &slope) * cos(at) * 0.14 / 100000;
    }
    CHECK_NEAR(yarn_table_cosine_work(&t, 0.14) / cosine, 1.0, 1e-8);
    /* a line stays a line; what does not rise is told by its place */
    const double line[3] = {1.0, 2.5, 7.0}, flat[3] = {1.0, 1.0, 2.0};
    assert_int_equal(yarn_table_create(3, line, line, &straight), -1);
    CHECK_NEAR(yarn_table_value(&straight, 4.2, &slope), 4.2, 1e-14);
    assert_int_equal(yarn_table_create(3, line, flat, &straight), 1);
}

/* forces of rows with tables are the derivatives of the energy of units */
static void test_table_forces(void **unused) {
    (void)unused;
    static const double angles[3] = {0.01, 0.05, 0.14}, forces[3] = {0.8, 3.0, 12.0};
    Arena arena = {0};
    Error error = {0};
    Cloth cloth;
    ClothDef def = cloths_rectangle(0.1, 0.1, 6, 6, cloths_orthotropic());
    def.model = "particles";
    def.fabric.curves[FABRIC_CURVE_WARP] = (FabricCurve){5, points[0], points[1]};
    def.fabric.curves[FABRIC_CURVE_SHEAR] = (FabricCurve){3, angles, forces};
    assert_true(cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error));
    double x[108], g[108] = {0}, step = 1e-7, size = 0.0;
    cloth_start(&cloth, x);
    cloths_shake(x, 36, 0.2 * cloth.panel.h1, 5);
    cloth.model->add_gradient(&cloth, x, g);
    for (int i = 0; i < 108; i++) {
        size = fmax(size, fabs(g[i]));
    }
    for (int i = 0; i < 108; i++) {
        double at = x[i];
        x[i] = at + step;
        double high = cloth.model->energy(&cloth, x);
        x[i] = at - step;
        double low = cloth.model->energy(&cloth, x);
        x[i] = at;
        CHECK_AT_MOST(fabs((high - low) / (2 * step) - g[i]), 1e-6 * size);
    }
    arena_free(&arena);
}

/* a curve that friction takes more from than it has */
static void test_table_refused(void **unused) {
    (void)unused;
    static const double at[2] = {10, 200}, moment[2] = {1e-5, 2e-3};
    Arena arena = {0};
    Error error = {0};
    Cloth cloth;
    ClothDef def = cloths_rectangle(0.1, 0.1, 6, 6, cloths_orthotropic());
    def.model = "particles";
    def.fabric.bend_hysteresis.value = 1e-3;
    def.fabric.curves[FABRIC_CURVE_WARP] = (FabricCurve){2, at, moment};
    assert_true(cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error));
    def.hysteresis = true;
    assert_false(cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, "bending along the warp does not rise to its point 1"));
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_yarn),           cmocka_unit_test(test_trellis),
        cmocka_unit_test(test_bending_tester), cmocka_unit_test(test_shear_tester),
        cmocka_unit_test(test_cantilever),     cmocka_unit_test(test_crumpled),
        cmocka_unit_test(test_table),          cmocka_unit_test(test_table_forces),
        cmocka_unit_test(test_table_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
