/* All steppers in one loop: order in time, free fall, momentum, energy, limits, what they refuse. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/step/stepper.h"
#include "sim/step/stochastic.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/play.h"
#include "tests/support/run.h"

typedef struct Expected {
    const char *name;
    double order; /* in time; 0: has none */
    bool contact;
} Expected;

/* a new stepper has its line here too */
static const Expected expected[] = {
    {"central", 2, true},
    {"bdf2", 2, true},
    {"backward_euler", 1, true},
    {"static", 0, true},
    {"symplectic_euler", 1, true},
    {"forward_euler", 1, false},
    {"midpoint", 2, false},
    {"rk4", 4, false},
    {"rk45", 5, false},
    {"one_solve", 1, false},
    {"relaxation", 0, false},
    {"stochastic", 0, false},
    {"three_phase", 0, false}, /* random moves have no order; see test_three_phase_* */
};

static const Expected *expected_of(const Stepper *stepper) {
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        if (strcmp(expected[i].name, stepper->name) == 0) {
            return &expected[i];
        }
    }
    fail_msg("stepper '%s' is not in the table of this test", stepper->name);
    return NULL;
}

/* a soft sheet of 6 x 6 nodes that falls from 60 degrees, so that steps can vary widely */
static void make_sheet(Run *r) {
    memset(r, 0, sizeof *r);
    r->bench.scene = scene_default();
    r->bench.cloth = cloths_rectangle(1.0, 1.0, 6, 6, cloths_fabric(0.2, 40.0, 0.3, 1e-3, 0.3));
    r->bench.cloth.model = "triangles";
    r->bench.scene = cloths_scene(&r->bench.cloth);
    r->bench.scene.solver.self_contact = false;
    r->bench.scene.solver.newton_iterations = 30;
    r->bench.scene.solver.courant = 1.0;
    r->bench.cloth.pose.turn = quat_from_axis_angle(vec3(1, 0, 0), 60.0 * PI / 180.0);
    r->bench.handles[0] = r->bench.handles[1] = handle_default();
    r->bench.handles[0].region = REGION_TOP_LEFT;
    r->bench.handles[1].region = REGION_TOP_RIGHT;
    bench_build(&r->bench, 2);
}

enum { SHEET = 3 * 36 };

/* positions at 0.3 s by steps of 0.3 s / count */
static void sheet_at_end(const Stepper *stepper, int count, double tolerance, double x[SHEET]) {
    Run r;
    make_sheet(&r);
    r.bench.scene.solver.tolerance = tolerance;
    run_start(&r, stepper->name, 0.3 / count);
    run_to(&r, 0.3);
    memcpy(x, r.state.x, SHEET * sizeof *x);
    run_end(&r);
}

static double distance(const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < SHEET; i++) {
        sum += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return sqrt(sum / 36);
}

static void test_order(void **unused) {
    (void)unused;
    double exact[SHEET], x[SHEET], errors[2];
    sheet_at_end(stepper_find("rk4"), 4000, 0.0, exact);
    for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
        double order = expected_of(*stepper)->order;
        bool controlled = order == 5;
        /* steps short enough for each limit, long enough for errors above rounding */
        int steps = order == 4 ? 60 : order == 1 ? 12000 : 2000;
        for (int k = 0; k < 2 && order > 0; k++) {
            sheet_at_end(*stepper, controlled ? 1 : steps << k, k ? 1e-8 : 1e-6, x);
            errors[k] = distance(x, exact);
        }
        if (order == 0) {
            continue;
        }
        print_message("  %s: errors %.3g, %.3g m\n", (*stepper)->name, errors[0], errors[1]);
        if (controlled) { /* the error follows the tolerance */
            CHECK_AT_MOST(errors[0], 1e-4);
            CHECK_AT_MOST(errors[1], 1e-6);
        } else {
            CHECK_NEAR(log2(errors[0] / errors[1]), order, 0.15);
        }
    }
}

