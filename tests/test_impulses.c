/* Contact by impulses: what one impulse and one zone do, friction with known answers, impacts, heaps,
 * the same bits. Formulas: sim/contact/impulses.h, impact_zone.h. */
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "sim/contact/impulses.h"
#include "tests/support/check.h"
#include "tests/support/contacts.h"
#include "tests/support/folder.h"
#include "tests/support/play.h"
#include "tests/support/resume.h"

#define G 9.80665
#define FABRIC CONTACTS_FABRIC
#define SOLVER "solver: {stepper: central, contact: impulses}\n"

static Vec3 random_vector(uint64_t seed, double size) {
    return vec3_scale(size, vec3(hash_random(seed, 0), hash_random(seed, 1), hash_random(seed, 2)));
}

/* ---- one strike ---- */

/* Four free vertices of unlike masses, one triangle and a point, without lists. */
typedef struct Bodies {
    Contact contact;
    ContactDef def;
    Impulses impulses;
    Toll tolls[4];
    double v[12], weight[4];
    unsigned char held[4], flags[2][4];
    int lists[2][4];
    Vec3 kicked[4];
} Bodies;

static void bodies_start(Bodies *b, uint64_t seed) {
    *b = (Bodies){.def = {.vertex_count = 4}};
    b->contact = (Contact){.def = &b->def,
                           .impulses = &b->impulses,
                           .v = b->v,
                           .weight_kept = b->weight,
                           .held = b->held,
                           .tolls = b->tolls,
                           .changed = b->lists[0],
                           .is_touched = b->flags[0],
                           .is_changed = b->flags[1],
                           .kicked = b->kicked};
    b->impulses.changed = b->lists[1];
    for (uint64_t i = 0; i < 4; i++) {
        vec3_store(b->v + 3 * i, random_vector(100 * seed + i, 10.0));
        b->weight[i] = pow(10.0, 2.0 * hash_random(100 * seed + i, 7)); /* 1/kg, 1e-2 .. 1e2 */
    }
}

static Strike random_strike(uint64_t seed, double friction) {
    double a = 0.5 + 0.5 * hash_random(seed, 20), b = 0.5 + 0.5 * hash_random(seed, 21);
    return (Strike){.count = 4,
                    .place = {0, 1, 2, 3},
                    .weight = {1.0, -a * b, -a * (1.0 - b), a - 1.0},
                    .normal = vec3_unit(random_vector(seed + 5000, 1.0), vec3(0, 0, 1)),
                    .friction = friction,
                    .obstacle = -1};
}

static Vec3 apart(const Bodies *b, const Strike *s) {
    Vec3 v = {0, 0, 0};
    for (int a = 0; a < s->count; a++) {
        v = vec3_axpy(v, s->weight[a], vec3_load(b->v + 3 * s->place[a]));
    }
    return v;
}

static Vec3 momentum(const Bodies *b) {
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < 4; i++) {
        sum = vec3_axpy(sum, 1.0 / b->weight[i], vec3_load(b->v + 3 * i));
    }
    return sum;
}

static double kinetic(const Bodies *b) {
    double sum = 0.0;
    for (int i = 0; i < 4; i++) {
        Vec3 v = vec3_load(b->v + 3 * i);
        sum += 0.5 / b->weight[i] * vec3_dot(v, v);
    }
    return sum;
}

/* one impulse leaves v_N = 0, whatever the masses; momentum stays, energy falls, and
 * friction takes at most mu times what v_N gained off the sliding, along it */
