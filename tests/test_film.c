/* What a film asks for: cameras that move, motion blur, titles; and its way through the states. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/between.h"
#include "render/command.h"
#include "render/overlay.h"
#include "render/video.h"
#include "sim/base/hash.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/render_states.h"

#define WIDTH 320
#define HEIGHT 180
#define FRAMES 6

/* ---- the camera ---- */

static Film moving_film(void) {
    Film film = film_default();
    film.camera = CAMERA_PERSPECTIVE;
    film.eye = vec3(0, -2, 1);
    film.floor_height = -1;
    film.frame_count = 60;
    return film;
}

static void check_near_vec(Vec3 a, Vec3 b, double tolerance) {
    CHECK_AT_MOST(vec3_length(vec3_sub(a, b)), tolerance);
}

static void test_orbit(void **state) {
    (void)state;
    Film film = moving_film();
    film.move = (FilmMove){.orbit = 2 * PI, .orbit_begin = 1, .orbit_end = 3};
    Camera start = camera_create(&film, WIDTH, HEIGHT, NULL, -1);
    assert_true(camera_moves(&film));
    check_near_vec(camera_at(&film, &start, 0.5, vec3(0, 0, 0)).eye, film.eye, 1e-15);
    check_near_vec(camera_at(&film, &start, 2.0, vec3(0, 0, 0)).eye, vec3(0, 2, 1), 1e-12);
    check_near_vec(camera_at(&film, &start, 9.0, vec3(0, 0, 0)).eye, film.eye, 1e-12);
    for (int i = 0; i <= 20; i++) { /* the target stays in the middle, as far away as ever */
        Camera camera = camera_at(&film, &start, 1 + 0.1 * i, vec3(0, 0, 0));
        CHECK_NEAR(vec3_length(vec3_sub(camera.eye, camera.target)), sqrt(5.0), 1e-12);
        check_near_vec(vec3_axpy(camera.eye, sqrt(5.0), camera.forward), film.target, 1e-12);
        CHECK_NEAR(vec3_dot(camera.right, camera.forward), 0, 1e-14);
        CHECK_NEAR(camera.floor_height, -1, 0);
    }
}

static void test_keys(void **state) {
    (void)state;
    Film film = moving_film();
    film.move.key_count = 4;
    for (int i = 0; i < 4; i++) {
        double t = 0.4 * i + 0.1 * i * i;
        film.move.keys[i] =
            (FilmKey){t, vec3(1 - t, -2 + 3 * t, 1), vec3(0.1 * i * i, 0, 0.2), 0.4 + 0.05 * i};
    }
    Camera start = camera_create(&film, WIDTH, HEIGHT, NULL, -1), before = start;
    for (int i = 0; i < 4; i++) {
        const FilmKey *key = &film.move.keys[i];
        Camera camera = camera_at(&film, &start, key->time, vec3(0, 0, 0));
        check_near_vec(camera.eye, key->eye, 1e-12);
        check_near_vec(camera.target, key->target, 1e-12);
        CHECK_NEAR(camera.half_y, tan(0.5 * key->fov), 1e-12);
    }
    /* a straight way at constant speed stays one; the target's has no kinks */
    double last = film.move.keys[3].time, step = last / 400, kink = 0.0;
    double speed = 0.0;
    for (int i = 0; i <= 400; i++) {
        double t = i * step;
        Camera camera = camera_at(&film, &start, t, vec3(0, 0, 0));
        check_near_vec(camera.eye, vec3(1 - t, -2 + 3 * t, 1), 1e-12);
        double now = (camera.target.x - before.target.x) / step;
        kink = i > 1 ? fmax(kink, fabs(now - speed)) : 0.0;
        speed = now;
        before = camera;
    }
    CHECK_AT_MOST(kink, 0.02); /* [m/s] between steps; a broken line would jump by 0.2 */
}

static void test_follow(void **state) {
    (void)state;
    Film film = moving_film();
    film.move.follow = true;
    Camera start = camera_create(&film, WIDTH, HEIGHT, NULL, -1);
    Camera camera = camera_at(&film, &start, 1, vec3(0.3, 0.2, 0.1));
    check_near_vec(camera.eye, vec3(0.3, -1.8, 1.1), 1e-15);
    check_near_vec(camera.forward, start.forward, 1e-15);
    film.move.follow = false;
    assert_false(camera_moves(&film));
}

