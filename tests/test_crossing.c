/* The exact check of two triangles: predicates against rationals, built cases, random triangles on
 * a coarse grid (full of special positions) against a brute-force test in integers. */
#include "sim/base/hash.h"
#include "sim/geom/crossing.h"
#include "sim/geom/exact.h"
#include "tests/support/check.h"

static uint64_t drawn;

static double draw(void) { return hash_random(11, drawn++); } /* -1 .. 1 */
static int draw_int(int count) {
    int i = (int)((0.5 * draw() + 0.5) * count);
    return i < count ? i : count - 1;
}

/* ---- predicates ---- */

static void test_predicates(void **unused) {
    (void)unused;
    const double scales[] = {1.0, 1e-3, 1e-60, 1e-110, 1e-160, 1e60, 1e120};
    int zero = 0;
    for (int round = 0; round < 40000; round++) {
        double p[4][3], scale = scales[round % 7], s = draw(), t = draw();
        for (int i = 0; i < 4; i++) {
            for (int k = 0; k < 3; k++) {
                p[i][k] = scale * (round % 3 ? draw() : draw_int(3));
            }
        }
        if (round % 2) { /* in one plane, but for rounding */
            for (int k = 0; k < 3; k++) {
                p[3][k] = p[0][k] + s * (p[1][k] - p[0][k]) + t * (p[2][k] - p[0][k]);
            }
        }
        int expected = exact_orient3d_rational(p[0], p[1], p[2], p[3]);
        zero += expected == 0;
        assert_int_equal(exact_orient3d(p[0], p[1], p[2], p[3]), expected);
        assert_int_equal(exact_orient3d(p[1], p[2], p[0], p[3]), expected);
        assert_int_equal(exact_orient3d(p[1], p[0], p[2], p[3]), -expected);
        for (int drop = 0; drop < 3; drop++) {
            assert_int_equal(exact_orient2d(p[0], p[1], p[3], drop),
                             exact_orient2d_rational(p[0], p[1], p[3], drop));
        }
    }
    assert_true(zero > 1000);
    const double o[3] = {0, 0, 0}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1};
    assert_int_equal(exact_orient3d(o, x, y, z), 1);
    assert_int_equal(exact_orient2d(o, x, y, 2), 1);
    assert_int_equal(exact_orient2d(o, y, z, 0), 1);
    assert_int_equal(exact_orient2d(o, z, x, 1), 1);
}

/* ---- built cases ---- */

typedef struct Built {
    const char *name;
    double p[3][3], q[3][3]; /* shared corners stand first, in the same order */
    int shared;
    bool cross;
} Built;

