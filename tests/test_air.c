/* The push of the air on faces (sim/step/air.h): the law, its potential in implicit steps, sheets that
 * fall and are blown by every stepper. */
#include <stdlib.h>
#include <string.h>

#include "sim/step/air.h"
#include "sim/step/stepper.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/play.h"
#include "tests/support/strips.h"

static const AirDef air = {
    .normal_drag = 0.3, .density = 1.2, .across = 1.2, .along = 0.03, .wind = {1.0, -2.0, 0.5}};

static void test_law(void **unused) {
    (void)unused;
    const Vec3 x[3] = {{0, 0, 1}, {0.2, 0, 1}, {0, 0.1, 1}}; /* 0.01 m2, faces up */
    const Vec3 flow = {3.0, 4.0, -2.0};
    AirFace face = air_face(&air, x, flow);
    Vec3 push = air_push(&face, flow);
    double skin = -0.01 * 0.6 * 0.03 * 5.0, plate = 0.01 * (0.3 + 0.6 * 1.2 * 2.0) * 2.0;
    CHECK_NEAR(push.x, skin * 3.0, 1e-15);
    CHECK_NEAR(push.y, skin * 4.0, 1e-15);
    CHECK_NEAR(push.z, plate, 1e-15);
    const Vec3 none[3] = {{0, 0, 1}, {0.2, 0, 1}, {0.4, 0, 1}};
    face = air_face(&air, none, flow);
    push = air_push(&face, flow);
    assert_true(vec3_length(push) == 0.0);
}

/* a crumpled sheet that flies, in an implicit step of 10 ms */
typedef struct Flight {
    Bench bench;
    State state;
    AirFace *faces;
    AirStep step;
    BlockMatrix matrix;
} Flight;

static void take_off(Flight *f) {
    memset(f, 0, sizeof *f);
    f->bench.cloth = cloths_rectangle(0.3, 0.2, 5, 4, cloths_fabric(0.2, 1e3, 0.3, 1e-4, 0.3));
    f->bench.scene = cloths_scene(&f->bench.cloth);
    bench_build(&f->bench, 0);
    System *s = &f->bench.system;
    const Cloth *cloth = &s->cloths[0];
    int triangles = cloth->panel.triangle_count, count = 0;
    f->state = state_allocate(s, &f->bench.arena);
    state_start(s, &f->state);
    cloths_shake(f->state.x, s->place_count, 0.03, 3);
    cloths_shake(f->state.v, s->place_count, 2.0, 4);
    f->faces = arena_push(&f->bench.arena, AirFace, triangles);
    f->step = (AirStep){f->faces, air_find_faces(&air, cloth, 0, f->state.x, f->state.v, f->faces),
                        air.wind, 0.01, f->state.x};
    assert_int_equal(f->step.count, triangles);
    int *pairs = arena_push(&f->bench.arena, int, 12 * triangles);
    for (int t = 0; t < triangles; t++) {
        count += block_pairs(f->faces[t].corner, 3, s->place_count, pairs + 2 * count);
    }
    f->matrix = block_matrix_create(s->place_count, pairs, count, &f->bench.arena);
}

static void test_potential(void **unused) {
    (void)unused;
    Flight f;
    take_off(&f);
    int n = 3 * f.bench.system.place_count;
    double *x = arena_push(&f.bench.arena, double, n), *d = arena_push(&f.bench.arena, double, n);
    double *g = arena_push(&f.bench.arena, double, n), *ends[2];
    double *kd = arena_push(&f.bench.arena, double, n);
    memcpy(x, f.state.x, (size_t)n * sizeof *x);
    cloths_shake(x, n / 3, 0.02, 5);
    cloths_shake(d, n / 3, 1.0, 6);
    air_step_add_gradient(&f.step, x, g);
    air_step_add_hessian(&f.step, &f.matrix);
    block_matrix_multiply(&f.matrix, d, kd);
    double along = 0.0, energy[2], worst = 0.0, size = 0.0;
    for (int e = 0; e < 2; e++) {
        ends[e] = arena_push(&f.bench.arena, double, n);
        double *at = arena_push(&f.bench.arena, double, n);
        for (int k = 0; k < n; k++) {
            at[k] = x[k] + (e ? 1e-4 : -1e-4) * d[k];
        }
        energy[e] = air_step_energy(&f.step, at);
        air_step_add_gradient(&f.step, at, ends[e]);
    }
    for (int k = 0; k < n; k++) {
        along += g[k] * d[k];
        worst = fmax(worst, fabs((ends[1][k] - ends[0][k]) / 2e-4 - kd[k]));
        size = fmax(size, fabs(kd[k]));
    }
    CHECK_AT_MOST(fabs((energy[1] - energy[0]) / 2e-4 / along - 1.0), 1e-10);
    CHECK_AT_MOST(worst / size, 1e-9);
    arena_free(&f.bench.arena);
}

