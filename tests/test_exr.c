/* Pictures for compositing: EXR channels against what is known of a flat sheet, alpha, linear light. */
#include <OpenEXR/openexr.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/command.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/render_states.h"

#define WIDTH 320
#define HEIGHT 180
#define DISTANCE 1.5 /* [m] of the camera from the patch */

static void render_frame(const char *states, int frame, Options options) {
    Error error = {0};
    options.run.path = folder_path(states);
    options.width = WIDTH;
    options.height = HEIGHT;
    options.threads = 1;
    options.first = options.last = frame;
    options.frames_given = options.quiet = options.force = true;
    if (command_render(&options, &error) != EXIT_OK) {
        fail_msg("%s", error.text);
    }
}

static void render(const char *output, const char *look, bool alpha) {
    Options options = options_default();
    options.output = folder_path(output);
    options.look = look;
    options.range = look ? (QuantityRange){0, 1} : (QuantityRange){0, 0};
    options.clear = alpha;
    render_frame("patch.states", 0, options);
}

/* One channel of an EXR file as 32-bit numbers (HEIGHT x WIDTH), by the library's own decoder. */
static void *read_channel(const char *path, const char *name, exr_pixel_type_t type) {
    exr_context_t file = NULL;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    uint8_t *values = calloc(WIDTH * HEIGHT, 4);
    int32_t step;
    int found = 0;
    assert_int_equal(exr_start_read(&file, path, &init), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_scanlines_per_chunk(file, 0, &step), EXR_ERR_SUCCESS);
    for (int y = 0; y < HEIGHT; y += step) {
        exr_chunk_info_t chunk;
        assert_int_equal(exr_read_scanline_chunk_info(file, 0, y, &chunk), EXR_ERR_SUCCESS);
        assert_int_equal(y == 0 ? exr_decoding_initialize(file, 0, &chunk, &decoder)
                                : exr_decoding_update(file, 0, &chunk, &decoder),
                         EXR_ERR_SUCCESS);
        for (int c = 0; c < decoder.channel_count; c++) {
            exr_coding_channel_info_t *channel = &decoder.channels[c];
            bool wanted = strcmp(channel->channel_name, name) == 0;
            found += wanted;
            channel->decode_to_ptr = wanted ? values + (size_t)4 * WIDTH * (size_t)y : NULL;
            channel->user_pixel_stride = 4;
            channel->user_line_stride = 4 * WIDTH;
            channel->user_bytes_per_element = 4;
            channel->user_data_type = (uint16_t)type;
        }
        if (y == 0) {
            assert_int_equal(exr_decoding_choose_default_routines(file, 0, &decoder),
                             EXR_ERR_SUCCESS);
        }
        assert_int_equal(exr_decoding_run(file, 0, &decoder), EXR_ERR_SUCCESS);
    }
    assert_true(found > 0);
    exr_decoding_destroy(file, &decoder);
    exr_finish(&file);
    return values;
}

static float *read_floats(const char *path, const char *name) {
    return read_channel(path, name, EXR_PIXEL_FLOAT);
}

/* What the camera sees at a pixel: (u, v) in parts of the panel; false: beside it. */
static bool patch_at(int x, int y, double uv[2]) {
    double half = DISTANCE * tan(0.25), sx = 2.0 * half / HEIGHT; /* [m] of a pixel at the patch */
    double px = (x + 0.25 - WIDTH / 2) * sx, pz = (HEIGHT / 2 - (y + 0.75)) * sx; /* its sample */
    double v = (pz + 0.2) / ((1 + RENDER_PATCH_WEFT) * cos(RENDER_PATCH_SHEAR));
    double u = (px + 0.3 - (1 + RENDER_PATCH_WEFT) * v * sin(RENDER_PATCH_SHEAR)) /
               (1 + RENDER_PATCH_WARP);
    uv[0] = u / 0.6, uv[1] = v / 0.4;
    return uv[0] > 0 && uv[0] < 1 && uv[1] > 0 && uv[1] < 1;
}

