/* Contacts of sides and faces of cloth at solids: what cloth feels is continuous as it moves over an edge, so that
 * it comes to rest there. */
#include <string.h>

#include "sim/contact/engine.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/play.h"
#include "tests/support/strips.h"

#define STEP 1e-4    /* [s] */
#define NODES 9      /* along a side */
#define SPACING 0.01 /* [m] */
#define RADIUS 0.1   /* [m] of the arc that the cloth follows */
#define OVER 0.4e-3  /* [m] of the arc over the edge: nodes there are near too */
#define SAMPLES 4000 /* of a way of one spacing */
#define LEAP 0.02    /* of the largest energy: 1 if a contact came or went */

static double no_motion(void *owner) {
    (void)owner;
    return 0.0;
}

/* a cloth over a box that stands on an edge, whose opposite edge is the y axis */
typedef struct Rig {
    Bench bench;
    Motion rest;
    ContactObstacle box;
    ContactDef def;
    ContactMemory memory;
    Lanes lanes;
    int *slot;
    unsigned char *held;
    Contact *contact;
} Rig;

static double *const *where_it_is(void *owner, double ahead) {
    (void)ahead;
    return ((Rig *)owner)->lanes.x;
}

static void rig_make(Rig *r) {
    memset(r, 0, sizeof *r);
    double side = (NODES - 1) * SPACING;
    r->bench.cloth =
        cloths_rectangle(side, side, NODES, NODES, cloths_fabric(0.15, 1000.0, 0.3, 1e-5, 0.0));
    r->bench.scene = cloths_scene(&r->bench.cloth);
    bench_build(&r->bench, 0);
    Arena *arena = &r->bench.arena;
    double half = 0.05;
    r->box = (ContactObstacle){.solid = {SOLID_BOX, {half, half, half}, 0.0},
                               .start = pose_identity(),
                               .motion = &r->rest};
    r->box.start.turn = quat_from_axis_angle(vec3(0, 1, 0), 0.25 * PI);
    r->box.start.shift = vec3(0, 0, -sqrt(2.0) * half);
    r->def = r->bench.system.contact;
    r->def.obstacle_count = 1;
    r->def.obstacles = &r->box;
    int count = r->def.vertex_count;
    r->lanes = lanes_create(count, arena);
    r->slot = arena_push(arena, int, count);
    r->held = arena_push(arena, unsigned char, count);
    r->memory = (ContactMemory){.poses = arena_push(arena, Pose, 1),
                                .clocks = arena_push(arena, double, 1),
                                .bristles = arena_push(arena, double, 3 * count),
                                .pairs = arena_push(arena, PairMemory, 1)};
    r->memory.poses[0] = r->box.start;
    for (int i = 0; i < count; i++) {
        r->slot[i] = i;
    }
    r->contact = contact_create(&r->def, arena);
}

/* [J] of the contacts where the cloth lies on the arc, turned by `yaw`, and has gone `shift` [m] along it */
static double rig_energy(Rig *r, double shift, double yaw) {
    ContactMotion motion = {no_motion, where_it_is, no_motion, no_motion, no_motion, true, r};
    for (int i = 0; i < r->def.vertex_count; i++) {
        double u = (i % NODES - NODES / 2) * SPACING, v = (i / NODES - NODES / 2) * SPACING;
        double along = cos(yaw) * u - sin(yaw) * v + shift, angle = along / RADIUS;
        r->lanes.x[0][i] = RADIUS * sin(angle);
        r->lanes.x[1][i] = sin(yaw) * u + cos(yaw) * v;
        r->lanes.x[2][i] = RADIUS * (cos(angle) - 1.0) + OVER;
    }
    contact_begin(r->contact, (ContactView){&r->lanes, r->slot, r->held, 1.0, motion, false},
                  &r->memory, STEP);
    return contact_energy(r->contact, STEP);
}

static void slide(double yaw) {
    Rig r;
    rig_make(&r);
    double most = 0.0, leap = 0.0, before = rig_energy(&r, 0.0, yaw);
    for (int k = 1; k <= SAMPLES; k++) {
        double energy = rig_energy(&r, SPACING * k / SAMPLES, yaw);
        most = fmax(most, energy);
        leap = fmax(leap, fabs(energy - before));
        before = energy;
    }
    assert_true(most > 0.0);
    CHECK_AT_MOST(leap / most, LEAP);
    arena_free(&r.bench.arena);
}

/* along its lines, across them, and at an angle at which the edge crosses all kinds of sides */
static void test_slide(void **unused) {
    (void)unused;
    slide(0.0);
    slide(0.3);
    slide(0.25 * PI);
}

typedef struct Sheet {
    int nodes;
    const char *sides;
    double stretch;      /* [N/m] */
    const char *bending; /* [N m] */
    double x, y, turn;   /* [mm], [deg] */
    const char *obstacle;
} Sheet;

