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
#include "tests/support/meshes.h"

enum { NU = 9, NV = 7, HALF = 4 };
#define SPACING 0.01 /* [m] */

static int vertex(int i, int j) { return j * NU + i; }

typedef struct Sheet {
    int vertex_count, face_count;
    float x[2 * NU * NV][3], uv[2 * NU * NV][2];
    uint16_t face[2 * NU * NV][3];
} Sheet;

/* A sheet of NU x NV vertices in the plane z = 0 of a z-up file, one diagonal in every cell, in
 * millimetres. halves: cut along column HALF, whose vertices are there twice, with (u, v) elsewhere;
 * mirror: u of the second half runs the other way. */
static const Sheet *make_sheet(bool halves, bool mirror) {
    static Sheet s;
    s.vertex_count = s.face_count = 0;
    for (int part = 0; part < (halves ? 2 : 1); part++) {
        for (int k = 0; k < NU * NV; k++) {
            int i = k % NU, j = k / NU;
            float x[3] = {10.0f * (float)i, 10.0f * (float)j, 0};
            float uv[2] = {(float)i, (float)(j + 5 * part)};
            uv[0] = part ? (mirror ? 30.0f - uv[0] : uv[0] + 20.0f) : uv[0];
            memcpy(s.x[s.vertex_count], x, sizeof x);
            memcpy(s.uv[s.vertex_count++], uv, sizeof uv);
        }
    }
    for (int k = 0; k < NU * NV; k++) {
        if (k % NU + 1 < NU && k / NU + 1 < NV) {
            int a = k + (halves && k % NU >= HALF ? NU * NV : 0);
            int corners[2][3] = {{a, a + 1, a + 1 + NU}, {a, a + 1 + NU, a + NU}};
            for (int c = 0; c < 6; c++) {
                s.face[s.face_count + c / 3][c % 3] = (uint16_t)corners[c / 3][c % 3];
            }
            s.face_count += 2;
        }
    }
    return &s;
}

static void write_obj(FILE *f, const Sheet *s) {
    for (int i = 0; i < s->vertex_count; i++) {
        fprintf(f, "v %g %g 0\nvt %g %g\n", (double)s->x[i][0], (double)s->x[i][1],
                (double)s->uv[i][0], (double)s->uv[i][1]);
    }
    for (int t = 0; t < s->face_count; t++) {
        const uint16_t *n = s->face[t];
        int a = n[0] + 1, b = n[1] + 1, c = n[2] + 1;
        fprintf(f, "f %d/%d %d/%d %d/%d\n", a, a, b, b, c, c);
    }
}

static void write_ply(FILE *f, const Sheet *s) {
    fprintf(f,
            "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
            "property float z\nproperty float s\nproperty float t\nelement face %d\n"
            "property list uchar int vertex_indices\nend_header\n",
            s->vertex_count, s->face_count);
    for (int i = 0; i < s->vertex_count; i++) {
        fprintf(f, "%g %g 0 %g %g\n", (double)s->x[i][0], (double)s->x[i][1], (double)s->uv[i][0],
                (double)s->uv[i][1]);
    }
    for (int t = 0; t < s->face_count; t++) {
        fprintf(f, "3 %d %d %d\n", s->face[t][0], s->face[t][1], s->face[t][2]);
    }
}

/* in a glTF v runs down */
static void write_glb(FILE *f, const Sheet *s) {
    size_t positions = (size_t)s->vertex_count * sizeof s->x[0];
    size_t places = (size_t)s->vertex_count * sizeof s->uv[0];
    size_t faces = (size_t)s->face_count * sizeof s->face[0], size;
    unsigned char *bytes = calloc(1, positions + places + faces + 4);
    memcpy(bytes, s->x, positions);
    for (int i = 0; i < s->vertex_count; i++) {
        float uv[2] = {s->uv[i][0], 1.0f - s->uv[i][1]};
        memcpy(bytes + positions + (size_t)i * sizeof uv, uv, sizeof uv);
    }
    memcpy(bytes + positions + places, s->face, faces);
    char json[1000];
    snprintf(
        json, sizeof json,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
        "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":"
        "{\"POSITION\":0,\"TEXCOORD_0\":1},\"indices\":2}]}],\"buffers\":[{\"byteLength\":%zu}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteOffset\":0,\"byteLength\":%zu},"
        "{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu},"
        "{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":%d,\"type\":\"VEC3\","
        "\"min\":[0,0,0],\"max\":[80,60,0]},"
        "{\"bufferView\":1,\"componentType\":5126,\"count\":%d,\"type\":\"VEC2\"},"
        "{\"bufferView\":2,\"componentType\":5123,\"count\":%d,\"type\":\"SCALAR\"}]}",
        positions + places + faces, positions, positions, places, positions + places, faces,
        s->vertex_count, s->vertex_count, 3 * s->face_count);
    unsigned char *glb = test_glb(json, bytes, (positions + places + faces + 3) / 4 * 4, &size);
    fwrite(glb, 1, size, f);
    free(bytes), free(glb);
}

