/* Garments: panels sewn into a ring, their start, their seams in the energy and in the states. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/layout.h"
#include "sim/model/model.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

/* `panels` gores that are together as wide as given at the top and the hem, with arcs for both */
static const char *gore_scene(Arena *arena, int panels, double top, double hem, double length,
                              const char *more) {
    char *text = arena_push(arena, char, 20000), *at = text;
    at += sprintf(at,
                  "toile: 1\ncloth:\n  skirt:\n    model: triangles\n    spacing: 12 mm\n"
                  "    fabric: wool-tropical\n%s    shape:\n      garment:\n        panels:\n",
                  more);
    for (int p = 0; p < panels; p++) {
        at += sprintf(at, "          p%d: {outline: [", p);
        for (int k = 0; k < 10; k++) {
            double t = (k < 5 ? k - 2 : 7 - k) / 2.0, u, v;
            double wide = (k < 5 ? hem : top) / panels;
            if (fabs(hem - top) > 1e-9) {
                double angle = 0.5 * (hem - top) / panels / length; /* half, at the apex */
                u = 0.5 * wide / angle * sin(t * angle), v = -0.5 * wide / angle * cos(t * angle);
            } else {
                u = 0.5 * t * wide, v = k < 5 ? 0.0 : length;
            }
            at += sprintf(at, "%s[%.12f, %.12f]", k ? ", " : "", u, v);
        }
        at += sprintf(at, "]}\n");
    }
    at += sprintf(at, "        seams:\n");
    for (int p = 0; p < panels; p++) {
        at += sprintf(at, "          - [p%d.4-5, p%d.0-9]\n", p, (p + 1) % panels);
    }
    return text;
}

typedef struct Garment {
    Arena arena;
    Scene scene;
    System system;
} Garment;

static void make(Garment *g, int panels, double top, double hem, const char *more) {
    Error error = {0};
    memset(g, 0, sizeof *g);
    const char *text = gore_scene(&g->arena, panels, top, hem, 0.3, more);
    if (!scene_parse("test.yaml", text, strlen(text), NULL, &g->arena, &g->scene, &error) ||
        !system_create(&g->system, &g->scene, 1, &g->arena, &error)) {
        fail_msg("%s", error.text);
    }
}

static const Panel *panel_of(const Garment *g) { return &g->system.cloths[0].panel; }

static int compare_edges(const void *a, const void *b) { return memcmp(a, b, 2 * sizeof(int)); }

static int count_edges(const Panel *p) {
    int count = 3 * p->triangle_count, different = 0;
    int(*edges)[2] = malloc((size_t)count * sizeof *edges);
    for (int k = 0; k < count; k++) {
        int a = p->triangles[k], b = p->triangles[k / 3 * 3 + (k + 1) % 3];
        edges[k][0] = a < b ? a : b, edges[k][1] = a < b ? b : a;
    }
    qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    for (int k = 0; k < count; k++) {
        different += k == 0 || compare_edges(edges[k], edges[k - 1]) != 0;
    }
    free(edges);
    return different;
}

/* sewn gores are a band: as many nodes and triangles as edges, whatever the number of panels */
static void test_topology(void **unused) {
    (void)unused;
    for (int panels = 1; panels <= 6; panels += panels) {
        Garment g;
        make(&g, panels, 0.7, 1.2, "");
        const Panel *p = panel_of(&g);
        double area = 0.0;
        for (int i = 0; i < p->node_count; i++) {
            area += p->area[i];
        }
        CHECK_NEAR(area, shape_area(&g.scene.cloths[0].shape), 1e-12);
        assert_int_equal(p->node_count - count_edges(p) + p->triangle_count, 0);
        /* a seam of 25 pieces shares 26 nodes */
        assert_int_equal(p->vertex_count - p->node_count, 26 * panels);
        arena_free(&g.arena);
    }
}

