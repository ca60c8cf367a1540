/* Scenes at the ends of what the language allows: three nodes a side, cloth of a millimetre and of a hundred
 * metres, friction of 0 and of 10, a frame a second and a thousand. A sheet falls on a ball: every number stays
 * finite, and nothing crosses. Handles that pull cloth to more than ten times its length are refused. */
#include <string.h>

#include "tests/support/check.h"
#include "tests/support/play.h"

typedef struct Extreme {
    const char *width, *height, *radius; /* of sheet, its centre, the ball */
    double seconds, rate;
    const char *nodes, *friction, *solver;
} Extreme;

static Extreme usual(const char *nodes) {
    return (Extreme){.width = "30 cm",
                     .height = "7 cm",
                     .radius = "6 cm",
                     .seconds = 0.3,
                     .rate = 30,
                     .nodes = nodes,
                     .friction = "0.3",
                     .solver = "{}"};
}

static void run(const Extreme *e, const char *model) {
    char text[1024];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: %g, seconds: %g}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: %s, height: %s}}\n    fabric: {weight: 160 g/m2}\n"
             "    model: %s\n    nodes: %s\n    at: [0, 0, %s]\nobstacles:\n"
             "  ball: {sphere: {radius: %s}, friction: %s}\nsolver: %s\n",
             e->rate, e->seconds, e->width, e->width, model, e->nodes, e->height, e->radius,
             e->friction, e->solver);
    Play play;
    play_start(&play, text);
    double start = play_mean_x(&play).z;
    play_to(&play, e->seconds - 1.0 / e->rate);
    assert_int_equal(play_crossings(&play), 0);
    for (int i = 0; i < 3 * play.sim.system.place_count; i++) {
        assert_true(isfinite(play.sim.state.x[i]) && isfinite(play.sim.state.v[i]));
    }
    assert_true(play_mean_x(&play).z < start); /* it fell */
    play_end(&play);
}

/* the middle node meets the top of the ball: sides and faces are as near as their corner, to the last bit */
static void test_few_nodes(void **unused) {
    (void)unused;
    static const char *const models[] = {"mlpg", "springs", "triangles", "particles"};
    static const char *const solvers[] = {"{stepper: central}", "{stepper: symplectic_euler}",
                                          "{stepper: bdf2}", "{stepper: backward_euler}"};
    Extreme e = usual("3 x 3");
    for (int m = 0; m < 4; m++) {
        for (int k = 0; k < 4; k++) {
            e.solver = solvers[k];
            run(&e, models[m]);
        }
    }
    e = usual("3 x 30");
    run(&e, "mlpg");
    e = usual("4 x 3");
    run(&e, "mlpg");
}

static void test_sizes(void **unused) {
    (void)unused;
    static const char *const models[] = {"mlpg", "springs", "triangles"};
    for (int m = 0; m < 3; m++) {
        run(&(Extreme){.width = "1 mm",
                       .height = "1.5 mm",
                       .radius = "0.3 mm",
                       .seconds = 0.1,
                       .rate = 100,
                       .nodes = "11 x 11",
                       .friction = "0.3",
                       .solver = "{}"},
            models[m]);
        run(&(Extreme){.width = "100 m",
                       .height = "20.5 m",
                       .radius = "20 m",
                       .seconds = 3,
                       .rate = 10,
                       .nodes = "11 x 11",
                       .friction = "0.3",
                       .solver = "{}"},
            models[m]);
    }
}

static void test_friction_rate_and_distance(void **unused) {
    (void)unused;
    static const char *const frictions[] = {"0", "10"};
    static const double rates[] = {1, 1000};
    for (int k = 0; k < 2; k++) {
        Extreme rough = usual("16 x 16"), often = usual("16 x 16");
        rough.friction = frictions[k];
        run(&rough, "mlpg");
        often.rate = rates[k];
        often.seconds = k == 0 ? 2.0 : 0.3;
        run(&often, "mlpg");
    }
    Extreme thick = usual("16 x 16"), thin = thick;
    thick.height = "12 cm";
    thick.solver = "{contact_distance: 6 cm}"; /* three times the spacing */
    run(&thick, "mlpg");
    thin.solver = "{contact_distance: 1 um}";
    run(&thin, "mlpg");
}

