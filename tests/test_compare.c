/* compare: photographs that nobody took, of drapes whose outline is known. Painted ones (tests/support/
 * photos.h) and some drawn by the renderer, clean and with every flaw of a camera; and pictures that
 * must be refused. TOLERANCES=print shows what was reached. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/compare.h"
#include "render/drape_parts.h"
#include "render/video.h"
#include "tests/support/check.h"
#include "tests/support/photos.h"
#include "tests/support/shell.h"

#define DEGREE (PI / 180.0)

static char folder[] = "/tmp/toile_test_compare_XXXXXX";
static char program[4096], text[1 << 16];

static const char *in_folder(const char *name) {
    static char paths[4][4200];
    static int next = 0;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

/* No symmetry: one turn fits, one face fits. */
static DrapeShape shape_of(int folds) {
    DrapeShape shape = drape_shape_default();
    shape.a[6] = 0.0;
    shape.a[folds] = 0.009;
    shape.b[2] = 0.003;
    shape.a[3] = 0.0025;
    shape.b[folds + 1] = 0.002;
    shape.warp = 0.4;
    shape.rings = 24;
    return shape;
}

/* ---- painted photographs ---- */

typedef struct Case {
    const char *name;
    int folds;
    double camera_height;
    double turn;
    bool mirrored;
    double x, y, scale; /* 0: the default */
    PhotoGround pattern;
    double gradient, vignette, shadow, noise, blur;
    int jpeg;                   /* ffmpeg's scale, 6 is about quality 60; 0: PNG */
    double cloth[3], ground[3]; /* 0 0 0: the default */
    bool flat_light;            /* hardly any light and shade on the folds */
    bool bare;                  /* no plate: the disc is given */
} Case;

#define FAR INFINITY

#define CASE(text, count, height, angle, ...)                                                      \
    { .name = text, .folds = count, .camera_height = height, .turn = angle, __VA_ARGS__ }

static const Case clean[] = {
    CASE("infinity", 6, FAR, 0.0, .x = 0),
    CASE("turned", 6, FAR, 1.234, .x = 0),
    CASE("mirrored", 6, FAR, 2.5, .mirrored = true),
    CASE("from 1 m", 6, 1.0, -0.7, .x = 0),
    CASE("from 60 cm", 5, 0.6, 0.3, .x = 0),
    CASE("from 2 m, mirrored", 7, 2.0, 3.0, .mirrored = true),
    CASE("four folds", 4, 1.0, 0.9, .x = 0),
    CASE("eight folds", 8, 1.0, 0.2, .x = 0),
    CASE("bare", 6, 1.0, 0.5, .bare = true),
    CASE("off-centre", 6, FAR, 0.5, .x = 308, .y = 264),
    CASE("pale cloth", 6, 1.0, 0.1, .cloth = {0.7, 0.68, 0.62}, .ground = {0.12, 0.12, 0.13}),
};
static const Case degraded[] = {
    CASE("noise", 6, 1.0, 0.5, .noise = 4),
    CASE("blur", 6, 1.0, 0.5, .blur = 1.5),
    CASE("vignette", 6, 1.0, 0.5, .vignette = 0.4),
    CASE("gradient", 6, 1.0, 0.5, .gradient = 0.3),
    CASE("jpeg", 6, 1.0, 0.5, .jpeg = 6),
    CASE("shadow", 6, 1.0, 0.5, .shadow = 0.45),
    CASE("stripes", 6, 1.0, 0.5, .pattern = GROUND_STRIPES),
    CASE("woven", 6, 1.0, 0.5, .pattern = GROUND_WOVEN),
    CASE("grey, 15 % darker", 6, 1.0, 0.5, .flat_light = true, .noise = 1.5,
         .cloth = {0.40, 0.40, 0.40}, .ground = {0.47, 0.47, 0.47}),
    CASE("grey, 15 % lighter", 5, 1.0, 0.5, .flat_light = true, .noise = 1.5,
         .cloth = {0.54, 0.54, 0.54}, .ground = {0.47, 0.47, 0.47}),
    CASE("5 px/cm", 6, 1.0, 0.5, .x = 175, .y = 175, .scale = 500),
    CASE("16 px/cm, noise", 7, 1.0, 0.5, .noise = 6, .blur = 1),
    CASE("all of it", 6, 1.0, 0.5, .mirrored = true, .x = 292, .y = 272, .pattern = GROUND_WOVEN,
         .gradient = 0.2, .vignette = 0.3, .shadow = 0.4, .noise = 4, .blur = 1, .jpeg = 6),
    CASE("all of it, five folds", 5, 0.8, 2.2, .x = 272, .y = 288, .scale = 1520,
         .pattern = GROUND_STRIPES, .gradient = -0.2, .vignette = 0.2, .shadow = 0.4, .noise = 3,
         .blur = 0.8, .jpeg = 6),
};
#define COUNT(cases) ((int)(sizeof cases / sizeof *cases))

