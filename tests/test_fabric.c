/* Fabrics: the shipped ones and their provenance, materials, fallbacks, plausibility. */
#include <stdlib.h>
#include <string.h>

#include "sim/scene/fabric_schema.h"
#include "sim/scene/scene.h"
#include "tests/support/check.h"
#include "tests/support/shell.h"

static Arena arena;

static int teardown(void **state) {
    (void)state;
    arena_free(&arena);
    return 0;
}

/* published values [SI]: weight, thickness, B warp, B weft, 2HB, E warp, E weft, nu, G, limit, DC */
static const struct {
    const char *name;
    double values[11];
} shipped[] = {
    {"cotton-broadcloth",
     {.1238, .497e-3, 11.57e-6, 11.57e-6, 1.216e-3, 3000, 1500, .2, 80, .06, .829}},
    {"wool-tropical", {.1629, .407e-3, 6.57e-6, 6.57e-6, .3236e-3, 1100, 745, .2, 41, .08, .498}},
    {"polyester-tropical",
     {.1165, .34e-3, 7.55e-6, 7.55e-6, .2844e-3, 2900, 1300, .3, 31, .06, .507}},
    {"polyester-faille",
     {.1043, .226e-3, 1.863e-6, 1.863e-6, .06865e-3, 1500, 1200, .3, 20, .06, .283}},
    {"cotton-plain",
     {.1503, .318e-3, 13.06e-6, 7.244e-6, 1.066e-3, 3955, 10350, .243, 66.6, .0608, 0}},
    {"polyester-plain",
     {.1646, .252e-3, 14.94e-6, 9.691e-6, .4681e-3, 2942, 1298, .381, 30.9, .0646, 0}},
    {"silk-charmeuse", {.083, .18e-3, 3.22e-6, 3.068e-6, .1258e-3, 326.6, 755.2, .5, 51.3, .34, 0}},
    {"cotton-poplin", {.1036, .18e-3, 5.38e-6, 4.286e-6, .5075e-3, 2365, 3801, .311, 96.8, .14, 0}},
    {"canvas", {.294, .53e-3, 25.29e-6, 23.4e-6, 2.556e-3, 2651, 9785, .135, 532, .067, 0}},
    {"denim", {.4, .66e-3, 40.82e-6, 18.78e-6, 3.129e-3, 1673, 3152, .5, 808, .28, 0}},
    {"wool-coating", {.4806, 1.28e-3, 49.52e-6, 24.85e-6, 1.822e-3, 2175, 2108, .516, 237, .5, 0}},
};
#define SHIPPED_COUNT (sizeof shipped / sizeof shipped[0])

static Fabric read_fabric(const char *name) {
    Fabric fabric;
    Error error = {0};
    if (!fabric_read(name, &arena, &fabric, &error)) {
        fail_msg("%s", error.text);
    }
    return fabric;
}

static void test_shipped_values(void **state) {
    (void)state;
    for (size_t i = 0; i < SHIPPED_COUNT; i++) {
        Fabric f = read_fabric(shipped[i].name);
        const double values[10] = {f.weight.value,          f.thickness.value,
                                   f.bend_warp.value,       f.bend_weft.value,
                                   f.bend_hysteresis.value, f.stretch_warp.value,
                                   f.stretch_weft.value,    f.stretch_poisson.value,
                                   f.shear.value,           f.stretch_limit.value};
        for (int k = 0; k < 10; k++) {
            double wanted = shipped[i].values[k];
            if (!(fabs(values[k] - wanted) <= 1e-3 * wanted)) {
                fail_msg("%s, number %d: %g, not %g", f.name, k, values[k], wanted);
            }
        }
        double drape = f.drape_count > 0 ? f.drapes[0].coefficient : 0.0;
        CHECK_NEAR(drape, shipped[i].values[10], 1e-9);
        assert_string_equal(f.name, shipped[i].name);
        assert_int_equal(f.warning_count, 0);
    }
}

