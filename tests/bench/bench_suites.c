/* The suites: what toile claims about speed and error. */
#include <math.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "tests/bench/bench.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

/* ---- sweep: cost of an explicit step ---- */

static double sweep_ns(const SweepKernel *kernel, int n) {
    Arena arena = {0};
    ClothDef def = cloths_rectangle(1.0, 1.0, n, n, cloths_orthotropic());
    Cloth cloth;
    Error error = {0};
    cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error);
    SweepLattice l = *cloth.lattice;
    l.first = l.stride + LANE_MARGIN;
    Lanes lanes = lanes_create((l.nv + 2) * l.stride + LANE_MARGIN, &arena);
    for (int i = 0; i < cloth.node_count; i++) {
        int slot = l.first + i / n * l.stride + i % n;
        for (int a = 0; a < 3; a++) {
            lanes.x[a][slot] = cloth.panel.start[3 * i + a];
        }
        lanes.weight[slot] = 1.0 / cloth.mass[i];
    }
    double *buffer = arena_push(&arena, double, SWEEP_BUFFER_ROWS *l.stride + LANE_MARGIN);
    double dt = 0.5 * sweep_stable_step(&l, cloth.material.density), best = INFINITY;
    SweepKick kick = {dt, {0, 0, -9.81}, 1.0, {NULL, NULL}, NULL};
    SweepDrift drift = {.dt = dt};
    int steps = 1 + 2000000 / (n * n);
    for (int trial = 0; trial < 7; trial++) {
        double start = bench_cpu();
        for (int s = 0; s < steps; s++) {
            kernel->kick(&l, &lanes, &kick, 0, l.nv, buffer);
            kernel->drift(&l, &lanes, &drift, 0, l.nv);
        }
        best = fmin(best, (bench_cpu() - start) / steps / (n * n) * 1e9);
    }
    arena_free(&arena);
    return best;
}

/* forces of a model by its own function, on a shaken sheet; *nodes: of it */
static double gradient_ns(const ClothDef *def, int *nodes) {
    Arena arena = {0};
    Cloth cloth;
    Error error = {0};
    if (!cloth_create(&cloth, def, NULL, 0, 1, &arena, &error)) {
        arena_free(&arena);
        return NAN;
    }
    int n = *nodes = cloth.node_count;
    double *x = arena_push(&arena, double, 3 * n), *g = arena_push(&arena, double, 3 * n);
    cloth_start(&cloth, x);
    cloths_shake(x, n, 0.05 * cloth.panel.h1, 3);
    double best = INFINITY;
    int calls = 1 + 200000 / n;
    for (int trial = 0; trial < 7; trial++) {
        double start = bench_cpu();
        for (int k = 0; k < calls; k++) {
            cloth.model->add_gradient(&cloth, x, g);
        }
        best = fmin(best, (bench_cpu() - start) / calls / n * 1e9);
    }
    arena_free(&arena);
    return best;
}

static void run_gradients(void) {
    int nodes;
    for (int k = 0; cloth_models[k]; k++) {
        for (int hysteresis = 0; hysteresis < 2; hysteresis++) {
            ClothDef def = cloths_rectangle(1.0, 1.0, 51, 51, cloths_orthotropic());
            def.model = cloth_models[k]->name, def.hysteresis = hysteresis;
            double ns = gradient_ns(&def, &nodes);
            bench_write((BenchRow){"sweep", hysteresis ? "gradient with hysteresis" : "gradient",
                                   "none", "ns_per_node", 51, NAN, ns, NAN, NAN, NAN,
                                   "minimum of 7", def.model});
        }
    }
    for (int k = BENDING_MORLEY; k <= BENDING_HINGE; k++) {
        ClothDef def = cloths_rectangle(1.0, 1.0, 51, 51, cloths_orthotropic());
        char note[64];
        def.model = "triangles", def.bending = (BendingKind)k;
        def.scattered = true, def.spacing = 1.0 / 50;
        double ns = gradient_ns(&def, &nodes);
        snprintf(note, sizeof note, "%s; minimum of 7", bending_words[k]);
        bench_write((BenchRow){"sweep", "gradient on scattered nodes", "none", "ns_per_node", nodes,
                               NAN, ns, NAN, NAN, NAN, note, def.model});
    }
}

static void run_sweep(void) {
    run_gradients();
    const int sizes[4] = {26, 51, 101, 201};
    for (int k = 0; k < 4; k++) {
        double scalar = NAN;
        for (const SweepKernel *const *kernel = sweep_kernels; *kernel; kernel++) {
            if (!sweep_kernel_runs_here(*kernel)) {
                continue;
            }
            double ns = sweep_ns(*kernel, sizes[k]);
            scalar = kernel == sweep_kernels ? ns : scalar;
            char note[64];
            snprintf(note, sizeof note, "%.2f times the scalar speed; minimum of 7", scalar / ns);
            bench_write((BenchRow){"sweep", (*kernel)->name, "central", "ns_per_node_step",
                                   sizes[k], NAN, ns, 14, NAN, NAN, note, NULL});
        }
    }
}

const BenchSuite bench_sweep = {
    "sweep", "kick and drift of a lattice, forces of all models, one core", run_sweep};

/* ---- implicit: one iteration against its factorisation; memory ---- */

