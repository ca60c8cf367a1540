/* The proof that nothing can touch (quiet.h), against the distances of all features. */
#include <string.h>

#include "sim/base/hash.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/play.h"
#include "tests/support/rig.h"
#include "tests/support/strips.h"

#define NODES 25
#define CHECKS 25 /* of all distances, over the whole time */

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
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, roll, 2.0, CHECKS, &least);
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
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, fold, 1.0, CHECKS, &least);
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
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, crumple, 1.0, CHECKS, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.04 - time, 0.0);
    CHECK_AT_MOST(time, 0.5);
    arena_free(&r.bench.arena);
}

/* A hairpin: five cells turn by up to 175 degrees at 1 s, the rest stays flat. Sharper than blocks of
 * cells can prove. */
static Vec3 hairpin(const Rig *r, int node, double time) {
    Vec3 m = material(r, node);
    double half = 0.025, bend = 0.5 * 3.05 * (time + 1e-3) / half, u = fabs(m.x);
    double angle = bend * fmin(u, half), over = fmax(u - half, 0.0);
    double x = sin(angle) / bend + over * cos(angle), z = (1.0 - cos(angle)) / bend;
    return vec3(copysign(x, m.x), m.y, z + over * sin(angle));
}

static void test_hairpin(void **unused) {
    (void)unused;
    Rig r;
    double least;
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, hairpin, 1.0, CHECKS, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.95 - time, 0.0);
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
    rig_make(&r, NODES, true, vec3(0, 0, -1.0));
    double time = rig_play(&r, squeeze, 1.0, CHECKS, &least);
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
    rig_make(&r, NODES, false, vec3(0.013, 0.007, -0.3));
    double time = rig_play(&r, throw, 1.0, CHECKS, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.05 - time, 0.0); /* 28 cm away at 5 m/s: touches at 0.056 s */
    CHECK_AT_MOST(time, 0.056);
    arena_free(&r.bench.arena);
}

/* all of it at 30 m/s: that says nothing about neighbours, whose velocities are looked at */
static Vec3 fly(const Rig *r, int node, double time) {
    Vec3 m = material(r, node);
    m.x += 30.0 * time;
    return m;
}

static void test_fly(void **unused) {
    (void)unused;
    Rig r;
    double least;
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    double time = rig_play(&r, fly, 0.02, CHECKS, &least);
    CHECK_AT_MOST(-least, 0.0);
    CHECK_AT_MOST(0.02 - time, 0.0);
    arena_free(&r.bench.arena);
}

/* A fold that closes in flight, of cloth whose neighbours the drift does not look at: a new proof knows how slow
 * they are against each other, the drift of the same step does not. */
static Vec3 fold_in_flight(const Rig *r, int node, double time) {
    Vec3 p = hairpin(r, node, 0.85 + time);
    p.x += 30.0 * time;
    return p;
}

static void test_unframed(void **unused) {
    (void)unused;
    for (int fold = 0; fold < 2; fold++) {
        Rig r;
        double least;
        rig_make(&r, NODES, false, vec3(0, 0, -1.0));
        r.unframed = true;
        double time = rig_play(&r, fold ? fold_in_flight : fly, 0.05, CHECKS, &least);
        CHECK_AT_MOST(-least, 0.0);
        CHECK_AT_MOST(0.01 - time, 0.0);
        arena_free(&r.bench.arena);
    }
}

/* A close bound that was asked for goes on being asked for while cloth slows down. */
static void test_close(void **unused) {
    (void)unused;
    Rig r;
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    assert_true(rig_begin(&r));
    for (int step = 0; step < 3; step++) {
        double speed = step == 1 ? 30.0 : 0.1;
        contact_forces(r.contact, RIG_STEP, 1.0, (step + 1) * RIG_STEP);
        contact_clear(r.contact, vec3(0, 0, 0));
        r.contact->quiet.speeds.fastest = speed;
        contact_guard(r.contact, RIG_STEP);
        assert_int_equal(contact_asks_relative(r.contact), step > 0);
        contact_drifted(r.contact, &(ContactSpeeds){speed, 2.0 * speed, 0.01}, RIG_STEP);
    }
    arena_free(&r.bench.arena);
}