static void test_strike(void **unused) {
    (void)unused;
    double left = 0.0, drift = 0.0, gain = 0.0, cone = 0.0, turned = 0.0, slid = 0.0;
    for (uint64_t k = 0; k < 2000; k++) {
        Bodies b;
        bodies_start(&b, k);
        Strike s = random_strike(k, 0.3 * (double)(k % 4));
        Vec3 before = apart(&b, &s), start = momentum(&b);
        double energy = kinetic(&b), vn = vec3_dot(before, s.normal);
        double grown = impulses_stop(&b.contact, &s, 0.0);
        Vec3 stopped = apart(&b, &s);
        double now = vec3_dot(stopped, s.normal);
        left = fmax(left, fabs(now - fmax(vn, 0.0)) / 10.0);
        CHECK_NEAR(grown, fmax(-vn, 0.0), 1e-12);
        impulses_rub(&b.contact, &s, grown);
        Vec3 after = apart(&b, &s), sliding = vec3_axpy(stopped, -now, s.normal);
        Vec3 rest = vec3_axpy(after, -vec3_dot(after, s.normal), s.normal);
        double speed = vec3_length(sliding), expected = fmax(0.0, speed - s.friction * grown);
        cone = fmax(cone, fabs(vec3_length(rest) - expected) / 10.0);
        turned = fmax(turned, vec3_length(vec3_cross(rest, sliding)) / (speed * 10.0));
        slid = fmax(slid, fabs(vec3_dot(after, s.normal) - now) / 10.0);
        drift = fmax(drift, vec3_length(vec3_sub(momentum(&b), start)) / vec3_length(start));
        gain = fmax(gain, kinetic(&b) / energy - 1.0);
    }
    CHECK_AT_MOST(left, 1e-14);
    CHECK_AT_MOST(cone, 1e-13);
    CHECK_AT_MOST(turned, 1e-13);
    CHECK_AT_MOST(slid, 1e-13);
    CHECK_AT_MOST(drift, 1e-12);
    CHECK_AT_MOST(gain, 1e-14);
}

/* what a handle holds is not moved, and gets no friction */
static void test_strike_held(void **unused) {
    (void)unused;
    Bodies b;
    bodies_start(&b, 3);
    b.held[1] = b.held[2] = b.held[3] = 1;
    double kept[12];
    memcpy(kept, b.v, sizeof kept);
    Strike s = random_strike(3, 0.5);
    s.normal = vec3_unit(vec3_scale(-1.0, apart(&b, &s)), vec3(0, 0, 1));
    double grown = impulses_stop(&b.contact, &s, 0.0);
    CHECK_AT_MOST(0.1, grown);
    CHECK_NEAR(vec3_length(apart(&b, &s)), 0.0, 1e-13); /* it approached along the normal */
    assert_memory_equal(b.v + 3, kept + 3, 9 * sizeof(double));
    b.held[0] = 1;
    vec3_store(b.v, vec3_load(kept));
    assert_true(impulses_stop(&b.contact, &s, 0.0) == 0.0);
}

/* ---- one zone ---- */

#define MOST 40

typedef struct Swarm {
    int count;
    double mass[MOST];
    Vec3 x[MOST], v[MOST];
} Swarm;

typedef enum SwarmShape { SWARM_CLOUD, SWARM_FLAT, SWARM_LINE, SWARM_PAIR, SWARM_POINT } SwarmShape;

static Swarm swarm(uint64_t seed, SwarmShape shape) {
    Swarm s = {.count = shape == SWARM_PAIR ? 2 : shape == SWARM_POINT ? 1 : 4 + (int)(seed % 37)};
    Vec3 a = random_vector(seed + 77, 1.0), b = random_vector(seed + 78, 1.0);
    for (int i = 0; i < s.count; i++) {
        uint64_t k = 1000 * seed + (uint64_t)i;
        double p = hash_random(k, 11), q = hash_random(k, 12);
        s.x[i] = vec3_add(vec3(3, 1, -2), shape == SWARM_CLOUD  ? random_vector(k + 1, 0.05)
                                          : shape == SWARM_FLAT ? vec3_add(vec3_scale(0.05 * p, a),
                                                                           vec3_scale(0.05 * q, b))
                                                                : vec3_scale(0.05 * p, a));
        s.v[i] = random_vector(k + 2, 5.0);
        s.mass[i] = pow(10.0, hash_random(k, 13) - 4.0);
    }
    return s;
}

