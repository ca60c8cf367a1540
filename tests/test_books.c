/* The books of energy: what was given is there or was taken, and where. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "tests/support/check.h"
#include "tests/support/play.h"

/* What became of the energy in a run, all in [J]. */
typedef struct Book {
    double fall;  /* largest fall of the potential of gravity */
    double given; /* by handles */
    double rise;  /* of the energy in the cloth */
    double taken; /* by contact and the bound on sides */
    double fabric, drag;
} Book;

static double energy_of(const Statistics *s) {
    return s->kinetic + s->elastic + s->gravity + s->contact;
}

/* from the end of the first frame on */
static Book keep_book(const char *text, double seconds, int threads) {
    Play play;
    Book book = {0};
    play_start_threads(&play, text, threads);
    const Statistics *s = &play.sim.statistics;
    play_to(&play, 1e-3);
    double start = energy_of(s), high = s->gravity;
    while (play.sim.state.time < seconds - 1e-9) {
        play_to(&play, play.sim.state.time + 1e-3);
        book.given += s->work;
        book.taken += s->friction + s->damping + s->guard + s->sides + s->numerical;
        book.fabric += s->fabric;
        book.drag += s->drag;
        book.fall = fmax(book.fall, high - s->gravity);
    }
    book.rise = energy_of(s) - start;
    play_end(&play);
    return book;
}

#define SHEET                                                                                      \
    "toile: 1\nfilm: {rate: 30, seconds: 4}\nsolver: {stepper: central}\ncloth:\n  sheet:\n"       \
    "    shape: {rectangle: {width: 1 m, height: 1 m}}\n"                                          \
    "    fabric: {name: f, weight: 200 g/m2, friction: 0.3, isotropic: {stretch: 1000 N/m, "       \
    "poisson: 0.3, bending: 1e-4 N m}}\n    nodes: 26 x 26\n"

/* Damped falls. Fabric and drag are measured in one step of 64, hence 4 % of the fall. Without them
 * a tenth of it or more would be missing. */
static void test_damping(void **unused) {
    (void)unused;
    static const char *const texts[] = {
        SHEET "handles:\n  - {hold: sheet.left}\n",
        SHEET "    damping: 1 1/s\n    bending_damping: 20 ms\n    membrane_damping: 1 ms\n"
              "handles:\n  - {hold: sheet.top-left}\n  - {hold: sheet.top-right}\n",
        SHEET "    model: springs\nhandles:\n  - {hold: sheet.left}\n",
        SHEET "    model: triangles\n    damping: 1 1/s\nhandles:\n  - {hold: sheet.left}\n",
        SHEET "    damping: 1 1/s\n    at: [3 cm, 2 cm, 30 cm]\n    turn: {axis: z, by: 15 deg}\n"
              "obstacles:\n  cube: {box: {size: [50 cm, 50 cm, 50 cm]}, friction: 0.3}\n",
    };
    for (int k = 0; k < 5; k++) {
        Book book = keep_book(texts[k], 1.5, 1);
        double lost = book.taken + book.fabric + book.drag;
        CHECK_NEAR((book.rise + lost - book.given) / book.fall, 0.0, 0.04);
        assert_true(book.fabric + book.drag > 0.1 * book.fall);
        assert_true(book.fabric > 0.0 && (book.drag > 0.0) == (k % 2 == 1 || k == 4));
    }
}

#define CARD                                                                                       \
    "toile: 1\nfilm: {rate: 30, seconds: 4}\nsolver: {stepper: central}\ncloth:\n  card:\n"        \
    "    shape: {rectangle: {width: 30 cm, height: 10 cm}}\n"                                      \
    "    fabric: {name: f, weight: 300 g/m2, isotropic: {stretch: 5000 N/m, poisson: 0.3, "        \
    "bending: 5e-3 N m}}\n    nodes: 16 x 6\n"
#define TURNED "handles:\n  - {clamp: card.left, turn: {axis: y, by: 90 deg, from: 0 s, to: 1 s}}\n"

/* A stiff card whose clamp lifts it by turning: all of the work is done on the ghosts of the clamp. */
static void test_turning_clamp(void **unused) {
    (void)unused;
    static const char *const models[] = {"", "    model: springs\n", "    model: triangles\n",
                                         "    model: particles\n"};
    for (int k = 0; k < 4; k++) {
        char text[2048];
        snprintf(text, sizeof text, CARD "%s" TURNED, models[k]);
        Book book = keep_book(text, 1.2, 1);
        double lost = book.taken + book.fabric + book.drag;
        CHECK_NEAR((book.rise + lost - book.given) / book.rise, 0.0, 0.005);
        assert_true(book.rise > 1e-3);
    }
}