/* ---- through the states ---- */

static void fill_film(Film *film) {
    *film = moving_film();
    film->surface = FILM_SPLATS;
    film->range[0] = -3, film->range[1] = 5;
    film->blur = 0.5, film->blur_samples = 5, film->play = 12.5;
    film->show_time = true;
    strcpy(film->title, "A title: \303\244");
    film->move = (FilmMove){.orbit = 1, .orbit_begin = 0.5, .orbit_end = 2, .follow = true};
    film->view_count = FILM_MOST_VIEWS;
    for (int i = 0; i < FILM_MOST_VIEWS; i++) {
        FilmView *view = &film->views[i];
        *view = (FilmView){.camera = CAMERA_ORTHOGRAPHIC,
                           .eye = {i, 1, 2},
                           .up = {0, 0, 1},
                           .fov = 0.3,
                           .pixels_per_mm = i};
        snprintf(view->name, sizeof view->name, "camera-with-a-long-name-%c------", '0' + i);
        view->move.key_count = i == 1 ? 0 : FILM_MOST_KEYS;
        for (int k = 0; k < view->move.key_count; k++) {
            view->move.keys[k] = (FilmKey){k, {k, i, 0}, {0, 0, k}, 0.5};
        }
    }
}

static bool write_header(const char *path, const Film *film) {
    StateCloth cloth = {.name = "cloth", .fabric = "made-up", .look = "linen"};
    StateHeader header = {.program = "toile tests",
                          .scene_path = "",
                          .scene_text = "",
                          .film = *film,
                          .cloth_count = 1,
                          .cloths = &cloth};
    StateWriter *writer = state_create(path, NULL);
    return writer && state_write_header(writer, &header, NULL) && state_close(writer, NULL);
}

static void test_states_carry_the_film(void **state) {
    (void)state;
    Film film;
    Error error = {0};
    fill_film(&film);
    assert_true(write_header(folder_path("film.states"), &film));
    StateReader *reader = state_open(folder_path("film.states"), &error);
    if (!reader) {
        fail_msg("%s", error.text);
    }
    const Film *read = &state_header(reader)->film;
    assert_int_equal(read->surface, film.surface);
    CHECK_NEAR(read->range[1], 5, 0);
    CHECK_NEAR(read->play, 12.5, 0);
    assert_int_equal(read->blur_samples, 5);
    assert_true(read->show_time && !read->show_scale && read->move.follow);
    assert_string_equal(read->title, film.title);
    CHECK_NEAR(read->move.orbit_end, 2, 0);
    assert_int_equal(read->view_count, FILM_MOST_VIEWS);
    assert_memory_equal(read->views, film.views, sizeof film.views);
    state_reader_close(reader);
    unlink(folder_path("film.states"));
}

static void test_impossible_films_are_refused(void **state) {
    (void)state;
    Film films[6];
    for (int i = 0; i < 6; i++) {
        fill_film(&films[i]);
    }
    films[0].blur = 2;
    films[1].range[0] = 6;
    films[2].views[3].move.keys[4].time = 1; /* times must increase */
    films[3].views[2].move.keys[2].eye.x = INFINITY;
    films[4].blur_samples = 100000;
    films[5].views[0].move.orbit = NAN;
    for (int i = 0; i < 6; i++) {
        Error error = {0};
        assert_true(write_header(folder_path("bad.states"), &films[i]));
        assert_null(state_open(folder_path("bad.states"), &error));
        assert_int_equal(error.code, EXIT_BAD_INPUT);
        assert_non_null(strstr(error.text, "impossible"));
    }
    unlink(folder_path("bad.states"));
}

/* ---- between frames ---- */