static PhotoDef photo_of(const Case *c) {
    PhotoDef photo = photo_default();
    photo.camera_height = c->camera_height;
    photo.turn = c->turn;
    photo.mirrored = c->mirrored;
    photo.scale = c->scale > 0 ? c->scale : photo.scale;
    photo.x = c->x > 0 ? c->x : photo.x;
    photo.y = c->y > 0 ? c->y : photo.y;
    if (c->scale == 500) {
        photo.width = photo.height = 350; /* the table lies in its middle */
    }
    photo.pattern = c->pattern;
    photo.gradient = c->gradient;
    photo.vignette = c->vignette;
    photo.shadow = c->shadow;
    photo.noise = c->noise;
    photo.blur = c->blur;
    photo.plated = !c->bare;
    photo.relief = c->flat_light ? 0.03 : photo.relief;
    for (int k = 0; k < 3; k++) {
        photo.cloth[k] = c->cloth[0] > 0 ? c->cloth[k] : photo.cloth[k];
        photo.ground[k] = c->ground[0] > 0 ? c->ground[k] : photo.ground[k];
    }
    return photo;
}

/* Writes it; false when JPEG is asked for and there is no ffmpeg. */
static bool write_photo(const Image *image, int jpeg, char path[4200]) {
    snprintf(path, 4200, "%s/photo.png", folder);
    assert_true(image_write_png(path, image, NULL, 0, NULL));
    if (jpeg == 0) {
        return true;
    }
    char command[9000];
    snprintf(command, sizeof command,
             "ffmpeg -nostdin -v error -y -i %s/photo.png -q:v %d %s/photo.jpg 2>&1", folder, jpeg,
             folder);
    snprintf(path, 4200, "%s/photo.jpg", folder);
    return shell_run(command, text, sizeof text) == 0;
}

/* What the photograph shows, exactly. */
static CompareSide truth_of(const DrapeShape *shape, const PhotoDef *photo, const Drape *drape) {
    CompareSide truth = {.dc = 0};
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        truth.r[i] = photo_outline(shape, photo, 2 * PI * i / CONTOUR_RAYS);
    }
    drape_measure_outline(truth.r, drape->specimen, &truth.harmonics, &truth.nodes,
                          &truth.nodes_most, &truth.nodes_least);
    truth.dc = 100 * (contour_area(truth.r) - drape->area_disc) /
               (drape->area_specimen - drape->area_disc);
    return truth;
}

static double rms_of(const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        sum += (a[i] - b[i]) * (a[i] - b[i]) / CONTOUR_RAYS;
    }
    return sqrt(sum);
}