/* At 30 m/s one node leaves the others in a single step, across its neighbours */
static void test_tear(void **unused) {
    (void)unused;
    Rig r;
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    for (int i = 0; i < rig_count(&r); i++) {
        r.lanes.v[0][i] = 30.0;
    }
    assert_true(rig_begin(&r));
    for (int step = 0; step < 2; step++) {
        r.lanes.v[1][NODES * NODES / 2] = step == 0 ? 0.0 : 0.012 / RIG_STEP;
        contact_forces(r.contact, RIG_STEP, 1.0, (step + 1) * RIG_STEP);
        contact_clear(r.contact, vec3(0, 0, 0));
        contact_guard(r.contact, RIG_STEP);
        assert_int_equal(r.contact->quiet.holds, step == 0);
        contact_drifted(r.contact, &(ContactSpeeds){125.0, 250.0, 250.0}, RIG_STEP);
    }
    arena_free(&r.bench.arena);
}

/* blocks of any size, of places by lot */
static void lay_blocks(SlopeBlocks *blocks, SlopeFit *fit) {
    slope_blocks_begin(blocks, fit);
    for (int k = 0; k < SLOPE_BATCH; k++) {
        int cells[2] = {1 + k % SURFACE_BLOCK, 1 + k / SURFACE_BLOCK % SURFACE_BLOCK};
        blocks->cells[0][k] = (float)cells[0], blocks->cells[1][k] = (float)cells[1];
        for (int n = 0; n < 3 * SLOPE_NODES * SLOPE_NODES; n++) {
            int a = n % 3, m = n / 3 / SLOPE_NODES, c = n / 3 % SLOPE_NODES;
            int i = c < cells[0] ? c : cells[0], j = m < cells[1] ? m : cells[1];
            int node = SLOPE_BATCH * (3 * (SLOPE_NODES * j + i) + a) + k;
            blocks->node[m][c][a][k] = (float)hash_random(7, (uint64_t)node);
        }
    }
}

/* numbers of many blocks, by lot */
static SlopeField lay_field(Arena *arena, uint64_t seed) {
    int room = 4 * SLOPE_BATCH;
    SlopeField field = slope_field_create(room, arena);
    for (int k = 0; k < SLOPE_ROWS * room; k++) {
        field.row[k / room][k % room] = (float)hash_random(seed, (uint64_t)k);
    }
    return field;
}

static void check_same(const SlopeField *a, const SlopeField *b) {
    for (int r = 0; r < SLOPE_ROWS; r++) {
        assert_memory_equal(a->row[r], b->row[r], sizeof(SlopeRow));
    }
}

static void check_pack(const SlopeKernel *kernel) {
    SlopeRow packed[SURFACE_BLOCK] = {{0.0f}};
    double x[3 * SLOPE_BATCH];
    int count = SLOPE_BATCH - 3;
    for (int i = 0; i < 3 * SLOPE_BATCH; i++) {
        x[i] = hash_random(9, (uint64_t)i);
    }
    kernel->pack(x, 0.25, count, (float *[]){packed[0], packed[1], packed[2]});
    for (int i = 0; i < 3 * SLOPE_BATCH; i++) {
        CHECK_NEAR((double)packed[i % 3][i / 3], i / 3 < count ? x[i] - 0.25 : 0.0, 1e-7);
    }
}

/* the same bits for every width */
static void test_widths(void **unused) {
    (void)unused;
    Arena arena = {0};
    SlopeBlocks blocks;
    SlopeFit first = {.h = {0.5, 0.7}, .origin = {1.0, 2.0, 3.0}};
    SlopeField fine = lay_field(&arena, 8), first_joined = slope_field_create(SLOPE_BATCH, &arena);
    SlopeRow first_window;
    lay_blocks(&blocks, &first);
    for (int width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
        if (!vector_runs_here((VectorWidth)width)) {
            continue;
        }
        const SlopeKernel *kernel = quiet_blocks_kernel((VectorWidth)width);
        SlopeFit fit = first;
        SlopeField joined = slope_field_create(SLOPE_BATCH, &arena);
        SlopeRow window;
        fit.slopes = slope_field_create(SLOPE_BATCH, &arena);
        kernel->fit(&fit);
        kernel->join(&fine, 1, 12, &joined, 0);
        kernel->window(&fine, 12, 0, window);
        check_pack(kernel);
        if (width == VECTOR_SCALAR) {
            first = fit, first_joined = joined;
            memcpy(first_window, window, sizeof window);
        }
        check_same(&fit.slopes, &first.slopes);
        check_same(&joined, &first_joined);
        assert_memory_equal(fit.low, first.low, sizeof fit.low);
        assert_memory_equal(fit.high, first.high, sizeof fit.high);
        assert_memory_equal(window, first_window, sizeof window);
    }
    arena_free(&arena);
}

