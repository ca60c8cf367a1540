/* compare from the side: photographs drawn by the renderer with cameras that are known, clean and with
 * the flaws of a camera; and requests that must be refused. TOLERANCES=1 shows what was reached. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/compare_side.h"
#include "tests/support/check.h"
#include "tests/support/render_states.h"
#include "tests/support/shell.h"

#define WIDTH 960
#define HEIGHT 720
#define POINTS 6
#define TEXT 64

static char folder[] = "/tmp/toile_test_side_XXXXXX";
static char program[4096], output[1 << 16], names[POINTS][TEXT];

static const char *in_folder(const char *name) {
    static char paths[4][4200];
    static int next = 0;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static int shell(const char *command) {
    char whole[16384];
    snprintf(whole, sizeof whole, "cd %s && ( %s ) 2>&1", folder, command);
    return shell_run(whole, output, sizeof output);
}

/* Marks on the table and on the floor around it, 2 m apart. */
static const Vec3 places[POINTS] = {{0.6, 0.0, 0.74},  {-0.6, 0.0, 0.74}, {0.0, -0.6, 0.74},
                                    {0.9, -0.5, 0.00}, {-0.9, -0.6, 0.0}, {0.0, 0.6, 0.74}};

typedef struct Case {
    const char *name, *filter; /* of ffmpeg; NULL: as it was drawn */
    const char *codec;         /* ending of the file */
    const char *look;
    Vec3 eye;
    double off;       /* [px] by which the points are off */
    double area, far; /* what is asked for: part of the area, mean distance of the outlines [px] */
} Case;

static const Case cases[] = {
    {"clean", NULL, "png", "teal-twill", {1.6, -2.6, 1.25}, 0.0, 0.005, 0.5},
    {"another side, velvet", NULL, "png", "velvet", {-2.8, -1.2, 1.0}, 0.0, 0.005, 0.5},
    {"points off by a pixel", NULL, "png", "teal-twill", {0.4, -3.2, 1.6}, 1.0, 0.015, 2.0},
    {"noise", "noise=alls=10:allf=t", "png", "teal-twill", {1.6, -2.6, 1.25}, 0.0, 0.015, 1.0},
    {"blur", "gblur=sigma=1.5", "png", "teal-twill", {1.6, -2.6, 1.25}, 0.0, 0.015, 1.0},
    {"jpeg", "null", "jpg", "teal-twill", {1.6, -2.6, 1.25}, 0.0, 0.015, 1.0},
};
#define CASES ((int)(sizeof cases / sizeof *cases))

static Film film_of(const Film *film, const Case *c) {
    Film view = *film;
    view.camera = CAMERA_PERSPECTIVE;
    view.eye = c->eye;
    view.target = vec3(0.05, 0.0, 0.42);
    view.up = vec3(0.03, 0.0, 1.0);
    view.fov = 0.62;
    return view;
}

/* Draws the photograph; false: there is no ffmpeg to spoil it. */
static bool take_photo(const Case *c, Camera *camera) {
    Run run;
    RunDef def = run_default();
    def.path = in_folder("table.states");
    assert_true(render_states_write("table", def.path, 20, 1, 40, c->look, true, NULL));
    assert_true(run_open(&run, &def, NULL));
    Film view = film_of(&state_header(run.reader)->film, c);
    *camera = camera_create(&view, WIDTH, HEIGHT, NULL, 0.0);
    run_close(&run);
    Image image = image_create(WIDTH, HEIGHT);
    Error error = {0};
    bool drawn = compare_draw_run(in_folder("table.states"), &view, 0, 1, &image, &error);
    assert_true(drawn || (printf("%s\n", error.text), false));
    assert_true(image_write_png(in_folder("drawn.png"), &image, NULL, 0, NULL));
    image_free(&image);
    char command[1024];
    snprintf(command, sizeof command,
             "ffmpeg -nostdin -v error -y -i drawn.png %s%s -q:v 6 photo.%s",
             c->filter ? "-vf " : "", c->filter ? c->filter : "", c->codec);
    return shell(c->filter ? command : "cp drawn.png photo.png") == 0;
}

