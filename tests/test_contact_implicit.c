/* Contact on the implicit road: forces, the clamp, planes with friction, overhangs. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "sim/contact/constants.h"
#include "sim/contact/meeting.h"
#include "sim/geom/crossing.h"
#include "sim/step/stepper.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"

#define STEP (1.0 / 60.0)

/* A scene with up to two cloths, obstacles and handles, and its run. */
typedef struct World {
    Arena arena;
    ClothDef cloths[2];
    ObstacleDef obstacles[1];
    HandleDef handles[2];
    Scene scene;
    System system;
    const Stepper *stepper;
    void *data;
    State state;
    Statistics statistics;
    CrossingMesh mesh;
} World;

static void world_clear(World *w) {
    memset(w, 0, sizeof *w);
    w->scene = cloths_scene(w->cloths);
    w->scene.obstacles = w->obstacles;
    w->scene.handles = w->handles;
    w->obstacles[0] = obstacle_default();
    w->obstacles[0].name = "obstacle";
    w->handles[0] = w->handles[1] = handle_default();
}

static ClothDef sheet(double size, int nodes) {
    ClothDef cloth =
        cloths_rectangle(size, size, nodes, nodes, cloths_fabric(0.2, 1000.0, 0.3, 1e-4, 0.3));
    cloth.damping = 1.0;
    return cloth;
}

static void world_start(World *w, const char *stepper) {
    Error error = {0};
    w->scene.solver.stepper = stepper;
    if (!system_create(&w->system, &w->scene, 3, &w->arena, &error)) {
        fail_msg("%s", error.text);
    }
    const System *s = &w->system;
    w->stepper = stepper_find(stepper);
    if (!w->stepper->create(s, &w->data, &error)) {
        fail_msg("%s", error.text);
    }
    w->state = state_allocate(s, &w->arena);
    state_start(s, &w->state);
    w->statistics.smallest_gap = w->statistics.smallest_self_gap = INFINITY;
    w->mesh = system_mesh(s, w->state.x, &w->arena);
}

static void world_to(World *w, double time) {
    Error error = {0};
    if (!w->stepper->advance(&w->system, w->data, &w->state, time, &w->statistics, &error)) {
        fail_msg("%s: %s", w->stepper->name, error.text);
    }
}

static void world_end(World *w) {
    if (w->stepper && w->stepper->destroy) {
        w->stepper->destroy(w->data);
    }
    arena_free(&w->arena);
}

static int crossings(World *w) {
    int count = 0;
    assert_null(crossing_find_damage(&w->mesh));
    count += (int)crossing_count_self(&w->mesh, &w->arena).count;
    for (int o = 0; o < w->system.contact.obstacle_count; o++) {
        const Solid *solid = &w->system.contact.obstacles[o].solid;
        count += (int)crossing_count_solid(&w->mesh, solid, w->state.contact.poses[o]).count;
    }
    return count;
}

/* runs to `time` step by step; crossings of all steps together */
static int run_and_count(World *w, double time) {
    int count = 0, steps = (int)(time / STEP + 0.5);
    for (int k = 1; k <= steps; k++) {
        world_to(w, k * STEP);
        count += crossings(w);
    }
    return count;
}

static Vec3 mean_position(const World *w) {
    Vec3 sum = {0, 0, 0};
    double mass = 0.0;
    for (int i = 0; i < w->system.place_count; i++) {
        sum = vec3_axpy(sum, w->system.mass[i], vec3_load(w->state.x + 3 * (size_t)i));
        mass += w->system.mass[i];
    }
    return vec3_scale(1.0 / mass, sum);
}

/* ---- forces ---- */

/* two shaken sheets, one turned, a fraction of the contact distance above each other */
static void two_sheets(World *w, SolidKind kind, double radius) {
    world_clear(w);
    w->scene.cloth_count = 2;
    for (int c = 0; c < 2; c++) {
        w->cloths[c] = sheet(0.1, 6);
        w->cloths[c].noise = 1.5e-4;
        w->cloths[c].fabric.friction.value = 0.0;
        w->cloths[c].pose.shift.z = 0.8e-3 * c;
    }
    w->cloths[1].pose.turn = quat_from_axis_angle(vec3(0, 0, 1), PI / 6.0);
    w->scene.obstacle_count = radius > 0.0;
    w->obstacles[0].solid = (Solid){kind, {0.04, 0.03, 0.02}, radius};
    w->obstacles[0].pose.shift.z = -0.7e-3 - (kind == SOLID_BOX ? 0.02 : radius);
    w->obstacles[0].pose.turn =
        quat_from_axis_angle(vec3(1, 0, 0), kind == SOLID_CAPSULE ? PI / 2.0 : 0.0);
    w->obstacles[0].friction = 0.0;
    world_start(w, "bdf2");
}