/* free flight of a shaken, thrown sheet: momentum stays, its centre falls as it must */
static void test_flight(void **unused) {
    (void)unused;
    for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
        double order = expected_of(*stepper)->order;
        if (order == 0) {
            continue;
        }
        Run r = {0};
        r.bench.cloth = cloths_rectangle(0.3, 0.3, 8, 8, cloths_orthotropic());
        r.bench.cloth.velocity = vec3(1.0, -0.5, 2.0);
        r.bench.cloth.noise = 1e-3;
        r.bench.cloth.model = "triangles";
        r.bench.scene = cloths_scene(&r.bench.cloth);
        r.bench.scene.solver.self_contact = false;
        r.bench.scene.solver.newton_iterations = 30;
        bench_build(&r.bench, 0);
        const double step = order == 1 || (*stepper)->implicit ? 5e-4 : 0.0;
        run_start(&r, (*stepper)->name, step);
        const System *s = &r.bench.system;
        double mass = 0.0;
        Vec3 before = {0}, after = {0}, p = {0};
        for (int i = 0; i < s->place_count; i++) {
            mass += s->mass[i];
            before = vec3_axpy(before, s->mass[i], vec3_load(r.state.x + 3 * i));
        }
        for (int f = 1; f <= 5; f++) {
            run_to(&r, f / 30.0);
        }
        double t = 5 / 30.0;
        for (int i = 0; i < s->place_count; i++) {
            p = vec3_axpy(p, s->mass[i], vec3_load(r.state.v + 3 * i));
            after = vec3_axpy(after, s->mass[i], vec3_load(r.state.x + 3 * i));
        }
        Vec3 moved = vec3_scale(1 / mass, vec3_sub(after, before));
        print_message("  %s: %.2g, %.2g\n", (*stepper)->name, p.x / mass - 1.0,
                      p.z / mass - (2.0 - 9.81 * t));
        CHECK_AT_MOST(fabs(p.x / mass - 1.0), 1e-9);
        CHECK_AT_MOST(fabs(p.y / mass + 0.5), 1e-9);
        CHECK_AT_MOST(fabs(p.z / mass - (2.0 - 9.81 * t)), 1e-9);
        /* first order falls g t dt/2 too far or too short; bdf2 makes one such step */
        double slack = 1e-9 + 0.51 * 9.81 * step * (order == 1 ? t : 2.0 * step);
        CHECK_AT_MOST(fabs(moved.x - t), 1e-9);
        CHECK_AT_MOST(fabs(moved.z - (2.0 * t - 4.905 * t * t)), slack);
        run_end(&r);
    }
}

/* undamped swing for 1 s: energy of the explicit ones */
static void test_energy(void **unused) {
    (void)unused;
    const char *names[2] = {"central", "rk4"};
    const double bars[2] = {1e-4, 1e-5}; /* [J] of some 1 J that turn over */
    for (int k = 0; k < 2; k++) {
        Run r = {0};
        swing_make(&r.bench, 26, SIDES_FREE);
        r.bench.scene.solver.self_contact = false;
        r.bench.system.contact.self = false;
        run_start(&r, names[k], 0.0);
        double before = run_energy(&r);
        for (int f = 1; f <= 30; f++) {
            run_to(&r, f / 30.0);
        }
        CHECK_AT_MOST(fabs(run_energy(&r) - before), bars[k]);
        run_end(&r);
    }
}

/* the limit is the limit: just below it nothing is taken back, a tenth above everything is */
static void test_limit(void **unused) {
    (void)unused;
    for (int above = 0; above < 2; above++) {
        Run r = {0};
        r.bench.scene = scene_default();
        r.bench.cloth = cloths_rectangle(0.5, 0.5, 11, 11, cloths_fabric(0.2, 1e3, 0.2, 1e-5, 0.0));
        r.bench.cloth.model = "springs";
        r.bench.cloth.buckling = BUCKLE_NONE;
        r.bench.cloth.noise = 1e-4;
        r.bench.scene = cloths_scene(&r.bench.cloth);
        r.bench.scene.solver.self_contact = false;
        r.bench.scene.solver.courant = above ? 1.1 : 0.98;
        bench_build(&r.bench, 0);
        run_start(&r, "central", 0.0);
        for (int f = 1; f <= 10; f++) {
            run_to(&r, f / 30.0);
        }
        assert_true(above ? r.statistics.retries > 0 : r.statistics.retries == 0);
        run_end(&r);
    }
}

