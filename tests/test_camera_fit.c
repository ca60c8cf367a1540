/* camera_fit: cameras that are known, seen from the pixels of a few points; and points that tell
 * nothing. TOLERANCES=1 shows what was reached. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/camera_fit.h"
#include "tests/support/check.h"

#define WIDTH 1280
#define HEIGHT 960
#define CASES 100
#define CORNERS 8

static unsigned lot = 1;

static double draw(void) { /* 0..1 */
    lot = lot * 1664525u + 1013904223u;
    return (lot >> 8) / 16777216.0;
}

static double normal(void) { /* sum of twelve: mean 0, deviation 1 */
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        sum += draw();
    }
    return sum;
}

static Camera camera_at_place(Vec3 eye, Vec3 target, double roll, double focal) {
    Camera camera = {.perspective = true, .eye = eye, .target = target};
    camera.forward = vec3_unit(vec3_sub(target, eye), vec3(0, 1, 0));
    Vec3 right = vec3_unit(vec3_cross(camera.forward, vec3(0, 0, 1)), vec3(1, 0, 0));
    Vec3 up = vec3_cross(right, camera.forward);
    camera.right = vec3_axpy(vec3_scale(cos(roll), right), sin(roll), up);
    camera.up = vec3_cross(camera.right, camera.forward);
    camera.half_x = 0.5 * WIDTH / focal;
    camera.half_y = 0.5 * HEIGHT / focal;
    return camera;
}

/* A side photograph: 1 to 4 m away, a little above, hardly rolled, aimed beside the middle. */
static Camera draw_camera(void) {
    double azimuth = 2 * PI * draw(), height = 0.1 + 0.6 * draw(), far = 1.2 + 2.8 * draw();
    Vec3 target = vec3(0.1 * draw() - 0.05, 0.1 * draw() - 0.05, 0.15 + 0.1 * draw());
    Vec3 eye = vec3_axpy(target, far,
                         vec3(cos(height) * cos(azimuth), cos(height) * sin(azimuth), sin(height)));
    return camera_at_place(eye, target, 0.2 * (draw() - 0.5), WIDTH * far * (0.6 + 0.5 * draw()));
}

/* Corners of a pedestal of 40 x 30 x 40 cm that stands in the middle. */
static Vec3 corner(int i) {
    return vec3(i & 1 ? 0.2 : -0.2, i & 2 ? 0.15 : -0.15, i & 4 ? 0.4 : 0.0);
}

static void mark(const Camera *camera, Vec3 place, double noise, CameraPoint *point) {
    double seen[3];
    camera_see(camera, WIDTH, HEIGHT, place, seen);
    *point = (CameraPoint){.place = place};
    point->x = seen[0] + noise * normal(), point->y = seen[1] + noise * normal();
    snprintf(point->name, sizeof point->name, "%.2f,%.2f,%.2f", place.x, place.y, place.z);
}

static int mark_corners(const Camera *camera, int count, double noise, CameraPoint *points) {
    static const int order[CORNERS] = {4, 5, 6, 0, 7, 1, 2, 3}; /* the first four: not in a plane */
    for (int i = 0; i < count; i++) {
        mark(camera, corner(order[i]), noise, &points[i]);
    }
    return count;
}

static bool fit_to(const CameraPoint *points, int count, CameraFit *fit, Error *error) {
    Vec3 watched[CORNERS];
    for (int i = 0; i < CORNERS; i++) {
        watched[i] = vec3_scale(1.1, corner(i));
    }
    return camera_fit(points, count, watched, CORNERS, WIDTH, HEIGHT, fit, error);
}

static double turn_between(const Camera *a, const Camera *b) {
    double trace =
        vec3_dot(a->right, b->right) + vec3_dot(a->up, b->up) + vec3_dot(a->forward, b->forward);
    return acos(fmax(-1.0, fmin(1.0, 0.5 * (trace - 1.0))));
}

/* Exact pixels of four to eight points give the camera back, or the fit says that two cameras or a
 * range of them would. */