/* [m] of the certificate for the leaves from one to another: the least distance / distance at rest of two of
 * their nodes is not below it */
static void check_rectangle(Rig *r, const QuietLevel *level, int i0, int j0, int i1, int j1) {
    const SurfacePanel *panel = &r->def.panels[0];
    Slopes slopes[4];
    const Slopes *part[4];
    int count = 0;
    for (int j = j0; j <= j1; j++) {
        for (int i = i0; i <= i1; i++) {
            slopes[count] = quiet_slopes_at(level, i, j);
            part[count] = &slopes[count];
            count++;
        }
    }
    double least = INFINITY;
    int right = 3 * i1 + 3 < panel->nu ? 3 * i1 + 3 : panel->nu - 1;
    int top = 3 * j1 + 3 < panel->nv ? 3 * j1 + 3 : panel->nv - 1;
    for (int j = 3 * j0; j <= top; j++) {
        for (int i = 3 * i0; i <= right; i++) {
            for (int n = 3 * j0; n <= top; n++) {
                for (int m = 3 * i0; m <= right; m++) {
                    double rest = hypot((m - i) * panel->h1, (n - j) * panel->h2);
                    Vec3 d =
                        vec3_sub(rig_place(r, n * panel->nu + m), rig_place(r, j * panel->nu + i));
                    least = rest > 0.0 ? fmin(least, vec3_length(d) / rest) : least;
                }
            }
        }
    }
    CHECK_AT_MOST(slopes_least(part, count) - least, 0.0);
    if (i1 > i0 && j1 > j0) { /* row loops say the same, a little less closely */
        double window = quiet_blocks_window(r->contact->quiet.kernel, level, i0, j0);
        CHECK_AT_MOST(window - least, 0.0);
        CHECK_NEAR(window, slopes_least(part, count), 2e-5);
    }
}

/* a block turned about v by `angle`, whose slopes leave its plane by half */
static Slopes turned(double angle) {
    Vec3 normal = vec3(-sin(angle), 0, cos(angle));
    return (Slopes){{vec3(cos(angle), 0, sin(angle)), vec3(0, 1, 0)}, normal, 0.0, 0.5};
}

static void field_put(SlopeField *field, int block, const Slopes *from) {
    const Vec3 rows[3] = {from->mean[0], from->mean[1], from->normal};
    for (int k = 0; k < 3; k++) {
        field->row[3 * k][block] = (float)rows[k].x,
                       field->row[3 * k + 1][block] = (float)rows[k].y;
        field->row[3 * k + 2][block] = (float)rows[k].z;
    }
    field->row[SLOPE_FLAT][block] = (float)from->flat;
    field->row[SLOPE_STEEP][block] = (float)from->steep;
}

static Slopes turned_join(const Slopes *a, const Slopes *b, Arena *arena) {
    SlopeField fine = slope_field_create(2 * SLOPE_BATCH, arena);
    SlopeField both = slope_field_create(SLOPE_BATCH, arena);
    field_put(&fine, 0, a);
    field_put(&fine, 1, b);
    quiet_blocks_kernel(vector_best())->join(&fine, 0, 0, &both, 0);
    return slope_field_at(&both, 0);
}