typedef struct Sums {
    double energy, mass, size; /* size: of the moment, sum |r x m v| */
    Vec3 momentum, moment;
} Sums;

static Sums sums_of(const Swarm *s) {
    Sums sum = {.energy = 0.0};
    Vec3 about = s->x[0];
    for (int i = 0; i < s->count; i++) {
        Vec3 p = vec3_scale(s->mass[i], s->v[i]), r = vec3_sub(s->x[i], about);
        sum.energy += 0.5 * vec3_dot(p, s->v[i]);
        sum.momentum = vec3_add(sum.momentum, p);
        sum.moment = vec3_add(sum.moment, vec3_cross(r, p));
        sum.size += vec3_length(r) * vec3_length(p);
        sum.mass += s->mass[i] * vec3_length(s->v[i]);
    }
    return sum;
}

/* momentum and angular momentum to 1e-12, energy never up; no two points come nearer in a step; a rigid
 * motion stays as it is */
static void test_zone(void **unused) {
    (void)unused;
    double momentum = 0.0, moment = 0.0, gain = 0.0, nearer = 0.0, again = 0.0;
    for (uint64_t k = 0; k < 1000; k++) {
        Swarm s = swarm(k, (SwarmShape)(k % 5));
        Sums before = sums_of(&s);
        assert_true(impact_zone_settle(s.count, s.mass, s.x, NULL, s.v));
        Sums after = sums_of(&s);
        momentum =
            fmax(momentum, vec3_length(vec3_sub(after.momentum, before.momentum)) / before.mass);
        moment = fmax(moment, vec3_length(vec3_sub(after.moment, before.moment)) /
                                  fmax(before.size, 1e-30));
        gain = fmax(gain, after.energy / before.energy - 1.0);
        for (int i = 0; i < s.count; i++) {
            for (int j = 0; j < i; j++) {
                Vec3 x = vec3_sub(s.x[i], s.x[j]), v = vec3_sub(s.v[i], s.v[j]);
                double d = vec3_length(x);
                for (double t = 1e-3; t < 0.1; t *= 3.0) {
                    nearer = fmax(nearer, 1.0 - vec3_length(vec3_axpy(x, t, v)) / fmax(d, 1e-30));
                }
            }
        }
        Swarm twice = s;
        assert_true(impact_zone_settle(s.count, s.mass, s.x, NULL, twice.v));
        for (int i = 0; i < s.count; i++) {
            again = fmax(again, vec3_length(vec3_sub(twice.v[i], s.v[i])) / 5.0);
        }
    }
    CHECK_AT_MOST(momentum, 1e-12);
    CHECK_AT_MOST(moment, 1e-12);
    CHECK_AT_MOST(gain, 1e-13);
    CHECK_AT_MOST(nearer, 1e-12);
    CHECK_AT_MOST(again, 1e-11);
}

