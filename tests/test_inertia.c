/* Scaled inertia: symmetric, positive, blind to what is linear; the stable step that it allows; and scenes
 * that come out the same with it. */
#include <math.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/step/explicit.h"
#include "sim/step/inertia.h"
#include "tests/support/check.h"
#include "tests/support/play.h"

#define FABRIC                                                                                     \
    "fabric: {weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3, bending: 1e-5 N "     \
    "m}}\n"
#define ALONE "gravity: 0\nsolver: {stepper: central, self_contact: false}\n"
#define STRIP "toile: 1\nfilm: {rate: 1000, seconds: 1}\ncloth:\n  sheet:\n    shape: {rectangle: "

static const char free_sheet[] =
    STRIP "{width: 40 cm, height: 30 cm}}\n    " FABRIC "    nodes: 17 x 13\n" ALONE;
static const char tube[] =
    "toile: 1\nfilm: {rate: 1000, seconds: 1}\ncloth:\n  tube:\n"
    "    shape: {sleeve: {radius: 6 cm, length: 30 cm, rest: curved}}\n    " FABRIC
    "    nodes: 18 x 15\n" ALONE;
static const char stiff_in_bending[] =
    STRIP "{width: 8 cm, height: 8 cm}}\n    fabric: {weight: 150 g/m2, isotropic: {stretch: 20 "
          "N/m, poisson: 0.3, bending: 1e-3 N m}}\n    nodes: 17 x 17\n" ALONE;
static const char thread_by_thread[] = STRIP
    "{width: 40 cm, height: 30 cm}}\n    fabric: {weight: 200 g/m2, stretch: {warp: 2000 N/m, "
    "weft: 600 N/m, poisson: 0.2}, shear: 100 N/m, bending: {warp: 20 uN m, weft: 5 uN m, "
    "poisson: 0.3}}\n    nodes: 15 x 21\n" ALONE;
static const char *const lattices[] = {free_sheet, tube, stiff_in_bending, thread_by_thread};
enum { LATTICES = sizeof lattices / sizeof *lattices };

/* one cloth in lanes of its own */
typedef struct Rig {
    Play play;
    const System *system;
    SweepLattice lattice;
    Lanes lanes;
    Inertia inertia;
    Steer steer;
    int *slot;
} Rig;

static void rig_start(Rig *r, const char *text) {
    play_start(&r->play, text);
    r->system = &r->play.sim.system;
    r->lattice = *r->system->cloths[0].lattice;
    r->lattice.scaled = true;
    int stride = r->lattice.stride, slots = (r->lattice.nv + 2) * stride + LANE_MARGIN;
    r->lattice.first = stride + LANE_MARGIN;
    r->lanes = lanes_create(slots, &r->play.arena);
    r->slot = arena_push(&r->play.arena, int, r->system->place_count);
    for (int i = 0; i < r->system->place_count; i++) {
        r->slot[i] = r->lattice.first + i / r->lattice.nu * stride + i % r->lattice.nu;
        r->lanes.weight[r->slot[i]] = 1.0 / r->system->mass[i];
    }
    r->inertia = inertia_create(r->system, slots, 1);
    r->steer = steer_create(r->system);
    inertia_begin(&r->inertia, &r->steer, r->slot);
}

/* out = S in, of (place_count x 3) */
static void spread(Rig *r, const double *in, double *out) {
    for (int i = 0; i < 3 * r->system->place_count; i++) {
        r->inertia.moved[i % 3][r->slot[i / 3]] = r->lanes.v[i % 3][r->slot[i / 3]] = in[i];
    }
    inertia_spread(&r->inertia, &r->lattice, &r->lanes, 0, r->lattice.nv);
    for (int i = 0; i < 3 * r->system->place_count; i++) {
        out[i] = r->lanes.v[i % 3][r->slot[i / 3]];
    }
}

static double *random_field(Rig *r, uint64_t seed) {
    double *field = arena_push(&r->play.arena, double, 3 * r->system->place_count);
    for (int i = 0; i < 3 * r->system->place_count; i++) {
        field[i] = hash_random(seed, (uint64_t)i);
    }
    return field;
}

static double product(const Rig *r, const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < 3 * r->system->place_count; i++) {
        sum += r->system->mass[i / 3] * a[i] * b[i];
    }
    return sum;
}

