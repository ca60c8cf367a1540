/* Geometry: solids, stencils of points, triangles and outlines, the inside test. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/geom/closest.h"
#include "sim/geom/delaunay.h"
#include "sim/geom/inside.h"
#include "sim/geom/rbf.h"
#include "sim/geom/solid.h"
#include "tests/support/check.h"

/* ---- solids ---- */

static Solid solid_of(int kind) {
    return (Solid){(SolidKind)kind, {0.3, 0.2, 0.25}, kind == SOLID_BOX ? 0.05 : 0.15};
}

static Vec3 random_place(uint64_t seed, uint64_t i, double size) {
    return vec3(size * hash_random(seed, 3 * i), size * hash_random(seed, 3 * i + 1),
                size * hash_random(seed, 3 * i + 2));
}

typedef struct Known {
    int kind;
    Vec3 place, normal;
    double distance;
} Known;

static void test_solid_known_places(void **unused) {
    (void)unused;
    const double s = sqrt(0.5), t = sqrt(1.0 / 3.0), slant = hypot(0.15, 0.5);
    const Known known[] = {
        {SOLID_PLANE, {3, -2, 0.4}, {0, 0, 1}, 0.4},
        {SOLID_PLANE, {3, -2, -0.4}, {0, 0, 1}, -0.4},
        {SOLID_SPHERE, {0, -0.25, 0}, {0, -1, 0}, 0.1},
        {SOLID_SPHERE, {0.05, 0, 0}, {1, 0, 0}, -0.1},
        {SOLID_BOX, {0.4, 0.1, -0.1}, {1, 0, 0}, 0.1},
        {SOLID_BOX, {0.0, -0.19, 0.1}, {0, -1, 0}, -0.01},
        {SOLID_BOX, {0.25 + 0.1, 0.15 + 0.1, 0}, {s, s, 0}, 0.1 / s - 0.05},
        {SOLID_BOX, {0.35, -0.25, 0.3}, {t, -t, t}, 0.1 / t - 0.05},
        {SOLID_CYLINDER, {0.25, 0, 0.1}, {1, 0, 0}, 0.1},
        {SOLID_CYLINDER, {0.05, 0.05, -0.3}, {0, 0, -1}, 0.05},
        {SOLID_CYLINDER, {0, 0.25, 0.35}, {0, s, s}, 0.1 / s},
        {SOLID_CYLINDER, {0.01, 0, 0.24}, {0, 0, 1}, -0.01},
        {SOLID_CAPSULE, {0, 0.3, -0.2}, {0, 1, 0}, 0.15},
        {SOLID_CAPSULE, {0, 0, 0.5}, {0, 0, 1}, 0.1},
        {SOLID_CAPSULE, {0.3, 0, 0.55}, {s, 0, s}, 0.3 / s - 0.15},
        {SOLID_CONE, {0, 0, 0.45}, {0, 0, 1}, 0.2},
        {SOLID_CONE, {0.1, 0, -0.35}, {0, 0, -1}, 0.1},
        {SOLID_CONE,
         {0.125, 0, 0.015},
         {0.5 / slant, 0, 0.15 / slant},
         (0.5 * 0.125 + 0.15 * (0.015 - 0.25)) / slant},
        {SOLID_CONE, {0, 0.25, -0.25 - 0.1}, {0, s, -s}, 0.1 / s},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        Solid solid = solid_of(known[i].kind);
        Vec3 normal;
        double d = solid_distance(&solid, known[i].place, &normal);
        double away = vec3_length(vec3_sub(normal, known[i].normal));
        CHECK_NEAR(d, known[i].distance, 1e-14);
        CHECK_AT_MOST(away, 1e-12);
    }
}

