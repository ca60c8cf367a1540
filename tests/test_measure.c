/* measure --crossings: a run that is made here crosses in known frames; the numbers, and the program
 * with its exit codes. Needs toile-render beside this test. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/measure.h"
#include "tests/support/check.h"
#include "tests/support/shell.h"

enum { SIDE = 3, NODES = 2 * SIDE * SIDE, TRIANGLES = 16, FRAMES = 5 };

static char folder[] = "/tmp/toile_test_measure_XXXXXX";
static char program[4096];

/* two sheets of 3 x 3 nodes */
static const int32_t lattice[8] = {SIDE, SIDE, 0, 0, SIDE, SIDE, 0, 0};
static const int32_t node_begin[3] = {0, 9, 18}, triangle_begin[3] = {0, 8, 16};
static const int32_t loop_begin[3] = {0, 1, 2}, outline_begin[3] = {0, 3, 6};
static const double outline[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
static int32_t triangles[3 * TRIANGLES];
static double material[2 * NODES], rest[3 * NODES], x[3 * NODES];

static void make_sheets(void) {
    int at = 0;
    for (int n = 0; n < NODES; n++) {
        double u = n % SIDE, v = n % 9 / SIDE;
        material[2 * n] = rest[3 * n] = 0.1 * u;
        material[2 * n + 1] = rest[3 * n + 1] = 0.1 * v;
        rest[3 * n + 2] = n < 9 ? 0.0 : 0.05;
    }
    for (int cell = 0; cell < 8; cell++) {
        int a = cell / 4 * 9 + cell % 4 / 2 * SIDE + cell % 2;
        const int32_t both[6] = {a, a + 1, a + 4, a, a + 4, a + 3};
        memcpy(triangles + at, both, sizeof both);
        at += 6;
    }
}

/* 0: apart. 1: the corner of the upper sheet pokes through the lower one. 2: the lower sheet is
 * folded over its middle, flat onto itself. 3: the ball comes up between four nodes of the lower
 * sheet. 4: a corner of the upper one touches the lower one. */
static Pose place(int frame) {
    Pose pose = pose_identity();
    pose.shift = vec3(0.05, 0.06, frame == 3 ? -0.029 : -0.2);
    memcpy(x, rest, sizeof x);
    if (frame == 1 || frame == 4) {
        double corner[3] = {0.03, 0.01, frame == 1 ? -0.01 : 0.0};
        memcpy(x + 3 * 9, corner, sizeof corner);
    }
    for (int n = 0; frame == 2 && n < 9; n += SIDE) {
        memcpy(x + 3 * (n + 2), x + 3 * n, 3 * sizeof *x);
    }
    return pose;
}

/* a tall tetrahedron, far below but in frame 0, where its tip comes through the lower sheet */
static const double tip[12] = {0.05, 0.06, 0.01, 0.04, 0.05, -0.3,
                               0.07, 0.05, -0.3, 0.05, 0.08, -0.3};
static const int32_t tip_faces[12] = {1, 3, 2, 0, 1, 2, 0, 2, 3, 0, 3, 1};

static void run_path(const char *name, char path[4200]) {
    snprintf(path, 4200, "%s/%s", folder, name);
}

static const StateCloth cloths[2] = {{.name = "lower", .fabric = "wool", .look = "linen"},
                                     {.name = "upper", .fabric = "wool", .look = "linen"}};

/* meshes: size of the tetrahedron, which is the obstacle instead of the ball; 0: the ball is */
static void write_run(const char *name, int first, int count, bool done, int meshes) {
    StateObstacle ball = {"ball", "clay", {SOLID_SPHERE, {0, 0, 0}, 0.03}, NULL};
    const StateMesh mesh = {4, 4, tip, tip_faces, true, true};
    ball.mesh = meshes ? &mesh : NULL;
    StateHeader header = {.program = "toile test",
                          .scene_path = "s.yaml",
                          .scene_text = "toile: 1",
                          .film = film_default(),
                          .cloth_count = 2,
                          .cloths = cloths,
                          .obstacle_count = 1,
                          .obstacles = &ball};
    StateLayout layout = {.cloth_count = 2,
                          .node_count = NODES,
                          .vertex_count = NODES,
                          .triangle_count = TRIANGLES,
                          .lattice = lattice,
                          .node_begin = node_begin,
                          .vertex_begin = node_begin,
                          .triangle_begin = triangle_begin,
                          .material = material,
                          .rest = rest,
                          .vertex_material = material,
                          .triangles = triangles,
                          .loop_count = 2,
                          .outline_count = 6,
                          .outline = outline,
                          .outline_begin = outline_begin,
                          .loop_begin = loop_begin};
    char path[4200];
    run_path(name, path);
    StateWriter *writer = state_create(path, NULL);
    assert_non_null(writer);
    assert_true(state_write_header(writer, &header, NULL));
    assert_true(state_write_layout(writer, &layout, NULL));
    static const double still[3 * NODES];
    const Pose here = pose_identity();
    for (int i = first; i < first + count; i++) {
        Pose pose = place(i);
        StateFrame frame = {.frame = i - first,
                            .time = 0.1 * i,
                            .x = x,
                            .v = still,
                            .pose_count = 1,
                            .pose = &pose};
        double moved[12];
        for (int k = 0; k < 12; k++) {
            static const double centre[3] = {0.05, 0.06, -0.05};
            moved[k] = centre[k % 3] + meshes * (tip[k] - centre[k % 3]);
            moved[k] -= k % 3 == 2 && i > first ? 0.1 : 0.0;
        }
        frame.moved = moved;
        frame.moved_count = meshes ? 4 : 0;
        frame.pose = meshes ? &here : &pose;
        assert_true(state_write_frame(writer, &frame, NODES, NULL, 0, NULL));
    }
    assert_true(!done || state_write_done(writer, "finished", NULL));
    assert_true(state_close(writer, NULL));
}

static void test_numbers(void **unused) {
    (void)unused;
    char path[4200];
    Error error = {0};
    run_path("all.states", path);
    StateReader *reader = state_open(path, &error);
    assert_non_null(reader);
    state_refresh(reader);
    assert_int_equal(state_frame_count(reader), FRAMES);
    /* frame 1: the two triangles at the corner, each with the triangle below it, and frame 2: the
     * four cells' triangles with their mirror images and with what these touch */
    const int64_t least[FRAMES] = {0, 2, 4, 0, 2}, inside[FRAMES] = {0, 0, 0, 2, 0};
    Arena arena = {0};
    for (int i = 0; i < FRAMES; i++) {
        StateFrame frame;
        StateLayout layout;
        MeasureCrossings found;
        int layout_index;
        assert_true(state_read_frame(reader, i, &frame, &layout, &layout_index, &error));
        assert_true(
            measure_crossings(state_header(reader), &layout, &frame, &arena, &found, &error));
        assert_true(least[i] ? found.cloth >= least[i] : found.cloth == 0);
        assert_int_equal(found.obstacles, inside[i]);
        assert_int_equal(found.obstacle[0], inside[i]);
        assert_int_equal(found.place[0] != 0, least[i] || inside[i]);
        if (i == 1) {
            assert_string_equal(found.place,
                                "lower at (0.0667, 0.0333) m and upper at (0.0667, 0.0333) m");
        } else if (i == 3) {
            assert_string_equal(found.place, "lower at (0.0667, 0.0333) m in ball");
        }
    }
    arena_free(&arena);
    state_reader_close(reader);
}

/* exit code of toile-render measure; what it prints goes to *text */
static int measure(const char *name, const char *options, char *text, size_t size) {
    char command[9000];
    snprintf(command, sizeof command, "%s measure %s/%s %s 2>&1", program, folder, name, options);
    return shell_run(command, text, size);
}

static void test_program(void **unused) {
    (void)unused;
    char text[16384];
    assert_int_equal(measure("clean.states", "--crossings", text, sizeof text), EXIT_OK);
    assert_non_null(strstr(text, "0 crossings in 0 of 1 frames"));
    assert_int_equal(measure("all.states", "--crossings", text, sizeof text), EXIT_DIFFERS);
    assert_non_null(strstr(text, "in 4 of 5 frames"));
    assert_non_null(strstr(text, "lower at (0.0667, 0.0333) m in ball"));
    assert_int_equal(measure("all.states", "--crossings --frames 0", text, sizeof text), EXIT_OK);
    assert_int_equal(measure("all.states", "--crossings --frames 3-4 --json", text, sizeof text),
                     EXIT_DIFFERS);
    assert_non_null(
        strstr(text, "\"frames_checked\": 2, \"frames_crossing\": 2, \"complete\": true"));
    assert_non_null(strstr(text, "\"obstacles\": {\"ball\": 2}"));
    assert_int_equal(measure("mesh.states", "--crossings --json", text, sizeof text), EXIT_DIFFERS);
    assert_non_null(
        strstr(text, "\"frame\": 0, \"time\": 0, \"cloth\": 0, \"obstacles\": {\"ball\": 3}"));
    assert_non_null(strstr(text, "\"obstacles\": {\"ball\": 0}")); /* it went down */
    assert_int_equal(measure("swallowed.states", "--crossings", text, sizeof text), EXIT_DIFFERS);
    assert_non_null(strstr(text, "16 crossings in 1 of 1 frames")); /* both sheets are inside */
    /* the drawn surface of the same frames: the two that only touch a solid are clean */
    assert_int_equal(measure("clean.states", "--crossings --drawn", text, sizeof text), EXIT_OK);
    assert_non_null(strstr(text, "0 crossings in 0 of 1 frames"));
    assert_int_equal(
        measure("all.states", "--crossings --drawn --triangles 4000", text, sizeof text),
        EXIT_DIFFERS);
    assert_non_null(strstr(text, "in 3 of 5 frames"));
    assert_non_null(strstr(text, "lower at ("));
    assert_int_equal(measure("all.states", "--drawn", text, sizeof text), EXIT_USAGE);
    assert_non_null(strstr(text, "--drawn goes with --crossings"));
    /* what was asked for is not there */
    assert_int_equal(measure("all.states", "", text, sizeof text), EXIT_OK);
    assert_null(strstr(text, "drape coefficient")); /* nothing that it hangs on */
    assert_int_equal(measure("all.states", "clean.states --crossings", text, sizeof text),
                     EXIT_USAGE);
    assert_int_equal(measure("all.states", "clean.states --gaps", text, sizeof text), EXIT_USAGE);
    assert_int_equal(measure("all.states", "--gaps", text, sizeof text), EXIT_OK);
    assert_non_null(strstr(text, "crossed in 5 frames"));
    assert_int_equal(measure("all.states", "--gaps --json", text, sizeof text), EXIT_OK);
    assert_non_null(strstr(text, "\"schema\": \"toile-gaps-1\""));
    assert_non_null(strstr(text, "\"complete\": true"));
    assert_int_equal(measure("torn.states", "--gaps", text, sizeof text), EXIT_BAD_INPUT);
    assert_int_equal(measure("all.states", "--crossings --frames 3-9", text, sizeof text),
                     EXIT_USAGE);
    assert_non_null(strstr(text, "frames 0 to 4"));
    assert_int_equal(measure("none.states", "--crossings", text, sizeof text), EXIT_MISSING_INPUT);
    assert_int_equal(measure("open.states", "--crossings", text, sizeof text), EXIT_OK);
    assert_non_null(strstr(text, "not finished"));
    assert_int_equal(measure("torn.states", "--crossings", text, sizeof text), EXIT_BAD_INPUT);
    assert_int_equal(measure("torn.states", "--crossings --frames 0", text, sizeof text), EXIT_OK);
}

/* damages the checksum of the last record */
static void tear(const char *name) {
    char path[4200];
    run_path(name, path);
    FILE *file = fopen(path, "r+");
    assert_non_null(file);
    fseek(file, -1, SEEK_END);
    fputc(0x55, file);
    fclose(file);
}

int main(int argc, char **argv) {
    (void)argc;
    snprintf(program, sizeof program, "%s", argv[0]);
    char *slash = strstr(program, "/tests/");
    if (!slash || !mkdtemp(folder)) {
        fprintf(stderr, "test_measure: must be started as build/CONFIG/tests/test_measure\n");
        return 1;
    }
    strcpy(slash, "/toile-render");
    make_sheets();
    write_run("all.states", 0, FRAMES, true, 0);
    write_run("clean.states", 0, 1, true, 0);
    write_run("open.states", 0, 1, false, 0);
    write_run("torn.states", 0, 2, false, 0);
    tear("torn.states");
    write_run("mesh.states", 0, 2, true, 1);
    write_run("swallowed.states", 0, 1, true, 300);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_program),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
