/* Contact by impulses with obstacles that move: friction with known answers, sweeps, pinches, books, the
 * same bits. */
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/contact/impulses.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/play.h"
#include "tests/support/resume.h"

#define G 9.80665
#define FABRIC                                                                                     \
    "fabric: {weight: 150 g/m2, thickness: 1 mm, stretch: {warp: 1000 N/m, weft: 1000 N/m, "       \
    "poisson: 0.3}, shear: 385 N/m, bending: {warp: 10 uN m, weft: 10 uN m}, friction: 0.3}\n"
#define SOLVER "solver: {stepper: central, contact: impulses}\n"
#define MESHES TOILE_SOURCE_DIR "/assets/meshes/"

/* ---- friction on a plate that moves ---- */

enum { RATE = 50 };

/* a sheet on a plate that goes by `way` [m] along x from 0.5 s to 1.5 s */
static void plate(Play *play, double way) {
    char text[2048];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: %d, seconds: 4}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n    " FABRIC
             "    nodes: 11 x 11\n    at: [0, 0, 0.99 mm]\n"
             "obstacles:\n  plate: {box: {size: [3 m, 1 m, 10 cm]}, at: [0, 0, -5 cm],"
             " friction: 0.3, motion: [{move: {by: [%.17g m, 0, 0], from: 0.5 s, to: 1.5 s}}]}\n"
             "gravity: %.17g\n" SOLVER,
             RATE, way, G);
    play_start(play, text);
}

/* velocity of the plate */
static double plate_speed(double way, double t) {
    double r = fmin(1.0, fmax(0.0, t - 0.5));
    return 30.0 * way * r * r * (1.0 - r) * (1.0 - r);
}

/* A block under Coulomb's friction: it takes at most mu g. Returns where it ends at 2 s. */
static double block_way(double way) {
    const double dt = 1e-6;
    double x = 0.0, v = 0.0;
    for (int k = 0; k < 2000000; k++) {
        double apart = plate_speed(way, (k + 1) * dt) - v, most = 0.3 * G * dt;
        v += fmax(-most, fmin(most, apart));
        x += dt * v;
    }
    return x;
}

/* below mu g it is carried, above it slides as a block would, and ends elsewhere on the plate */
static void test_carried(void **unused) {
    (void)unused;
    const double ways[3] = {0.4, 0.8,
                            1.2}; /* the plate's fastest change: 5.77 way = 2.3, 4.6, 6.9 */
    for (int k = 0; k < 3; k++) {
        Play play;
        plate(&play, ways[k]);
        play_to(&play, 0.4);
        double from = play_mean_x(&play).x;
        play_to(&play, 2.0);
        double moved = play_mean_x(&play).x - from, exact = block_way(ways[k]);
        print_message("  plate %.2f m: cloth %.5f m, block %.5f m\n", ways[k], moved, exact);
        CHECK_NEAR(moved, exact, k == 0 ? 1e-5 : 0.005 * ways[k]);
        CHECK_AT_MOST(fabs(play_mean_v(&play).x), 1e-6);
        play_end(&play);
    }
}

/* ---- sweeps ---- */

typedef struct Judged {
    long crossings;
    double lag, rounds, zones;
    double balance,
        turned; /* [J] largest change of all energies, losses and works together; of work */
} Judged;

static Judged judge(Play *play, double seconds, int frames) {
    Judged j = {.crossings = 0};
    double first = 0.0, work = 0.0, lost = 0.0;
    for (int f = 0; f < frames; f++) {
        play_to(play, (f + 1) * seconds / frames);
        const Statistics *s = &play->sim.statistics;
        j.crossings += play_crossings(play);
        j.lag = fmax(j.lag, s->lag);
        j.rounds += s->rounds, j.zones += s->zones;
        lost += s->friction + s->damping + s->guard + s->sides;
        work += s->work;
        double now = s->kinetic + s->elastic + s->gravity + lost - work;
        first = f == 0 ? now : first;
        j.balance = fmax(j.balance, fabs(now - first));
        j.turned = fmax(j.turned, fabs(work));
    }
    return j;
}

/* a sheet hung by one edge, and what goes through it */
static void hung(Play *play, const char *obstacle) {
    char text[2048];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
             "    nodes: 17 x 17\n    turn: {axis: x, by: 90 deg}\n"
             "    bending_damping: 0 s\n    membrane_damping: 0 s\n"
             "handles: [{hold: sheet.top}]\nobstacles:\n  %s\n" SOLVER,
             obstacle);
    play_start(play, text);
}

/* boxes, a cone, a ball and a mesh that go through it, straight and turning: no triangle crosses in any
 * frame, and what they do to the cloth is in the books */