/* [J] with the shares of the stiffness that contacts had before */
static double energy_at_shares(const Barrier *b, const Meeting *before, int count) {
    double energy = 0.0;
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        int k = 0;
        while (k < count && memcmp(before[k].key, m->key, sizeof m->key) != 0) {
            k++;
        }
        energy += k < count ? m->energy * before[k].share / m->share : m->energy;
    }
    return energy;
}

/* relative error of the gradient along random directions; how many contacts are faded in *faded */
static double gradient_error(World *w, Barrier *b, double *moved, double *g, int *faded) {
    int n = 3 * w->system.place_count;
    double worst = 0.0, h = 1e-8;
    memset(g, 0, (size_t)n * sizeof *g);
    assert_true(barrier_look(b, w->state.x).contacts > 20);
    barrier_add_gradient(b, g);
    int count = b->now.count;
    Meeting *before = arena_push(&w->arena, Meeting, count);
    memcpy(before, b->now.items, (size_t)count * sizeof *before);
    for (int i = 0; i < count; i++) {
        *faded += before[i].share < 1.0;
    }
    double size = 0.0;
    for (int k = 0; k < n; k++) {
        size += g[k] * g[k] / 3.0;
    }
    for (uint64_t seed = 0; seed < 8; seed++) {
        double energy[2], along = 0.0;
        for (int side = 0; side < 2; side++) {
            for (int k = 0; k < n; k++) {
                double d = hash_random(seed, (uint64_t)k);
                moved[k] = w->state.x[k] + (side ? h : -h) * d;
                along += 0.5 * g[k] * d;
            }
            barrier_look(b, moved);
            energy[side] = energy_at_shares(b, before, count);
        }
        worst = fmax(worst, fabs((energy[1] - energy[0]) / (2.0 * h) - along) / sqrt(size));
    }
    return worst;
}

static void test_gradient(void **unused) {
    (void)unused;
    SolidKind kinds[3] = {SOLID_SPHERE, SOLID_BOX, SOLID_CAPSULE};
    double radius[3] = {0.05, 0.005, 0.02};
    int faded = 0;
    for (int k = 0; k < 3; k++) {
        World w;
        two_sheets(&w, kinds[k], radius[k]);
        Barrier *b = barrier_create(&w.system.contact, &w.arena);
        unsigned char *held = arena_push(&w.arena, unsigned char, w.system.place_count);
        double *moved = arena_push(&w.arena, double, 3 * w.system.place_count);
        double *g = arena_push(&w.arena, double, 3 * w.system.place_count);
        barrier_begin(b, &w.state.contact, w.state.x, held);
        CHECK_AT_MOST(gradient_error(&w, b, moved, g, &faded), 1e-7);
        world_end(&w);
    }
    assert_true(faded > 3);
}

/* sums of force and torque between the sheets */
static void test_momentum(void **unused) {
    (void)unused;
    World w;
    two_sheets(&w, SOLID_SPHERE, 0.0);
    for (int i = 0; i < 2; i++) { /* with friction: it acts at one point too */
        double *friction = (double *)w.system.contact.friction;
        for (int k = 0; k < w.system.place_count; k++) {
            friction[k] = 0.4 * i;
        }
        Barrier *b = barrier_create(&w.system.contact, &w.arena);
        unsigned char *held = arena_push(&w.arena, unsigned char, w.system.place_count);
        double *start = arena_push(&w.arena, double, 3 * w.system.place_count);
        double *g = arena_push(&w.arena, double, 3 * w.system.place_count);
        memcpy(start, w.state.x, 3 * (size_t)w.system.place_count * sizeof *start);
        cloths_shake(start, w.system.place_count, 1e-5, 4);
        barrier_begin(b, &w.state.contact, start, held);
        barrier_look(b, w.state.x);
        barrier_add_gradient(b, g);
        Vec3 force = {0, 0, 0}, torque = {0, 0, 0};
        double size = 0.0;
        for (int k = 0; k < w.system.place_count; k++) {
            Vec3 f = vec3_load(g + 3 * (size_t)k);
            force = vec3_add(force, f);
            torque = vec3_add(torque, vec3_cross(vec3_load(w.state.x + 3 * (size_t)k), f));
            size += vec3_length(f);
        }
        CHECK_AT_MOST(vec3_length(force) / size, 1e-12);
        /* friction acts along the tangent plane at both nearest points: a couple of gap x force */
        CHECK_AT_MOST(vec3_length(torque) / (size * 0.1), i == 0 ? 1e-12 : 1e-4);
    }
    world_end(&w);
}

