/* swing: run time against time error, all steppers, on all models. Errors are those of time
 * alone: rms distance of nodes over 10 output times from RK4 with a fine step on the same mesh.
 *
 * Each row stands beside the prototype of particles_springs_triangles.md 4.2, which swings springs:
 * its error, and its CPU time. Times are compared up to one factor for each road, explicit and
 * implicit: it holds the machine, the speed of a gradient and that of the factorisation, which are
 * no property of a stepper. The prototype does not scale inertia: one row more says what that adds. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/bench/bench.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

enum { N = 26, FRAMES = 10, SIZE = 3 * N * N * FRAMES };

typedef struct Way {
    const char *stepper;
    double step;    /* [s]; 0: explicit, from the limit */
    double courant; /* of the stepper's own limit */
    int iterations; /* of Newton; of three_phase sweeps, negative: as published */
    double tolerance;
    double error, cpu; /* [m], [s] of the prototype; 0: it has no such row */
} Way;

#define SMALL_ERROR 1e-5 /* [m] the prototype tells no smaller ones apart */
#define ERROR_FACTOR 1.3 /* of rows that reproduce the prototype */
#define COST_FACTOR 1.5
#define UNCAPPED 20.0 /* courant: only the tolerance bounds the step */

typedef struct Outcome {
    double cpu, gain, step; /* [s], [J], [s] */
    double retries;
    const char *failure; /* NULL: none */
} Outcome;

/* 1 m sheet on two corners, released 60 degrees from where it hangs, C11 1000 N/m, G 300 N/m, B 1e-3 N m, 0.2 kg/m2 */
static void make(Bench *b, const char *model, const Way *way, bool scaled) {
    memset(b, 0, sizeof *b);
    b->cloth = cloths_rectangle(1.0, 1.0, N, N, cloths_fabric(0.2, 910.0, 0.3, 1e-3, 0.0));
    b->cloth.fabric.shear.value = 300.0;
    b->cloth.model = model;
    b->cloth.buckling = BUCKLE_NONE;
    b->cloth.pose.turn = quat_from_axis_angle(vec3(1, 0, 0), 30.0 * PI / 180.0);
    b->scene = cloths_scene(&b->cloth);
    b->scene.solver.self_contact = false;
    b->scene.solver.stepper = way->stepper;
    b->scene.solver.step = way->step;
    b->scene.solver.courant = way->courant;
    b->scene.solver.newton_iterations = abs(way->iterations);
    b->scene.solver.sweeps = abs(way->iterations);
    b->scene.solver.breen = way->iterations < 0;
    b->scene.solver.tolerance = way->tolerance;
    b->scene.solver.mass_scaling = scaled;
    b->handles[0] = b->handles[1] = handle_default();
    b->handles[0].region = REGION_TOP_LEFT;
    b->handles[1].region = REGION_TOP_RIGHT;
    bench_build(b, 2);
}

/* positions at FRAMES times into x; CPU of stepping alone */
static Outcome run(const char *model, const Way *way, bool scaled, double *x) {
    Bench b;
    make(&b, model, way, scaled);
    const Stepper *s = stepper_find(way->stepper);
    void *data;
    Error error = {0};
    Outcome out = {0};
    s->create(&b.system, &data, &error);
    State state = state_allocate(&b.system, &b.arena);
    unsigned char *held = arena_push(&b.arena, unsigned char, b.system.place_count);
    state_start(&b.system, &state);
    system_mark_held(&b.system, 0, held);
    double start =
        system_elastic_energy(&b.system, state.x) + system_gravity_energy(&b.system, state.x, held);
    Statistics statistics = {.smallest_gap = INFINITY};
    double cpu = bench_cpu();
    for (int f = 1; f <= FRAMES && !out.failure; f++) {
        if (!s->advance(&b.system, data, &state, (double)f / FRAMES, &statistics, &error)) {
            out.failure = "fails";
        }
        memcpy(x + (size_t)(f - 1) * 3 * N * N, state.x, 3 * N * N * sizeof *x);
    }
    out.cpu = bench_cpu() - cpu;
    out.gain = system_kinetic_energy(&b.system, state.v, held) +
               system_elastic_energy(&b.system, state.x) +
               system_gravity_energy(&b.system, state.x, held) - start;
    out.step = 1.0 / fmax(statistics.steps, 1.0);
    out.retries = statistics.retries;
    if (s->destroy) {
        s->destroy(data);
    }
    arena_free(&b.arena);
    return out;
}

