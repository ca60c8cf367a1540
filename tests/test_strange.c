/* Pictures of strangers: kinds of pixels, sizes, files that may not be read, and places where nothing can be
 * written. The answer is the right picture or a clear error, and no half-written file. */
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/image_source.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/render_child.h"
#include "tests/support/render_states.h"
#include "tests/support/shell.h"

static char text[8000];

/* Runs a command inside of the folder. */
static int inside(const char *command) {
    char whole[3000];
    snprintf(whole, sizeof whole, "cd %s && %s", folder_path(""), command);
    return shell_run(whole, text, sizeof text);
}

typedef struct Kind {
    const char *file, *options; /* of ffmpeg */
    int width, height, tolerance;
    int color[3];
} Kind;

#define OWN_COLORS "color=#c86432:s=40x30:d=0.1 -vf 'split[a][b];[a]palettegen[p];[b][p]paletteuse'"

/* One colour in every kind of pixel that files have; the source of ffmpeg rounds it to YUV first. */
static void test_kinds(void **state) {
    (void)state;
    static const Kind kinds[] = {
        {"rgb.png", "color=#c86432:s=40x30 -pix_fmt rgb24", 40, 30, 4, {200, 100, 50}},
        {"deep.png", "color=#c86432:s=40x30 -pix_fmt rgb48be", 40, 30, 4, {200, 100, 50}},
        {"alpha.png", "color=#c86432:s=40x30 -pix_fmt rgba64be", 40, 30, 4, {200, 100, 50}},
        {"gray.png", "color=#808080:s=40x30 -pix_fmt gray", 40, 30, 3, {128, 128, 128}},
        {"gray16.png", "color=#808080:s=40x30 -pix_fmt gray16be", 40, 30, 3, {128, 128, 128}},
        {"both.png", "color=#808080:s=40x30 -pix_fmt ya8", 40, 30, 3, {128, 128, 128}},
        {"table.png", OWN_COLORS " -pix_fmt pal8", 40, 30, 4, {200, 100, 50}},
        {"bits.png", "color=white:s=40x30 -pix_fmt monob", 40, 30, 1, {255, 255, 255}},
        {"one.png", "color=#c86432:s=16x16,format=rgb24,crop=1:1:0:0", 1, 1, 4, {200, 100, 50}},
        {"one.bmp", "color=#c86432:s=16x16,format=bgr24,crop=1:1:0:0", 1, 1, 4, {200, 100, 50}},
        {"wide.png", "color=#c86432:s=20000x2 -pix_fmt rgb24", 20000, 2, 4, {200, 100, 50}},
        {"high.jpg",
         "color=#c86432:s=2x20000,format=rgb24 -pix_fmt yuvj444p -q:v 2",
         2,
         20000,
         6,
         {200, 100, 50}},
        {"table.gif", OWN_COLORS, 40, 30, 20, {200, 100, 50}},
        {"deep.tiff", "color=#c86432:s=40x30 -pix_fmt rgb48le", 40, 30, 4, {200, 100, 50}},
    };
    if (shell_run("command -v ffmpeg", text, sizeof text) != 0) {
        printf("SKIPPED: kinds of pictures: ffmpeg is not installed\n");
        return;
    }
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        const Kind *kind = &kinds[i];
        char command[500];
        Image image;
        Error error = {0};
        snprintf(command, sizeof command,
                 "ffmpeg -nostdin -v error -y -f lavfi -i %s -frames:v 1 %s 2>&1", kind->options,
                 kind->file);
        if (inside(command) != 0) {
            fail_msg("%s: %s", command, text);
        }
        if (!image_read(folder_path(kind->file), &image, &error)) {
            fail_msg("%s: %s", kind->file, error.text);
        }
        assert_int_equal(image.width, kind->width);
        assert_int_equal(image.height, kind->height);
        size_t last = IMAGE_CHANNELS * ((size_t)image.width * (size_t)image.height - 1);
        for (int k = 0; k < 3; k++) {
            CHECK_NEAR(image.rgba[k], kind->color[k], kind->tolerance);
            CHECK_NEAR(image.rgba[last + (size_t)k], kind->color[k], kind->tolerance);
        }
        image_free(&image);
    }
}

