/* Solves with sparse matrices against what they are made of. */
#include <stdlib.h>

#include "sim/base/hash.h"
#include "sim/solve/triangular.h"
#include "tests/support/check.h"

enum { COUNT = 60, TERMS = 200 };

/* a sum of terms (x_a - w x_b)^2 / 2 and x_i^2 / 2: positive definite */
static int make_entries(TriangularEntry *entries) {
    int count = 0;
    for (int i = 0; i < COUNT; i++) {
        entries[count++] = (TriangularEntry){i, i, 1.0};
    }
    for (int k = 0; k < TERMS; k++) {
        int a = (int)(COUNT * (0.5 + 0.499 * hash_random(1, (uint64_t)k)));
        int b = (int)(COUNT * (0.5 + 0.499 * hash_random(2, (uint64_t)k)));
        double w = hash_random(3, (uint64_t)k);
        if (a != b) {
            entries[count++] = (TriangularEntry){a, a, 1.0};
            entries[count++] = (TriangularEntry){b, b, w * w};
            entries[count++] = (TriangularEntry){a > b ? a : b, a > b ? b : a, -w};
        }
    }
    return count;
}

static void test_triangular(void **unused) {
    (void)unused;
    Arena arena = {0};
    TriangularEntry entries[COUNT + 3 * TERMS];
    int count = make_entries(entries);
    Triangular l;
    assert_true(triangular_create(COUNT, entries, count, &arena, &l));
    double x[COUNT], b[COUNT] = {0};
    for (int i = 0; i < COUNT; i++) {
        x[i] = hash_random(4, (uint64_t)i);
    }
    for (int k = 0; k < count; k++) {
        const TriangularEntry *e = &entries[k];
        b[e->row] += e->value * x[e->column];
        b[e->column] += e->row == e->column ? 0.0 : e->value * x[e->row];
    }
    triangular_solve(&l, b);
    for (int i = 0; i < COUNT; i++) {
        CHECK_NEAR(b[i], x[i], 1e-12);
    }
    entries[count - 1].value = -1e3; /* no longer positive definite */
    assert_false(triangular_create(COUNT, entries, count, &arena, &l));
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_triangular)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
