/* Pictures behind the scene and printed on cloths. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/draw.h"
#include "sim/base/hash.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/render_states.h"
#include "tests/support/shell.h"

#define WIDTH 640
#define HEIGHT 360

/* Draws frame 0 of the patch; *key: of the frame. NULL error: must succeed. */
static bool draw(DrawDef def, Image *image, uint64_t *key, Error *error) {
    RunDef run_def = run_default();
    Run run;
    Error own = {0};
    run_def.path = folder_path("patch.states");
    def.width = WIDTH, def.height = HEIGHT;
    def.quality = quality_find("standard");
    assert_true(run_open(&run, &run_def, &own));
    run_wait_end(&run);
    Drawer *drawer = draw_create(&run, &def, error ? error : &own);
    const Image *drawn = drawer ? draw_frame(drawer, 0, &own) : NULL;
    if (drawn) {
        *image = image_create(WIDTH, HEIGHT);
        memcpy(image->rgba, drawn->rgba, (size_t)IMAGE_CHANNELS * WIDTH * HEIGHT);
        assert_true(draw_frame_key(drawer, 0, key, &own));
    } else if (!error) {
        fail_msg("%s", own.text);
    }
    draw_destroy(drawer);
    run_close(&run);
    return drawn != NULL;
}

static const uint8_t *pixel(const Image *image, int x, int y) {
    return image->rgba + IMAGE_CHANNELS * (y * image->width + x);
}

static void test_flat_backdrop(void **state) {
    (void)state;
    static const int wanted[3] = {0x20, 0xc0, 0x81};
    Image image;
    uint64_t key;
    draw((DrawDef){.backdrop = "#20c081"}, &image, &key, NULL);
    for (int k = 0; k < 3; k++) {
        CHECK_NEAR(pixel(&image, 3, 3)[k], wanted[k], 1.0);
        CHECK_NEAR(pixel(&image, WIDTH - 4, 3)[k], wanted[k], 1.0);
    }
    image_free(&image);
}

/* Twice the film's size and wider: its middle fills the picture, where nothing else is. */
static void test_picture_backdrop(void **state) {
    (void)state;
    Image from = image_create(2 * WIDTH + 200, 2 * HEIGHT), image;
    uint64_t key;
    for (int i = 0; i < from.width * from.height; i++) {
        int x = i % from.width, y = i / from.width;
        uint8_t color[4] = {(uint8_t)(x * 255 / from.width), (uint8_t)(y * 255 / from.height), 60,
                            255};
        memcpy(from.rgba + IMAGE_CHANNELS * i, color, 4);
    }
    assert_true(image_write_png(folder_path("back.png"), &from, NULL, 0, NULL));
    draw((DrawDef){.backdrop = folder_path("back.png")}, &image, &key, NULL);
    for (int y = 4; y < 40; y += 7) {
        for (int x = 4; x < WIDTH; x += 31) {
            CHECK_NEAR(pixel(&image, x, y)[0], (2 * x + 100) * 255.0 / from.width, 2.0);
            CHECK_NEAR(pixel(&image, x, y)[1], 2 * y * 255.0 / from.height, 2.0);
        }
    }
    image_free(&from);
    image_free(&image);
}

/* Red, green; blue, white: quarters of a picture. */
static void write_quarters(const char *path) {
    static const uint8_t colors[4][4] = {
        {220, 20, 20, 255}, {20, 200, 20, 255}, {20, 20, 220, 255}, {250, 250, 250, 255}};
    Image image = image_create(60, 40);
    for (int i = 0; i < 60 * 40; i++) {
        memcpy(image.rgba + IMAGE_CHANNELS * i, colors[(i % 60 >= 30) + 2 * (i / 60 >= 20)], 4);
    }
    assert_true(image_write_png(path, &image, NULL, 0, NULL));
    image_free(&image);
}