/* the normal is the gradient of the distance, which is 1 long and continuous outside */
static void test_solid_gradient(void **unused) {
    (void)unused;
    const double step = 1e-6;
    for (int kind = 0; kind < SOLID_KIND_COUNT; kind++) {
        Solid solid = solid_of(kind);
        double worst = 0.0, worst_length = 0.0;
        int smooth = 0;
        for (uint64_t i = 0; i < 2000; i++) {
            Vec3 p = random_place(11, i, 0.6), normal, around[6];
            solid_distance(&solid, p, &normal);
            double d[6], turned = 0.0;
            for (int k = 0; k < 6; k++) {
                double shift = k % 2 ? -step : step;
                Vec3 q = vec3(p.x + (k / 2 == 0 ? shift : 0), p.y + (k / 2 == 1 ? shift : 0),
                              p.z + (k / 2 == 2 ? shift : 0));
                d[k] = solid_distance(&solid, q, &around[k]);
                turned = fmax(turned, vec3_length(vec3_sub(around[k], normal)));
            }
            worst_length = fmax(worst_length, fabs(vec3_length(normal) - 1.0));
            if (turned < 1e-3) { /* not across a ridge of the inside */
                Vec3 slope = vec3_scale(0.5 / step, vec3(d[0] - d[1], d[2] - d[3], d[4] - d[5]));
                worst = fmax(worst, vec3_length(vec3_sub(slope, normal)));
                smooth++;
            }
        }
        print_message("  %s\n", solid_names[kind]);
        CHECK_AT_MOST(worst, 1e-7);
        CHECK_AT_MOST(worst_length, 1e-12);
        CHECK_AT_MOST(1900, smooth);
    }
}

/* p - d n lies on the surface, and the solid is on one side of the plane through it */
static void test_solid_closest_and_support(void **unused) {
    (void)unused;
    for (int kind = 0; kind < SOLID_KIND_COUNT; kind++) {
        Solid solid = solid_of(kind);
        double worst_foot = 0.0, worst_support = 0.0, worst_bound = 0.0;
        for (uint64_t i = 0; i < 2000; i++) {
            Vec3 p = random_place(12, i, 0.6), normal, other;
            double d = solid_distance(&solid, p, &normal);
            Vec3 foot = vec3_axpy(p, -d, normal);
            worst_foot = fmax(worst_foot, fabs(solid_distance(&solid, foot, &other)));
            if (d > 0.0 && kind != SOLID_PLANE) {
                double reach = solid_support(&solid, normal);
                worst_support = fmax(worst_support, fabs(vec3_dot(foot, normal) - reach));
                worst_bound = fmax(worst_bound, vec3_length(foot) - solid_bound(&solid));
            }
        }
        print_message("  %s\n", solid_names[kind]);
        CHECK_AT_MOST(worst_foot, 1e-14);
        CHECK_AT_MOST(worst_support, 1e-14);
        CHECK_AT_MOST(worst_bound, 1e-14);
    }
    Solid plane = solid_of(SOLID_PLANE);
    CHECK_NEAR(solid_support(&plane, vec3(0, 0, 1)), 0.0, 0.0);
    assert_true(isinf(solid_support(&plane, vec3(1, 0, 0))));
    assert_true(isinf(solid_support(&plane, vec3(0, 0, -1))));
}

/* ---- points ---- */

enum { SIDE = 21 };

static void lattice_fill(double *points, double h) {
    for (int i = 0; i < SIDE * SIDE; i++) {
        points[2 * i] = h * (i % SIDE);
        points[2 * i + 1] = h * (i / SIDE);
    }
}

/* small and large triangles at a sphere, outside and across it, some with a corner twice: nearest is what is
 * nearest to the middle, on the face as on every side */
static void test_triangle_at_sphere(void **unused) {
    (void)unused;
    const Solid ball = {SOLID_SPHERE, {0, 0, 0}, 0.3};
    int features[8] = {0};
    for (uint64_t i = 0; i < 20000; i++) {
        Vec3 x[3], n[3], nearest = {0, 0, 0}, middle = random_place(22, i, 0.6);
        double d[3], w[3], size = i % 3 == 0 ? 1.0 : 0.05;
        for (uint64_t c = 0; c < 3; c++) {
            x[c] = vec3_add(middle, random_place(23, 3 * i + c, size));
            x[c] = i % 101 == 0 && c == 2 ? x[1] : x[c];
            d[c] = solid_distance(&ball, x[c], &n[c]);
        }
        SolidNearest found = solid_nearest_on_triangle(&ball, x, d, n);
        closest_on_triangle(vec3(0, 0, 0), x[0], x[1], x[2], w);
        for (int c = 0; c < 3; c++) {
            nearest = vec3_axpy(nearest, w[c], x[c]);
        }
        features[found.feature]++;
        assert_true(fabs(found.distance - (vec3_length(nearest) - ball.radius)) < 1e-13);
        for (int k = 0; k < 3; k++) {
            Vec3 along = vec3_sub(x[(k + 1) % 3], x[k]);
            double at = -vec3_dot(x[k], along) / vec3_dot(along, along);
            Vec3 p = vec3_axpy(x[k], at, along);
            if (at > 1e-6 && at < 1.0 - 1e-6) {
                assert_true(fabs(found.side[k].distance - (vec3_length(p) - ball.radius)) < 1e-13);
            }
        }
    }
    for (int f = 1; f < 8; f++) {
        assert_true(features[f] > 100);
    }
}