/* M S is symmetric and between the bounds of its waves; what is uniform stays, and so do linear fields away
 * from the borders; every kernel has the same bits; blocks give what rows give */
static void test_spread(void **unused) {
    (void)unused;
    double least = pow(1.0 - 16.0 * SWEEP_MASS_SCALING, 2.0);
    for (int k = 0; k < LATTICES; k++) {
        Rig r;
        rig_start(&r, lattices[k]);
        int n = 3 * r.system->place_count;
        double *a = random_field(&r, 1), *b = random_field(&r, 2);
        double *sa = arena_push(&r.play.arena, double, n),
               *sb = arena_push(&r.play.arena, double, n);
        spread(&r, a, sa);
        spread(&r, b, sb);
        double norm = product(&r, a, a);
        CHECK_NEAR((product(&r, a, sb) - product(&r, sa, b)) / norm, 0.0, 1e-15);
        CHECK_AT_MOST(product(&r, a, sa) / norm, 1.0);
        CHECK_AT_MOST(least * norm / product(&r, a, sa), 1.0);
        InertiaKernel *const kernels[] = {inertia_kernel_scalar, inertia_kernel_sse2,
                                          inertia_kernel_avx2, inertia_kernel_avx512};
        for (int width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
            if (vector_runs_here((VectorWidth)width)) {
                r.inertia.kernel = kernels[width];
                spread(&r, a, sb);
                assert_memory_equal(sa, sb, (size_t)n * sizeof *sa);
            }
        }
        int nu = r.lattice.nu, nv = r.lattice.nv;
        for (int i = 0; i < n; i++) {
            b[i] = 3.0;
            a[i] = r.lattice.wrap ? i / 3 / nu : 2.0 * (i / 3 % nu) - i / 3 / nu;
        }
        spread(&r, b, sb);
        spread(&r, a, sa);
        double uniform = 0.0, linear = 0.0;
        for (int i = 0; i < n; i++) {
            int u = i / 3 % nu, v = i / 3 / nu;
            bool inside = v > 1 && v < nv - 2 && (r.lattice.wrap || (u > 1 && u < nu - 2));
            uniform = fmax(uniform, fabs(sb[i] - 3.0));
            linear = fmax(linear, inside ? fabs(sa[i] - a[i]) : 0.0);
        }
        CHECK_AT_MOST(uniform, 0.0);
        CHECK_AT_MOST(linear, 1e-13);
        play_end(&r.play);
    }
}

/* a few changed nodes, block by block */
static void test_blocks(void **unused) {
    (void)unused;
    for (int k = 0; k < LATTICES; k++) {
        Rig r;
        rig_start(&r, lattices[k]);
        const double share = 0.6;
        int n = 3 * r.system->place_count, nu = r.lattice.nu;
        double *a = arena_push(&r.play.arena, double, n),
               *sa = arena_push(&r.play.arena, double, n);
        InertiaBlocks blocks = inertia_blocks_create(&r.lattice, &r.play.arena);
        const int changed[] = {0, 9, 3 * nu + 7, 3 * nu + 8, r.system->place_count - 1};
        for (int c = 0; c < 5; c++) {
            int i = changed[c];
            inertia_blocks_mark(&blocks, i % nu, i / nu);
            for (int x = 0; x < 3; x++) {
                a[3 * i + x] = hash_random(3, (uint64_t)(3 * i + x));
                r.inertia.pulled[x][r.slot[i]] = a[3 * i + x];
            }
        }
        spread(&r, a, sa);
        for (int i = 0; i < n; i++) {
            r.lanes.v[i % 3][r.slot[i / 3]] = share * a[i];
        }
        inertia_spread_blocks(&r.inertia, &r.lattice, &r.lanes, 0, share, &blocks, r.lattice.nv);
        inertia_blocks_clear(&blocks, &r.lattice, r.inertia.pulled, 0, r.lattice.nv);
        double worst = 0.0;
        for (int i = 0; i < n; i++) {
            int slot = r.slot[i / 3];
            worst = fmax(worst, fabs(r.lanes.v[i % 3][slot] - sa[i]));
            assert_true(r.inertia.pulled[i % 3][slot] == 0.0);
        }
        CHECK_AT_MOST(worst, 1e-15);
        for (int j = 0; j < r.lattice.nv; j++) {
            assert_int_equal(blocks.some[j], 0);
        }
        play_end(&r.play);
    }
}