/* A shipped fabric says where every number comes from. */
static void test_provenance(void **state) {
    (void)state;
    const char *const *names = fabric_names(&arena);
    size_t count = 0;
    for (; names[count]; count++) {
        Fabric f = read_fabric(names[count]);
        assert_non_null(f.about);
        assert_non_null(f.source);
        assert_non_null(f.read);
        assert_non_null(f.licence);
        for (const FabricRow *row = fabric_rows; row->name; row++) {
            const FabricNumber *n = (const void *)((const char *)&f + row->offset);
            bool bending =
                strcmp(row->name, "bending.bias") == 0 || strcmp(row->name, "bending.poisson") == 0;
            if (n->flag == FABRIC_STATED || (n->flag != FABRIC_MEASURED && !n->from) ||
                (n->flag == FABRIC_FALLBACK && !bending)) {
                fail_msg("%s: %s has no provenance", f.name, row->name);
            }
        }
    }
    assert_int_equal(count, SHIPPED_COUNT);
}

/* Every file of assets/fabrics and assets/scenes has its line in assets/ORIGINS. */
static void test_origins(void **state) {
    (void)state;
    const char *command = "cd " TOILE_SOURCE_DIR "/assets && for f in fabrics/* scenes/*; do "
                          "grep -q \"^$f | .* | .* | .* | \" ORIGINS || echo \"$f\"; done";
    char missing[256];
    shell_run(command, missing, sizeof missing);
    if (missing[0]) {
        fail_msg("no line in assets/ORIGINS: %s", missing);
    }
}

static Fabric parse_text(const char *text) {
    Scene scene;
    Error error = {0};
    if (!scene_parse("made.yaml", text, strlen(text), NULL, &arena, &scene, &error)) {
        fail_msg("%s", error.text);
    }
    return scene.cloths[0].fabric;
}

static Fabric parse(const char *keys) {
    char text[1024];
    snprintf(text, sizeof text,
             "toile: 1\ncloth: {a: {shape: {disc: {radius: 10 cm}}, fabric: %s}}\n", keys);
    return parse_text(text);
}

static void test_material(void **state) {
    (void)state;
    Fabric f =
        parse("{weight: 160 g/m2, thickness: 0.4 mm, stretch: {warp: 1000 N/m, weft: 500 N/m, "
              "poisson: 0.4}, shear: 1 gf/cm/deg, bending: {warp: 8 uN m, weft: 4 uN m, "
              "bias: 5 uN m}, friction: 0.25}");
    Material m = fabric_material(&f);
    double coupling = 1.0 - 0.4 * 0.4 * 0.5;
    CHECK_NEAR(m.density, 0.16, 1e-15);
    CHECK_NEAR(m.c11, 1000 / coupling, 1e-9);
    CHECK_NEAR(m.c22, 500 / coupling, 1e-9);
    CHECK_NEAR(m.c12, 0.4 * 500 / coupling, 1e-9);
    CHECK_NEAR(m.c66, 56.18796, 1e-4);
    CHECK_NEAR(m.d11, 8e-6, 1e-18);
    CHECK_NEAR(m.d22, 4e-6, 1e-18);
    CHECK_NEAR(m.d12, 0, 0);
    CHECK_NEAR(1 / m.d66, 4 / 5e-6 - 1 / 8e-6 - 1 / 4e-6, 1e-4);
    CHECK_NEAR(m.thickness, 4e-4, 1e-18);
    CHECK_NEAR(m.friction, 0.25, 0);
}

/* isotropic: D66 = (1 - nu) D / 2, C66 = E / (2 (1 + nu)), no hysteresis, no limit */
static void test_isotropic(void **state) {
    (void)state;
    Fabric f = parse("{weight: 200 g/m2, isotropic: {stretch: 10000 N/m, poisson: 0.3, "
                     "bending: 1e-5 N m}}");
    Material m = fabric_material(&f);
    CHECK_NEAR(m.c11, 1e4 / 0.91, 1e-8);
    CHECK_NEAR(m.c22, m.c11, 0);
    CHECK_NEAR(m.c12, 0.3 * m.c11, 1e-8);
    CHECK_NEAR(m.c66, 1e4 / 2.6, 1e-8);
    CHECK_NEAR(m.d11, 1e-5, 0);
    CHECK_NEAR(m.d12, 0.3e-5, 1e-20);
    CHECK_NEAR(m.d66, 0.35e-5, 1e-19);
    CHECK_NEAR(f.bend_hysteresis.value, 0, 0);
    assert_true(isinf(f.stretch_limit.value));
}

