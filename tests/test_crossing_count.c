/* Counting crossings: sheets with themselves and each other against all pairs, triangles that reach
 * inside a solid against many points of each, and what it costs. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/clock.h"
#include "sim/base/hash.h"
#include "sim/geom/crossing.h"
#include "tests/support/check.h"

static uint64_t drawn;

static double draw(void) { return hash_random(13, drawn++); } /* -1 .. 1 */

/* ---- meshes ---- */

typedef struct Sheet {
    CrossingMesh mesh;
    double *vertices;
    int32_t *triangles;
} Sheet;

static Sheet sheet_create(int n) {
    Sheet sheet = {.mesh = {n * n, 2 * (n - 1) * (n - 1), NULL, NULL}};
    sheet.vertices = calloc(3 * (size_t)n * (size_t)n, sizeof(double));
    sheet.triangles = calloc(3 * (size_t)sheet.mesh.triangle_count, sizeof(int32_t));
    int at = 0;
    for (int j = 0; j + 1 < n; j++) {
        for (int i = 0; i + 1 < n; i++) {
            int32_t a = j * n + i, b = a + 1, c = a + n, d = c + 1;
            int32_t cell[6] = {a, b, d, a, d, c};
            memcpy(sheet.triangles + at, cell, sizeof cell);
            at += 6;
        }
    }
    sheet.mesh.vertices = sheet.vertices;
    sheet.mesh.triangles = sheet.triangles;
    return sheet;
}

static void sheet_free(Sheet *sheet) {
    free(sheet->vertices);
    free(sheet->triangles);
}

typedef Vec3 Place(double u, double v);

static void sheet_place(Sheet *sheet, int n, Place *place) {
    for (int i = 0; i < n * n; i++) {
        vec3_store(sheet->vertices + 3 * i, place(i % n / (n - 1.0), i / n / (n - 1.0)));
    }
}

static Vec3 place_flat(double u, double v) { return vec3(u, v, 0); }
static Vec3 place_tilted(double u, double v) {
    Quat turn = quat_from_axis_angle(vec3(1, 2, 3), 0.7);
    return quat_rotate(turn, vec3(u, v, 0));
}
static Vec3 place_waves(double u, double v) {
    return vec3(u, v, 0.05 * sin(9 * u + 4 * v) * cos(7 * v));
}
/* ten layers, 3 mm apart */
static Vec3 place_folded(double u, double v) { return vec3(0.1 * sin(10 * PI * u), v, 0.03 * u); }
/* a roll that runs into itself along one line of cells */
static Vec3 place_rolled(double u, double v) {
    double angle = 2.2 * PI * u, r = 0.2 + 0.004 * cos(4 * PI * v);
    return vec3(r * cos(angle), r * sin(angle), v);
}

static int64_t brute_self(const CrossingMesh *mesh) {
    int64_t count = 0;
    for (int i = 0; i < mesh->triangle_count; i++) {
        for (int j = i + 1; j < mesh->triangle_count; j++) {
            CrossingMesh one = *mesh;
            int32_t two[6];
            memcpy(two, mesh->triangles + 3 * i, 3 * sizeof *two);
            memcpy(two + 3, mesh->triangles + 3 * j, 3 * sizeof *two);
            one.triangle_count = 2;
            one.triangles = two;
            Arena arena = {0};
            count += crossing_count_self(&one, &arena).count;
            arena_free(&arena);
        }
    }
    return count;
}

static void test_self(void **unused) {
    (void)unused;
    enum { N = 15 };
    Arena arena = {0};
    Sheet sheet = sheet_create(N);
    Place *clean[] = {place_flat, place_tilted, place_waves};
    for (int i = 0; i < 3; i++) {
        sheet_place(&sheet, N, clean[i]);
        assert_int_equal(crossing_count_self(&sheet.mesh, &arena).count, 0);
    }
    sheet_place(&sheet, N, place_rolled);
    Crossings found = crossing_count_self(&sheet.mesh, &arena);
    assert_true(found.count > 10 && found.first[0] >= 0 && found.first[0] < found.first[1]);
    assert_int_equal(found.count, brute_self(&sheet.mesh));
    /* folded over onto itself: exactly coplanar, every cell meets its mirror image */
    sheet_place(&sheet, N, place_tilted);
    for (int j = 0; j < N; j++) {
        for (int i = N / 2 + 1; i < N; i++) {
            memcpy(sheet.vertices + 3 * (j * N + i), sheet.vertices + 3 * (j * N + N - 1 - i),
                   3 * sizeof(double));
        }
    }
    found = crossing_count_self(&sheet.mesh, &arena);
    assert_true(found.count > (N - 1) * (N - 1));
    assert_int_equal(found.count, brute_self(&sheet.mesh));
    assert_int_equal(arena.bytes_used, 0);
    sheet_free(&sheet);
    arena_free(&arena);
}