static void test_geometry(void **state) {
    (void)state;
    render("patch.exr", NULL, false);
    const char *path = folder_path("patch.exr");
    float *z = read_floats(path, "Z"), *u = read_floats(path, "uv.u"),
          *v = read_floats(path, "uv.v");
    float *nx = read_floats(path, "N.X"), *nz = read_floats(path, "N.Z");
    uint32_t *id = read_channel(path, "id", EXR_PIXEL_UINT);
    double worst_z = 0, worst_uv = 0, worst_n = 0;
    int wrong = 0, cloth = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double uv[2];
        bool inside = patch_at(i % WIDTH, i / WIDTH, uv);
        cloth += inside;
        wrong += inside != (id[i] == 1);
        if (inside && id[i] == 1) {
            worst_z = fmax(worst_z, fabs((double)z[i] - DISTANCE));
            worst_uv = fmax(worst_uv, fmax(fabs((double)u[i] - uv[0]), fabs((double)v[i] - uv[1])));
            worst_n = fmax(worst_n, fmax(fabs((double)nx[i]), fabs((double)nz[i] - 1)));
        } else if (id[i] == 0) {
            assert_true(z[i] == EXR_NOTHING && u[i] == 0.0f && nz[i] == 0.0f);
        }
    }
    assert_true(cloth > 5000);
    CHECK_AT_MOST(wrong, 4); /* samples on the border itself */
    CHECK_AT_MOST(worst_z, 1e-4);
    CHECK_AT_MOST(worst_uv, 1e-4);
    CHECK_AT_MOST(worst_n, 1e-3);
    free(z), free(u), free(v), free(nx), free(nz), free(id);
}

/* The patch moves to the right and up without turning: every pixel of it by the same way, seen by a camera
 * at rest; nothing else. */
static void check_motion(const char *look, const char *film, bool splats) {
    double half = DISTANCE * tan(0.25), way = RENDER_PATCH_SPEED / 30.0 * HEIGHT / (2.0 * half);
    Options options = options_default();
    options.output = folder_path(film);
    options.look = look;
    options.surface = splats ? "splats" : "mesh";
    render_frame("moving.states", 1, options);
    float *x = read_floats(options.output, "motion.x"),
          *y = read_floats(options.output, "motion.y");
    uint32_t *id = read_channel(options.output, "id", EXR_PIXEL_UINT);
    double worst = 0.0;
    int cloth = 0, missed = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        cloth += id[i] == 1;
        if (id[i] == 1 && x[i] != 0.0f) {
            worst = fmax(worst, hypot((double)x[i] - 0.6 * way, (double)y[i] + 0.8 * way));
        } else {
            missed += id[i] == 1;
            assert_true(x[i] == 0.0f && y[i] == 0.0f);
        }
    }
    assert_true(cloth > 5000);
    CHECK_AT_MOST(worst, 1e-3); /* [px] positions are floats */
    CHECK_AT_MOST(missed, 4);   /* samples on the border itself */
    free(x), free(y), free(id);
}

static void test_motion(void **state) {
    (void)state;
    check_motion(NULL, "mesh.exr", false);
    check_motion(NULL, "splats.exr", true);
}

#define PLATE 0.2                                        /* [m] half a side */
#define PLATE_GROW 1.1                                   /* in a frame */
static const double plate_shift[3] = {0.01, 0.0, 0.005}; /* [m] likewise */

