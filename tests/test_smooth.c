/* Projection on the smooth surface of a panel, with known answers. */
#include <math.h>

#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "sim/geom/smooth.h"
#include "tests/support/check.h"

#define RADIUS 0.1
#define MOST_NODES 4000
#define POINTS 200

typedef struct Worst {
    double gap, place, normal;
    int lost, misplaced; /* without a projection; on the wrong side of the border */
} Worst;

static double share(uint64_t seed, uint64_t k) { return 0.5 + 0.5 * hash_random(seed, k); }

/* A bent panel u, v in [0, size] on a cylinder, n x n nodes; size one turn: closed. Points up to a fifth of
 * the radius off the surface, from a start that is a spacing away. */
static Worst project_all(int n, bool closed, double margin) {
    static double material[2 * MOST_NODES], x[3 * MOST_NODES];
    double size = closed ? 2.0 * acos(-1.0) * RADIUS : 0.2, h = size / (closed ? n : n - 1);
    for (int i = 0; i < n * n; i++) {
        double u = i % n * h, v = i / n * h, angle = u / RADIUS;
        material[2 * i] = u, material[2 * i + 1] = v;
        vec3_store(x + 3 * i, vec3(RADIUS * cos(angle), RADIUS * sin(angle), v));
    }
    Arena arena = {0};
    Worst worst = {0};
    SmoothSurface s = smooth_create(material, n * n, h, closed ? size : 0.0, &arena);
    for (uint64_t k = 0; k < POINTS; k++) {
        double across = closed ? 0.0 : margin;
        double u = across + (size - 2.0 * across) * share(1, k);
        double v = margin + (size - h - 2.0 * margin) * share(2, k);
        double off = 0.2 * RADIUS * hash_random(3, k), angle = u / RADIUS;
        double start[2] = {u + 0.5 * h * hash_random(4, k), v + 0.5 * h * hash_random(5, k)};
        Vec3 up = {cos(angle), sin(angle), 0.0}, p = vec3_scale(RADIUS + off, up);
        SmoothPoint found;
        p.z = v;
        if (!smooth_project(&s, x, p, start, &arena, &found)) {
            worst.lost++;
            continue;
        }
        worst.gap = fmax(worst.gap, fabs(found.gap - off));
        worst.place = fmax(worst.place, hypot(found.at[0] - u, found.at[1] - v));
        worst.normal = fmax(worst.normal, vec3_length(vec3_sub(found.normal, up)));
        worst.misplaced += !found.inside;
    }
    arena_free(&arena);
    return worst;
}

static void test_cylinder(void **unused) {
    (void)unused;
    Worst coarse = project_all(21, false, 0.02), fine = project_all(41, false, 0.02);
    assert_int_equal(coarse.lost + fine.lost + coarse.misplaced + fine.misplaced, 0);
    CHECK_AT_MOST(coarse.gap / RADIUS, 1e-5); /* triangles: h^2 / 8 R^2 = 1.2e-3 */
    CHECK_AT_MOST(coarse.place / RADIUS, 1e-3);
    CHECK_AT_MOST(coarse.normal, 1e-3);
    CHECK_AT_MOST(3.0 - log2(coarse.gap / fine.gap), 0.0); /* order */
}

/* the seam of a closed panel is like any other place */
static void test_seam(void **unused) {
    (void)unused;
    Worst closed = project_all(63, true, 0.05);
    assert_int_equal(closed.lost + closed.misplaced, 0);
    CHECK_AT_MOST(closed.gap / RADIUS, 1e-5);
    CHECK_AT_MOST(closed.normal, 1e-3);
}

/* above the border and beyond it */
static void test_border(void **unused) {
    (void)unused;
    enum { SIDE = 12 };
    double material[2 * SIDE * SIDE], x[3 * SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) {
        material[2 * i] = 0.01 * (i % SIDE), material[2 * i + 1] = 0.01 * (int)(i / SIDE);
        vec3_store(x + 3 * i, vec3(material[2 * i], material[2 * i + 1], 0.0));
    }
    Arena arena = {0};
    SmoothSurface s = smooth_create(material, SIDE * SIDE, 0.01, 0.0, &arena);
    for (int k = -8; k <= 8; k++) {
        double beyond = 0.001 * k, start[2] = {0.105, 0.05};
        SmoothPoint found;
        assert_true(smooth_project(&s, x, vec3(0.11 + beyond, 0.05, 0.002), start, &arena, &found));
        CHECK_AT_MOST(fabs(found.gap - 0.002), 1e-12);
        if (fabs(beyond) > 0.0025) { /* a quarter of the spacing */
            assert_int_equal(found.inside, beyond < 0.0);
        }
    }
    arena_free(&arena);
}

int main(int argc, char **argv) {
    (void)argc;
    parallel_fix_environment(argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cylinder),
        cmocka_unit_test(test_seam),
        cmocka_unit_test(test_border),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