#define TINY 0x1p-52
static const Built built[] = {
    {"vertex touches the inside",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{1, 1, 0}, {1, 1, 1}, {2, 1, 1}},
     0,
     true},
    {"vertex a hair above",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{1, 1, TINY}, {1, 1, 1}, {2, 1, 1}},
     0,
     false},
    {"vertex a hair below",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{1, 1, -TINY}, {1, 1, 1}, {2, 1, 1}},
     0,
     true},
    {"vertex touches a vertex",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{0, 0, 0}, {-1, 0, 1}, {-1, 1, 1}},
     0,
     true},
    {"vertex touches an edge",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{2, 2, 0}, {3, 3, 1}, {4, 3, 1}},
     0,
     true},
    {"vertex beside that edge",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{2, 2 + 2 * TINY, 0}, {3, 3, 1}, {4, 3, 1}},
     0,
     false},
    {"edge crosses an edge",
     {{0, 0, 0}, {2, 2, 0}, {0, 4, 0}},
     {{2, 0, 0}, {0, 2, 0}, {3, 0, -5}},
     0,
     true},
    {"edge in the plane, inside",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{1, 1, 0}, {2, 1, 0}, {1, 1, 3}},
     0,
     true},
    {"edge in the plane, outside",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{5, 0, 0}, {5, 3, 0}, {5, 1, 3}},
     0,
     false},
    {"edge in the plane, passing through",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{-1, 1, 0}, {9, 1, 0}, {5, 1, 3}},
     0,
     true},
    {"edge pierces",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{1, 1, -1}, {1, 1, 1}, {9, 9, 1}},
     0,
     true},
    {"planes cross, triangles apart",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{5, 5, -1}, {5, 5, 1}, {6, 5, 0}},
     0,
     false},
    {"coplanar, overlapping",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{1, 1, 0}, {5, 1, 0}, {1, 5, 0}},
     0,
     true},
    {"coplanar, one inside the other",
     {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}},
     {{1, 1, 0}, {2, 1, 0}, {1, 2, 0}},
     0,
     true},
    {"coplanar, edges touching",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{1, 0, 0}, {3, 0, 0}, {2, -1, 0}},
     0,
     true},
    {"coplanar, apart",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{4, 4, 0}, {4, 1, 0}, {1, 4, 0}},
     0,
     false},
    {"parallel, a hair apart",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{0, 0, TINY}, {4, 0, TINY}, {0, 4, TINY}},
     0,
     false},
    {"twice the same, other numbers",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{4, 0, 0}, {0, 0, 0}, {0, 4, 0}},
     0,
     true},
    {"a collinear triangle 27 mm away",
     {{0, 0, 0.1}, {0.3, 0, 0.1}, {0.1, 0, 0.1}},
     {{0.327, 0, 0.1}, {0.4, 0, 0.1}, {0.4, 0.1, 0.1}},
     0,
     false},
    {"the same, tilted",
     {{0.1, 0.1, 0.1}, {0.4, 0.4, 0.4}, {0.2, 0.2, 0.2}},
     {{0.427, 0.427, 0.427}, {0.5, 0.5, 0.5}, {0.5, 0.6, 0.5}},
     0,
     false},
    {"a collinear triangle that pierces",
     {{1, 1, -1}, {1, 1, 3}, {1, 1, 2}},
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     0,
     true},
    {"a collinear triangle that lies in it",
     {{1, 1, 0}, {2, 1, 0}, {9, 1, 0}},
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     0,
     true},
    {"two collinear ones, crossing",
     {{0, 0, 0}, {2, 2, 2}, {1, 1, 1}},
     {{2, 0, 2}, {0, 2, 0}, {1, 1, 1}},
     0,
     true},
    {"two collinear ones, one line, apart",
     {{0, 0, 0}, {2, 2, 2}, {1, 1, 1}},
     {{3, 3, 3}, {5, 5, 5}, {4, 4, 4}},
     0,
     false},
    {"a point in it",
     {{1, 1, 0}, {1, 1, 0}, {1, 1, 0}},
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     0,
     true},
    {"a point beside it",
     {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}},
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     0,
     false},
    {"sharing a vertex",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {-1, 0, 1}, {0, -1, 1}},
     1,
     false},
    {"sharing a vertex, flat, apart",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}},
     1,
     false},
    {"sharing a vertex, flat, overlapping",
     {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}},
     {{0, 0, 0}, {1, 1, 0}, {-1, 1, 0}},
     1,
     true},
    {"sharing a vertex, an edge along an edge",
     {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}},
     {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}},
     1,
     true},
    {"sharing a vertex, piercing elsewhere",
     {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
     {{0, 0, 0}, {1, 1, 1}, {1, 1, -1}},
     1,
     true},
    {"sharing a vertex, piercing beyond",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {4, 4, 1}, {4, 4, -1}},
     1,
     true},
    {"sharing a vertex with a collinear one",
     {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
     {{0, 0, 0}, {-1, 0, 0}, {0, 1, 0}},
     1,
     false},
    {"sharing an edge",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 1}},
     2,
     false},
    {"sharing an edge, flat",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {1, 0, 0}, {0, -1, 0}},
     2,
     false},
    {"sharing an edge, folded flat",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {1, 0, 0}, {3, 2, 0}},
     2,
     true},
    {"sharing an edge, folded but for a hair",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {1, 0, 0}, {3, 2, TINY}},
     2,
     false},
    {"the same triangle",
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
     3,
     true},
};

static CrossingTriangle corners(const double p[3][3], const int order[3]) {
    return (CrossingTriangle){{p[order[0]], p[order[1]], p[order[2]]}};
}

/* Every order of the corners that leaves the shared ones first, both ways round. */
static void check_case(const char *name, const double p[3][3], const double q[3][3], int shared,
                       bool cross) {
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                     {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) {
            bool fits = true;
            for (int k = 0; k < shared; k++) {
                fits = fits && orders[i][k] == orders[j][k] && orders[i][k] < shared;
            }
            CrossingTriangle a = corners(p, orders[i]), b = corners(q, orders[j]);
            if (fits && (crossing_triangles_sharing(&a, &b, shared) != cross ||
                         crossing_triangles_sharing(&b, &a, shared) != cross)) {
                fail_msg("%s (orders %d %d): expected %s", name, i, j, cross ? "crossing" : "none");
            }
        }
    }
}

static void test_built(void **unused) {
    (void)unused;
    for (size_t i = 0; i < sizeof built / sizeof built[0]; i++) {
        const Built *one = &built[i];
        check_case(one->name, one->p, one->q, one->shared, one->cross);
    }
}

/* ---- brute force in integers ---- */

__extension__ typedef __int128 Wide;
typedef struct Ints {
    Wide v[3];
} Ints;

static Ints sub(Ints a, Ints b) {
    return (Ints){{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2]}};
}
static Wide dot(Ints a, Ints b) { return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2]; }
static Ints cross(Ints a, Ints b) {
    return (Ints){{a.v[1] * b.v[2] - a.v[2] * b.v[1], a.v[2] * b.v[0] - a.v[0] * b.v[2],
                   a.v[0] * b.v[1] - a.v[1] * b.v[0]}};
}
static bool zero(Ints a) { return dot(a, a) == 0; }

static bool in_segment(Ints a, Ints b) { return zero(cross(a, b)) && dot(a, b) <= 0; }