/* A plate in front of a small cloth, facing the camera: a mesh whose vertices move from frame 0 to 1. */
static void write_plate(void) {
    const int32_t lattice[4] = {2, 2, 0, 0}, nodes[2] = {0, 4}, faces[6] = {0, 1, 2, 0, 2, 3};
    const int32_t triangles[2] = {0, 2}, loops[2] = {0, 0};
    const double uv[8] = {0, 0, 0.02, 0, 0, 0.02, 0.02, 0.02}, v[12] = {0};
    const double x[12] = {0, .1, 0, .02, .1, 0, 0, .1, .02, .02, .1, .02};
    const double start[12] = {-PLATE, 0, -PLATE, PLATE,  0, -PLATE,
                              PLATE,  0, PLATE,  -PLATE, 0, PLATE};
    const int32_t corners[6] = {0, 1, 3, 0, 3, 2};
    StateMesh mesh = {4, 2, start, faces, true, false};
    StateCloth cloth = {.name = "sheet", .fabric = "none", .look = "linen"};
    StateObstacle plate = {"plate", "clay", {SOLID_SPHERE, {0, 0, 0}, 1.0}, &mesh};
    StateHeader header = {.program = "toile test",
                          .scene_path = "s.yaml",
                          .scene_text = "toile: 1",
                          .film = film_default(),
                          .cloth_count = 1,
                          .cloths = &cloth,
                          .obstacle_count = 1,
                          .obstacles = &plate};
    header.film.camera = CAMERA_PERSPECTIVE;
    header.film.eye = vec3(0, -DISTANCE, 0);
    header.film.floor = false;
    header.film.frame_count = 2;
    StateLayout layout = {.cloth_count = 1,
                          .node_count = 4,
                          .vertex_count = 4,
                          .triangle_count = 2,
                          .lattice = lattice,
                          .node_begin = nodes,
                          .vertex_begin = nodes,
                          .triangle_begin = triangles,
                          .material = uv,
                          .rest = x,
                          .vertex_material = uv,
                          .triangles = corners,
                          .loop_begin = loops,
                          .outline_begin = loops};
    const Pose pose = {{0, 0, 0}, {1, 0, 0, 0}};
    Error error = {0};
    StateWriter *writer = state_create(folder_path("plate.states"), &error);
    assert_non_null(writer);
    assert_true(state_write_header(writer, &header, &error));
    assert_true(state_write_layout(writer, &layout, &error));
    for (int frame = 0; frame < 2; frame++) {
        double moved[12];
        for (int i = 0; i < 12; i++) {
            moved[i] = frame == 0 ? start[i] : PLATE_GROW * start[i] + plate_shift[i % 3];
        }
        StateFrame state = {.frame = frame,
                            .time = frame / 30.0,
                            .x = x,
                            .v = v,
                            .pose_count = 1,
                            .pose = &pose,
                            .moved_count = 4,
                            .moved = moved};
        assert_true(state_write_frame(writer, &state, 4, NULL, 0, &error));
    }
    assert_true(state_write_done(writer, "end", &error) && state_close(writer, &error));
}

/* A mesh that moves by itself, its pose at rest: each pixel by the way of what it shows. */
static void test_mesh_motion(void **state) {
    (void)state;
    double half = DISTANCE * tan(0.25), pixel = 2.0 * half / HEIGHT, worst = 0.0;
    Options options = options_default();
    int seen = 0;
    write_plate();
    options.output = folder_path("plate.exr");
    render_frame("plate.states", 1, options);
    float *x = read_floats(options.output, "motion.x"),
          *y = read_floats(options.output, "motion.y");
    uint32_t *id = read_channel(options.output, "id", EXR_PIXEL_UINT);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double right = (i % WIDTH + 0.25 - WIDTH / 2) * pixel;
        double up = (HEIGHT / 2 - (i / WIDTH + 0.75)) * pixel;
        if (id[i] == 2) {
            double dx = right - (right - plate_shift[0]) / PLATE_GROW;
            double dy = up - (up - plate_shift[2]) / PLATE_GROW;
            worst = fmax(worst, hypot((double)x[i] - dx / pixel, (double)y[i] + dy / pixel));
            seen++;
        }
    }
    assert_true(seen > 5000);
    CHECK_AT_MOST(worst, 1e-3); /* [px] */
    free(x), free(y), free(id);
}

/* A measuring look is not tone-mapped: its light is the light of the code in a PNG. */
static void test_light(void **state) {
    (void)state;
    Image image;
    render("speed.png", "speed", false);
    render("speed.exr", "speed", false);
    assert_true(image_read_png(folder_path("speed.png"), &image, NULL));
    int at = HEIGHT / 2 * WIDTH + WIDTH / 2; /* no vignette in the middle */
    static const char *const names[3] = {"R", "G", "B"};
    for (int k = 0; k < 3; k++) {
        float *channel = read_floats(folder_path("speed.exr"), names[k]);
        double light = (double)channel[at];
        double code = light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1 / 2.4) - 0.055;
        CHECK_NEAR(255 * code, image.rgba[IMAGE_CHANNELS * at + k], 1.5);
        free(channel);
    }
    image_free(&image);
}

