/* Contact on the explicit road: law, distances, friction with known answers, impacts, rest. */
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "sim/geom/closest.h"
#include "tests/support/check.h"
#include "tests/support/contacts.h"
#include "tests/support/play.h"

#define SOLVER "solver: {stepper: central}\n"
#define FABRIC CONTACTS_FABRIC

static Vec3 random_point(uint64_t seed, double size) {
    return vec3_scale(size, vec3(hash_random(seed, 0), hash_random(seed, 1), hash_random(seed, 2)));
}

/* force and stiffness are the slopes of the energy */
static void test_law(void **unused) {
    (void)unused;
    double dhat = 1e-3, k = 50.0, step = 1e-9, worst = 0.0, bend = 0.0;
    for (double d = 0.05 * dhat; d < 1.2 * dhat; d += 0.013 * dhat) {
        double f[3], c[3];
        double low = contact_law(d - step, dhat, k, &f[0], &c[0]);
        contact_law(d, dhat, k, &f[1], &c[1]);
        double high = contact_law(d + step, dhat, k, &f[2], &c[2]);
        worst = fmax(worst, fabs((low - high) / (2 * step) - f[1]) / (k * dhat));
        bend = fmax(bend, fabs((f[0] - f[2]) / (2 * step) - c[1]) / c[1] * (d < dhat - step));
    }
    CHECK_AT_MOST(worst, 1e-7);
    CHECK_AT_MOST(bend, 1e-7);
}

/* closest points against a fine grid of candidates */
static void test_closest(void **unused) {
    (void)unused;
    double triangle = 0.0, segments = 0.0;
    for (uint64_t k = 0; k < 2000; k++) {
        Vec3 p[4];
        for (uint64_t i = 0; i < 4; i++) {
            p[i] = random_point(10 * k + i, 1.0);
        }
        double w[3], s, t, sine2;
        closest_on_triangle(p[0], p[1], p[2], p[3], w);
        Vec3 at = vec3_add(vec3_add(vec3_scale(w[0], p[1]), vec3_scale(w[1], p[2])),
                           vec3_scale(w[2], p[3]));
        double found = vec3_length(vec3_sub(p[0], at));
        closest_on_segments(p[0], p[1], p[2], p[3], &s, &t, &sine2);
        double apart = vec3_length(vec3_sub(vec3_axpy(p[0], s, vec3_sub(p[1], p[0])),
                                            vec3_axpy(p[2], t, vec3_sub(p[3], p[2]))));
        for (int i = 0; i <= 20; i++) {
            for (int j = 0; j <= 20; j++) {
                double a = i / 20.0, b = j / 20.0;
                Vec3 on = vec3_add(vec3_axpy(p[1], a * (1 - b), vec3_sub(p[2], p[1])),
                                   vec3_scale(a * b, vec3_sub(p[3], p[1])));
                triangle = fmax(triangle, found - vec3_length(vec3_sub(p[0], on)));
                Vec3 x = vec3_axpy(p[0], a, vec3_sub(p[1], p[0]));
                Vec3 y = vec3_axpy(p[2], b, vec3_sub(p[3], p[2]));
                segments = fmax(segments, apart - vec3_length(vec3_sub(x, y)));
            }
        }
    }
    CHECK_AT_MOST(triangle, 1e-12);
    CHECK_AT_MOST(segments, 1e-12);
}

/* the nearest point of a triangle to every solid against a grid over the triangle */
static void test_solid_triangle(void **unused) {
    (void)unused;
    double worst = 0.0, told = 0.0;
    for (uint64_t k = 0; k < 3000; k++) {
        SolidKind kind = (SolidKind)(1 + k % (SOLID_KIND_COUNT - 1));
        Solid solid = {kind, {0.3, 0.2, 0.25}, kind == SOLID_BOX ? 0.02 * (double)(k % 3) : 0.2};
        Vec3 x[3], n[3], centre = random_point(7 * k, 0.6);
        double d[3];
        for (int i = 0; i < 3; i++) {
            x[i] = vec3_add(centre, random_point(7 * k + 1 + (uint64_t)i, 0.3));
            d[i] = solid_distance(&solid, x[i], &n[i]);
        }
        SolidNearest nearest = solid_nearest_on_triangle(&solid, x, d, n);
        const double *w = nearest.weight;
        Vec3 normal, at = vec3_add(vec3_add(vec3_scale(w[0], x[0]), vec3_scale(w[1], x[1])),
                                   vec3_scale(w[2], x[2]));
        double found = solid_distance(&solid, at, &normal), least = INFINITY;
        told = fmax(told, fabs(found - nearest.distance));
        for (int i = 0; i <= 40; i++) {
            for (int j = 0; i + j <= 40; j++) {
                Vec3 on = vec3_axpy(vec3_axpy(x[0], i / 40.0, vec3_sub(x[1], x[0])), j / 40.0,
                                    vec3_sub(x[2], x[0]));
                least = fmin(least, solid_distance(&solid, on, &normal));
            }
        }
        /* inside the solid the nearest point is not needed: the guard keeps cloth outside */
        worst = fmax(worst, least > 0.0 ? found - least : 0.0);
    }
    CHECK_AT_MOST(worst, 1e-7);
    CHECK_AT_MOST(told, 1e-14);
}