/* a sleeve with rest curvature, twisted by its clamps until it folds and rubs */
static void test_twisted_sleeve(void **unused) {
    (void)unused;
    Book book = keep_book(
        "toile: 1\nfilm: {rate: 30, seconds: 4}\nsolver: {stepper: central}\ncloth:\n  tube:\n"
        "    shape: {sleeve: {radius: 25 cm, length: 1 m, rest: curved}}\n"
        "    fabric: {weight: 150 g/m2, thickness: 2.5 mm, friction: 0.3, isotropic: {stretch: "
        "1000 N/m, poisson: 0.3, bending: 1e-4 N m}}\n    nodes: 24 x 27\n    noise: 0.2 mm\n"
        "handles:\n  - {clamp: tube.start, turn: {axis: z, by: -288 deg, from: 0 s, to: 4 s}}\n"
        "  - {clamp: tube.end, turn: {axis: z, by: 288 deg, from: 0 s, to: 4 s}}\n"
        "gravity: 0 m/s2\n",
        4.0, 1);
    double lost = book.taken + book.fabric + book.drag;
    CHECK_NEAR((book.rise + lost) / book.given, 1.0, 0.04);
    assert_true(book.taken > 0.05 * book.given);
}

/* ... and tight, then let go: what lies crowded and unwinds is not fed by its contacts */
static void test_released_twist(void **unused) {
    static const char text[] =
        "toile: 1\nfilm: {rate: 30, seconds: 9}\ncloth:\n  sleeve:\n"
        "    shape: {sleeve: {radius: 8 cm, length: 60 cm, rest: curved}}\n"
        "    fabric: wool-tropical\n    nodes: 24 x 29\n    noise: 0.2 mm\n    damping: 2 1/s\n"
        "handles:\n  - {hold: sleeve.start, turn: {axis: z, by: -2 turns, from: 0 s, to: 1.5 s},\n"
        "     move: {by: [0, 0, 7 cm], from: 0 s, to: 1.5 s}}\n"
        "  - {hold: sleeve.end, turn: {axis: z, by: 2 turns, from: 0 s, to: 1.5 s},\n"
        "     move: {by: [0, 0, -7 cm], from: 0 s, to: 1.5 s}, release: 1.6 s}\n"
        "solver: {stepper: central}\n";
    Play play;
    (void)unused;
    play_start(&play, text);
    play_to(&play, 1.7);
    const Statistics *total = &play.sim.total;
    CHECK_AT_MOST(-total->guard / total->work, 0.1);
    CHECK_AT_MOST(2.5, total->work);
    play_end(&play);
}

/* ---- the implicit road ---- */

/* What backward Euler takes in a step from x0, v0 to x1, v1 = (x1 - x0) / dt when its equations are
 * solved: M (v1 - v0) / dt + grad W(x1) - f = 0 times x1 - x0 is the change of energy but for
 *
 *     1/2 |v1 - v0|_M^2 + grad W(x1) . (x1 - x0) - (W(x1) - W(x0)),
 *
 * both of which are 0 or more where W is convex. Held places move by dx, and are left out. */
static double euler_loss(const System *system, const double *x0, const double *v0,
                         const State *now) {
    int n = 3 * system->place_count;
    double *force = calloc((size_t)n, sizeof *force);
    double loss = system_elastic_energy(system, x0) - system_elastic_energy(system, now->x);
    system_add_gradient(system, now->x, force);
    for (int k = 0; k < n; k++) {
        double dv = now->v[k] - v0[k], dx = now->x[k] - x0[k];
        loss += 0.5 * system->mass[k / 3] * dv * dv + force[k] * dx;
    }
    free(force);
    return loss;
}

/* A swing from a side that is held still, one step a frame, solved to the end. */
static void test_euler_swing(void **unused) {
    (void)unused;
    Play play;
    double taken = 0.0, exact = 0.0, drag = 0.0;
    play_start(&play, "toile: 1\nfilm: {rate: 120, seconds: 1}\n"
                      "solver: {stepper: backward_euler, step: 1/120 s, newton_iterations: 30}\n"
                      "cloth:\n  sheet:\n    shape: {rectangle: {width: 1 m, height: 1 m}}\n"
                      "    fabric: {weight: 200 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3, "
                      "bending: 1e-4 N m}}\n    nodes: 11 x 11\n    damping: 0.5 1/s\n"
                      "handles:\n  - {hold: sheet.left}\n");
    const System *system = &play.sim.system;
    const Statistics *s = &play.sim.statistics;
    size_t bytes = 3 * (size_t)system->place_count * sizeof(double);
    double *x0 = malloc(bytes), *v0 = malloc(bytes);
    double start = energy_of(s), high = s->gravity;
    for (int f = 1; f < 120; f++) {
        memcpy(x0, play.sim.state.x, bytes);
        memcpy(v0, play.sim.state.v, bytes);
        play_to(&play, f / 120.0);
        assert_true(s->steps == 1.0);
        exact += euler_loss(system, x0, v0, &play.sim.state);
        taken += s->numerical;
        drag += s->drag;
    }
    CHECK_NEAR(taken / exact, 1.0, 1e-3);
    CHECK_NEAR((start - energy_of(s) - drag - taken) / (high - s->gravity), 0.0, 1e-9);
    assert_true(taken > 0.02 * (high - s->gravity) && drag > 0.0 && s->friction == 0.0);
    free(x0);
    free(v0);
    play_end(&play);
}