/* w = s b + t c with s, t >= 0 */
static bool in_cone(Ints w, Ints b, Ints c) {
    Ints n = cross(b, c);
    if (zero(n)) {
        return (zero(cross(w, b)) && dot(w, b) > 0) || (zero(cross(w, c)) && dot(w, c) > 0);
    }
    return dot(n, w) == 0 && dot(cross(b, w), n) >= 0 && dot(cross(w, c), n) >= 0;
}

static bool in_triangle(Ints a, Ints b, Ints c) {
    Ints n = cross(sub(b, a), sub(c, a));
    return !zero(n) && dot(n, a) == 0 && dot(cross(a, b), n) >= 0 && dot(cross(b, c), n) >= 0 &&
           dot(cross(c, a), n) >= 0;
}

static bool in_tetrahedron(const Ints p[4]) {
    int least = 1, most = -1;
    for (int k = 0; k < 4; k++) {
        Ints a = p[(k + 1) % 4], b = p[(k + 2) % 4], c = p[(k + 3) % 4];
        Ints n = cross(sub(b, a), sub(c, a));
        Wide whole = dot(n, sub(p[k], a)), part = dot(n, sub((Ints){{0, 0, 0}}, a));
        if (whole == 0) {
            return false;
        }
        int sign = part == 0 ? 0 : (part > 0) == (whole > 0) ? 1 : -1;
        least = sign < least ? sign : least;
        most = sign > most ? sign : most;
    }
    return least >= 0;
}

/* A and B meet when the origin is in the hull of all differences: in one of the simplices that
 * these nine points span [Caratheodory]. */
static bool meet_by_force(const Ints p[3], const Ints q[3]) {
    Ints d[9];
    for (int i = 0; i < 9; i++) {
        d[i] = sub(p[i / 3], q[i % 3]);
        if (zero(d[i])) {
            return true;
        }
    }
    for (int i = 0; i < 9; i++) {
        for (int j = i + 1; j < 9; j++) {
            if (in_segment(d[i], d[j])) {
                return true;
            }
            for (int k = j + 1; k < 9; k++) {
                if (in_triangle(d[i], d[j], d[k])) {
                    return true;
                }
                for (int m = k + 1; m < 9; m++) {
                    if (in_tetrahedron((Ints[4]){d[i], d[j], d[k], d[m]})) {
                        return true;
                    }
                }
            }
        }
    }
    return false;
}

/* sharing corner 0: a direction that is in both cones, among those that bound their overlap */
static bool cones_by_force(const Ints p[3], const Ints q[3]) {
    Ints b = sub(p[1], p[0]), c = sub(p[2], p[0]), d = sub(q[1], p[0]), e = sub(q[2], p[0]);
    Ints line = cross(cross(b, c), cross(d, e));
    Ints tries[6] = {b, c, d, e, line, sub((Ints){{0, 0, 0}}, line)};
    for (int i = 0; i < 6; i++) {
        if (!zero(tries[i]) && in_cone(tries[i], b, c) && in_cone(tries[i], d, e)) {
            return true;
        }
    }
    return false;
}

/* sharing corners 0 and 1 */
static bool edge_by_force(const Ints p[3], const Ints q[3]) {
    Ints u = sub(p[1], p[0]), c = sub(p[2], p[0]), d = sub(q[2], p[0]);
    Ints n = cross(u, c), m = cross(u, d);
    if (zero(u)) {
        return !zero(c) && !zero(d) && zero(cross(c, d)) && dot(c, d) > 0;
    }
    if (!zero(n) && !zero(m)) {
        return dot(n, d) == 0 && dot(n, m) > 0;
    }
    Wide at_c = dot(u, c), at_d = dot(u, d), whole = dot(u, u);
    return zero(n) && zero(m) && ((at_c > whole && at_d > whole) || (at_c < 0 && at_d < 0));
}

/* `range` values a coordinate, at a scale and place where doubles still hold them exactly */
static int random_rounds(int rounds, int range, double scale, double shift) {
    int crossings = 0;
    for (int round = 0; round < rounds; round++) {
        Ints p[3], q[3];
        double a[3][3], b[3][3];
        int shared = round % 3;
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < 3; k++) {
                p[i].v[k] = draw_int(range);
                q[i].v[k] = i < shared ? p[i].v[k] : draw_int(range);
                a[i][k] = shift + scale * (double)p[i].v[k];
                b[i][k] = shift + scale * (double)q[i].v[k];
            }
        }
        bool expected = shared == 0   ? meet_by_force(p, q)
                        : shared == 1 ? cones_by_force(p, q)
                                      : edge_by_force(p, q);
        crossings += expected;
        check_case("random", (const double(*)[3])a, (const double(*)[3])b, shared, expected);
    }
    return crossings;
}

static void test_random(void **unused) {
    (void)unused;
    assert_true(random_rounds(6000, 2, 1.0, 0.0) > 1000);
    assert_true(random_rounds(12000, 3, 0x1p-9, 0.0) > 1000);
    assert_true(random_rounds(12000, 5, 0x1p-40, 1.0) > 1000);
    assert_true(random_rounds(6000, 1 << 15, 0x1p-30, 0x1p20) > 300);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_predicates),
        cmocka_unit_test(test_built),
        cmocka_unit_test(test_random),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