static void test_incline(void **unused) {
    (void)unused;
    contacts_check_incline("solver: {stepper: central, step: 0.15 ms}\n");
}

static void test_stop(void **unused) {
    (void)unused;
    contacts_check_stop("solver: {stepper: central, step: 0.15 ms}\n");
}

/* strip over a fixed cylinder, drawn along: T2 / T1 = exp(mu pi) */
static void test_capstan(void **unused) {
    (void)unused;
    Play play;
    play_start(
        &play,
        "toile: 1\nfilm: {rate: 50, seconds: 4}\ncloth:\n  strip:\n"
        "    shape: {rectangle: {width: 36 cm, height: 1.6 cm}}\n    at: [0, 0, 10 cm]\n    " FABRIC
        "    nodes: 91 x 5\n    damping: 10 1/s\n"
        "handles:\n"
        "  - {hold: strip.left, move: {by: [0, 0, 4 cm], from: 0 s, to: 1 s, "
        "ease: linear}}\n"
        "  - {hold: strip.right, move: {by: [0, 0, -4 cm], from: 0 s, to: 1 s, "
        "ease: linear}}\n"
        "obstacles:\n  drum: {cylinder: {radius: 5 cm, from: [0, -5 cm, 0], to: [0, "
        "5 cm, 0]}, friction: 0.3}\n"
        "gravity: 0\nsolver: {stepper: central, self_contact: false}\n");
    /* wrapped half around, stretched by 0.5 % */
    System *system = &play.sim.system;
    double radius = 0.0509, stretch = 1.005, quarter = 0.5 * PI * radius;
    for (int i = 0; i < system->place_count; i++) {
        double s = stretch * (0.004 * (i % 91) - 0.18), t = fabs(s), y = play_x(&play, i).y;
        double angle = fmin(t, quarter) / radius;
        Vec3 p = {radius * sin(angle), y, radius * cos(angle) - fmax(0.0, t - quarter)};
        vec3_store(play.sim.state.x + 3 * (size_t)i, vec3(s < 0 ? -p.x : p.x, p.y, p.z));
    }
    for (int h = 0; h < 2; h++) {
        for (int i = 0; i < system->handles[h].count; i++) {
            memcpy((double *)system->handles[h].start + 3 * (size_t)i,
                   play.sim.state.x + 3 * (size_t)system->handles[h].places[i], 3 * sizeof(double));
        }
    }
    double tension[2] = {0, 0};
    for (int frame = 20; frame <= 40; frame++) { /* means, since slipping shakes the strip */
        play_to(&play, 0.02 * frame);
        for (int side = 0; side < 2; side++) {
            for (int i = 3; i < 18; i++) {
                int a = 2 * 91 + (side == 0 ? i : 90 - i), b = side == 0 ? a + 1 : a - 1;
                double length = vec3_length(vec3_sub(play_x(&play, b), play_x(&play, a))) / 0.004;
                tension[side] += 0.5 * (length * length - 1.0) * length;
            }
        }
    }
    double exponent = log(tension[1] / tension[0]);
    CHECK_NEAR(exponent / (0.3 * PI), 1.0, 0.005);
    play_end(&play);
}

/* thrown at 10, 50, 200 m/s on every solid, nothing crosses */
static void test_impacts(void **unused) {
    (void)unused;
    long crossings = 0;
    for (size_t k = 0; k < CONTACTS_SOLIDS; k++) {
        for (int speed = 10; speed <= 200; speed = speed == 10 ? 50 : 4 * speed) {
            char text[2048];
            Play play;
            snprintf(text, sizeof text,
                     "toile: 1\nfilm: {rate: 100, seconds: 4}\ncloth:\n  sheet:\n"
                     "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
                     "    nodes: 17 x 17\n    at: [0, 0, 5 cm]\n    velocity: [0, 0, %d m/s]\n"
                     "obstacles:\n  target: {%s, friction: 0.3}\n" SOLVER,
                     -speed, contacts_solids[k]);
            play_start(&play, text);
            for (int f = 1; f <= 4; f++) {
                play_to(&play, f * 0.01);
                crossings += play_crossings(&play);
            }
            play_end(&play);
        }
    }
    CHECK_AT_MOST((double)crossings, 0.0);
}