static void test_nearest_takes_ties(void **unused) {
    (void)unused;
    const double h = 0.07;
    double points[2 * SIDE * SIDE];
    lattice_fill(points, h);
    Arena arena = {0};
    PointGrid grid = points_grid(points, SIDE * SIDE, h, &arena);
    /* whole shells around a node, a middle of a cell, a corner of the lattice */
    const struct {
        double at[2];
        int wanted, count;
    } cases[] = {{{10, 10}, 1, 1},      {{10, 10}, 2, 5},   {{10, 10}, 6, 9},
                 {{10, 10}, 10, 13},    {{10, 10}, 14, 21}, {{10.5, 10.5}, 1, 4},
                 {{10.5, 10.5}, 5, 12}, {{0, 0}, 2, 3},     {{0, 0}, 7, 8}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        int nodes[STENCIL_CAPACITY];
        double at[2] = {h * cases[i].at[0], h * cases[i].at[1]};
        assert_int_equal(points_nearest(&grid, at, cases[i].wanted, nodes), cases[i].count);
    }
    arena_free(&arena);
}

static int compare_numbers(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* against sorting all points; also from far outside */
static void test_nearest_is_nearest(void **unused) {
    (void)unused;
    enum { COUNT = 300, WANTED = 20 };
    double points[2 * COUNT], squares[COUNT];
    for (int i = 0; i < 2 * COUNT; i++) {
        points[i] = hash_random(13, (uint64_t)i);
    }
    Arena arena = {0};
    PointGrid grid = points_grid(points, COUNT, 2.0 / sqrt(COUNT), &arena);
    for (uint64_t place = 0; place < 100; place++) {
        double at[2] = {3 * hash_random(14, place), 3 * hash_random(15, place)};
        int nodes[STENCIL_CAPACITY];
        assert_int_equal(points_nearest(&grid, at, WANTED, nodes), WANTED);
        for (int i = 0; i < COUNT; i++) {
            double u = points[2 * i] - at[0], v = points[2 * i + 1] - at[1];
            squares[i] = u * u + v * v;
        }
        for (int k = 1; k < WANTED; k++) {
            assert_true(squares[nodes[k]] >= squares[nodes[k - 1]]);
        }
        double last = squares[nodes[WANTED - 1]];
        qsort(squares, COUNT, sizeof *squares, compare_numbers);
        CHECK_NEAR(last, squares[WANTED - 1], 0.0);
    }
    arena_free(&arena);
}

/* on two lines no quadratic is determined: rows of a lower degree, which still keep planes */
static void test_rows_of_few_nodes(void **unused) {
    (void)unused;
    const double h = 0.01;
    double points[2 * 16], at[2] = {2.3 * h, 0.4 * h}, rows[3][STENCIL_CAPACITY];
    const RbfFunctional parts[3] = {RBF_VALUE, RBF_D1, RBF_D2};
    for (int i = 0; i < 16; i++) {
        points[2 * i] = h * (i / 2);
        points[2 * i + 1] = h * (i % 2);
    }
    Arena arena = {0};
    for (int count = 3; count <= 16; count++) {
        PointGrid grid = points_grid(points, count, h, &arena);
        RbfStencil stencil = rbf_stencil(&grid, rbf_scattered_membrane, at, &arena);
        assert_int_equal(stencil.kind.degree, 1);
        rbf_rows(&stencil, at, 3, parts, rows);
        double sum[3] = {0};
        for (int k = 0; k < stencil.count; k++) {
            const double *p = points + 2 * stencil.nodes[k];
            for (int r = 0; r < 3; r++) {
                sum[r] += rows[r][k] * (1.0 + 2.0 * p[0] / h - 3.0 * p[1] / h);
            }
        }
        CHECK_NEAR(sum[0], 1.0 + 2.0 * 2.3 - 3.0 * 0.4, 1e-12);
        CHECK_NEAR(sum[1] * h, 2.0, 1e-12);
        CHECK_NEAR(sum[2] * h, -3.0, 1e-12);
    }
    arena_free(&arena);
}

/* ---- triangles and outlines ---- */

static void test_delaunay(void **unused) {
    (void)unused;
    enum { COUNT = 200 };
    double points[2 * COUNT], area = 0.0;
    for (int i = 0; i < 2 * COUNT; i++) {
        points[i] = hash_random(16, (uint64_t)i);
    }
    const double corners[8] = {-1, -1, 1, -1, 1, 1, -1, 1};
    memcpy(points, corners, sizeof corners);
    Arena arena = {0};
    int *triangles, count;
    assert_true(delaunay_triangulate(points, COUNT, &arena, &triangles, &count));
    assert_int_equal(count, 2 * COUNT - 2 - 4); /* Euler, four corners on the hull */
    for (int t = 0; t < count; t++) {
        const double *a = points + 2 * triangles[3 * t], *b = points + 2 * triangles[3 * t + 1];
        const double *c = points + 2 * triangles[3 * t + 2];
        double bu = b[0] - a[0], bv = b[1] - a[1], cu = c[0] - a[0], cv = c[1] - a[1];
        double twice = bu * cv - bv * cu, b2 = bu * bu + bv * bv, c2 = cu * cu + cv * cv;
        assert_true(twice > 0.0);
        area += 0.5 * twice;
        double u = 0.5 * (cv * b2 - bv * c2) / twice, v = 0.5 * (bu * c2 - cu * b2) / twice;
        for (int i = 0; i < COUNT; i++) { /* nobody inside the circle around it */
            double away = hypot(points[2 * i] - a[0] - u, points[2 * i + 1] - a[1] - v);
            assert_true(away > hypot(u, v) * (1.0 - 1e-9));
        }
    }
    CHECK_NEAR(area, 4.0, 1e-12);
    const double line[8] = {0, 0, 1, 1, 2, 2, 3, 3};
    assert_false(delaunay_triangulate(line, 4, &arena, &triangles, &count));
    assert_false(delaunay_triangulate(points, 2, &arena, &triangles, &count));
    arena_free(&arena);
}

typedef struct Outline {
    const char *name;
    int loop_count, begin[3];
    double points[2 * 8];
    double area;
} Outline;

static const Outline outlines[] = {
    {"square", 1, {0, 4, 4}, {0, 0, 1, 0, 1, 1, 0, 1}, 1.0},
    {"square with a hole",
     2,
     {0, 4, 8},
     {0, 0, 1, 0, 1, 1, 0, 1, 0.3, 0.3, 0.3, 0.7, 0.7, 0.7, 0.7, 0.3},
     0.84},
    {"L", 1, {0, 6, 6}, {0, 0, 1, 0, 1, 0.5, 0.5, 0.5, 0.5, 1, 0, 1}, 0.75},
};
#define OUTLINE_COUNT 3

static void test_loops(void **unused) {
    (void)unused;
    for (int k = 0; k < OUTLINE_COUNT; k++) {
        const Outline *o = &outlines[k];
        CHECK_NEAR(loops_area(o->points, o->begin, o->loop_count), o->area, 1e-15);
        const double middle[2] = {0.51, 0.51}, corner[2] = {0.05, 0.02}, away[2] = {1.3, 1.4};
        assert_int_equal(loops_contain(o->points, o->begin, o->loop_count, middle), k == 0);
        assert_true(loops_contain(o->points, o->begin, o->loop_count, corner));
        assert_false(loops_contain(o->points, o->begin, o->loop_count, away));
        CHECK_NEAR(loops_distance(o->points, o->begin, o->loop_count, corner), 0.02, 1e-15);
        CHECK_NEAR(loops_distance(o->points, o->begin, o->loop_count, away),
                   k == 2 ? hypot(0.8, 0.4) : 0.5, 1e-15);
    }
}

/* ---- inside or outside, from the nodes alone ---- */

#define SPACING 0.05
#define NEAR_CORNER (2.5 * SPACING) /* the reach of the weights */

/* lattice nodes of the outline; those off the border shifted by up to `jitter` */
static int fill_nodes(const Outline *o, double jitter, double *nodes) {
    int count = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
        double p[2] = {SPACING * (i % SIDE), SPACING * (i / SIDE)};
        double away = loops_distance(o->points, o->begin, o->loop_count, p);
        if (away > 1e-9 && !loops_contain(o->points, o->begin, o->loop_count, p)) {
            continue;
        }
        for (int c = 0; c < 2; c++) {
            double shift = away > 1e-9 ? jitter * hash_random(17, (uint64_t)(2 * i + c)) : 0.0;
            nodes[2 * count + c] = p[c] + shift;
        }
        count++;
    }
    return count;
}

