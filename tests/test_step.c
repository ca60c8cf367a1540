/* Steppers: energy, momentum, free fall, the same bits for any number of threads. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "sim/sim.h"
#include "sim/step/lead.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/play.h"
#include "tests/support/run.h"

/* Undamped swings. Held by two corners, the explicit cloth keeps its energy; where the sides
 * there are bounded, within what the bound stores and takes (sides.h). Three implicit
 * iterations never gain. */
static void test_energy(void **unused) {
    (void)unused;
    for (int bounded = 0; bounded < 2; bounded++) {
        Run r = {0};
        swing_make(&r.bench, 26, bounded ? SIDES_BOUNDED : SIDES_FREE);
        run_start(&r, "central", 0.0);
        double start = run_energy(&r), least = 0.0, most = 0.0;
        /* what the swing turns over: the fall of the sheet's centre */
        double scale = 0.5 * r.bench.system.weight;
        for (int f = 1; f <= 60; f++) {
            run_to(&r, f / 30.0);
            double change = (run_energy(&r) - start) / scale;
            least = fmin(least, change), most = fmax(most, change);
        }
        CHECK_AT_MOST(most, bounded ? 1e-3 : 1e-4);
        CHECK_AT_MOST(-least, bounded ? 2e-3 : 1e-4);
        if (!bounded) {
            run_to(&r, 20.0);
            CHECK_AT_MOST(fabs(run_energy(&r) - start), 3e-3); /* [J] */
        }
        run_end(&r);
    }
    Run r;
    memset(&r, 0, sizeof r);
    swing_make(&r.bench, 26, SIDES_FREE);
    r.bench.scene.solver.newton_iterations = 3;
    run_start(&r, "bdf2", 1.0 / 60);
    double start = run_energy(&r), rise = -INFINITY, scale = 0.5 * r.bench.system.weight;
    for (int f = 1; f <= 30; f++) {
        run_to(&r, f / 30.0);
        rise = fmax(rise, (run_energy(&r) - start) / scale);
    }
    CHECK_AT_MOST(rise, 0.0);
    run_end(&r);
}

/* a standing wave along a strip: damping of the membrane takes exp(-tau omega^2 t) of its energy,
 * with the tau that was wished or the longest stable one */
static void test_membrane_damping(void **unused) {
    (void)unused;
    const double wished[2] = {1e-6, 1e-3}, pi = 3.14159265358979, time = 0.1;
    const int cells = 40, wave = 4;
    for (int k = 0; k < 2; k++) {
        Run r = {0};
        r.bench.cloth =
            cloths_rectangle(0.4, 0.1, cells + 1, 11, cloths_fabric(0.15, 1e3, 0, 0, 0));
        r.bench.cloth.membrane_damping = wished[k];
        r.bench.scene = cloths_scene(&r.bench.cloth);
        r.bench.scene.gravity = vec3(0, 0, 0);
        bench_build(&r.bench, 0);
        run_start(&r, "central", 0.0);
        const Cloth *cloth = &r.bench.system.cloths[0];
        for (int i = 0; i < r.bench.system.node_count; i++) {
            r.state.v[3 * i] = 1e-3 * cos(pi * wave * (i % (cells + 1)) / cells);
        }
        double start = run_energy(&r), c = sqrt(1e3 / 0.15);
        double omega = 2.0 * c * cells / 0.4 * sin(0.5 * pi * wave / cells);
        run_to(&r, time);
        SweepLattice lattice = *cloth->lattice;
        lattice.scaled = r.state.scaled != 0.0;
        double tau =
            lead_time(sweep_fastest(&lattice, 0.15).membrane, wished[k], r.statistics.step_length);
        assert_true(k == 0 ? tau == wished[k] : tau < wished[k]);
        CHECK_NEAR(run_energy(&r) / start, exp(-tau * omega * omega * time), 0.01);
        run_end(&r);
    }
}

/* a flat sheet that starts to bend in waves along its warp: what it keeps of its energy */
static double kept_by_bending(const char *model, bool scattered, double damping) {
    const double pi = 3.14159265358979;
    const int cells = 40, wave = 8;
    Run r = {0};
    r.bench.cloth = cloths_rectangle(0.4, 0.1, cells + 1, 11, cloths_fabric(0.15, 1e3, 0, 1e-5, 0));
    r.bench.cloth.model = model;
    r.bench.cloth.scattered = scattered;
    r.bench.cloth.spacing = scattered ? 0.01 : 0.0;
    r.bench.cloth.fabric.bend_hysteresis.value = 0.0; /* moments proportional to curvature */
    r.bench.cloth.bending_damping = damping;
    r.bench.cloth.membrane_damping = 0.0;
    r.bench.scene = cloths_scene(&r.bench.cloth);
    r.bench.scene.gravity = vec3(0, 0, 0);
    bench_build(&r.bench, 0);
    run_start(&r, "central", 0.0);
    for (int i = 0; i < r.bench.system.node_count; i++) {
        r.state.v[3 * i + 2] = 1e-3 * cos(pi * wave * (r.state.x[3 * i] / 0.4 + 0.5));
    }
    run_to(&r, 1e-3); /* as short waves have more inertia than their masses (inertia.h) */
    double start = run_energy(&r);
    run_to(&r, 0.2);
    double kept = run_energy(&r) / start;
    run_end(&r);
    return kept;
}