/* A card that slides on a floor until it rests: friction has all that it had, along its way. */
static void test_sliding_card(void **unused) {
    (void)unused;
    Play play;
    double friction = 0.0, numerical = 0.0, mu = 0.3;
    play_start(
        &play,
        "toile: 1\nfilm: {rate: 60, seconds: 2}\nsolver: {stepper: bdf2, step: 1/480 s}\n"
        "cloth:\n  card:\n    shape: {rectangle: {width: 20 cm, height: 10 cm}}\n"
        "    fabric: {weight: 500 g/m2, friction: 0.3, isotropic: {stretch: 2e4 N/m, poisson: "
        "0.3, bending: 1e-2 N m}}\n    nodes: 9 x 5\n    at: [0, 0, 1 mm]\n"
        "    velocity: [1.5 m/s, 0, 0]\n"
        "obstacles:\n  floor: {plane: {}, friction: 0.3}\n");
    const Statistics *s = &play.sim.statistics;
    play_to(&play, 0.05); /* it has come down */
    double start = energy_of(s), kinetic = s->kinetic, from = play_mean_x(&play).x;
    while (play.sim.state.time < 1.5) {
        play_to(&play, play.sim.state.time + 1e-3);
        friction += s->friction;
        numerical += s->numerical;
    }
    double way = play_mean_x(&play).x - from, weight = 0.5 * 0.02 * 9.81;
    CHECK_NEAR(way * mu * weight / kinetic, 1.0, 0.02);
    CHECK_NEAR(friction / kinetic, 1.0, 0.02);
    CHECK_NEAR((start - energy_of(s) - friction - numerical) / kinetic, 0.0, 1e-6);
    CHECK_AT_MOST(fabs(numerical) / kinetic, 0.02);
    CHECK_AT_MOST(s->kinetic / kinetic, 1e-6);
    play_end(&play);
}

/* the same for any number of threads */
/* A patch that a handle holds as a whole is pressed into a sheet that is held at two sides: what is in the sheet, or was
 * taken there, the handle gave, by the law and by impulses. */
static void test_pressing_handle(void **unused) {
    (void)unused;
    static const char *const contacts[] = {"penalty", "impulses"};
    for (int k = 0; k < 2; k++) {
        char text[900];
        snprintf(
            text, sizeof text,
            "toile: 1\nfilm: {rate: 30, seconds: 0.6}\ngravity: 0 m/s2\n"
            "solver: {stepper: central, contact: %s}\n"
            "cloth:\n  sheet:\n    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n"
            "    fabric: {name: f, weight: 200 g/m2, thickness: 1 mm, friction: 0.3, isotropic: "
            "{stretch: 500 N/m, poisson: 0.3, bending: 1e-5 N m}}\n    nodes: 16 x 16\n"
            "  patch:\n    shape: {rectangle: {width: 8 cm, height: 8 cm}}\n"
            "    fabric: {name: g, weight: 200 g/m2, thickness: 1 mm, friction: 0.3, isotropic: "
            "{stretch: 500 N/m, poisson: 0.3, bending: 1e-5 N m}}\n    nodes: 6 x 6\n"
            "    at: [3 mm, 2 mm, 2 mm]\n"
            "handles:\n  - {hold: [sheet.left, sheet.right]}\n"
            "  - {hold: patch.all, motion: [{move: {by: [0, 0, -4 cm], from: 0 s, to: 0.4 s}}]}\n",
            contacts[k]);
        Book book = keep_book(text, 0.6, 1);
        double kept = book.rise + book.taken + book.fabric + book.drag;
        CHECK_AT_MOST(0.02 - book.given, 0.0);
        CHECK_NEAR(kept, book.given, 0.04 * book.given);
    }
}

static void test_threads(void **unused) {
    (void)unused;
    const char *text = SHEET "    damping: 1 1/s\nhandles:\n  - {hold: sheet.left}\n";
    Book one = keep_book(text, 0.4, 1), three = keep_book(text, 0.4, 3);
    assert_true(one.fabric == three.fabric && one.drag == three.drag && one.fabric > 0.0);
    parallel_set_threads(1);
}

int main(int argc, char **argv) {
    (void)argc;
    parallel_fix_environment(argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_damping),         cmocka_unit_test(test_turning_clamp),
        cmocka_unit_test(test_twisted_sleeve),  cmocka_unit_test(test_released_twist),
        cmocka_unit_test(test_euler_swing),     cmocka_unit_test(test_sliding_card),
        cmocka_unit_test(test_pressing_handle), cmocka_unit_test(test_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
