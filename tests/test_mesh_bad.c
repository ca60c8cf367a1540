/* Meshes from strangers: damaged and hostile files end in a message, never in a crash of toile, a
 * hang, or more memory than the child may have. Every file is made here. */
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "sim/base/clock.h"
#include "sim/scene/mesh_import.h"
#include "tests/support/check.h"
#include "tests/support/meshes.h"

#define REFUSED " " /* for any reason: every message has more than one word */
#ifdef __SANITIZE_ADDRESS__
#define MOST_MEMORY 4.0 /* [GiB] of any child; redzones and freed blocks count */
#else
#define MOST_MEMORY 2.0
#endif
#define SLACK 9.0 /* [s] over the limit; the machine may be busy */

static char folder[] = "/tmp/toile_test_mesh_bad_XXXXXX";
static int file_count, refused_count;
static double slowest, patience = 1.0; /* [s] */

/* Imports what is in the folder under `name`. A refusal says why, in the words `message` when these
 * are given ("": it is accepted); NULL: either is right. */
static void try_name(const char *name, bool animated, const char *message) {
    char path[4200];
    Arena arena = {0};
    MeshDef mesh;
    Error error = {0};
    MeshImportDef def = mesh_import_default();
    snprintf(path, sizeof path, "%s/%s", folder, name);
    def.path = path;
    def.animated = animated;
    def.patience = patience;
    double start = clock_seconds();
    bool good = mesh_import(&def, &arena, &mesh, &error);
    double seconds = clock_seconds() - start;
    slowest = fmax(slowest, seconds);
    CHECK_AT_MOST(seconds, patience + SLACK);
    file_count++;
    refused_count += !good;
    if (good) {
        assert_true(mesh.triangle_count > 0 && mesh.vertex_count > 0 && mesh.hash != 0);
        for (int i = 0; i < 3 * mesh.triangle_count; i++) {
            assert_true(mesh.triangles[i] >= 0 && mesh.triangles[i] < mesh.vertex_count);
        }
        for (int k = 0; k < 3; k++) {
            assert_true(isfinite(mesh.low[k]) && isfinite(mesh.high[k]));
        }
    } else {
        assert_true(strlen(error.text) > 10 && error.code >= EXIT_BAD_INPUT);
    }
    if (message && (message[0] ? good || !strstr(error.text, message) : !good)) {
        fail_msg("%s: expected '%s', found '%s'", name, message, good ? "accepted" : error.text);
    }
    arena_free(&arena);
}