typedef struct Dense {
    int n;
    double *a;
} Dense;

static bool add_dense(void *context, int row, int column, const double block[9]) {
    Dense *d = context;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            d->a[(size_t)(3 * row + r) * (size_t)d->n + (size_t)(3 * column + c)] +=
                block[3 * r + c];
            if (row != column) {
                d->a[(size_t)(3 * column + c) * (size_t)d->n + (size_t)(3 * row + r)] +=
                    block[3 * r + c];
            }
        }
    }
    return true;
}

static void test_definite(void **unused) {
    (void)unused;
    World w;
    two_sheets(&w, SOLID_SPHERE, 0.05);
    int n = 3 * w.system.place_count;
    Barrier *b = barrier_create(&w.system.contact, &w.arena);
    unsigned char *held = arena_push(&w.arena, unsigned char, w.system.place_count);
    double *p = arena_push(&w.arena, double, n), *y = arena_push(&w.arena, double, n);
    Dense dense = {n, arena_push(&w.arena, double, n *n)};
    double *friction = (double *)w.system.contact.friction, least = INFINITY, most = -INFINITY;
    for (int k = 0; k < w.system.place_count; k++) {
        friction[k] = 0.3;
    }
    double *start = arena_push(&w.arena, double, n);
    memcpy(start, w.state.x, (size_t)n * sizeof *start);
    cloths_shake(start, w.system.place_count, 1e-5, 4);
    barrier_begin(b, &w.state.contact, start, held);
    barrier_look(b, w.state.x);
    barrier_add_stiffness(b, add_dense, &dense);
    for (uint64_t seed = 0; seed < 200; seed++) {
        double lumped = 0.0, whole = 0.0, scale = 0.0;
        for (int k = 0; k < n; k++) {
            p[k] = hash_random(seed, (uint64_t)k);
            p[k] += seed % 2 ? 3.0 * hash_random(seed, (uint64_t)(k % 3) + 100000) : 0.0;
        }
        memset(y, 0, (size_t)n * sizeof *y);
        assert_true(barrier_add_lumped(b, p, y));
        for (int r = 0; r < n; r++) {
            double row = 0.0;
            for (int c = 0; c < n; c++) {
                row += dense.a[(size_t)r * (size_t)n + (size_t)c] * p[c];
            }
            lumped += p[r] * row;
            whole += p[r] * (row + y[r]);
            scale += p[r] * p[r] * dense.a[(size_t)r * (size_t)n + (size_t)r];
        }
        least = fmin(least, fmin(lumped, whole) / scale);
        most = fmax(most, (whole - lumped) / scale);
    }
    CHECK_AT_MOST(-least, 1e-12);
    CHECK_AT_MOST(most, 1e-12); /* lumping majorises */
    world_end(&w);
}

/* ---- the clamp ---- */

static void test_clamp(void **unused) {
    (void)unused;
    double scales[4] = {1e-3, 2e-2, 0.5, 20.0}; /* [m] 20: 1000 x the spacing */
    int count = 0;
    double least = INFINITY;
    for (int k = 0; k < 8; k++) {
        World w;
        two_sheets(&w, k < 4 ? SOLID_SPHERE : SOLID_BOX, k < 4 ? 0.05 : 0.005);
        Clamp clamp = clamp_create(&w.system.contact, &w.arena);
        int n = 3 * w.system.place_count;
        double *dx = arena_push(&w.arena, double, n);
        unsigned char *held = arena_push(&w.arena, unsigned char, w.system.place_count);
        for (int round = 0; round < 4; round++) { /* each from where the last one ended */
            memset(dx, 0, (size_t)n * sizeof *dx);
            cloths_shake(dx, w.system.place_count, scales[k % 4], (uint64_t)(10 * k + round));
            clamp_motion(&clamp, &(ClampObstacles){.from = w.state.contact.poses}, held, w.state.x,
                         dx);
            for (int i = 0; i < n; i++) {
                w.state.x[i] += dx[i];
            }
            count += crossings(&w);
        }
        Barrier *b = barrier_create(&w.system.contact, &w.arena);
        barrier_begin(b, &w.state.contact, w.state.x, held);
        BarrierReport report = barrier_look(b, w.state.x);
        least = fmin(least, fmin(report.smallest_gap, report.smallest_self_gap));
        dx[4] = NAN;
        assert_true(clamp_motion(&clamp, &(ClampObstacles){.from = w.state.contact.poses}, held,
                                 w.state.x, dx) == 0.0);
        assert_true(dx[4] == 0.0);
        world_end(&w);
    }
    CHECK_AT_MOST(count, 0);
    CHECK_AT_MOST(CONTACT_CORE * 1e-3 / least, 1.0);
}

