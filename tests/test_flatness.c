/* The certificate of neighbouring groups (flatness.h), against the distances of all of their features. */
#include "sim/base/hash.h"
#include "sim/contact/flatness.h"
#include "sim/contact/lists.h"
#include "sim/geom/crossing.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

#define PITCH 0.01 /* [m] of the nodes; blocks are 3 cells long */

typedef struct Rig {
    Bench bench;
    Surface surface;
    Flatness flatness;
    int *groups;
    double *x;
} Rig;

/* blocks at two sides are narrower than others */
static void rig_make(Rig *r, bool sleeve) {
    *r = (Rig){0};
    Fabric fabric = cloths_fabric(0.15, 1000.0, 0.3, 1e-5, 0.0);
    r->bench.cloth = sleeve
                         ? cloths_sleeve(16 * PITCH / 6.2831853, 10 * PITCH, 16, 11, true, fabric)
                         : cloths_rectangle(13 * PITCH, 10 * PITCH, 14, 11, fabric);
    r->bench.scene = cloths_scene(&r->bench.cloth);
    r->bench.scene.solver.self_contact = true;
    bench_build(&r->bench, 0);
    const ContactDef *def = &r->bench.system.contact;
    Arena *arena = &r->bench.arena;
    r->surface = surface_create(def->panels, def->panel_count, def->start, arena);
    r->flatness = flatness_create(&r->surface, arena);
    r->groups = arena_push(arena, int, r->surface.group_count);
    r->x = arena_push(arena, double, 3 * def->vertex_count);
    for (int g = 0; g < r->surface.group_count; g++) {
        r->groups[g] = g;
    }
}

static void rig_fit(const Rig *r) {
    Points x = {r->x};
    flatness_fit(&r->flatness, &r->surface, &x, r->groups, r->surface.group_count);
}

/* nodes where they start, the sheet rolled by `bend` [1/m], noise [m] */
static void rig_place(Rig *r, double bend, double noise) {
    const ContactDef *def = &r->bench.system.contact;
    for (int i = 0; i < 3 * def->vertex_count; i += 3) {
        Vec3 p = vec3_load(def->start + i);
        if (bend > 0.0) {
            p = vec3(sin(bend * p.x) / bend, p.y, (1.0 - cos(bend * p.x)) / bend);
        }
        vec3_store(r->x + i, p);
        for (int a = 0; a < 3; a++) {
            r->x[i + a] += noise * hash_random(3, (uint64_t)(i + a));
        }
    }
    rig_fit(r);
}

static double distance(const Rig *r, PairKind kind, int a, int b, int c, int d) {
    Pair pair = {.kind = kind, .place = {a, b, c, d}};
    Points x = {r->x};
    bool one = kind == PAIR_FACE;
    if (a == c || a == d || (one ? a == b : b == c || b == d)) {
        return INFINITY;
    }
    pair_evaluate(&x, &pair);
    return pair.distance;
}

/* least distance of features of two cells without a common vertex; vertices of the first with triangles */
static double cells_apart(const Rig *r, const SurfaceCell *a, const SurfaceCell *b) {
    const Surface *s = &r->surface;
    double least = INFINITY;
    for (int t = 0; t < b->triangle_count; t++) {
        const int *q = s->triangles + 3 * (size_t)b->triangle[t];
        for (int k = 0; k < a->corner_count; k++) {
            least = fmin(least, distance(r, PAIR_FACE, a->corner[k], q[0], q[1], q[2]));
        }
    }
    for (int i = 0; i < a->edge_count; i++) {
        for (int j = 0; j < b->edge_count; j++) {
            const int *p = s->edges + 2 * (size_t)a->edge[i],
                      *q = s->edges + 2 * (size_t)b->edge[j];
            least = fmin(least, distance(r, PAIR_EDGES, p[0], p[1], q[0], q[1]));
        }
    }
    return least;
}

static double groups_apart(const Rig *r, int first, int second) {
    const SurfaceGroup *a = &r->surface.groups[first], *b = &r->surface.groups[second];
    double least = INFINITY;
    for (int i = a->cell_begin; i < a->cell_end; i++) {
        for (int j = b->cell_begin; j < b->cell_end; j++) {
            const SurfaceCell *p = &r->surface.cells[i], *q = &r->surface.cells[j];
            least = fmin(least, fmin(cells_apart(r, p, q), cells_apart(r, q, p)));
        }
    }
    return least;
}

/* no certificate says more than is true; returns the share of neighbours that have one */
static double share_certified(const Rig *r) {
    double certified = 0.0, neighbours = 0.0;
    for (int a = 0; a < r->surface.group_count; a++) {
        for (int b = a; b < r->surface.group_count; b++) {
            int group[4];
            if (flatness_groups(&r->surface, a, b, group) > 0) {
                double bound = flatness_distance(&r->flatness, &r->surface, a, b);
                CHECK_AT_MOST(bound - groups_apart(r, a, b), 1e-15);
                neighbours++;
                certified += bound > 0.0;
            }
        }
    }
    return certified / neighbours;
}

static void test_bound(void **unused) {
    (void)unused;
    for (int sleeve = 0; sleeve < 2; sleeve++) {
        Rig r;
        rig_make(&r, sleeve);
        for (int k = 0; k < 8; k++) {
            rig_place(&r, sleeve ? 0.0 : 10.0 * k, 0.03 * k * PITCH);
            double share = share_certified(&r);
            CHECK_AT_MOST(k == 0 ? 1.0 - share : 0.0, 0.0);
        }
        arena_free(&r.bench.arena);
    }
}

/* a flat sheet is certified by its altitude; one that turns by 120 degrees in two blocks still is */
static void test_reach(void **unused) {
    (void)unused;
    Rig r;
    rig_make(&r, false);
    rig_place(&r, 0.0, 0.0);
    CHECK_NEAR(flatness_distance(&r.flatness, &r.surface, 0, 1), PITCH * sqrt(0.5), 1e-4 * PITCH);
    rig_place(&r, 120.0 / 57.29578 / (6 * PITCH), 0.0);
    CHECK_AT_MOST(0.1 * PITCH - flatness_distance(&r.flatness, &r.surface, 0, 1), 0.0);
    arena_free(&r.bench.arena);
}

/* A sheet that is said to be a graph does not meet itself; rolled up it is not said to be one, nor is a sleeve. */
static void test_graph(void **unused) {
    (void)unused;
    int graphs = 0, crossing = 0;
    for (int sleeve = 0; sleeve < 2; sleeve++) {
        Rig r;
        rig_make(&r, sleeve);
        const SurfacePanel *panel = &r.bench.system.contact.panels[0];
        for (int k = 0; k < 60; k++) {
            rig_place(&r, sleeve ? 0.0 : 2.0 * k, (sleeve ? 0.001 : 0.04) * k * PITCH);
            Points places = {r.x};
            CrossingMesh mesh = system_mesh(&r.bench.system, r.x, &r.bench.arena);
            bool crosses = crossing_count_self(&mesh, &r.bench.arena).count > 0;
            bool graph = flatness_is_graph(panel, &places);
            CHECK_AT_MOST(graph && (crosses || sleeve) ? 1.0 : 0.0, 0.0);
            CHECK_AT_MOST(k == 0 && !graph && !sleeve ? 1.0 : 0.0, 0.0);
            graphs += graph, crossing += crosses;
        }
        arena_free(&r.bench.arena);
    }
    CHECK_AT_MOST(5 - graphs, 0.0);
    CHECK_AT_MOST(10 - crossing, 0.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bound),
        cmocka_unit_test(test_reach),
        cmocka_unit_test(test_graph),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