static void test_swept(void **unused) {
    (void)unused;
    const char *const sweepers[] = {
        "box: {box: {size: [20 cm, 10 cm, 10 cm]}, at: [3 cm, -30 cm, -5 cm], motion: [{move: {by: "
        "[0, 60 cm, 0], from: 0 s, to: 0.3 s}}]}",
        "box: {box: {size: [30 cm, 3 cm, 3 cm]}, at: [0, -20 cm, -5 cm], motion: [{turn: {axis: z, "
        "by: 1.5 turns, from: 0 s, to: 1 s}}, {move: {by: [0, 40 cm, 0], from: 0 s, to: 1 s}}]}",
        "cone: {cone: {radius: 8 cm, from: [0, -30 cm, -5 cm], to: [0, "
        "-20 cm, -5 cm]}, motion: [{move: {by: [0, 45 cm, 0], from: 0 s, to: 0.5 s}}]}",
        "ball: {sphere: {radius: 5 cm}, at: [0, -25 cm, -5 cm], motion: [{move: {by: [0, 50 cm, "
        "0], "
        "from: 0 s, to: 0.1 s}}]}",
        "ico: {mesh: {file: " MESHES "icosphere.obj, scale: 5 cm}, at: [0, -25 cm, -5 cm], motion: "
        "[{move: {by: [0, 50 cm, 0], from: 0 s, to: 0.5 s}}]}",
        "ell: {mesh: {file: " MESHES "l-shape.stl, scale: 60 cm}, at: [0, 8 cm, -4 cm], motion: "
        "[{turn: {axis: x, by: 1 turns, from: 0 s, to: 1 s}}]}",
    };
    for (size_t k = 0; k < sizeof sweepers / sizeof *sweepers; k++) {
        Play play;
        hung(&play, sweepers[k]);
        Judged j = judge(&play, 1.0, 60);
        print_message("  %.10s: %ld crossings, %.0f rounds, %.0f zones, lag %.2g s, books %.2g of "
                      "%.2g J\n",
                      sweepers[k], j.crossings, j.rounds, j.zones, j.lag, j.balance, j.turned);
        CHECK_AT_MOST((double)j.crossings, 0.0);
        CHECK_AT_MOST(j.balance / j.turned, 0.05);
        play_end(&play);
    }
}

/* ---- pinches ---- */

/* a block or a ball pressed through the floor with the sheet between waits above it, ever farther behind;
 * the sheet stays whole and comes to rest, and the press goes back up with its programme */
static void test_pinched(void **unused) {
    (void)unused;
    const char *const presses[2] = {"press: {box: {size: [10 cm, 10 cm, 10 cm]}, at: [0, 0, 8 cm],",
                                    "press: {mesh: {file: " MESHES
                                    "icosphere.obj, scale: 5 cm}, at: [0, 0, 8 cm],"};
    for (int k = 0; k < 2; k++) {
        Play play;
        char text[2048];
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  sheet:\n"
                 "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    " FABRIC
                 "    nodes: 13 x 13\n    at: [0, 0, 2 mm]\nobstacles:\n  floor: {plane: {}}\n  %s"
                 " motion: [{move: {by: [0, 0, -5 cm], from: 0 s, to: 0.5 s}}, {move: {by: [0, 0, "
                 "10 cm], from: 0.9 s, to: 1.3 s}}]}\n" SOLVER,
                 presses[k]);
        play_start(&play, text);
        Judged down = judge(&play, 0.6, 36);
        double lowest = INFINITY;
        for (int i = 0; i < play.sim.system.place_count; i++) {
            lowest = fmin(lowest, play_x(&play, i).z);
        }
        print_message("  lag %.3g s, lowest node at %.3g mm\n", down.lag, 1e3 * lowest);
        Judged held = judge(&play, 0.9, 54);
        CHECK_AT_MOST((double)(down.crossings + held.crossings), 0.0);
        CHECK_AT_MOST(0.2, down.lag);
        CHECK_AT_MOST(down.lag + 0.2, held.lag);
        CHECK_AT_MOST(0.0, lowest);
        CHECK_AT_MOST(play.sim.statistics.kinetic, 1e-5);
        Judged up = judge(&play, 1.5, 90);
        CHECK_AT_MOST((double)up.crossings, 0.0);
        CHECK_AT_MOST(play.sim.statistics.lag, 1e-9);
        play_end(&play);
    }
}

/* ---- the same bits ---- */

static const char swept[] =
    "toile: 1\nfilm: {rate: 60, seconds: 0.5}\ncloth:\n  sheet:\n"
    "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
    "    nodes: 17 x 17\n    turn: {axis: x, by: 90 deg}\nhandles: [{hold: sheet.top}]\n"
    "obstacles:\n  box: {box: {size: [20 cm, 10 cm, 10 cm]}, at: [3 cm, -10 cm, -5 cm], motion: "
    "[{turn: {axis: z, by: 0.25 turns, from: 0 s, to: 0.5 s}}, {move: {by: [0, 20 cm, 0], from: "
    "0 s, to: 0.5 s}}]}\n" SOLVER;

/* for any threads, and when it was stopped on the way */
static void test_bits(void **unused) {
    (void)unused;
    resume_check(swept, 12, 20);
}

static int set_up(void **unused) {
    (void)unused;
    return folder_make("impulses_driven") ? 0 : 1;
}

static int tear_down(void **unused) {
    (void)unused;
    return folder_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_carried),
        cmocka_unit_test(test_swept),
        cmocka_unit_test(test_pinched),
        cmocka_unit_test(test_bits),
    };
    return cmocka_run_group_tests_name("impulses_driven", tests, set_up, tear_down);
}