/* Among places over twice the width of the square; mlpg.md does not say over which. All mistakes
 * lie near the border, so the share goes with 1 / area: within two cells around the square it is
 * 2.8 times as large. */
static double share_wrong(const Outline *o, const PointGrid *grid) {
    enum { PLACES = 20000 };
    int wrong = 0;
    for (uint64_t i = 0; i < PLACES; i++) {
        double p[2] = {0.5 + hash_random(18, i), 0.5 + hash_random(19, i)};
        wrong += inside_contains(grid, p) != loops_contain(o->points, o->begin, o->loop_count, p);
    }
    return (double)wrong / PLACES;
}

/* loops run anticlockwise, all but the hole: there every corner is re-entrant */
static bool is_reentrant(const Outline *o, int corner) {
    int loop = corner >= o->begin[1], first = o->begin[loop], n = o->begin[loop + 1] - first;
    const double *a = o->points + 2 * (first + (corner - first + n - 1) % n);
    const double *b = o->points + 2 * corner;
    const double *c = o->points + 2 * (first + (corner - first + 1) % n);
    return (b[0] - a[0]) * (c[1] - b[1]) < (b[1] - a[1]) * (c[0] - b[0]);
}

static bool near_reentrant(const Outline *o, const double p[2]) {
    for (int i = 0; i < o->begin[o->loop_count]; i++) {
        if (is_reentrant(o, i) &&
            hypot(p[0] - o->points[2 * i], p[1] - o->points[2 * i + 1]) < NEAR_CORNER) {
            return true;
        }
    }
    return false;
}