/* largest strain of any triangle at the start */
static double largest_strain(const Garment *g, double *x) {
    const Panel *p = panel_of(g);
    double worst = 0.0;
    for (int t = 0; t < p->triangle_count; t++) {
        const int *v = p->vertex_triangles + 3 * t, *n = p->triangles + 3 * t;
        double d[2][2];
        Vec3 e[2], f[2];
        for (int k = 0; k < 2; k++) {
            for (int c = 0; c < 2; c++) {
                d[k][c] = p->vertex_material[2 * v[k + 1] + c] - p->vertex_material[2 * v[0] + c];
            }
            e[k] = vec3_sub(vec3_load(x + 3 * n[k + 1]), vec3_load(x + 3 * n[0]));
        }
        double det = d[0][0] * d[1][1] - d[0][1] * d[1][0];
        f[0] = vec3_axpy(vec3_scale(d[1][1] / det, e[0]), -d[0][1] / det, e[1]);
        f[1] = vec3_axpy(vec3_scale(-d[1][0] / det, e[0]), d[0][0] / det, e[1]);
        worst = fmax(worst, fabs(0.5 * (vec3_dot(f[0], f[0]) - 1.0)));
        worst = fmax(worst, fabs(0.5 * (vec3_dot(f[1], f[1]) - 1.0)));
        worst = fmax(worst, fabs(0.5 * vec3_dot(f[0], f[1])));
    }
    return worst;
}

/* gores start on a cone, rectangles on a cylinder: what is left is chords for arcs, of the mesh and of
 * the outline (h^2 / 24 r^2 = 5e-4 for spacings, four times that for the pieces of an arc) */
static void test_start(void **unused) {
    (void)unused;
    const double hems[3] = {0.7, 1.2, 2.0};
    for (int panels = 1; panels <= 6; panels += panels) {
        for (int k = 0; k < 3; k++) {
            Garment g;
            if (panels == 1 && k == 2) {
                continue; /* more than half a disc: its seams have no left and right */
            }
            make(&g, panels, 0.7, hems[k], "");
            double *x = arena_push(&g.arena, double, 3 * g.system.place_count);
            cloth_start(&g.system.cloths[0], x);
            double strain = largest_strain(&g, x);
            print_message("  %d panels, hem %.1f m: %.2g\n", panels, hems[k], strain);
            CHECK_AT_MOST(strain, 1.5e-3);
            arena_free(&g.arena);
        }
    }
}

/* a tube stores B/2 per squared radius and area, whether it has one seam or six */
static void test_bending(void **unused) {
    (void)unused;
    const int counts[3] = {1, 2, 6};
    for (int k = 0; k < 3; k++) {
        Garment g;
        make(&g, counts[k], 0.7, 0.7, "");
        const Cloth *cloth = &g.system.cloths[0];
        double *x = arena_push(&g.arena, double, 3 * g.system.place_count), r = 0.7 / (2.0 * PI);
        cloth_start(cloth, x);
        const Material *m = &cloth->material;
        double exact = 0.5 * m->d11 * 0.7 * 0.3 / (r * r);
        /* without the membrane: triangles of chords are a little short */
        Cloth soft;
        ClothDef def = *cloth->def;
        def.fabric = cloths_fabric(m->density, 1e-9, 0.0, m->d11, 0.0);
        Error error = {0};
        assert_true(cloth_create(&soft, &def, NULL, 0, 1, &g.arena, &error));
        double energy = soft.model->energy(&soft, x);
        print_message("  %d panels: %.4f\n", counts[k], energy / exact);
        CHECK_NEAR(energy / exact, 1.0, 0.03);
        arena_free(&g.arena);
    }
}

/* the gradient along random directions against differences of the energy; no net force or torque */
static void test_gradient(void **unused) {
    (void)unused;
    for (int hinge = 0; hinge < 2; hinge++) {
        Garment g;
        make(&g, 3, 0.7, 1.2, hinge ? "    bending: hinge\n" : "");
        const Cloth *cloth = &g.system.cloths[0];
        int n = 3 * cloth->node_count;
        double *x = arena_push(&g.arena, double, n), *y = arena_push(&g.arena, double, n);
        double *f = arena_push(&g.arena, double, n), *d = arena_push(&g.arena, double, n);
        double along = 0.0, forces = 0.0, size = 0.0, side[2], step = 1e-6;
        cloth_start(cloth, x);
        cloths_shake(x, cloth->node_count, 1e-3, 3);
        cloth->model->add_gradient(cloth, x, f);
        Vec3 force = {0}, torque = {0};
        for (int i = 0; i < cloth->node_count; i++) {
            Vec3 at = vec3_load(f + 3 * i);
            force = vec3_add(force, at);
            torque = vec3_add(torque, vec3_cross(vec3_load(x + 3 * i), at));
            size += vec3_length(at);
        }
        CHECK_AT_MOST(vec3_length(force) / size, 1e-12);
        CHECK_AT_MOST(vec3_length(torque) / size, 1e-12);
        for (int i = 0; i < n; i++) {
            d[i] = hash_random(7, (uint64_t)i);
            along += d[i] * f[i];
            forces += f[i] * f[i];
        }
        for (int s = 0; s < 2; s++) {
            for (int i = 0; i < n; i++) {
                y[i] = x[i] + (s ? -step : step) * d[i];
            }
            side[s] = cloth->model->energy(cloth, y);
        }
        CHECK_AT_MOST(fabs((side[0] - side[1]) / (2 * step) - along) / sqrt(forces * n), 1e-7);
        arena_free(&g.arena);
    }
}

