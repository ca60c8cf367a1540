/* Cloth at triangle meshes: still, driven, turning, animated, pinching.
 * Every frame is judged by the exact check. */
#include <string.h>

#include "tests/support/check.h"
#include "tests/support/play.h"

#define MESHES TOILE_SOURCE_DIR "/assets/meshes/"
#define FABRIC                                                                                     \
    "fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3, bending: "   \
    "1e-5 N m}}\n"
#define SHEET                                                                                      \
    "toile: 1\nfilm: {rate: 50, seconds: 9}\ncloth:\n  sheet:\n"                                   \
    "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC "    nodes: 21 x 21\n"
#define HANGING                                                                                    \
    SHEET "    turn: {axis: x, by: 90 deg}\nhandles:\n  - {hold: sheet.top}\nobstacles:\n"

typedef struct Judged {
    double crossings, lag, kinetic, gap;
} Judged;

static Judged judge(const char *text, double seconds) {
    Play play;
    Judged judged = {0};
    play_start(&play, text);
    for (int f = 1; f <= (int)(50 * seconds + 0.5); f++) {
        play_to(&play, f / 50.0);
        judged.crossings += (double)play_crossings(&play);
        for (int o = 0; o < play.sim.system.contact.obstacle_count; o++) {
            double lag = play.sim.state.time - play.sim.state.contact.clocks[o];
            judged.lag = lag > judged.lag ? lag : judged.lag;
        }
    }
    judged.kinetic = play.sim.statistics.kinetic;
    judged.gap = play.sim.total.smallest_gap;
    play_end(&play);
    return judged;
}

/* dropped on a ball, a ring and an L with an inward edge */
static void test_drape(void **unused) {
    (void)unused;
    const char *bodies[3] = {
        "  body: {mesh: {file: " MESHES "icosphere.obj, scale: 10 cm}, at: [0, 0, -10.5 cm]}\n",
        "  body: {mesh: {file: " MESHES "torus.ply, scale: 40 cm}, at: [0, 0, -5 cm]}\n",
        "  body: {mesh: {file: " MESHES "l-shape.stl, scale: 1 m}, at: [0, 0, -11 cm]}\n"};
    for (int k = 0; k < 3; k++) {
        char text[2000];
        snprintf(text, sizeof text, "%sobstacles:\n%s", SHEET "    at: [1 cm, 2 cm, 0]\n",
                 bodies[k]);
        Judged judged = judge(text, 0.6);
        CHECK_AT_MOST(judged.crossings, 0.0);
        assert_true(judged.gap < 1e-3); /* it did meet the mesh */
    }
}

/* still meshes on the implicit road: a drape by steps, and the equilibrium, which lies as high as
 * what the explicit road comes to */
static void test_implicit(void **unused) {
    (void)unused;
    const char *names[3] = {"bdf2", "static", "central"};
    double height[3];
    for (int k = 0; k < 3; k++) {
        char text[2000];
        Play play;
        long crossings = 0;
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 30, seconds: 2}\ncloth:\n  sheet:\n    damping: 8 1/s\n"
                 "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    " FABRIC
                 "    nodes: 11 x 11\nobstacles:\n  body: {mesh: {file: " MESHES
                 "icosphere.obj, scale: 12 cm}, at: [0, 0, -12.5 cm]}\nsolver: {stepper: %s}\n",
                 names[k]);
        play_start(&play, text);
        for (int f = 1; f <= (k == 1 ? 1 : 45); f++) {
            play_to(&play, f / 30.0);
            crossings += play_crossings(&play);
        }
        height[k] = play_mean_x(&play).z;
        assert_true(k == 1 || play.sim.total.smallest_gap < 1e-3);
        play_end(&play);
        CHECK_AT_MOST((double)crossings, 0.0);
    }
    CHECK_NEAR(height[0], height[2], 0.002);
    CHECK_NEAR(height[1], height[2], 0.002);
}

/* a fine ball pushed through hanging cloth at 1 and 5 m/s, and a turning L */
static void test_driven(void **unused) {
    (void)unused;
    Judged slow = judge(HANGING "  ball: {mesh: {file: " MESHES
                                "icosphere.obj, scale: 6 cm}, at: [2 cm, 12 cm, -4 cm],"
                                " motion: [{move: {by: [0, -30 cm, 0], from: 0 s, to: 0.3 s}}]}\n",
                        0.4);
    CHECK_AT_MOST(slow.crossings, 0.0);
    CHECK_AT_MOST(slow.lag, 0.01);
    Judged fast = judge(HANGING "  ball: {mesh: {file: " MESHES
                                "icosphere.obj, scale: 6 cm}, at: [2 cm, 12 cm, -4 cm],"
                                " motion: [{move: {by: [0, -30 cm, 0], from: 0 s, to: 0.06 s}}]}\n",
                        0.2);
    CHECK_AT_MOST(fast.crossings, 0.0);
    assert_true(slow.gap < 1e-3 && fast.gap < 1e-3);
    Judged turning = judge(
        HANGING "  ell: {mesh: {file: " MESHES "l-shape.stl, scale: 60 cm}, at: [0, 8 cm, -4 cm],"
                " motion: [{turn: {axis: x, by: 1 turns, from: 0 s, to: 1 s}}]}\n",
        0.8);
    CHECK_AT_MOST(turning.crossings, 0.0);
    assert_true(turning.gap < 1e-3);
}