/* the damping of bending is that of the fabric, whether a model has a sweep or not */
static void test_bending_damping(void **unused) {
    (void)unused;
    double sweep = kept_by_bending("mlpg", false, 1e-3);
    CHECK_AT_MOST(sweep, 0.9);
    for (int k = 0; cloth_models[k]; k++) {
        const char *name = cloth_models[k]->name;
        CHECK_NEAR(kept_by_bending(name, false, 1e-3), sweep, 0.01);
        CHECK_NEAR(kept_by_bending(name, false, 0.0), 1.0, 1e-3);
        if (cloth_models[k]->scattered_bendings) {
            CHECK_NEAR(kept_by_bending(name, true, 1e-3), sweep, 0.02);
            CHECK_NEAR(kept_by_bending(name, true, 0.0), 1.0, 1e-3);
        }
    }
}

/* free flight of a shaken, thrown sheet: momentum and angular momentum */
static void test_momentum(void **unused) {
    (void)unused;
    const char *names[2] = {"central", "bdf2"};
    for (int k = 0; k < 2; k++) {
        Run r = {0};
        r.bench.cloth = cloths_rectangle(0.3, 0.3, 16, 16, cloths_orthotropic());
        r.bench.cloth.velocity = vec3(1.0, -0.5, 2.0);
        r.bench.cloth.noise = 1e-3;
        r.bench.scene = cloths_scene(&r.bench.cloth);
        r.bench.scene.gravity = vec3(0, 0, 0);
        r.bench.scene.solver.newton_iterations = 30;
        bench_build(&r.bench, 0);
        run_start(&r, names[k], 0.0);
        const System *s = &r.bench.system;
        Vec3 before = {0}, after = {0};
        double size = 0.0;
        for (int pass = 0; pass < 2; pass++) {
            Vec3 sum = {0};
            for (int i = 0; i < s->place_count; i++) {
                sum = vec3_axpy(sum, s->mass[i], vec3_load(r.state.v + 3 * i));
                size += s->mass[i] * 3.0;
            }
            if (pass == 0) {
                before = sum;
                for (int f = 1; f <= 15; f++) {
                    run_to(&r, f / 30.0);
                }
            } else {
                after = sum;
            }
        }
        CHECK_AT_MOST(vec3_length(vec3_sub(after, before)) / size, 1e-11);
        run_end(&r);
    }
}

/* free fall to 0.1 % at every frame rate */
static void test_free_fall(void **unused) {
    (void)unused;
    const char *names[3] = {"central", "bdf2", "backward_euler"};
    const double rates[4] = {24, 25, 50, 100};
    for (int k = 0; k < 3; k++) {
        for (int rate = 0; rate < 4; rate++) {
            Run r = {0};
            r.bench.cloth = cloths_rectangle(0.3, 0.3, 8, 8, cloths_orthotropic());
            r.bench.scene = cloths_scene(&r.bench.cloth);
            bench_build(&r.bench, 0);
            /* backward Euler is first order: it falls g dt t / 2 too far, here 0.05 % */
            run_start(&r, names[k], k == 2 ? 5e-4 : 0.0);
            for (int f = 1; f <= rates[rate]; f++) {
                run_to(&r, f / rates[rate]);
            }
            double fall = 0.5 * 9.81, speed = 9.81;
            CHECK_AT_MOST(fabs(-r.state.x[2] / fall - 1.0), 1e-3);
            CHECK_AT_MOST(fabs(-r.state.v[2] / speed - 1.0), 1e-3);
            run_end(&r);
        }
    }
}

