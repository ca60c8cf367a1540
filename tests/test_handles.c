/* Handles that lead cloth to where it cannot go: it stays behind, crosses nothing, and comes after them. */
#include <math.h>
#include <stdio.h>

#include "sim/base/parallel.h"
#include "tests/support/check.h"
#include "tests/support/play.h"

#define SHEET                                                                                      \
    "toile: 1\nfilm: {rate: 30, seconds: 3}\ncloth:\n  sheet:\n"                                   \
    "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n"                                      \
    "    fabric: {name: f, weight: 120 g/m2, thickness: 0.5 mm, isotropic: {stretch: 2000 N/m, "   \
    "poisson: 0.3, bending: 1e-5 N m}}\n"                                                          \
    "    nodes: 15 x 15\n    at: [0, 0, 10 cm]\n"

static const char *const roads[] = {"central", "bdf2"};

/* the scene to a time; most [m] that a held place was behind; fails where anything crosses */
static double play_on(Play *play, double time) {
    double behind = 0.0;
    while (play->sim.state.time < time - 1e-9) {
        play_to(play, play->sim.state.time + 1e-3);
        behind = fmax(behind, play->sim.statistics.behind);
        assert_int_equal(play_crossings(play), 0);
    }
    return behind;
}

/* One edge is led 10 cm below the floor, where cloth lies under it, and up again. */
static void test_floor(void **unused) {
    (void)unused;
    for (int k = 0; k < 2; k++) {
        char text[2000];
        Play play;
        snprintf(text, sizeof text,
                 SHEET "handles:\n  - hold: sheet.left\n    motion:\n"
                       "      - {move: {by: [0, 0, -20 cm], from: 0.1 s, to: 0.7 s}}\n"
                       "      - {move: {by: [0, 0, 25 cm], from: 0.8 s, to: 1.5 s}}\n"
                       "obstacles:\n  floor: {plane: {}, friction: 0.3}\n"
                       "solver: {stepper: %s}\n",
                 roads[k]);
        play_start(&play, text);
        double behind = play_on(&play, 0.75);
        CHECK_AT_MOST(0.099, behind);
        CHECK_AT_MOST(behind, 0.101);
        play_on(&play, 1.6);
        CHECK_AT_MOST(play.sim.statistics.behind, 1e-9);
        /* what pinched cloth takes; to push through the floor would be 1e6 J */
        CHECK_AT_MOST(fabs(play.sim.total.work), 20.0);
        play_end(&play);
    }
}

/* a corner is led into a ball, or a box */
static void test_solids(void **unused) {
    (void)unused;
    static const char *const solids[] = {"sphere: {radius: 4 cm}",
                                         "box: {size: [8 cm, 8 cm, 8 cm]}"};
    for (int k = 0; k < 2; k++) {
        char text[2000];
        Play play;
        snprintf(text, sizeof text,
                 SHEET "handles:\n  - hold: sheet.top-right\n"
                       "    motion: {move: {by: [20 cm, -1 cm, 0], from: 0 s, to: 0.8 s}}\n"
                       "obstacles:\n  solid: {%s, at: [20 cm, 10 cm, 10 cm]}\n"
                       "solver: {stepper: central}\n",
                 solids[k]);
        play_start(&play, text);
        CHECK_AT_MOST(0.002, play_on(&play, 1.2));
        CHECK_AT_MOST(fabs(play.sim.total.work), 0.5);
        play_end(&play);
    }
}

/* The border of a disc, held, is led against a box that comes towards it. Impulses on triangles of which hardly
 * anything is free stay away from it. */
static void test_border(void **unused) {
    (void)unused;
    Play play;
    play_start(
        &play,
        "toile: 1\nfilm: {rate: 30, seconds: 0.6}\ncloth:\n  disc:\n"
        "    shape: {disc: {radius: 216 mm}}\n    spacing: 48 mm\n    noise: 0.73 mm\n"
        "    fabric: {name: f, weight: 50 g/m2, thickness: 0.2 mm, isotropic: {stretch: "
        "3000 N/m, poisson: 0.2, bending: 1e-4 N m}}\n"
        "    at: [25 mm, 36 mm, 120 mm]\n    turn: {axis: [1, 1, 0], by: 45 deg}\n"
        "    damping: 1 1/s\nhandles:\n  - hold: disc.border\n"
        "    motion: {move: {by: [-77 mm, 98 mm, -55 mm], from: 0.02 s, to: 0.82 s}}\n"
        "obstacles:\n  box: {box: {size: [122 mm, 206 mm, 147 mm], rounding: 5 mm}, at: [98 "
        "mm, 66 mm, -107 mm],\n    motion: {move: {by: [-40 mm, 31 mm, -6 mm], from: 0.24 s, "
        "to: 0.44 s}}, friction: 0}\nsolver: {stepper: central}\n");
    double fastest = 0.0;
    while (play.sim.state.time < 0.55) {
        CHECK_AT_MOST(play_on(&play, play.sim.state.time + 0.03), 0.1);
        for (int i = 0; i < play.sim.system.node_count; i++) {
            fastest = fmax(fastest, vec3_length(play_v(&play, i)));
        }
    }
    CHECK_AT_MOST(fastest, 50.0);
    play_end(&play);
}

static double energy_of(const Play *play) {
    const Statistics *s = &play->sim.statistics;
    return s->kinetic + s->elastic + s->gravity + s->contact;
}

static double lost_by(const Play *play) {
    const Statistics *s = &play->sim.total;
    return s->friction + s->damping + s->guard + s->sides + s->fabric + s->drag + s->numerical;
}

/* A sheet that hangs by one corner is torn off to the side: the handle works through what bounds sides and
 * springs too. */
static void test_work(void **unused) {
    (void)unused;
    static const char *const kinds[] = {
        "    sides: free\n", "    sides: bounded\n",
        "    model: springs\n    limit_rounds: 10\n    stiffening: none\n"};
    for (int k = 0; k < 3; k++) {
        char text[2000];
        Play play;
        snprintf(text, sizeof text,
                 SHEET "%shandles:\n  - hold: sheet.top-left\n"
                       "    motion: {move: {by: [-10 cm, 30 cm, -20 cm], from: 0.6 s, to: 0.9 s}}\n"
                       "solver: {stepper: central}\n",
                 kinds[k]);
        play_start(&play, text);
        play_on(&play, 0.5);
        double energy = energy_of(&play), lost = lost_by(&play), work = play.sim.total.work;
        play_on(&play, 1.2);
        energy = energy_of(&play) - energy, lost = lost_by(&play) - lost;
        work = play.sim.total.work - work;
        CHECK_AT_MOST(1e-3, work);
        CHECK_AT_MOST(fabs(energy - work + lost), 0.05 * work); /* damping is sampled */
        play_end(&play);
    }
}

int main(int argc, char **argv) {
    (void)argc;
    parallel_fix_environment(argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_floor), cmocka_unit_test(test_solids),
                                       cmocka_unit_test(test_border), cmocka_unit_test(test_work)};
    return cmocka_run_group_tests_name("handles", tests, NULL, NULL);
}