static void test_exact(void **unused) {
    (void)unused;
    int refused[CORNERS + 1] = {0};
    double eye = 0.0, turn = 0.0, focal = 0.0;
    for (int i = 0; i < CASES; i++) {
        Camera camera = draw_camera();
        CameraPoint points[CORNERS];
        CameraFit fit;
        Error error = {0};
        int count = mark_corners(&camera, CAMERA_FIT_LEAST + i % 5, 0.0, points);
        if (!fit_to(points, count, &fit, &error)) {
            refused[count]++;
            assert_int_equal(error.code, EXIT_BAD_INPUT);
            continue;
        }
        eye = fmax(eye, vec3_length(vec3_sub(fit.camera.eye, camera.eye)));
        turn = fmax(turn, turn_between(&fit.camera, &camera));
        focal = fmax(focal, fabs(fit.focal / (0.5 * WIDTH / camera.half_x) - 1.0));
        CHECK_AT_MOST(fit.missed, 1e-6);
    }
    if (getenv("TOLERANCES")) {
        printf("refused of 20: %d of 4 points, %d of 5, %d of 6, %d of 7, %d of 8\n", refused[4],
               refused[5], refused[6], refused[7], refused[8]);
    }
    CHECK_AT_MOST(eye, 1e-5); /* [m] */
    CHECK_AT_MOST(turn, 1e-6);
    CHECK_AT_MOST(focal, 1e-5);
    assert_true(refused[4] <=
                20 / 3); /* a tripod of corners far away is seen alike from two places */
    assert_int_equal(refused[5] + refused[6] + refused[7] + refused[8], 0);
}

/* With points off by a pixel the true camera lies where the fit says it may: the mean square of
 * the error over its deviation is 1. */
static void test_noise(void **unused) {
    (void)unused;
    double squares[2] = {0, 0}, worst = 0.0;
    int count = 0;
    for (int i = 0; i < CASES; i++) {
        Camera camera = draw_camera();
        CameraPoint points[CORNERS];
        CameraFit fit;
        if (!fit_to(points, mark_corners(&camera, 7, 1.0, points), &fit, NULL)) {
            continue;
        }
        double pixel = fmax(CAMERA_FIT_PIXEL, fit.missed);
        double eye = vec3_length(vec3_sub(fit.camera.eye, camera.eye)) / (fit.eye_unsure / pixel);
        double focal = log(fit.focal / (0.5 * WIDTH / camera.half_x)) / (fit.focal_unsure / pixel);
        squares[0] += eye * eye, squares[1] += focal * focal;
        worst = fmax(worst, eye);
        count++;
    }
    if (getenv("TOLERANCES")) {
        printf("%d of %d: eye %.2f deviations (worst %.1f), focal length %.2f\n", count, CASES,
               sqrt(squares[0] / count), worst, sqrt(squares[1] / count));
    }
    assert_true(count >= CASES * 9 / 10);
    for (int k = 0; k < 2; k++) { /* five deviations of a mean of so many squares */
        CHECK_NEAR(squares[k] / count, 1.0, 5.0 * sqrt(2.0 / count));
    }
}

static void expect_refusal(const CameraPoint *points, int count, const char *words) {
    CameraFit fit;
    Error error = {0};
    assert_false(fit_to(points, count, &fit, &error));
    if (!strstr(error.text, words)) {
        printf("expected '%s', found '%s'\n", words, error.text);
    }
    assert_non_null(strstr(error.text, words));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
}

static void test_refusals(void **unused) {
    (void)unused;
    Camera camera = camera_at_place(vec3(1.2, -1.6, 0.8), vec3(0, 0, 0.2), 0.05, 1500);
    CameraPoint points[CORNERS];
    mark_corners(&camera, CORNERS, 0.0, points);
    expect_refusal(points, 3, "3 points; a camera is found from 4");
    points[2].x += 150.0; /* another corner */
    expect_refusal(points, CORNERS, "no camera sees the points where they are");
    mark_corners(&camera, CORNERS, 0.0, points);
    points[1].x = WIDTH + 300.0;
    expect_refusal(points, CORNERS, "outside the picture");
    for (int i = 0; i < 5; i++) { /* along an edge */
        mark(&camera, vec3(0.2, -0.15, 0.1 * i), 0.0, &points[i]);
    }
    expect_refusal(points, 5, "on a line");
    for (int i = 0; i < 5; i++) { /* all within a millimetre, off by half a pixel */
        mark(&camera, vec3(0.2 + 1e-3 * draw(), 1e-3 * draw(), 0.2 + 1e-3 * draw()), 0.5,
             &points[i]);
    }
    expect_refusal(points, 5, "the points do not tell where the camera is");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
