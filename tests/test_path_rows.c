/* Relative paths of many group pairs at once (paths.h): the same bits as one by one, at every width. */
#include <string.h>

#include "sim/base/hash.h"
#include "sim/contact/constants.h"
#include "sim/contact/paths.h"
#include "tests/support/check.h"

enum { GROUPS = 40, FIRST = 3, END = 701, ROOM = 704 };

static const double dt = 1.3e-4;

typedef struct Rows {
    PathRows rows;
    PathEnds ends[ROOM];
    double path[ROOM], next[ROOM], limit[ROOM], near[ROOM], speed[ROOM], earliest[ROOM];
    unsigned char flags[ROOM];
} Rows;

/* in 0 .. 1 */
static double noise(int i, int what) {
    return 0.5 + 0.5 * hash_random(23, (uint64_t)(i * 16 + what));
}

static void make_motion(GroupMotion motion[GROUPS]) {
    for (int g = 0; g < GROUPS; g++) {
        Vec3 v = {noise(g, 0) - 0.5, noise(g, 1) - 0.5, noise(g, 2) - 0.5};
        motion[g] = (GroupMotion){v, noise(g, 3), 0.0};
    }
}

/* one in nine was never searched; the others are about to pass one or the other border, or not */
static void make_rows(Rows *r) {
    for (int i = 0; i < ROOM; i++) {
        bool fresh = i % 9 == 0;
        r->ends[i] = (PathEnds){(int)(GROUPS * noise(i, 4)), (int)(GROUPS * noise(i, 5))};
        r->path[i] = 1e-3 * noise(i, 6);
        r->limit[i] = fresh ? -1.0 : r->path[i] + 1.2e-3 * noise(i, 7);
        r->near[i] = fresh ? -1.0 : 4e-4 * noise(i, 8);
        r->earliest[i] = r->path[i] + 4e-4 * noise(i, 9);
        r->next[i] = r->speed[i] = -7.0;
        r->flags[i] = 64;
    }
    r->rows =
        (PathRows){r->ends, r->path, r->next, r->limit, r->near, r->speed, r->earliest, r->flags};
}

enum { QUESTIONS = ADVANCED + 1, ANSWERS = 16 };

static unsigned char one(const Rows *r, const GroupMotion *motion, int i, int question,
                         double *speed, double *next) {
    const GroupMotion *a = &motion[r->ends[i].a], *b = &motion[r->ends[i].b];
    double asked = vec3_length(vec3_sub(a->velocity, b->velocity)) + a->deviation + b->deviation;
    *speed = question == ADVANCED ? r->speed[i] : asked;
    *next = r->path[i] + *speed * dt;
    bool outgrown = CONTACT_LEAST_NEAR_STEPS * *speed * dt > r->near[i];
    bool outrun = *speed * dt > CONTACT_PLANE_SHARE * r->near[i];
    bool wanted = (question == OUTGROWN && outgrown) || (question == OUTRUN && outrun);
    bool soon = *next + CONTACT_SOON_STEPS * (*speed * dt) > r->limit[i];
    return (unsigned char)((wanted ? PATH_WANTED : 0) | (*next > r->limit[i] ? PATH_SPENT : 0) |
                           (soon ? PATH_SOON : 0) | (*next >= r->earliest[i] ? PATH_DUE : 0));
}

static void check_question(const PathKernel *kernel, int question, int seen[ANSWERS]) {
    GroupMotion motion[GROUPS];
    Rows before, after;
    make_motion(motion);
    make_rows(&before);
    make_rows(&after);
    for (int i = 0; i < ROOM && question == ADVANCED; i++) {
        before.speed[i] = after.speed[i] = noise(i, 10);
    }
    PathQuestion outgrown = {CONTACT_LEAST_NEAR_STEPS, 1.0, dt};
    PathQuestion outrun = {1.0, CONTACT_PLANE_SHARE, dt};
    if (question == ADVANCED) {
        kernel->advance(&after.rows, FIRST, END, dt);
    } else {
        kernel->ask(&after.rows, motion, question == OUTGROWN ? &outgrown : &outrun, FIRST, END);
    }
    for (int i = 0; i < ROOM; i++) {
        double speed = before.speed[i], next = before.next[i];
        unsigned char flags = before.flags[i];
        if (i >= FIRST && i < END) {
            flags = one(&before, motion, i, question, &speed, &next);
            seen[flags]++;
        }
        assert_memory_equal(&after.speed[i], &speed, sizeof speed);
        assert_memory_equal(&after.next[i], &next, sizeof next);
        assert_int_equal(after.flags[i], flags);
    }
    assert_memory_equal(after.path, before.path, sizeof before.path);
    assert_memory_equal(after.limit, before.limit, sizeof before.limit);
    assert_memory_equal(after.near, before.near, sizeof before.near);
}

static void test_same_bits(void **unused) {
    (void)unused;
    const PathKernel *kernels[] = {&path_kernel_scalar, &path_kernel_sse2, &path_kernel_avx2,
                                   &path_kernel_avx512};
    for (VectorWidth width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
        int seen[ANSWERS] = {0};
        for (int question = 0; question < QUESTIONS && vector_runs_here(width); question++) {
            check_question(kernels[width], question, seen);
        }
        for (int k = 0; k < ANSWERS && vector_runs_here(width); k++) {
            bool may_be = !(k & PATH_SPENT) || (k & PATH_SOON);
            assert_true(may_be ? seen[k] > 10 : seen[k] == 0);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
