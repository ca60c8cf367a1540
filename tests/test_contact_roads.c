/* Both roads of contact: the same drape, abuse, driven solids, starts that touch. */
#include <string.h>

#include "sim/base/parallel.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/play.h"
#include "tests/support/resume.h"

#define LAYERS 10
#define STIFF                                                                                      \
    "fabric: {weight: 200 g/m2, thickness: 1 mm, stretch: {warp: 1000 N/m, weft: 1000 N/m, "       \
    "poisson: 0}, shear: 500 N/m, bending: {warp: 100 uN m, weft: 100 uN m, poisson: 0}}\n"
#define STIFF_DENSITY 0.2 /* [kg/m2] */

/* ---- one drape by both roads ---- */

static void start_drape(Play *play, double bending, const char *stepper) {
    char text[2048];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 8}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 1 m, height: 1 m}}\n"
             "    fabric: {weight: 200 g/m2, thickness: 1 mm, stretch: {warp: 1000 N/m, weft: 1000 "
             "N/m, poisson: 0.3}, shear: 385 N/m, bending: {warp: %g, weft: %g}}\n"
             "    nodes: 26 x 26\n    at: [3 cm, 2 cm, 1.1 mm]\n    turn: {axis: z, by: 15 deg}\n  "
             "  damping: 3 1/s\nobstacles:\n"
             "  cube: {box: {size: [50 cm, 50 cm, 50 cm]}, at: [0, 0, -25 cm], friction: 0.3}\n"
             "solver: {stepper: %s}\n",
             bending, bending, stepper);
    play_start(play, text);
}

/* [J] above the base of the cube */
static double potential(const Play *play) {
    const Statistics *now = &play->sim.statistics;
    return now->elastic + now->gravity + 0.5 * play->sim.system.weight;
}

/* a sheet on a cube: stiff, its shape is the same; limp, folds choose, and statistics are */
static void test_roads(void **unused) {
    (void)unused;
    for (int limp = 0; limp < 2; limp++) {
        Play a, b;
        double bending = limp ? 1e-5 : 3e-4, sum = 0.0;
        start_drape(&a, bending, "central");
        start_drape(&b, bending, "bdf2");
        play_to(&a, 1.5);
        play_to(&b, 1.5);
        int n = a.sim.system.node_count;
        for (int i = 0; i < n; i++) {
            Vec3 apart = vec3_sub(play_x(&a, i), play_x(&b, i));
            sum += vec3_dot(apart, apart) / n;
        }
        if (!limp) {
            CHECK_AT_MOST(sqrt(sum), 0.01); /* of 1 m */
        }
        CHECK_NEAR((play_mean_x(&b).z + 0.5) / (play_mean_x(&a).z + 0.5), 1.0, 0.01);
        CHECK_NEAR(potential(&b) / potential(&a), 1.0, 0.01);
        CHECK_AT_MOST((double)(play_crossings(&a) + play_crossings(&b)), 0.0);
        play_end(&a);
        play_end(&b);
    }
}

/* ---- abuse ---- */

/* thrown edge-on at a plate that stands upright, thinner than the cloth: nothing crosses */
static void test_plate(void **unused) {
    (void)unused;
    static const int speeds[] = {10, 30, 50, 200};
    long crossings = 0;
    double gained = 0.0;
    for (int k = 0; k < 8; k++) {
        char text[2048];
        Play play;
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  sheet:\n"
                 "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " STIFF
                 "    nodes: 13 x 13\n    at: [0, 0, 5 cm]\n    velocity: [0, 0, %d m/s]\n"
                 "obstacles:\n  plate: {box: {size: [60 cm, 0.5 mm, 20 cm]}, at: [0, 7 mm, -10 "
                 "cm], friction: 0.3}\nsolver: {stepper: %s}\n",
                 -speeds[k / 2], k % 2 ? "bdf2" : "central");
        play_start(&play, text);
        for (int f = 1; f <= 3; f++) {
            play_to(&play, f / 60.0);
            crossings += play_crossings(&play);
        }
        const Statistics *now = &play.sim.statistics;
        double thrown = 0.5 * STIFF_DENSITY * 0.16 * speeds[k / 2] * speeds[k / 2];
        gained = fmax(gained, (now->kinetic + now->elastic) / thrown);
        play_end(&play);
    }
    CHECK_AT_MOST((double)crossings, 0.0);
    CHECK_AT_MOST(gained, 1.0);
}

