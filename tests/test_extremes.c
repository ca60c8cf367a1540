/* Scenes at the ends of what the language allows: three nodes a side, cloth of a millimetre and of a hundred
 * metres, friction of 0 and of 10, a frame a second and a thousand. A sheet falls on a ball: every number stays
 * finite, and nothing crosses. */
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_few_nodes),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_friction_rate_and_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
