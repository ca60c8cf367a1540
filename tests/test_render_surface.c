/* The surface between the nodes, the solids' meshes, the camera, and comparing pictures. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "render/camera.h"
#include "render/image.h"
#include "render/look.h"
#include "render/output.h"
#include "render/resample.h"
#include "render/solid_mesh.h"
#include "sim/base/hash.h"

#define NU 13
#define NV 9
#define WIDTH 0.6  /* [m] */
#define HEIGHT 0.4 /* [m] */

typedef Vec3 Place(double u, double v);

/* A lattice and its layout; no triangles are needed for resampling. */
typedef struct Lattice {
    int32_t lattice[4], begin[2], none[2];
    double material[2 * 64 * 64], x[3 * 64 * 64];
    StateLayout layout;
} Lattice;

static void lattice_fill(Lattice *l, int nu, int nv, bool around, bool v_first, Place *place) {
    *l = (Lattice){.lattice = {nu, nv, around, 0}, .begin = {0, nu * nv}};
    for (int j = 0; j < nv; j++) {
        for (int i = 0; i < nu; i++) {
            int node = v_first ? i * nv + j : j * nu + i;
            double u = WIDTH * i / (around ? nu : nu - 1), v = HEIGHT * j / (nv - 1);
            l->material[2 * node] = u;
            l->material[2 * node + 1] = v;
            vec3_store(l->x + 3 * node, place(u, v));
        }
    }
    l->layout = (StateLayout){.cloth_count = 1,
                              .node_count = nu * nv,
                              .vertex_count = nu * nv,
                              .lattice = l->lattice,
                              .node_begin = l->begin,
                              .vertex_begin = l->begin,
                              .triangle_begin = l->none,
                              .material = l->material,
                              .vertex_material = l->material};
}

static Vec3 plane(double u, double v) {
    return vec3(1 + 0.8 * u, 0.2 + 0.9 * v, 0.6 * u - 0.1 * v);
}

static Vec3 saddle(double u, double v) { return vec3(u, v, 3 * u * u - 2 * u * v + v * v + v); }

static Vec3 cylinder(double u, double v) {
    double r = WIDTH / (2 * PI), a = u / r;
    return vec3(r * cos(a), r * sin(a), v);
}

static double distance_to(const SurfaceVertex *vertex, Vec3 p) {
    return fmax(fabs(vertex->position[0] - p.x),
                fmax(fabs(vertex->position[1] - p.y), fabs(vertex->position[2] - p.z)));
}

/* Largest distance of the resampled surface from the function. */
static double surface_error(Lattice *l, Place *place, int cap) {
    ResampleDef def = {.pixels_per_metre = 500, .triangle_cap = cap};
    Resampler *resampler = resample_create(&l->layout, &def);
    const Surface *surface = resample_frame(resampler, &l->layout, l->x);
    double worst = 0;
    for (int i = 0; i < surface->vertex_count; i++) {
        Vec3 p = place((double)surface->uv[2 * i], (double)surface->uv[2 * i + 1]);
        worst = fmax(worst, distance_to(&surface->vertices[i], p));
    }
    resample_destroy(resampler);
    return worst;
}

static void test_quadratics_are_exact(void **state) {
    (void)state;
    static Lattice l;
    Place *const places[] = {plane, saddle};
    for (int k = 0; k < 4; k++) {
        lattice_fill(&l, NU, NV, false, k & 1, places[k / 2]);
        assert_true(surface_error(&l, places[k / 2], 100000) < 3e-7); /* float */
    }
}

static void test_two_nodes_are_enough(void **state) {
    (void)state;
    static Lattice l;
    lattice_fill(&l, 2, 3, false, false, plane);
    assert_true(surface_error(&l, plane, 1000) < 3e-7);
}