static void test_between(void **unused) {
    (void)unused;
    enum { N = 9 };
    Arena arena = {0};
    Sheet a = sheet_create(N), b = sheet_create(N);
    sheet_place(&a, N, place_flat);
    sheet_place(&b, N, place_flat);
    for (int i = 0; i < N * N; i++) {
        b.vertices[3 * i + 2] = 1e-9;
    }
    assert_int_equal(crossing_count_between(&a.mesh, &b.mesh, &arena).count, 0);
    b.vertices[3 * (4 * N + 4) + 2] = 0.0; /* one vertex, in six triangles, touches one of a's */
    Crossings found = crossing_count_between(&a.mesh, &b.mesh, &arena);
    assert_int_equal(found.count, 36);
    assert_int_equal(found.first[0], found.first[1]);
    sheet_place(&b, N, place_tilted);
    int64_t one_way = crossing_count_between(&a.mesh, &b.mesh, &arena).count;
    assert_true(one_way > 0);
    assert_int_equal(crossing_count_between(&b.mesh, &a.mesh, &arena).count, one_way);
    b.mesh.triangle_count = 0;
    assert_int_equal(crossing_count_between(&a.mesh, &b.mesh, &arena).count, 0);
    sheet_free(&a);
    sheet_free(&b);
    arena_free(&arena);
}

/* a cube of two triangles a side, and points whose place is known; the segments that leave from its
 * axes, corners and edges meet special positions */