/* held vertices lead a zone; a solid that stands stops it; what moves apart cannot be glued */
static void test_zone_led(void **unused) {
    (void)unused;
    Vec3 velocity = {1, -2, 0.5}, turn = {3, 1, -4}, centre = {3, 1, -2};
    Swarm s = swarm(8, SWARM_CLOUD), kept;
    for (int i = 0; i < 5; i++) {
        s.mass[i] = INFINITY;
        s.v[i] = vec3_add(velocity, vec3_cross(turn, vec3_sub(s.x[i], centre)));
    }
    kept = s;
    assert_true(impact_zone_settle(s.count, s.mass, s.x, NULL, s.v));
    double off = 0.0;
    for (int i = 0; i < s.count; i++) {
        Vec3 led = vec3_add(velocity, vec3_cross(turn, vec3_sub(s.x[i], centre)));
        off = fmax(off, vec3_length(vec3_sub(s.v[i], led)));
    }
    CHECK_AT_MOST(off, 1e-12);
    s = kept;
    s.v[2] = vec3_scale(2.0, s.v[2]);
    kept = s;
    assert_false(impact_zone_settle(s.count, s.mass, s.x, NULL, s.v));
    assert_memory_equal(&s, &kept, sizeof s);
    Vec3 lead[MOST] = {{0, 0, 0}};
    assert_false(impact_zone_settle(s.count, s.mass, s.x, lead, s.v));
    s = swarm(9, SWARM_CLOUD);
    assert_true(impact_zone_settle(s.count, s.mass, s.x, lead, s.v));
    CHECK_AT_MOST(sums_of(&s).energy, 0.0);
    for (int i = 0; i < s.count; i++) { /* a solid that moves leads it */
        lead[i] = vec3_add(velocity, vec3_cross(turn, vec3_sub(s.x[i], centre)));
        s.v[i] = i < 3 ? lead[i] : random_vector(900 + (uint64_t)i, 5.0);
        s.mass[i] = i < 3 ? INFINITY : s.mass[i];
    }
    assert_true(impact_zone_settle(s.count, s.mass, s.x, lead, s.v));
    assert_memory_equal(s.v, lead, (size_t)s.count * sizeof *lead);
    s.v[0] = vec3_scale(1.1, lead[0]);
    assert_false(impact_zone_settle(s.count, s.mass, s.x, lead, s.v));
}

/* zones join by common members, keep what they are at, and can be forgotten */
static void test_zones_join(void **unused) {
    (void)unused;
    Arena arena = {0};
    ImpactZones z = impact_zones_create(12, &arena);
    for (int turn = 0; turn < 2; turn++) {
        impact_zones_join(&z, 3, (const int[]){4, 1, 7}, ZONE_FREE);
        impact_zones_join(&z, 2, (const int[]){2, 9}, turn ? 5 : ZONE_STILL);
        assert_int_equal(impact_zones_count(&z), 2);
        assert_int_equal(impact_zones_root(&z, 0), -1);
        assert_true(impact_zones_root(&z, 7) == impact_zones_root(&z, 1));
        assert_int_equal(z.solid[impact_zones_root(&z, 7)], ZONE_FREE);
        impact_zones_join(&z, 2, (const int[]){7, 9}, ZONE_FREE);
        assert_int_equal(impact_zones_count(&z), 1);
        assert_int_equal(z.solid[impact_zones_root(&z, 4)], turn ? 5 : ZONE_STILL);
        int around = 0, place = 4;
        do {
            around++;
            place = z.next[place];
        } while (place != 4 && around < 20);
        assert_int_equal(around, 5);
        assert_int_equal(z.member_count, 5);
        impact_zones_join(&z, 2, (const int[]){0, 9}, 6); /* another solid */
        assert_int_equal(z.solid[impact_zones_root(&z, 1)], ZONE_TORN);
        impact_zones_clear(&z);
        assert_int_equal(impact_zones_root(&z, 9), -1);
    }
    arena_free(&arena);
}

/* ---- friction with known answers ---- */

static void test_incline(void **unused) {
    (void)unused;
    contacts_check_incline(SOLVER);
}

static void test_stopping_distance(void **unused) {
    (void)unused;
    contacts_check_stop(SOLVER);
}

/* ---- scenes ---- */

typedef struct Judged {
    long crossings;
    double rounds, zones, zone_vertices, lost;
    double balance; /* [J] largest change of all energies and losses together */
    double fall;    /* [J] largest that gravity gave */
} Judged;

/* frame by frame, each by the exact check */
static Judged judge(Play *play, double seconds, int frames) {
    Judged j = {.crossings = 0};
    double first = 0.0, top = 0.0;
    for (int f = 0; f < frames; f++) {
        play_to(play, (f + 1) * seconds / frames);
        const Statistics *s = &play->sim.statistics;
        j.crossings += play_crossings(play);
        j.rounds += s->rounds, j.zones += s->zones, j.zone_vertices += s->zone_vertices;
        j.lost += s->friction + s->damping + s->guard + s->sides;
        double now = s->kinetic + s->elastic + s->gravity + j.lost;
        first = f == 0 ? now : first;
        top = f == 0 ? s->gravity : top;
        j.balance = fmax(j.balance, fabs(now - first));
        j.fall = fmax(j.fall, top - s->gravity);
    }
    return j;
}