static void test_cylinder_converges(void **state) {
    (void)state;
    static Lattice l;
    double error[2];
    for (int k = 0; k < 2; k++) {
        lattice_fill(&l, 12 << k, 5, true, false, cylinder);
        error[k] = surface_error(&l, cylinder, 100000);
    }
    assert_true(error[0] < 2e-4 * WIDTH);
    assert_true(error[0] / error[1] > 10); /* fourth order: 16 */
}

static void test_cylinder_frames(void **state) {
    (void)state;
    static Lattice l;
    lattice_fill(&l, 40, 5, true, false, cylinder);
    ResampleDef def = {.pixels_per_metre = 500, .triangle_cap = 100000};
    Resampler *resampler = resample_create(&l.layout, &def);
    const Surface *surface = resample_frame(resampler, &l.layout, l.x);
    assert_true(surface->parts[0].around);
    double width = surface->parts[0].size[0];
    assert_true(fabs(width - WIDTH) < 1e-12);
    for (int i = 0; i < surface->vertex_count; i++) {
        double a = 2 * PI * (double)surface->uv[2 * i] / WIDTH;
        const SurfaceVertex *v = &surface->vertices[i];
        assert_true(fabs(v->normal[0] - cos(a)) < 2e-4 && fabs(v->normal[1] - sin(a)) < 2e-4);
        assert_true(fabs(v->tangent[0] + sin(a)) < 2e-4 && fabs(v->tangent[1] - cos(a)) < 2e-4);
    }
    /* the seam is closed: first and last column are the same */
    int columns = 1;
    while (surface->uv[2 * columns] > surface->uv[2 * columns - 2]) {
        columns++;
    }
    for (int j = 0; j + columns <= surface->vertex_count; j += columns) {
        const SurfaceVertex *first = &surface->vertices[j], *last = first + columns - 1;
        for (int k = 0; k < 3; k++) {
            assert_true(fabsf(first->position[k] - last->position[k]) < 1e-6f);
        }
    }
    resample_destroy(resampler);
}

static void test_cap_and_coarse(void **state) {
    (void)state;
    static Lattice l;
    lattice_fill(&l, NU, NV, false, false, saddle);
    for (int cap = 2000; cap <= 200000; cap *= 10) {
        ResampleDef def = {.pixels_per_metre = 1e5, .triangle_cap = cap};
        Resampler *resampler = resample_create(&l.layout, &def);
        const Surface *surface = resample_surface(resampler);
        assert_true(surface->fine_count <= cap && surface->fine_count > cap / 2);
        assert_true(surface->coarse_count >= surface->fine_count / 4);
        assert_true(surface->coarse_count < surface->fine_count / 2);
        for (int i = 0; i < 3 * surface->fine_count; i++) {
            assert_true(surface->fine[i] < (uint32_t)surface->vertex_count);
        }
        resample_destroy(resampler);
    }
}

/* A scattered patch: a jittered grid, triangulated. */
typedef struct Patch {
    Lattice l;
    int32_t triangles[3 * 2 * 20 * 20], triangle_begin[2];
} Patch;

static void patch_fill(Patch *patch, int n, Place *place) {
    lattice_fill(&patch->l, n, n, false, false, place);
    memset(patch->l.lattice, 0, sizeof patch->l.lattice);
    for (int i = 0; i < n * n; i++) {
        double *a = patch->l.material + 2 * i;
        int column = i % n, row = i / n;
        if (column > 0 && column < n - 1 && row > 0 && row < n - 1) {
            a[0] += 0.3 * WIDTH / n * hash_random(1, (uint64_t)i);
            a[1] += 0.3 * HEIGHT / n * hash_random(2, (uint64_t)i);
        }
        vec3_store(patch->l.x + 3 * i, place(a[0], a[1]));
    }
    int count = 0;
    for (int j = 0; j + 1 < n; j++) {
        for (int i = 0; i + 1 < n; i++) {
            int a = j * n + i;
            int32_t cell[6] = {a, a + 1, a + n + 1, a, a + n + 1, a + n};
            memcpy(patch->triangles + 3 * count, cell, sizeof cell);
            count += 2;
        }
    }
    patch->triangle_begin[1] = count;
    patch->l.layout.triangles = patch->triangles;
    patch->l.layout.triangle_begin = patch->triangle_begin;
    patch->l.layout.triangle_count = count;
}