/* a sheet falls on a tilted plane: it slides when tan(angle) > mu, and stays otherwise */
static void test_incline(void **unused) {
    (void)unused;
    const double mu = 0.3, shares[3] = {0.99, 1.01, 1.05};
    for (int k = 0; k < 3; k++) {
        Run r = {0};
        double angle = atan(mu * shares[k]);
        ObstacleDef plane = obstacle_default();
        plane.name = "plane";
        plane.solid = (Solid){.kind = SOLID_PLANE};
        plane.friction = mu;
        plane.pose.turn = quat_from_axis_angle(vec3(0, 1, 0), angle);
        r.bench.cloth = cloths_rectangle(0.2, 0.2, 11, 11, cloths_orthotropic());
        r.bench.cloth.pose.turn = plane.pose.turn;
        r.bench.cloth.pose.shift = quat_rotate(plane.pose.turn, vec3(0, 0, 1e-3));
        r.bench.scene = cloths_scene(&r.bench.cloth);
        r.bench.scene.obstacle_count = 1;
        r.bench.scene.obstacles = &plane;
        bench_build(&r.bench, 0);
        run_start(&r, "central", 0.0);
        Vec3 down = quat_rotate(plane.pose.turn, vec3(1, 0, 0));
        double at[3];
        for (int f = 1; f <= 60; f++) {
            run_to(&r, f / 30.0);
            if (f % 30 == 0 || f == 15) {
                int c = 5 * 11 + 5;
                at[f == 15 ? 0 : f / 30] = vec3_dot(vec3_load(r.state.x + 3 * c), down);
            }
        }
        /* x(t) = a t^2 / 2 + start: second difference of 1 s and 2 s against 0.5 s */
        double exact = 9.81 * (sin(angle) - mu * cos(angle));
        double slid = at[2] - at[1];
        print_message("  %.2f of mu: slid %.3g m, expected %.3g m\n", shares[k], slid,
                      1.5 * fmax(exact, 0.0));
        if (shares[k] < 1.0) {
            CHECK_AT_MOST(fabs(slid), 1e-6);
        } else {
            CHECK_NEAR(slid, 1.5 * exact, 0.02 * 1.5 * exact + 1e-3);
        }
        run_end(&r);
    }
}

/* cloth without damping moves the same whether other cloth is damped or not */
static void test_damping_of_one(void **unused) {
    (void)unused;
    double place[2][3];
    for (int damped = 0; damped < 2; damped++) {
        const char *cloth = "shape: {rectangle: {width: 20 cm, height: 20 cm}}\n"
                            "    fabric: {weight: 150 g/m2, isotropic: {stretch: 1000 N/m, "
                            "poisson: 0.3, bending: 10 uN m}}\n    nodes: 9 x 9";
        char text[1600];
        Play play;
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n"
                 "  one:\n    %s\n    bending_damping: 0 s\n    membrane_damping: 0 s\n"
                 "  two:\n    %s\n    at: [1 m, 0 m, 0 m]\n    bending_damping: %s\n"
                 "    membrane_damping: %s\nhandles:\n  - {hold: one.top-left}\n"
                 "solver: {stepper: central, self_contact: false}\n",
                 cloth, cloth, damped ? "1 ms" : "0 s", damped ? "0.1 ms" : "0 s");
        play_start(&play, text);
        play_to(&play, 0.3);
        vec3_store(place[damped], play_x(&play, 0));
        assert_true(play_x(&play, 0).z < -0.05);
        play_end(&play);
    }
    assert_memory_equal(place[0], place[1], sizeof place[0]);
}

/* the same bits with 1, 2 and 3 threads */
static void test_threads(void **unused) {
    (void)unused;
    uint64_t first = 0;
    for (int threads = 1; threads <= 3; threads++) {
        parallel_set_threads(threads);
        Run r = {0};
        swing_make(&r.bench, 51, SIDES_FREE);
        run_start(&r, "central", 0.0);
        for (int f = 1; f <= 6; f++) {
            run_to(&r, f / 30.0);
        }
        uint64_t hash =
            hash_bytes(r.state.x, 3 * (size_t)r.bench.system.place_count * sizeof(double));
        first = threads == 1 ? hash : first;
        assert_true(hash == first);
        run_end(&r);
    }
    parallel_set_threads(1);
}

/* static equilibrium: the cantilever through the stepper, also from a shaken start */
static void test_static(void **unused) {
    (void)unused;
    Run r = {0};
    r.bench.cloth = cloths_rectangle(0.2, 0.05, 21, 6, cloths_orthotropic());
    r.bench.scene = cloths_scene(&r.bench.cloth);
    r.bench.handles[0] = handle_default();
    r.bench.handles[0].kind = HANDLE_CLAMP;
    r.bench.handles[0].region = REGION_LEFT;
    bench_build(&r.bench, 1);
    run_start(&r, "static", 0.0);
    run_to(&r, 1.0 / 30);
    double tip = r.state.x[3 * 20 + 2];
    CHECK_AT_MOST(r.statistics.residual / r.bench.system.weight, 1e-6);
    state_start(&r.bench.system, &r.state);
    for (int i = 0; i < r.bench.system.cloths[0].node_count; i++) {
        r.state.x[3 * i + 2] += r.held[i] ? 0.0 : 0.01 * hash_random(4, (uint64_t)i);
    }
    run_to(&r, 2.0 / 30);
    CHECK_NEAR(r.state.x[3 * 20 + 2], tip, 1e-6);
    run_end(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_energy),          cmocka_unit_test(test_membrane_damping),
        cmocka_unit_test(test_damping_of_one),  cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_bending_damping), cmocka_unit_test(test_free_fall),
        cmocka_unit_test(test_incline),         cmocka_unit_test(test_threads),
        cmocka_unit_test(test_static),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