/* Three blocks, of which two are joined: no mean of their extreme slopes is shorter than is said. */
static void test_turned(void **unused) {
    (void)unused;
    Arena arena = {0};
    for (int turn = 0; turn < 8; turn++) {
        Slopes block[3] = {turned(0.0), turned(0.2 * turn), turned(-0.1 * turn)};
        const Slopes *part[3] = {&block[0], &block[1], &block[2]};
        Slopes both = turned_join(part[0], part[1], &arena);
        const Slopes *joined[2] = {&both, &block[2]};
        double least = INFINITY;
        for (int signs = 0; signs < 8; signs++) {
            Vec3 du[3];
            for (int k = 0; k < 3; k++) {
                double sign = signs >> k & 1 ? 0.5 : -0.5;
                du[k] = vec3_axpy(block[k].mean[0], sign, block[k].normal);
            }
            for (int a = 0; a <= 20; a++) {
                for (int b = 0; a + b <= 20; b++) {
                    Vec3 mean = vec3_scale(0.05 * a, du[0]);
                    mean = vec3_axpy(vec3_axpy(mean, 0.05 * b, du[1]), 1.0 - 0.05 * (a + b), du[2]);
                    least = fmin(least, vec3_length(mean));
                }
            }
        }
        CHECK_AT_MOST(slopes_least(part, 3) - least, 1e-12);
        CHECK_AT_MOST(slopes_least(joined, 2) - least, 1e-12);
        CHECK_AT_MOST(0.5 - 0.2 * turn - slopes_least(part, 3), 0.0); /* and not much longer */
    }
    arena_free(&arena);
}

static void test_slopes(void **unused) {
    (void)unused;
    Rig r;
    rig_make(&r, NODES, false, vec3(0, 0, -1.0));
    assert_true(rig_begin(&r));
    Contact *c = r.contact;
    QuietPanel *panel = &c->quiet.panels[0];
    QuietView view = {&c->surface, r.lanes.x, r.slot, rig_count(&r), c->x, c->quiet.kernel};
    for (int turn = 0; turn < 6; turn++) {
        for (int i = 0; i < rig_count(&r); i++) {
            Vec3 p = shaken(roll(&r, i, 0.3 * turn), i, 1e-3 * turn);
            r.lanes.x[0][i] = p.x, r.lanes.x[1][i] = p.y, r.lanes.x[2][i] = p.z;
        }
        quiet_blocks_fit(&view, panel, 0);
        const QuietLevel *level = &panel->level[0];
        for (int j = 0; j < level->along; j++) {
            for (int i = 0; i < level->across; i++) {
                int right = i + 1 < level->across ? i + 1 : i,
                    top = j + 1 < level->along ? j + 1 : j;
                check_rectangle(&r, level, i, j, i, j);
                check_rectangle(&r, level, i, j, right, top);
            }
        }
    }
    arena_free(&r.bench.arena);
}

/* A proof goes on in the next interval where positions are the same, with what it has used of its rooms,
 * unless there are obstacles. */
static void test_continues(void **unused) {
    (void)unused;
    for (int k = 0; k < 4; k++) {
        Rig r;
        double least, path;
        rig_make(&r, NODES, false, vec3(0, 0, -1.0));
        r.def.obstacle_count = k & 1;
        rig_play(&r, fly, 0.005, CHECKS, &least);
        path = r.contact->quiet.far_path;
        contact_end(r.contact, &r.memory);
        r.continues = k & 2;
        assert_true(rig_begin(&r));
        bool goes_on = k == 2;
        assert_true((r.contact->quiet.far_path == path) == goes_on);
        assert_true((r.contact->quiet.proven < 0.0) == goes_on);
        arena_free(&r.bench.arena);
    }
}

/* lattices that no sweep moves are looked at too: a sheet that hangs by two corners, thrown at 100 m/s */
static void test_thrown_models(void **unused) {
    static const char *const models[] = {"springs", "triangles", "particles"};
    (void)unused;
    for (int k = 0; k < 3; k++) {
        Play play;
        char text[640];
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 120, seconds: 1}\ncloth:\n  sheet:\n    model: %s\n"
                 "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    nodes: 16 x 16\n"
                 "    fabric: {weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.2, "
                 "bending: 1e-5 N m}}\n    damping: 5 1/s\n"
                 "handles: [{hold: [sheet.top-left, sheet.top-right]}]\n"
                 "solver: {stepper: central}\n",
                 models[k]);
        play_start(&play, text);
        for (int i = 0; i < play.sim.system.node_count; i++) {
            play.sim.state.v[3 * i + 2] = 100.0;
        }
        long crossings = 0;
        while (play.sim.state.time < 0.1 - 1e-9) {
            play_to(&play, play.sim.state.time + 1.0 / 120);
            crossings += system_crossings(&play.sim.system, &play.sim.state);
        }
        CHECK_AT_MOST((double)crossings, 0.0);
        play_end(&play);
    }
}