/* two sheets of unlike nodes thrown at each other: none crosses, and momentum stays */
static void test_clap(void **unused) {
    (void)unused;
    double zones = 0.0;
    for (int speed = 10; speed <= 30; speed += 20) {
        char text[2048];
        Play play;
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 200, seconds: 4}\ncloth:\n  upper:\n"
                 "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
                 "    nodes: 17 x 17\n    at: [0, 0, 3 cm]\n    velocity: [0, 0, -%d m/s]\n"
                 "  lower:\n    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
                 "    nodes: 15 x 18\n    at: [3 cm, 1 cm, -2 cm]\n    velocity: [0, 0, %d m/s]\n"
                 "    turn: {axis: z, by: 20 deg}\ngravity: 0\n" SOLVER,
                 speed, speed);
        play_start(&play, text);
        Judged j = judge(&play, 0.1, 20);
        Vec3 sum = {0, 0, 0};
        double scale = 0.15 * 0.16 * speed;
        for (int i = 0; i < play.sim.system.place_count; i++) {
            sum = vec3_axpy(sum, play.sim.system.mass[i], play_v(&play, i));
        }
        CHECK_AT_MOST((double)j.crossings, 0.0);
        CHECK_AT_MOST(vec3_length(sum) / scale, 1e-10);
        CHECK_AT_MOST(1.0, j.rounds); /* repulsions alone do not stop it */
        zones += j.zones;
        play_end(&play);
    }
    CHECK_AT_MOST(1.0, zones); /* zones were needed, and none crossed */
}

static const char mesh[] =
    "mesh: {file: " TOILE_SOURCE_DIR "/assets/meshes/icosphere.obj, scale: 6 cm}, "
    "at: [0.4 cm, 0.3 cm, -6 cm]";

/* thrown at every solid and at a mesh */
static void test_thrown(void **unused) {
    (void)unused;
    long crossings = 0;
    for (int t = 0; t <= CONTACTS_SOLIDS; t++) {
        for (int speed = 10; speed <= 30; speed += 20) {
            char text[2048];
            Play play;
            snprintf(text, sizeof text,
                     "toile: 1\nfilm: {rate: 200, seconds: 4}\ncloth:\n  sheet:\n"
                     "    shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    " FABRIC
                     "    nodes: 17 x 17\n    at: [0, 0, 5 cm]\n    velocity: [0, 0, %d m/s]\n"
                     "obstacles:\n  target: {%s}\n" SOLVER,
                     -speed, t < CONTACTS_SOLIDS ? contacts_solids[t] : mesh);
            play_start(&play, text);
            crossings += judge(&play, 0.05, 10).crossings;
            play_end(&play);
        }
    }
    CHECK_AT_MOST((double)crossings, 0.0);
}

/* faster than cloth bears: it goes on without a crossing, or stops and says that zones took too much */
static void test_limit(void **unused) {
    (void)unused;
    for (int t = 0; t < 3; t++) {
        char text[2048];
        Play play;
        Error error = {0};
        bool on = true;
        snprintf(text, sizeof text,
                 "toile: 1\nfilm: {rate: 500, seconds: 4}\ncloth:\n  sheet:\n"
                 "    shape: {rectangle: {width: 30 cm, height: 30 cm}}\n    " FABRIC
                 "    nodes: 13 x 13\n    at: [1 cm, 2 cm, 10 cm]\n    velocity: [0, 0, -200 m/s]\n"
                 "obstacles:\n  target: {%s}\n" SOLVER,
                 contacts_solids[t]);
        play_start(&play, text);
        for (int f = 0; f < 2 && on; f++) {
            on = sim_advance(&play.sim, &error);
            CHECK_AT_MOST((double)play_crossings(&play), 0.0);
        }
        assert_true(on || (error.code == EXIT_DIFFERS && strstr(error.text, "impact zones")));
        play_end(&play);
    }
}

