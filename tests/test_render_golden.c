/* Golden pictures: drawn from committed states, compared with committed pictures under the gate
 * of render/image.h. TOILE_GOLDEN_ACCEPT=1 writes the pictures anew (and missing states); a failing
 * case leaves its picture and the difference in build/golden/. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "render/draw.h"
#include "render/gl.h"
#include "render/passes.h"
#include "tests/support/render_states.h"

#define WIDTH 640
#define HEIGHT 360
#define GOLDEN TOILE_SOURCE_DIR "/tests/golden/"
#define FAILED TOILE_SOURCE_DIR "/build/golden/"

typedef struct Golden {
    const char *name, *motion;
    int frame, nodes; /* of the states, when they are written anew */
    const char *look; /* NULL: the motion's own */
} Golden;

static const Golden goldens[] = {
    {"table", "table", 5, 36, NULL}, /* weave too fine to draw, wood, hard and soft shadow */
    {"sleeve", "sleeve", 80, 30, "teal-twill"}, /* weave, closed along u, automatic camera */
    {"ball", "ball", 5, 36, "linen"},           /* transmission, clay, plane as floor */
    {"disc", "disc", 5, 22, "satin"},           /* scattered nodes, highlights, metal */
    {"figure", "figure", 21, 16, NULL},         /* a mesh that moves by itself */
};
#define GOLDEN_COUNT ((int)(sizeof goldens / sizeof *goldens))

static bool accepting(void) { return getenv("TOILE_GOLDEN_ACCEPT") != NULL; }

static void path_of(char path[512], const char *folder, const char *name, const char *ending) {
    snprintf(path, 512, "%s%s%s", folder, name, ending);
}

/* ---- drawing the states, as they are or with something changed ---- */

typedef enum Change { CHANGE_NONE, CHANGE_LIGHT, CHANGE_CAMERA, CHANGE_WEAVE, CHANGE_SIDE } Change;

typedef struct Scene {
    Run run;
    Camera camera;
    const Look *look;
    Look changed_look;
    PaintProp props[8];
    StateFrame frame;
    StateLayout layout;
} Scene;

static void open_scene(Scene *scene, const char *name) {
    char path[512];
    RunDef def = run_default();
    Error error = {0};
    int floor_obstacle, layout_index;
    path_of(path, GOLDEN, name, ".states");
    def.path = path;
    *scene = (Scene){0};
    if (!run_open(&scene->run, &def, &error)) {
        fail_msg("%s", error.text);
    }
    const StateHeader *header = state_header(scene->run.reader);
    CameraReach reach;
    double floor = run_floor(&scene->run, &floor_obstacle, NULL);
    assert_true(run_find_reach(&scene->run, WIDTH, HEIGHT, &reach, NULL));
    scene->camera = camera_create(&header->film, WIDTH, HEIGHT, &reach, floor);
    scene->look = look_find(header->cloths[0].look, NULL);
    for (int i = 0; i < header->obstacle_count; i++) {
        scene->props[i] =
            (PaintProp){header->obstacles[i].solid, header->obstacles[i].mesh,
                        prop_look_find(header->obstacles[i].look, NULL), i == floor_obstacle};
    }
    assert_true(
        state_read_frame(scene->run.reader, 0, &scene->frame, &scene->layout, &layout_index, NULL));
}

static void make_change(Scene *scene, Change change) {
    scene->changed_look = *scene->look;
    scene->look = &scene->changed_look;
    if (change == CHANGE_CAMERA) { /* 1 cm at the scale of a table */
        Camera *camera = &scene->camera;
        camera->eye = vec3_axpy(camera->eye, 0.01 * camera->scale, camera->right);
    } else if (change == CHANGE_WEAVE) {
        scene->changed_look.bump += 0.2f;
    }
}

static Image draw_scene(Scene *scene, Change change) {
    const StateHeader *header = state_header(scene->run.reader);
    make_change(scene, change);
    PaintDef def = {.width = WIDTH,
                    .height = HEIGHT,
                    .quality = quality_find("standard"),
                    .camera = scene->camera,
                    .floor = true,
                    .cloth_count = 1,
                    .looks = &scene->look,
                    .prop_count = header->obstacle_count,
                    .props = scene->props};
    ResampleDef density = {.pixels_per_metre = camera_pixels_per_metre(&scene->camera, HEIGHT),
                           .triangle_cap = 100000};
    Resampler *resampler = resample_create(&scene->layout, &density);
    Surface surface = *resample_frame(resampler, &scene->layout, scene->frame.x);
    for (int i = 0; change == CHANGE_SIDE && i < 3 * surface.vertex_count; i++) {
        surface.vertices[i / 3].normal[i % 3] *= -1;
    }
    Image image = image_create(WIDTH, HEIGHT);
    Error error = {0};
    Painter *painter = paint_create(&def, &error);
    if (!painter) {
        fail_msg("%s", error.text);
    }
    if (change == CHANGE_LIGHT) { /* 5 % */
        painter->stage.block.key_color[0] *= 1.05f;
        painter->stage.block.key_color[1] *= 1.05f;
        painter->stage.block.key_color[2] *= 1.05f;
    }
    for (int i = 0; i < header->obstacle_count; i++) {
        if (scene->props[i].mesh) {
            paint_move_mesh(painter, i, state_mesh_vertices(header, &scene->frame, i));
        }
    }
    paint_set_surface(painter, &surface);
    paint_frame(painter, &surface, scene->frame.pose, &image);
    paint_destroy(painter);
    resample_destroy(resampler);
    return image;
}

