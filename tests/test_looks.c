/* Looks: colour maps, and the numbers, ranges and pictures of measuring looks. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/command.h"
#include "render/gl.h"
#include "render/quantity.h"
#include "render/swatch.h"
#include "sim/base/hash.h"
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
    /* as many newtons as metres a second, on the cell around an inner node */
    double cell = 0.6 / (NODES - 1) * 0.4 / (NODES - 1), pressed = RENDER_PATCH_SPEED / cell;
    CHECK_AT_MOST(worst(patch_path, QUANTITY_CONTACT, pressed, true) / pressed, 1e-9);
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

/* ---- swatches ---- */

/* Places in a swatch, parts of width and height: one layer of the face, the turned corner, beside. */
static const double FACE[2] = {0.415, 0.34}, BACK[2] = {0.54, 0.566}, BESIDE[2] = {0.29, 0.34};

static Image draw_swatch(const Look *look, int width, int height) {
    Image image = {0};
    Error error = {0};
    if (!swatch_draw_cloth(look, quality_find("standard"), SWATCH_WHOLE, width, height, &image,
                           &error)) {
        fail_msg("%s", error.text);
    }
    return image;
}

/* Mean of 5 x 5 pixels, 0..255. */
static void mean_at(const Image *image, const double place[2], double rgb[3]) {
    int x0 = (int)(place[0] * image->width) - 2, y0 = (int)(place[1] * image->height) - 2;
    memset(rgb, 0, 3 * sizeof *rgb);
    for (int i = 0; i < 25; i++) {
        const uint8_t *p =
            image->rgba + IMAGE_CHANNELS * ((y0 + i / 5) * image->width + x0 + i % 5);
        for (int k = 0; k < 3; k++) {
            rgb[k] += p[k] / 25.0;
        }
    }
}

static double difference_at(const Image *a, const double at_a[2], const Image *b,
                            const double at_b[2]) {
    double p[3], q[3], most = 0.0;
    mean_at(a, at_a, p);
    mean_at(b, at_b, q);
    for (int k = 0; k < 3; k++) {
        most = fmax(most, fabs(p[k] - q[k]));
    }
    return most;
}

/* How far green is on the way from one picture to the other, in display code. */
static double opacity_at(const Image *image, const Image *none, const Image *all,
                         const double place[2]) {
    double at[3], from[3], to[3];
    mean_at(image, place, at);
    mean_at(none, place, from);
    mean_at(all, place, to);
    return (at[1] - from[1]) / (to[1] - from[1]);
}

static void test_every_look_draws(void **state) {
    (void)state;
    uint64_t seen[64];
    for (int i = 0; i < look_count + prop_look_count; i++) {
        Image image = {0};
        if (i < look_count) {
            image = draw_swatch(&looks[i], 160, 132);
        } else {
            assert_true(swatch_draw_prop(&prop_looks[i - look_count], quality_find("draft"), 160,
                                         132, &image, NULL));
        }
        seen[i] = hash_bytes(image.rgba, (size_t)160 * 132 * IMAGE_CHANNELS);
        for (int j = 0; j < i; j++) {
            assert_true(seen[i] != seen[j]);
        }
        image_free(&image);
    }
}

/* Bands much finer than a pixel become their mean: no moire, no flicker. */
static void test_bands_fade(void **state) {
    (void)state;
    Look look = *look_find("breton", NULL), mean = look;
    look.weft_bands.repeat = 0.0021f; /* [m]; a pixel holds 9 mm of cloth */
    float part = look.weft_bands.second[1] - look.weft_bands.second[0];
    for (int k = 0; k < 3; k++) {
        mean.weft[k] += part * (look.second[k] - look.weft[k]);
        mean.warp[k] = mean.weft[k];
    }
    mean.weft_bands.repeat = 0.0f;
    Image banded = draw_swatch(&look, 80, 66), even = draw_swatch(&mean, 80, 66);
    ImageDifference difference = image_compare(&banded, &even);
    CHECK_AT_MOST(-difference.psnr, -45.0);
    look.weft_bands.second[1] += 0.1f; /* the test can fail: another part of the second colour */
    Image darker = draw_swatch(&look, 80, 66);
    difference = image_compare(&darker, &even);
    CHECK_AT_MOST(difference.psnr, 40.0);
    image_free(&banded);
    image_free(&even);
    image_free(&darker);
}

static void test_sheer_cloth(void **state) {
    (void)state;
    Look look = *look_find("voile", NULL);
    look.hem = 0;
    Image usual = draw_swatch(&look, 320, 264);
    look.cover = 0.999f;
    Image dense = draw_swatch(&look, 320, 264);
    look.cover = 1e-4f;
    Image none = draw_swatch(&look, 320, 264);
    look.cover = 0.0f;
    Image opaque = draw_swatch(&look, 320, 264);
    /* no gaps: as cloth that is drawn without layers, where no fold dims the light */
    CHECK_AT_MOST(difference_at(&dense, FACE, &opaque, FACE), 6.0);
    /* nothing but gaps: the backdrop, which changes little from left to right */
    CHECK_AT_MOST(difference_at(&none, FACE, &none, BESIDE), 6.0);
    double opacity = opacity_at(&usual, &none, &dense, FACE);
    print_message("opacity of one layer %.2f\n", opacity);
    assert_true(opacity > 0.5 && opacity < 0.75); /* 0.55 straight on, more at a slant */
    image_free(&usual);
    image_free(&dense);
    image_free(&none);
    image_free(&opaque);
}

static void test_sides_and_borders(void **state) {
    (void)state;
    Look look = *look_find("double-face", NULL);
    Image image = draw_swatch(&look, 320, 264);
    double face[3], back[3];
    mean_at(&image, FACE, face);
    mean_at(&image, BACK, back);
    assert_true(face[0] > 2.0 * back[0] && face[0] > 1.5 * face[2]); /* camel, charcoal */
    look.hem = 0;
    Image plain = draw_swatch(&look, 320, 264);
    ImageDifference hem = image_compare(&image, &plain);
    assert_true(hem.share > 0.005 && hem.share < 0.2);
    assert_true(difference_at(&image, FACE, &plain, FACE) == 0.0); /* far from any border */
    image_free(&image);
    image_free(&plain);
}

static void test_threads_follow_the_fabric(void **state) {
    (void)state;
    const Look *look = look_find("wool", NULL);
    LookPanel panel = {.width = 0.8, .height = 0.6, .thickness = (double)look->thickness};
    ClothBlock usual = look_cloth_block(look, &panel);
    CHECK_NEAR((double)usual.warp[3], (double)look->ends, 0.02 * (double)look->ends);
    panel.thickness *= 0.5;
    ClothBlock thin = look_cloth_block(look, &panel);
    CHECK_NEAR((double)thin.warp[3], 2.0 * (double)look->ends, 0.04 * (double)look->ends);
    CHECK_NEAR((double)thin.weft[3], 2.0 * (double)look->picks, 0.04 * (double)look->picks);
    panel.thickness = 1.0; /* no fabric: it is not spread out without end */
    ClothBlock thick = look_cloth_block(look, &panel);
    assert_true((double)thick.warp[3] > 0.35 * (double)look->ends);
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
        cmocka_unit_test(test_every_look_draws),
        cmocka_unit_test(test_bands_fade),
        cmocka_unit_test(test_sheer_cloth),
        cmocka_unit_test(test_sides_and_borders),
        cmocka_unit_test(test_threads_follow_the_fabric),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