static const char folded[] = CONTACTS_FOLDED SOLVER;

/* dropped on its edge: it folds into a heap without a crossing, the books close, and the bits are the
 * same for any number of threads */
static void test_heap(void **unused) {
    (void)unused;
    uint64_t hash[3];
    for (int threads = 1; threads <= 3; threads++) {
        Play play;
        play_start(&play, folded);
        parallel_set_threads(threads);
        if (threads == 1) {
            Judged j = judge(&play, 0.8, 24);
            CHECK_AT_MOST((double)j.crossings, 0.0);
            CHECK_AT_MOST(j.balance / j.fall, 0.01);
        } else {
            play_to(&play, 0.8);
        }
        hash[threads - 1] = sim_state_hash(&play.sim);
        play_end(&play);
    }
    parallel_set_threads(1);
    assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
}

/* bounded sides over the sharp edges of a cube: the books close within 4 % of the fall */
static void test_books(void **unused) {
    (void)unused;
    Play play;
    play_start(
        &play,
        "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  sheet:\n"
        "    shape: {rectangle: {width: 60 cm, height: 60 cm}}\n    " FABRIC
        "    nodes: 25 x 25\n    at: [0, 0, 1 cm]\n    sides: bounded\n"
        "    noise: 0.2 mm\n    bending_damping: 0 s\n    membrane_damping: 0 s\n"
        "obstacles:\n  cube: {box: {size: [30 cm, 30 cm, 30 cm]}, at: [0, 0, -15 cm]}\n" SOLVER);
    Judged j = judge(&play, 1.0, 30);
    CHECK_AT_MOST((double)j.crossings, 0.0);
    CHECK_AT_MOST(j.balance / j.fall, 0.04);
    play_end(&play);
}

/* at rest on a box the impulses carry the weight, over an interval */
static void test_weight(void **unused) {
    (void)unused;
    Play play;
    double force = 0.0;
    play_start(
        &play,
        "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  sheet:\n    damping: 8 1/s\n"
        "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n    " FABRIC
        "    nodes: 11 x 11\n    at: [0, 0, 3 mm]\n    look: contact-force\n"
        "obstacles:\n  box: {box: {size: [30 cm, 30 cm, 10 cm]}, at: [0, 0, -5 cm]}\n" SOLVER);
    play_to(&play, 2.0);
    for (int f = 1; f <= 30; f++) {
        play_to(&play, 2.0 + f / 30.0);
        for (int i = 0; i < play.sim.system.place_count; i++) {
            force += play.sim.state.contact_force[3 * i + 2] / 30.0;
        }
    }
    CHECK_NEAR(force / (0.15 * 0.04 * G), 1.0, 0.01);
    CHECK_AT_MOST(play.sim.statistics.kinetic, 1e-7);
    play_end(&play);
}

/* a heap, stopped in the middle and resumed by three threads */
static void test_resume(void **unused) {
    (void)unused;
    resume_check(folded, 14, 20);
}

static int set_up(void **unused) {
    (void)unused;
    return folder_make("impulses") ? 0 : 1;
}

static int tear_down(void **unused) {
    (void)unused;
    return folder_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strike),
        cmocka_unit_test(test_strike_held),
        cmocka_unit_test(test_zone),
        cmocka_unit_test(test_zone_led),
        cmocka_unit_test(test_zones_join),
        cmocka_unit_test(test_incline),
        cmocka_unit_test(test_stopping_distance),
        cmocka_unit_test(test_clap),
        cmocka_unit_test(test_thrown),
        cmocka_unit_test(test_limit),
        cmocka_unit_test(test_heap),
        cmocka_unit_test(test_books),
        cmocka_unit_test(test_weight),
        cmocka_unit_test(test_resume),
    };
    return cmocka_run_group_tests_name("impulses", tests, set_up, tear_down);
}