static void test_inside(void **unused) {
    (void)unused;
    double vertices[24];
    for (int i = 0; i < 24; i++) {
        vertices[i] = i / 3 >> i % 3 & 1;
    }
    int32_t triangles[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                             2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    CrossingMesh cube = {8, 12, vertices, triangles};
    for (int turned = 0; turned < 2; turned++) {
        for (int i = 0; i < 5000; i++) {
            double p[3] = {0.5 + draw(), 0.5 + draw(), 0.5 + draw()};
            bool inside = true;
            for (int k = 0; k < 3; k++) {
                p[k] = i % 2 ? p[k] : 0.25 * round(4 * p[k]);
                p[k] += i % 3 ? 0.0 : 1e-17;
                inside = inside && p[k] > 0.0 && p[k] < 1.0;
            }
            bool on = false;
            for (int k = 0; k < 3; k++) {
                on = on || p[k] == 0.0 || p[k] == 1.0;
            }
            assert_true(on || crossing_point_inside(&cube, p) == inside);
        }
        for (int i = 0; i < 36; i += 3) { /* inside out it has an inside, too */
            int32_t keep = triangles[i];
            triangles[i] = triangles[i + 1];
            triangles[i + 1] = keep;
        }
    }
}

static void test_damage(void **unused) {
    (void)unused;
    Sheet sheet = sheet_create(3);
    assert_null(crossing_find_damage(&sheet.mesh));
    sheet.vertices[7] = NAN;
    assert_string_equal(crossing_find_damage(&sheet.mesh), "vertex 2 is not finite");
    sheet.vertices[7] = 0.0;
    sheet.triangles[4] = 9;
    assert_string_equal(crossing_find_damage(&sheet.mesh), "triangle 1 names vertex 9 of 9");
    sheet_free(&sheet);
}

/* ---- solids ---- */

static int64_t reach(const Solid *solid, Pose pose, Vec3 a, Vec3 b, Vec3 c) {
    double vertices[9];
    int32_t triangle[3] = {0, 1, 2};
    vec3_store(vertices, a);
    vec3_store(vertices + 3, b);
    vec3_store(vertices + 6, c);
    CrossingMesh mesh = {3, 1, vertices, triangle};
    return crossing_count_solid(&mesh, solid, pose).count;
}

static const Solid solids[] = {
    {SOLID_SPHERE, {0, 0, 0}, 0.3},      {SOLID_BOX, {0.3, 0.2, 0.25}, 0.0},
    {SOLID_BOX, {0.3, 0.2, 0.25}, 0.05}, {SOLID_CYLINDER, {0, 0, 0.25}, 0.2},
    {SOLID_CAPSULE, {0, 0, 0.2}, 0.15},  {SOLID_CONE, {0, 0, 0.3}, 0.25},
    {SOLID_PLANE, {0, 0, 0}, 0}};
enum { SOLIDS = sizeof solids / sizeof solids[0] };

/* Depth of the deepest of many points: the search must not say "outside" when one is inside, and
 * when it says "inside" a fine enough grid finds that. */
static void test_solid_random(void **unused) {
    (void)unused;
    enum { ROUNDS = 4000, GRID = 40 };
    int inside = 0;
    for (int round = 0; round < ROUNDS; round++) {
        const Solid *solid = &solids[round % SOLIDS];
        Vec3 p[3], normal, at = vec3(draw(), draw(), draw());
        at = vec3_scale(0.5, at);
        Pose pose = {vec3(draw(), draw(), draw()),
                     quat_from_axis_angle(vec3(draw(), draw(), draw()), 3 * draw())};
        for (int k = 0; k < 3; k++) {
            p[k] = vec3_axpy(at, round % 2 ? 0.1 : 0.5, vec3(draw(), draw(), draw()));
        }
        double deepest = INFINITY;
        for (int i = 0; i <= GRID; i++) {
            for (int j = 0; i + j <= GRID; j++) {
                double u = (double)i / GRID, v = (double)j / GRID;
                Vec3 x = vec3_axpy(vec3_axpy(vec3_scale(u, p[0]), v, p[1]), 1 - u - v, p[2]);
                deepest = fmin(deepest, solid_distance(solid, x, &normal));
            }
        }
        bool found = reach(solid, pose, pose_apply(pose, p[0]), pose_apply(pose, p[1]),
                           pose_apply(pose, p[2]));
        inside += found;
        if ((deepest < -1e-9 && !found) || (found && deepest > 1.0 / GRID)) {
            fail_msg("round %d: deepest point %g, found %d", round, deepest, found);
        }
    }
    assert_true(inside > ROUNDS / 20);
}

static void test_solid_touching(void **unused) {
    (void)unused;
    Pose here = pose_identity();
    const double gaps[] = {1e-3, 1e-6, 1e-9, 0.0, -2e-10, -1e-6};
    for (int i = 0; i < 6; i++) {
        double z = 0.3 + gaps[i];
        int64_t expected = gaps[i] < 0.0;
        /* the tangent point is no corner */
        assert_int_equal(
            reach(&solids[0], here, vec3(-0.6, -0.7, z), vec3(0.9, -0.5, z), vec3(0, 0.8, z)),
            expected);
        /* across the sharp edge x = 0.3, z = 0.25 of the box, at 45 degrees */
        double g = gaps[i] * sqrt(2.0);
        assert_int_equal(reach(&solids[1], here, vec3(0.0, -0.1, 0.55 + g),
                               vec3(0.0, 0.1, 0.55 + g), vec3(0.55, 0, g)),
                         expected);
        /* the corner of the box pokes through the middle */
        assert_int_equal(reach(&solids[1], here, vec3(0.75 + 3 * gaps[i] / sqrt(3), 0, 0),
                               vec3(0, 0.75 + 3 * gaps[i] / sqrt(3), 0),
                               vec3(0, 0, 0.75 + 3 * gaps[i] / sqrt(3))),
                         expected);
        /* the cone's apex */
        assert_int_equal(
            reach(&solids[5], here, vec3(-0.6, -0.7, z), vec3(0.9, -0.5, z), vec3(0, 0.8, z)),
            expected);
        assert_int_equal(reach(&solids[6], here, vec3(0, 0, z - 0.3), vec3(1, 0, z), vec3(0, 1, 1)),
                         expected);
    }
}

/* ---- cost ---- */

/* Smallest CPU time of some rounds: the sheet with itself and with a ball. */
static double cost(Sheet *sheet, int n, Place *place) {
    const Solid ball = {SOLID_SPHERE, {0, 0, 0}, 0.3};
    Arena arena = {0};
    double best = INFINITY;
    sheet_place(sheet, n, place);
    for (int round = 0; round < 5; round++) {
        double start = clock_process_seconds();
        crossing_count_self(&sheet->mesh, &arena);
        crossing_count_solid(&sheet->mesh, &ball, pose_identity());
        best = fmin(best, clock_process_seconds() - start);
    }
    arena_free(&arena);
    return best;
}

static void test_cost(void **unused) {
    (void)unused;
#if !defined(__OPTIMIZE__) || defined(__SANITIZE_ADDRESS__)
    skip();
#endif
    Place *places[] = {place_flat, place_tilted, place_waves, place_folded, place_rolled};
    const int sizes[2] = {51, 101};
    const double limits_ms[2] = {50.0, 250.0};
    for (int i = 0; i < 2; i++) {
        Sheet sheet = sheet_create(sizes[i]);
        for (int k = 0; k < 5; k++) {
            double ms = 1e3 * cost(&sheet, sizes[i], places[k]);
            CHECK_AT_MOST(ms, limits_ms[i]);
        }
        sheet_free(&sheet);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_self),         cmocka_unit_test(test_between),
        cmocka_unit_test(test_damage),       cmocka_unit_test(test_inside),
        cmocka_unit_test(test_solid_random), cmocka_unit_test(test_solid_touching),
        cmocka_unit_test(test_cost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