/* the push of a step that ends where it began at its own speed is that of the explicit road */
static void test_roads(void **unused) {
    (void)unused;
    Flight f;
    take_off(&f);
    int n = 3 * f.bench.system.place_count;
    double *x = arena_push(&f.bench.arena, double, n), worst = 0.0, size = 0.0;
    double *implicit = arena_push(&f.bench.arena, double, n);
    double *now = arena_push(&f.bench.arena, double, n);
    for (int k = 0; k < n; k++) {
        x[k] = f.state.x[k] + f.step.dt * f.state.v[k];
    }
    air_step_add_gradient(&f.step, x, implicit);
    double power = air_add_gradient(&air, &f.bench.system.cloths[0], f.state.x, f.state.v, now);
    for (int k = 0; k < n; k++) {
        worst = fmax(worst, fabs(implicit[k] - now[k]));
        size = fmax(size, fabs(now[k]));
    }
    CHECK_AT_MOST(worst / size, 1e-12);
    CHECK_NEAR(air_step_work(&f.step, x), f.step.dt * power, 1e-12 * fabs(power));
    arena_free(&f.bench.arena);
}

/* steppers that follow motion in air */
static const char *const followers[] = {
    "central", "symplectic_euler", "forward_euler", "midpoint", "rk4", "rk45",
    "bdf2",    "backward_euler",   "one_solve"};
enum { FOLLOWERS = sizeof followers / sizeof *followers };

/* `choices`: further ones of the solver */
static void fly(Play *play, const char *stepper, const char *choices, const char *rest) {
    char text[1000];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n"
             "    fabric: {name: f, weight: 150 g/m2, thickness: 0.5 mm, isotropic:"
             " {stretch: 100 N/m, poisson: 0, bending: 1e-3 N m}}\n    nodes: 6 x 6\n"
             "solver: {stepper: %s, self_contact: false%s}\n%s",
             stepper, choices, rest);
    play_start(play, text);
}

/* a flat sheet comes to the speed at which the air carries it, and on the way is as fast as a body under
 * quadratic drag: v = u tanh(g t / u) */
static void test_terminal(void **unused) {
    (void)unused;
    double u = sqrt(2.0 * 0.15 * 9.80665 / (1.2 * 1.2));
    for (size_t k = 0; k < FOLLOWERS; k++) {
        Play play;
        fly(&play, followers[k], "", "air: {density: 1.2 kg/m3}\n");
        play_to(&play, 0.1);
        double early = -play_mean_v(&play).z / (u * tanh(0.1 * 9.80665 / u));
        play_to(&play, 2.0);
        double late = -play_mean_v(&play).z / u;
        print_message("  %s: %.5f, %.6f\n", followers[k], early, late);
        CHECK_NEAR(early, 1.0, play.sim.stepper->implicit ? 0.05 : 0.005);
        CHECK_NEAR(late, 1.0, 1e-3);
        play_end(&play);
    }
}

/* without weight, across the wind: 1 / (w - v) grows by density across / (2 weight). The push lags by half a
 * step, hence steps that are not made longer. */
static void test_wind(void **unused) {
    (void)unused;
    double rate = 1.2 * 1.2 / (2.0 * 0.15), w = 4.0;
    double exact = w - 1.0 / (1.0 / w + rate * 0.5);
    for (size_t k = 0; k < FOLLOWERS; k++) {
        Play play;
        fly(&play, followers[k], ", mass_scaling: false",
            "gravity: 0 m/s2\nair: {density: 1.2 kg/m3, wind: [0, 0, 4 m/s]}\n");
        play_to(&play, 0.5);
        Vec3 v = play_mean_v(&play);
        double taken = 0.5 * 0.15 * 0.09 * v.z * v.z, given = -play.sim.total.drag;
        print_message("  %s: %.5f, %.5f J of %.5f\n", followers[k], v.z / exact, given, taken);
        CHECK_NEAR(v.z / exact, 1.0, play.sim.stepper->implicit ? 0.03 : 0.001);
        if (!play.sim.stepper->implicit) {
            CHECK_NEAR(given, taken, 0.02 * taken);
        }
        play_end(&play);
    }
}

/* what looks for rest knows no wind on faces, and says so */
static void test_refusals(void **unused) {
    (void)unused;
    const char *names[] = {"static", "relaxation", "stochastic", "three_phase"};
    for (int k = 0; k < 4; k++) {
        Arena arena = {0};
        ClothDef cloth = cloths_rectangle(0.3, 0.3, 6, 6, cloths_fabric(0.2, 1e3, 0.3, 1e-4, 0.3));
        Scene scene = cloths_scene(&cloth);
        Sim sim;
        SimOptions options = sim_options_default();
        Error error = {0};
        scene.solver.stepper = names[k];
        scene.solver.self_contact = false;
        scene.air = air;
        assert_false(sim_create(&sim, &scene, &options, &error));
        assert_int_equal(error.code, EXIT_BAD_INPUT);
        assert_non_null(strstr(error.text, "wind"));
        arena_free(&arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_law),   cmocka_unit_test(test_potential),
        cmocka_unit_test(test_roads), cmocka_unit_test(test_terminal),
        cmocka_unit_test(test_wind),  cmocka_unit_test(test_refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