static void test_alpha(void **state) {
    (void)state;
    Image image;
    render("alpha.exr", NULL, true);
    render("alpha.png", NULL, true);
    render("plain.exr", NULL, false);
    float *a = read_floats(folder_path("alpha.exr"), "A"),
          *r = read_floats(folder_path("alpha.exr"), "R");
    float *whole = read_floats(folder_path("plain.exr"), "A");
    assert_true(image_read_png(folder_path("alpha.png"), &image, NULL));
    int between = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        assert_true(whole[i] == 1.0f);
        assert_true(a[i] >= 0.0f && a[i] <= 1.0f && (a[i] > 0.0f || r[i] == 0.0f));
        CHECK_NEAR((double)a[i], image.rgba[IMAGE_CHANNELS * i + 3] / 255.0, 0.01);
        between += a[i] > 0.1f && a[i] < 0.9f;
    }
    assert_true(a[HEIGHT / 2 * WIDTH + WIDTH / 2] == 1.0f && a[0] == 0.0f);
    assert_true(between > 50); /* the border is not jagged */
    free(a), free(r), free(whole);
    image_free(&image);
}

/* FFmpeg has a reader of its own. */
static void test_other_reader(void **state) {
    (void)state;
    float *r = read_floats(folder_path("plain.exr"), "R"),
          *nz = read_floats(folder_path("patch.exr"), "N.Z");
    static float planes[4 * WIDTH * HEIGHT];
    char command[512];
    for (int layer = 0; layer < 2; layer++) {
        snprintf(command, sizeof command,
                 "ffmpeg -nostdin -v error -y %s -i %s -f rawvideo -pix_fmt %s %s",
                 layer ? "-layer N" : "", folder_path(layer ? "patch.exr" : "plain.exr"),
                 layer ? "gbrpf32le" : "gbrapf32le", folder_path("raw"));
        assert_int_equal(system(command), 0);
        FILE *file = fopen(folder_path("raw"), "rb");
        assert_non_null(file);
        assert_true(fread(planes, sizeof(float), 4 * WIDTH * HEIGHT, file) >= 3 * WIDTH * HEIGHT);
        fclose(file);
        /* planes: green, blue, red; of the layer: Y, Z, X */
        const float *seen = layer ? planes + WIDTH * HEIGHT : planes + 2 * WIDTH * HEIGHT;
        assert_memory_equal(seen, layer ? nz : r, sizeof(float) * WIDTH * HEIGHT);
    }
    free(r), free(nz);
}

static void test_wrong_requests(void **state) {
    (void)state;
    Options options = options_default();
    Error error = {0};
    options.run.path = folder_path("patch.states");
    options.quiet = true;
    options.output = folder_path("film.mp4");
    options.clear = true;
    assert_int_equal(command_render(&options, &error), EXIT_USAGE);
    options.output = folder_path("%04d.exr");
    options.jobs = 2;
    error = (Error){0};
    assert_int_equal(command_render(&options, &error), EXIT_USAGE);
}

static int set_up(void **state) {
    (void)state;
    Error error = {0};
    bool good =
        folder_make("exr") &&
        render_states_write("patch", folder_path("patch.states"), 0, 1, 9, NULL, true, &error) &&
        render_states_write("patch", folder_path("moving.states"), 0, 2, 9, NULL, true, &error);
    return good ? 0 : 1;
}

static int tear_down(void **state) {
    (void)state;
    return folder_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_geometry),       cmocka_unit_test(test_light),
        cmocka_unit_test(test_alpha),          cmocka_unit_test(test_other_reader),
        cmocka_unit_test(test_wrong_requests), cmocka_unit_test(test_motion),
        cmocka_unit_test(test_mesh_motion),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