static void test_twist(void **state) {
    (void)state;
    Fabric f = parse("{weight: 200 g/m2, bending: {warp: 9 uN m, weft: 4 uN m, twist: 3 uN m}}");
    CHECK_NEAR(fabric_material(&f).d66, 3e-6, 1e-18);
    f = parse("{weight: 200 g/m2, bending: {warp: 9 uN m, weft: 4 uN m}}");
    CHECK_NEAR(fabric_material(&f).d66, 0.41 * 6e-6, 1e-18);
    assert_int_equal(f.bend_bias.flag, FABRIC_FALLBACK);
    f.bend_bias.value = NAN;
    CHECK_NEAR(fabric_material(&f).d66, 0.41 * 6e-6, 1e-18);
}

static void check_fallback(const Fabric *f) {
    double b = 0.2 * 9.80665 * pow(0.0195, 3);
    CHECK_NEAR(f->bend_warp.value, 1.19 * b, 1e-12);
    CHECK_NEAR(f->bend_weft.value, 0.81 * b, 1e-12);
    CHECK_NEAR(f->bend_hysteresis.value, 45 * b, 1e-9);
    CHECK_NEAR(f->thickness.value, 0.2 / 450, 1e-12);
    CHECK_NEAR(f->stretch_warp.value, 3000, 0);
    CHECK_NEAR(f->stretch_weft.value, 1500, 0);
    CHECK_NEAR(f->stretch_poisson.value, 0.2, 0);
    CHECK_NEAR(f->shear.value, 45, 0);
    CHECK_NEAR(f->shear_hysteresis.value, 0.5, 0);
    CHECK_NEAR(f->stretch_limit.value, 0.06, 0);
    CHECK_NEAR(f->friction.value, 0.3, 0);
    assert_int_equal(f->shear.flag, FABRIC_FALLBACK);
    assert_int_equal(f->weight.flag, FABRIC_STATED);
}

static void test_from_weight(void **state) {
    (void)state;
    Fabric f = parse("{weight: 200 g/m2}"), g = fabric_from_weight(0.2);
    check_fallback(&f);
    check_fallback(&g);
    assert_string_equal(f.weight.written, "200 g/m2");
}

static void test_bending_length(void **state) {
    (void)state;
    Fabric f = parse("{weight: 200 g/m2, bending_length: 21 mm}");
    CHECK_NEAR(f.bend_warp.value, 0.2 * 9.80665 * pow(0.021, 3), 1e-15);
    CHECK_NEAR(f.bend_weft.value, f.bend_warp.value, 0);
    CHECK_NEAR(fabric_bending_length(&f, f.bend_warp.value), 0.021, 1e-12);
    f = parse("{weight: 200 g/m2, bending_length: {warp: 21 mm}}");
    CHECK_NEAR(f.bend_weft.value, f.bend_warp.value * 0.81 / 1.19, 1e-15);
}

static void test_like(void **state) {
    (void)state;
    Fabric f = parse("{like: wool-tropical, friction: 0.6, bending: {warp: 8 uN m}}");
    CHECK_NEAR(f.friction.value, 0.6, 0);
    CHECK_NEAR(f.bend_warp.value, 8e-6, 1e-18);
    CHECK_NEAR(f.bend_weft.value, 0.067 * 9.80665e-5, 1e-12);
    CHECK_NEAR(fabric_material(&f).d66, 0.41 * sqrt(f.bend_warp.value * f.bend_weft.value), 1e-15);
    assert_int_equal(f.shear.flag, FABRIC_ESTIMATED);
}

