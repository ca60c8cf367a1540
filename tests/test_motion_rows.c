/* Copies from the lanes and the motion of groups by rows (motion.h): what one vertex after the other
 * gives, bit for bit, at every width. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/contact/motion.h"
#include "sim/geom/lanes.h"
#include "tests/support/check.h"

enum { ACROSS = 14, ALONG = 11, COUNT = ACROSS * ALONG };

typedef struct Rig {
    Arena arena;
    SurfacePanel panel;
    Surface surface;
    Lanes lanes;
    int *slot;
} Rig;

static void rig_create(Rig *r, bool wrap) {
    *r = (Rig){.arena = {0}};
    int cells = wrap ? ACROSS : ACROSS - 1, stride = lanes_row_stride(ACROSS), at = 0;
    int *triangles = arena_push(&r->arena, int, 6 * cells * (ALONG - 1));
    double *start = arena_push(&r->arena, double, 3 * COUNT);
    for (int j = 0; j < ALONG - 1; j++) {
        for (int i = 0; i < cells; i++) {
            int a = j * ACROSS + i, b = j * ACROSS + (i + 1) % ACROSS;
            int corner[6] = {a, b, b + ACROSS, a, b + ACROSS, a + ACROSS};
            memcpy(triangles + 6 * at++, corner, sizeof corner);
        }
    }
    r->panel = (SurfacePanel){.vertex_count = COUNT,
                              .triangle_count = 2 * at,
                              .triangles = triangles,
                              .nu = ACROSS,
                              .nv = ALONG,
                              .wrap = wrap};
    r->surface = surface_create(&r->panel, 1, start, &r->arena);
    r->slot = arena_push(&r->arena, int, COUNT);
    r->lanes = lanes_create((ALONG + 2) * stride + LANE_MARGIN, &r->arena);
    for (int i = 0; i < COUNT; i++) {
        r->slot[i] = LANE_MARGIN + (1 + i / ACROSS) * stride + i % ACROSS;
    }
    for (int k = 0; k < 3 * r->lanes.slot_count; k++) {
        r->lanes.v[k % 3][k / 3] = hash_random(7, (uint64_t)k);
    }
}

static GroupMotion motion_of(const Rig *r, const double *v, int g) {
    const SurfaceGroup *group = &r->surface.groups[g];
    const int *vertices = r->surface.group_vertices;
    Vec3 middle = vec3_load(v + 3 * vertices[(group->vertex_begin + group->vertex_end) / 2]);
    double most = 0.0;
    for (int k = group->vertex_begin; k < group->vertex_end; k++) {
        Vec3 d = vec3_sub(vec3_load(v + 3 * vertices[k]), middle);
        most = fmax(most, vec3_dot(d, d));
    }
    return (GroupMotion){middle, sqrt(most), vec3_length(middle) + sqrt(most)};
}

static void check_rows(Rig *r, int blocks) {
    double v[3 * COUNT];
    GroupMotion *motion = arena_push(&r->arena, GroupMotion, r->surface.group_count);
    MotionRows rows = motion_rows_create(&r->surface, COUNT, &r->arena);
    motion_rows_set(&rows, &r->surface, r->slot, COUNT);
    assert_int_equal(rows.block_count, blocks);
    assert_int_equal(rows.block_count + rows.other_count, r->surface.group_count);
    memset(v, 0, sizeof v);
    MotionCopy copy = {&rows, r->lanes.v, v};
    ParallelLoop loop = motion_copy_loop(&copy);
    parallel_for_all(&loop, 1);
    for (int k = 0; k < 3 * COUNT; k++) {
        assert_memory_equal(&v[k], &r->lanes.v[k % 3][r->slot[k / 3]], sizeof *v);
    }
    motion_bound(&rows, 0, rows.block_count, r->lanes.v, motion);
    for (int k = 0; k < rows.block_count; k++) {
        GroupMotion one = motion_of(r, v, rows.blocks[k].group);
        assert_memory_equal(&motion[rows.blocks[k].group], &one, sizeof one);
    }
}

static void check_widths(Rig *r, int blocks) {
    static const char *const names[] = {"scalar", "sse2", "avx2", "avx512"};
    for (int width = 0; width < VECTOR_WIDTHS; width++) {
        setenv("TOILE_VECTORS", names[width], 1);
        check_rows(r, blocks);
    }
    unsetenv("TOILE_VECTORS");
}

/* whole blocks only: the last cells of each row and the last row make smaller groups */
static void test_sheet(void **unused) {
    (void)unused;
    Rig r;
    rig_create(&r, false);
    check_widths(&r, 4 * 3);
    arena_free(&r.arena);
}

/* the last block of each row has its last vertices in the first slots */
static void test_tube(void **unused) {
    (void)unused;
    Rig r;
    rig_create(&r, true);
    check_widths(&r, 4 * 3);
    arena_free(&r.arena);
}

static void test_scattered(void **unused) {
    (void)unused;
    Rig r;
    rig_create(&r, false);
    for (int i = 0; i < COUNT; i++) {
        r.slot[i] = 2 * i;
    }
    check_widths(&r, 0);
    arena_free(&r.arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sheet), cmocka_unit_test(test_tube),
                                       cmocka_unit_test(test_scattered)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
