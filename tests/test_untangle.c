/* Starts that cross themselves: pulled apart when it is not far, otherwise refused with the place. */
#include "sim/geom/untangle.h"

#include <string.h>

#include "tests/support/check.h"
#include "tests/support/play.h"

#define FABRIC                                                                                     \
    "    fabric: {weight: 150 g/m2, thickness: 1 mm, isotropic: {stretch: 1000 N/m, poisson: "     \
    "0.3, bending: 1e-5 N m}}\n"

/* one triangle over the edge of another: they part along the shorter way */
static void test_two_triangles(void **unused) {
    (void)unused;
    /* the tip of the second reaches 0.1 below the first */
    double x[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, -0.1, 0.3, 0.3, 1, 0.6, 0.3, 1};
    const int32_t triangles[6] = {0, 1, 2, 3, 4, 5};
    const unsigned char held[6] = {0};
    CrossingMesh mesh = {6, 2, x, triangles};
    Arena scratch = {0};
    assert_int_equal(crossing_count_self(&mesh, &scratch).count, 1);
    double before = x[11];
    Untangled result = untangle(&mesh, held, 0.01, 0.3, x, &scratch);
    assert_true(result.done);
    assert_int_equal(crossing_count_self(&mesh, &scratch).count, 0);
    CHECK_AT_MOST(result.way, 0.12);
    assert_true(x[11] > before && x[2] <= 0.0); /* the tip up, the other down */
    CHECK_AT_MOST((double)scratch.bytes_used, 0.0);
    arena_free(&scratch);
}

/* what is held stays; what cannot part in `most` is as it was */
static void test_held_and_hopeless(void **unused) {
    (void)unused;
    const double start[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, -0.1, 0.3, 0.3, 1, 0.6, 0.3, 1};
    const int32_t triangles[6] = {0, 1, 2, 3, 4, 5};
    const unsigned char first[6] = {1, 1, 1, 0, 0, 0}, all[6] = {1, 1, 1, 1, 1, 1};
    double x[18];
    CrossingMesh mesh = {6, 2, x, triangles};
    Arena scratch = {0};
    memcpy(x, start, sizeof x);
    assert_true(untangle(&mesh, first, 0.01, 0.3, x, &scratch).done);
    assert_memory_equal(x, start, 9 * sizeof *x);
    memcpy(x, start, sizeof x);
    assert_false(untangle(&mesh, all, 0.01, 0.3, x, &scratch).done);
    assert_memory_equal(x, start, sizeof x);
    assert_false(untangle(&mesh, first, 0.01, 0.05, x, &scratch).done);
    assert_memory_equal(x, start, sizeof x);
    arena_free(&scratch);
}

#define SHEET "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n" FABRIC

static const char two_sheets[] =
    "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  low:\n" SHEET "    nodes: 17 x 17\n"
    "    at: [0, 0, %s]\n  high:\n" SHEET "    nodes: 17 x 17\n"
    "    at: [1 cm, 0.7 cm, %s]\n    turn: {axis: y, by: %s}\nsolver: {stepper: central}\n";

/* pulled apart, and neither crossing nor thrown off in what follows */
static void expect_parted(const char *text) {
    Play play;
    play_start(&play, text);
    assert_true(play.sim.moves.untangled > 0);
    assert_int_equal(play_crossings(&play), 0);
    for (int f = 1; f <= 6; f++) {
        play_to(&play, f / 30.0);
        assert_int_equal(play_crossings(&play), 0);
    }
    Vec3 fallen = vec3_sub(play_mean_v(&play), vec3(0, 0, -9.80665 * 6 / 30.0));
    CHECK_AT_MOST(vec3_length(fallen), 0.1);
    play_end(&play);
}

/* a rim that has sunk 1 and 7 mm into another sheet: the line of crossing ends at the other's rim */
static void test_rim(void **unused) {
    (void)unused;
    const char *heights[] = {"1.8 cm", "1.2 cm"};
    char text[1500];
    for (int k = 0; k < 2; k++) {
        snprintf(text, sizeof text, two_sheets, "2 mm", heights[k], "5 deg");
        expect_parted(text);
    }
}

/* two rough sheets in each other: hundreds of bumps that have gone through */
static void test_bumps(void **unused) {
    (void)unused;
    expect_parted("toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  low:\n" SHEET
                  "    nodes: 33 x 33\n    noise: 0 mm\n  high:\n" SHEET
                  "    nodes: 33 x 33\n    noise: 2 mm\n    at: [3 mm, 2 mm, 0.5 mm]\n"
                  "solver: {stepper: central}\n");
}

/* sheets through each other's middle are refused with the place on both */
static void test_refused(void **unused) {
    (void)unused;
    char text[1500];
    Arena arena = {0};
    Scene scene;
    Sim sim;
    Error error = {0};
    SimOptions options = sim_options_default();
    snprintf(text, sizeof text, two_sheets, "20 cm", "20 cm", "80 deg");
    assert_true(scene_parse("play", text, strlen(text), NULL, &arena, &scene, &error));
    assert_false(sim_create(&sim, &scene, &options, &error));
    assert_non_null(strstr(error.text, "cloth 'low' crosses cloth 'high' at the start too deep to "
                                       "be untangled, first at ("));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_triangles), cmocka_unit_test(test_held_and_hopeless),
        cmocka_unit_test(test_rim),           cmocka_unit_test(test_bumps),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