/* v = S u: kinetic energy (v M u - v M v) / 2 beyond that of the masses */
static void test_hidden(void **unused) {
    (void)unused;
    for (int k = 0; k < LATTICES; k++) {
        Rig r;
        rig_start(&r, lattices[k]);
        double *u = random_field(&r, 4);
        double *v = arena_push(&r.play.arena, double, 3 * r.system->place_count);
        spread(&r, u, v);
        double exact = 0.5 * (product(&r, v, u) - product(&r, v, v));
        CHECK_NEAR(inertia_hidden(&r.inertia, &r.lattice, &r.lanes, 0, r.lattice.nv) / exact, 1.0,
                   1e-3);
        play_end(&r.play);
    }
}

/* [s] 2 / the fastest frequency of S M^-1 K at the start, by the power method */
static double stable_by_power(Rig *r) {
    const Cloth *cloth = &r->system->cloths[0];
    const double *x = r->play.sim.state.x;
    int n = 3 * r->system->place_count;
    double *d = random_field(r, 5), *moved = random_field(r, 0);
    double *g0 = arena_push(&r->play.arena, double, n), *g = arena_push(&r->play.arena, double, n);
    double scale = 1e-6 * cloth->panel.h1, lambda = 0.0;
    cloth->model->add_gradient(cloth, x, g0);
    for (int iteration = 0; iteration < 1500; iteration++) {
        double norm = sqrt(product(r, d, d) / r->system->mass[0]);
        memset(g, 0, (size_t)n * sizeof *g);
        for (int i = 0; i < n; i++) {
            d[i] /= norm;
            moved[i] = x[i] + scale * d[i];
        }
        cloth->model->add_gradient(cloth, moved, g);
        for (int i = 0; i < n; i++) {
            g[i] = (g[i] - g0[i]) / (scale * r->system->mass[i / 3]);
        }
        spread(r, g, d);
        lambda = sqrt(product(r, d, d) / r->system->mass[0]);
    }
    return 2.0 / sqrt(lambda);
}

/* the step is stable but for 1.5 % by waves along free borders, which the Courant factor covers; bending and
 * membrane are bounded apart, which is a third too short where both matter */
static void test_stable(void **unused) {
    (void)unused;
    for (int k = 0; k < LATTICES; k++) {
        Rig r;
        rig_start(&r, lattices[k]);
        double density = r.system->cloths[0].material.density;
        double step = sweep_stable_step(&r.lattice, density), most = stable_by_power(&r);
        CHECK_AT_MOST(step / most, 1.02);
        CHECK_AT_MOST(most / step, 1.35);
        r.lattice.scaled = false;
        CHECK_AT_MOST(1.5 * sweep_stable_step(&r.lattice, density) / step, 1.0);
        play_end(&r.play);
    }
}

/* ... and with stretch and shear: of uniform strain it is known to 4 % */
static void test_stretched(void **unused) {
    static const double maps[][3] = {
        {1.3, 1.3, 0.0}, {1.5, 0.9, 0.0}, {0.95, 1.4, 0.0}, {1.1, 1.2, 0.3}};
    (void)unused;
    for (int k = 0; k < 2 * LATTICES; k++) {
        Rig r;
        rig_start(&r, lattices[k / 2]);
        bool round = lattices[k / 2] == tube, bends = lattices[k / 2] == stiff_in_bending;
        double *x = r.play.sim.state.x, flat = sweep_stiffening(&r.lattice, x);
        CHECK_NEAR(flat, 1.0, round ? 0.03 : 1e-12); /* chords of the tube */
        const double *map = maps[round ? 0 : k % 4];
        for (int i = 0; i < r.system->place_count; i++) {
            x[3 * i] = map[0] * x[3 * i] + map[2] * x[3 * i + 1];
            x[3 * i + 1] *= map[1];
            x[3 * i + 2] *= round ? map[0] : 1.0;
        }
        double density = r.system->cloths[0].material.density;
        double step = sweep_stable_step(&r.lattice, density), most = stable_by_power(&r);
        step /= sqrt(sweep_stiffening(&r.lattice, x));
        CHECK_AT_MOST(step / most, 1.02);
        CHECK_AT_MOST(most / step, bends ? 1.4 : 1.04);
        play_end(&r.play);
    }
}