/* ---- planes with friction ---- */

/* a sheet on a plane; gravity leans by the angle whose tangent is `slope` */
static void on_plane(World *w, double slope, double friction, double speed, const char *stepper) {
    world_clear(w);
    w->cloths[0] = sheet(0.5, 6);
    w->cloths[0].damping = 0.0;
    w->cloths[0].velocity = vec3(speed, 0, 0);
    w->cloths[0].pose.shift.z = 0.999e-3;
    w->scene.obstacle_count = 1;
    w->obstacles[0].solid.kind = SOLID_PLANE;
    w->obstacles[0].friction = friction;
    double angle = atan(slope);
    w->scene.gravity = vec3(9.81 * sin(angle), 0, -9.81 * cos(angle));
    world_start(w, stepper);
}

static double slide(double slope, double friction, double speed, double time, const char *stepper) {
    World w;
    on_plane(&w, slope, friction, speed, stepper);
    double start = mean_position(&w).x;
    int steps = (int)(time / STEP + 0.5);
    for (int k = 1; k <= steps; k++) {
        world_to(&w, k * STEP);
    }
    double distance = mean_position(&w).x - start;
    world_end(&w);
    return distance;
}

static void test_incline(void **unused) {
    (void)unused;
    const char *names[2] = {"bdf2", "backward_euler"};
    for (int k = 0; k < 2; k++) {
        CHECK_AT_MOST(fabs(slide(0.5, 0.505, 0.0, 1.0, names[k])), 0.5e-3);
        CHECK_AT_MOST(fabs(slide(0.5, 0.5005, 0.0, 1.0, names[k])), 1e-3);
        /* a = g (sin - mu cos) = 0.0439 m/s2, over one second, half a step more by Euler */
        double a = 9.81 * (sin(atan(0.5)) - 0.495 * cos(atan(0.5)));
        CHECK_NEAR(slide(0.5, 0.495, 0.0, 1.0, names[k]) / (0.5 * a), 1.0, 0.1);
    }
    double a = 9.81 * (sin(atan(0.5)) - 0.3 * cos(atan(0.5)));
    double moved = slide(0.5, 0.3, 0.0, 0.5, "bdf2"), exact = 0.125 * a;
    CHECK_NEAR(moved, 0.2194, 0.04 * 0.2194);
    CHECK_NEAR(moved, exact * (1.0 + STEP / 0.5), 1e-3 * 0.2267);
}

static void test_stop(void **unused) {
    (void)unused;
    double exact = 1.0 / (2.0 * 0.3 * 9.81);
    double moved = slide(0.0, 0.3, 1.0, 0.6, "bdf2");
    CHECK_NEAR(moved, exact, 0.06 * exact);
    CHECK_NEAR(moved, exact - 0.5 * STEP, 0.005 * exact);
}

/* the same gap at rest as on the explicit road, as a share of the contact distance */
static double rest_gap(const char *stepper) {
    World w;
    on_plane(&w, 0.0, 0.3, 0.0, stepper);
    for (int k = 1; k <= 60; k++) {
        world_to(&w, k * STEP);
    }
    double gap = mean_position(&w).z;
    world_end(&w);
    return gap / 1e-3;
}

static void test_rest_gap(void **unused) {
    (void)unused;
    CHECK_NEAR(rest_gap("bdf2"), rest_gap("central"), 0.02);
}

/* ---- overhang ---- */

/* a quarter of a sheet hangs over a table's edge: positions after two seconds */
static void overhang(World *w, const char *stepper) {
    world_clear(w);
    w->cloths[0] = sheet(1.0, 26);
    w->cloths[0].pose.shift = vec3(0.25, 0, 1.1e-3);
    w->scene.obstacle_count = 1;
    w->obstacles[0].solid = (Solid){SOLID_BOX, {0.5, 0.6, 0.25}, 0.0};
    w->obstacles[0].pose.shift.z = -0.25;
    w->obstacles[0].friction = 0.6;
    world_start(w, stepper);
}