static Vec3 dome(double u, double v) {
    double a = 2 * (u - WIDTH / 2), b = 2 * (v - HEIGHT / 2);
    return vec3(u, v, 0.3 * cos(a) * cos(b));
}

static void test_scattered(void **state) {
    (void)state;
    static Patch patch;
    for (int n = 2; n <= 8; n += 6) { /* four vertices determine no quadratic */
        patch_fill(&patch, n, plane);
        assert_true(surface_error(&patch.l, plane, 20000) < 3e-7); /* float */
    }
    patch_fill(&patch, 8, saddle);
    assert_true(surface_error(&patch.l, saddle, 20000) < 3e-7);
    double error[2];
    for (int k = 0; k < 2; k++) {
        patch_fill(&patch, 8 << k, dome);
        error[k] = surface_error(&patch.l, dome, 20000);
    }
    assert_true(error[0] < 3e-5 && error[0] / error[1] > 8); /* third order */
}

static void test_scattered_has_no_cracks(void **state) {
    (void)state;
    static Patch patch;
    patch_fill(&patch, 8, dome);
    ResampleDef def = {.pixels_per_metre = 500, .triangle_cap = 20000};
    Resampler *resampler = resample_create(&patch.l.layout, &def);
    const Surface *surface = resample_frame(resampler, &patch.l.layout, patch.l.x);
    int twins = 0;
    for (int i = 0; i < surface->vertex_count; i++) {
        for (int j = i + 1; j < surface->vertex_count; j++) {
            const SurfaceVertex *a = &surface->vertices[i], *b = &surface->vertices[j];
            if (distance_to(a, vec3((double)b->position[0], (double)b->position[1],
                                    (double)b->position[2])) < 1e-5) {
                assert_memory_equal(a, b, sizeof *a); /* normals are continuous, too */
                twins++;
            }
        }
    }
    assert_true(twins > 100);
    resample_destroy(resampler);
}

static void test_solid_meshes(void **state) {
    (void)state;
    for (int kind = SOLID_SPHERE; kind < SOLID_KIND_COUNT; kind++) {
        Arena arena = {0};
        Solid solid = {(SolidKind)kind, {0.3, 0.2, 0.25}, 0.1};
        SolidMesh mesh = solid_mesh_create(&solid, 1.0, &arena);
        double volume = 0;
        for (int i = 0; i < mesh.vertex_count; i++) {
            const SolidVertex *v = &mesh.vertices[i];
            Vec3 p = vec3((double)v->position[0], (double)v->position[1], (double)v->position[2]);
            Vec3 n = vec3((double)v->normal[0], (double)v->normal[1], (double)v->normal[2]), unit;
            double d = solid_distance(&solid, p, &unit);
            assert_true(d < 1e-6 && d > -0.002); /* bevels lie inside */
            assert_true(fabs(vec3_length(n) - 1) < 1e-5);
        }
        for (int i = 0; i < mesh.triangle_count; i++) {
            Vec3 p[3];
            for (int k = 0; k < 3; k++) {
                const float *f = mesh.vertices[mesh.triangles[3 * i + k]].position;
                p[k] = vec3((double)f[0], (double)f[1], (double)f[2]);
            }
            volume += vec3_dot(p[0], vec3_cross(p[1], p[2])) / 6;
        }
        assert_true(volume > 0); /* turned outward, as a whole */
        arena_free(&arena);
    }
}

