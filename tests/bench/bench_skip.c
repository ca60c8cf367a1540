/* bench_skip.c: what contact costs where nothing touches, against the same run without it. */
#include <math.h>

#include "tests/bench/bench.h"
#include "tests/support/play.h"

typedef struct Swing {
    const char *name, *hold;
    double size, stretch, bending; /* [m], [N/m], [N m] */
    double damping;                /* [1/s] */
    int nodes;
} Swing;

static const Swing swings[] = {
    {"stiff swing", "sheet.top", 0.3, 1e4, 3e-3, 0.2, 26},
    {"hanging by two corners", "sheet.top-left, sheet.top-right", 0.2, 1000, 1e-5, 1.0, 41},
    {"limp fast swing", "sheet.top", 0.3, 1000, 1e-5, 0.2, 51},
};

#define REPEATS 11 /* of which the fastest count */

static double play_swing(const Swing *swing, bool contact, uint64_t *hash) {
    char text[1200];
    Play play;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 9}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: %g m, height: %g m}}\n"
             "    fabric: {name: f, weight: 150 g/m2, thickness: 0.5 mm, isotropic:"
             " {stretch: %g N/m, poisson: 0.3, bending: %g N m}}\n"
             "    nodes: %d x %d\n    damping: %g 1/s\nhandles: [{hold: [%s]}]\n"
             "solver: {stepper: central, self_contact: %s}\n",
             swing->size, swing->size, swing->stretch, swing->bending, swing->nodes, swing->nodes,
             swing->damping, swing->hold, contact ? "true" : "false");
    play_start(&play, text);
    play_to(&play, 2.0);
    double cpu = play.sim.total.cpu;
    *hash = sim_state_hash(&play.sim);
    play_end(&play);
    return cpu;
}

static void run(void) {
    for (size_t i = 0; i < sizeof swings / sizeof swings[0]; i++) {
        double with = INFINITY, without = INFINITY;
        uint64_t hash[2];
        for (int k = 0; k < REPEATS; k++) {
            with = fmin(with, play_swing(&swings[i], true, &hash[0]));
            without = fmin(without, play_swing(&swings[i], false, &hash[1]));
        }
        bench_write((BenchRow){"skip", swings[i].name, "central", "share_of_contact",
                               swings[i].nodes, NAN, with / without - 1.0, 0.02, NAN, with,
                               hash[0] == hash[1] ? "same bits" : "touches", NULL});
    }
}

const BenchSuite bench_skip = {"skip", "what contact costs where nothing touches", run};