static double rms_apart(const World *a, const World *b) {
    double sum = 0.0;
    int n = 3 * a->system.place_count;
    for (int k = 0; k < n; k++) {
        sum += (a->state.x[k] - b->state.x[k]) * (a->state.x[k] - b->state.x[k]);
    }
    return sqrt(sum / (n / 3.0));
}

static void test_overhang(void **unused) {
    (void)unused;
    World a, b;
    overhang(&a, "bdf2");
    overhang(&b, "central");
    CHECK_AT_MOST(run_and_count(&a, 2.0), 0);
    for (int k = 1; k <= 120; k++) {
        world_to(&b, k * STEP);
    }
    CHECK_AT_MOST(rms_apart(&a, &b), 1e-2);
    world_end(&a);
    world_end(&b);
}

/* ---- abuse ---- */

static void test_tunnelling(void **unused) {
    (void)unused;
    double speeds[3] = {10.0, 50.0, 200.0};
    Solid solids[3] = {{SOLID_BOX, {0.1, 0.1, 0.1}, 0.0},
                       {SOLID_BOX, {0.3, 0.005, 0.1}, 0.0},
                       {SOLID_SPHERE, {0, 0, 0}, 0.1}};
    for (int k = 0; k < 9; k++) {
        World w;
        world_clear(&w);
        w.cloths[0] = sheet(0.5, 12);
        w.cloths[0].pose.shift = vec3(0.03, 0.02, 0.13);
        w.cloths[0].velocity = vec3(0, 0, -speeds[k / 3]);
        w.scene.obstacle_count = 1;
        w.obstacles[0].solid = solids[k % 3];
        w.obstacles[0].friction = 0.3;
        world_start(&w, k % 2 ? "backward_euler" : "bdf2");
        CHECK_AT_MOST(run_and_count(&w, 0.1), 0);
        world_end(&w);
    }
    for (int k = 0; k < 3; k++) {
        World w;
        world_clear(&w);
        w.scene.cloth_count = 2;
        for (int c = 0; c < 2; c++) {
            w.cloths[c] = sheet(0.3, 10);
            w.cloths[c].pose.shift = vec3(0.04 * c, 0.03 * c, 0.05 * c);
            w.cloths[c].velocity = vec3(0, 0, c ? -0.5 * speeds[k] : 0.5 * speeds[k]);
        }
        world_start(&w, "bdf2");
        CHECK_AT_MOST(run_and_count(&w, 0.1), 0);
        world_end(&w);
    }
}

static uint64_t heap(int threads, double time, int *count) {
    World w;
    parallel_set_threads(threads);
    world_clear(&w);
    w.cloths[0] = sheet(0.4, 15);
    w.cloths[0].noise = 1e-3;
    w.cloths[0].pose.shift.z = 0.23;
    w.cloths[0].pose.turn = quat_from_axis_angle(vec3(1, 0, 0), 88.0 * PI / 180.0);
    w.scene.obstacle_count = 1;
    w.obstacles[0].solid.kind = SOLID_PLANE;
    w.obstacles[0].friction = 0.3;
    world_start(&w, "bdf2");
    *count = run_and_count(&w, time);
    uint64_t hash = hash_bytes(w.state.x, 3 * (size_t)w.system.place_count * sizeof(double));
    world_end(&w);
    parallel_set_threads(1);
    return hash;
}

static void test_heap(void **unused) {
    (void)unused;
    int count;
    heap(1, 0.8, &count);
    CHECK_AT_MOST(count, 0);
}

static void test_threads(void **unused) {
    (void)unused;
    int count;
    uint64_t first = heap(1, 0.4, &count);
    for (int threads = 2; threads <= 3; threads++) {
        assert_true(heap(threads, 0.4, &count) == first);
    }
}

int main(int argc, char **argv) {
    (void)argc;
    parallel_fix_environment(argv); /* threads of BLAS that spin cost more than the tests */
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradient),   cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_definite),   cmocka_unit_test(test_clamp),
        cmocka_unit_test(test_incline),    cmocka_unit_test(test_stop),
        cmocka_unit_test(test_rest_gap),   cmocka_unit_test(test_overhang),
        cmocka_unit_test(test_tunnelling), cmocka_unit_test(test_heap),
        cmocka_unit_test(test_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