/* standing waves along a strip: as slow as the lattice and S make them, under leapfrog */
static void test_waves(void **unused) {
    (void)unused;
    const int cells = 40, waves[2] = {3, 6};
    for (int k = 0; k < 2; k++) {
        Play play;
        play_start(&play, STRIP "{width: 40 cm, height: 10 cm}}\n    fabric: {weight: 150 g/m2, "
                                "isotropic: {stretch: 1000 N/m, poisson: 0, bending: 1e-9 N m}}\n"
                                "    nodes: 41 x 11\n    membrane_damping: 0 s\n" ALONE);
        State *state = &play.sim.state;
        double angle = PI * waves[k] / cells, speed = 1e-4;
        for (int i = 0; i < play.sim.system.node_count; i++) {
            state->v[3 * i] = speed * cos(angle * (i % (cells + 1)));
        }
        double start = state->x[0];
        play_to(&play, 0.02);
        assert_true(state->scaled == 1.0);
        double square = 4.0 * pow(sin(0.5 * angle), 2.0), dt = play.sim.statistics.step_length;
        double spread = 1.0 - SWEEP_MASS_SCALING * square * square;
        double omega = sqrt(1000 / 0.15 * square * spread) / 0.01;
        double leap = 2.0 / dt * asin(0.5 * omega * dt);
        /* velocities start at a full step: x = v dt sin(leap t) / sin(leap dt) */
        double exact = speed * dt / sin(leap * dt) * sin(leap * state->time);
        CHECK_NEAR((state->x[0] - start - exact) / (speed / omega), 0.0, 1e-5);
        play_end(&play);
    }
}

/* [m] the mean height of a sheet, and *most: that of its lowest node */
static double height(const char *rest, const char *solver, double seconds, double *lowest,
                     long *crossings) {
    char text[2000];
    Play play;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 9}\ncloth:\n  sheet:\n    " FABRIC "%s"
             "solver: {stepper: central%s}\n",
             rest, solver);
    play_start(&play, text);
    *crossings = 0;
    for (int f = 1; f <= 30 * seconds + 0.5; f++) {
        play_to(&play, f / 30.0);
        *crossings += play_crossings(&play);
    }
    *lowest = INFINITY;
    for (int i = 0; i < play.sim.system.node_count; i++) {
        *lowest = fmin(*lowest, play_x(&play, i).z);
    }
    double mean = play_mean_x(&play).z;
    play_end(&play);
    return mean;
}

/* the same equilibrium of a sheet that hangs, and the same drape within what its folds decide by chance */
static void test_scenes(void **unused) {
    (void)unused;
    const char *scenes[2] = {
        "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    nodes: 16 x 16\n"
        "    damping: 8 1/s\nhandles:\n  - {hold: sheet.top-left}\n  - {hold: sheet.top-right}\n",
        "    shape: {rectangle: {width: 1 m, height: 1 m}}\n    nodes: 26 x 26\n    at: [0, 0, 2 "
        "cm]\n"
        "    noise: 0.2 mm\n    sides: bounded\nobstacles:\n  cube: {box: {size: [50 cm, 50 cm, 50 "
        "cm], "
        "rounding: 5 mm}, at: [0, 0, -25 cm], friction: 0.3}\n"};
    const double bars[2] = {1e-6, 0.01};
    for (int k = 0; k < 2; k++) {
        double lowest[2], mean[2];
        for (int scaled = 0; scaled < 2; scaled++) {
            long crossings;
            mean[scaled] = height(scenes[k], scaled ? "" : ", mass_scaling: false", k == 0 ? 8 : 2,
                                  &lowest[scaled], &crossings);
            CHECK_AT_MOST((double)crossings, 0.0);
        }
        CHECK_NEAR((mean[1] - mean[0]) / lowest[0], 0.0, bars[k]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_spread),    cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_hidden),    cmocka_unit_test(test_stable),
        cmocka_unit_test(test_stretched), cmocka_unit_test(test_waves),
        cmocka_unit_test(test_scenes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