static void test_between_frames(void **state) {
    (void)state;
    /* x = t^2 - t^3 + 2 t, a cubic, is met exactly */
    double xa[3] = {0, 0, 0}, va[3] = {2, 2, 2}, xb[3], vb[3];
    double h = 0.4;
    for (int k = 0; k < 3; k++) {
        xb[k] = h * h - h * h * h + 2 * h;
        vb[k] = 2 * h - 3 * h * h + 2;
    }
    Pose pa = pose_identity(), pb = pose_identity();
    pb.turn = (Quat){-cos(0.4), 0, 0, -sin(0.4)}; /* 0.8 rad about z, with the other sign */
    pb.shift = vec3(1, 2, 3);
    StateFrame a = {.x = xa, .v = va, .pose_count = 1, .pose = &pa};
    StateFrame b = {.time = h, .x = xb, .v = vb, .pose_count = 1, .pose = &pb};
    Arena arena = {0};
    for (int i = 0; i <= 10; i++) {
        double t = h * i / 10;
        StateFrame frame = between_frames(&a, &b, 1, i / 10.0, &arena);
        CHECK_NEAR(frame.x[1], t * t - t * t * t + 2 * t, 1e-14);
        CHECK_NEAR(frame.time, t, 1e-15);
        CHECK_NEAR(frame.pose[0].shift.z, 0.3 * i, 1e-14);
    }
    StateFrame middle = between_frames(&a, &b, 1, 0.5, &arena);
    Vec3 turned = quat_rotate(middle.pose[0].turn, vec3(1, 0, 0));
    CHECK_NEAR(turned.x, cos(0.4), 1e-12); /* half of the way, the shorter one */
    CHECK_NEAR(turned.y, sin(0.4), 1e-12);
    arena_free(&arena);
}

/* ---- pictures ---- */

static Options options_of(const char *motion, const char *output) {
    Options options = options_default();
    options.run.path = folder_path(motion);
    options.output = folder_path(output);
    options.width = WIDTH;
    options.height = HEIGHT;
    options.threads = 1;
    options.quiet = options.force = true;
    return options;
}

static Image render(const Options *options, int frame) {
    Options one = *options;
    Error error = {0};
    Image image;
    one.first = one.last = frame;
    one.frames_given = true;
    if (command_render(&one, &error) != EXIT_OK || !image_read_png(one.output, &image, &error)) {
        fail_msg("%s", error.text);
    }
    return image;
}

/* Pixels between the colours of sheet and floor in the row through the middle of the left half. */
static int edge_width(const Image *image) {
    int count = 0;
    const uint8_t *row = image->rgba + (size_t)IMAGE_CHANNELS * WIDTH * (HEIGHT / 2);
    for (int x = 1; x < WIDTH / 2; x++) {
        count += abs(row[IMAGE_CHANNELS * x] - row[IMAGE_CHANNELS * (x - 1)]) > 5;
    }
    return count;
}

static void test_blur(void **state) {
    (void)state;
    Options options = options_of("patch.states", "blur.png");
    options.look = "satin";
    Image sharp = render(&options, 3);
    options.blur = 1.0;
    Image blurred = render(&options, 3), first = render(&options, 0);
    options.blur = 0.0;
    Image first_sharp = render(&options, 0);
    print_message("edge: %d px, blurred %d px\n", edge_width(&sharp), edge_width(&blurred));
    assert_true(edge_width(&sharp) <= 4);
    assert_true(edge_width(&blurred) >= edge_width(&sharp) + 1);
    ImageDifference none = image_compare(&first, &first_sharp);
    assert_true(none.largest == 0.0);                 /* nothing comes before the first frame */
    options = options_of("roll.states", "still.png"); /* at rest: the mean of equal pictures */
    Image still = render(&options, 1);
    options.blur = 0.5;
    Image still_blurred = render(&options, 1);
    ImageDifference rest = image_compare(&still, &still_blurred);
    CHECK_AT_MOST(rest.largest, 1.0);
    image_free(&sharp);
    image_free(&blurred);
    image_free(&first);
    image_free(&first_sharp);
    image_free(&still);
    image_free(&still_blurred);
}

/* Whether any pixel of a box (parts of width and height) differs. */
static bool differs(const Image *a, const Image *b, double x0, double y0, double x1, double y1) {
    for (int y = (int)(y0 * HEIGHT); y < (int)(y1 * HEIGHT); y++) {
        size_t at = (size_t)IMAGE_CHANNELS * (size_t)(y * WIDTH + (int)(x0 * WIDTH));
        if (memcmp(a->rgba + at, b->rgba + at, IMAGE_CHANNELS * (size_t)((x1 - x0) * WIDTH)) != 0) {
            return true;
        }
    }
    return false;
}