/* dynamic relaxation comes to the equilibrium that Newton finds */
static void test_relaxation(void **unused) {
    (void)unused;
    double tips[2];
    for (int k = 0; k < 2; k++) {
        Run r = {0};
        r.bench.cloth = cloths_rectangle(0.2, 0.05, 21, 6, cloths_orthotropic());
        r.bench.scene = cloths_scene(&r.bench.cloth);
        r.bench.scene.solver.self_contact = false;
        r.bench.handles[0] = handle_default();
        r.bench.handles[0].kind = HANDLE_CLAMP;
        r.bench.handles[0].region = REGION_LEFT;
        bench_build(&r.bench, 1);
        run_start(&r, k ? "relaxation" : "static", 0.0);
        run_to(&r, 1.0 / 30);
        tips[k] = r.state.x[3 * 20 + 2];
        print_message("  %s: tip %.6f m, %.0f steps\n", r.stepper->name, tips[k],
                      r.statistics.steps);
        run_end(&r);
    }
    CHECK_NEAR(tips[1], tips[0], 1e-6);
}

/* a sheet that falls from flat until it hangs by two corners ends as low as by Newton */
static void test_relaxation_falls(void **unused) {
    (void)unused;
    double energies[2];
    for (int k = 0; k < 2; k++) {
        Run r = {0};
        r.bench.cloth =
            cloths_rectangle(0.3, 0.3, 16, 16, cloths_fabric(0.15, 1000.0, 0.2, 1e-5, 0.0));
        r.bench.scene = cloths_scene(&r.bench.cloth);
        r.bench.scene.solver.self_contact = false;
        r.bench.handles[0] = r.bench.handles[1] = handle_default();
        r.bench.handles[0].region = REGION_TOP_LEFT;
        r.bench.handles[1].region = REGION_TOP_RIGHT;
        bench_build(&r.bench, 2);
        run_start(&r, k ? "relaxation" : "static", 0.0);
        run_to(&r, 1.0 / 30);
        energies[k] = run_energy(&r);
        print_message("  %s: %.7f J, %.0f steps\n", r.stepper->name, energies[k],
                      r.statistics.steps);
        run_end(&r);
    }
    CHECK_NEAR(energies[1], energies[0], 1e-3 * fabs(energies[0]));
}

/* a sheet held by two edges, from flat */
static void make_hammock(Run *r, const char *model) {
    memset(r, 0, sizeof *r);
    r->bench.cloth = cloths_rectangle(0.3, 0.3, 8, 8, cloths_fabric(0.2, 100.0, 0.3, 1e-4, 0.3));
    r->bench.cloth.model = model;
    r->bench.scene = cloths_scene(&r->bench.cloth);
    r->bench.scene.solver.self_contact = false;
    r->bench.handles[0] = r->bench.handles[1] = handle_default();
    r->bench.handles[0].region = REGION_LEFT;
    r->bench.handles[1].region = REGION_RIGHT;
    bench_build(&r->bench, 2);
}

/* random moves of nodes come down to the energy of relaxation, by the same moves each time */
static void test_stochastic(void **unused) {
    (void)unused;
    for (int k = 0; cloth_models[k]; k++) {
        double before, energies[3];
        for (int way = 0; way < 3; way++) {
            Run r;
            make_hammock(&r, cloth_models[k]->name);
            run_start(&r, way ? "stochastic" : "relaxation", 0.0);
            before = run_energy(&r);
            run_to(&r, 1.0 / 30);
            energies[way] = run_energy(&r);
            print_message("  %s, %s: %.9f J, %.0f steps\n", cloth_models[k]->name, r.stepper->name,
                          energies[way], r.statistics.steps);
            run_end(&r);
        }
        CHECK_AT_MOST(energies[1] - energies[0], 0.01 * (before - energies[0]));
        assert_true(energies[1] == energies[2]);
    }
}

