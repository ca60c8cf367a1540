/* export: strain and curvature with known answers, the choice of keys, every format read back byte by
 * byte here and by programs of others, and what must be refused. */
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/export.h"
#include "sim/scene/mesh_import.h"
#include "tests/support/check.h"
#include "tests/support/shell.h"

/* a square whose vertices are its 4 nodes and their middle, and a closed ring of 4 x 2 nodes */
enum { NODES = 12, VERTICES = 13, TRIANGLES = 12, FRAMES = 9 };
#define RATE 25.0
#define ROUND 1.2e-7 /* a float, over the number */

static char folder[] = "/tmp/toile_test_export_XXXXXX";
static char program[4096], text[65536];

static const int32_t lattice[8] = {0, 0, 0, 0, 4, 2, 1, 0};
static const int32_t node_begin[3] = {0, 4, 12}, vertex_begin[3] = {0, 5, 13};
static const int32_t triangle_begin[3] = {0, 4, 12};
static const int32_t loop_begin[3] = {0, 1, 2}, outline_begin[3] = {0, 4, 8};
static const double outline[16] = {0, 0, 1, 0, 1, 1, 0, 1, 0, 0, 2, 0, 2, 0.5, 0, 0.5};
static const double material[24] = {0,   0, 1,   0, 1, 1,   0,   1,   0,   0,   0.5, 0,
                                    1.0, 0, 1.5, 0, 0, 0.5, 0.5, 0.5, 1.0, 0.5, 1.5, 0.5};
static const double vertex_material[26] = {0, 0,   1, 0,   1, 1, 0,   1,   0.5, 0.5, 0,   0,   0.5,
                                           0, 1.0, 0, 1.5, 0, 0, 0.5, 0.5, 0.5, 1.0, 0.5, 1.5, 0.5};
static const int32_t triangles[36] = {0, 1, 4,  1, 2,  4,  2, 3, 4,  3, 0,  4,
                                      5, 6, 10, 5, 10, 9,  6, 7, 11, 6, 11, 10,
                                      7, 8, 12, 7, 12, 11, 8, 5, 9,  8, 9,  12};
