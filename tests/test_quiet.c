/* The proof that nothing can touch (quiet.h), against the distances of all features. */
#include <string.h>

#include "sim/base/hash.h"
#include "sim/contact/engine.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

#define STEP 1e-4 /* [s] */
#define NODES 25
#define CHECKS 25 /* of all distances, over the whole time */

/* a cloth whose motion the test prescribes */
typedef struct Rig {
    Bench bench;
    Motion rest;
    ContactObstacle ball;
    ContactDef def;
    ContactMemory memory;
    Lanes lanes;
    int *slot;
    unsigned char *held;
    double *from;
    Contact *contact;
} Rig;

static int rig_count(const Rig *r) { return r->def.vertex_count; }

static double rig_fastest(void *owner) {
    const Rig *r = owner;
    double most = 0.0;
    for (int i = 0; i < rig_count(r); i++) {
        Vec3 v = {r->lanes.v[0][i], r->lanes.v[1][i], r->lanes.v[2][i]};
        most = fmax(most, vec3_length(v));
    }
    return most;
}

static Vec3 rig_place(const Rig *r, int i) {
    return vec3(r->lanes.x[0][i], r->lanes.x[1][i], r->lanes.x[2][i]);
}

static void rig_mark(void *owner) {
    Rig *r = owner;
    for (int i = 0; i < rig_count(r); i++) {
        vec3_store(r->from + 3 * i, rig_place(r, i));
    }
}

static double rig_spread(void *owner) {
    const Rig *r = owner;
    const SurfacePanel *panel = &r->def.panels[0];
    double most = 0.0;
    for (int i = 0; i < rig_count(r); i++) {
        int column = i % panel->nu, right = column + 1 < panel->nu ? i + 1 : i - column;
        int next[2] = {panel->wrap || column + 1 < panel->nu ? right : i, i + panel->nu};
        for (int k = 0; k < 2; k++) {
            if (next[k] < rig_count(r)) {
                Vec3 a = vec3_sub(rig_place(r, i), vec3_load(r->from + 3 * i));
                Vec3 b = vec3_sub(rig_place(r, next[k]), vec3_load(r->from + 3 * next[k]));
                most = fmax(most, vec3_length(vec3_sub(a, b)));
            }
        }
    }
    return most;
}

/* a sheet or a sleeve of 24 cm, and a ball of 2 cm at `centre` */
static void rig_make(Rig *r, bool sleeve, Vec3 centre) {
    memset(r, 0, sizeof *r);
    Fabric fabric = cloths_fabric(0.15, 1000.0, 0.3, 1e-5, 0.0);
    r->bench.cloth = sleeve ? cloths_sleeve(0.24 / 6.2831853, 0.04, 48, 13, true, fabric)
                            : cloths_rectangle(0.24, 0.24, NODES, NODES, fabric);
    r->bench.scene = cloths_scene(&r->bench.cloth);
    r->bench.scene.solver.self_contact = true;
    bench_build(&r->bench, 0);
    Arena *arena = &r->bench.arena;
    r->ball = (ContactObstacle){.solid = {SOLID_SPHERE, {0.02, 0.02, 0.02}, 0.02},
                                .start = pose_identity(),
                                .motion = &r->rest};
    r->ball.start.shift = centre;
    r->def = r->bench.system.contact;
    r->def.obstacle_count = 1;
    r->def.obstacles = &r->ball;
    r->lanes = lanes_create(rig_count(r), arena);
    r->slot = arena_push(arena, int, rig_count(r));
    r->held = arena_push(arena, unsigned char, rig_count(r));
    r->from = arena_push(arena, double, 3 * rig_count(r));
    r->memory = (ContactMemory){.poses = arena_push(arena, Pose, 1),
                                .clocks = arena_push(arena, double, 1),
                                .bristles = arena_push(arena, double, 3 * rig_count(r)),
                                .pairs = arena_push(arena, PairMemory, 1)};
    r->memory.poses[0] = r->ball.start;
    for (int i = 0; i < rig_count(r); i++) {
        r->slot[i] = i;
        for (int a = 0; a < 3; a++) {
            r->lanes.x[a][i] = r->def.start[3 * i + a];
        }
    }
    r->contact = contact_create(&r->def, arena);
}