static void mark(const Camera *camera, double off, CompareDef *def) {
    for (int i = 0; i < POINTS; i++) {
        double seen[3], turn = 2.4 * i;
        camera_see(camera, WIDTH, HEIGHT, places[i], seen);
        snprintf(names[i], TEXT, "%g,%g,%g=%.6f,%.6f", places[i].x, places[i].y, places[i].z,
                 seen[0] + off * cos(turn), seen[1] + off * sin(turn));
        def->points[i] = names[i];
    }
    def->point_count = POINTS;
    def->fit_camera = true;
}

static void check_case(const Case *c) {
    Camera camera;
    CompareFromSide compare;
    CompareDef def = compare_default();
    Error error = {0};
    char photo[64];
    if (!take_photo(c, &camera)) {
        printf("%s: not run, ffmpeg is missing\n", c->name);
        return;
    }
    snprintf(photo, sizeof photo, "photo.%s", c->codec);
    mark(&camera, c->off, &def);
    def.run = in_folder("table.states");
    def.photo = in_folder(photo);
    bool good = compare_from_side(&def, &compare, &error);
    assert_true(good || (printf("%s: %s\n", c->name, error.text), false));
    double eye = vec3_length(vec3_sub(compare.fit.camera.eye, camera.eye));
    double focal = compare.fit.focal * camera.half_y / (0.5 * HEIGHT) - 1.0;
    double area = compare.numbers.area[0] / compare.numbers.area[1] - 1.0;
    if (getenv("TOLERANCES")) {
        printf("%-24s eye %.2f mm, focal %.4f %%, area %+.3f %%, iou %.4f, outlines %.2f px, 95 %% "
               "%.2f, most %.2f, %s\n",
               c->name, 1e3 * eye, 100 * focal, 100 * area, compare.numbers.iou,
               compare.numbers.mean, compare.numbers.hausdorff95, compare.numbers.hausdorff,
               compare.segment.feature);
    }
    CHECK_AT_MOST(eye, c->off > 0 ? 4.0 * compare.fit.eye_unsure : 1e-4);
    CHECK_AT_MOST(fabs(focal), c->off > 0 ? 4.0 * compare.fit.focal_unsure : 1e-5);
    CHECK_AT_MOST(fabs(area), c->area);
    CHECK_AT_MOST(compare.numbers.mean, c->far);
    compare_from_side_free(&compare);
}

static void test_photographs(void **unused) {
    (void)unused;
    for (int i = 0; i < CASES; i++) {
        check_case(&cases[i]);
    }
}

/* Linen in the colour of its ground is refused, unless a mask tells where it is. */
static void test_pale_cloth(void **unused) {
    (void)unused;
    Case c = cases[0];
    Camera camera;
    CompareFromSide compare;
    CompareDef def = compare_default();
    Error error = {0};
    c.look = "linen";
    assert_true(take_photo(&c, &camera));
    mark(&camera, 0.0, &def);
    def.run = in_folder("table.states");
    def.photo = in_folder("drawn.png");
    assert_false(compare_from_side(&def, &compare, &error));
    assert_non_null(strstr(error.text, "cannot be measured"));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    Image mask = image_create(WIDTH, HEIGHT);
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++) {
        memset(mask.rgba + 4 * i, compare.run[i] >= 0.5f ? 255 : 0, 4);
    }
    compare_from_side_free(&compare);
    assert_true(image_write_png(in_folder("mask.png"), &mask, NULL, 0, NULL));
    image_free(&mask);
    def.mask = in_folder("mask.png");
    assert_true(compare_from_side(&def, &compare, &error));
    CHECK_AT_MOST(1.0 - compare.numbers.iou, 0.01);
    compare_from_side_free(&compare);
}