static bool run_case(const Case *c, Compare *compare, CompareSide *truth) {
    DrapeShape shape = shape_of(c->folds);
    PhotoDef photo = photo_of(c);
    char path[4200];
    /* the states are of a table without a plate: camera and table agree in its height */
    assert_true(drape_shape_write(&shape, in_folder("run.states")));
    Image image = photo_paint(&shape, &photo);
    bool written = write_photo(&image, c->jpeg, path);
    image_free(&image);
    if (!written) {
        printf("SKIPPED: %s: ffmpeg is not installed\n", c->name);
        return false;
    }
    CompareDef def = compare_default();
    def.run = in_folder("run.states");
    def.photo = path;
    def.drape.camera_height = c->camera_height;
    if (c->bare) {
        def.disc[0] = photo.x, def.disc[1] = photo.y;
        def.disc[2] = 2 * shape.support * photo.scale;
    }
    Error error = {0};
    bool good = compare_photo(&def, compare, &error);
    assert_true(good || (printf("%s: %s\n", c->name, error.text), false));
    *truth = truth_of(&shape, &photo, &compare->drape);
    return true;
}

/* The turn of the run in the photograph: theta = theta_run + turn, mirrored -theta_run + turn. */
static double turn_error(const Case *c, const Compare *compare) {
    double off = compare->rotation - c->turn;
    return fabs(off - 2 * PI * round(off / (2 * PI)));
}

static void check_case(const Case *c, double dc, double rms) {
    Compare compare;
    CompareSide truth;
    if (!run_case(c, &compare, &truth)) {
        return;
    }
    double off = rms_of(compare.photo.r, truth.r) / compare.drape.specimen;
    if (getenv("TOLERANCES")) {
        printf("%-24s dc %+.3f points, outline %.3f %%, run %.3f %%, turn %.2f deg, %d nodes, %s\n",
               c->name, compare.photo.dc - truth.dc, 100 * off,
               100 * compare.rms / compare.drape.specimen, turn_error(c, &compare) / DEGREE,
               compare.photo.nodes.count, compare.segment.feature);
    }
    CHECK_NEAR(compare.photo.dc, truth.dc, dc);
    CHECK_NEAR(compare.run.dc, truth.dc, 0.3);
    CHECK_AT_MOST(off, rms);
    CHECK_AT_MOST(compare.rms / compare.drape.specimen, rms + 0.002);
    assert_int_equal(compare.photo.nodes.count, truth.nodes.count);
    assert_int_equal(compare.run.nodes.count, truth.nodes.count);
    assert_int_equal(compare.mirrored, c->mirrored);
    CHECK_AT_MOST(turn_error(c, &compare) / DEGREE, 0.5);
    CHECK_AT_MOST(fabs(compare.iou - 1.0), 4 * rms + 0.01);
    assert_true(compare.mean <= compare.hausdorff95 && compare.hausdorff95 <= compare.hausdorff);
    compare_free(&compare);
}

static void test_clean(void **unused) {
    (void)unused;
    for (int i = 0; i < COUNT(clean); i++) {
        check_case(&clean[i], 0.3, 0.003);
    }
}

static void test_degraded(void **unused) {
    (void)unused;
    for (int i = 0; i < COUNT(degraded); i++) {
        check_case(&degraded[i], 1.5, 0.015);
    }
}

/* Number i of a hundred drapes of 4 to 8 folds, with flaws drawn by lot. */
static void draw_lot(int i, DrapeShape *shape, PhotoDef *photo) {
    unsigned lot = 12345u + 7919u * (unsigned)i;
    double lots[12];
    for (int k = 0; k < 12; k++) {
        lot = lot * 1664525u + 1013904223u;
        lots[k] = (lot >> 8) / 16777216.0;
    }
    *shape = shape_of(4 + i % 5);
    shape->a[0] = 0.113 + 0.012 * lots[0];
    shape->a[4 + i % 5] = 0.006 + 0.005 * lots[1];
    *photo = photo_default();
    photo->width = photo->height = 360;
    photo->scale = 950 + 120 * lots[2];
    photo->x = 180 + 16 * (lots[3] - 0.5);
    photo->y = 180 + 16 * (lots[4] - 0.5);
    photo->turn = 6.28 * lots[5];
    photo->camera_height = 0.6 + 1.4 * lots[6];
    photo->noise = 4 * lots[7];
    photo->blur = 0.4 + 0.8 * lots[8];
    photo->gradient = 0.6 * (lots[9] - 0.5);
    photo->vignette = 0.3 * lots[10];
    photo->shadow = i % 3 == 0 ? 0.4 * lots[11] : 0.0;
    photo->pattern = i % 4 == 1 ? GROUND_WOVEN : i % 4 == 2 ? GROUND_STRIPES : GROUND_PLAIN;
    photo->seed = lot;
}