static void write_bytes(const char *name, const void *bytes, size_t size) {
    char path[4200];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static void try_bytes(const char *name, const void *bytes, size_t size, bool animated,
                      const char *message) {
    write_bytes(name, bytes, size);
    try_name(name, animated, message);
}

static void try_text(const char *name, const char *text, const char *message) {
    try_bytes(name, text, strlen(text), false, message);
}

/* every format, cut at many places */
static void test_truncated(void **unused) {
    (void)unused;
    for (int i = 0; i < TEST_MESH_COUNT; i++) {
        const TestMesh *mesh = &test_meshes()[i];
        char name[64];
        snprintf(name, sizeof name, "cut.%s", mesh->name);
        for (size_t k = 1; k < 8; k++) {
            try_bytes(name, mesh->bytes, mesh->size * k / 8 + (k & 1), k & 1, NULL);
        }
        try_bytes(name, mesh->bytes, mesh->size - 1, false, NULL);
    }
}

/* every format, single bytes and words changed to what hurts most */
static void test_flipped(void **unused) {
    (void)unused;
    static const unsigned char words[4][4] = {
        {255, 255, 255, 255}, {255, 255, 255, 127}, {0, 0, 0, 128}, {0, 0, 192, 127}};
    for (int i = 0; i < TEST_MESH_COUNT; i++) {
        const TestMesh *mesh = &test_meshes()[i];
        unsigned char *bytes = malloc(mesh->size);
        char name[64];
        snprintf(name, sizeof name, "flipped.%s", mesh->name);
        for (size_t k = 0; k < 6; k++) {
            memcpy(bytes, mesh->bytes, mesh->size);
            size_t at = (mesh->size - 4) * (2 * k + 1) / 12;
            memcpy(bytes + at, words[k % 4], 4);
            try_bytes(name, bytes, mesh->size, k & 1, NULL);
        }
        free(bytes);
    }
}

static void test_nothing(void **unused) {
    (void)unused;
    try_text("empty.obj", "", "it is empty");
    try_text("words.obj", "nothing of this is a mesh\n", "it cannot be read");
    try_text("vertices.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", REFUSED);
    try_text("line.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n", REFUSED);
    try_text("noise.glb", "glTF this is not what it says", "it cannot be read");
    try_text("noise.fbx", "Kaydara FBX Binary  \x1a", REFUSED);
    try_text("noise.stl", "solid of nothing", REFUSED);
    try_text("ending.dae", "<COLLADA/>", "a mesh ends in");
    try_text("ending", "v 0 0 0", "a mesh ends in");
    try_name("missing.obj", false, "there is no such file");
    char command[4200];
    snprintf(command, sizeof command, "mkdir %s/folder.obj && mkfifo %s/pipe.obj", folder, folder);
    assert_int_equal(system(command), 0);
    try_name("folder.obj", false, "not a plain file");
    try_name("pipe.obj", false, "not a plain file");
}

#define TET "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"

static void test_numbers(void **unused) {
    (void)unused;
    try_text("nan.obj", TET "v nan 0 0\nf 1 2 5\n", REFUSED);
    try_text("inf.obj", TET "v inf 0 0\nf 1 2 5\n", NULL);
    try_text("huge.obj", TET "v 1e38 0 0\nf 1 2 5\n", "is 'scale' right?");
    try_text("far.obj", TET "v 1e6 0 0\nf 1 2 5\n", "is 'scale' right?");
    try_text("index.obj", TET "f 1 2 99\n", NULL);
    try_text("below.obj", TET "f -1 -2 -99\n", NULL);
    try_text("largest.obj", TET "f 1 2 4294967297\n", NULL);
    try_text("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "none of its triangles");
    try_text("point.obj", "v 0 0 0\nf 1 1 1\n", "none of its triangles");
    try_text("some-flat.obj", TET "v 2 0 0\nf 1 2 5\n", "");
    try_text("crowded.obj", TET "v 5 5 5\nf 1 2 5\nf 2 1 5\n", "");
    try_text("inside-out.obj",
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\n"
             "f 2 4 3\n",
             "");
    size_t size;
    float data[42];
    const void *good = test_gltf_bytes(&size);
    char *json = test_gltf(NULL, "");
    for (int i = 0; i < 3; i++) {
        /* a position, a time of a key, a quaternion */
        memcpy(data, good, sizeof data);
        data[i == 0 ? 4 : i == 1 ? 31 : 37] = NAN;
        size_t glb_size;
        unsigned char *glb = test_glb(json, data, size, &glb_size);
        try_bytes("nan.glb", glb, glb_size, i > 0, i == 0 ? REFUSED : NULL);
        free(glb);
    }
    free(json);
}

static void test_counts(void **unused) {
    (void)unused;
    static const char ply[] = "ply\nformat %s 1.0\nelement vertex %s\nproperty float x\n"
                              "property float y\nproperty float z\nelement face %s\n"
                              "property list uchar int vertex_indices\nend_header\n"
                              "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    static const char *const counts[][3] = {{"ascii", "3", "10000000"},
                                            {"ascii", "4000000000", "1"},
                                            {"ascii", "-1", "-1"},
                                            {"binary_little_endian", "3", "10000000"},
                                            {"binary_little_endian", "2000000000", "1"},
                                            {"binary_big_endian", "4294967295", "4294967295"}};
    for (int i = 0; i < 6; i++) {
        char text[400];
        snprintf(text, sizeof text, ply, counts[i][0], counts[i][1], counts[i][2]);
        try_text("counts.ply", text, i < 2 ? NULL : REFUSED);
    }
    unsigned char stl[134] = "binary";
    memset(stl + 80, 255, 4);
    try_bytes("counts.stl", stl, sizeof stl, false, REFUSED);
    static const char *const extras[] = {"\"count\":12",           "\"count\":4000000000",
                                         "\"byteLength\":24}",     "\"byteLength\":4000000000}",
                                         "\"byteOffset\":48",      "\"byteOffset\":-48",
                                         "\"bufferView\":0",       "\"bufferView\":77",
                                         "\"componentType\":5123", "\"componentType\":5126",
                                         "\"count\":4,",           "\"count\":400,"};
    size_t size, data_size;
    const void *data = test_gltf_bytes(&data_size);
    for (int i = 0; i < 12; i += 2) {
        char *json = test_gltf(NULL, ""), text[4000];
        char *at = strstr(json, extras[i]);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - json), json, extras[i + 1],
                 at + strlen(extras[i]));
        unsigned char *glb = test_glb(text, data, data_size, &size);
        try_bytes("counts.glb", glb, size, false, NULL);
        free(glb);
        free(json);
    }
}