#define FBX_HEAD                                                                                   \
    "; FBX 7.5.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n"                 \
    "\tFBXVersion: 7500\n}\nGlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n"             \
    "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\", 1\n\t}\n}\nObjects:  {\n"

static void write_fbx(FILE *f, const Sheet *s) {
    fprintf(f, FBX_HEAD "\tGeometry: 1, \"Geometry::\", \"Mesh\" {\n\t\tVertices: *%d {\n\t\t\ta: ",
            3 * s->vertex_count);
    for (int i = 0; i < s->vertex_count; i++) {
        fprintf(f, "%s%g,%g,0", i ? "," : "", (double)s->x[i][0], (double)s->x[i][1]);
    }
    fprintf(f, "\n\t\t}\n\t\tPolygonVertexIndex: *%d {\n\t\t\ta: ", 3 * s->face_count);
    for (int t = 0; t < s->face_count; t++) { /* the last of a polygon is -1 - index */
        fprintf(f, "%s%d,%d,%d", t ? "," : "", s->face[t][0], s->face[t][1], -1 - s->face[t][2]);
    }
    fprintf(f,
            "\n\t\t}\n\t\tGeometryVersion: 124\n\t\tLayerElementUV: 0 {\n\t\t\tVersion: 101\n"
            "\t\t\tName: \"uv\"\n\t\t\tMappingInformationType: \"ByPolygonVertex\"\n"
            "\t\t\tReferenceInformationType: \"IndexToDirect\"\n\t\t\tUV: *%d {\n\t\t\t\ta: ",
            2 * s->vertex_count);
    for (int i = 0; i < s->vertex_count; i++) {
        fprintf(f, "%s%g,%g", i ? "," : "", (double)s->uv[i][0], (double)s->uv[i][1]);
    }
    fprintf(f, "\n\t\t\t}\n\t\t\tUVIndex: *%d {\n\t\t\t\ta: ", 3 * s->face_count);
    for (int k = 0; k < 3 * s->face_count; k++) {
        fprintf(f, "%s%d", k ? "," : "", s->face[k / 3][k % 3]);
    }
    fprintf(f, "\n\t\t\t}\n\t\t}\n\t\tLayer: 0 {\n\t\t\tVersion: 100\n\t\t\tLayerElement:  {\n"
               "\t\t\t\tType: \"LayerElementUV\"\n\t\t\t\tTypedIndex: 0\n\t\t\t}\n\t\t}\n\t}\n"
               "\tModel: 2, \"Model::sheet\", \"Mesh\" {\n\t\tVersion: 232\n\t}\n}\n"
               "Connections:  {\n\tC: \"OO\", 2, 0\n\tC: \"OO\", 1, 2\n}\n");
}

typedef void Write(FILE *file, const Sheet *sheet);

static void write_sheet(const char *name, Write *write, bool halves, bool mirror) {
    FILE *f = fopen(folder_path(name), "wb");
    assert_non_null(f);
    write(f, make_sheet(halves, mirror));
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
    /* which a lattice has too */
    if (!make(&arena, mesh, "    bending: tensor\n", &system, &scene, &error)) {
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
    static const struct {
        const char *ending;
        Write *write;
    } formats[4] = {{"obj", write_obj}, {"ply", write_ply}, {"glb", write_glb}, {"fbx", write_fbx}};
    static const char *const names[3] = {"whole", "halves", "mirror"};
    for (int format = 0; format < 4; format++) {
        for (int kind = 0; kind < 3; kind++) {
            char name[32];
            snprintf(name, sizeof name, "%s.%s", names[kind], formats[format].ending);
            print_message("  %s\n", name);
            write_sheet(name, formats[format].write, kind > 0, kind == 2);
            check_forces(name, kind > 0);
        }
    }
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