/* Inks instead of lights: cyan 20, magenta 230, yellow 200, black 10 of 255. */
static void test_inks(void **state) {
    (void)state;
    Image image;
    Error error = {0};
    if (!image_read(TOILE_SOURCE_DIR "/tests/pictures/cmyk.jpg", &image, &error)) {
        fail_msg("%s", error.text);
    }
    const double expected[3] = {235 * 245 / 255.0, 25 * 245 / 255.0, 55 * 245 / 255.0};
    for (int k = 0; k < 3; k++) {
        CHECK_NEAR(image.rgba[k], expected[k], 4.0); /* coarse steps of a JPEG */
    }
    image_free(&image);
}

/* 41 bytes that promise 400 million pixels */
static void test_too_large(void **state) {
    (void)state;
    static const unsigned char head[41] = {
        0x89, 'P',  'N',  'G',  13,   10,   26, 10, 0,    0,    0,   13,  'I', 'H',
        'D',  'R',  0,    0,    0x4e, 0x20, 0,  0,  0x4e, 0x20, 1,   0,   0,   0,
        0,    0xcb, 0x0b, 0x7b, 0x94, 0,    0,  0,  9,    'I',  'D', 'A', 'T'};
    FILE *file = fopen(folder_path("huge.png"), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(head, 1, sizeof head, file), sizeof head);
    fclose(file);
    Image image;
    Error error = {0};
    assert_false(image_read(folder_path("huge.png"), &image, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, "huge.png"));
    assert_non_null(strstr(error.text, "too many pixels"));
}

/* What somebody without rights reads: the exit code, 0 for a picture. */
static int read_as_nobody(void *path) {
    Image image;
    Error error = {0};
    if (geteuid() == 0 && setuid(65534) != 0) {
        return 1;
    }
    bool good = image_read(path, &image, &error);
    return good ? 0 : strstr(error.text, "Permission denied") ? (int)error.code : 1;
}

static void test_no_permission(void **state) {
    (void)state;
    static const char *const names[] = {"secret.png", "secret.jpg"};
    char path[256];
    assert_int_equal(chmod(folder_path(""), 0755), 0);
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s", folder_path(names[i]));
        Image image = image_create(8, 8);
        assert_true(image_write_png(path, &image, NULL, 0, NULL));
        image_free(&image);
        assert_int_equal(chmod(path, 0), 0);
        assert_int_equal(render_child_wait(render_child_start(read_as_nobody, path)), EXIT_IO);
    }
}

/* No room: an error, and nothing under the final name. */
static void test_full(void **state) {
    (void)state;
    static const char *const targets[] = {"full.png", "full.mp4", "full.webm",
                                          "full.gif", "full.exr", "full.mkv"};
    Error error = {0};
    assert_true(
        render_states_write("patch", folder_path("run.states"), 0, 3, 9, NULL, true, &error));
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
        char command[600], path[256];
        bool one = strstr(targets[i], "png") || strstr(targets[i], "exr");
        snprintf(
            command, sizeof command,
            "(ulimit -f 2; trap '' XFSZ; %s/scripts/toile render run.states -o %s --size 640x360 "
            "--quiet %s) 2>&1",
            TOILE_SOURCE_DIR, targets[i], one ? "--frames 0" : "");
        int code = inside(command);
        if (code != EXIT_IO) {
            fail_msg("%s: %d: %s", targets[i], code, text);
        }
        snprintf(path, sizeof path, "%s", folder_path(targets[i]));
        assert_true(access(path, F_OK) != 0);
        assert_non_null(strstr(text, targets[i]));
    }
}

static int set_up(void **state) {
    (void)state;
    return folder_make("strange") ? 0 : 1;
}

static int tear_down(void **state) {
    (void)state;
    return folder_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kinds), cmocka_unit_test(test_inks), cmocka_unit_test(test_too_large),
        cmocka_unit_test(test_no_permission), cmocka_unit_test(test_full)};
    return cmocka_run_group_tests_name("strange", tests, set_up, tear_down);
}
