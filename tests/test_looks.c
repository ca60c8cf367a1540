/* Looks: colour maps, and the numbers, ranges and pictures of measuring looks. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/command.h"
#include "render/gl.h"
#include "render/quantity.h"
#include "tests/support/check.h"
#include "tests/support/render_states.h"

#define NODES 17
#define WIDTH 320
#define HEIGHT 180

static char folder[] = "/tmp/toile-looks-XXXXXX";
static char patch_path[64], roll_path[64];

static Run open_run(const char *path) {
    Run run;
    RunDef def = run_default();
    Error error = {0};
    def.path = path;
    if (!run_open(&run, &def, &error)) {
        fail_msg("%s", error.text);
    }
    return run;
}

/* ---- colour maps ---- */

static double distance_lab(const double a[3], const double b[3]) {
    double lab_a[3], lab_b[3], sum = 0.0;
    colormap_lab(a, lab_a);
    colormap_lab(b, lab_b);
    for (int k = 0; k < 3; k++) {
        sum += (lab_a[k] - lab_b[k]) * (lab_a[k] - lab_b[k]);
    }
    return sqrt(sum);
}

/* Largest over smallest distance of neighbours on the piece from..to of a map. */
static double unevenness(const ColorMap *map, double from, double to) {
    double least = INFINITY, most = 0.0;
    int steps = 100;
    for (int i = 0; i < steps; i++) {
        double a[3], b[3];
        colormap_color(map, from + (to - from) * i / steps, a);
        colormap_color(map, from + (to - from) * (i + 1) / steps, b);
        double step = distance_lab(a, b);
        least = fmin(least, step);
        most = fmax(most, step);
    }
    return most / least - 1.0;
}

static void test_maps_are_even(void **state) {
    (void)state;
    CHECK_AT_MOST(unevenness(&colormap_sequential, 0.0, 1.0), 0.12); /* corners cut a step short */
    CHECK_AT_MOST(unevenness(&colormap_diverging, 0.0, 0.5), 0.12);
    CHECK_AT_MOST(unevenness(&colormap_diverging, 0.5, 1.0), 0.12);
    double before = -1.0;
    for (int i = 0; i <= 50; i++) { /* lightness alone orders the sequential map */
        double rgb[3], lab[3];
        colormap_color(&colormap_sequential, i / 50.0, rgb);
        colormap_lab(rgb, lab);
        assert_true(lab[0] > before);
        before = lab[0];
    }
}

static void test_map_values(void **state) {
    (void)state;
    double white[3] = {1, 1, 1}, lab[3], rgb[3], red[3] = {1, 0, 0};
    colormap_lab(white, lab);
    CHECK_NEAR(lab[0], 100.0, 1e-3);
    CHECK_NEAR(lab[1], 0.0, 0.02);
    CHECK_NEAR(lab[2], 0.0, 0.02);
    colormap_lab(red, lab); /* B. Lindbloom's calculator */
    CHECK_NEAR(lab[0], 53.2408, 0.01);
    CHECK_NEAR(lab[1], 80.0925, 0.02);
    CHECK_NEAR(lab[2], 67.2032, 0.02);
    colormap_rgb(lab, rgb);
    CHECK_NEAR(rgb[0], 1.0, 1e-4);
    CHECK_NEAR(rgb[1], 0.0, 1e-3);
    colormap_color(&colormap_sequential, -1.0, rgb); /* clamped to the ends */
    CHECK_NEAR(rgb[0], 68 / 255.0, 1e-4);
    colormap_color(&colormap_diverging, 0.5, rgb);
    CHECK_NEAR(rgb[1], 221 / 255.0, 1e-4);
    colormap_color(&colormap_diverging, 2.0, rgb);
    CHECK_NEAR(rgb[0], 180 / 255.0, 1e-4);
}

/* ---- numbers ---- */

