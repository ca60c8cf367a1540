/* How fast nodes of a lattice are, alone and against each other: looks (looks.h) and drifts (sweep.h). */
#include <string.h>

#include "sim/base/hash.h"
#include "sim/step/looks.h"
#include "tests/support/check.h"

/* a lattice whose nodes turn about a line across it, and shake by `noise` [m/s]; returns the arena */
static Arena lattice_make(SweepLattice *l, Lanes *lanes, int nu, int nv, bool wrap, double noise) {
    Arena arena = {0};
    *l = (SweepLattice){.nu = nu, .nv = nv, .stride = nu + LANE_MARGIN, .wrap = wrap};
    l->first = l->stride + LANE_MARGIN;
    *lanes = lanes_create((nv + 2) * l->stride + LANE_MARGIN, &arena);
    for (int i = 0; i < nu * nv; i++) {
        int slot = l->first + i / nu * l->stride + i % nu;
        for (int a = 0; a < 3; a++) {
            double turn = a == 0 ? 0.1 * (i / nu) : a == 1 ? 0.02 * (i % nu) : 1.0;
            lanes->x[a][slot] = hash_random(5, (uint64_t)(3 * i + a));
            lanes->v[a][slot] = turn + noise * hash_random(6, (uint64_t)(3 * i + a));
        }
    }
    return arena;
}

static Vec3 lanes_at(double *const lane[3], int slot) {
    return vec3(lane[0][slot], lane[1][slot], lane[2][slot]);
}

static Vec3 lattice_velocity(const SweepLattice *l, const Lanes *lanes, int i, int j) {
    int slot = l->first + j * l->stride + i;
    return lanes_at(lanes->v, slot);
}

static void check_speeds(const SweepLattice *l, const Lanes *lanes, SweepSpeed speed,
                         double slack) {
    double fastest = 0.0, relative = 0.0, mutual = 0.0;
    for (int j = 0; j < l->nv; j++) {
        for (int i = 0; i < l->nu; i++) {
            Vec3 v = lattice_velocity(l, lanes, i, j);
            for (int k = 0; k < l->nu * l->nv; k++) {
                Vec3 other = lattice_velocity(l, lanes, k % l->nu, k / l->nu);
                mutual = fmax(mutual, vec3_length(vec3_sub(other, v)));
            }
            int right = i + 1 < l->nu ? i + 1 : l->wrap ? 0 : i, up = j + 1 < l->nv ? j + 1 : j;
            Vec3 other[2] = {lattice_velocity(l, lanes, right, j),
                             lattice_velocity(l, lanes, i, up)};
            fastest = fmax(fastest, vec3_length(v));
            for (int k = 0; k < 2; k++) {
                relative = fmax(relative, vec3_length(vec3_sub(other[k], v)));
            }
        }
    }
    Vec3 high = speed.frames.high, low = speed.frames.low;
    double within = sqrt(speed.within), frames = vec3_length(vec3_sub(high, low));
    double most = hypot(fmax(-low.x, high.x), hypot(fmax(-low.y, high.y), fmax(-low.z, high.z)));
    double apart = sqrt(speed.shear) + 2.0 * within;
    CHECK_AT_MOST(fastest - most - within, 1e-14);
    CHECK_AT_MOST(mutual - frames - 2.0 * within, 1e-14);
    CHECK_AT_MOST(relative - apart, 1e-14);
    CHECK_AT_MOST(apart - relative, slack);
}

static void check_box(Box box, Box wanted) {
    CHECK_AT_MOST(vec3_length(vec3_sub(box.low, wanted.low)), 0.0);
    CHECK_AT_MOST(vec3_length(vec3_sub(box.high, wanted.high)), 0.0);
}

/* in two chunks */
static void check_spread(const LookKernel *kernel, const SweepLattice *l, double *const x[3],
                         double *const from[3], const double wanted[2]) {
    double low[2], high[2];
    kernel->spread(l, x, from, 0, 2, low);
    kernel->spread(l, x, from, 2, l->nv, high);
    for (int k = 0; k < 2; k++) {
        CHECK_NEAR(fmax(low[k], high[k]), wanted[k], 1e-14);
    }
}