/* a ring of quads is smooth, a tetrahedron sharp */
static void test_triangle_meshes(void **state) {
    (void)state;
    enum { AROUND = 24 };
    double vertices[6 * AROUND];
    int32_t triangles[6 * AROUND];
    for (int i = 0; i < AROUND; i++) {
        double angle = 2 * PI * i / AROUND;
        vec3_store(vertices + 6 * i, vec3(cos(angle), sin(angle), 0));
        vec3_store(vertices + 6 * i + 3, vec3(cos(angle), sin(angle), 1));
        int a = 2 * i, b = 2 * ((i + 1) % AROUND);
        const int32_t cell[6] = {a, b, b + 1, a, b + 1, a + 1};
        memcpy(triangles + 6 * i, cell, sizeof cell);
    }
    Arena arena = {0};
    StateMesh ring = {2 * AROUND, 2 * AROUND, vertices, triangles, false, false};
    SolidMesh mesh = solid_mesh_from_triangles(&ring, vertices, &arena);
    assert_int_equal(mesh.vertex_count, 6 * AROUND);
    for (int i = 0; i < mesh.vertex_count; i++) { /* 15 degrees from side to side: round */
        const SolidVertex *v = &mesh.vertices[i];
        double along = (double)(v->position[0] * v->normal[0] + v->position[1] * v->normal[1]);
        assert_true(along > cos(8 * PI / 180) && fabsf(v->normal[2]) < 1e-6f);
    }
    static const double corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const int32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    StateMesh sharp = {4, 4, corners, faces, false, true};
    mesh = solid_mesh_from_triangles(&sharp, corners, &arena);
    assert_true(mesh.vertices[0].normal[2] < -0.999f && mesh.vertices[3].normal[1] < -0.999f);
    assert_true(mesh.low[0] == 0.0f && mesh.high[2] == 1.0f);
    arena_free(&arena);
}

static void test_camera_frames_all_points(void **state) {
    (void)state;
    Film film = film_default();
    for (int kind = 0; kind < 2; kind++) {
        film.camera = kind ? CAMERA_ORTHOGRAPHIC : CAMERA_AUTO;
        CameraReach reach = camera_reach_start(&film, 1280, 720);
        for (uint64_t i = 0; i < 200; i++) {
            camera_reach_add(
                &reach, vec3(2 + hash_random(3, i), hash_random(4, i), 0.5 * hash_random(5, i)));
        }
        Camera camera = camera_create(&film, 1280, 720, &reach, NAN);
        Mat4 clip = camera_clip(&camera), back = camera_unclip(&camera);
        double most = 0;
        for (uint64_t i = 0; i < 200; i++) {
            Vec3 p = {2 + hash_random(3, i), hash_random(4, i), 0.5 * hash_random(5, i)};
            double c[4], q[4];
            mat4_apply(&clip, p, c);
            most = fmax(most, fmax(fabs(c[0] / c[3]), fabs(c[1] / c[3])));
            mat4_apply(&back, vec3(c[0] / c[3], c[1] / c[3], c[2] / c[3]), q);
            assert_true(fabs(q[0] / q[3] - p.x) < 1e-6 && fabs(q[2] / q[3] - p.z) < 1e-6);
        }
        assert_true(most < 0.81 && most > 0.79);
        assert_true(camera.floor_height < -0.45);
    }
}

static void test_looks_have_names(void **state) {
    (void)state;
    for (int i = 0; i < look_count; i++) {
        assert_ptr_equal(look_find(looks[i].name, NULL), &looks[i]);
        LookPanel panel = {.width = 0.5, .height = 0.3, .around = true, .rectangle = true};
        ClothBlock block = look_cloth_block(&looks[i], &panel);
        double threads = (double)block.weft[3] * 0.5;
        assert_true(fabs(threads / 20 - round(threads / 20)) < 1e-4);
    }
    for (int i = 0; i < prop_look_count; i++) {
        assert_ptr_equal(prop_look_find(prop_looks[i].name, NULL), &prop_looks[i]);
    }
    Error error = {0};
    assert_null(look_find("linnen", &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, "'linen'"));
}

