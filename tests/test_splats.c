/* Point splats: where surfels end, and that their pictures are those of the mesh. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/draw.h"
#include "render/gl.h"
#include "render/surfel.h"
#include "sim/base/hash.h"
#include "tests/support/check.h"
#include "tests/support/render_child.h"
#include "tests/support/render_states.h"

#define MOTIONS 6
static const char *const motions[MOTIONS] = {"table", "sleeve", "ball", "disc", "figure", "patch"};
static char folder[] = "/tmp/toile-splats-XXXXXX";

static const char *path_of(const char *motion) {
    static char path[128];
    snprintf(path, sizeof path, "%s/%s.states", folder, motion);
    return path;
}

/* ---- pictures ---- */

typedef struct View {
    const char *motion, *look; /* NULL: its own */
    bool splats, clear;
    int width, height, threads;
    QuantityRange range;
} View;

static Image draw(const View *view) {
    RunDef run_def = run_default();
    Run run;
    Error error = {0};
    run_def.path = path_of(view->motion);
    DrawDef def = {.width = view->width,
                   .height = view->height,
                   .quality = quality_find("standard"),
                   .splats = view->splats,
                   .clear = view->clear,
                   .look = view->look,
                   .range = view->range,
                   .threads = view->threads};
    Image copy = image_create(view->width, view->height);
    if (!run_open(&run, &run_def, &error)) {
        fail_msg("%s", error.text);
    }
    run_wait_end(&run);
    Drawer *drawer = draw_create(&run, &def, &error);
    const Image *image = drawer ? draw_frame(drawer, 0, &error) : NULL;
    if (!image) {
        fail_msg("%s", error.text);
    }
    memcpy(copy.rgba, image->rgba, (size_t)IMAGE_CHANNELS * view->width * view->height);
    draw_destroy(drawer);
    run_close(&run);
    return copy;
}

static void test_like_the_mesh(void **state) {
    (void)state;
    for (int i = 0; i < MOTIONS; i++) {
        View view = {.motion = motions[i], .width = 1280, .height = 720};
        Image mesh = draw(&view);
        view.splats = true;
        Image splats = draw(&view);
        ImageDifference difference = image_compare(&mesh, &splats);
        print_message("%-8s PSNR %.1f dB, SSIM %.4f\n", motions[i], difference.psnr,
                      difference.ssim);
        CHECK_AT_MOST(-difference.psnr, -38.0);
        image_free(&mesh);
        image_free(&splats);
    }
}

/* Pixels whose neighbours the mesh covers, and which the surfels do not. */
static int count_open(const Image *mesh, const Image *splats) {
    int open = 0;
    for (int y = 1; y < mesh->height - 1; y++) {
        for (int x = 1; x < mesh->width - 1; x++) {
            bool inside = true;
            for (int k = 0; k < 9; k++) {
                int at = (y + k / 3 - 1) * mesh->width + x + k % 3 - 1;
                inside = inside && mesh->rgba[IMAGE_CHANNELS * at + 3] > 0;
            }
            open += inside && splats->rgba[IMAGE_CHANNELS * (y * mesh->width + x) + 3] == 0;
        }
    }
    return open;
}

static void lay_over_grey(Image *image) {
    for (int i = 0; i < image->width * image->height; i++) {
        uint8_t *p = image->rgba + IMAGE_CHANNELS * i;
        for (int k = 0; k < 3; k++) {
            p[k] = (uint8_t)((p[k] * p[3] + 110 * (255 - p[3])) / 255);
        }
    }
}

static void test_every_look(void **state) {
    (void)state;
    for (int i = 0; i < look_count; i++) {
        View view = {
            .motion = "table", .look = looks[i].name, .clear = true, .width = 1280, .height = 720};
        Image mesh = draw(&view);
        view.splats = true;
        Image splats = draw(&view);
        int open = count_open(&mesh, &splats);
        lay_over_grey(&mesh);
        lay_over_grey(&splats);
        ImageDifference difference = image_compare(&mesh, &splats);
        print_message("%-12s PSNR %.1f dB, %d pixels open\n", view.look, difference.psnr, open);
        CHECK_AT_MOST(-difference.psnr, -38.0);
        assert_int_equal(open, 0);
        image_free(&mesh);
        image_free(&splats);
    }
}