static double rms(const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < SIZE; i++) {
        sum += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return sqrt(3.0 * sum / SIZE);
}

static const Way ways[] = {
    {"symplectic_euler", 0, 0.98, 2, 0, 4.2e-4, 0.054},
    {"central", 0, 0.98, 2, 0, 5e-5, 0.056},
    {"central", 0, 0.8, 2, 0, 0, 0},
    {"central", 0, 0.4, 2, 0, 0, 0},
    {"midpoint", 0, 1.0, 2, 0, SMALL_ERROR, 1.2},
    {"rk4", 0, 0.92, 2, 0, SMALL_ERROR, 0.17},
    {"rk45", 0, UNCAPPED, 2, 1e-4, 1e-3, 0.65},
    {"rk45", 0, UNCAPPED, 2, 1e-5, 3e-5, 0.82},
    {"rk45", 0, UNCAPPED, 2, 1e-6, SMALL_ERROR, 1.0},
    {"rk45", 0, 1.0, 2, 1e-5, 0, 0},
    {"one_solve", 1.0 / 30, 1, 1, 0, 0.24, 0.4},
    {"one_solve", 1.0 / 60, 1, 1, 0, 0.12, 0.8},
    {"one_solve", 1.0 / 120, 1, 1, 0, 0.059, 1.4},
    {"one_solve", 1.0 / 480, 1, 1, 0, 0.014, 5.8},
    {"backward_euler", 1.0 / 60, 1, 1, 0, 0.068, 0.67},
    {"backward_euler", 1.0 / 120, 1, 1, 0, 0.038, 1.4},
    {"backward_euler", 1.0 / 480, 1, 1, 0, 0.012, 4.8},
    {"backward_euler", 1.0 / 30, 1, 30, 0, 0.11, 1.2},
    {"backward_euler", 1.0 / 60, 1, 30, 0, 0.065, 1.6},
    {"backward_euler", 1.0 / 240, 1, 30, 0, 0.021, 4.8},
    {"bdf2", 1.0 / 60, 1, 1, 0, 0.035, 0.57},
    {"bdf2", 1.0 / 120, 1, 1, 0, 8.8e-3, 1.0},
    {"bdf2", 1.0 / 240, 1, 1, 0, 3.8e-3, 3.0},
    {"bdf2", 1.0 / 60, 1, 2, 0, 0.0105, 1.1},
    {"bdf2", 1.0 / 120, 1, 2, 0, 5.8e-3, 2.7},
    {"bdf2", 1.0 / 240, 1, 2, 0, 3.3e-3, 4.0},
    {"bdf2", 1.0 / 60, 1, 30, 0, 0.0103, 1.6},
    {"bdf2", 1.0 / 120, 1, 30, 0, 5.8e-3, 2.7},
    {"three_phase", 1.0 / 960, 1, 20, 0, 0, 0},
    {"three_phase", 1.0 / 960, 1, -20, 0, 0, 0},
};
enum { WAYS = sizeof ways / sizeof *ways };

/* the fastest of a few runs, where they are short */
#define BRIEF 0.3 /* [CPU s] */
static Outcome run_best(const char *model, const Way *way, bool scaled, double *x) {
    Outcome best = run(model, way, scaled, x);
    for (int trial = 1; trial < 4 && best.cpu < BRIEF && !best.failure; trial++) {
        best.cpu = fmin(best.cpu, run(model, way, scaled, x).cpu);
    }
    return best;
}

static bool is_implicit(const Way *way) { return stepper_find(way->stepper)->implicit; }

