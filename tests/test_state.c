/* States files: round trip, following a growing file, resuming, and damage. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/state/state.h"
#include "tests/support/check.h"

enum { NODES = 6, FRAMES = 5 };

static char path[] = "/tmp/toile_test_state_XXXXXX";

static const int32_t lattice[4] = {3, 2, 0, 0}, node_begin[2] = {0, NODES};
static const int32_t triangle_begin[2] = {0, 4}, loop_begin[2] = {0, 1}, outline_begin[2] = {0, 3};
static const int32_t triangles[12] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
static const double outline[6] = {0, 0, 1, 0, 0, 1};
static double material[2 * NODES], rest[3 * NODES];

static StateLayout small_layout(void) {
    return (StateLayout){.cloth_count = 1,
                         .node_count = NODES,
                         .vertex_count = NODES,
                         .triangle_count = 4,
                         .lattice = lattice,
                         .node_begin = node_begin,
                         .vertex_begin = node_begin,
                         .triangle_begin = triangle_begin,
                         .material = material,
                         .rest = rest,
                         .vertex_material = material,
                         .triangles = triangles,
                         .loop_count = 1,
                         .outline_count = 3,
                         .outline = outline,
                         .outline_begin = outline_begin,
                         .loop_begin = loop_begin};
}

static void write_frame(StateWriter *writer, int number) {
    double x[3 * NODES], v[3 * NODES], stat[2] = {number, 7};
    for (int i = 0; i < 3 * NODES; i++) {
        x[i] = number + 0.1 * i, v[i] = -number;
    }
    Pose pose = pose_identity();
    StateFrame frame = {
        .frame = number, .time = 0.5 * number, .x = x, .v = v, .pose_count = 1, .pose = &pose};
    StateArray extra[2] = {{"stat", STATE_F64, 1, 2, stat},
                           {"statistics", STATE_U8, 1, 13, "steps\nenergy\n"}};
    assert_true(state_write_frame(writer, &frame, NODES, extra, 2, NULL));
}

static StateWriter *start_file(void) {
    StateCloth cloth = {.name = "sheet", .fabric = "wool", .look = "teal-twill", .thickness = 4e-4};
    StateObstacle obstacle = {"rod", "wood", {SOLID_CAPSULE, {0, 0, 1}, 0.25}, NULL};
    StateHeader header = {.program = "toile test",
                          .scene_path = "s.yaml",
                          .scene_text = "toile: 1",
                          .scene_hash = 0xF000000000000001u,
                          .film = film_default(),
                          .cloth_count = 1,
                          .cloths = &cloth,
                          .obstacle_count = 1,
                          .obstacles = &obstacle};
    StateLayout layout = small_layout();
    StateWriter *writer = state_create(path, NULL);
    assert_non_null(writer);
    assert_true(state_write_header(writer, &header, NULL));
    assert_true(state_write_layout(writer, &layout, NULL));
    return writer;
}

static void write_whole_file(void) {
    StateWriter *writer = start_file();
    for (int i = 0; i < FRAMES; i++) {
        write_frame(writer, i);
    }
    assert_true(state_write_done(writer, "all frames", NULL));
    assert_true(state_close(writer, NULL));
}

static void test_round_trip(void **unused) {
    (void)unused;
    write_whole_file();
    StateReader *reader = state_open(path, NULL);
    assert_non_null(reader);
    assert_int_equal(state_refresh(reader), STATE_FINISHED);
    assert_int_equal(state_frame_count(reader), FRAMES);
    assert_string_equal(state_done_reason(reader), "all frames");
    const StateHeader *header = state_header(reader);
    assert_true(header->scene_hash == 0xF000000000000001u);
    assert_string_equal(header->cloths[0].look, "teal-twill");
    assert_string_equal(header->obstacles[0].name, "rod");
    assert_true(header->obstacles[0].solid.radius == 0.25);
    assert_int_equal(header->film.width, 1280);
    StateFrame frame;
    StateLayout layout;
    assert_true(state_read_frame(reader, 3, &frame, &layout, NULL, NULL));
    assert_int_equal(frame.frame, 3);
    assert_true(frame.x[4] == 3 + 0.1 * 4 && frame.v[0] == -3);
    assert_true(state_frame_statistic(reader, "energy") == 7);
    assert_true(isnan(state_frame_statistic(reader, "speed")));
    double surface[3 * NODES];
    state_surface(&layout, frame.x, surface);
    assert_memory_equal(surface, frame.x, sizeof surface);
    state_reader_close(reader);
}

/* a still mesh, a solid, a mesh that moves */
static void write_meshes(int damage) {
    static const double vertices[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static int32_t faces[6] = {0, 2, 1, 1, 2, 3};
    double moved[12], x[3 * NODES] = {0};
    faces[5] = damage == 1 ? 4 : 3;
    StateMesh still = {3, 1, vertices, faces, false, true};
    StateMesh moving = {4, 2, vertices, faces, true, false};
    StateCloth cloth = {.name = "sheet", .fabric = "wool", .look = "teal-twill", .thickness = 4e-4};
    StateObstacle obstacles[3] = {{"stone", "clay", {SOLID_SPHERE, {0, 0, 0}, 1}, &still},
                                  {"rod", "wood", {SOLID_CAPSULE, {0, 0, 1}, 0.25}, NULL},
                                  {"body", "clay", {SOLID_SPHERE, {0, 0, 0}, 2}, &moving}};
    StateHeader header = {.program = "toile test",
                          .scene_path = "s.yaml",
                          .scene_text = "toile: 1",
                          .film = film_default(),
                          .cloth_count = 1,
                          .cloths = &cloth,
                          .obstacle_count = 3,
                          .obstacles = obstacles};
    StateLayout layout = small_layout();
    StateWriter *writer = state_create(path, NULL);
    assert_non_null(writer);
    assert_true(state_write_header(writer, &header, NULL));
    assert_true(state_write_layout(writer, &layout, NULL));
    Pose poses[3] = {pose_identity(), pose_identity(), pose_identity()};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 12; k++) {
            moved[k] = vertices[k] + i;
        }
        moved[5] = damage == 3 ? NAN : moved[5];
        StateFrame frame = {.frame = i,
                            .x = x,
                            .v = x,
                            .pose_count = 3,
                            .pose = poses,
                            .moved_count = damage == 2 ? 3 : 4,
                            .moved = moved};
        assert_true(state_write_frame(writer, &frame, NODES, NULL, 0, NULL));
    }
    assert_true(state_close(writer, NULL));
}

