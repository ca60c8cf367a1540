/* measure --gaps: both detections against gaps that are known. */
#include <math.h>
#include <string.h>

#include "render/gaps.h"
#include "tests/support/check.h"

enum { SIDE = 9, SHEET = SIDE * SIDE, NODES = 2 * SHEET, TRIANGLES = 4 * (SIDE - 1) * (SIDE - 1) };
#define SPACING 0.01
#define BALL 0.3 /* [m] radius of the ball that both sheets lie on */

static const int32_t lattice[8] = {SIDE, SIDE, 0, 0, SIDE, SIDE, 0, 0};
static const int32_t node_begin[3] = {0, SHEET, NODES};
static const int32_t triangle_begin[3] = {0, TRIANGLES / 2, TRIANGLES};
static int32_t triangles[3 * TRIANGLES];
static double material[2 * NODES], x[3 * NODES];
static StateCloth cloths[2] = {{.name = "lower"}, {.name = "upper"}};
static StateObstacle ball = {.name = "ball", .solid = {SOLID_SPHERE, {0, 0, 0}, BALL}};
static StateHeader header = {
    .cloth_count = 2, .cloths = cloths, .obstacle_count = 1, .obstacles = &ball};
static StateLayout layout = {.cloth_count = 2,
                             .node_count = NODES,
                             .vertex_count = NODES,
                             .triangle_count = TRIANGLES,
                             .lattice = lattice,
                             .node_begin = node_begin,
                             .vertex_begin = node_begin,
                             .triangle_begin = triangle_begin,
                             .material = material,
                             .vertex_material = material,
                             .triangles = triangles};

static void make_sheets(void) {
    for (int i = 0; i < NODES; i++) {
        material[2 * i] = SPACING * (i % SIDE);
        material[2 * i + 1] = SPACING * (int)(i % SHEET / SIDE);
    }
    int32_t *next = triangles;
    for (int s = 0; s < 2; s++) {
        for (int c = 0; c < (SIDE - 1) * (SIDE - 1); c++) {
            int a = s * SHEET + c / (SIDE - 1) * SIDE + c % (SIDE - 1);
            const int32_t both[6] = {a, a + 1, a + SIDE + 1, a, a + SIDE + 1, a + SIDE};
            memcpy(next, both, sizeof both);
            next += 6;
        }
    }
}

/* nodes of one sheet above the ball by `height` [m] */
static void place_sheet(int sheet, double height) {
    for (int i = sheet * SHEET; i < (sheet + 1) * SHEET; i++) {
        double u = material[2 * i] - 0.5 * SPACING * (SIDE - 1);
        double v = material[2 * i + 1] - 0.5 * SPACING * (SIDE - 1);
        Vec3 p = {u, v, sqrt(BALL * BALL - u * u - v * v)};
        vec3_store(x + 3 * (size_t)i, vec3_scale(1.0 + height / BALL, p));
    }
}

static Gaps measure(double lower, double upper, GapSides *sides, Arena *arena) {
    Pose pose = pose_identity();
    StateFrame frame = {.x = x, .pose_count = 1, .pose = &pose};
    place_sheet(0, lower);
    place_sheet(1, upper);
    Arena scratch = {0};
    Gaps gaps =
        gaps_measure(&header, &layout, &frame, gaps_spacing(&layout), &scratch, sides, arena);
    arena_free(&scratch);
    return gaps;
}

static void test_gaps(void **unused) {
    (void)unused;
    Arena arena = {0};
    GapSides sides = {0};
    make_sheets();
    CHECK_AT_MOST(fabs(gaps_spacing(&layout) - SPACING), 1e-12);
    Gaps apart = measure(0.05, 0.10, &sides, &arena);
    assert_int_equal(apart.points, 0);
    /* the lower sheet 2 mm over the ball, the upper one 3 mm over the lower one */
    Gaps near = measure(0.002, 0.005, &sides, &arena);
    assert_int_equal(near.points, 4 * SHEET); /* nodes, and the feet of both on the ball */
    assert_int_equal(near.crossed, 0);
    CHECK_AT_MOST(fabs(near.smooth - 0.002), 2e-7);
    /* triangles are chords: nearer to the ball by at most h^2 / 4 R */
    double chord = SPACING * SPACING / (4.0 * BALL);
    CHECK_AT_MOST(near.triangles - 0.002, 0.0);
    CHECK_AT_MOST(0.002 - near.triangles, 1.1 * chord);
    CHECK_AT_MOST(near.most, 1.1 * chord);
    /* through each other: all that project inside the other one have crossed, and stay so */
    for (int again = 0; again < 2; again++) {
        Gaps through = measure(0.005, 0.002, &sides, &arena);
        CHECK_AT_MOST(fabs(through.smooth + 0.003), 1e-4);
        CHECK_AT_MOST(2.0 * (SIDE - 2) * (SIDE - 2) - through.crossed, 0.0);
        CHECK_AT_MOST(through.crossed - 2.0 * SHEET, 0.0);
    }
    Gaps back = measure(0.002, 0.005, &sides, &arena);
    assert_int_equal(back.crossed, 0);
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_gaps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