/* two sheets thrown at each other */
static void test_clap(void **unused) {
    (void)unused;
    long crossings = 0;
    for (int speed = 15; speed <= 100; speed += 85) {
        char text[2048];
        Play play;
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 100, seconds: 4}\ncloth:\n  upper:\n"
                 "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
                 "    nodes: 17 x 17\n    at: [0, 0, 3 cm]\n    velocity: [0, 0, -%d m/s]\n"
                 "  lower:\n    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
                 "    nodes: 15 x 18\n    at: [3 cm, 1 cm, -2 cm]\n    velocity: [0, 0, %d m/s]\n"
                 "    turn: {axis: z, by: 20 deg}\nsolver: {stepper: central}\n",
                 speed, speed);
        play_start(&play, text);
        for (int f = 1; f <= 5; f++) {
            play_to(&play, f * 0.01);
            crossings += play_crossings(&play);
        }
        play_end(&play);
    }
    CHECK_AT_MOST((double)crossings, 0.0);
}

/* dropped on its edge: a heap, no crossing, energy accounted for, and the same bits for any
 * number of threads */
static void test_heap(void **unused) {
    (void)unused;
    uint64_t hash[3];
    for (int threads = 1; threads <= 3; threads++) {
        Play play;
        long crossings = 0;
        play_start_threads(&play, CONTACTS_FOLDED SOLVER, threads);
        Sim *sim = &play.sim;
        double lost = 0.0, worst = 0.0, start = 0.0;
        for (int f = 0; f < 24; f++) {
            play_to(&play, (f + 1) / 30.0);
            crossings += threads == 1 ? play_crossings(&play) : 0;
            const Statistics *s = &sim->statistics;
            lost += s->friction + s->damping + s->guard + s->sides + s->numerical;
            double now = s->kinetic + s->elastic + s->gravity + s->contact + lost;
            start = f == 0 ? now : start;
            worst = fmax(worst, fabs(now - start));
        }
        CHECK_AT_MOST((double)crossings, 0.0);
        CHECK_AT_MOST(worst / (0.15 * 0.36 * 9.80665 * 0.31), 0.005);
        hash[threads - 1] = sim_state_hash(sim);
        play_end(&play);
    }
    parallel_set_threads(1);
    assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
}

/* a tube twisted by 1.1 turns until it chokes itself: the work of its ends is stored or taken by
 * friction, however hard the contacts are pressed and stiffened */
static void test_twist(void **unused) {
    (void)unused;
    Play play;
    long crossings = 0;
    play_start(&play,
               "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  tube:\n"
               "    shape: {sleeve: {radius: 25 cm, length: 1 m, rest: curved}}\n"
               "    fabric: {weight: 150 g/m2, thickness: 2.5 mm, isotropic: {stretch: 1000 "
               "N/m, poisson: 0.3, bending: 1e-5 N m}}\n"
               "    nodes: 24 x 27\n    noise: 0.2 mm\n    membrane_damping: 0 s\n"
               "    bending_damping: 0 s\nhandles:\n"
               "  - hold: tube.start\n    turn: {axis: z, by: -288 deg, from: 0 s, to: 4 s}\n"
               "  - hold: tube.end\n    turn: {axis: z, by: 288 deg, from: 0 s, to: 4 s}\n"
               "gravity: 0 m/s2\nsolver: {stepper: central}\n");
    double lost = 0.0, work = 0.0, friction = 0.0, worst = 0.0, returned = 0.0;
    const Statistics *s = &play.sim.statistics;
    for (int f = 1; f <= 84; f++) {
        play_to(&play, f / 30.0);
        crossings += play_crossings(&play);
        lost += s->friction + s->damping + s->guard;
        work += s->work;
        worst = fmax(worst, fabs(s->kinetic + s->elastic + s->contact + lost - work));
        friction += s->friction;
        returned = fmax(returned, -s->friction);
    }
    CHECK_AT_MOST((double)crossings, 0.0);
    CHECK_AT_MOST(worst / work, 0.02);
    CHECK_AT_MOST(0.05, friction / work);
    CHECK_AT_MOST(returned / work, 0.01); /* what bristles give back */
    play_end(&play);
}

/* a crumpled sheet comes to rest, does not creep, and then costs nothing */
static void test_rest(void **unused) {
    (void)unused;
    Play play;
    play_start(&play, "toile: 1\nfilm: {rate: 30, seconds: 80}\ncloth:\n  sheet:\n"
                      "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    " FABRIC
                      "    nodes: 16 x 16\n    at: [0, 0, 16 cm]\n    turn: {axis: x, by: 90 "
                      "deg}\n    noise: 1 mm\nobstacles:\n  floor: {plane: {}, friction: 0.3}\n"
                      "air: {drag: 0.05 kg/(m2 s)}\nsolver: {stepper: central}\n");
    play_to(&play, 4.0);
    CHECK_AT_MOST(play.sim.statistics.kinetic, 1e-9);
    double fall = play.sim.total.cpu;
    uint64_t hash = hash_bytes(play.sim.state.x, 3 * sizeof(double) * 256);
    play_to(&play, 64.0);
    CHECK_AT_MOST((play.sim.total.cpu - fall) / fall / 6.0, 0.01); /* of 10 s */
    assert_true(hash == hash_bytes(play.sim.state.x, 3 * sizeof(double) * 256));
    CHECK_AT_MOST((double)play_crossings(&play), 0.0);
    play_end(&play);
}

