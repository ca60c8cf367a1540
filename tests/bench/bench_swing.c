/* swing: run time against time error, all steppers, on all models. Errors are those of time
 * alone: rms distance of nodes over 10 output times from RK4 with a fine step on the same mesh. */
#include <math.h>
#include <string.h>

#include "tests/bench/bench.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

enum { N = 26, FRAMES = 10, SIZE = 3 * N * N * FRAMES };

typedef struct Way {
    const char *stepper;
    double step;    /* [s]; 0: explicit, from the limit */
    double courant; /* of the stepper's own limit */
    int iterations; /* of Newton */
    double tolerance;
} Way;

typedef struct Outcome {
    double cpu, gain, step; /* [s], [J], [s] */
    double retries;
    const char *failure; /* NULL: none */
} Outcome;

/* 1 m sheet on two corners, released 60 degrees from where it hangs, Eh 1000 N/m, G 300 N/m, B 1e-3 N m, 0.2 kg/m2 */
static void make(Bench *b, const char *model, const Way *way) {
    memset(b, 0, sizeof *b);
    b->cloth = cloths_rectangle(1.0, 1.0, N, N, cloths_fabric(0.2, 1e3, 0.3, 1e-3, 0.0));
    b->cloth.fabric.shear.value = 300.0;
    b->cloth.model = model;
    b->cloth.buckling = BUCKLE_NONE;
    b->cloth.pose.turn = quat_from_axis_angle(vec3(1, 0, 0), 30.0 * PI / 180.0);
    b->scene = cloths_scene(&b->cloth);
    b->scene.solver.self_contact = false;
    b->scene.solver.stepper = way->stepper;
    b->scene.solver.step = way->step;
    b->scene.solver.courant = way->courant;
    b->scene.solver.newton_iterations = way->iterations;
    b->scene.solver.tolerance = way->tolerance;
    b->handles[0] = b->handles[1] = handle_default();
    b->handles[0].region = REGION_TOP_LEFT;
    b->handles[1].region = REGION_TOP_RIGHT;
    bench_build(b, 2);
}

/* positions at FRAMES times into x; CPU of stepping alone */
static Outcome run(const char *model, const Way *way, double *x) {
    Bench b;
    make(&b, model, way);
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
    {"symplectic_euler", 0, 0.98, 2, 0},
    {"central", 0, 0.98, 2, 0},
    {"central", 0, 0.8, 2, 0},
    {"central", 0, 0.4, 2, 0},
    {"midpoint", 0, 1.0, 2, 0},
    {"rk4", 0, 0.92, 2, 0},
    {"rk45", 0, 1.0, 2, 1e-4},
    {"rk45", 0, 1.0, 2, 1e-5},
    {"rk45", 0, 1.0, 2, 1e-6},
    {"one_solve", 1.0 / 30, 1, 1, 0},
    {"one_solve", 1.0 / 60, 1, 1, 0},
    {"one_solve", 1.0 / 120, 1, 1, 0},
    {"one_solve", 1.0 / 480, 1, 1, 0},
    {"backward_euler", 1.0 / 60, 1, 1, 0},
    {"backward_euler", 1.0 / 120, 1, 1, 0},
    {"backward_euler", 1.0 / 480, 1, 1, 0},
    {"backward_euler", 1.0 / 30, 1, 30, 0},
    {"backward_euler", 1.0 / 60, 1, 30, 0},
    {"backward_euler", 1.0 / 240, 1, 30, 0},
    {"bdf2", 1.0 / 60, 1, 1, 0},
    {"bdf2", 1.0 / 120, 1, 1, 0},
    {"bdf2", 1.0 / 240, 1, 1, 0},
    {"bdf2", 1.0 / 60, 1, 2, 0},
    {"bdf2", 1.0 / 120, 1, 2, 0},
    {"bdf2", 1.0 / 240, 1, 2, 0},
    {"bdf2", 1.0 / 60, 1, 30, 0},
    {"bdf2", 1.0 / 120, 1, 30, 0},
};

static void run_model(const char *model) {
    static double reference[SIZE], x[SIZE];
    const Way fine = {"rk4", 0, 0.085, 2, 0};
    Outcome out = run(model, &fine, reference);
    bench_write((BenchRow){"swing", "reference", "rk4", "rms_error", N, out.step, 0, NAN, 0,
                           out.cpu, "0.12 of the limit", model});
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        char note[120];
        const Way *w = &ways[k];
        out = run(model, w, x);
        double error = out.failure ? NAN : rms(x, reference);
        if (w->step > 0.0) {
            snprintf(note, sizeof note, "%d iterations; ", w->iterations);
        } else if (w->tolerance > 0.0) {
            snprintf(note, sizeof note, "tolerance %g m; ", w->tolerance);
        } else {
            snprintf(note, sizeof note, "courant %g; ", w->courant);
        }
        size_t at = strlen(note);
        snprintf(note + at, sizeof note - at, "energy gain %.2g J; %.0f taken back", out.gain,
                 out.retries);
        bench_write((BenchRow){"swing", "T=1s", w->stepper, "rms_error", N, out.step, error, NAN,
                               error, out.cpu, out.failure ? out.failure : note, model});
    }
}

static void run_swing(void) {
    for (int k = 0; cloth_models[k]; k++) {
        run_model(cloth_models[k]->name);
    }
}

const BenchSuite bench_swing = {"swing", "1 m sheet, released 60 degrees from hanging, n = 26, 1 s",
                                run_swing};
