/* What Breen, House and Wozny published and particles leave out by default: threads of the fifth power,
 * the force that keeps particles apart (sim/model/repel.h). */
#include <stdlib.h>
#include <string.h>

#include "sim/model/repel.h"
#include "sim/model/spring_law.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/play.h"
#include "tests/support/strips.h"

static void test_thread(void **unused) {
    (void)unused;
    const double rest = 0.02, k = 3000.0;
    SpringKind line = spring_kind(rest, k, NULL, 0.0), breen = line;
    breen.fifth = k * rest * rest * 0.01 / 5e-8; /* the paper: 1 % under its load */
    CHECK_NEAR(spring_tension(&breen, 1.01 * rest, NULL), spring_tension(&line, 1.01 * rest, NULL),
               1e-9);
    CHECK_NEAR(spring_energy(&breen, 0.98 * rest), spring_energy(&line, 0.98 * rest), 1e-15);
    for (int step = 0; step < 16; step++) {
        double stretch = 0.002 + 0.003 * step;
        double slope, at = (1.0 + stretch) * rest, d = 1e-7 * rest;
        double force = spring_tension(&breen, at, &slope);
        double work = (spring_energy(&breen, at + d) - spring_energy(&breen, at - d)) / (2 * d);
        double rise =
            (spring_tension(&breen, at + d, NULL) - spring_tension(&breen, at - d, NULL)) / (2 * d);
        CHECK_NEAR(work, force, 1e-6 * force);
        CHECK_NEAR(rise, slope, 1e-6 * slope);
    }
}

typedef struct Sheet {
    Bench bench;
    double *x;
    int count; /* of numbers */
} Sheet;

/* crumpled to `share` of its size */
static void crumple(Sheet *s, double share) {
    memset(s, 0, sizeof *s);
    s->bench.cloth = cloths_rectangle(0.2, 0.2, 11, 11, cloths_fabric(0.15, 1e3, 0.0, 1e-5, 0.0));
    s->bench.cloth.model = "particles";
    s->bench.cloth.fifth_power = s->bench.cloth.repel = true;
    s->bench.scene = cloths_scene(&s->bench.cloth);
    bench_build(&s->bench, 0);
    s->count = 3 * s->bench.system.place_count;
    s->x = arena_push(&s->bench.arena, double, s->count);
    cloth_start(&s->bench.system.cloths[0], s->x);
    for (int k = 0; k < s->count; k++) {
        s->x[k] *= share;
    }
    cloths_shake(s->x, s->count / 3, 0.004, 5);
}

static void test_forces(void **unused) {
    (void)unused;
    const double shares[2] = {0.45, 1.02};
    for (int k = 0; k < 2; k++) {
        Sheet s;
        crumple(&s, shares[k]);
        const Cloth *cloth = &s.bench.system.cloths[0];
        double *g = arena_push(&s.bench.arena, double, s.count),
               *d = arena_push(&s.bench.arena, double, s.count);
        double side[2], along = 0.0, size = 0.0, sum[3] = {0};
        cloths_shake(d, s.count / 3, 1.0, 9);
        cloth->model->add_gradient(cloth, s.x, g);
        for (int e = 0; e < 2; e++) {
            double *y = arena_push(&s.bench.arena, double, s.count);
            for (int i = 0; i < s.count; i++) {
                y[i] = s.x[i] + (e ? 1e-8 : -1e-8) * d[i];
            }
            side[e] = cloth->model->energy(cloth, y);
        }
        for (int i = 0; i < s.count; i++) {
            along += g[i] * d[i];
            size += fabs(g[i]);
            sum[i % 3] += g[i];
        }
        CHECK_NEAR((side[1] - side[0]) / 2e-8, along, 1e-6 * fabs(along));
        CHECK_AT_MOST(fmax(fabs(sum[0]), fmax(fabs(sum[1]), fabs(sum[2]))) / size, 1e-12);
        arena_free(&s.bench.arena);
    }
}