static Image noise_image(int width, int height) {
    Image image = image_create(width, height);
    for (int i = 0; i < width * height * IMAGE_CHANNELS; i++) {
        double smooth = 100 + 60 * sin(0.01 * (i / IMAGE_CHANNELS));
        image.rgba[i] = (uint8_t)(smooth + 30 * hash_random(7, (uint64_t)i));
        image.rgba[i] = i % 4 == 3 ? 255 : image.rgba[i];
    }
    return image;
}

static void test_compare(void **state) {
    (void)state;
    Image a = noise_image(80, 60), b = noise_image(80, 60);
    ImageDifference same = image_compare(&a, &b);
    assert_true(image_passes(&same) && isinf(same.psnr) && same.ssim == 1.0);
    for (int i = 0; i < 80 * 60; i++) { /* one channel one level brighter: not seen by PSNR */
        b.rgba[4 * i]++;
    }
    ImageDifference tinted = image_compare(&a, &b);
    assert_true(tinted.psnr > 50 && !image_passes(&tinted));
    assert_true(fabs(tinted.mean_signed[0] - 1) < 1e-12);
    image_free(&a);
    image_free(&b);
}

static void test_png_round_trip(void **state) {
    (void)state;
    char path[] = "/tmp/toile-test-XXXXXX.png", text[64];
    close(mkstemps(path, 4));
    Image a = noise_image(33, 21), b;
    ImageText texts[] = {{"toile:key", "one two"}};
    assert_true(image_write_png(path, &a, texts, 1, NULL));
    assert_true(image_read_png(path, &b, NULL));
    assert_memory_equal(a.rgba, b.rgba, 33 * 21 * 4);
    assert_true(image_read_png_text(path, "toile:key", text, sizeof text));
    assert_string_equal(text, "one two");
    image_free(&b);
    assert_int_equal(truncate(path, 700), 0);
    Error error = {0};
    assert_false(image_read_png(path, &b, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    unlink(path);
    image_free(&a);
}

static void test_output_names(void **state) {
    (void)state;
    const struct {
        const char *path;
        bool good;
        OutputKind kind;
    } cases[] = {{"a.mp4", true, OUTPUT_VIDEO},          {"x/a.webm", true, OUTPUT_VIDEO},
                 {"a.png", true, OUTPUT_PICTURE},        {"f/%04d.png", true, OUTPUT_SEQUENCE},
                 {"frames/", true, OUTPUT_SEQUENCE},     {"frames", true, OUTPUT_SEQUENCE},
                 {"a%s.png", false, OUTPUT_SEQUENCE},    {"%d%d.png", false, OUTPUT_SEQUENCE},
                 {"a.avi", false, OUTPUT_PICTURE},       {"%99999d.png", false, OUTPUT_SEQUENCE},
                 {"a%04d%n.png", false, OUTPUT_SEQUENCE}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        OutputDef def = {0};
        Error error = {0};
        assert_int_equal(output_plan(cases[i].path, &def, &error), cases[i].good);
        assert_int_equal(error.code, cases[i].good ? EXIT_OK : EXIT_USAGE);
        assert_true(!cases[i].good || def.kind == cases[i].kind);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quadratics_are_exact),
        cmocka_unit_test(test_two_nodes_are_enough),
        cmocka_unit_test(test_cylinder_converges),
        cmocka_unit_test(test_cylinder_frames),
        cmocka_unit_test(test_cap_and_coarse),
        cmocka_unit_test(test_scattered),
        cmocka_unit_test(test_scattered_has_no_cracks),
        cmocka_unit_test(test_solid_meshes),
        cmocka_unit_test(test_triangle_meshes),
        cmocka_unit_test(test_camera_frames_all_points),
        cmocka_unit_test(test_looks_have_names),
        cmocka_unit_test(test_compare),
        cmocka_unit_test(test_png_round_trip),
        cmocka_unit_test(test_output_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