static void test_overlays(void **state) {
    (void)state;
    Options options = options_of("roll.states", "text.png");
    Image plain = render(&options, 0);
    options.title = "Wool";
    Image title = render(&options, 0);
    options.title = NULL;
    options.show_time = true;
    Image time = render(&options, 0), later = render(&options, 1);
    assert_true(differs(&plain, &title, 0, 0, 0.5, 0.15));
    assert_false(differs(&plain, &title, 0, 0.2, 1, 1));
    assert_true(differs(&plain, &time, 0.7, 0, 1, 0.15));
    assert_false(differs(&plain, &time, 0, 0.2, 1, 1));
    assert_true(differs(&time, &later, 0.7, 0, 1, 0.15)); /* the cloth rests, the clock does not */
    image_free(&plain);
    image_free(&title);
    image_free(&time);
    image_free(&later);
    Error error = {0};
    options.show_scale = true; /* in perspective there is no scale */
    assert_int_equal(command_render(&options, &error), EXIT_USAGE);
}

static void test_scale_bar(void **state) {
    (void)state;
    bool shown[QUANTITY_COUNT] = {false};
    Image image = image_create(1000, 500);
    Overlay overlay = {.shown = shown, .title = "", .time = NAN, .pixels_per_metre = 2000};
    overlay_draw(&overlay, &image); /* a quarter of the width is 12.5 cm: a bar of 10 cm, 200 px */
    int longest = 0;
    for (int y = 400; y < 500; y++) {
        int run = 0;
        for (int x = 0; x < 1000; x++) {
            run = image.rgba[IMAGE_CHANNELS * (y * 1000 + x)] > 230 ? run + 1 : 0;
            longest = run > longest ? run : longest;
        }
    }
    CHECK_NEAR(longest, 200, 1);
    image_free(&image);
}

static void test_play_and_every(void **state) {
    (void)state;
    Options options = options_of("patch.states", "slow.mp4");
    Error error = {0};
    VideoInfo info;
    options.quality = quality_find("draft");
    options.play = 12;
    options.every = 2;
    assert_int_equal(command_render(&options, &error), EXIT_OK);
    assert_true(video_probe(options.output, &info, -1, NULL, &error));
    assert_int_equal(info.frames, FRAMES / 2);
    CHECK_NEAR(info.rate, 12, 1e-9);
    /* another speed is another video, the same is made once */
    options.force = false;
    options.json = false;
    options.play = 24;
    assert_int_equal(command_render(&options, &error), EXIT_OK);
    assert_true(video_probe(options.output, &info, -1, NULL, &error));
    CHECK_NEAR(info.rate, 24, 1e-9);
    unlink(options.output);
}

static void test_cameras_by_name(void **state) {
    (void)state;
    Film film, changed;
    Error error = {0};
    fill_film(&film);
    strcpy(film.views[2].name, "top");
    Options options = options_default();
    options.camera = "top";
    assert_true(command_film(&options, &film, &changed, &error));
    CHECK_NEAR(changed.pixels_per_mm, 2, 0);
    assert_int_equal(changed.move.key_count, FILM_MOST_KEYS);
    options.camera = "tap";
    assert_false(command_film(&options, &film, &changed, &error));
    assert_int_equal(error.code, EXIT_USAGE);
    assert_non_null(strstr(error.text, "did you mean 'top'"));
    options.camera = NULL;
    options.surface = "points";
    assert_false(command_film(&options, &film, &changed, &error));
}

static int set_up(void **state) {
    (void)state;
    Error error = {0};
    bool good =
        folder_make("cameras") &&
        render_states_write("patch", folder_path("patch.states"), 0, FRAMES, 9, NULL, true,
                            &error) &&
        render_states_write("roll", folder_path("roll.states"), 0, 2, 17, NULL, true, &error);
    if (!good) {
        print_message("%s\n", error.text);
    }
    return good ? 0 : 1;
}

static int tear_down(void **state) {
    (void)state;
    return folder_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orbit),
        cmocka_unit_test(test_keys),
        cmocka_unit_test(test_follow),
        cmocka_unit_test(test_states_carry_the_film),
        cmocka_unit_test(test_impossible_films_are_refused),
        cmocka_unit_test(test_between_frames),
        cmocka_unit_test(test_blur),
        cmocka_unit_test(test_overlays),
        cmocka_unit_test(test_scale_bar),
        cmocka_unit_test(test_play_and_every),
        cmocka_unit_test(test_cameras_by_name),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