/* K d against differences of the gradient; all but without bending, whose tangent leaves out what
 * moments do to angles */
static void test_hessian(void **unused) {
    (void)unused;
    Garment g;
    make(&g, 3, 0.7, 1.2, "");
    ClothDef def = *g.system.cloths[0].def;
    def.fabric = cloths_fabric(0.2, 1e3, 0.3, 1e-15, 0.0);
    Cloth cloth;
    Error error = {0};
    assert_true(cloth_create(&cloth, &def, NULL, 0, 1, &g.arena, &error));
    int n = 3 * cloth.node_count, pair_count = cloth.model->couple(&cloth, NULL);
    int *pairs = arena_push(&g.arena, int, 2 * pair_count);
    cloth.model->couple(&cloth, pairs);
    BlockMatrix matrix = block_matrix_create(cloth.node_count, pairs, pair_count, &g.arena);
    cloth.model->bind_hessian(&cloth, &matrix, 0, &g.arena);
    double *x = arena_push(&g.arena, double, n), *d = arena_push(&g.arena, double, n);
    double *kd = arena_push(&g.arena, double, n), *side[2], worst = 0.0, size = 0.0;
    double *stress = arena_push(&g.arena, double, cloth.strain_count);
    cloth_start(&cloth, x);
    cloths_shake(x, cloth.node_count, 1e-3, 3);
    cloth.model->stress(&cloth, x, stress);
    cloth.model->add_hessian(&cloth, x, stress, false, matrix.values);
    for (int s = 0; s < 2; s++) {
        double *y = arena_push(&g.arena, double, n);
        side[s] = arena_push(&g.arena, double, n);
        for (int i = 0; i < n; i++) {
            d[i] = hash_random(5, (uint64_t)i);
            y[i] = x[i] + (s ? -1e-6 : 1e-6) * d[i];
        }
        cloth.model->add_gradient(&cloth, y, side[s]);
    }
    block_matrix_multiply(&matrix, d, kd);
    for (int i = 0; i < n; i++) {
        worst = fmax(worst, fabs((side[0][i] - side[1][i]) / 2e-6 - kd[i]));
        size += kd[i] * kd[i];
    }
    CHECK_AT_MOST(worst / sqrt(size), 1e-7);
    arena_free(&g.arena);
}

/* both sides of every seam are at the same place in the states, to the last bit */
static void test_states(void **unused) {
    (void)unused;
    Garment g;
    make(&g, 4, 0.7, 1.2, "");
    const Panel *p = panel_of(&g);
    StateLayout layout = layout_make(&g.system, &g.arena);
    assert_int_equal(layout.vertex_count, p->vertex_count);
    assert_int_equal(layout.node_count, p->node_count);
    double *x = arena_push(&g.arena, double, 3 * p->node_count);
    double *s = arena_push(&g.arena, double, 3 * p->vertex_count);
    int *first = arena_push(&g.arena, int, p->node_count), shared = 0;
    cloths_shake(x, p->node_count, 1.0, 3);
    state_surface(&layout, x, s);
    for (int i = 0; i < p->vertex_count; i++) {
        int node = p->vertex_node[i];
        shared += first[node] > 0;
        first[node] = first[node] ? first[node] : i + 1;
        assert_memory_equal(s + 3 * i, s + 3 * (first[node] - 1), 3 * sizeof(double));
    }
    assert_int_equal(shared, 4 * 26);
    arena_free(&g.arena);
}