enum { SOLVE_ITERATIONS = 4 }; /* a solve of these counts, with all that it begins and ends with */

static void one_iteration(int n) {
    Bench b;
    swing_make(&b, n, SIDES_FREE);
    Implicit *implicit = implicit_create(&b.system);
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    unsigned char *held = arena_push(&b.arena, unsigned char, b.system.place_count);
    system_mark_held(&b.system, 0, held);
    double *x_hat = arena_push(&b.arena, double, 3 * b.system.place_count);
    memcpy(x_hat, state.x, 3 * (size_t)b.system.place_count * sizeof *x_hat);
    ImplicitTerms terms = {.acceleration = 3600.0, .x_hat = x_hat};
    NewtonProblem problem = implicit_problem(implicit, &terms, held, &state);
    problem.keep_stress(problem.context, state.x, NULL);
    problem.tangent(problem.context, state.x, false);
    double factor = INFINITY, whole = INFINITY;
    NewtonParams params = newton_default();
    params.max_iterations = SOLVE_ITERATIONS;
    for (int trial = 0; trial < 7; trial++) {
        memcpy(state.x, x_hat, 3 * (size_t)b.system.place_count * sizeof *x_hat);
        problem.keep_stress(problem.context, state.x, NULL);
        problem.tangent(problem.context, state.x, false);
        double start = bench_cpu();
        factor_numeric(problem.factor, problem.matrix);
        factor = fmin(factor, bench_cpu() - start);
        start = bench_cpu();
        implicit_begin(implicit, held, &state);
        implicit_solve(implicit, &terms, &params, NULL, state.x);
        whole = fmin(whole, (bench_cpu() - start) / SOLVE_ITERATIONS);
    }
    char note[80];
    snprintf(note, sizeof note, "factorisation %.4g ms; nnz(L) %.4g", 1e3 * factor,
             implicit_nonzeros(implicit));
    bench_write((BenchRow){"implicit", "iteration/factorisation", "bdf2", "ratio", n, NAN,
                           whole / factor, 1.25, NAN, whole, note, NULL});
    implicit_destroy(implicit);
    arena_free(&b.arena);
}

void bench_one_step(const char *stepper) {
    Bench b;
    swing_make(&b, 100, SIDES_FREE);
    b.scene.solver.stepper = stepper;
    const Stepper *s = stepper_find(stepper);
    void *data;
    Error error = {0};
    Statistics statistics = {0};
    s->create(&b.system, &data, &error);
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    s->advance(&b.system, data, &state, 1.0 / 30, &statistics, &error);
}

static void run_implicit(void) {
    const int sizes[3] = {20, 51, 100};
    for (int k = 0; k < 3; k++) {
        one_iteration(sizes[k]);
    }
    const char *names[2] = {"central", "bdf2"};
    const double limits[2] = {60, 400};
    for (int k = 0; k < 2; k++) {
        double peak = bench_peak_memory(names[k]);
        bench_write((BenchRow){"implicit", "memory", names[k], "peak_mib", 100, NAN, peak,
                               limits[k], NAN, NAN, "whole process", NULL});
    }
}

const BenchSuite bench_implicit = {"implicit", "cost of one iteration, memory at 100 x 100",
                                   run_implicit};

/* ---- sleeve: the paper's scene against real time ---- */

static void run_sleeve_case(bool self_contact) {
    Bench b = {0};
    MotionPiece turn = {.kind = MOTION_TURN,
                        .axis = {0, 0, 1},
                        .angle = 2.0,
                        .from = 0.5,
                        .to = 4.0,
                        .smooth = true};
    /* E = 10000 N/m, nu = 0.3, 20 x 20 nodes; weight and bending of a shirt cotton */
    b.cloth = cloths_sleeve(0.08, 0.3, 20, 20, false, cloths_fabric(0.15, 1e4, 0.3, 1e-5, 0.3));
    b.scene = cloths_scene(&b.cloth);
    b.scene.solver.self_contact = self_contact;
    b.handles[0] = b.handles[1] = handle_default();
    b.handles[0].region = REGION_BOTTOM;
    b.handles[1].region = REGION_TOP;
    b.handles[1].motion = (Motion){1, &turn};
    bench_build(&b, 2);
    void *data;
    Error error = {0};
    stepper_central.create(&b.system, &data, &error);
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    double start = bench_cpu(), seconds = 5.0;
    Statistics statistics = {.smallest_gap = INFINITY};
    for (int f = 1; f <= 30 * seconds; f++) {
        if (!stepper_central.advance(&b.system, data, &state, f / 30.0, &statistics, &error)) {
            printf("sleeve: %s\n", error.text);
        }
    }
    double cpu = (bench_cpu() - start) / seconds;
    char note[64];
    snprintf(note, sizeof note, "real time / CPU time; %.0f taken back", statistics.retries);
    const char *name = self_contact ? "paper 20 x 20; meets itself" : "paper 20 x 20, E=10000 N/m";
    bench_write((BenchRow){"sleeve", name, "central", "times_real_time", 20, statistics.step_length,
                           1.0 / cpu, 5, NAN, cpu, note, NULL});
    arena_free(&b.arena);
}

static void run_sleeve(void) {
    run_sleeve_case(false);
    run_sleeve_case(true);
}

const BenchSuite bench_sleeve = {"sleeve", "the paper's twisted sleeve, one core", run_sleeve};