/* [J] kinetic energy after 5 s */
static double hang(const Sheet *sheet, const char *solver) {
    Play play;
    char text[1200];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 6}\ncloth:\n  sheet:\n    damping: 8 1/s\n"
             "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n"
             "    fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: %g N/m,"
             " poisson: 0.3, bending: %s N m}}\n    nodes: %d x %d\n    sides: %s\n"
             "    at: [%g mm, %g mm, 5 mm]\n    turn: {axis: z, by: %g deg}\nobstacles:\n  %s\n"
             "solver: {%s}\n",
             sheet->stretch, sheet->bending, sheet->nodes, sheet->nodes, sheet->sides, sheet->x,
             sheet->y, sheet->turn, sheet->obstacle, solver);
    play_start(&play, text);
    play_to(&play, 5.0);
    double kinetic = play.sim.statistics.kinetic;
    play_end(&play);
    return kinetic;
}

#define STILL 1e-9 /* [J] */
#define BOX(size, rounding, mu)                                                                    \
    "box: {box: {size: [" size ", 10 cm], rounding: " rounding "}, at: [0, 0, -5 cm],"             \
    " friction: " mu "}"
#define BALL(radius, mu)                                                                           \
    "ball: {sphere: {radius: " radius "}, at: [0, 0, -" radius "], friction: " mu "}"

static void hang_over_box(double width, const char *sides, const char *solver) {
    char box[200];
    snprintf(box, sizeof box, "box: {box: {size: [%g m, %g m, 10 cm]}, at: [0, 0, -5 cm]}", width,
             width);
    Sheet sheet = {11, sides, 1000, "1e-5", 0, 0, 0, box};
    CHECK_AT_MOST(hang(&sheet, solver), STILL);
}

/* Sheets that hang over the edges of boxes, of widths at which contacts that leap keep them trembling. */
static void test_rest(void **unused) {
    (void)unused;
    const double width[] = {0.092, 0.098, 0.101, 0.107, 0.11};
    for (int k = 0; k < 5; k++) {
        hang_over_box(width[k], "free", "stepper: central");
        hang_over_box(width[k], "bounded", "stepper: central");
    }
    hang_over_box(0.095, "free", "stepper: bdf2, step: 1/240 s");
    hang_over_box(0.1, "free", "stepper: bdf2, step: 1/240 s");
}

/* Each of them swings for ever where contacts of sides come within a twentieth of the contact distance and the
 * bound on sides takes the inertia for 0.6 of what it is. One in some hundreds still does, by chance. */
static const Sheet sheets[] = {
    {15, "bounded", 3000, "1e-6", 9.65, -2.74, 80.7, BOX("139.4 mm, 113.6 mm", "0 mm", "0.3")},
    {9, "free", 300, "1e-5", -11.84, -9.0, 73.6, BOX("91.3 mm, 67.1 mm", "0 mm", "0.3")},
    {15, "bounded", 300, "1e-6", 6.04, -8.1, 19.9, BALL("66.1 mm", "0.6")},
    {17, "bounded", 300, "1e-5", -11.29, -3.68, 28.6, BALL("36.4 mm", "0.3")},
    {11, "bounded", 1000, "1e-6", 8.31, -0.3, 51.1, BOX("61.0 mm, 57.3 mm", "3 mm", "0.6")},
    {9, "bounded", 1000, "1e-4", -10.36, 8.65, 9.6, BOX("99.7 mm, 89.4 mm", "0 mm", "0.1")},
    {9, "free", 1000, "1e-4", -1.53, 11.5, 36.7, BOX("93.4 mm, 73.5 mm", "0 mm", "0.3")},
    {15, "bounded", 3000, "1e-6", -0.04, -3.17, 62.1, BOX("112.2 mm, 84.6 mm", "3 mm", "0.1")},
    {9, "bounded", 300, "1e-6", -1.08, 7.92, 74.7, BOX("68.2 mm, 49.2 mm", "0 mm", "0.3")},
    {11, "bounded", 1000, "1e-6", -4.2, 10.38, 50.1, BOX("113.2 mm, 110.8 mm", "0 mm", "0.3")},
    {15, "bounded", 300, "1e-6", 2.02, -10.8, 14.0, BOX("61.2 mm, 47.6 mm", "3 mm", "0.3")},
    {9, "bounded", 300, "1e-5", -8.5, 5.32, 38.4, BOX("116.1 mm, 109.8 mm", "0 mm", "0.6")},
};

static void test_sheets(void **unused) {
    (void)unused;
    double swinging = 0.0;
    for (size_t k = 0; k < sizeof sheets / sizeof sheets[0]; k++) {
        swinging += hang(&sheets[k], "stepper: central") > STILL;
    }
    CHECK_AT_MOST(swinging, 1.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_slide), cmocka_unit_test(test_rest),
                                       cmocka_unit_test(test_sheets)};
    return cmocka_run_group_tests_name("touches", tests, NULL, NULL);
}