/* the top is the edge between the upper ends of the seams: a circle at z = 0, through all panels */
static void test_handles(void **unused) {
    (void)unused;
    Garment g;
    make(&g, 4, 0.7, 1.2, "");
    const Panel *p = panel_of(&g);
    for (int top = 0; top < 2; top++) {
        HandleDef handle = handle_default();
        handle.region = top ? REGION_TOP : REGION_BOTTOM;
        unsigned char *marks = arena_push(&g.arena, unsigned char, p->node_count);
        int count = panel_select(p, &handle, marks), held = 0;
        double low = INFINITY, high = -INFINITY;
        for (int i = 0; i < p->node_count; i++) {
            held += marks[i];
            low = marks[i] ? fmin(low, p->start[3 * i + 2]) : low;
            high = marks[i] ? fmax(high, p->start[3 * i + 2]) : high;
        }
        assert_int_equal(count, held);
        assert_true(count >= 4 * (top ? 12 : 20));
        CHECK_AT_MOST(high - low, 2e-3); /* chords for arcs */
        CHECK_NEAR(high, top ? 0.0 : -0.3 * sqrt(1.0 - pow(0.5 / (0.6 * PI), 2)), 4e-3);
    }
    arena_free(&g.arena);
}

/* long slanted sides are filled at any angle, also of one polygon */
static void test_slanted_sides(void **unused) {
    (void)unused;
    for (int degrees = 5; degrees <= 40; degrees += 7) {
        Arena arena = {0};
        Scene scene;
        System system;
        Error error = {0};
        double half = 0.5 * tan(degrees * PI / 180.0);
        char text[400];
        sprintf(text,
                "toile: 1\ncloth:\n  p:\n    fabric: denim\n    model: triangles\n"
                "    spacing: 15 mm\n    shape: {polygon: {outline: [[%.4f, 0], [%.4f, 0.1],"
                " [0.05, 0.6], [-0.05, 0.6], [%.4f, 0.1], [%.4f, 0]]}}\n",
                half, half + 0.05, -half - 0.05, -half);
        if (!scene_parse("test.yaml", text, strlen(text), NULL, &arena, &scene, &error) ||
            !system_create(&system, &scene, 1, &arena, &error)) {
            fail_msg("%d degrees: %s", degrees, error.text);
        }
        arena_free(&arena);
    }
}

static void expect_error(const char *text, const char *message) {
    Arena arena = {0};
    Scene scene;
    System system;
    Error error = {0};
    bool ok = scene_parse("test.yaml", text, strlen(text), NULL, &arena, &scene, &error) &&
              system_create(&system, &scene, 1, &arena, &error);
    assert_false(ok);
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    if (!strstr(error.text, message)) {
        fail_msg("'%s' is not in '%s'", message, error.text);
    }
    arena_free(&arena);
}

static const char *replace(Arena *arena, const char *text, const char *what, const char *by) {
    const char *at = strstr(text, what);
    assert_non_null(at);
    char *out = arena_push(arena, char, strlen(text) + strlen(by) + 1);
    sprintf(out, "%.*s%s%s", (int)(at - text), text, by, at + strlen(what));
    return out;
}

static void test_errors(void **unused) {
    (void)unused;
    Arena arena = {0};
    const char *good = gore_scene(&arena, 3, 0.7, 1.2, 0.3, "");
    expect_error(replace(&arena, good, "model: triangles", "model: springs"),
                 "model 'springs' has no seams and no meshes; 'triangles' has");
    expect_error(replace(&arena, good, "- [p1.4-5, p2.0-9]", "- [p0.4-5, p1.0-9]"),
                 "panel 'p1' is not sewn to 'p2': panels stand in a ring");
    expect_error(replace(&arena, good, "p1.0-9", "p1.9-0"), "starts 0.");
    expect_error(replace(&arena, good, "p1.0-9", "p1.5-4"), "leave no width");
    expect_error(replace(&arena, good, "p1.0-9", "p9.0-9"), "no panel is called 'p9'");
    expect_error(replace(&arena, good, "p1.0-9", "p1.0-10"), "corners of 'p1' are numbered 0 .. 9");
    expect_error(replace(&arena, good, "p1.0-9", "p1.0-3"), "corner 3 does not follow");
    expect_error(replace(&arena, good, "p1.0-9", "p1.0-9-8"), "2 edges cannot be sewn to 1");
    expect_error(replace(&arena, good, "p1.0-9", "p1"), "a seam wants panel.corner-corner");
    expect_error(replace(&arena, good, "p1.0-9", "p1.9"), "a seam runs from corner to corner");
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_topology), cmocka_unit_test(test_start),
        cmocka_unit_test(test_bending),  cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_hessian),  cmocka_unit_test(test_states),
        cmocka_unit_test(test_handles),  cmocka_unit_test(test_slanted_sides),
        cmocka_unit_test(test_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
