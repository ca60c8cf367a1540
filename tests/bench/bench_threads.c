/* bench_threads.c: the same drape by one thread and by two, in turns, by the clock on the wall: means
 * something on a machine with two free processors. */
#include <math.h>

#include "sim/base/clock.h"
#include "sim/base/parallel.h"
#include "tests/bench/bench.h"
#include "tests/support/check.h"
#include "tests/support/play.h"

#define TURNS 3
#define SECONDS 0.8

static const int sizes[] = {51, 101};

typedef struct Timed {
    double wall, cpu; /* [s] */
    uint64_t hash;
} Timed;

static Timed drape(int nodes, int threads) {
    char text[1000];
    Play play;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 9}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 1 m, height: 1 m}}\n"
             "    fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3,"
             " bending: 1e-5 N m}}\n    nodes: %d x %d\n    noise: 0.2 mm\n    sides: bounded\n"
             "    at: [0, 0, 2 cm]\nobstacles:\n  cube: {box: {size: [50 cm, 50 cm, 50 cm], "
             "rounding: 5 mm}, at: [0, 0, -25 cm], friction: 0.3}\nsolver: {stepper: central}\n",
             nodes, nodes);
    play_start_threads(&play, text, threads);
    double wall = clock_seconds(), cpu = bench_cpu();
    play_to(&play, SECONDS);
    Timed timed = {clock_seconds() - wall, bench_cpu() - cpu, sim_state_hash(&play.sim)};
    play_end(&play);
    parallel_set_threads(1);
    return timed;
}

static void run_size(int nodes) {
    Timed best[2] = {{.wall = INFINITY}, {.wall = INFINITY}};
    for (int turn = 0; turn < TURNS; turn++) {
        for (int threads = 1; threads <= 2; threads++) {
            Timed timed = drape(nodes, threads);
            assert_true(turn == 0 || timed.hash == best[0].hash);
            best[threads - 1] = timed.wall < best[threads - 1].wall ? timed : best[threads - 1];
        }
    }
    assert_true(best[0].hash == best[1].hash);
    for (int k = 0; k < 2; k++) {
        bench_write((BenchRow){"threads", k == 0 ? "one" : "two", "central", "wall_per_second",
                               nodes, NAN, best[k].wall / SECONDS, NAN, NAN, best[k].cpu,
                               "cube 0.5 m; Eh 1000; best of three", NULL});
    }
    bench_write((BenchRow){"threads", "one / two", "central", "speedup", nodes, NAN,
                           best[0].wall / best[1].wall, NAN, NAN, NAN, "by the wall clock", NULL});
}

static void run(void) {
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        run_size(sizes[k]);
    }
}

const BenchSuite bench_threads = {"threads", "the same drape by one thread and by two", run};