/* [s] greatest lag; solids that move through or pinch a hanging cloth: nothing crosses */
static double drive(const char *obstacles, double seconds, const char *stepper, long *crossings) {
    char text[2048];
    Play play;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " STIFF
             "    nodes: 17 x 17\n    turn: {axis: x, by: 90 deg}\nhandles:\n"
             "  - {hold: sheet.top}\nobstacles:\n%ssolver: {stepper: %s}\n",
             obstacles, stepper);
    play_start(&play, text);
    for (int f = 1; f <= (int)(60.0 * seconds); f++) {
        play_to(&play, f / 60.0);
        *crossings += play_crossings(&play);
    }
    double lag = play.sim.total.lag;
    play_end(&play);
    return lag;
}

static void test_driven(void **unused) {
    (void)unused;
    static const char *const through[] = {
        "  ball: {sphere: {radius: 6 cm}, at: [2 cm, 12 cm, -4 cm], motion: [{move: {by: [0, -30 "
        "cm, 0], from: 0 s, to: 0.3 s}}]}\n",
        "  box: {box: {size: [8 cm, 8 cm, 8 cm]}, at: [2 cm, 12 cm, -4 cm], turn: {axis: z, by: 20 "
        "deg}, motion: [{turn: {axis: z, rate: 2 rad/s}}, {move: {by: [0, -30 cm, 0], from: 0 s, "
        "to: 0.3 s}}]}\n"};
    long crossings = 0;
    double lag = 0.0;
    drive(through[0], 0.3, "static", &crossings);
    for (int k = 0; k < 2; k++) {
        lag = fmax(lag, drive(through[k], 0.5, "bdf2", &crossings));
    }
    CHECK_AT_MOST((double)crossings, 0.0);
    CHECK_AT_MOST(lag, 0.01);
    double waits = drive("  left: {sphere: {radius: 6 cm}, at: [0, 8 cm, -4 cm], motion: [{move: "
                         "{by: [0, -4 cm, 0], from: 0 s, to: 0.3 s}}]}\n"
                         "  right: {sphere: {radius: 6 cm}, at: [0, -8 cm, -4 cm], motion: [{move: "
                         "{by: [0, 4 cm, 0], from: 0 s, to: 0.3 s}}]}\n",
                         0.5, "bdf2", &crossings);
    CHECK_NEAR(waits, 0.35, 0.01); /* they stop where they touch the cloth */
    CHECK_AT_MOST((double)crossings, 0.0);
}

/* ten sheets over a ball */
static void write_layers(char *text, size_t size) {
    int at = snprintf(text, size, "toile: 1\nfilm: {rate: 30, seconds: 10}\ncloth:\n");
    for (int k = 0; k < LAYERS; k++) {
        at +=
            snprintf(text + at, size - (size_t)at,
                     "  sheet%d:\n    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    " STIFF
                     "    nodes: 11 x 11\n    at: [%d mm, %d mm, %g mm]\n"
                     "    turn: {axis: z, by: %d deg}\n    damping: 3 1/s\n",
                     k, k % 3, k % 2, 62.0 + 3.0 * k, 20 * k);
    }
    snprintf(text + at, size - (size_t)at,
             "obstacles:\n  ball: {sphere: {radius: 6 cm}, friction: 0.3}\n"
             "  floor: {plane: {}, at: [0, 0, -25 cm]}\nsolver: {stepper: central}\n");
}

/* they fall; nothing crosses, the energy is accounted for, and they come to rest: no impulses of the
 * guard hold them, which go on shaking them with 1e-3 of their fall */