static Image draw_golden(const Golden *golden, Change change) {
    Scene scene;
    open_scene(&scene, golden->name);
    Image image = draw_scene(&scene, change);
    run_close(&scene.run);
    return image;
}

/* ---- the tests ---- */

static void accept_golden(const Golden *golden) {
    char states[512], picture[512];
    path_of(states, GOLDEN, golden->name, ".states");
    path_of(picture, GOLDEN, golden->name, ".png");
    mkdir(GOLDEN, 0777);
    if (access(states, F_OK) != 0) {
        assert_true(render_states_write(golden->motion, states, golden->frame, 1, golden->nodes,
                                        golden->look, true, NULL));
    }
    Image image = draw_golden(golden, CHANGE_NONE);
    assert_true(image_write_png(picture, &image, NULL, 0, NULL));
    image_free(&image);
    print_message("accepted %s\n", picture);
}

static void keep_failure(const Golden *golden, const Image *expected, const Image *actual) {
    char path[512];
    Image difference = image_difference_picture(expected, actual);
    mkdir(FAILED, 0777);
    path_of(path, FAILED, golden->name, "-actual.png");
    image_write_png(path, actual, NULL, 0, NULL);
    path_of(path, FAILED, golden->name, "-difference.png");
    image_write_png(path, &difference, NULL, 0, NULL);
    image_free(&difference);
}

static Image read_golden(const Golden *golden) {
    char path[512];
    Image image;
    Error error = {0};
    path_of(path, GOLDEN, golden->name, ".png");
    if (!image_read_png(path, &image, &error)) {
        fail_msg("%s", error.text);
    }
    return image;
}

static void test_goldens(void **state) {
    (void)state;
    int failures = 0;
    for (int i = 0; i < GOLDEN_COUNT; i++) {
        if (accepting()) {
            accept_golden(&goldens[i]);
        }
        Image expected = read_golden(&goldens[i]), actual = draw_golden(&goldens[i], CHANGE_NONE);
        ImageDifference d = image_compare(&expected, &actual);
        if (!image_passes(&d)) {
            print_message("golden %s: PSNR %.1f dB, share %.3f %%, SSIM %.5f: see " FAILED "\n",
                          goldens[i].name, d.psnr, 100 * d.share, d.ssim);
            keep_failure(&goldens[i], &expected, &actual);
            failures++;
        }
        image_free(&expected);
        image_free(&actual);
    }
    assert_int_equal(failures, 0);
}

static void expect_failure(const Golden *golden, Change change) {
    Image expected = read_golden(golden), actual = draw_golden(golden, change);
    ImageDifference d = image_compare(&expected, &actual);
    if (image_passes(&d)) {
        fail_msg("golden %s passes with change %d: PSNR %.1f, share %.4f, SSIM %.5f", golden->name,
                 (int)change, d.psnr, d.share, d.ssim);
    }
    image_free(&expected);
    image_free(&actual);
}

static void test_changes_are_seen(void **state) {
    (void)state;
    for (int i = 0; i < GOLDEN_COUNT; i++) {
        expect_failure(&goldens[i], CHANGE_LIGHT);
        expect_failure(&goldens[i], CHANGE_CAMERA);
        expect_failure(&goldens[i], CHANGE_SIDE);
    }
    expect_failure(&goldens[1], CHANGE_WEAVE); /* the only one whose threads are seen */
}

/* A still surface of satin must have no facets: neighbouring pixels differ little. */
static void test_no_facets(void **state) {
    (void)state;
    Image image = draw_golden(&goldens[3], CHANGE_NONE);
    int steps = 0, counted = 0;
    for (int y = 70; y < 180; y++) { /* inside the cloth */
        for (int x = 165; x < 250; x++) {
            const uint8_t *p = image.rgba + IMAGE_CHANNELS * (y * WIDTH + x);
            steps += abs(p[0] - p[IMAGE_CHANNELS]) > 12;
            counted++;
        }
    }
    assert_true(steps * 1000 < counted);
    image_free(&image);
}

static int open_gl(void **state) {
    (void)state;
    Error error = {0};
    if (!gl_open(0, &error)) {
        print_message("%s\n", error.text);
        return 1;
    }
    print_message("%s\n", gl_describe());
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_goldens),
        cmocka_unit_test(test_changes_are_seen),
        cmocka_unit_test(test_no_facets),
    };
    return cmocka_run_group_tests(tests, open_gl, NULL);
}