/* nothing can touch: the same bits as with contact switched off */
static void test_skipped(void **unused) {
    (void)unused;
    uint64_t hash[2];
    for (int on = 0; on < 2; on++) {
        char text[1024];
        Play play;
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  sheet:\n"
                 "    shape: {rectangle: {width: 50 cm, height: 50 cm}}\n    " FABRIC
                 "    nodes: 21 x 21\n    turn: {axis: x, by: 60 deg}\nhandles:\n"
                 "  - {hold: sheet.top}\nsolver: {stepper: central, self_contact: %s}\n",
                 on ? "true" : "false");
        play_start(&play, text);
        play_to(&play, 0.5);
        hash[on] = sim_state_hash(&play.sim);
        play_end(&play);
    }
    assert_true(hash[0] == hash[1]);
}

/* a driven sphere goes through a hanging cloth: pushes, never crosses */
static void test_driven(void **unused) {
    (void)unused;
    Play play;
    long crossings = 0;
    play_start(
        &play,
        "toile: 1\nfilm: {rate: 50, seconds: 4}\ncloth:\n  sheet:\n"
        "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
        "    nodes: 21 x 21\n    turn: {axis: x, by: 90 deg}\nhandles:\n"
        "  - {hold: sheet.top}\nobstacles:\n  ball: {sphere: {radius: 6 cm}, at: "
        "[2 cm, 12 cm, -4 cm], motion: [{move: {by: [0, -30 cm, 0], from: 0 s, to: 0.3 s}}]}\n"
        "solver: {stepper: central}\n");
    for (int f = 1; f <= 25; f++) {
        play_to(&play, f / 50.0);
        crossings += play_crossings(&play);
    }
    CHECK_AT_MOST((double)crossings, 0.0);
    CHECK_AT_MOST(play.sim.state.time - play.sim.state.contact.clocks[0], 0.01);
    play_end(&play);
}

/* touching, 1e-9 m apart, some millimetres inside: cloth is moved out and lies down; farther inside
 * and pierced: refused with the place */
static void test_starts(void **unused) {
    (void)unused;
    const char *scene =
        "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  sheet:\n"
        "    shape: {rectangle: {width: 60 cm, height: 60 cm}}\n    " FABRIC
        "    nodes: 16 x 16\n    at: [1 cm, 0, %s]\nobstacles:\n  box: {box: {size: [30 cm, 30 cm, "
        "30 cm], rounding: 5 mm}, at: [0, 0, -15 cm]}\nsolver: {stepper: central}\n";
    const char *good[] = {"0 m", "1e-9 m", "-4 mm"}, *bad[] = {"-3 cm", "-14 cm"};
    char text[1500];
    for (int k = 0; k < 3; k++) {
        Play play;
        snprintf(text, sizeof text, scene, good[k]);
        play_start(&play, text);
        assert_true(play.sim.moves.pushed_out > 0);
        assert_int_equal(play_crossings(&play), 0);
        play_to(&play, 0.1);
        assert_int_equal(play_crossings(&play), 0);
        CHECK_AT_MOST(play_mean_v(&play).z, 0.1); /* not thrown off */
        play_end(&play);
    }
    for (int k = 0; k < 2; k++) {
        Arena arena = {0};
        Scene read;
        Sim sim;
        Error error = {0};
        SimOptions options = sim_options_default();
        snprintf(text, sizeof text, scene, bad[k]);
        assert_true(scene_parse("play", text, strlen(text), NULL, &arena, &read, &error));
        assert_false(sim_create(&sim, &read, &options, &error));
        assert_non_null(strstr(error.text, "cloth 'sheet' starts inside obstacle 'box', "));
        assert_true(k > 0 || strstr(error.text, " 30 mm deep at ("));
        assert_int_equal(error.code, EXIT_BAD_INPUT);
        arena_free(&arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_law),
        cmocka_unit_test(test_closest),
        cmocka_unit_test(test_solid_triangle),
        cmocka_unit_test(test_incline),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_capstan),
        cmocka_unit_test(test_impacts),
        cmocka_unit_test(test_clap),
        cmocka_unit_test(test_heap),
        cmocka_unit_test(test_twist),
        cmocka_unit_test(test_skipped),
        cmocka_unit_test(test_driven),
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_starts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