/* no sweep raises the energy by more than its threshold, and the widest of them do raise it */
static void test_sweeps(void **unused) {
    (void)unused;
    for (int k = 0; cloth_models[k]; k++) {
        Run r;
        make_hammock(&r, cloth_models[k]->name);
        run_start(&r, "stochastic", 0.0);
        const System *system = &r.bench.system;
        Stochastic *s = stochastic_create(system);
        memcpy(s->held, r.held, (size_t)system->place_count);
        memcpy(s->weightless, r.held, (size_t)system->place_count);
        stochastic_begin(s, 0.01, 7);
        double scale = system->weight * system->size, energy = stochastic_energy(s, r.state.x);
        int rises = 0;
        for (int sweep = 0; sweep < 600; sweep++) {
            double threshold = sweep < 400 ? 1e-3 * scale * pow(0.98, sweep) : 0.0;
            double told = stochastic_sweep(s, threshold, energy, r.state.x);
            double now = run_energy(&r); /* without velocities, by other functions */
            CHECK_NEAR(now, told, 1e-12 * scale);
            CHECK_AT_MOST(now - energy, threshold + 1e-12 * scale);
            rises += now > energy;
            energy = now;
        }
        print_message("  %s: %d of 600 sweeps rose\n", cloth_models[k]->name, rises);
        assert_true(rises > 0);
        run_end(&r);
    }
}

/* ---- three phases ---- */

/* a shaken sheet in the air, without handles */
static void make_flying(Run *r, const char *model) {
    memset(r, 0, sizeof *r);
    r->bench.cloth = cloths_rectangle(0.3, 0.3, 8, 8, cloths_orthotropic());
    r->bench.cloth.velocity = vec3(1.0, -0.5, 2.0);
    r->bench.cloth.noise = 1e-3;
    r->bench.cloth.model = model;
    r->bench.scene = cloths_scene(&r->bench.cloth);
    r->bench.scene.solver.self_contact = false;
    bench_build(&r->bench, 0);
}

/* sum of mass times vector (place_count x 3) */
static Vec3 sum_by_mass(const System *system, const double *vector) {
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < system->place_count; i++) {
        sum = vec3_axpy(sum, system->mass[i], vec3_load(vector + 3 * i));
    }
    return sum;
}

/* free fall is that of symplectic Euler, and of a viscous medium, though moves one at a time do not keep
 * momentum: without its correction the third phase would add what the sweeps moved the centre */
static void test_three_phase_falls(void **unused) {
    (void)unused;
    enum { STEPS = 40, FRAMES = 2 };
    for (int k = 0; k < 4; k++) {
        Run r;
        double d = k == 1 ? 3.0 : 0.0, dt = 1.0 / 30.0 / STEPS;
        make_flying(&r, k == 2 ? "mlpg" : "particles");
        r.bench.scene.solver.breen = k == 3;
        const System *s = &r.bench.system;
        for (int i = 0; i < s->place_count; i++) {
            s->damping[i] = d;
        }
        run_start(&r, "three_phase", dt);
        double mass = 0.0;
        for (int i = 0; i < s->place_count; i++) {
            mass += s->mass[i];
        }
        double vx = 1.0, vz = 2.0, x = 0.0, z = 0.0;
        Vec3 from = sum_by_mass(s, r.state.x);
        double shaken = system_elastic_energy(s, r.state.x);
        for (int f = 1; f <= FRAMES; f++) {
            run_to(&r, f / 30.0);
        }
        for (int n = 0; n < FRAMES * STEPS; n++) {
            double u = d > 0.0 ? -9.81 / d : 0.0, kept = exp(-d * dt);
            vx *= kept;
            vz = d > 0.0 ? u + (vz - u) * kept : vz - 9.81 * dt;
            x += dt * vx, z += dt * vz;
        }
        Vec3 p = vec3_scale(1 / mass, sum_by_mass(s, r.state.v));
        Vec3 moved = vec3_scale(1 / mass, vec3_sub(sum_by_mass(s, r.state.x), from));
        CHECK_NEAR(p.x, vx, 1e-10);
        CHECK_NEAR(p.z, vz, 1e-10);
        CHECK_NEAR(moved.x, x, 1e-10);
        CHECK_NEAR(moved.z, z, 1e-10);
        CHECK_AT_MOST(system_elastic_energy(s, r.state.x), 0.5 * shaken); /* the sweeps did work */
        run_end(&r);
    }
}

