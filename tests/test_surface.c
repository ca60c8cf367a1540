/* Cells and groups of the surface (surface.h) of cloths of all kinds beside each other. */
#include "sim/contact/surface.h"

#include "tests/support/check.h"

enum { NU = 8, NV = 6, NODES = NU * NV, MOST = 2 * (NU - 1) * (NV - 1) };

static SurfacePanel lattice(Arena *arena, int first) {
    int *triangles = arena_push(arena, int, 3 * MOST), at = 0;
    for (int cell = 0; cell < MOST / 2; cell++) {
        int a = cell / (NU - 1) * NU + cell % (NU - 1);
        int corner[6] = {a, a + 1, a + NU + 1, a, a + NU + 1, a + NU};
        for (int k = 0; k < 6; k++) {
            triangles[at++] = corner[k];
        }
    }
    return (SurfacePanel){.first = first,
                          .vertex_count = NODES,
                          .triangle_count = MOST,
                          .triangles = triangles,
                          .nu = NU,
                          .nv = NV,
                          .h1 = 0.01,
                          .h2 = 0.01};
}

/* every vertex, edge and triangle is in one cell, and cells of lattices are squares */
static void check_surface(const Surface *s, int places, Arena *arena) {
    int *triangles = arena_push(arena, int, s->triangle_count), *vertices, *edges;
    vertices = arena_push(arena, int, places), edges = arena_push(arena, int, s->edge_count);
    for (int g = 0; g < s->group_count; g++) {
        for (int c = s->groups[g].cell_begin; c < s->groups[g].cell_end; c++) {
            const SurfaceCell *cell = &s->cells[c];
            for (int k = 0; k < cell->triangle_count; k++) {
                triangles[cell->triangle[k]]++;
            }
            for (int k = 0; k < cell->vertex_count; k++) {
                vertices[cell->vertex[k]]++;
            }
            for (int k = 0; k < cell->edge_count; k++) {
                edges[cell->edge[k]]++;
            }
            for (int k = 0; k < cell->corner_count; k++) {
                assert_int_equal(s->panel_of[cell->corner[k]], s->groups[g].panel);
            }
            if (s->panels[s->groups[g].panel].nu > 0) {
                assert_int_equal(cell->triangle_count, 2);
                assert_int_equal(cell->corner_count, 4);
            }
        }
    }
    for (int i = 0; i < s->triangle_count; i++) {
        assert_int_equal(triangles[i], 1);
    }
    for (int i = 0; i < s->edge_count; i++) {
        assert_int_equal(edges[i], 1);
    }
    for (int i = 0; i < places; i++) {
        assert_int_equal(vertices[i], 1);
    }
}

/* a lattice after an odd number of triangles, and before some */
static void test_side_by_side(void **unused) {
    (void)unused;
    Arena arena = {0};
    static const int odd[9] = {0, 1, 2, 2, 1, 3, 2, 3, 4};
    SurfacePanel strip = {.vertex_count = 5, .triangle_count = 3, .triangles = odd};
    SurfacePanel panels[3] = {strip, lattice(&arena, 5), strip};
    panels[2].first = 5 + NODES;
    int places = NODES + 10;
    double *start = arena_push(&arena, double, 3 * places);
    for (int i = 0; i < 3 * places; i++) {
        start[i] = (i % 3 + 1) * 0.01 * (i / 3);
    }
    Surface surface = surface_create(panels, 3, start, &arena);
    assert_int_equal(surface.triangle_count, MOST + 6);
    check_surface(&surface, places, &arena);
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_side_by_side)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