/* A cloth that hangs otherwise, 60 frames later, is told from the one in the photograph. */
static void test_difference_is_seen(void **unused) {
    (void)unused;
    Camera camera;
    CompareDef def = compare_default();
    double mean[2];
    assert_true(take_photo(&cases[0], &camera));
    mark(&camera, 0.0, &def);
    def.run = in_folder("table.states");
    def.photo = in_folder("photo.png");
    for (int i = 0; i < 2; i++) {
        CompareFromSide compare;
        assert_true(compare_from_side(&def, &compare, NULL));
        mean[i] = compare.numbers.mean;
        compare_from_side_free(&compare);
        assert_true(render_states_write("table", def.run, 80, 1, 40, cases[0].look, true, NULL));
    }
    CHECK_AT_MOST(mean[0], 0.25 * mean[1]);
}

static void expect(const char *arguments, int code, const char *words) {
    char command[4096 + 2048];
    snprintf(command, sizeof command, "%s compare table.states photo.png %s", program, arguments);
    int found = shell(command);
    if (found != code || !strstr(output, words)) {
        printf("%s: %d, %s\n", arguments, found, output);
    }
    assert_int_equal(found, code);
    assert_non_null(strstr(output, words));
}

static void test_program(void **unused) {
    (void)unused;
    Camera camera;
    CompareDef def = compare_default();
    char good[1024] = "--fit camera", few[1024], off[1200], line[1024] = "--fit camera";
    assert_true(take_photo(&cases[0], &camera));
    mark(&camera, 0.0, &def);
    for (int i = 0; i < POINTS; i++) {
        size_t used = strlen(good);
        snprintf(good + used, sizeof good - used, " --point %s", names[i]);
        snprintf(i == 2 ? few : off, sizeof few, "%s", good);
    }
    for (int i = 0; i < 5; i++) {
        double seen[3];
        camera_see(&camera, WIDTH, HEIGHT, vec3(0.2 * i - 0.4, 0, 0.74), seen);
        size_t used = strlen(line);
        snprintf(line + used, sizeof line - used, " --point %g,0,0.74=%.3f,%.3f", 0.2 * i - 0.4,
                 seen[0], seen[1]);
    }
    expect(good, 0, "common part over both");
    snprintf(off, sizeof off, "%s --json -o out", good);
    expect(off, 0, "\"schema\": \"toile-compare-side-1\"");
    assert_int_equal(shell("python3 -m json.tool out/compare.json"), 0);
    Image overlay, strip;
    assert_true(image_read_png(in_folder("out/overlay.png"), &overlay, NULL));
    assert_true(image_read_png(in_folder("out/side-by-side.png"), &strip, NULL));
    assert_int_equal(overlay.width, WIDTH);
    assert_int_equal(strip.width, 3 * WIDTH + 16);
    image_free(&overlay);
    image_free(&strip);
    expect(few, EXIT_BAD_INPUT, "3 points; a camera is found from 4");
    expect(line, EXIT_BAD_INPUT, "on a line");
    snprintf(off, sizeof off, "%s --point 0,0,0.74=30,700", good);
    expect(off, EXIT_BAD_INPUT, "no camera sees the points where they are");
    snprintf(off, sizeof off, "%s --point 0,0,0.74=30000,700", good);
    expect(off, EXIT_BAD_INPUT, "outside the picture");
    expect("--fit camera --point food.middle=3,4", EXIT_USAGE, "did you mean 'foot'");
    expect("--fit camera --point foot.corner=3,4", EXIT_USAGE, "expected foot.middle");
    expect("--fit camera --point foot.middle=3", EXIT_USAGE, "expected NAME=X,Y in pixels");
    expect("--fit focus", EXIT_USAGE, "--fit focus: expected camera");
    expect("--fit camera", EXIT_BAD_INPUT, "0 points");
}

int main(int argc, char **argv) {
    (void)argc;
    char *absolute = realpath(argv[0], NULL),
         *slash = absolute ? strstr(absolute, "/tests/") : NULL;
    if (!slash || !mkdtemp(folder)) {
        fprintf(stderr, "must be started as build/CONFIG/tests/test_compare_side\n");
        return 1;
    }
    snprintf(program, sizeof program, "%.*s/toile-render", (int)(slash - absolute), absolute);
    free(absolute);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_photographs),
        cmocka_unit_test(test_pale_cloth),
        cmocka_unit_test(test_difference_is_seen),
        cmocka_unit_test(test_program),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