static void test_meshes(void **unused) {
    (void)unused;
    write_meshes(0);
    StateReader *reader = state_open(path, NULL);
    assert_non_null(reader);
    assert_int_equal(state_refresh(reader), STATE_GROWING);
    assert_int_equal(state_frame_count(reader), 3);
    const StateHeader *header = state_header(reader);
    const StateObstacle *o = header->obstacles;
    assert_true(o[0].mesh && !o[1].mesh && o[2].mesh);
    assert_int_equal(o[0].solid.kind, SOLID_SPHERE);
    assert_true(!o[0].mesh->moves && o[0].mesh->closed && !o[2].mesh->closed);
    assert_true(o[0].mesh->triangle_count == 1 && o[0].mesh->triangles[1] == 2);
    assert_true(o[2].mesh->moves && o[2].mesh->vertex_count == 4 && o[2].mesh->triangles[5] == 3);
    StateFrame frame;
    StateLayout layout;
    assert_true(state_read_frame(reader, 2, &frame, &layout, NULL, NULL));
    assert_int_equal(frame.moved_count, 4);
    assert_true(state_mesh_vertices(header, &frame, 0)[3] == 1.0);
    assert_true(state_mesh_vertices(header, &frame, 2)[3] == 3.0);
    state_reader_close(reader);
    write_meshes(1); /* a triangle that points outside */
    Error error = {0};
    assert_null(state_open(path, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    for (int damage = 2; damage <= 3; damage++) { /* too few vertices, one that is not finite */
        write_meshes(damage);
        reader = state_open(path, NULL);
        assert_int_equal(state_refresh(reader), STATE_DAMAGED);
        assert_int_equal(state_frame_count(reader), 0);
        state_reader_close(reader);
    }
}

static void test_follow_and_resume(void **unused) {
    (void)unused;
    StateWriter *writer = start_file();
    StateReader *reader = state_open(path, NULL);
    assert_int_equal(state_refresh(reader), STATE_GROWING);
    write_frame(writer, 0);
    write_frame(writer, 1);
    assert_int_equal(state_refresh(reader), STATE_GROWING);
    assert_int_equal(state_frame_count(reader), 2);
    write_frame(writer, 2);
    assert_true(state_close(writer, NULL));
    state_reader_close(reader);

    /* a torn record at the end is cut off when the run goes on */
    FILE *file = fopen(path, "ab");
    fputs("FRAMtorn", file);
    fclose(file);
    writer = state_append(path, 1, NULL);
    assert_non_null(writer);
    /* nobody else writes meanwhile, nor empties it */
    Error error = {0};
    assert_null(state_create(path, &error));
    assert_int_equal(error.code, EXIT_IO);
    assert_non_null(strstr(error.text, "another process is writing it"));
    assert_null(state_append(path, 1, NULL));
    write_frame(writer, 2);
    assert_true(state_write_done(writer, "end", NULL));
    assert_true(state_close(writer, NULL));
    reader = state_open(path, NULL);
    assert_int_equal(state_refresh(reader), STATE_FINISHED);
    assert_int_equal(state_frame_count(reader), 3);
    state_reader_close(reader);
}

/* every truncation and every flipped byte is noticed or harmless, never a crash */
static void test_damage(void **unused) {
    (void)unused;
    write_whole_file();
    FILE *file = fopen(path, "rb");
    unsigned char *whole = malloc(1 << 20);
    size_t bytes = fread(whole, 1, 1 << 20, file);
    fclose(file);
    for (size_t at = 0; at < bytes; at += 3) {
        for (int flip = 0; flip < 2; flip++) {
            unsigned char kept = whole[at];
            whole[at] ^= flip ? 0x5a : 0;
            file = fopen(path, "wb");
            fwrite(whole, 1, flip ? bytes : at, file);
            fclose(file);
            whole[at] = kept;
            Error error = {0};
            StateReader *reader = state_open(path, &error);
            if (!reader) {
                assert_int_equal(error.code, EXIT_BAD_INPUT);
                continue;
            }
            StateStatus status = state_refresh(reader);
            assert_true(status != STATE_FINISHED || at >= bytes - 8 || !flip);
            for (int i = 0; i < state_frame_count(reader); i++) {
                StateFrame frame;
                StateLayout layout;
                assert_true(state_read_frame(reader, i, &frame, &layout, NULL, NULL));
                assert_int_equal(frame.frame, i);
            }
            state_reader_close(reader);
        }
    }
    free(whole);
}

/* A record of nearly 2^63 bytes: damage behind good frames, without a sum that overflows. */
static void test_impossible_size(void **unused) {
    (void)unused;
    write_whole_file();
    StateReader *reader = state_open(path, NULL);
    state_refresh(reader);
    int frames = state_frame_count(reader);
    int64_t end = state_frame_end(reader, frames - 1);
    state_reader_close(reader);
    assert_true(frames > 0);
    unsigned char head[24] = "FRAM";
    memset(head + 8, 0xff, 8);
    head[8] = 0xf0, head[15] = 0x7f;
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    assert_int_equal(fseek(file, (long)end, SEEK_SET), 0);
    assert_int_equal(fwrite(head, 1, sizeof head, file), sizeof head);
    fclose(file);
    reader = state_open(path, NULL);
    assert_non_null(reader);
    assert_int_equal(state_refresh(reader), STATE_DAMAGED);
    assert_int_equal(state_frame_count(reader), frames);
    assert_non_null(strstr(state_damage(reader), "size is impossible"));
    state_reader_close(reader);
}

static void test_foreign(void **unused) {
    (void)unused;
    Error error = {0};
    assert_null(state_open("/nonexistent/run.states", &error));
    assert_int_equal(error.code, EXIT_MISSING_INPUT);
    error = (Error){0};
    assert_null(state_open("Makefile", &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, "not a toile states file"));
}

int main(void) {
    int file = mkstemp(path);
    close(file);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),        cmocka_unit_test(test_meshes),
        cmocka_unit_test(test_follow_and_resume), cmocka_unit_test(test_damage),
        cmocka_unit_test(test_impossible_size),   cmocka_unit_test(test_foreign),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