/* two balls close on the cloth, wait there, and open again: no crossing and no burst */
static void test_pinch(void **unused) {
    (void)unused;
    Judged judged =
        judge(HANGING
              "  left: {mesh: {file: " MESHES "icosphere.obj, scale: 6 cm}, at: [0, 8 cm, -4 cm],"
              " motion: [{move: {by: [0, -4 cm, 0], from: 0 s, to: 0.2 s}},"
              " {move: {by: [0, 4 cm, 0], from: 0.4 s, to: 0.6 s}}]}\n"
              "  right: {mesh: {file: " MESHES "icosphere.obj, scale: 6 cm}, at: [0, -8 cm, -4 cm],"
              " motion: [{move: {by: [0, 4 cm, 0], from: 0 s, to: 0.2 s}},"
              " {move: {by: [0, -4 cm, 0], from: 0.4 s, to: 0.6 s}}]}\n",
              0.7);
    CHECK_AT_MOST(judged.crossings, 0.0);
    CHECK_AT_MOST(judged.kinetic, 2e-3);
}

/* balls that stay closed on the cloth: the run ends with the reason when they are too late */
static void test_late(void **unused) {
    (void)unused;
    Play play;
    Error error = {0};
    play_start(&play, HANGING "  left: {sphere: {radius: 6 cm}, at: [0, 8 cm, -4 cm],"
                              " motion: [{move: {by: [0, -4 cm, 0], from: 0 s, to: 0.2 s}}]}\n"
                              "  right: {mesh: {file: " MESHES
                              "icosphere.obj, scale: 6 cm}, at: [0, -8 cm, -4 cm],"
                              " motion: [{move: {by: [0, 4 cm, 0], from: 0 s, to: 0.2 s}}]}\n"
                              "solver: {lag: 0.1 s}\n");
    while (play.sim.state.time < 0.5 && sim_advance(&play.sim, &error)) {
        assert_int_equal(play_crossings(&play), 0);
    }
    assert_int_equal(error.code, EXIT_DIFFERS);
    assert_non_null(strstr(error.text, "is 0.1"));
    assert_non_null(strstr(error.text, "since pinched cloth does not let it move"));
    assert_true(play.sim.state.time < 0.4);
    play_end(&play);
}

/* a ring of cloth around the waist of the dress form that turns its hips and chest */
static void test_animated(void **unused) {
    (void)unused;
    Judged judged = judge("toile: 1\nfilm: {rate: 50, seconds: 9}\ncloth:\n  sheet:\n"
                          "    shape: {rectangle: {width: 60 cm, height: 60 cm}}\n    " FABRIC
                          "    nodes: 25 x 25\n    at: [0, 0, 150 cm]\nobstacles:\n"
                          "  form: {mesh: " MESHES "mannequin.glb, motion: file}\n",
                          0.8);
    CHECK_AT_MOST(judged.crossings, 0.0);
    assert_true(judged.gap < 1e-3);
}

/* cloth at rest on the floor stays awake as long as the frames of a mesh move it */
static void test_awake(void **unused) {
    (void)unused;
    Play play;
    play_start(&play,
               "toile: 1\nfilm: {rate: 20, seconds: 5}\ncloth:\n  rag:\n"
               "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    " FABRIC
               "    nodes: 7 x 7\n    at: [2 m, 0, 1 mm]\nobstacles:\n  ground: {plane: {}}\n"
               "  form: {mesh: " MESHES "mannequin.glb, motion: file}\n");
    play_to(&play, 3.9);
    assert_true(play.sim.statistics.asleep == 0.0 && play.sim.state.calm > 0.5);
    play_to(&play, 4.9);
    assert_true(play.sim.statistics.asleep == 1.0);
    play_end(&play);
}

static void test_refused(void **unused) {
    (void)unused;
    Arena arena = {0};
    Scene scene;
    Sim sim;
    Error error = {0};
    SimOptions options = sim_options_default();
    const char *inside =
        SHEET "obstacles:\n  body: {mesh: {file: " MESHES "icosphere.obj, scale: 10 cm}}\n";
    assert_true(scene_parse("play", inside, strlen(inside), NULL, &arena, &scene, &error));
    assert_false(sim_create(&sim, &scene, &options, &error));
    assert_non_null(strstr(error.text, "crosses obstacle 'body' at the start"));
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drape),    cmocka_unit_test(test_driven),
        cmocka_unit_test(test_implicit), cmocka_unit_test(test_pinch),
        cmocka_unit_test(test_animated), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_late),     cmocka_unit_test(test_awake),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