/* The patch is 60 x 40 cm, so that the print fits it once; seen from in front of its back or face, up is up. */
static void check_quarters(bool splats) {
    Image image, plain;
    uint64_t key, plain_key;
    const char *prints[1] = {folder_path("quarters.png")};
    DrawDef def = {.look = "cotton", .splats = splats};
    draw(def, &plain, &plain_key, NULL);
    def.prints = prints, def.print_count = 1;
    draw(def, &image, &key, NULL);
    assert_true(key != plain_key);
    const uint8_t *red = pixel(&image, WIDTH / 2 - 50, HEIGHT / 2 - 40);
    const uint8_t *green = pixel(&image, WIDTH / 2 + 50, HEIGHT / 2 - 40);
    const uint8_t *blue = pixel(&image, WIDTH / 2 - 50, HEIGHT / 2 + 40);
    const uint8_t *white = pixel(&image, WIDTH / 2 + 50, HEIGHT / 2 + 40);
    assert_true(red[0] > 2 * red[1] && red[0] > 2 * red[2]);
    assert_true(green[1] > 2 * green[0] && green[1] > 2 * green[2]);
    assert_true(blue[2] > 2 * blue[0] && blue[2] > 2 * blue[1]);
    for (int k = 0; k < 3; k++) { /* white ink leaves the cloth nearly as it is */
        CHECK_NEAR(white[k], pixel(&plain, WIDTH / 2 + 50, HEIGHT / 2 + 40)[k], 8.0);
    }
    image_free(&image);
    image_free(&plain);
}

static void test_print(void **state) {
    (void)state;
    write_quarters(folder_path("quarters.png"));
    check_quarters(false);
    check_quarters(true);
}

/* Half as wide: the same colours come back once. */
static void test_repeat(void **state) {
    (void)state;
    Image image;
    uint64_t key;
    char text[160];
    write_quarters(folder_path("quarters.png"));
    snprintf(text, sizeof text, "%s@0.3", folder_path("quarters.png"));
    const char *prints[1] = {text};
    draw((DrawDef){.look = "cotton", .prints = prints, .print_count = 1}, &image, &key, NULL);
    int runs = 0, length = 0;
    for (int x = 0; x < WIDTH; x++) { /* stretches of red along a row near the top */
        const uint8_t *p = pixel(&image, x, HEIGHT / 2 - 70);
        length = p[0] > 2 * p[1] && p[0] > 2 * p[2] ? length + 1 : 0;
        runs += length == 5;
    }
    assert_int_equal(runs, 2);
    image_free(&image);
}

static void expect(DrawDef def, ExitCode code, const char *words) {
    Image image;
    uint64_t key;
    Error error = {0};
    assert_false(draw(def, &image, &key, &error));
    if (error.code != code || !strstr(error.text, words)) {
        print_message("%d: %s\n", error.code, error.text);
    }
    assert_int_equal(error.code, code);
    assert_non_null(strstr(error.text, words));
}

static void expect_print(const char *text, ExitCode code, const char *words) {
    const char *prints[1] = {text};
    expect((DrawDef){.prints = prints, .print_count = 1}, code, words);
}

#define SCENE                                                                                      \
    "toile: 1\nfilm: {rate: 30, seconds: 0.1, size: 320x180%s}\ncloth:\n  sheet:\n"                \
    "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n    fabric: wool-tropical\n"           \
    "    nodes: 5 x 5\n%s"

/* Simulates a scene of this name and draws it with these options into NAME.png. */
static int film_scene(const char *name, const char *film, const char *cloth, const char *options,
                      char *text, size_t size) {
    char command[2000], path[256];
    snprintf(path, sizeof path, "%s.yaml", name);
    FILE *file = fopen(folder_path(path), "w");
    assert_non_null(file);
    fprintf(file, SCENE, film, cloth);
    fclose(file);
    snprintf(command, sizeof command,
             "cd %s && %s/scripts/toile sim %s.yaml -o %s.run --force --quiet 2>&1 && cd / && "
             "%s/scripts/toile render %s%s.run -o %s%s.png --force --quiet %s 2>&1",
             folder_path(""), TOILE_SOURCE_DIR, name, name, TOILE_SOURCE_DIR, folder_path(""), name,
             folder_path(""), name, options);
    return shell_run(command, text, size);
}

static void check_same(const char *a, const char *b, int expected) {
    char command[1000], text[4000];
    snprintf(command, sizeof command, "%s/scripts/toile diff --profile exact %s%s.png %s%s.png",
             TOILE_SOURCE_DIR, folder_path(""), a, folder_path(""), b);
    assert_int_equal(shell_run(command, text, sizeof text), expected);
}