/* Swings about its upper edge, in waves along it and across that grow until they meet; every programme has waves
 * of its own. */
static uint64_t waves_of;

static Vec3 waves(const Rig *r, int node, double time) {
    Vec3 p = vec3_load(r->def.start + 3 * node);
    double grown = 6.0 * time * time;
    Vec3 out = vec3(p.x, p.y, 0.0);
    for (uint64_t k = 0; k < 6; k++) {
        uint64_t n = 16 * waves_of + 2 * k;
        double across = 6.2831853 * hash_random(11, n) * (double)(k + 1) / 0.24;
        double along = 6.2831853 * hash_random(12, n) * (double)(k + 1) / 0.24;
        double turn = 30.0 * hash_random(13, n) * time + 6.0 * hash_random(14, n);
        double size = grown * 0.04 * hash_random(15, n) / (double)(k + 1);
        double wave = size * sin(across * p.x + along * p.y + turn);
        out = vec3_axpy(out, wave, vec3(hash_random(16, n), hash_random(17, n), 1.0));
    }
    double swing = 2.0 * sin(8.0 * time) * hash_random(18, waves_of), y = out.y - 0.12;
    return vec3(out.x, y * cos(swing) - out.z * sin(swing), y * sin(swing) + out.z * cos(swing));
}

/* Proofs that are ahead of the cloth: it is apart while they hold, and they last until it is not far from
 * touching. */
static void test_ahead(void **unused) {
    (void)unused;
    int ahead = 0;
    double soonest = INFINITY;
    for (waves_of = 0; waves_of < 6; waves_of++) {
        Rig r;
        double least;
        rig_make(&r, 13, false, vec3(0, 0, -1.0));
        r.def.obstacle_count = 0;
        double time = rig_play(&r, waves, 1.0, 60, &least);
        CHECK_AT_MOST(-least, 0.0);
        soonest = fmin(soonest, time);
        ahead += r.ahead;
        arena_free(&r.bench.arena);
    }
    assert_true(ahead > 40);
    CHECK_AT_MOST(0.2 - soonest, 0.0);
}

/* what leaps after the proof was asked is told so */
static void test_leap(void **unused) {
    (void)unused;
    Rig r;
    rig_make(&r, NODES, false, vec3(0.013, 0.007, -0.3));
    assert_true(rig_begin(&r));
    ContactSpeeds slow = {1e-3, 2e-3, 2e-3},
                  fast = {0.3 / RIG_STEP, 0.6 / RIG_STEP, 0.6 / RIG_STEP};
    for (int step = 0; step < 3; step++) {
        contact_forces(r.contact, RIG_STEP, 1.0, (step + 1) * RIG_STEP);
        contact_clear(r.contact, vec3(0, 0, 0));
        contact_guard(r.contact, RIG_STEP);
        assert_true(r.contact->quiet.holds);
        contact_drifted(r.contact, step < 2 ? &slow : &fast, RIG_STEP);
        assert_int_equal(contact_statistics(r.contact)->rejected, step == 2);
    }
    arena_free(&r.bench.arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_roll),    cmocka_unit_test(test_fold),
        cmocka_unit_test(test_crumple), cmocka_unit_test(test_squeeze),
        cmocka_unit_test(test_throw),   cmocka_unit_test(test_thrown_models),
        cmocka_unit_test(test_leap),    cmocka_unit_test(test_hairpin),
        cmocka_unit_test(test_fly),     cmocka_unit_test(test_tear),
        cmocka_unit_test(test_widths),  cmocka_unit_test(test_slopes),
        cmocka_unit_test(test_turned),  cmocka_unit_test(test_continues),
        cmocka_unit_test(test_close),   cmocka_unit_test(test_unframed),
        cmocka_unit_test(test_ahead),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