/* False: refused. *off: error of the drape coefficient; *right: as many nodes as it shows. */
static bool measure_lot(const DrapeShape *shape, const PhotoDef *photo, double *off, bool *right) {
    Drape sizes = {.specimen = 0.15, .area_specimen = PI * 0.0225, .area_disc = PI * 0.0081};
    Image image = photo_paint(shape, photo);
    SegmentDef def = {.threshold = NAN, .x = 180, .y = 180};
    Segment segment;
    SegmentDisc disc;
    bool cut = segment_photo(&image, &def, &segment, NULL);
    bool good = cut && segment_find_disc(&image, &segment, &disc);
    if (good) {
        CompareSide truth = truth_of(shape, photo, &sizes), found;
        Contour contour = segment_trace(&image, &segment, disc.x, disc.y);
        for (int k = 0; k < CONTOUR_RAYS; k++) {
            found.r[k] = contour.r[k] * shape->support / disc.radius;
        }
        drape_measure_outline(found.r, 0.15, &found.harmonics, &found.nodes, &found.nodes_most,
                              &found.nodes_least);
        found.dc = 100 * (contour_area(found.r) - sizes.area_disc) /
                   (sizes.area_specimen - sizes.area_disc);
        *off = found.dc - truth.dc;
        *right = found.nodes.count == truth.nodes.count;
    }
    if (cut) {
        segment_free(&segment);
    }
    image_free(&image);
    return good;
}

/* The coefficient within 1.5 points of the one that the photograph shows, the nodes right in 95. */
static void test_hundred(void **unused) {
    (void)unused;
    int right = 0, measured = 0;
    double worst = 0.0;
    for (int i = 0; i < 100; i++) {
        DrapeShape shape;
        PhotoDef photo;
        double off = 0.0;
        bool nodes = false;
        draw_lot(i, &shape, &photo);
        measured += measure_lot(&shape, &photo, &off, &nodes);
        right += nodes;
        worst = fmax(worst, fabs(off));
    }
    if (getenv("TOLERANCES")) {
        printf("%d measured, %d with the right nodes, worst coefficient off by %.2f\n", measured,
               right, worst);
    }
    CHECK_AT_MOST(worst, 1.5);
    assert_true(right >= 95);
}

/* ---- drawn photographs ---- */

static int shell(const char *command) {
    char whole[16384];
    snprintf(whole, sizeof whole, "cd %s && ( %s ) 2>&1", folder, command);
    return shell_run(whole, text, sizeof text);
}

/* The renderer's own lights, shadows, weave; the same run compared with its picture. */
static void check_drawn(const char *name, const DrapeShape *shape, double dc, double rms) {
    char command[9000];
    assert_true(drape_shape_write(shape, in_folder("drawn.states")));
    snprintf(command, sizeof command,
             "%s render drawn.states -o drawn.png --frames 1 --size 720x720 --force --quiet",
             program);
    assert_int_equal(shell(command), 0);
    CompareDef def = compare_default();
    Compare compare;
    Error error = {0};
    def.run = in_folder("drawn.states");
    def.photo = in_folder("drawn.png");
    def.drape.camera_height = shape->camera_height;
    bool good = compare_photo(&def, &compare, &error);
    assert_true(good || (printf("%s: %s\n", name, error.text), false));
    if (getenv("TOLERANCES")) {
        printf("%-24s dc %+.3f points, outline %.3f %%, %s\n", name,
               compare.photo.dc - compare.run.dc, 100 * compare.rms / compare.drape.specimen,
               compare.segment.feature);
    }
    CHECK_NEAR(compare.photo.dc, compare.run.dc, dc);
    CHECK_AT_MOST(compare.rms / compare.drape.specimen, rms);
    assert_int_equal(compare.photo.nodes.count, compare.run.nodes.count);
    compare_free(&compare);
}