/* The keys of a scene draw what the options draw, from any directory. */
static void test_keys(void **state) {
    (void)state;
    char text[4000], options[1000];
    write_quarters(folder_path("ink.png"));
    snprintf(options, sizeof options, "--backdrop '#204060' --print sheet=%s@0.05",
             folder_path("ink.png"));
    assert_int_equal(film_scene("plain", "", "", "", text, sizeof text), 0);
    assert_int_equal(film_scene("options", "", "", options, text, sizeof text), 0);
    assert_int_equal(film_scene("keys", ", backdrop: \"#204060\"",
                                "    print: {file: ink.png, width: 5 cm}\n", "", text, sizeof text),
                     0);
    assert_int_equal(film_scene("short", ", backdrop: ink.png", "    print: ink.png\n",
                                "--backdrop '#204060'", text, sizeof text),
                     0);
    check_same("options", "keys", 0);
    check_same("options", "plain", 1);
    check_same("options", "short", 1);
    /* without a backdrop the scene's is left out */
    assert_int_equal(film_scene("clear", ", backdrop: ink.png", "", "--alpha", text, sizeof text),
                     0);
}

static void test_bad_keys(void **state) {
    (void)state;
    char text[4000];
    const struct {
        const char *film, *cloth, *message;
        int code;
    } bad[] = {
        {", backdrop: \"#20406\"", "", "bad.yaml:2:57: error: 'backdrop' is #20406;",
         EXIT_BAD_INPUT},
        {", backdrop: nowhere.png", "", "bad.yaml:2:57: error: 'backdrop' nowhere.png: No such",
         EXIT_MISSING_INPUT},
        {"", "    print: nowhere.png\n", "bad.yaml:8:12: error: 'print' nowhere.png: No such",
         EXIT_MISSING_INPUT},
        {"", "    print: {file: ., width: 5 cm}\n", "is no picture file", EXIT_BAD_INPUT},
        {"", "    print: {file: ink.png, width: 0 cm}\n", "'width'", EXIT_BAD_INPUT},
        {"", "    print: {flie: ink.png}\n", "did you mean 'file'", EXIT_BAD_INPUT},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        int code = film_scene("bad", bad[i].film, bad[i].cloth, "", text, sizeof text);
        if (code != bad[i].code || !strstr(text, bad[i].message)) {
            fail_msg("%d: %s", code, text);
        }
    }
}

static void test_refusals(void **state) {
    (void)state;
    char text[160];
    Image image = image_create(50, 50);
    assert_true(image_write_png(folder_path("whole.png"), &image, NULL, 0, NULL));
    image_free(&image);
    FILE *whole = fopen(folder_path("whole.png"), "rb"),
         *torn = fopen(folder_path("torn.png"), "wb");
    char bytes[70];
    assert_int_equal(fread(bytes, 1, sizeof bytes, whole), sizeof bytes);
    assert_int_equal(fwrite(bytes, 1, sizeof bytes, torn), sizeof bytes);
    fclose(whole), fclose(torn);
    expect_print(folder_path("torn.png"), EXIT_BAD_INPUT, "torn.png");
    expect_print(folder_path("none.png"), EXIT_MISSING_INPUT, "none.png");
    expect_print(folder_path("patch.states"), EXIT_BAD_INPUT, "patch.states");
    snprintf(text, sizeof text, "curtain=%s", folder_path("whole.png"));
    expect_print(text, EXIT_USAGE, "no cloth is called 'curtain'");
    expect_print("=", EXIT_USAGE, "expected [CLOTH=]FILE[@WIDTH]");
    expect((DrawDef){.backdrop = folder_path("torn.png")}, EXIT_BAD_INPUT, "torn.png");
    expect((DrawDef){.backdrop = "#12345"}, EXIT_USAGE, "expected #rrggbb");
    expect((DrawDef){.backdrop = "#123456", .clear = true}, EXIT_USAGE, "exclude each other");
}

static int set_up(void **state) {
    (void)state;
    return folder_make("pictures") && render_states_write("patch", folder_path("patch.states"), 0,
                                                          1, 9, NULL, true, NULL)
               ? 0
               : 1;
}

static int tear_down(void **state) {
    (void)state;
    return folder_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat_backdrop), cmocka_unit_test(test_picture_backdrop),
        cmocka_unit_test(test_print),         cmocka_unit_test(test_repeat),
        cmocka_unit_test(test_keys),          cmocka_unit_test(test_bad_keys),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