static const int32_t w_start[14] = {0, 1, 2, 3, 4, 8, 9, 10, 11, 12, 13, 14, 15, 16};
static const int32_t w_column[16] = {0, 1, 2, 3, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
static const double w_value[16] = {1, 1, 1, 1, 0.25, 0.25, 0.25, 0.25, 1, 1, 1, 1, 1, 1, 1, 1};
static double rest[3 * NODES];

static double coordinate(int node, int axis, int frame) {
    double t = frame / RATE, phase = 0.7 * node + 1.9 * axis;
    return rest[3 * node + axis] + 0.3 * t * t * sin(9 * t + phase) + 0.01 * axis;
}

static StateLayout make_layout(void) {
    return (StateLayout){.cloth_count = 2,
                         .node_count = NODES,
                         .vertex_count = VERTICES,
                         .triangle_count = TRIANGLES,
                         .lattice = lattice,
                         .node_begin = node_begin,
                         .vertex_begin = vertex_begin,
                         .triangle_begin = triangle_begin,
                         .material = material,
                         .rest = rest,
                         .vertex_material = vertex_material,
                         .triangles = triangles,
                         .w_count = 16,
                         .w_start = w_start,
                         .w_column = w_column,
                         .w_value = w_value,
                         .loop_count = 2,
                         .outline_count = 8,
                         .outline = outline,
                         .outline_begin = outline_begin,
                         .loop_begin = loop_begin};
}

static void in_folder(const char *name, char path[4200]) {
    snprintf(path, 4200, "%s/%s", folder, name);
}

/* again: frame before which the layout is written a second time; huge: the frame with a coordinate
 * that no float holds; -1: none */
static void write_run(const char *name, int again, int huge) {
    StateCloth cloths[2] = {
        {.name = "square", .fabric = "wool", .look = "linen", .thickness = 4e-4},
        {.name = "ring", .fabric = "wool", .look = "teal-twill", .thickness = 4e-4}};
    StateHeader header = {.program = "toile test",
                          .scene_path = "s.yaml",
                          .scene_text = "toile: 1",
                          .film = film_default(),
                          .cloth_count = 2,
                          .cloths = cloths};
    header.film.rate = RATE;
    header.film.frame_count = FRAMES;
    StateLayout layout = make_layout();
    char path[4200];
    in_folder(name, path);
    StateWriter *writer = state_create(path, NULL);
    assert_non_null(writer);
    assert_true(state_write_header(writer, &header, NULL));
    assert_true(state_write_layout(writer, &layout, NULL));
    for (int i = 0; i < FRAMES; i++) {
        double x[3 * NODES], v[3 * NODES];
        for (int n = 0; n < 3 * NODES; n++) {
            x[n] = coordinate(n / 3, n % 3, i) * (i == huge ? 1e60 : 1.0);
            v[n] = 0.1 * n - i;
        }
        StateFrame frame = {.frame = i, .time = i / RATE, .x = x, .v = v};
        assert_true(i != again || state_write_layout(writer, &layout, NULL));
        assert_true(state_write_frame(writer, &frame, NODES, NULL, 0, NULL));
    }
    assert_true(state_write_done(writer, "finished", NULL));
    assert_true(state_close(writer, NULL));
}

static int export(const char *run, const char *options) {
    char command[9000];
    snprintf(command, sizeof command, "cd %s && %s export %s %s 2>&1", folder, program, run,
             options);
    return shell_run(command, text, sizeof text);
}

/* where a vertex is, z up */
static void position(int vertex, int frame, double p[3]) {
    for (int k = 0; k < 3; k++) {
        p[k] = 0.0;
        for (int i = w_start[vertex]; i < w_start[vertex + 1]; i++) {
            p[k] += w_value[i] * coordinate(w_column[i], k, frame);
        }
    }
}

static unsigned char *read_bytes(const char *name, size_t *size) {
    char path[4200];
    in_folder(name, path);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    unsigned char *bytes = malloc(1 << 20);
    assert_non_null(bytes);
    *size = fread(bytes, 1, 1 << 20, file);
    bytes[*size] = 0;
    fclose(file);
    return bytes;
}

static uint32_t word(const unsigned char *p, bool big) {
    return big ? (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3]
               : (uint32_t)p[3] << 24 | (uint32_t)p[2] << 16 | (uint32_t)p[1] << 8 | p[0];
}

static double number(const unsigned char *p, bool big) {
    uint32_t bits = word(p, big);
    float value;
    memcpy(&value, &bits, 4);
    return value;
}

/* ---- numbers ---- */

/* a fine strip of 40 x 4 cells: (u, v) -> place(u, v) */
static void make_strip(void (*place)(double u, double v, double p[3]), bool around, Field *field,
                       Arena *arena) {
    enum { NU = 40, NV = 5 };
    int columns = around ? NU : NU - 1;
    double *uv = arena_push(arena, double, 2 * NU * NV),
           *x = arena_push(arena, double, 3 * NU * NV);
    int32_t *faces = arena_push(arena, int32_t, 6 * NU * NV);
    for (int i = 0; i < NU * NV; i++) {
        uv[2 * i] = i % NU / (double)columns;
        uv[2 * i + 1] = 0.025 * (i / NU);
        place(uv[2 * i], uv[2 * i + 1], x + 3 * i);
    }
    int count = 0;
    for (int c = 0; c < columns * (NV - 1); c++) {
        int a = c / columns * NU + c % columns, b = c / columns * NU + (c % columns + 1) % NU;
        int32_t both[6] = {a, b, b + NU, a, b + NU, a + NU};
        memcpy(faces + 3 * count, both, sizeof both);
        count += 2;
    }
    FieldMesh mesh = {NU * NV, count, uv, faces, around ? 1.0 : 0.0};
    *field = field_create(NU * NV, arena);
    field_compute(&mesh, x, field);
}

/* u around a circle, the face outside: it curves away from its face */
static void place_ring(double u, double v, double p[3]) {
    p[0] = cos(2 * PI * u) / (2 * PI), p[1] = sin(2 * PI * u) / (2 * PI), p[2] = v;
}

static void place_sheared(double u, double v, double p[3]) {
    p[0] = 1.1 * u + 0.2 * v, p[1] = 0.9 * v, p[2] = 0.4 * u;
}

/* n x n nodes on a square of 1 m, stretched along u by 1 + u / 10: the strain grows from 0 to 10 %. */
static double mean_error(int n, double growth, Arena *arena) {
    double *uv = arena_push(arena, double, 2 * (size_t)(n * n));
    double *x = arena_push(arena, double, 3 * (size_t)(n * n));
    double *error = arena_push(arena, double, (size_t)(n * n)), sum = 0.0;
    int32_t *faces = arena_push(arena, int32_t, 6 * (size_t)(n * n));
    int count = 0, inner = 0;
    for (int i = 0; i < n * n; i++) {
        double u = (double)(i % n) / (n - 1), v = (double)(i / n) / (n - 1);
        uv[2 * i] = u, uv[2 * i + 1] = v;
        x[3 * i] = 1.02 * u + 0.5 * growth * u * u, x[3 * i + 1] = v;
        if (i % n + 1 < n && i / n + 1 < n) {
            const int32_t both[6] = {i, i + 1, i + n + 1, i, i + n + 1, i + n};
            memcpy(faces + 3 * (size_t)count, both, sizeof both);
            count += 2;
        }
    }
    FieldMesh mesh = {n * n, count, uv, faces, 0.0};
    Field field = field_create(n * n, arena);
    field_find_errors(&mesh, x, &field, error);
    for (int i = 0; i < n * n; i++) {
        bool border = i % n < 2 || i / n < 2 || i % n > n - 3 || i / n > n - 3;
        sum += border ? 0.0 : error[i];
        inner += !border;
    }
    return sum / inner;
}

/* Of a strain g u the means at vertices are exact, and u scatters in a triangle of width h by h / sqrt(12) about the place whose
 * strain the triangle has: the error is g h / sqrt(12). Even strain has none. */
static void test_error(void **unused) {
    (void)unused;
    Arena arena = {0};
    CHECK_AT_MOST(mean_error(11, 0.0, &arena), 1e-12);
    double coarse = mean_error(11, 0.1, &arena), fine = mean_error(21, 0.1, &arena);
    CHECK_NEAR(coarse / fine, 2.0, 1e-6);
    CHECK_NEAR(coarse, 0.1 * 0.1 / sqrt(12.0), 1e-9);
    arena_free(&arena);
}

static void test_fields(void **unused) {
    (void)unused;
    Arena arena = {0};
    Field field;
    make_strip(place_ring, true, &field, &arena);
    for (int i = 0; i < 200; i++) { /* chords of 40 sides: 0.1 % shorter than arcs */
        CHECK_NEAR(field.curvature[3 * i], -2 * PI, 0.01 * 2 * PI);
        CHECK_NEAR(field.curvature[3 * i + 1], 0.0, 0.02);
        CHECK_NEAR(field.strain[3 * i], sin(PI / 40) / (PI / 40) - 1.0, 1e-9);
        CHECK_NEAR(field.strain[3 * i + 2], 0.0, 1e-9);
        CHECK_NEAR(field.normal[3 * i], cos(2 * PI * (i % 40) / 40.0), 0.01);
    }
    make_strip(place_sheared, false, &field, &arena);
    double warp = hypot(1.1, 0.4), weft = hypot(0.2, 0.9);
    for (int i = 0; i < 200; i++) {
        CHECK_NEAR(field.strain[3 * i], warp - 1.0, 1e-12);
        CHECK_NEAR(field.strain[3 * i + 1], weft - 1.0, 1e-12);
        CHECK_NEAR(field.strain[3 * i + 2], asin(0.22 / (warp * weft)), 1e-12);
        CHECK_NEAR(field.curvature[3 * i], 0.0, 1e-12);
    }
    arena_free(&arena);
}

static void test_keys(void **unused) {
    (void)unused;
    /* straight between frames 0, 4, 5, 11: those are found, and nothing is missed */
    const double corner[4][3] = {{0, 0, 1}, {4, 2, 0}, {5, -3, 0}, {11, 1, 1}};
    float x[24];
    double times[12];
    for (int i = 0; i < 12; i++) {
        int c = i < 4 ? 0 : i < 5 ? 1 : 2;
        double part = (i - corner[c][0]) / (corner[c + 1][0] - corner[c][0]);
        for (int k = 0; k < 2; k++) {
            x[2 * i + k] =
                (float)(corner[c][1 + k] + part * (corner[c + 1][1 + k] - corner[c][1 + k]));
        }
        times[i] = 0.5 * i;
    }
    int chosen[12];
    CHECK_AT_MOST(export_choose_keys(x, times, 12, 2, 4, chosen), 1e-6);
    const int expected[4] = {0, 4, 5, 11};
    assert_memory_equal(chosen, expected, sizeof expected);
    /* one fewer: the kink that is left out is the smaller one, and the miss is what it is */
    double miss = export_choose_keys(x, times, 12, 2, 3, chosen);
    assert_true(chosen[1] == 5);
    CHECK_NEAR(miss, fabs(2.0 - (0.0 + 0.8 * -3.0)), 1e-6);
    assert_true(export_choose_keys(x, times, 12, 2, 12, chosen) == 0.0 && chosen[7] == 7);
}

/* ---- files, byte by byte ---- */

static void check_cache(const char *name, int first, int count, bool mdd) {
    size_t size, at = mdd ? 8 + 4 * FRAMES : 32;
    unsigned char *bytes = read_bytes(name, &size);
    assert_int_equal(size, at + 12 * (size_t)count * FRAMES);
    if (mdd) {
        assert_int_equal(word(bytes, true), FRAMES);
        assert_int_equal(word(bytes + 4, true), count);
        CHECK_NEAR(number(bytes + 8 + 4 * 3, true), 3 / RATE, 1e-8);
    } else {
        assert_memory_equal(bytes, "POINTCACHE2\0\1\0\0", 16);
        assert_int_equal(word(bytes + 16, false), count);
        CHECK_NEAR(number(bytes + 20, false), 0.0, 0.0);
        CHECK_NEAR(number(bytes + 24, false), 1 / RATE, 1e-8);
        assert_int_equal(word(bytes + 28, false), FRAMES);
    }
    for (int i = 0; i < FRAMES * count; i++) {
        double p[3];
        position(first + i % count, i / count, p);
        for (int k = 0; k < 3; k++, at += 4) {
            CHECK_NEAR(number(bytes + at, mdd), p[k], ROUND * fmax(1.0, fabs(p[k])));
        }
    }
    free(bytes);
}

static void test_caches(void **unused) {
    (void)unused;
    assert_int_equal(export("run.states", "--as obj-pc2 -o pc2"), EXIT_OK);
    check_cache("pc2/square.pc2", 0, 5, false);
    check_cache("pc2/ring.pc2", 5, 8, false);
    assert_int_equal(export("run.states", "--as obj-mdd -o mdd"), EXIT_OK);
    check_cache("mdd/ring.mdd", 5, 8, true);
    /* the ring has two corners twice: where its seam is, u is 0 and 1 */
    size_t size;
    char *obj = (char *)read_bytes("pc2/ring.obj", &size);
    assert_non_null(strstr(obj, "\no ring\nv "));
    assert_non_null(strstr(obj, "\nvt 0.75 1\nvt 1 0\nvt 1 1\nf "));
    assert_non_null(strstr(obj, "\nf 4/4 1/9 5/10\n"));
    assert_null(strstr(obj, "vn "));
    free(obj);
    /* other units and axes: (x, y, z) -> (x, z, -y) */
    assert_int_equal(export("run.states", "--as obj-pc2 -o up --up y --unit cm --frames 2-3 "
                                          "--pc2-frames"),
                     EXIT_OK);
    unsigned char *bytes = read_bytes("up/square.pc2", &size);
    double p[3];
    position(0, 2, p);
    CHECK_NEAR(number(bytes + 20, false), 2.0, 0.0);
    CHECK_NEAR(number(bytes + 24, false), 1.0, 0.0);
    CHECK_NEAR(number(bytes + 32, false), 100 * p[0], 1e-5);
    CHECK_NEAR(number(bytes + 36, false), 100 * p[2], 1e-5);
    CHECK_NEAR(number(bytes + 40, false), -100 * p[1], 1e-5);
    free(bytes);
}

static void test_ply(void **unused) {
    (void)unused;
    assert_int_equal(export("run.states", "--as ply -o ply"), EXIT_OK);
    size_t size;
    unsigned char *bytes = read_bytes("ply/0008.ply", &size);
    char *end = strstr((char *)bytes, "end_header\n");
    assert_non_null(end);
    assert_non_null(strstr((char *)bytes, "comment toile frame 8 time 0.32 s unit m up +Z\n"));
    unsigned char *row = (unsigned char *)end + 11;
    assert_int_equal(size, (size_t)(row - bytes) + 72 * VERTICES + 13 * TRIANGLES);
    for (int i = 0; i < VERTICES; i++, row += 72) {
        double p[3], length = 0.0;
        position(i, 8, p);
        for (int k = 0; k < 3; k++) {
            CHECK_NEAR(number(row + 4 * k, false), p[k], ROUND * fmax(1.0, fabs(p[k])));
            length += pow(number(row + 12 + 4 * k, false), 2);
        }
        CHECK_NEAR(length, 1.0, 1e-6);
        CHECK_NEAR(number(row + 24, false), vertex_material[2 * i], ROUND);
        assert_int_equal(word(row + 68, false), i >= 5);
    }
    for (int t = 0; t < TRIANGLES; t++, row += 13) {
        assert_int_equal(row[0], 3);
        for (int k = 0; k < 3; k++) {
            assert_int_equal(word(row + 1 + 4 * k, false), triangles[3 * t + k]);
        }
    }
    free(bytes);
}

/* assimp, in the importer of scenes: it turns y up back, and plays the morph targets */
static void check_glb(const char *name, double tolerance) {
    char path[4200];
    in_folder(name, path);
    Arena arena = {0};
    Error error = {0};
    MeshImportDef def = mesh_import_default();
    MeshDef mesh;
    def.path = path;
    def.animated = true;
    def.rate = RATE;
    def.seconds = (FRAMES - 1) / RATE;
    bool good = mesh_import(&def, &arena, &mesh, &error);
    assert_true(good || (printf("%s\n", error.text), false));
    assert_int_equal(mesh.triangle_count, TRIANGLES);
    assert_int_equal(mesh.vertex_count, VERTICES); /* the twins at the seam are joined */
    double *found = arena_push(&arena, double, 3 * VERTICES), worst = 0.0;
    for (int frame = 0; frame < FRAMES; frame++) {
        mesh_positions(&mesh, frame / RATE, found);
        for (int i = 0; i < VERTICES; i++) {
            double p[3], nearest = INFINITY;
            position(i, frame, p);
            for (int n = 0; n < VERTICES; n++) {
                Vec3 d = vec3_sub(vec3_load(found + 3 * n), vec3_load(p));
                nearest = fmin(nearest, vec3_length(d));
            }
            worst = fmax(worst, nearest);
        }
    }
    CHECK_AT_MOST(worst, tolerance);
    arena_free(&arena);
}

static void test_gltf(void **unused) {
    (void)unused;
    assert_int_equal(export("run.states", "--as gltf -o all.glb"), EXIT_OK);
    check_glb("all.glb", 1e-6);
    assert_int_equal(export("run.states", "--as gltf -o few.glb --keys 4 --json"), EXIT_OK);
    const char *miss = strstr(text, "at most ");
    assert_non_null(miss);
    double promised = 1e-3 * atof(miss + 8); /* of one coordinate */
    assert_true(promised > 1e-4);
    check_glb("few.glb", sqrt(3.0) * promised + 1e-6);
    assert_int_equal(export("run.states", "--as gltf -o one.glb --frames 3"), EXIT_OK);
    size_t size;
    unsigned char *bytes = read_bytes("one.glb", &size);
    assert_int_equal(word(bytes + 8, false), size);
    assert_null(strstr((char *)bytes + 20, "animations"));
    free(bytes);
}

/* ---- programs of others ---- */

/* Runs a command that reads files of the folder; aloud when its program is missing. */
static void read_with(const char *what, const char *command_format, const char *file) {
    char command[9000];
    snprintf(command, sizeof command, "cd %s && " /* formats hold: script, file */, folder);
    size_t length = strlen(command);
    snprintf(command + length, sizeof command - length, command_format,
             TOILE_SOURCE_DIR "/tests/support/read_export.py", file);
    int code = shell_run(command, text, sizeof text);
    if (code == 77 || code == 127) {
        printf("SKIPPED: %s does not read %s: not installed\n", what, file);
        return;
    }
    if (code != 0) {
        printf("%s\n", text);
    }
    assert_int_equal(code, 0);
}

static void test_foreign(void **unused) {
    (void)unused;
    assert_int_equal(export("run.states", "--as vtp -o run.pvd"), EXIT_OK);
    assert_int_equal(export("run.states", "--as vtp -o text.pvd --vtp-ascii"), EXIT_OK);
    assert_int_equal(export("run.states", "--as usd -o run.usda"), EXIT_OK);
    static const char vtk[] = "/usr/bin/python3 %s vtk run.states %s 2>&1";
    static const char usd[] = "${TOILE_USD_PYTHON:-python3} %s usd run.states %s 2>&1";
    static const char blender[] = "command -v blender >/dev/null || exit 77; blender -b "
                                  "--factory-startup --python-exit-code 3 --python %s -- blender "
                                  "run.states %s 2>&1";
    read_with("VTK", vtk, "run.pvd");
    read_with("VTK", vtk, "text.pvd");
    read_with("VTK", vtk, "ply");
    read_with("VTK", vtk, "pc2");
    read_with("OpenUSD", usd, "run.usda");
    read_with("Blender", blender, "pc2");
    read_with("Blender", blender, "mdd");
    read_with("Blender", blender, "all.glb");
}

/* a cache that does not belong to its mesh must not pass */
static void test_foreign_notices(void **unused) {
    (void)unused;
    if (system("command -v blender >/dev/null") != 0) {
        printf("SKIPPED: Blender does not refuse a wrong cache: not installed\n");
        return;
    }
    char command[9000];
    snprintf(command, sizeof command,
             "cd %s && rm -rf bad && cp -r pc2 bad && cp bad/square.pc2 bad/ring.pc2 && blender -b "
             "--factory-startup --python-exit-code 3 --python %s -- blender run.states bad 2>&1",
             folder, TOILE_SOURCE_DIR "/tests/support/read_export.py");
    assert_int_not_equal(shell_run(command, text, sizeof text), 0);
}

/* ---- what is refused ---- */

static bool exists(const char *name) {
    char path[4200];
    in_folder(name, path);
    return access(path, F_OK) == 0;
}

static void test_refusals(void **unused) {
    (void)unused;
    assert_int_equal(export("run.states", "--as gltff -o a.glb"), EXIT_USAGE);
    assert_non_null(strstr(text, "did you mean 'gltf'"));
    assert_int_equal(export("run.states", "--as gltf -o a.obj"), EXIT_USAGE);
    assert_int_equal(export("run.states", "--as gltf -o a.glb --up z"), EXIT_USAGE);
    assert_int_equal(export("run.states", "--as gltf -o a.glb --unit cm"), EXIT_USAGE);
    assert_int_equal(export("run.states", "--as ply"), EXIT_USAGE);
    assert_int_equal(export("run.states", "--as ply -o x --frames 3-99"), EXIT_USAGE);
    assert_int_equal(export("none.states", "--as ply -o x"), EXIT_MISSING_INPUT);
    /* a mesh that changes */
    assert_int_equal(export("changing.states", "--as obj-pc2 -o c"), EXIT_BAD_INPUT);
    assert_non_null(strstr(text, "the mesh changes at frame 5"));
    assert_false(exists("c/square.pc2") || exists("c/square.pc2.part"));
    assert_int_equal(export("changing.states", "--as obj-pc2 -o c --frames 5-8"), EXIT_OK);
    assert_int_equal(export("changing.states", "--as ply -o c"), EXIT_OK);
    /* numbers that a float does not hold */
    assert_int_equal(export("huge.states", "--as gltf -o h.glb"), EXIT_BAD_INPUT);
    assert_false(exists("h.glb") || exists("h.glb.part"));
    /* what others wrote stays, what toile wrote is replaced */
    char command[9000];
    snprintf(command, sizeof command, "echo mine > %s/mine.glb", folder);
    assert_int_equal(system(command), 0);
    assert_int_equal(export("run.states", "--as gltf -o mine.glb"), EXIT_IO);
    assert_non_null(strstr(text, "not written by toile"));
    assert_int_equal(export("run.states", "--as gltf -o mine.glb --force"), EXIT_OK);
    assert_int_equal(export("run.states", "--as gltf -o mine.glb"), EXIT_OK);
    assert_int_equal(export("run.states", "--as obj-pc2 -o pc2"), EXIT_OK);
    /* nowhere to write */
    assert_int_equal(export("run.states", "--as usd -o /dev/null/x.usda"), EXIT_IO);
    snprintf(command, sizeof command,
             "(ulimit -f 2; trap '' XFSZ; cd %s; %s export run.states --as "
             "usd -o full.usda) 2>&1",
             folder, program);
    assert_int_equal(shell_run(command, text, sizeof text), EXIT_IO);
    assert_false(exists("full.usda") || exists("full.usda.part"));
}

int main(int argc, char **argv) {
    (void)argc;
    snprintf(program, sizeof program, "%s", argv[0]);
    char *slash = strstr(program, "/tests/");
    if (!slash || !mkdtemp(folder)) {
        fprintf(stderr, "test_export: must be started as build/CONFIG/tests/test_export\n");
        return 1;
    }
    strcpy(slash, "/toile-render");
    char *absolute = realpath(program, NULL);
    snprintf(program, sizeof program, "%s", absolute ? absolute : "");
    free(absolute);
    for (int i = 0; i < NODES; i++) {
        bool ring = i >= 4;
        double angle = PI * material[2 * i];
        rest[3 * i] = ring ? 2 + cos(angle) / PI : material[2 * i];
        rest[3 * i + 1] = ring ? sin(angle) / PI : material[2 * i + 1];
        rest[3 * i + 2] = ring ? material[2 * i + 1] : 0.0;
    }
    write_run("run.states", -1, -1);
    write_run("changing.states", 5, -1);
    write_run("huge.states", -1, 4);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fields),   cmocka_unit_test(test_error),
        cmocka_unit_test(test_keys),     cmocka_unit_test(test_caches),
        cmocka_unit_test(test_ply),      cmocka_unit_test(test_gltf),
        cmocka_unit_test(test_foreign),  cmocka_unit_test(test_foreign_notices),
        cmocka_unit_test(test_refusals),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