/* Largest distance of a quantity from what it should be; inner: without the border. */
static double worst(const char *path, QuantityKind kind, double expected, bool inner) {
    Run run = open_run(path);
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    Arena arena = {0};
    double most = 0.0;
    assert_true(state_read_frame(run.reader, 0, &frame, &layout, &layout_index, NULL));
    double *values = arena_push(&arena, double, NODES *NODES);
    quantity_compute(kind, &layout, &frame, 0, &arena, values);
    for (int i = 0; i < NODES * NODES; i++) {
        int column = i % NODES, row = i / NODES;
        bool border = column < 2 || row < 2 || column > NODES - 3 || row > NODES - 3;
        if (!inner || !border) {
            most = fmax(most, fabs(values[i] - expected));
        }
    }
    arena_free(&arena);
    run_close(&run);
    return most;
}

static void test_quantities(void **state) {
    (void)state;
    CHECK_AT_MOST(worst(patch_path, QUANTITY_STRAIN_WARP, RENDER_PATCH_WARP, false), 1e-12);
    CHECK_AT_MOST(worst(patch_path, QUANTITY_STRAIN_WEFT, RENDER_PATCH_WEFT, false), 1e-12);
    CHECK_AT_MOST(worst(patch_path, QUANTITY_SHEAR, RENDER_PATCH_SHEAR, false), 1e-12);
    CHECK_AT_MOST(worst(patch_path, QUANTITY_CURVATURE, 0.0, false), 1e-9);
    CHECK_AT_MOST(worst(patch_path, QUANTITY_SPEED, RENDER_PATCH_SPEED, false), 1e-9);
    CHECK_AT_MOST(worst(roll_path, QUANTITY_SPEED, 0.0, false), 1e-12);
    /* one principal curvature is 1 / R away from the face, the other 0; chords are short of arcs */
    double mean = -0.5 / RENDER_ROLL_RADIUS;
    CHECK_AT_MOST(worst(roll_path, QUANTITY_CURVATURE, mean, true), 0.005 * fabs(mean));
}

static void test_ranges(void **state) {
    (void)state;
    Run run = open_run(patch_path);
    Error error = {0};
    QuantityRange range;
    run_wait_end(&run);
    QuantityKind kinds[1] = {QUANTITY_STRAIN_WARP};
    assert_true(quantity_find_range(kinds[0], &run, kinds, &range, &error));
    CHECK_NEAR(range.high, RENDER_PATCH_WARP, 1e-12); /* 4 % is round already */
    CHECK_NEAR(range.low, -RENDER_PATCH_WARP, 1e-12);
    kinds[0] = QUANTITY_SPEED;
    assert_true(quantity_find_range(kinds[0], &run, kinds, &range, &error));
    CHECK_NEAR(range.high, RENDER_PATCH_SPEED, 1e-12);
    CHECK_NEAR(range.low, 0.0, 1e-12);
    CHECK_NEAR(quantity_round_up(0.0), 1.0, 0.0);
    CHECK_NEAR(quantity_round_up(-3.0), 1.0, 0.0);
    CHECK_NEAR(quantity_round_up(0.11), 0.12, 1e-15);
    CHECK_NEAR(quantity_round_up(8.1), 10.0, 1e-12);
    CHECK_NEAR(quantity_round_up(2e-7), 2e-7, 1e-20);
    run_close(&run);
}

/* ---- pictures ---- */

static double linear(uint8_t code) { return pow((code / 255.0 + 0.055) / 1.055, 2.4); }

/* The middle of the picture has the chromaticity of the value: light only scales. Returns the
 * largest difference of a colour's share. */
static double color_error(const char *path, const char *look, QuantityRange range, double t,
                          const ColorMap *map) {
    Run run = open_run(path);
    Error error = {0};
    DrawDef def = {.width = WIDTH,
                   .height = HEIGHT,
                   .quality = quality_find("standard"),
                   .look = look,
                   .range = range};
    run_wait_end(&run);
    Drawer *drawer = draw_create(&run, &def, &error);
    const Image *image = drawer ? draw_frame(drawer, 0, &error) : NULL;
    if (!image) {
        fail_msg("%s", error.text);
    }
    const uint8_t *p = image->rgba + IMAGE_CHANNELS * (HEIGHT / 2 * WIDTH + WIDTH / 2);
    double wanted[3], seen[3], sum_wanted = 0.0, sum_seen = 0.0, most = 0.0;
    colormap_color(map, t, wanted);
    for (int k = 0; k < 3; k++) {
        wanted[k] = pow((wanted[k] + 0.055) / 1.055, 2.4);
        seen[k] = linear(p[k]);
        sum_wanted += wanted[k];
        sum_seen += seen[k];
    }
    for (int k = 0; k < 3; k++) {
        most = fmax(most, fabs(wanted[k] / sum_wanted - seen[k] / sum_seen));
    }
    draw_destroy(drawer);
    run_close(&run);
    return most;
}

