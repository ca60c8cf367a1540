/* sim/base and motions: arenas, errors, vectors, words, hashing, threads, turns over time. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/arena.h"
#include "sim/base/error.h"
#include "sim/base/hash.h"
#include "sim/base/memory.h"
#include "sim/base/parallel.h"
#include "sim/base/text.h"
#include "sim/base/vec.h"
#include "sim/scene/motion.h"
#include "tests/support/check.h"

static void test_arena_blocks(void **state) {
    (void)state;
    Arena arena = {0};
    size_t sizes[] = {0, 1, 63, 64, 65, 1000, 1 << 18, 3 << 20};
    unsigned char *before = NULL;
    for (int i = 0; i < 8; i++) {
        unsigned char *block = arena_alloc(&arena, sizes[i]);
        assert_non_null(block);
        assert_ptr_not_equal(block, before);
        assert_int_equal((uintptr_t)block % ARENA_ALIGNMENT, 0);
        for (size_t k = 0; k < sizes[i]; k++) {
            assert_int_equal(block[k], 0);
        }
        memset(block, 0xFF, sizes[i]);
        before = block;
    }
    assert_string_equal(arena_strdup(&arena, "toile"), "toile");
    assert_true(arena.bytes_used > 3 << 20);
    arena_free(&arena);
    assert_int_equal(arena.bytes_used, 0);
    assert_null(arena.chunk);
}

/* going back gives the same memory again, zeroed, also over chunks */
static void test_arena_rewind(void **state) {
    (void)state;
    Arena arena = {0};
    double *kept = arena_push(&arena, double, 10);
    kept[9] = 5.0;
    ArenaMark mark = arena_mark(&arena);
    double *first = arena_push(&arena, double, 100);
    size_t used = arena.bytes_used;
    for (int round = 0; round < 20; round++) {
        arena_rewind(&arena, mark);
        double *again = arena_push(&arena, double, 100);
        assert_ptr_equal(again, first);
        CHECK_NEAR(again[99], 0, 0);
        again[99] = 7.0;
        assert_int_equal(arena.bytes_used, used);
        for (int i = 0; i < 5; i++) {
            memset(arena_alloc(&arena, 200000), 1, 200000);
        }
        unsigned char *large =
            arena_alloc(&arena, 400000); /* a chunk of its own, kept for the next round */
        for (int i = 0; i < 400000; i++) {
            assert_int_equal(large[i], 0);
        }
        memset(large, 1, 400000);
    }
    CHECK_NEAR(kept[9], 5, 0);
    assert_true(arena.bytes_peak >= 1000000);
    arena_free(&arena);
}

/* more than there is: a sentence, and the code of input and output; nothing is a block too */
static void test_memory(void **state) {
    (void)state;
    void *nothing = memory_new(0), *zeros = memory_zeroed(0, 8);
    assert_non_null(nothing);
    assert_non_null(zeros);
    nothing = memory_resize(nothing, 100);
    free(nothing);
    free(zeros);
#ifndef __SANITIZE_ADDRESS__ /* which ends in its own way */
    for (int k = 0; k < 3; k++) {
        fflush(NULL);
        pid_t child = fork();
        if (child == 0) {
            fclose(stderr);
            Arena arena = {0};
            size_t most = SIZE_MAX / 4;
            void *block = k == 0   ? memory_new(most)
                          : k == 1 ? memory_zeroed(most, 1)
                                   : arena_alloc(&arena, most);
            _exit(block ? 1 : 2);
        }
        int status = 0;
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), EXIT_IO);
    }
#endif
}

