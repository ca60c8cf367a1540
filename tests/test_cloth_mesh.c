/* Cloth out of a file: the same forces as the same triangles made here, welded seams, mirrored charts,
 * and files that are no cloth. */
#include <stdlib.h>
#include <string.h>

#include "sim/model/model.h"
#include "sim/model/panel_mesh.h"
#include "sim/step/system.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/folder.h"

enum { NU = 9, NV = 7, HALF = 4 };
#define SPACING 0.01 /* [m] */

static int vertex(int i, int j) { return j * NU + i; }

/* A sheet of NU x NV vertices in the plane z = 0 of a z-up file, one diagonal in every cell, in
 * millimetres. halves: cut along column HALF, whose vertices are there twice, with (u, v) elsewhere;
 * mirror: u of the second half runs the other way. */
static void write_sheet(const char *name, bool halves, bool mirror) {
    FILE *f = fopen(folder_path(name), "w");
    assert_non_null(f);
    for (int part = 0; part < (halves ? 2 : 1); part++) {
        for (int j = 0; j < NV; j++) {
            for (int i = 0; i < NU; i++) {
                double u = part ? (mirror ? 30.0 - i : i + 20.0) : i;
                fprintf(f, "v %d %d 0\nvt %.3f %.3f\n", 10 * i, 10 * j, u, 1.0 * j + 5.0 * part);
            }
        }
    }
    for (int j = 0; j + 1 < NV; j++) {
        for (int i = 0; i + 1 < NU; i++) {
            int a = vertex(i, j) + 1 + (halves && i >= HALF ? NU * NV : 0);
            fprintf(f, "f %d/%d %d/%d %d/%d\n", a, a, a + 1, a + 1, a + 1 + NU, a + 1 + NU);
            fprintf(f, "f %d/%d %d/%d %d/%d\n", a, a, a + 1 + NU, a + 1 + NU, a + NU, a + NU);
        }
    }
    fclose(f);
}

static const char *scene_text(Arena *arena, const char *mesh, const char *more) {
    char *text = arena_push(arena, char, 2000);
    snprintf(text, 2000,
             "toile: 1\ncloth:\n  sheet:\n    shape: {mesh: {%s}}\n    model: triangles\n"
             "    fabric: wool-tropical\n%s",
             mesh, more);
    return text;
}

static bool make(Arena *arena, const char *mesh, const char *more, System *system, Scene *scene,
                 Error *error) {
    const char *text = scene_text(arena, mesh, more);
    return scene_parse(folder_path("scene.yaml"), text, strlen(text), NULL, arena, scene, error) &&
           system_create(system, scene, 1, arena, error);
}

/* node of the imported cloth at a grid point, by its start */
static int node_at(const Panel *p, int i, int j) {
    for (int n = 0; n < p->node_count; n++) {
        if (fabs(p->start[3 * n] - SPACING * i) < 1e-9 &&
            fabs(p->start[3 * n + 1] - SPACING * j) < 1e-9) {
            return n;
        }
    }
    fail_msg("no node at %d, %d", i, j);
    return -1;
}

/* Energy and forces of a crumpled sheet against the lattice with the same triangles. */
static void check_forces(const char *name, bool halves) {
    Arena arena = {0};
    Scene scene;
    System system;
    Error error = {0};
    char mesh[200];
    snprintf(mesh, sizeof mesh, "file: %s, scale: 1 mm, uv: 1 cm, up: z", name);
    if (!make(&arena, mesh, "", &system, &scene, &error)) {
        fail_msg("%s", error.text);
    }
    const Cloth *cloth = &system.cloths[0];
    ClothDef def =
        cloths_rectangle(SPACING * (NU - 1), SPACING * (NV - 1), NU, NV, scene.cloths[0].fabric);
    Cloth lattice;
    def.model = "triangles", def.membrane = MEMBRANE_TRIANGLES;
    assert_true(cloth_create(&lattice, &def, NULL, 0, 1, &arena, &error));
    assert_int_equal(cloth->node_count, NU * NV);
    assert_int_equal(cloth->panel.vertex_count, NU * NV + (halves ? NV : 0));
    int n = 3 * NU * NV;
    double *x = arena_push(&arena, double, n), *y = arena_push(&arena, double, n);
    double *g = arena_push(&arena, double, n), *h = arena_push(&arena, double, n);
    double size = 0.0, mass = 0.0;
    cloth_start(&lattice, x);
    cloths_shake(x, NU * NV, 2e-3, 4);
    for (int k = 0; k < NU * NV; k++) {
        int node = node_at(&cloth->panel, k % NU, k / NU);
        memcpy(y + 3 * node, x + 3 * k, 3 * sizeof *x);
        mass += cloth->mass[node] - lattice.mass[k];
    }
    CHECK_NEAR(mass, 0.0, 1e-12 * NU * NV * lattice.mass[vertex(1, 1)]);
    double energy = lattice.model->energy(&lattice, x);
    CHECK_NEAR(cloth->model->energy(cloth, y), energy, 1e-9 * energy);
    lattice.model->add_gradient(&lattice, x, g);
    cloth->model->add_gradient(cloth, y, h);
    for (int k = 0; k < n; k++) {
        size = fmax(size, fabs(g[k]));
    }
    for (int k = 0; k < n; k++) {
        int node = node_at(&cloth->panel, k / 3 % NU, k / 3 / NU);
        CHECK_NEAR(h[3 * node + k % 3], g[k], 1e-9 * size);
    }
    /* nothing is stretched or bent where it starts */
    CHECK_AT_MOST(cloth->model->energy(cloth, cloth->panel.start), 1e-12 * energy);
    arena_free(&arena);
}

