/* The bound on the sides of cells: slopes against differences, impulses against the law, and a sheet
 * that hangs by a corner. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/step/sides.h"
#include "tests/support/check.h"
#include "tests/support/play.h"

#define NU 4
#define NV 5
#define STRIDE 16
#define SPACING1 0.02
#define SPACING2 0.03

typedef struct Patch {
    Arena arena;
    SweepLattice lattice;
    Lanes lanes;
    Sides sides;
    unsigned char held[NU * NV];
} Patch;

static int slot_of(const Patch *p, int node) {
    return p->lattice.first + node / NU * STRIDE + node % NU;
}

/* a crumpled patch, stretched as a whole, all cells to be looked at */
static void patch_make(Patch *p, double stretch, double noise) {
    memset(p, 0, sizeof *p);
    p->lattice = (SweepLattice){.nu = NU,
                                .nv = NV,
                                .stride = STRIDE,
                                .first = STRIDE + LANE_MARGIN,
                                .h1 = SPACING1,
                                .h2 = SPACING2,
                                .c11 = 100,
                                .c22 = 200,
                                .bounded = true};
    p->lanes = lanes_create((NV + 2) * STRIDE + LANE_MARGIN, &p->arena);
    double *const none[3] = {NULL, NULL, NULL};
    p->sides = sides_create(&p->lattice, none, &p->arena);
    for (int i = 0; i < NU * NV; i++) {
        double flat[3] = {stretch * SPACING1 * (i % NU), stretch * SPACING2 * (i / NU), 0.0};
        for (int a = 0; a < 3; a++) {
            uint64_t seed = (uint64_t)(3 * i + a);
            p->lanes.x[a][slot_of(p, i)] = flat[a] + noise * hash_random(1, seed);
            p->lanes.v[a][slot_of(p, i)] = hash_random(2, seed);
        }
        p->lanes.weight[slot_of(p, i)] = 1e3 * (1.5 + hash_random(3, (uint64_t)i));
    }
}

/* excess of a listed side when everything has moved on for a time */
static double excess_after(const Patch *p, const BoundSide *side, double time) {
    Vec3 x[4];
    for (int k = 0; k < 4; k++) {
        int s = side->slot[k];
        double *const *l = p->lanes.x, *const *v = p->lanes.v;
        x[k] = vec3(l[0][s] + time * v[0][s], l[1][s] + time * v[1][s], l[2][s] + time * v[2][s]);
    }
    Vec3 own = vec3_sub(x[1], x[0]), mean = vec3_scale(0.5, vec3_add(own, vec3_sub(x[3], x[2])));
    double spacing = abs(side->slot[1] - side->slot[0]) == 1 ? SPACING1 : SPACING2;
    double length = vec3_length(own), stretched = vec3_length(mean);
    double longest = (1.0 + SWEEP_SIDE_EXCESS) * fmax(spacing, stretched);
    double shortest = (1.0 - SWEEP_SIDE_EXCESS) * fmin(spacing, stretched);
    return fmax(length - longest, shortest - length);
}

static void test_slopes(void **unused) {
    (void)unused;
    for (int wide = 0; wide < 2; wide++) {
        Patch p;
        patch_make(&p, wide ? 1.2 : 0.95, 4e-3);
        sides_find(&p.sides, &p.lanes, p.held, true, 0.0);
        assert_true(p.sides.count > 10);
        double worst = 0.0, step = 1e-7, level = 0.0;
        for (int k = 0; k < p.sides.count; k++) {
            const BoundSide *side = &p.sides.shares->list[k];
            double change = excess_after(&p, side, step) - excess_after(&p, side, -step);
            worst = fmax(worst, fabs(0.5 * change / step - side->before));
            level = fmax(level, fabs(excess_after(&p, side, 0.0) - side->excess));
        }
        CHECK_AT_MOST(worst, 1e-6);
        CHECK_AT_MOST(level, 1e-15);
        arena_free(&p.arena);
    }
}

/* cloth that stretches as a whole meets no bound, however far */
static void test_stretched(void **unused) {
    (void)unused;
    Patch p;
    patch_make(&p, 1.3, 0.0);
    sides_find(&p.sides, &p.lanes, p.held, true, 0.0);
    assert_int_equal(p.sides.count, 0);
    arena_free(&p.arena);
}

/* forces and impulses of a kick of `share` dt */
static void kick_sides(Patch *p, double dt, double share) {
    for (int i = 0; i < NU * NV; i++) {
        int s = slot_of(p, i);
        for (int a = 0; a < 3; a++) {
            p->lanes.v[a][s] += share * dt * p->lanes.weight[s] * p->lanes.f[a][s];
        }
    }
    sides_hold(&p->sides, &p->lanes, dt, share);
}

static Vec3 momentum(const Patch *p, Vec3 *angular) {
    Vec3 sum = {0, 0, 0};
    *angular = sum;
    for (int i = 0; i < NU * NV; i++) {
        int s = slot_of(p, i);
        Vec3 x = vec3(p->lanes.x[0][s], p->lanes.x[1][s], p->lanes.x[2][s]);
        Vec3 v = vec3(p->lanes.v[0][s], p->lanes.v[1][s], p->lanes.v[2][s]);
        v = vec3_scale(1.0 / p->lanes.weight[s], v);
        sum = vec3_add(sum, v);
        *angular = vec3_add(*angular, vec3_cross(x, v));
    }
    return sum;
}

