/* Meshes that move, on the implicit road: driven, turning, animated, pinching; stopped and resumed. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/play.h"
#include "tests/support/resume.h"
#include "tests/support/shell.h"

#define MESHES TOILE_SOURCE_DIR "/assets/meshes/"
#define FABRIC                                                                                     \
    "fabric: {name: f, weight: 200 g/m2, thickness: 1 mm, friction: 0.3, isotropic: {stretch: "    \
    "1000 N/m, poisson: 0, bending: 1e-4 N m}}\n"
#define HANGING                                                                                    \
    "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  sheet:\n"                                   \
    "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC                           \
    "    nodes: 17 x 17\n    turn: {axis: x, by: 90 deg}\nhandles:\n  - {hold: sheet.top}\n"       \
    "obstacles:\n"

/* the surface of a cube of side 1 about the origin */
static void write_cube(const char *path) {
    static const int sides[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                                    {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    for (int i = 0; i < 8; i++) {
        fprintf(file, "v %g %g %g\n", (i & 1) - 0.5, (i / 2 & 1) - 0.5, i / 4 - 0.5);
    }
    for (int s = 0; s < 6; s++) {
        const int *v = sides[s];
        fprintf(file, "f %d %d %d\nf %d %d %d\n", v[0], v[1], v[2], v[0], v[2], v[3]);
    }
    assert_int_equal(fclose(file), 0);
}

static double lag_of(const Play *play) {
    double lag = 0.0;
    for (int o = 0; o < play->sim.system.contact.obstacle_count; o++) {
        lag = fmax(lag, play->sim.state.time - play->sim.state.contact.clocks[o]);
    }
    return lag;
}

/* to `time`, every frame judged */
static long play_and_judge(Play *play, double time) {
    long crossings = 0;
    while (play->sim.state.time < time - 1e-9) {
        play_to(play, play->sim.state.time + 1e-3);
        crossings += play_crossings(play);
    }
    return crossings;
}

/* A turning box pushed into hanging cloth: as a mesh it does what the exact solid does. Until 0.2 s
 * the cloth is pushed by 12 cm; the two may differ by about the contact distance, 1 mm, since the
 * edges of a mesh meet those of cloth and a solid meets triangles. */
static void test_box(void **unused) {
    (void)unused;
    static const char *const names[] = {"bdf2", "backward_euler"};
    write_cube(folder_path("cube.obj"));
    for (int k = 0; k < 2; k++) {
        Play play[2];
        double sum = 0.0;
        for (int mesh = 0; mesh < 2; mesh++) {
            char text[4096], shape[2048] = "box: {size: [8 cm, 8 cm, 8 cm]}";
            if (mesh) {
                snprintf(shape, sizeof shape, "mesh: {file: %s, scale: 8 cm, up: z}",
                         folder_path("cube.obj"));
            }
            snprintf(text, sizeof text,
                     HANGING "  box: {%s, at: [2 cm, 12 cm, -4 cm], turn: {axis: z, by: 20 deg}, "
                             "motion: [{turn: {axis: z, rate: 2 rad/s}}, {move: {by: [0, -30 cm, "
                             "0], from: 0 s, to: 0.3 s}}]}\nsolver: {stepper: %s}\n",
                     shape, names[k]);
            play_start(&play[mesh], text);
            CHECK_AT_MOST((double)play_and_judge(&play[mesh], 0.2), 0.0);
            CHECK_AT_MOST(lag_of(&play[mesh]), 1e-9);
        }
        int n = play[0].sim.system.node_count;
        for (int i = 0; i < n; i++) {
            Vec3 apart = vec3_sub(play_x(&play[0], i), play_x(&play[1], i));
            sum += vec3_dot(apart, apart) / n;
        }
        CHECK_AT_MOST(sqrt(sum), 1e-3);
        CHECK_NEAR(play[1].sim.total.work / play[0].sim.total.work, 1.0, 0.05);
        play_end(&play[0]);
        play_end(&play[1]);
    }
}

/* balls close on the cloth, wait there as long as the programme holds them, and open with it */
static void test_pinch(void **unused) {
    (void)unused;
    static const char *const names[] = {"bdf2", "central"};
    for (int k = 0; k < 2; k++) {
        char text[4096];
        Play play;
        snprintf(text, sizeof text,
                 HANGING "  left: {mesh: {file: " MESHES
                         "icosphere.obj, scale: 6 cm}, at: [0, 8 cm, -4 cm], motion: [{move: {by: "
                         "[0, -4 cm, 0], from: 0 s, to: 0.2 s}}, {move: {by: [0, 4 cm, 0], from: "
                         "0.4 s, to: 0.6 s}}]}\n"
                         "  right: {sphere: {radius: 6 cm}, at: [0, -8 cm, -4 cm], motion: [{move: "
                         "{by: [0, 4 cm, 0], from: 0 s, to: 0.2 s}}, {move: {by: [0, -4 cm, 0], "
                         "from: 0.4 s, to: 0.6 s}}]}\nsolver: {stepper: %s}\n",
                 names[k]);
        play_start(&play, text);
        long crossings = play_and_judge(&play, 0.4);
        CHECK_NEAR(lag_of(&play), 0.3, 0.05); /* they met half way, at 0.1 s */
        crossings += play_and_judge(&play, 0.7);
        CHECK_AT_MOST((double)crossings, 0.0);
        CHECK_AT_MOST(lag_of(&play), 1e-9);
        CHECK_AT_MOST(play.sim.statistics.kinetic, 2e-3); /* no burst */
        play_end(&play);
    }
}

/* An L turns through hanging cloth by up to 72 degrees from frame to frame: equilibria follow it in
 * smaller turns. */
static void test_static(void **unused) {
    (void)unused;
    Play play;
    play_start(&play,
               "toile: 1\nfilm: {rate: 10, seconds: 4}\ncloth:\n  sheet:\n"
               "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n"
               "    fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: "
               "0.3, bending: 1e-5 N m}}\n    nodes: 17 x 17\n    turn: {axis: x, by: 90 deg}\n"
               "handles:\n  - {hold: sheet.top}\nobstacles:\n"
               "  ell: {mesh: {file: " MESHES "l-shape.stl, scale: 60 cm}, at: [0, 8 cm, -4 cm], "
               "motion: [{turn: {axis: x, by: 1 turns, from: 0 s, to: 1 s}}]}\n"
               "solver: {stepper: static}\n");
    CHECK_AT_MOST((double)play_and_judge(&play, 0.8), 0.0);
    CHECK_AT_MOST(lag_of(&play), 1e-9);
    play_end(&play);
}

static const char cape[] =
    "toile: 1\nfilm: {rate: 30, seconds: 1.2}\ncloth:\n  cape:\n"
    "    shape: {rectangle: {width: 110 cm, height: 90 cm}}\n    fabric: wool-tropical\n"
    "    nodes: 17 x 14\n    turn: {axis: x, by: 90 deg}\n    at: [0, 20 cm, 82 cm]\n"
    "    damping: 0.5 1/s\nhandles:\n"
    "  - {hold: cape.top-left, motion: [{move: {by: [48 cm, -36 cm, -4 cm], from: 0 s, to: "
    "0.8 s}}]}\n"
    "  - {hold: cape.top-right, motion: [{move: {by: [-48 cm, -36 cm, -4 cm], from: 0 s, to: "
    "0.8 s}}]}\nobstacles:\n"
    "  form: {mesh: {file: " MESHES "mannequin.glb}, motion: file, friction: 0.4}\n"
    "solver: {stepper: bdf2}\n";

/* A cape drawn around the dress form that turns its hips against its chest: stopped and resumed by
 * another number of threads it is the same file, and nothing crosses in it. */
static void test_body(void **unused) {
    (void)unused;
    char command[600], text[4096];
    resume_check(cape, 12, 36);
    snprintf(command, sizeof command, "%s/scripts/toile measure %s --crossings | tail -n 1",
             TOILE_SOURCE_DIR, folder_path("whole"));
    assert_int_equal(shell_run(command, text, sizeof text), 0);
    assert_string_equal(text, "0 crossings in 0 of 36 frames\n");
}

static int set_up(void **unused) {
    (void)unused;
    return folder_make("contact-moving") ? 0 : 1;
}

static int tear_down(void **unused) {
    (void)unused;
    return folder_remove();
}

int main(int argc, char **argv) {
    (void)argc;
    parallel_fix_environment(argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box),
        cmocka_unit_test(test_pinch),
        cmocka_unit_test(test_static),
        cmocka_unit_test(test_body),
    };
    return cmocka_run_group_tests_name("contact_moving", tests, set_up, tear_down);
}
