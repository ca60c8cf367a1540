/* cantilever: the heavy elastica, by mlpg over resolution, stiffness and kind of Newton, and by all
 * models with each of their forms of bending: tip errors over resolution, and the master curve. */
#include <math.h>
#include <string.h>

#include "tests/bench/bench.h"
#include "tests/support/strips.h"

static void run_newton(double gamma, int nodes, int variant) {
    StripCase c = {.gamma = gamma,
                   .stiffness = variant == 0 ? 1e6 : 1e8,
                   .nodes = nodes,
                   .plain_newton = variant == 2};
    char name[64], note[64];
    double cpu = bench_cpu();
    StripResult r = strip_solve(&c);
    snprintf(name, sizeof name, "gamma=%g S=%g", c.gamma, c.stiffness);
    snprintf(note, sizeof note, "%s Newton; %d iterations; status %d",
             variant == 2 ? "plain" : "mixed-point", r.iterations, (int)r.status);
    bench_write((BenchRow){"cantilever", name, "static", "tip_drop", nodes, NAN, r.tip_drop, NAN,
                           r.error, bench_cpu() - cpu, note, NULL});
}

/* Newton where it finds the hanging strip, else kinetic damping, on softer cloth */
static void run_form(const ClothModel *model, BendingKind bending, double gamma, int segments,
                     const char *suite) {
    StripCase c = {.gamma = gamma,
                   .stiffness = 1e8,
                   .nodes = segments + 1,
                   .bending = bending,
                   .buckling = BUCKLE_ARC,
                   .model = model->name};
    bool kinks =
        bending == BENDING_CHOI_KO || bending == BENDING_CHORD || bending == BENDING_PROVOT;
    char name[64], note[80];
    double cpu = bench_cpu(), exact[2];
    StripResult r = {.status = NEWTON_STOPPED};
    const char *way = "Newton";
    if (!kinks) {
        r = strip_solve(&c);
    }
    if (kinks || gamma > 100 || r.status != NEWTON_CONVERGED) {
        c.stiffness = 1e6;
        r = strip_relax(&c, 400000);
        way = "kinetic damping";
    }
    strip_exact(gamma, exact);
    snprintf(name, sizeof name, "%s gamma=%g", bending_words[bending], gamma);
    snprintf(note, sizeof note, "%s; S=%g; status %d", way, c.stiffness, (int)r.status);
    bench_write((BenchRow){suite, name, "static", "H_over_W", segments + 1, NAN,
                           r.tip_drop / r.tip_x, exact[1] / exact[0], r.error, bench_cpu() - cpu,
                           note, model->name});
}

static void run_models(void) {
    const double all[] = {0.1, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000};
    const double some[] = {1, 10, 100, 1000};
    for (const ClothModel *const *model = cloth_models; *model; model++) {
        for (int bending = 1; bending < BENDING_COUNT; bending++) {
            /* a clamp on a lattice needs the stencil of mlpg */
            bool wide = strcmp((*model)->name, "mlpg") == 0 && bending == BENDING_RBF;
            if (!((*model)->lattice_bendings & 1u << bending) || wide) {
                continue;
            }
            for (size_t g = 0; g < sizeof all / sizeof *all; g++) {
                run_form(*model, (BendingKind)bending, all[g], 20, "master");
            }
            for (size_t g = 0; g < sizeof some / sizeof *some; g++) {
                for (int segments = 10; segments <= 40; segments *= 2) {
                    run_form(*model, (BendingKind)bending, some[g], segments, "models");
                }
            }
        }
    }
}

static void run_cantilever(void) {
    const double gammas[4] = {1, 10, 100, 1000};
    const int nodes[4] = {11, 21, 41, 81};
    for (int g = 0; g < 4; g++) {
        for (int k = 0; k < 4; k++) {
            run_newton(gammas[g], nodes[k], 0);
            run_newton(gammas[g], nodes[k], 1);
            if (nodes[k] == 21) { /* plain Newton for comparison at one resolution */
                run_newton(gammas[g], nodes[k], 2);
            }
        }
    }
    run_models();
}

const BenchSuite bench_cantilever = {"cantilever", "heavy elastica, static, from flat; all models",
                                     run_cantilever};