static void test_layers(void **unused) {
    (void)unused;
    char text[8192];
    write_layers(text, sizeof text);
    Play play;
    long crossings = 0;
    double lost = 0.0, start = 0.0, high = 0.0, now = 0.0;
    play_start(&play, text);
    const Statistics *s = &play.sim.statistics;
    for (int f = 1; f <= 90; f++) {
        play_to(&play, f / 30.0);
        crossings += play_crossings(&play);
        now = s->kinetic + s->elastic + s->gravity + s->contact;
        start = f == 1 ? now : start;
        high = f == 1 ? s->gravity : high;
        lost += f == 1 ? 0.0
                       : s->friction + s->damping + s->guard + s->sides + s->fabric + s->drag +
                             s->numerical;
    }
    CHECK_AT_MOST((double)crossings, 0.0);
    CHECK_NEAR((now + lost - start) / (high - s->gravity), 0.0, 0.04);
    play_to(&play, 5.0);
    CHECK_AT_MOST(s->kinetic / (high - s->gravity), 1e-6);
    play_end(&play);
}

/* stopped while the law is stiffer than at the start, and resumed by three threads */
static void test_resume(void **unused) {
    (void)unused;
    char text[8192];
    write_layers(text, sizeof text);
    resume_check(text, 20, 24);
}

/* [m] the greatest mean height of two sheets on a floor, the upper so far [m] above the lower at the
 * start */
static double bounce(double gap, const char *stepper, long *crossings) {
    char text[2048];
    Play play;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  lower:\n"
             "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n    " STIFF
             "    nodes: 9 x 9\n    at: [0, 0, %.17g m]\n  upper:\n"
             "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n    " STIFF
             "    nodes: 10 x 10\n    at: [1 cm, 1 cm, %.17g m]\nobstacles:\n"
             "  floor: {plane: {}, friction: 0.3}\nsolver: {stepper: %s}\n",
             0.6e-3, 0.6e-3 + gap, stepper);
    play_start(&play, text);
    double high = 0.0;
    for (int f = 1; f <= 30; f++) {
        play_to(&play, f / 60.0);
        *crossings += play_crossings(&play);
        high = fmax(high, play_mean_x(&play).z);
    }
    play_end(&play);
    return high;
}

/* sheets that start nearly touching stay apart; the implicit road opens them without a burst */
static void test_starts(void **unused) {
    (void)unused;
    static const double gaps[] = {1e-9, 5e-5, 1e-4};
    long crossings = 0;
    for (int k = 0; k < 3; k++) {
        bounce(gaps[k], "central", &crossings);
        double high = bounce(gaps[k], "bdf2", &crossings);
        CHECK_NEAR(1e3 * high, 1.5, 0.5); /* one and two contact distances */
    }
    CHECK_AT_MOST((double)crossings, 0.0);
}

/* [B] most memory that a drape over a cube took, and how many intervals were done again */
static double burst_memory(const char *solver, double *retries) {
    char text[1024];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 1 m, height: 1 m}}\n"
             "    fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3,"
             " bending: 1e-5 N m}}\n"
             "    nodes: 51 x 51\n    sides: bounded\n    noise: 0.2 mm\n    at: [0, 0, 2 cm]\n"
             "obstacles:\n  cube: {box: {size: [50 cm, 50 cm, 50 cm], rounding: 5 mm},"
             " at: [0, 0, -25 cm], friction: 0.3}\n"
             "solver: {stepper: central%s}\n",
             solver);
    Play play;
    play_start(&play, text);
    play_to(&play, 0.2);
    double bytes = (double)play.sim.arena.bytes_peak;
    *retries = play.sim.total.retries;
    play_end(&play);
    return bytes;
}

/* At the limit of stability intervals burst, with pairs without number, and are done again: that is seen
 * before it takes time and memory. */
static void test_burst(void **unused) {
    (void)unused;
    double calm, burst, usual = burst_memory("", &calm);
    double bytes = burst_memory(", courant: 1", &burst);
    assert_true(burst > calm);
    CHECK_AT_MOST(bytes / usual, 4.0); /* else some hundred */
}

static int set_up(void **unused) {
    (void)unused;
    return folder_make("roads") ? 0 : 1;
}

static int tear_down(void **unused) {
    (void)unused;
    return folder_remove();
}

int main(int argc, char **argv) {
    (void)argc;
    parallel_fix_environment(argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_roads),  cmocka_unit_test(test_plate),  cmocka_unit_test(test_driven),
        cmocka_unit_test(test_layers), cmocka_unit_test(test_resume), cmocka_unit_test(test_starts),
        cmocka_unit_test(test_burst),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