static void test_colors_in_pictures(void **state) {
    (void)state;
    QuantityRange percent = {-5, 5}, speed = {0, 1}, automatic = {0, 0};
    CHECK_AT_MOST(color_error(patch_path, "strain-warp", percent, 0.9, &colormap_diverging), 0.01);
    CHECK_AT_MOST(color_error(patch_path, "strain-weft", percent, 0.2, &colormap_diverging), 0.01);
    CHECK_AT_MOST(color_error(patch_path, "strain-warp", automatic, 1.0, &colormap_diverging),
                  0.01);
    CHECK_AT_MOST(color_error(patch_path, "speed", speed, 0.5, &colormap_sequential), 0.01);
    CHECK_AT_MOST(
        color_error(roll_path, "curvature", (QuantityRange){-10, 10}, 0.25, &colormap_diverging),
        0.01);
    /* the test can fail: half a percent more strain is another colour */
    double off = color_error(patch_path, "strain-warp", percent, 0.85, &colormap_diverging);
    assert_true(off > 0.02);
}

static void test_wrong_ranges(void **state) {
    (void)state;
    Run run = open_run(patch_path);
    Error error = {0};
    DrawDef def = {.quality = quality_find("draft"), .look = "linen", .range = {-1, 1}};
    assert_null(draw_create(&run, &def, &error));
    assert_int_equal(error.code, EXIT_USAGE);
    assert_non_null(strstr(error.text, "measuring look"));
    def.look = "speed";
    assert_false(draw_needs_end(&run, &def, &error));
    def.range = (QuantityRange){0};
    assert_true(draw_needs_end(&run, &def, &error));
    run_close(&run);
    char *words[] = {"toile-render", "render",  patch_path, "-o",
                     "/tmp/x.png",   "--range", "3,1",      NULL};
    assert_int_equal(command_run(7, words, &error), EXIT_USAGE);
}

static void test_names(void **state) {
    (void)state;
    Error error = {0};
    for (int kind = QUANTITY_NONE + 1; kind < QUANTITY_COUNT; kind++) {
        int found = 0;
        for (int i = 0; i < look_count; i++) {
            found += looks[i].quantity == (QuantityKind)kind;
        }
        assert_int_equal(found, 1); /* every quantity can be asked for, by one name */
        assert_true(strlen(quantities[kind].title) > 0 && strlen(quantities[kind].unit) > 0);
    }
    assert_null(look_find("strain-wrap", &error));
    assert_non_null(strstr(error.text, "strain-warp"));
}

static int set_up(void **state) {
    (void)state;
    Error error = {0};
    bool good = mkdtemp(folder) != NULL;
    snprintf(patch_path, sizeof patch_path, "%s/patch.states", folder);
    snprintf(roll_path, sizeof roll_path, "%s/roll.states", folder);
    good = good && render_states_write("patch", patch_path, 0, 3, NODES, NULL, true, &error) &&
           render_states_write("roll", roll_path, 0, 1, NODES, NULL, true, &error) &&
           gl_open(0, &error);
    if (!good) {
        print_message("%s\n", error.text);
    }
    return good ? 0 : 1;
}

static int tear_down(void **state) {
    (void)state;
    unlink(patch_path);
    unlink(roll_path);
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_maps_are_even),
        cmocka_unit_test(test_map_values),
        cmocka_unit_test(test_quantities),
        cmocka_unit_test(test_ranges),
        cmocka_unit_test(test_colors_in_pictures),
        cmocka_unit_test(test_wrong_ranges),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