static void test_error(void **state) {
    (void)state;
    Error error = {0};
    assert_false(error_set(&error, EXIT_BAD_INPUT, "line %d", 7));
    assert_false(error_set(&error, EXIT_IO, "later"));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_string_equal(error.text, "line 7");
    assert_false(error_set(NULL, EXIT_IO, "nobody listens"));
    Error io = {0};
    errno = ENOENT;
    error_set_errno(&io, EXIT_IO, "cannot open '%s'", "x");
    assert_string_equal(io.text, "cannot open 'x': No such file or directory");
    char longer[2 * ERROR_TEXT_SIZE];
    memset(longer, 'a', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    Error cut = {0};
    error_set(&cut, EXIT_IO, "%s", longer);
    assert_int_equal(strlen(cut.text), ERROR_TEXT_SIZE - 1);
}

static void test_nearest_word(void **state) {
    (void)state;
    static const char *const words[] = {"gravity", "drag", "air", "film", NULL};
    assert_string_equal(text_nearest("gravty", words), "gravity");
    assert_string_equal(text_nearest("grvaity", words), "gravity");
    assert_string_equal(text_nearest("dragg", words), "drag");
    assert_string_equal(text_nearest("drga", words), "drag");
    assert_null(text_nearest("dgar", words));
    assert_null(text_nearest("wind", words));
    assert_null(text_nearest("", words));
    assert_int_equal(text_distance("", "abc", 5), 3);
    assert_int_equal(text_distance("abc", "abc", 2), 0);
    assert_int_equal(text_distance("abcd", "acbd", 2), 1);
    assert_int_equal(text_distance("abcdef", "uvwxyz", 2), 3);
    char huge[200];
    memset(huge, 'x', sizeof huge - 1);
    huge[sizeof huge - 1] = '\0';
    assert_null(text_nearest(huge, words));
}

#define HASH_OF_NOTHING 0x2d06800538d394c2u

static void test_hash(void **state) {
    (void)state;
    assert_true(hash_bytes("", 0) == HASH_OF_NOTHING); /* XXH3-64, as published */
    assert_true(hash_bytes("toile", 5) != hash_bytes("toilf", 5));
    assert_true(hash_bytes("", 0) == hash_bytes("x", 0));
    double sum = 0.0, square = 0.0;
    for (uint64_t i = 0; i < 10000; i++) {
        double r = hash_random(42, i);
        assert_true(r >= -1.0 && r < 1.0);
        sum += r;
        square += r * r;
    }
    CHECK_NEAR(sum / 10000, 0, 0.02);
    CHECK_NEAR(square / 10000, 1.0 / 3.0, 0.01);
    CHECK_NEAR(hash_random(42, 7), hash_random(42, 7), 0);
    assert_true(hash_random(42, 7) != hash_random(43, 7));
}

static void check_vec(Vec3 a, Vec3 b) {
    CHECK_NEAR(a.x, b.x, 1e-14);
    CHECK_NEAR(a.y, b.y, 1e-14);
    CHECK_NEAR(a.z, b.z, 1e-14);
}

static void test_vectors(void **state) {
    (void)state;
    Vec3 p = {1, 2, 3};
    Quat turn = quat_from_axis_angle(vec3(0, 0, 2), PI / 2);
    check_vec(quat_rotate(turn, p), vec3(-2, 1, 3));
    check_vec(quat_rotate(quat_inverse(turn), quat_rotate(turn, p)), p);
    check_vec(vec3_cross(vec3(1, 0, 0), vec3(0, 1, 0)), vec3(0, 0, 1));
    check_vec(vec3_unit(vec3(0, 0, 0), vec3(0, 1, 0)), vec3(0, 1, 0));
    Pose outer = {{1, 0, 0}, turn}, inner = {{0, 0, 5}, quat_from_axis_angle(p, 1.0)};
    Pose both = pose_compose(outer, inner);
    check_vec(pose_apply(both, p), pose_apply(outer, pose_apply(inner, p)));
    check_vec(pose_unapply(both, pose_apply(both, p)), p);
    check_vec(pose_apply(pose_identity(), p), p);
}

typedef struct Sums {
    const double *values;
    double chunk[64];
} Sums;

static void sum_chunk(int chunk, int first, int end, void *context) {
    Sums *sums = context;
    for (int i = first; i < end; i++) {
        sums->chunk[chunk] += sums->values[i];
    }
}

/* the same bits for any number of threads, and for a count that no grain divides */
static void test_parallel(void **state) {
    (void)state;
    enum { COUNT = 1000, GRAIN = 17 };
    double values[COUNT], reference = 0.0;
    for (int i = 0; i < COUNT; i++) {
        values[i] = hash_random(1, (uint64_t)i);
    }
    for (int threads = 1; threads <= 4; threads++) {
        Sums sums = {.values = values};
        parallel_set_threads(threads);
        assert_int_equal(parallel_threads(), threads);
        parallel_for(COUNT, GRAIN, sum_chunk, &sums);
        double sum = 0.0;
        for (int i = 0; i < parallel_chunk_count(COUNT, GRAIN); i++) {
            sum += sums.chunk[i];
        }
        reference = threads == 1 ? sum : reference;
        assert_memory_equal(&sum, &reference, sizeof sum);
    }
    parallel_set_threads(1);
    parallel_for(0, GRAIN, sum_chunk, NULL);
}

typedef struct Loops {
    int number; /* of the loop at hand */
    int done[7], within[7];
} Loops;

static void count_within(int chunk, int first, int end, void *context) {
    (void)first, (void)end;
    ((int *)context)[0] += chunk;
}

static void do_loop(int chunk, int first, int end, void *context) {
    Loops *loops = context;
    loops->done[chunk] += end - first == 1 ? loops->number : 0;
    parallel_for(4, 1, count_within, &loops->within[chunk]);
}

/* one loop after the other, each chunk of each once, with loops within */
static void test_many_loops(void **state) {
    (void)state;
    enum { LOOPS = 30000 };
    Loops loops = {0};
    parallel_set_threads(3);
    for (loops.number = 1; loops.number <= LOOPS; loops.number++) {
        parallel_for(7, 1, do_loop, &loops);
    }
    parallel_set_threads(1);
    for (int chunk = 0; chunk < 7; chunk++) {
        assert_int_equal(loops.done[chunk], LOOPS / 2 * (LOOPS + 1));
        assert_int_equal(loops.within[chunk], 6 * LOOPS);
    }
}

/* a smooth turn starts and ends at rest, and is half done in the middle */
static void test_motion_smooth(void **state) {
    (void)state;
    MotionPiece piece = {.kind = MOTION_TURN,
                         .axis = {0, 0, 1},
                         .centre = {1, 0, 0},
                         .angle = PI,
                         .from = 1.0,
                         .to = 3.0,
                         .smooth = true};
    Motion motion = {1, &piece};
    const double h = 1e-4;
    check_vec(pose_apply(motion_pose(&motion, 0.0), vec3(2, 0, 0)), vec3(2, 0, 0));
    check_vec(pose_apply(motion_pose(&motion, 2.0), vec3(2, 0, 0)), vec3(1, 1, 0));
    check_vec(pose_apply(motion_pose(&motion, 9.0), vec3(2, 0, 0)), vec3(0, 0, 0));
    for (int i = 0; i < 2; i++) {
        double end = i == 0 ? 1.0 + h : 3.0 - h;
        Vec3 moved = vec3_sub(pose_apply(motion_pose(&motion, end), vec3(2, 0, 0)),
                              pose_apply(motion_pose(&motion, i == 0 ? 1.0 : 3.0), vec3(2, 0, 0)));
        CHECK_AT_MOST(vec3_length(moved), PI * 10 * pow(h / 2, 3) * 1.01);
    }
    CHECK_NEAR(motion_end(&motion), 3.0, 0);
}

static void test_motion_order(void **state) {
    (void)state;
    MotionPiece pieces[2] = {
        {.kind = MOTION_MOVE, .by = {1, 0, 0}, .from = 0.0, .to = 1.0},
        {.kind = MOTION_TURN, .axis = {0, 0, 1}, .angle = PI / 2, .to = 1.0, .endless = true}};
    Motion motion = {2, pieces};
    check_vec(pose_apply(motion_pose(&motion, 1.0), vec3(0, 0, 0)), vec3(0, 1, 0));
    check_vec(pose_apply(motion_pose(&motion, 2.0), vec3(0, 0, 0)), vec3(-1, 0, 0));
    assert_true(isinf(motion_end(&motion)));
    Motion none = {0};
    check_vec(pose_apply(motion_pose(&none, 5.0), vec3(1, 2, 3)), vec3(1, 2, 3));
    CHECK_NEAR(motion_end(&none), 0, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_arena_blocks), cmocka_unit_test(test_arena_rewind),
        cmocka_unit_test(test_error),        cmocka_unit_test(test_nearest_word),
        cmocka_unit_test(test_memory),       cmocka_unit_test(test_hash),
        cmocka_unit_test(test_vectors),      cmocka_unit_test(test_parallel),
        cmocka_unit_test(test_many_loops),   cmocka_unit_test(test_motion_smooth),
        cmocka_unit_test(test_motion_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