static bool rig_begin(Rig *r) {
    ContactMotion motion = {rig_fastest, rig_mark, rig_spread, r};
    contact_begin(r->contact, (ContactView){&r->lanes, r->slot, r->held, motion}, &r->memory, STEP);
    return r->contact->quiet.holds;
}

/* [m] least distance of any two features without a common vertex, and of any vertex to the ball, less the
 * contact distance */
static double rig_apart(Rig *r) {
    const Surface *s = &r->contact->surface;
    double least = INFINITY;
    contact_gather(r->contact);
    Points x = contact_positions(r->contact);
    for (int v = 0; v < rig_count(r); v++) {
        least = fmin(least, vec3_length(vec3_sub(rig_place(r, v), r->ball.start.shift)) - 0.02);
        for (int t = 0; t < s->triangle_count; t++) {
            const int *c = s->triangles + 3 * (size_t)t;
            if (v != c[0] && v != c[1] && v != c[2]) {
                Pair pair = {.kind = PAIR_FACE, .place = {v, c[0], c[1], c[2]}};
                pair_evaluate(&x, &pair);
                least = fmin(least, pair.distance);
            }
        }
    }
    for (int a = 0; a < s->edge_count; a++) {
        for (int b = a + 1; b < s->edge_count; b++) {
            const int *p = s->edges + 2 * (size_t)a, *q = s->edges + 2 * (size_t)b;
            if (p[0] != q[0] && p[0] != q[1] && p[1] != q[0] && p[1] != q[1]) {
                Pair pair = {.kind = PAIR_EDGES, .place = {p[0], p[1], q[0], q[1]}};
                pair_evaluate(&x, &pair);
                least = fmin(least, pair.distance);
            }
        }
    }
    return least - r->def.distance;
}

typedef Vec3 Programme(const Rig *rig, int node, double time);

/* Steps along a programme while the proof holds; returns the time when it ended, or `seconds`.
 * *least [m]: how near anything was to touching while it held; *proofs: how many were needed. */
static double rig_play(Rig *r, Programme *programme, double seconds, double *least) {
    double time = 0.0;
    *least = INFINITY;
    assert_true(rig_begin(r));
    for (int step = 0; time < seconds; step++, time = step * STEP) {
        for (int i = 0; i < rig_count(r); i++) {
            Vec3 v = vec3_sub(programme(r, i, time + STEP), rig_place(r, i));
            r->lanes.v[0][i] = v.x / STEP, r->lanes.v[1][i] = v.y / STEP;
            r->lanes.v[2][i] = v.z / STEP;
        }
        contact_forces(r->contact, STEP, 1.0, time + STEP);
        contact_clear(r->contact, vec3(0, 0, 0));
        contact_guard(r->contact, STEP);
        if (!r->contact->quiet.holds) {
            break;
        }
        for (int i = 0; i < rig_count(r); i++) {
            Vec3 p = programme(r, i, time + STEP);
            r->lanes.x[0][i] = p.x, r->lanes.x[1][i] = p.y, r->lanes.x[2][i] = p.z;
        }
        contact_drifted(r->contact, rig_fastest(r), STEP);
        assert_false(contact_statistics(r->contact)->rejected);
        *least = step % (int)(seconds / STEP / CHECKS) == 0 ? fmin(*least, rig_apart(r)) : *least;
    }
    *least = fmin(*least, rig_apart(r));
    return time;
}

/* material place from the middle, and noise that grows */
static Vec3 material(const Rig *r, int node) {
    return vec3_sub(vec3_load(r->def.start + 3 * node),
                    vec3_load(r->def.start + 3 * (NODES * NODES / 2)));
}

static Vec3 shaken(Vec3 p, int node, double size) {
    uint64_t k = 3 * (uint64_t)node;
    Vec3 noise = {hash_random(4, k), hash_random(4, k + 1), hash_random(4, k + 2)};
    return vec3_axpy(p, size, noise);
}