/* nodes that contain themselves, deep trees, a mesh used a hundred thousand times */
static void test_graphs(void **unused) {
    (void)unused;
    static const char *const nodes[] = {
        "[{\"mesh\":0,\"children\":[0]}]",
        "[{\"mesh\":0,\"children\":[1]},{\"children\":[2]},{\"children\":[1]}]",
        "[{\"mesh\":0,\"children\":[1]},{\"children\":[0]}]",
        "[{\"mesh\":0,\"children\":[1,1,1,1]},{\"children\":[2,2,2,2]},{\"children\":[3,3,3,3]},"
        "{\"children\":[4,4,4,4]},{\"children\":[5,5,5,5]},{\"children\":[6,6,6,6]},"
        "{\"children\":[7,7,7,7]},{\"children\":[8,8,8,8]},{\"children\":[9,9,9,9]},"
        "{\"children\":[10,10,10,10]},{\"children\":[11,11,11,11]},"
        "{\"children\":[12,12,12,12]},{\"children\":[13,13,13,13]},{\"mesh\":0}]",
        "[{\"mesh\":9}]",
        "[{\"mesh\":0,\"children\":[99]}]",
        "[{\"mesh\":0,\"matrix\":[1,0]}]"};
    static const char own[] = "[{\"name\":\"tet\",\"mesh\":0}]";
    size_t size, data_size;
    const void *data = test_gltf_bytes(&data_size);
    for (size_t i = 0; i < sizeof nodes / sizeof nodes[0]; i++) {
        char *json = test_gltf(NULL, ""), text[6000];
        char *at = strstr(json, own);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - json), json, nodes[i],
                 at + sizeof own - 1);
        unsigned char *glb = test_glb(text, data, data_size, &size);
        try_bytes("graph.glb", glb, size, false, i < 4 ? REFUSED : NULL);
        free(glb);
        free(json);
    }
    char *deep = malloc(400000);
    strcpy(deep, "{\"asset\":{\"version\":\"2.0\"},\"extras\":");
    memset(deep + strlen(deep), '[', 300000);
    try_bytes("deep.gltf", deep, 300000, false, REFUSED);
    free(deep);
    const TestMesh *fbx = &test_meshes()[TEST_MESH_COUNT - 1];
    char text[4000];
    snprintf(text, sizeof text, "%.*s\tC: \"OO\", 2, 2\n}\n", (int)fbx->size - 2,
             (const char *)fbx->bytes);
    try_text("cycle.fbx", text, REFUSED);
}

/* files beside a .gltf: only plain names in the same folder are looked at */
static void test_neighbours(void **unused) {
    (void)unused;
    static const char *const uris[] = {
        "missing.bin", "../part.bin", "/etc/passwd", "folder.obj",
        "pipe.obj",    "link.bin",    "empty.bin",   "data:application/octet-stream;base64,AAAA"};
    size_t size;
    write_bytes("part.bin", test_gltf_bytes(&size), 168);
    write_bytes("empty.bin", "", 0);
    char command[4200];
    snprintf(command, sizeof command, "ln -sf /etc/passwd %s/link.bin", folder);
    assert_int_equal(system(command), 0);
    for (size_t i = 0; i < sizeof uris / sizeof uris[0]; i++) {
        char *json = test_gltf(uris[i], "");
        try_text("uri.gltf", json, REFUSED);
        free(json);
    }
    char *json = test_gltf("part.bin", "");
    try_text("uri.gltf", json, "");
    free(json);
}

/* far more triangles than are allowed: by the size of the file, and by its content */
static void test_ten_million(void **unused) {
    (void)unused;
    char path[4200];
    unsigned char head[84] = "ten million";
    uint32_t count = 10000000;
    memcpy(head + 80, &count, 4);
    write_bytes("many.stl", head, sizeof head);
    snprintf(path, sizeof path, "%s/many.stl", folder);
    assert_int_equal(truncate(path, 84 + 50 * (off_t)count), 0); /* takes no place on the disk */
    try_name("many.stl", false, "at most 256 are read");
    count = 5000000;
    memcpy(head + 80, &count, 4);
    write_bytes("many.stl", head, sizeof head);
    assert_int_equal(truncate(path, 84 + 50 * (off_t)count), 0);
    try_name("many.stl", false, REFUSED);
    snprintf(path, sizeof path, "%s/many.obj", folder);
    FILE *file = fopen(path, "w");
    fputs("v 0 0 0\nv 1 0 0\nv 0 1 0\n", file);
    for (int i = 0; i < 10000000; i++) {
        fputs("f 1 2 3\n", file);
    }
    fclose(file);
    patience = MESH_SECONDS;
    try_name("many.obj", false, REFUSED);
}

static void test_summary(void **unused) {
    (void)unused;
    struct rusage used;
    getrusage(RUSAGE_CHILDREN, &used);
    double gib = (double)used.ru_maxrss / (1 << 20);
    print_message("  %d files, %d refused, slowest %.2f s, most memory %.2f GiB\n", file_count,
                  refused_count, slowest, gib);
    assert_true(file_count >= 60);
    CHECK_AT_MOST(gib, MOST_MEMORY);
}

int main(void) {
    if (!mkdtemp(folder)) {
        return 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_truncated),  cmocka_unit_test(test_flipped),
        cmocka_unit_test(test_nothing),    cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_counts),     cmocka_unit_test(test_graphs),
        cmocka_unit_test(test_neighbours), cmocka_unit_test(test_ten_million),
        cmocka_unit_test(test_summary),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
