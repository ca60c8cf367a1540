/* Conservative continuous collision detection. */
#include "sim/base/hash.h"
#include "sim/contact/ccd.h"
#include "tests/support/check.h"

static double uniform(uint64_t *seed, double scale) { return scale * hash_random(7, (*seed)++); }
static Vec3 random_vector(uint64_t *seed, double scale) {
    double x = uniform(seed, scale), y = uniform(seed, scale), z = uniform(seed, scale);
    return vec3(x, y, z);
}

static double pair_distance(PairKind kind, const Vec3 x[4], const Vec3 p[4], double t) {
    Vec3 y[4];
    for (int k = 0; k < 4; k++) {
        y[k] = vec3_axpy(x[k], t, p[k]);
    }
    Points points = {&y[0].x};
    Pair pair = {.kind = kind, .place = {0, 1, 2, 3}};
    pair_evaluate(&points, &pair);
    return pair.distance;
}

/* random, resting, sliding, impact, parallel, degenerate */
static void random_pair(int set, uint64_t *seed, Vec3 x[4], Vec3 p[4]) {
    double flat = set == 0 ? 1.0 : 0.02;
    double speed = set == 1 ? 0.01 : set == 3 ? 10.0 : 1.0;
    for (int k = 0; k < 4; k++) {
        x[k] = random_vector(seed, 1.0);
        x[k].z *= flat;
        p[k] = random_vector(seed, speed);
        p[k].z *= set == 2 ? 0.01 : 1.0;
    }
    if (set == 4) {
        x[3] = vec3_axpy(x[2], 1.0 + uniform(seed, 1e-9), vec3_sub(x[1], x[0]));
    }
    if (set == 5) {
        x[3] = vec3_axpy(x[2], uniform(seed, 1e-7), x[1]);
        p[3] = p[2];
    }
}

static void test_ccd_pairs(void **unused) {
    (void)unused;
    int unsafe = 0, hits = 0;
    double share = 0.0;
    uint64_t seed = 1;
    for (int k = 0; k < 120000; k++) {
        Vec3 x[4], p[4], n = {0, 0, 0};
        PairKind kind = k % 2 ? PAIR_FACE : PAIR_EDGES;
        random_pair(k / 2 % 6, &seed, x, p);
        double d0 = pair_distance(kind, x, p, 0.0);
        double target = (k % 7 ? 0.3 : 0.9) * d0;
        if (!(d0 > 1e-6)) {
            continue;
        }
        double t = ccd_pair(kind, x, p, target, &n), hit = 1.0;
        for (int s = 1; s <= 100 && hit == 1.0; s++) {
            double at = s / 100.0, d = pair_distance(kind, x, p, at);
            unsafe += at <= t && d < target * (1.0 - 1e-9);
            hit = d < target ? at : 1.0;
        }
        unsafe += pair_distance(kind, x, p, t) < target * (1.0 - 1e-9);
        if (hit < 1.0) {
            hits++;
            share += t / hit;
        }
    }
    CHECK_AT_MOST(unsafe, 0);
    CHECK_AT_MOST(1.0 - share / hits, 0.15);
}

static void test_ccd_solids(void **unused) {
    (void)unused;
    int unsafe = 0, hits = 0;
    double share = 0.0;
    uint64_t seed = 1;
    for (int k = 0; k < 60000; k++) {
        Solid solid = {(SolidKind)(k % SOLID_KIND_COUNT), {0.5, 0.4, 0.3}, 0.2};
        Vec3 x[3], p[3], n = {0, 0, 0};
        double w[3], distance[101];
        int feature;
        for (int c = 0; c < 3; c++) {
            x[c] = vec3_add(random_vector(&seed, 0.6), vec3(0.0, 0.0, 1.0));
            p[c] = random_vector(&seed, k % 3 ? 1.0 : 10.0);
            p[c].z -= 1.0;
        }
        for (int s = 0; s <= 100; s++) {
            Vec3 y[3];
            for (int c = 0; c < 3; c++) {
                y[c] = vec3_axpy(x[c], s / 100.0, p[c]);
            }
            distance[s] = ccd_solid_distance(&solid, y, &n, w, &feature);
        }
        if (!(distance[0] > 1e-6)) {
            continue;
        }
        double target = 0.3 * distance[0], hit = 1.0;
        double t = ccd_solid(&solid, x, p, target, &n);
        for (int s = 1; s <= 100 && hit == 1.0; s++) {
            unsafe += s / 100.0 <= t && distance[s] < target - 1e-9;
            hit = distance[s] < target ? s / 100.0 : 1.0;
        }
        if (hit < 1.0) {
            hits++;
            share += t / hit;
        }
    }
    CHECK_AT_MOST(unsafe, 0);
    CHECK_AT_MOST(1.0 - share / hits, 0.15);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ccd_pairs),
        cmocka_unit_test(test_ccd_solids),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