/* how far sweeps by themselves carry the centre of free cloth, of how far they move its nodes */
static void test_sweeps_momentum(void **unused) {
    (void)unused;
    Run r;
    make_flying(&r, "particles");
    run_start(&r, "three_phase", 0.0);
    const System *system = &r.bench.system;
    int n = 3 * system->place_count;
    Stochastic *s = stochastic_create(system);
    double *before = arena_push(&r.bench.arena, double, n), moves = 0.0;
    memset(s->weightless, 1, (size_t)system->place_count);
    memcpy(before, r.state.x, (size_t)n * sizeof *before);
    stochastic_begin(s, 1e-4, 11);
    double energy = stochastic_energy(s, r.state.x);
    for (int sweep = 0; sweep < 20; sweep++) {
        energy = stochastic_sweep(s, 0.0, energy, r.state.x);
    }
    for (int k = 0; k < n; k++) {
        before[k] = r.state.x[k] - before[k];
        moves += system->mass[k / 3] * fabs(before[k]);
    }
    double drift = vec3_length(sum_by_mass(system, before)) / moves;
    print_message("  the centre moves %.2g of the mean move\n", drift);
    CHECK_AT_MOST(1e-4, drift); /* what test_three_phase_falls would see */
    CHECK_AT_MOST(drift, 0.2);
    run_end(&r);
}

/* a damped hammock comes to rest at the energy of `static`, by either second phase; that of the paper
 * sags by longer steps */
static void test_three_phase_rests(void **unused) {
    (void)unused;
    double before, energies[4];
    for (int way = 0; way < 4; way++) {
        Run r;
        make_hammock(&r, "springs");
        for (int i = 0; i < r.bench.system.place_count; i++) {
            r.bench.system.damping[i] = 4.0;
        }
        r.bench.scene.solver.breen = way > 1;
        run_start(&r, way ? "three_phase" : "static", way == 3 ? 1.0 / 240 : 0.0);
        before = run_energy(&r);
        for (int f = 1; f <= (way ? 30 : 1); f++) {
            run_to(&r, f / 30.0);
        }
        energies[way] = run_energy(&r);
        print_message("  %s: %.7f J, %.0f steps\n", r.stepper->name, energies[way] - before,
                      r.statistics.steps);
        run_end(&r);
    }
    CHECK_NEAR(energies[1], energies[0], 1e-2 * (before - energies[0]));
    CHECK_NEAR(energies[2], energies[0], 1e-3 * (before - energies[0]));
    CHECK_AT_MOST(energies[2] + 1e-2 * (before - energies[0]), energies[3]);
}

/* the swing of a soft sheet: with inertia first order in the step, that of backward Euler; that of the
 * paper has no time of its own and is printed */
static void test_three_phase_swings(void **unused) {
    (void)unused;
    double exact[SHEET], errors[4];
    sheet_at_end(stepper_find("rk4"), 4000, 0.0, exact);
    for (int k = 0; k < 4; k++) {
        Run r;
        make_sheet(&r);
        r.bench.scene.solver.breen = k == 3;
        r.bench.scene.solver.sweeps = 40;
        run_start(&r, "three_phase", 0.3 / (k == 3 ? 80 : 40 << k));
        run_to(&r, 0.3);
        errors[k] = distance(r.state.x, exact);
        print_message("  %s, %.0f steps: error %.3g m\n", k == 3 ? "breen" : "inertia",
                      r.statistics.steps, errors[k]);
        run_end(&r);
    }
    CHECK_NEAR(log2(errors[0] / errors[1]), 1.0, 0.25);
    CHECK_NEAR(log2(errors[1] / errors[2]), 1.0, 0.25);
}