static void test_forces(void **unused) {
    (void)unused;
    write_sheet("whole.obj", false, false);
    write_sheet("halves.obj", true, false);
    write_sheet("mirror.obj", true, true);
    check_forces("whole.obj", false);
    check_forces("halves.obj", true);
    check_forces("mirror.obj", true);
}

/* the border, not the seam; the node at a place of the texture */
static void test_regions(void **unused) {
    (void)unused;
    Arena arena = {0};
    Scene scene;
    System system;
    Error error = {0};
    if (!make(&arena, "file: halves.obj, scale: 1 mm, uv: 1 cm, up: z",
              "handles:\n  - {hold: sheet.border}\n  - {hold: sheet, nearest: [2 cm, 3 cm]}\n",
              &system, &scene, &error)) {
        fail_msg("%s", error.text);
    }
    const Panel *p = &system.cloths[0].panel;
    assert_int_equal(system.handles[0].count, 2 * (NU + NV) - 4);
    assert_int_equal(system.handles[1].count, 1);
    assert_int_equal(system.handles[1].places[0], node_at(p, 2, 3));
    assert_int_equal(p->loop_count, 2);
    assert_int_equal(p->outline_begin[2], 2 * (2 * (HALF + 1 + NV) - 4));
    arena_free(&arena);
}

static void expect_error(const char *mesh, const char *more, const char *message) {
    Arena arena = {0};
    Scene scene;
    System system;
    Error error = {0};
    assert_false(make(&arena, mesh, more, &system, &scene, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    if (!strstr(error.text, message)) {
        fail_msg("'%s' instead of '%s'", error.text, message);
    }
    arena_free(&arena);
}

static void write_text(const char *name, const char *text) {
    FILE *f = fopen(folder_path(name), "w");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
}

static void test_bad(void **unused) {
    (void)unused;
    const char square[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    char text[500];
    write_text("no-uv.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    expect_error("file: no-uv.obj", "", "it has no texture coordinates");
    snprintf(text, sizeof text, "%sf 1/1 2/2 3/3\nf 1/1 3/3 4/2\n", square);
    write_text("over.obj", text);
    expect_error("file: over.obj", "", "is turned over in its texture coordinates");
    snprintf(text, sizeof text, "%sf 1/1 2/2 3/3\nf 1/1 3/3 4/1\n", square);
    write_text("point.obj", text);
    expect_error("file: point.obj", "", "has no area in its texture coordinates");
    snprintf(text, sizeof text, "%sv 0 0 1\nvt 9 9\nvt 9 8\nvt 8 9\n%s", square,
             "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 1/5 3/7 5/6\n");
    write_text("three.obj", text);
    expect_error("file: three.obj", "", "an edge has more than two triangles");
    expect_error("file: whole.obj, scale: 1 mm, uv: 1 cm", "    nodes: 5 x 5\n",
                 "the nodes of a mesh are those of its file");
    expect_error("file: whole.obj, scale: 1 mm, uv: 1e9 m", "", "is 'uv' right?");
    expect_error("file: whole.obj, scale: 1 mm, uv: 1 cm", "handles:\n  - {hold: sheet.top}\n",
                 "'top' is not a region of 'sheet', a mesh");
    expect_error("file: whole.obj, scale: 1 mm, uv: 1 cm", "    bending: stencil\n", "knows no");
}

/* what starts much larger than it is gets a warning */
static void test_warning(void **unused) {
    (void)unused;
    Arena arena = {0};
    Scene scene;
    System system;
    Error error = {0};
    assert_true(
        make(&arena, "file: whole.obj, scale: 1 cm, uv: 1 cm, up: z", "", &system, &scene, &error));
    bool told = false;
    for (int i = 0; i < scene.warning_count; i++) {
        told = told || strstr(scene.warnings[i], "it starts with 100 times the area") != NULL;
    }
    assert_true(told);
    arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forces),
        cmocka_unit_test(test_regions),
        cmocka_unit_test(test_bad),
        cmocka_unit_test(test_warning),
    };
    if (!folder_make("cloth_mesh")) {
        return EXIT_IO;
    }
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    return folder_remove() == 0 ? failed : EXIT_IO;
}