static void test_measured_numbers(void **state) {
    (void)state;
    Fabric f = parse("{weight: {value: 200 g/m2, low: 190 g/m2, high: 0.21, flag: derived, "
                     "from: a scale, note: damp}, shear: {value: 30 N/m, flag: measured}, "
                     "stretch: {warp: 900, limit: none}}");
    CHECK_NEAR(f.weight.low, 0.19, 1e-15);
    CHECK_NEAR(f.weight.high, 0.21, 1e-15);
    assert_int_equal(f.weight.flag, FABRIC_DERIVED);
    assert_string_equal(f.weight.from, "a scale");
    assert_string_equal(f.weight.note, "damp");
    CHECK_NEAR(f.shear.value, 30, 0);
    assert_int_equal(f.shear.flag, FABRIC_MEASURED);
    CHECK_NEAR(f.stretch_weft.value, 450, 0);
    assert_true(isinf(f.stretch_limit.value));
}

/* every warning, each from one fabric */
static const struct {
    const char *keys, *warning;
} doubtful[] = {
    {"{weight: 12 g/m2}", "weight 12 g/m2 is lighter than any woven fabric"},
    {"{weight: 1200 g/m2}", "weight 1200 g/m2 is heavier"},
    {"{weight: 160 g/m2, thickness: 0.1 mm}", "weight/thickness 1600 kg/m3 is denser than glass"},
    {"{weight: 160 g/m2, thickness: 3 mm}", "is fluffier than any fabric"},
    {"{weight: 160 g/m2, bending: 300 uN m}", "bending length 57.61 mm is stiffer than cardboard"},
    {"{weight: 160 g/m2, bending: 0.5 uN m}", "is limper than any woven fabric"},
    {"{weight: 160 g/m2, bending: {warp: 40 uN m, weft: 5 uN m}}", "bending warp/weft 8 is far"},
    {"{weight: 160 g/m2, bending: {warp: 7 uN m, weft: 7 uN m, bias: 2 uN m}}",
     "bending bias/mean 0.2857 is low"},
    {"{weight: 160 g/m2, bending: {warp: 7 uN m, weft: 7 uN m, hysteresis: 2.8 mN}}",
     "hysteresis 2HB/B 400 1/m is high; is 2HB in gf*cm/cm and B in gf*cm2/cm?"},
    {"{weight: 160 g/m2, shear: 0.7}",
     "shear 0.7 N/m is very soft (fabrics: 5 .. 900 N/m); given per degree? write gf/cm/deg"},
    {"{weight: 160 g/m2, stretch: 30000 N/m}", "stretch 3e+04 N/m is very stiff"},
    {"{weight: 160 g/m2, stretch: {warp: 700 N/m, limit: 1 %}}", "stretch limit 1% is very low"},
    {"{weight: 160 g/m2, friction: 2}", "friction 2 is very rough"},
    {"{weight: 160 g/m2, stretch: 100 N/m, shear: 200 N/m}", "shear stiffer than the yarns"},
};

static void test_plausibility(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof doubtful / sizeof doubtful[0]; i++) {
        char text[512];
        Scene scene;
        Error error = {0};
        snprintf(text, sizeof text,
                 "toile: 1\ncloth: {a: {shape: {disc: {radius: 10 cm}}, fabric: %s}}\n",
                 doubtful[i].keys);
        if (!scene_parse("made.yaml", text, strlen(text), NULL, &arena, &scene, &error)) {
            fail_msg("%s: %s", doubtful[i].keys, error.text);
        }
        bool found = false;
        for (int k = 0; k < scene.warning_count; k++) {
            found = found || strstr(scene.warnings[k], doubtful[i].warning);
        }
        if (!found) {
            fail_msg("%s: no warning '%s', last is '%s'", doubtful[i].keys, doubtful[i].warning,
                     scene.warnings[scene.warning_count - 1]);
        }
    }
}

static char *print(const char *name, bool json) {
    char *text = NULL;
    size_t bytes = 0;
    Error error = {0};
    FILE *out = open_memstream(&text, &bytes);
    assert_non_null(out);
    assert_true(name ? fabric_print(name, out, json, &error)
                     : fabric_print_list(out, json, &error));
    fclose(out);
    char *copy = arena_strdup(&arena, text);
    free(text);
    return copy;
}