/* all pairs, without any list */
static double energy_of_all(const Repel *r, const double *x) {
    double sum = 0.0, s = r->spacing;
    for (int a = 0; a < r->node_count; a++) {
        for (int b = a + 1; b < r->node_count; b++) {
            int across = abs(a % r->nu - b % r->nu), along = abs(a / r->nu - b / r->nu);
            bool unit = (along == 0 && across <= 2) || (across == 0 && along <= 2) ||
                        (along <= 1 && across <= 1);
            double d =
                vec3_length(vec3_sub(vec3_load(x + 3 * (size_t)a), vec3_load(x + 3 * (size_t)b)));
            sum += !unit && d < s ? r->strength * pow((s - d) / s, 5.0) * s / d : 0.0;
        }
    }
    return sum;
}

/* the pairs stay right while particles move, in steps of a tenth of the spacing */
static void test_pairs(void **unused) {
    (void)unused;
    Sheet s;
    crumple(&s, 0.5);
    const Panel *panel = &s.bench.system.cloths[0].panel;
    Repel *repel = repel_create(panel, 0.3, s.x, &s.bench.arena);
    for (int step = 0; step < 40; step++) {
        CHECK_NEAR(repel_energy(repel, s.x), energy_of_all(repel, s.x), 1e-12);
        cloths_shake(s.x, s.count / 3, 0.1 * repel->spacing, (uint64_t)step);
    }
    assert_true(energy_of_all(repel, s.x) > 0.0);
    arena_free(&s.bench.arena);
}

/* a folded sheet that hangs stays open by it alone, without contact */
static void test_fold(void **unused) {
    (void)unused;
    double gap[2];
    for (int k = 0; k < 2; k++) {
        char text[1200];
        Play play;
        snprintf(
            text, sizeof text,
            "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  sheet:\n"
            "    shape: {rectangle: {width: 20 cm, height: 10 cm}}\n    model: particles\n"
            "    threads: breen\n    repel: %s\n    fabric: {name: f, weight: 150 g/m2, thickness:"
            " 0.4 mm, isotropic: {stretch: 500 N/m, poisson: 0, bending: 1e-6 N m}}\n"
            "    nodes: 11 x 6\n    damping: 10 1/s\nhandles:\n  - hold: sheet.left\n"
            "  - hold: sheet.right\n    motion: [{turn: {axis: y, by: -180 deg, centre: [0, 0, 2 "
            "mm],"
            " from: 0 s, to: 0.8 s}}]\n"
            "gravity: [9.81, 0, 0]\nsolver: {stepper: central, self_contact: false}\n",
            k ? "true" : "false");
        play_start(&play, text);
        play_to(&play, 1.0);
        gap[k] = INFINITY;
        for (int p = 0; p < 66; p++) { /* free particles of both halves */
            for (int q = 0; q < 66; q++) {
                bool pair = p % 11 > 0 && p % 11 < 4 && q % 11 > 6 && q % 11 < 10;
                double d = vec3_length(vec3_sub(play_x(&play, p), play_x(&play, q)));
                gap[k] = pair ? fmin(gap[k], d) : gap[k];
            }
        }
        play_end(&play);
    }
    print_message("  gap %.4f m, with repel %.4f m\n", gap[0], gap[1]);
    CHECK_AT_MOST(0.01, gap[1]);
    CHECK_AT_MOST(gap[0], 0.75 * gap[1]);
}

static void refuse(const char *model, const char *stepper, const char *word) {
    char text[1000];
    Play play = {0};
    Error error = {0};
    SimOptions options = sim_options_default();
    snprintf(
        text, sizeof text,
        "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  sheet:\n"
        "    shape: {rectangle: {width: 20 cm, height: 10 cm}}\n    model: %s\n    repel: true\n"
        "    fabric: {name: f, weight: 150 g/m2, thickness: 0.4 mm, isotropic: {stretch: 500 N/m,"
        " poisson: 0, bending: 1e-6 N m}}\n    nodes: 11 x 6\n"
        "solver: {stepper: %s, self_contact: false}\n",
        model, stepper);
    assert_true(scene_parse("t.yaml", text, strlen(text), NULL, &play.arena, &play.scene, &error));
    assert_false(sim_create(&play.sim, &play.scene, &options, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, word));
    arena_free(&play.arena);
}

static void test_refusals(void **unused) {
    (void)unused;
    refuse("springs", "central", "particles");
    refuse("particles", "bdf2", "central");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_thread), cmocka_unit_test(test_forces),
                                       cmocka_unit_test(test_pairs), cmocka_unit_test(test_fold),
                                       cmocka_unit_test(test_refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