static int compare_numbers(const void *a, const void *b) {
    double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

/* median of CPU time / that of the prototype on one road */
static double find_unit(const Outcome *out, bool implicit) {
    double ratios[WAYS];
    int count = 0;
    for (int k = 0; k < WAYS; k++) {
        if (ways[k].cpu > 0.0 && is_implicit(&ways[k]) == implicit) {
            ratios[count++] = out[k].cpu / ways[k].cpu;
        }
    }
    qsort(ratios, (size_t)count, sizeof *ratios, compare_numbers);
    return ratios[count / 2];
}

static int describe(const Way *w, char *note, size_t room) {
    if (w->step > 0.0) {
        return snprintf(note, room, "%d iterations%s; ", abs(w->iterations),
                        w->iterations < 0 ? " as published" : "");
    }
    if (w->tolerance > 0.0) {
        return snprintf(note, room, "tolerance %g m%s; ", w->tolerance,
                        w->courant >= UNCAPPED ? "" : " and the limit");
    }
    return snprintf(note, room, "courant %g; ", w->courant);
}

/* Rows beside the prototype. */
typedef struct Tally {
    int rows, errors, smaller, costs; /* all; errors within the factor, smaller; costs within */
} Tally;

static void write_way(const char *model, const Way *w, const Outcome *out, double error,
                      double unit, Tally *tally) {
    char note[200];
    int at = describe(w, note, sizeof note);
    at += snprintf(note + at, sizeof note - (size_t)at, "energy gain %.2g J; %.0f taken back",
                   out->gain, out->retries);
    if (w->error > 0.0) {
        double wrong = fmax(error, SMALL_ERROR) / w->error, dear = out->cpu / unit / w->cpu;
        tally->rows++;
        tally->errors += wrong <= ERROR_FACTOR && wrong >= 1.0 / ERROR_FACTOR;
        tally->smaller += wrong < 1.0 / ERROR_FACTOR;
        tally->costs += dear <= COST_FACTOR && dear >= 1.0 / COST_FACTOR;
        snprintf(note + at, sizeof note - (size_t)at,
                 "; beside the prototype: error %.2f cost %.2f", wrong, dear);
    }
    bench_write((BenchRow){"swing", "T=1s", w->stepper, "rms_error", N, out->step, error,
                           w->error > 0.0 ? w->error : NAN, error, out->cpu,
                           out->failure ? out->failure : note, model});
}

/* the error of scaled inertia, which no shorter step takes away */
static void run_scaled(const char *model, const double *reference) {
    static double x[SIZE];
    const Way way = {.stepper = "central", .courant = 0.98, .iterations = 2};
    Outcome out = run_best(model, &way, true, x);
    double error = out.failure ? NAN : rms(x, reference);
    bench_write((BenchRow){"swing", "T=1s; scaled inertia", "central", "rms_error", N, out.step,
                           error, NAN, error, out.cpu,
                           out.failure ? out.failure : "scaled inertia; 0.98 of its limit", model});
}

static void run_model(const char *model) {
    static double reference[SIZE], x[SIZE];
    const Way fine = {.stepper = "rk4", .courant = 0.085, .iterations = 2};
    Outcome best = run(model, &fine, false, reference), out[WAYS];
    double errors[WAYS], units[2];
    Tally tally = {0};
    bench_write((BenchRow){"swing", "reference", "rk4", "rms_error", N, best.step, 0, NAN, 0,
                           best.cpu, "0.12 of the limit", model});
    for (int k = 0; k < WAYS; k++) {
        out[k] = run_best(model, &ways[k], false, x);
        errors[k] = out[k].failure ? NAN : rms(x, reference);
    }
    for (int implicit = 0; implicit < 2; implicit++) {
        units[implicit] = find_unit(out, implicit);
    }
    for (int k = 0; k < WAYS; k++) {
        write_way(model, &ways[k], &out[k], errors[k], units[is_implicit(&ways[k])], &tally);
    }
    char note[160];
    snprintf(note, sizeof note,
             "of %d rows: %d errors within %g; %d smaller; %d costs within %g; CPU times / the "
             "prototype's: explicit %.2f implicit %.2f",
             tally.rows, tally.errors, ERROR_FACTOR, tally.smaller, tally.costs, COST_FACTOR,
             units[0], units[1]);
    bench_write((BenchRow){"swing", "prototype", "all", "rows_that_agree", N, NAN,
                           tally.errors + tally.smaller, tally.rows, NAN, NAN, note, model});
    if (strcmp(model, "mlpg") == 0) { /* no other has a sweep, whose inertia is scaled */
        run_scaled(model, reference);
    }
}

static void run_swing(void) {
    for (int k = 0; cloth_models[k]; k++) {
        run_model(cloth_models[k]->name);
    }
}

const BenchSuite bench_swing = {"swing", "1 m sheet, released 60 degrees from hanging, n = 26, 1 s",
                                run_swing};
