/* Nearest points of many triangles to boxes at once (box_batch.h): the same bits as one by one, at every
 * width. */
#include <string.h>

#include "sim/base/arena.h"
#include "sim/base/hash.h"
#include "sim/contact/box_batch.h"
#include "tests/support/check.h"

#define TRIANGLES 20011 /* no multiple of a batch */
#define BOXES 4

/* round, sharp, a bar, one that is all rounding along an axis */
static const Solid boxes[BOXES] = {{SOLID_BOX, {0.5, 0.4, 0.3}, 0.1},
                                   {SOLID_BOX, {0.4, 0.4, 0.4}, 0.0},
                                   {SOLID_BOX, {0.1, 0.1, 1.0}, 0.05},
                                   {SOLID_BOX, {0.5, 0.5, 0.1}, 0.1}};

typedef struct Triangle {
    const Solid *box;
    Vec3 x[3], normal[3];
    double distance[3];
} Triangle;

static double noise(uint64_t i) { return 2.0 * hash_random(7, i) - 1.0; }

/* small and large ones, most of them near an edge or a corner; some flat on a face, some in the core */
static void make_triangle(int k, Triangle *t) {
    uint64_t at = 16 * (uint64_t)k;
    t->box = &boxes[k % BOXES];
    double size = k % 3 == 0 ? 1.0 : 0.1, h[3] = {t->box->half.x, t->box->half.y, t->box->half.z};
    double middle[3];
    for (int a = 0; a < 3; a++) {
        bool edge = (k / 3) % 4 != a;
        middle[a] = (edge ? copysign(1.0, noise(at + 9 + (uint64_t)a)) : noise(at + 12)) * h[a];
        middle[a] *= k % 17 == 0 ? 0.3 : 1.0;
    }
    for (int c = 0; c < 3; c++) {
        double p[3];
        for (int a = 0; a < 3; a++) {
            p[a] = middle[a] + size * noise(at + (uint64_t)(3 * c + a));
            p[a] = k % 13 == 0 && a == 2 ? h[2] + 0.01 : p[a];
        }
        t->x[c] = vec3_load(p);
        t->distance[c] = solid_distance(t->box, t->x[c], &t->normal[c]);
    }
    if (k % 101 == 0) { /* a corner twice */
        t->x[2] = t->x[1], t->normal[2] = t->normal[1], t->distance[2] = t->distance[1];
    }
}

static void check_same(const SolidNearest *a, const SolidNearest *b) {
    assert_int_equal(a->feature, b->feature);
    assert_memory_equal(a->weight, b->weight, sizeof a->weight);
    assert_memory_equal(&a->point, &b->point, sizeof a->point);
    assert_memory_equal(&a->normal, &b->normal, sizeof a->normal);
    assert_memory_equal(&a->distance, &b->distance, sizeof a->distance);
    assert_memory_equal(&a->lower, &b->lower, sizeof a->lower);
    for (int k = 0; k < 3; k++) {
        assert_memory_equal(&a->side[k].distance, &b->side[k].distance, sizeof(double));
        if (isfinite(a->side[k].distance)) {
            assert_memory_equal(&a->side[k], &b->side[k], sizeof a->side[k]);
        }
    }
}

static void check_batch(BoxBatch *batch, const SolidNearest *one, int first, int *within) {
    int count = box_batch_solve(batch);
    for (int k = 0; k < count; k++) {
        check_same(&batch->nearest[k], &one[first + k]);
        *within += batch->rows.within[k] > 0.0;
    }
}

static void test_same_bits(void **unused) {
    (void)unused;
    Arena arena = {0};
    Triangle *t = arena_push(&arena, Triangle, TRIANGLES);
    SolidNearest *one = arena_push(&arena, SolidNearest, TRIANGLES);
    BoxBatch *batch = arena_push(&arena, BoxBatch, 1);
    int features[8] = {0};
    for (int k = 0; k < TRIANGLES; k++) {
        make_triangle(k, &t[k]);
        one[k] = solid_nearest_on_triangle(t[k].box, t[k].x, t[k].distance, t[k].normal);
        features[one[k].feature]++;
    }
    for (int f = 1; f < 8; f++) {
        assert_true(features[f] > 100);
    }
    for (VectorWidth width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
        int within = 0, first = 0;
        if (!vector_runs_here(width)) {
            continue;
        }
        box_batch_begin(batch, width);
        for (int k = 0; k < TRIANGLES; k++) {
            for (int c = 0; c < 3; c++) {
                box_batch_set(batch, c, t[k].x[c], t[k].distance[c], t[k].normal[c]);
            }
            if (box_batch_add(batch, t[k].box) == BOX_BATCH || k + 1 == TRIANGLES) {
                check_batch(batch, one, first, &within);
                first = k + 1;
            }
        }
        assert_true(within > 100); /* some are left to the other way */
    }
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