/* an arc of `turns` whole turns at 1 s, which would close at one turn */
static Vec3 roll(const Rig *r, int node, double time) {
    Vec3 m = material(r, node);
    double bend = 6.2831853 * (time + 1e-3) / 0.24, angle = bend * m.x;
    Vec3 p = {sin(angle) / bend, m.y, (1.0 - cos(angle)) / bend};
    return shaken(p, node, 5e-4 * time);
}

static void test_roll(void **unused) {
    (void)unused;
    Rig r;
    double least;
    rig_make(&r, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, roll, 2.0, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.8 - time, 0.0); /* whatever is bent by less than that cannot touch */
    CHECK_AT_MOST(time, 1.0);
    arena_free(&r.bench.arena);
}

/* both halves fold up, to a sharp crease */
static Vec3 fold(const Rig *r, int node, double time) {
    Vec3 m = material(r, node);
    double angle = 1.5707963 * time;
    return vec3(m.x * cos(angle), m.y, fabs(m.x) * sin(angle));
}

static void test_fold(void **unused) {
    (void)unused;
    Rig r;
    double least;
    rig_make(&r, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, fold, 1.0, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(time, 1.0);
    CHECK_AT_MOST(0.3 - time, 0.0);
    arena_free(&r.bench.arena);
}

/* shaken ever more, until neighbours meet */
static Vec3 crumple(const Rig *r, int node, double time) {
    return shaken(material(r, node), node, 0.02 * time);
}

static void test_crumple(void **unused) {
    (void)unused;
    Rig r;
    double least;
    rig_make(&r, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, crumple, 1.0, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.04 - time, 0.0);
    CHECK_AT_MOST(time, 0.5);
    arena_free(&r.bench.arena);
}

/* a sleeve that is squeezed flat */
static Vec3 squeeze(const Rig *r, int node, double time) {
    Vec3 p = vec3_load(r->def.start + 3 * node);
    return vec3((1.0 + 0.3 * time) * p.x, (1.0 - time) * p.y, p.z);
}

static void test_squeeze(void **unused) {
    (void)unused;
    Rig r;
    double least;
    rig_make(&r, true, vec3(0, 0, -1.0));
    double time = rig_play(&r, squeeze, 1.0, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.2 - time, 0.0);
    CHECK_AT_MOST(time, 1.0);
    arena_free(&r.bench.arena);
}

/* thrown at the ball: the proof ends some steps before it */
static Vec3 throw(const Rig *r, int node, double time) {
    Vec3 m = material(r, node);
    m.z -= 5.0 * time;
    return m;
}

static void test_throw(void **unused) {
    (void)unused;
    Rig r;
    double least;
    rig_make(&r, false, vec3(0.013, 0.007, -0.3));
    double time = rig_play(&r, throw, 1.0, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.05 - time, 0.0); /* 28 cm away at 5 m/s: touches at 0.056 s */
    CHECK_AT_MOST(time, 0.056);
    arena_free(&r.bench.arena);
}

/* what leaps after the proof was asked is told so */
static void test_leap(void **unused) {
    (void)unused;
    Rig r;
    rig_make(&r, false, vec3(0.013, 0.007, -0.3));
    assert_true(rig_begin(&r));
    double speed[3] = {1e-3, 1e-3, 0.3 / STEP};
    for (int step = 0; step < 3; step++) {
        contact_forces(r.contact, STEP, 1.0, (step + 1) * STEP);
        contact_clear(r.contact, vec3(0, 0, 0));
        contact_guard(r.contact, STEP);
        assert_true(r.contact->quiet.holds);
        contact_drifted(r.contact, speed[step], STEP);
        assert_int_equal(contact_statistics(r.contact)->rejected, step == 2);
    }
    arena_free(&r.bench.arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_roll),    cmocka_unit_test(test_fold),
        cmocka_unit_test(test_crumple), cmocka_unit_test(test_squeeze),
        cmocka_unit_test(test_throw),   cmocka_unit_test(test_leap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