/* what sim_create says about two handles on 20 cm of cloth; "": nothing is wrong */
static void create_pulled(const char *shape, const char *held, const char *pulled,
                          const char *motion, Error *error) {
    char text[1024];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  sheet:\n    shape: {%s}\n"
             "    fabric: {weight: 160 g/m2}\n    %s\nhandles:\n  - {hold: %s}\n"
             "  - {hold: %s, %s}\n",
             shape, strstr(shape, "disc") ? "spacing: 2 cm" : "nodes: 11 x 11", held, pulled,
             motion);
    Arena arena = {0};
    Scene scene;
    Sim sim;
    SimOptions options = sim_options_default();
    *error = (Error){0};
    if (!scene_parse("play", text, strlen(text), NULL, &arena, &scene, error)) {
        fail_msg("%s", error->text);
    }
    if (sim_create(&sim, &scene, &options, error)) {
        sim_destroy(&sim);
    }
    arena_free(&arena);
}

/* handles that ask for more than cloth can be are refused at once, at their place */
static void test_pulled_apart(void **unused) {
    (void)unused;
    static const char square[] = "rectangle: {width: 20 cm, height: 20 cm}",
                      sleeve[] = "sleeve: {radius: 5 cm, length: 20 cm}",
                      disc[] = "disc: {radius: 10 cm}",
                      fast[] = "move: {by: [100 m, 0, 0], to: 0.1 s}";
    Error error;
    create_pulled(square, "sheet.left", "sheet.right", fast, &error);
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_string_equal(error.text,
                        "play:10:12: error: at t = 0.03333 s handles hold cloth 'sheet' at two "
                        "nodes that are 21.2 m apart, with 0.2 m of cloth between them: no cloth "
                        "stretches so far");
    create_pulled(sleeve, "sheet.start", "sheet.end", fast, &error);
    assert_non_null(strstr(error.text, "with 0.2 m of cloth between"));
    create_pulled(disc, "sheet, nearest: [-10 cm, 0]", "sheet, nearest: [10 cm, 0]", fast, &error);
    assert_non_null(strstr(error.text, "play:10:12: error: at t = 0.03333 s handles hold"));
    create_pulled(square, "sheet.left", "sheet.right", "move: {by: [1.9 m, 0, 0], to: 0.9 s}",
                  &error);
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    create_pulled(square, "sheet.left", "sheet.right", "move: {by: [1.7 m, 0, 0], to: 0.9 s}",
                  &error);
    assert_string_equal(error.text, "");
    create_pulled(square, "sheet.left, release: 0.01 s", "sheet.right", fast, &error);
    assert_string_equal(error.text, "");
    create_pulled(square, "sheet.left", "sheet.right", "turn: {axis: y, by: 900 deg, to: 0.9 s}",
                  &error);
    assert_string_equal(error.text, "");
}

/* Pulled to two and a half times its length, cloth becomes so much stiffer in a frame that the step bursts. That is
 * seen before contact parts, step by step, what flies about. */
static void test_pulled_far(void **unused) {
    (void)unused;
    Play play;
    play_start(&play, "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  sheet:\n"
                      "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n    fabric: canvas\n"
                      "    nodes: 21 x 21\nhandles:\n  - {hold: sheet.left}\n"
                      "  - {hold: sheet.right, move: {by: [30 cm, 0, 0], to: 0.1 s}}\n"
                      "solver: {stepper: central}\n");
    play_to(&play, 0.2);
    assert_true(play.sim.total.retries > 0);
    assert_int_equal(play_crossings(&play), 0);
    CHECK_AT_MOST(play.sim.total.cpu, 8.0); /* [s] half a second; else half a minute */
    play_end(&play);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_few_nodes),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_friction_rate_and_distance),
        cmocka_unit_test(test_pulled_apart),
        cmocka_unit_test(test_pulled_far),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
