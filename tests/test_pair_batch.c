/* Closest points of many pairs at once (pair_batch.h): the same bits as one by one, at every width. */
#include <string.h>

#include "sim/base/hash.h"
#include "sim/contact/pair_batch.h"
#include "tests/support/check.h"

#define PAIRS 20011 /* no multiple of a batch */

static double noise(uint64_t i) { return hash_random(7, i); }

/* four points near each other: of every kind of closest point, some degenerate, some parallel */
static void make_points(double *x) {
    for (int k = 0; k < PAIRS; k++) {
        double *p = x + 12 * (size_t)k;
        for (int a = 0; a < 12; a++) {
            p[a] = noise((uint64_t)(12 * k + a));
        }
        if (k % 7 == 0) { /* parallel edges, or a point over a parallelogram */
            for (int a = 0; a < 3; a++) {
                p[9 + a] = p[6 + a] + p[3 + a] - p[a];
            }
        }
        if (k % 11 == 0) { /* a corner twice: no triangle, no edge */
            memcpy(p + 9, p + 6, 3 * sizeof *p);
        }
        if (k % 13 == 0) { /* touching */
            memcpy(p, p + 9, 3 * sizeof *p);
        }
        if (k % 17 == 0) { /* flat */
            p[2] = p[5] = p[8] = p[11] = 0.25;
        }
    }
}

static Pair pair_at(int k) {
    return (Pair){.kind = k % 2 == 0 ? PAIR_FACE : PAIR_EDGES,
                  .place = {4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3}};
}

static void test_same_bits(void **unused) {
    (void)unused;
    Arena arena = {0};
    double *x = arena_push(&arena, double, 12 * PAIRS);
    Pair *one = arena_push(&arena, Pair, PAIRS), *many = arena_push(&arena, Pair, PAIRS);
    PairBatch *batch = arena_push(&arena, PairBatch, 1);
    Points points = {x};
    int features[8] = {0};
    make_points(x);
    for (int k = 0; k < PAIRS; k++) {
        one[k] = pair_at(k);
        pair_evaluate(&points, &one[k]);
        features[one[k].feature]++;
    }
    for (int f = 0; f < 8; f++) {
        assert_true(features[f] > 100);
    }
    for (VectorWidth width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
        if (!vector_runs_here(width)) {
            continue;
        }
        pair_batch_begin(batch, width);
        for (int k = 0; k < PAIRS; k++) {
            many[k] = pair_at(k);
            pair_batch_add(batch, &points, &many[k]);
        }
        pair_batch_end(batch);
        for (int k = 0; k < PAIRS; k++) {
            assert_memory_equal(&many[k], &one[k], sizeof one[k]);
        }
    }
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