static void test_drawn(void **unused) {
    (void)unused;
    DrapeShape shape = shape_of(6);
    shape.plate = "wood";
    shape.camera_height = 1.0;
    shape.look = "teal-twill";
    check_drawn("twill from 1 m", &shape, 0.3, 0.003);
    shape.camera_height = INFINITY;
    check_drawn("twill from infinity", &shape, 0.3, 0.003);
    shape.camera_height = 0.7;
    shape.look = "velvet";
    shape.plate = "metal";
    check_drawn("velvet from 70 cm", &shape, 0.3, 0.003);
    shape.camera_shift[0] = 0.02;
    shape.look = "felt";
    shape.plate = "wood";
    check_drawn("felt, off-centre", &shape, 0.3, 0.003);
    shape.camera_shift[0] = 0.0;
    shape.camera_height = 1.0;
    shape.tilt = 5 * DEGREE;
    check_drawn("tilted by 5 deg", &shape, 1.5, 0.04);
}

/* ---- what is refused ---- */

static void expect_refusal(const Image *image, const char *arguments, int code, const char *words) {
    char command[9000];
    assert_true(image_write_png(in_folder("bad.png"), image, NULL, 0, NULL));
    snprintf(command, sizeof command, "%s compare run.states bad.png %s", program, arguments);
    int found = shell(command);
    if (found != code || !strstr(text, words)) {
        printf("%s: %d, %s\n", words, found, text);
    }
    assert_int_equal(found, code);
    assert_non_null(strstr(text, words));
}

static void test_refusals(void **unused) {
    (void)unused;
    DrapeShape shape = shape_of(6);
    PhotoDef photo = photo_default();
    assert_true(drape_shape_write(&shape, in_folder("run.states")));
    photo.x = 150; /* cut off */
    Image image = photo_paint(&shape, &photo);
    expect_refusal(&image, "--photo-disc 150,280,288", EXIT_BAD_INPUT,
                   "cut off by the picture's edge");
    image_free(&image);
    photo = photo_default();
    for (int k = 0; k < 3; k++) { /* cloth like its ground */
        photo.cloth[k] = photo.ground[k];
    }
    photo.plated = false;
    photo.noise = 4;
    image = photo_paint(&shape, &photo);
    expect_refusal(&image, "--photo-disc 280,280,288", EXIT_BAD_INPUT, "cannot be measured");
    image_free(&image);
    image = image_create(300, 300); /* noise alone, black alone */
    expect_refusal(&image, "--photo-disc 150,150,80", EXIT_BAD_INPUT, "cannot be measured");
    unsigned lot = 3;
    for (int i = 0; i < 4 * 300 * 300; i++) {
        lot = lot * 1664525u + 1013904223u;
        image.rgba[i] = (uint8_t)(i % 4 == 3 ? 255 : lot >> 24);
    }
    expect_refusal(&image, "--photo-disc 150,150,80", EXIT_BAD_INPUT, "cannot be measured");
    image_free(&image);
    image = image_create(1, 1);
    expect_refusal(&image, "", EXIT_BAD_INPUT, "too small");
    image_free(&image);
    photo = photo_default();
    photo.plated = false; /* nothing tells where the table is */
    image = photo_paint(&shape, &photo);
    expect_refusal(&image, "", EXIT_USAGE, "--photo-disc");
    expect_refusal(&image, "--photo-disc 10,10,300", EXIT_BAD_INPUT, "bad.png");
    expect_refusal(&image, "--photo-disc 1,2", EXIT_USAGE, "expected X,Y,DIAMETER");
    expect_refusal(&image, "--camera-height -1m", EXIT_USAGE, "--camera-height");
    image_free(&image);
    assert_int_equal(shell("head -c 5000 photo.png > torn.png"), 0);
    char command[9000];
    snprintf(command, sizeof command, "%s compare run.states torn.png", program);
    assert_int_equal(shell(command), EXIT_BAD_INPUT);
    snprintf(command, sizeof command, "%s compare run.states none.jpg", program);
    assert_int_equal(shell(command), EXIT_MISSING_INPUT);
}