/* the same bits for any threads, and from a state that another run left */
static void test_three_phase_bits(void **unused) {
    (void)unused;
    double x[2][3 * 64];
    for (int way = 0; way < 2; way++) {
        Run r;
        parallel_set_threads(way ? 3 : 1);
        make_hammock(&r, "particles");
        run_start(&r, "three_phase", 1.0 / 600);
        for (int f = 1; f <= 3; f++) {
            if (way && f == 3) { /* nothing but the state is kept */
                Error error = {0};
                assert_true(r.stepper->create(&r.bench.system, &r.data, &error));
            }
            run_to(&r, f / 30.0);
        }
        memcpy(x[way], r.state.x, sizeof x[way]);
        run_end(&r);
    }
    parallel_set_threads(1);
    assert_memory_equal(x[0], x[1], sizeof x[0]);
}

/* what cannot do contact says so instead of ignoring it, and where that stands */
static void test_refusals(void **unused) {
    (void)unused;
    for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
        Error error = {0};
        Bench b = {0};
        b.cloth = cloths_rectangle(0.3, 0.3, 6, 6, cloths_orthotropic());
        b.scene = cloths_scene(&b.cloth);
        b.scene.solver.where = "a.yaml:7:9";
        bench_build(&b, 0);
        void *data;
        bool made = (*stepper)->create(&b.system, &data, &error);
        assert_int_equal(made, expected_of(*stepper)->contact);
        if (made && (*stepper)->destroy) {
            (*stepper)->destroy(data);
        } else if (!made) {
            assert_int_equal(error.code, EXIT_BAD_INPUT);
            assert_non_null(strstr(error.text, "self_contact: false"));
            assert_ptr_equal(strstr(error.text, "a.yaml:7:9: error: stepper"), error.text);
        }
        arena_free(&b.arena);
    }
}

/* what `stepper: auto` picks; each scene differs from the first by one thing */
static void test_auto(void **unused) {
    (void)unused;
    static const struct {
        const char *film, *stretch, *more, *stepper;
    } cases[] = {
        {"rate: 30, seconds: 6", "1000", "", "central"},
        {"rate: 30, seconds: 6", "1e6", "", "bdf2"},
        /* nobody sees how it comes to rest */
        {"rate: 0.1, seconds: 20", "1000", "solver: {self_contact: false}\n", "static"},
        /* contact makes the path matter */
        {"rate: 0.1, seconds: 20", "1000", "", "central"},
        /* it still swings after 1 s */
        {"rate: 1, seconds: 2", "1000", "solver: {self_contact: false}\n", "central"},
        {"rate: 30, seconds: 6", "1e6",
         "obstacles: {ball: {sphere: {radius: 5 cm}, at: [0, 0, -2 m],"
         " motion: [{move: {axis: x, by: 1 m, from: 0 s, to: 1 s}}]}}\n",
         "central"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        Play play;
        char text[1200];
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {%s}\ncloth:\n  sheet:\n    shape: {rectangle: {width: 40 cm,"
                 " height: 40 cm}}\n    nodes: 21 x 21\n    model: springs\n    damping: 4 1/s\n"
                 "    fabric: {weight: 150 g/m2, isotropic: {stretch: %s N/m, poisson: 0.2,"
                 " bending: 1e-4 N m}}\nhandles: [{hold: [sheet.top-left, sheet.top-right]}]\n%s",
                 cases[k].film, cases[k].stretch, cases[k].more);
        play_start(&play, text);
        print_message("  %zu: %s, %s\n", k, play.sim.stepper->name, play.sim.stepper_why);
        assert_string_equal(play.sim.stepper->name, cases[k].stepper);
        play_end(&play);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_flight),
        cmocka_unit_test(test_energy),
        cmocka_unit_test(test_limit),
        cmocka_unit_test(test_relaxation),
        cmocka_unit_test(test_relaxation_falls),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_auto),
        cmocka_unit_test(test_stochastic),
        cmocka_unit_test(test_sweeps),
        cmocka_unit_test(test_sweeps_momentum),
        cmocka_unit_test(test_three_phase_falls),
        cmocka_unit_test(test_three_phase_rests),
        cmocka_unit_test(test_three_phase_swings),
        cmocka_unit_test(test_three_phase_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