/* one long side meets the law at once, or yields; many keep both momenta, and none ever pushes */
static void test_impulses(void **unused) {
    (void)unused;
    const double dt = 1e-4;
    Patch p;
    patch_make(&p, 1.0, 0.0);
    p.lanes.x[0][slot_of(&p, 3)] += 0.06 * SPACING1;
    for (int share = 1; share <= 2; share++) {
        sides_find(&p.sides, &p.lanes, p.held, true, 0.5 * share * dt);
        assert_int_equal(p.sides.count, 1);
        kick_sides(&p, dt, 0.5 * share);
        const BoundSide *side = p.sides.shares->list;
        double growth = (excess_after(&p, side, 1e-9) - excess_after(&p, side, -1e-9)) / 2e-9;
        double law = 0.5 * share * dt * side->stiffness * (side->excess + dt * growth);
        CHECK_NEAR(side->impulse / law, 1.0, 1e-5);
    }
    p.lanes.x[0][slot_of(&p, 3)] += 0.3 * SPACING1;
    sides_find(&p.sides, &p.lanes, p.held, true, dt);
    kick_sides(&p, dt, 1.0);
    double yields = dt * p.sides.shares->list->stiffness * SIDE_BOUND_MOST * SPACING1;
    CHECK_NEAR(p.sides.shares->list->impulse / yields, 1.0, 1e-12);
    arena_free(&p.arena);
    patch_make(&p, 0.95, 4e-3);
    sides_find(&p.sides, &p.lanes, p.held, true, dt);
    Vec3 angular[2], before = momentum(&p, &angular[0]);
    kick_sides(&p, dt, 1.0);
    double taken = sides_work(&p.sides, &p.lanes).taken;
    Vec3 after = momentum(&p, &angular[1]);
    assert_true(taken != 0.0);
    CHECK_AT_MOST(vec3_length(vec3_sub(after, before)), 1e-15);
    CHECK_AT_MOST(vec3_length(vec3_sub(angular[1], angular[0])), 1e-16);
    for (int k = 0; k < p.sides.count; k++) {
        assert_true(p.sides.shares->list[k].impulse >= 0.0);
    }
    arena_free(&p.arena);
}

/* the kick of every kernel sees the cells that hold long or short sides, and no others */
static void test_seen(void **unused) {
    (void)unused;
    for (int n = 0; sweep_kernels[n / 2]; n++) {
        const SweepKernel *const *kernel = &sweep_kernels[n / 2];
        Patch p;
        patch_make(&p, 1.0, 0.0);
        p.lanes.x[1][slot_of(&p, NU * NV - 1)] += (n % 2 ? -0.1 : 0.1) * SPACING2;
        double *buffer = arena_push(&p.arena, double, SWEEP_BUFFER_ROWS *STRIDE + LANE_MARGIN);
        SweepKick kick = {1e-6, {0, 0, 0}, 1.0, p.sides.seen, NULL};
        if (!sweep_kernel_runs_here(*kernel)) {
            arena_free(&p.arena);
            continue;
        }
        (*kernel)->kick(&p.lattice, &p.lanes, &kick, 0, NV, buffer);
        for (int j = 0; j + 1 < NV; j++) {
            assert_int_equal(p.sides.seen.row[j], j == NV - 2);
        }
        for (int i = 0; i + 1 < NU; i++) {
            assert_int_equal(p.sides.seen.cell[(NV - 2) * NU + i], i == NU - 2);
        }
        arena_free(&p.arena);
    }
}

/* A sheet of 60 g hangs by one corner, whose sides would stretch by 64 %. They may differ by 2 % from a
 * cell that stretches by 1 or 2; half the weight along each of the two, over their stiffness, adds 1.4. */
static void test_corner(void **unused) {
    (void)unused;
    Play play;
    play_start(&play,
               "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  sheet:\n"
               "    shape: {rectangle: {width: 60 cm, height: 60 cm}}\n    fabric: {name: f, "
               "weight: 170 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3, bending: "
               "1e-5 N m}}\n    nodes: 31 x 31\n    sides: bounded\n    damping: 4 1/s\n    turn: "
               "{axis: x, by: "
               "90 deg}\nhandles:\n  - hold: sheet.top-left\nsolver: {stepper: central}\n");
    play_to(&play, 3.0);
    double worst = 0.0;
    for (int i = 0; i + 1 < 31; i++) {
        for (int j = 0; j < 31; j++) {
            Vec3 along = vec3_sub(play_x(&play, j * 31 + i + 1), play_x(&play, j * 31 + i));
            Vec3 up = vec3_sub(play_x(&play, i * 31 + 31 + j), play_x(&play, i * 31 + j));
            worst = fmax(worst, fmax(vec3_length(along), vec3_length(up)) / 0.02 - 1.0);
        }
    }
    CHECK_AT_MOST(worst, 0.054);
    play_end(&play);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slopes),   cmocka_unit_test(test_stretched),
        cmocka_unit_test(test_impulses), cmocka_unit_test(test_seen),
        cmocka_unit_test(test_corner),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