/* A plate that is an ellipse: 1 to 1.05. */
static void test_tilt_is_seen(void **unused) {
    (void)unused;
    DrapeShape shape = shape_of(6);
    PhotoDef photo = photo_default();
    Image image = photo_paint(&shape, &photo), flat = video_resize(&image, 560, 532);
    expect_refusal(&flat, "", EXIT_BAD_INPUT, "the camera is tilted");
    image_free(&image);
    image_free(&flat);
}

/* ---- the program ---- */

static void test_program(void **unused) {
    (void)unused;
    DrapeShape shape = shape_of(6);
    PhotoDef photo = photo_default();
    char command[9000];
    photo.camera_height = 1.0;
    assert_true(drape_shape_write(&shape, in_folder("run.states")));
    Image image = photo_paint(&shape, &photo), mask = image_create(560, 560);
    assert_true(image_write_png(in_folder("photo.png"), &image, NULL, 0, NULL));
    snprintf(
        command, sizeof command,
        "%s compare run.states photo.png --camera-height 100cm --json -o out > one.json && "
        "python3 -m json.tool one.json > /dev/null && cmp one.json out/compare.json && wc -l < "
        "out/contours.csv",
        program);
    assert_int_equal(shell(command), 0);
    assert_string_equal(text, "721\n");
    Image overlay, strip;
    assert_true(image_read_png(in_folder("out/overlay.png"), &overlay, NULL));
    assert_true(image_read_png(in_folder("out/side-by-side.png"), &strip, NULL));
    assert_int_equal(overlay.width, 560);
    assert_int_equal(strip.width, 3 * 560 + 16);
    image_free(&overlay);
    image_free(&strip);
    snprintf(command, sizeof command, "%s compare run.states photo.png", program);
    assert_int_equal(shell(command), 0);
    assert_non_null(strstr(text, "the height of the camera is not known"));
    /* a mask instead of a guess */
    for (int i = 0; i < 560 * 560; i++) {
        double x = i % 560 + 0.5 - 280, y = 280 - (i / 560 + 0.5);
        double r = 1600 * photo_outline(&shape, &photo, atan2(y, x));
        memset(mask.rgba + 4 * i, hypot(x, y) < r ? 255 : 0, 4);
    }
    assert_true(image_write_png(in_folder("mask.png"), &mask, NULL, 0, NULL));
    snprintf(command, sizeof command,
             "%s compare run.states photo.png --camera-height 1m --mask mask.png --photo-scale 16 "
             "--photo-centre 280,280",
             program);
    assert_int_equal(shell(command), 0);
    assert_non_null(strstr(text, "cloth told by              mask"));
    const char *rms = strstr(text, "rms along rays   ");
    assert_non_null(rms);
    CHECK_AT_MOST(atof(rms + 17), 0.45); /* [mm] 0.3 % of 15 cm */
    image_free(&image);
    image_free(&mask);
}

int main(int argc, char **argv) {
    (void)argc;
    char *absolute = realpath(argv[0], NULL),
         *slash = absolute ? strstr(absolute, "/tests/") : NULL;
    if (!slash || !mkdtemp(folder)) {
        fprintf(stderr, "test_compare: must be started as build/CONFIG/tests/test_compare\n");
        return 1;
    }
    snprintf(program, sizeof program, "%.*s/toile-render", (int)(slash - absolute), absolute);
    free(absolute);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_clean),    cmocka_unit_test(test_degraded),
        cmocka_unit_test(test_hundred),  cmocka_unit_test(test_drawn),
        cmocka_unit_test(test_refusals), cmocka_unit_test(test_tilt_is_seen),
        cmocka_unit_test(test_program),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