static void test_print(void **state) {
    (void)state;
    const char *one = print("wool-tropical", false), *list = print(NULL, false);
    assert_non_null(strstr(one, "0.067 gf*cm2/cm"));
    assert_non_null(strstr(one, "6.57e-06 N m"));
    assert_non_null(strstr(one, "16.0 mm warp"));
    assert_non_null(strstr(one, "10.4188/jte.61.69"));
    assert_non_null(strstr(one, "49.8 %, 5 nodes"));
    for (size_t i = 0; i < SHIPPED_COUNT; i++) {
        assert_non_null(strstr(list, shipped[i].name));
    }
    const char *json = print(NULL, true);
    assert_non_null(strstr(json, "\"schema\": \"toile-fabrics-1\""));
    assert_null(strstr(json, "nan"));
    assert_null(strstr(json, "inf,"));
}

/* measured curves, in the units of the tester and as printed */
static void test_curves(void **state) {
    (void)state;
    Fabric f = parse("{weight: 150 g/m2, bending: {warp: 10 uN m, curve_warp: [[0.1 1/cm, 0.02 "
                     "gf*cm/cm], [1 1/cm, 0.1 gf*cm/cm]]}, shear: {stiffness: 40 N/m, curve: "
                     "[[1 deg, 0.5 gf/cm], [4 deg, 2 gf/cm], [8 deg, 5 gf/cm]]}}");
    const FabricCurve *bend = &f.curves[FABRIC_CURVE_WARP], *shear = &f.curves[FABRIC_CURVE_SHEAR];
    assert_int_equal(bend->count, 2);
    assert_int_equal(shear->count, 3);
    assert_int_equal(f.curves[FABRIC_CURVE_WEFT].count, 0);
    CHECK_NEAR(bend->at[1], 100.0, 1e-12);
    CHECK_NEAR(bend->value[1], 0.1 * 9.80665e-3, 1e-15);
    CHECK_NEAR(shear->at[2], 8.0 * PI / 180.0, 1e-15);
    CHECK_NEAR(shear->value[2], 5.0 * 0.980665, 1e-12);
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    fputs("toile: 1\ncloth:\n  a:\n    shape: {disc: {radius: 10 cm}}\n    fabric:\n", out);
    fabric_print_keys(out, 6, &f);
    fclose(out);
    assert_non_null(strstr(text, "curve_warp: [["));
    Fabric again = parse_text(text);
    free(text);
    assert_memory_equal(again.curves[FABRIC_CURVE_WARP].value, bend->value, 2 * sizeof(double));
    assert_memory_equal(again.curves[FABRIC_CURVE_SHEAR].at, shear->at, 3 * sizeof(double));
    assert_memory_equal(again.curves[FABRIC_CURVE_SHEAR].value, shear->value, 3 * sizeof(double));
}

/* assets elsewhere, or not there at all */
static void test_asset_folder(void **state) {
    (void)state;
    Fabric fabric;
    Error error = {0};
    setenv("TOILE_ASSETS", "/nowhere", 1);
    assert_false(fabric_read("denim", &arena, &fabric, &error));
    assert_int_equal(error.code, EXIT_MISSING_INPUT);
    assert_false(fabric_print_list(stdout, false, &(Error){0}));
    setenv("TOILE_ASSETS", TOILE_SOURCE_DIR "/assets", 1);
    read_fabric("denim");
    unsetenv("TOILE_ASSETS");
}

#define TEST(name) cmocka_unit_test_teardown(name, teardown)

int main(void) {
    const struct CMUnitTest tests[] = {
        TEST(test_shipped_values), TEST(test_provenance),       TEST(test_origins),
        TEST(test_material),       TEST(test_isotropic),        TEST(test_twist),
        TEST(test_from_weight),    TEST(test_bending_length),   TEST(test_like),
        TEST(test_plausibility),   TEST(test_measured_numbers), TEST(test_print),
        TEST(test_asset_folder),   TEST(test_curves),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