/* Sheer cloth is drawn by triangles in both, from derivatives in one. */
static void test_sheer_is_the_mesh(void **state) {
    (void)state;
    View view = {.motion = "ball", .look = "chiffon", .width = 640, .height = 360};
    Image mesh = draw(&view);
    view.splats = true;
    Image splats = draw(&view);
    ImageDifference difference = image_compare(&mesh, &splats);
    CHECK_AT_MOST(-difference.psnr, -42.0); /* not the same triangles: the cells differ */
    image_free(&mesh);
    image_free(&splats);
}

/* Yellow in the measuring look of speed over its range; the backdrop is grey, wood is redder. */
static bool is_cloth(const Image *image, int x, int y) {
    const uint8_t *p = image->rgba + IMAGE_CHANNELS * (y * image->width + x);
    return p[0] > 2 * p[2] && p[1] > 2 * p[2] && 4 * p[1] > 3 * p[0];
}

/* Pixels well inside the cloth of `mesh` that are not cloth in `splats`, and well outside that are. */
static void count_wrong(const Image *mesh, const Image *splats, int reach, int *holes,
                        int *spills) {
    *holes = *spills = 0;
    for (int y = reach; y < mesh->height - reach; y++) {
        for (int x = reach; x < mesh->width - reach; x++) {
            int inside = 0, side = 2 * reach + 1;
            for (int k = 0; k < side * side; k++) {
                inside += is_cloth(mesh, x - reach + k % side, y - reach + k / side);
            }
            bool cloth = is_cloth(splats, x, y);
            *holes += inside == side * side && !cloth;
            *spills += inside == 0 && cloth;
        }
    }
}

static void test_no_holes(void **state) {
    (void)state;
    for (int i = 0; i < MOTIONS; i++) {
        /* every speed is far over the range: one colour, whatever the surface does */
        View view = {
            .motion = motions[i], .look = "speed", .width = 1280, .height = 720, .range = {-2, -1}};
        int holes, spills, cloth = 0;
        Image mesh = draw(&view);
        view.splats = true;
        Image splats = draw(&view);
        for (int k = 0; k < 1280 * 720; k++) {
            cloth += is_cloth(&mesh, k % 1280, k / 1280);
        }
        assert_true(cloth > 20000); /* the colour is recognised */
        count_wrong(&mesh, &splats, 1, &holes, &spills);
        print_message("%-8s %d px of cloth, %d holes, %d spills\n", motions[i], cloth, holes,
                      spills);
        assert_int_equal(holes, 0);
        assert_int_equal(spills, 0);
        image_free(&mesh);
        image_free(&splats);
    }
}

static uint64_t hash_of_view(void *context) {
    const View *view = context;
    Error error = {0};
    if (!gl_open(view->threads, &error)) {
        return 0;
    }
    Image image = draw(view);
    return hash_bytes(image.rgba, (size_t)IMAGE_CHANNELS * image.width * image.height);
}

static void test_same_bits(void **state) {
    (void)state;
    View view = {.motion = "ball", .splats = true, .width = 320, .height = 180};
    uint64_t hash = render_child_value(hash_of_view, &view);
    assert_true(hash != 0);
    for (int threads = 1; threads <= 3; threads++) {
        view.threads = threads;
        assert_true(render_child_value(hash_of_view, &view) == hash);
    }
}

/* ---- surfels ---- */

/* A layout of triangles alone, and the surface that has just its corners as vertices. */
typedef struct Patch {
    StateLayout layout;
    Surface surface;
    SurfacePart part;
    int32_t lattice[4], vertices[2], triangles[2];
    uint32_t fine[3 * 16];
    float uv[2 * 16];
    Surfel surfels[16];
} Patch;