/* largest distance from the border, in spacings, of a place that is misjudged, within reach of a
 * re-entrant corner or not */
static double border_error(const Outline *o, const PointGrid *grid, bool corners) {
    enum { PLACES = 40000 };
    double worst = 0.0;
    for (uint64_t i = 0; i < PLACES; i++) {
        double p[2] = {0.5 + 0.55 * hash_random(20, i), 0.5 + 0.55 * hash_random(21, i)};
        double away = loops_distance(o->points, o->begin, o->loop_count, p);
        if (away > worst && away < SPACING && near_reentrant(o, p) == corners &&
            inside_contains(grid, p) != loops_contain(o->points, o->begin, o->loop_count, p)) {
            worst = away;
        }
    }
    return worst / SPACING;
}

static void test_inside(void **unused) {
    (void)unused;
    for (int k = 0; k < 2 * OUTLINE_COUNT; k++) {
        const Outline *o = &outlines[k / 2];
        double nodes[2 * SIDE * SIDE];
        Arena arena = {0};
        int count = fill_nodes(o, k % 2 ? 0.25 * SPACING : 0.0, nodes);
        PointGrid grid = points_grid(nodes, count, SPACING, &arena);
        print_message("  %s, %s\n", o->name, k % 2 ? "jittered" : "regular");
        double wrong = share_wrong(o, &grid);
        double border = border_error(o, &grid, false), corner = border_error(o, &grid, true);
        CHECK_AT_MOST(wrong, 0.005);
        CHECK_AT_MOST(border, 0.25); /* at convex corners as well */
        CHECK_AT_MOST(corner, 0.5);  /* re-entrant ones are filled */
        arena_free(&arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_solid_known_places),
        cmocka_unit_test(test_solid_gradient),
        cmocka_unit_test(test_solid_closest_and_support),
        cmocka_unit_test(test_triangle_at_sphere),
        cmocka_unit_test(test_nearest_takes_ties),
        cmocka_unit_test(test_nearest_is_nearest),
        cmocka_unit_test(test_rows_of_few_nodes),
        cmocka_unit_test(test_delaunay),
        cmocka_unit_test(test_loops),
        cmocka_unit_test(test_inside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