/* looks at a lattice: what pairs of nodes have, for every width; of rows in two chunks */
static void test_looks(void **unused) {
    (void)unused;
    int size[4][2] = {{1, 5}, {3, 4}, {23, 9}, {51, 33}};
    for (int k = 0; k < 8; k++) {
        SweepLattice l;
        Lanes lanes;
        Arena arena = lattice_make(&l, &lanes, size[k / 2][0], size[k / 2][1], k & 1, 0.3);
        sweep_wrap_rows(&l, lanes.x);
        sweep_wrap_rows(&l, lanes.v);
        double fastest = 0.0, spread[2] = {0.0, 0.0}, relative[2] = {0.0, 0.0}, *led[3];
        Box moved = box_empty();
        for (int a = 0; a < 3; a++) {
            led[a] = arena_push(&arena, double, lanes.slot_count);
        }
        for (int i = 0; i < l.nu * l.nv; i++) {
            int s = l.first + i / l.nu * l.stride + i % l.nu;
            bool edge = i % l.nu + 1 == l.nu && !l.wrap, top = i / l.nu + 1 == l.nv;
            int to[2] = {edge ? s : s + 1, top ? s : s + l.stride};
            Vec3 v = lanes_at(lanes.v, s), x = vec3_sub(lanes_at(lanes.x, s), v);
            fastest = fmax(fastest, vec3_dot(v, v));
            box_add(&moved, x);
            for (int m = 0; m < 2; m++) {
                Vec3 w = lanes_at(lanes.v, to[m]), y = vec3_sub(lanes_at(lanes.x, to[m]), w);
                relative[m] = fmax(relative[m], vec3_dot(vec3_sub(w, v), vec3_sub(w, v)));
                spread[m] = fmax(spread[m], vec3_dot(vec3_sub(y, x), vec3_sub(y, x)));
            }
        }
        for (int width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
            if (!vector_runs_here((VectorWidth)width)) {
                continue;
            }
            const LookKernel *kernel = looks_kernel((VectorWidth)width);
            CHECK_NEAR(
                fmax(kernel->fastest(&l, &lanes, 0, 2), kernel->fastest(&l, &lanes, 2, l.nv)),
                fastest, 1e-14);
            check_spread(kernel, &l, lanes.v, NULL, relative);
            check_spread(kernel, &l, lanes.x, lanes.v, spread);
            Box low = kernel->moved(&l, lanes.x, lanes.v, 0, 2);
            check_box(box_union(low, kernel->moved(&l, lanes.x, lanes.v, 2, l.nv)), moved);
            kernel->lead(lanes.x, lanes.v, led, 0.3, lanes.slot_count);
            for (int s = 0; s < lanes.slot_count; s++) {
                assert_true(led[1][s] == lanes.x[1][s] + 0.3 * lanes.v[1][s]);
            }
        }
        arena_free(&arena);
    }
}

/* The drift moves nodes to the same places with frames as without, for every width, and says how fast they
 * were at most; rows that are taken in two chunks are compared with each other. */
static void test_frames(void **unused) {
    (void)unused;
    int size[4][2] = {{1, 5}, {3, 4}, {23, 9}, {51, 33}};
    for (int k = 0; k < 16; k++) {
        SweepLattice l;
        Lanes lanes;
        bool wrap = k & 1;
        double noise = k & 2 ? 0.3 : 0.0;
        Arena arena = lattice_make(&l, &lanes, size[k / 4][0], size[k / 4][1], wrap, noise);
        double *first = arena_push(&arena, double, lanes.slot_count);
        double *moved = arena_push(&arena, double, lanes.slot_count);
        size_t bytes = (size_t)lanes.slot_count * sizeof *first;
        memcpy(first, lanes.x[2], bytes);
        SweepDrift plain = {.dt = 0.3}, framed = {.dt = 0.3, .frames = true};
        SweepSpeed still = sweep_kernels[0]->drift(&l, &lanes, &plain, 0, l.nv);
        assert_true(vec3_length(still.frames.low) == 0.0 && vec3_length(still.frames.high) == 0.0);
        assert_true(still.shear == 0.0);
        memcpy(moved, lanes.x[2], bytes);
        for (int n = 0; sweep_kernels[n]; n++) {
            if (!sweep_kernel_runs_here(sweep_kernels[n])) {
                continue;
            }
            memcpy(lanes.x[2], first, bytes);
            SweepSpeed low = sweep_kernels[n]->drift(&l, &lanes, &framed, 0, 2);
            SweepSpeed high = sweep_kernels[n]->drift(&l, &lanes, &framed, 2, l.nv);
            assert_memory_equal(lanes.x[2], moved, bytes);
            SweepSpeed all = {fmax(low.within, high.within), box_union(low.frames, high.frames),
                              fmax(low.shear, high.shear)};
            check_speeds(&l, &lanes, all, noise > 0.0 ? 2.0 : 0.02 * l.nu);
        }
        arena_free(&arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_looks),
        cmocka_unit_test(test_frames),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