static void patch_fill(Patch *patch, const double *uv, int vertices, const int32_t *triangles,
                       int count) {
    *patch = (Patch){.vertices = {0, vertices}, .triangles = {0, count}};
    patch->layout = (StateLayout){.cloth_count = 1,
                                  .vertex_count = vertices,
                                  .triangle_count = count,
                                  .lattice = patch->lattice,
                                  .vertex_begin = patch->vertices,
                                  .triangle_begin = patch->triangles,
                                  .vertex_material = uv,
                                  .triangles = triangles};
    patch->part = (SurfacePart){.vertex_count = vertices, .fine_count = count};
    for (int i = 0; i < 2 * vertices; i++) {
        patch->uv[i] = (float)uv[i];
    }
    for (int i = 0; i < 3 * count; i++) {
        patch->fine[i] = (uint32_t)triangles[i];
    }
    patch->surface = (Surface){.part_count = 1,
                               .vertex_count = vertices,
                               .fine_count = count,
                               .parts = &patch->part,
                               .uv = patch->uv,
                               .fine = patch->fine,
                               .surfels = patch->surfels};
    surfel_fill(&patch->layout, &patch->surface);
}

static bool covers(const Surfel *surfel, double u, double v) {
    double a = surfel->line[0][0] * u + surfel->line[0][1] * v + surfel->line[0][2];
    double b = surfel->line[1][0] * u + surfel->line[1][1] * v + surfel->line[1][2];
    bool inside = surfel->cut > 1 ? a >= 0 || b >= 0 : a >= 0 && b >= 0;
    double du = u - surfel->uv[0], dv = v - surfel->uv[1];
    return inside && du * du + dv * dv < surfel->radius * surfel->radius;
}

/* An L of three unit squares: five convex corners, one that goes inward, at (1, 1). */
static const double l_uv[16] = {0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1, 0, 2, 1, 2};
static const int32_t l_triangles[18] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 3, 4, 7, 3, 7, 6};

static bool in_l(double u, double v) {
    return u >= 0 && v >= 0 && u <= 2 && v <= 2 && (u <= 1 || v <= 1);
}

static void test_clip_lines(void **state) {
    (void)state;
    Patch patch;
    patch_fill(&patch, l_uv, 8, l_triangles, 6);
    for (int i = 0; i <= 90; i++) {
        for (int j = 0; j <= 90; j++) {
            double u = -0.5 + 3.0 * (i + 0.37) / 91.0, v = -0.5 + 3.0 * (j + 0.41) / 91.0;
            int covering = 0;
            for (int k = 0; k < 8; k++) {
                covering += covers(&patch.surfels[k], u, v);
            }
            if (in_l(u, v)) {
                assert_true(covering > 0); /* no hole */
            }
        }
    }
    const Surfel *inner = &patch.surfels[4], *corner = &patch.surfels[0];
    assert_true(inner->cut == 2.0f);
    assert_true(covers(inner, 0.9, 1.1) && covers(inner, 1.1, 0.9) && !covers(inner, 1.1, 1.1));
    assert_true(corner->cut == 1.0f);
    assert_true(covers(corner, 0.1, 0.1) && !covers(corner, -0.1, 0.1) &&
                !covers(corner, 0.1, -0.1));
}

static void test_doubles_are_dropped(void **state) {
    (void)state;
    Patch patch;
    /* two triangles of a square that do not share their corners */
    static const double uv[12] = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1};
    static const int32_t triangles[6] = {0, 1, 2, 3, 4, 5};
    patch_fill(&patch, uv, 6, triangles, 2);
    int kept = 0;
    for (int i = 0; i < 6; i++) {
        kept += patch.surfels[i].radius > 0.0f;
    }
    assert_int_equal(kept, 4);
}

static int set_up(void **state) {
    (void)state;
    Error error = {0};
    bool good = mkdtemp(folder) != NULL;
    for (int i = 0; good && i < MOTIONS; i++) {
        good = render_states_write(motions[i], path_of(motions[i]), i == 1 ? 80 : 5, 1, 32, NULL,
                                   true, &error);
    }
    if (!good) {
        print_message("%s\n", error.text);
    }
    return good ? 0 : 1;
}

static int tear_down(void **state) {
    (void)state;
    for (int i = 0; i < MOTIONS; i++) {
        unlink(path_of(motions[i]));
    }
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bits), /* first: a process keeps its number of raster threads */
        cmocka_unit_test(test_clip_lines),    cmocka_unit_test(test_doubles_are_dropped),
        cmocka_unit_test(test_like_the_mesh), cmocka_unit_test(test_every_look),
        cmocka_unit_test(test_no_holes),      cmocka_unit_test(test_sheer_is_the_mesh),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
