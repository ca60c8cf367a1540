/* scripts/read_states.py against sim/state: the same numbers, bit for bit, and the same verdict on
 * files that are torn, damaged or foreign. Skipped, aloud, where Python has no numpy. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/state/state.h"
#include "tests/support/check.h"
#include "tests/support/shell.h"

#define GOLDEN TOILE_SOURCE_DIR "/tests/golden/"
#define READER TOILE_SOURCE_DIR "/scripts/read_states.py"

static const char *python; /* one that has numpy */
static char path[] = "/tmp/toile_test_python_XXXXXX";

/* Runs the reader on a file. Returns its exit code; its output goes to `text`. */
static int run(const char *file, const char *option, char *text, size_t size) {
    char command[512];
    snprintf(command, sizeof command, "%s %s %s %s 2>&1", python, READER, file, option);
    return shell_run(command, text, size);
}

static void compare_positions(const char *file) {
    StateReader *reader = state_open(file, NULL);
    assert_non_null(reader);
    state_refresh(reader);
    StateFrame frame;
    StateLayout layout;
    assert_true(state_read_frame(reader, 0, &frame, &layout, NULL, NULL));
    const size_t size = 1 << 20; /* [byte] enough for the positions of the golden files */
    char *text = malloc(size), *cursor = text;
    assert_non_null(text);
    assert_int_equal(run(file, "--frame 0", text, size), 0);
    for (int i = 0; i < 3 * layout.node_count; i++) {
        char *end;
        double value = strtod(cursor, &end);
        assert_true(end != cursor && value == frame.x[i]);
        cursor = end + 1;
    }
    assert_true(*cursor == 0);
    free(text);
    state_reader_close(reader);
}

static void test_positions(void **unused) {
    (void)unused;
    compare_positions(GOLDEN "ball.states");
    compare_positions(GOLDEN "disc.states");
    compare_positions(GOLDEN "sleeve.states");
    compare_positions(GOLDEN "figure.states");
}

/* the frame of disc.states twice more in a file of its own, with statistics */
static void write_file(void) {
    StateReader *reader = state_open(GOLDEN "disc.states", NULL);
    assert_non_null(reader);
    state_refresh(reader);
    StateFrame frame;
    StateLayout layout;
    assert_true(state_read_frame(reader, 0, &frame, &layout, NULL, NULL));
    StateWriter *writer = state_create(path, NULL);
    assert_non_null(writer);
    assert_true(state_write_header(writer, state_header(reader), NULL));
    assert_true(state_write_layout(writer, &layout, NULL));
    for (int i = 0; i < 2; i++) {
        double stat[2] = {10.0 + i, 1.0 / 3.0};
        StateArray extra[2] = {{"stat", STATE_F64, 1, 2, stat},
                               {"statistics", STATE_U8, 1, 13, "steps\nenergy\n"}};
        frame.frame = i, frame.time = i / 7.0;
        assert_true(state_write_frame(writer, &frame, layout.node_count, extra, 2, NULL));
    }
    assert_true(state_close(writer, NULL));
    state_reader_close(reader);
}

static double column(const char *text, int line, const char *name) {
    char head[1024];
    int at = 0;
    snprintf(head, sizeof head, "%.*s", (int)strcspn(text, "\n"), text);
    for (char *word = strtok(head, ","); word && strcmp(word, name) != 0;
         word = strtok(NULL, ",")) {
        at++;
    }
    for (; line > 0; line--) {
        text = strchr(text, '\n') + 1;
    }
    for (; at > 0; at--) {
        text = strchr(text, ',') + 1;
    }
    return strtod(text, NULL);
}

static void test_statistics(void **unused) {
    (void)unused;
    write_file();
    StateReader *reader = state_open(path, NULL);
    assert_non_null(reader);
    state_refresh(reader);
    StateFrame frame;
    StateLayout layout;
    char text[8192];
    assert_int_equal(run(path, "--csv", text, sizeof text), 0);
    for (int i = 0; i < 2; i++) {
        assert_true(state_read_frame(reader, i, &frame, &layout, NULL, NULL));
        double highest = -INFINITY;
        for (int n = 0; n < layout.node_count; n++) {
            highest = fmax(highest, frame.x[3 * n + 2]);
        }
        assert_true(column(text, i + 1, "frame") == frame.frame);
        assert_true(column(text, i + 1, "time") == frame.time);
        assert_true(column(text, i + 1, "z_max") == highest);
        assert_true(column(text, i + 1, "steps") == state_frame_statistic(reader, "steps"));
        assert_true(column(text, i + 1, "energy") == state_frame_statistic(reader, "energy"));
    }
    state_reader_close(reader);
}

static void test_mesh(void **unused) {
    (void)unused;
    char text[8192];
    assert_int_equal(run(GOLDEN "figure.states", "", text, sizeof text), 0);
    assert_non_null(strstr(text, "obstacle figure: mesh, 2304 triangles"));
}

static void test_damage(void **unused) {
    (void)unused;
    char text[8192];
    write_file();
    FILE *file = fopen(path, "ab");
    assert_non_null(file);
    fputs("FRAMtorn", file);
    fclose(file);
    assert_int_equal(run(path, "", text, sizeof text), 0); /* torn: still written */
    assert_non_null(strstr(text, "2 of 1 frames"));
    assert_non_null(strstr(text, "not finished"));
    file = fopen(path, "ab");
    fputs("and no record, for longer than a record head", file);
    fclose(file);
    assert_int_equal(run(path, "", text, sizeof text), EXIT_BAD_INPUT);
    assert_non_null(strstr(text, "damaged at byte"));
    file = fopen(path, "wb");
    fputs("something else that is long enough", file);
    fclose(file);
    assert_int_equal(run(path, "", text, sizeof text), EXIT_BAD_INPUT);
    assert_non_null(strstr(text, "not a toile states file"));
    assert_int_equal(run("/nowhere", "", text, sizeof text), EXIT_MISSING_INPUT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_positions),
        cmocka_unit_test(test_statistics),
        cmocka_unit_test(test_mesh),
        cmocka_unit_test(test_damage),
    };
    if (system("python3 -c 'import numpy' 2>/dev/null") == 0) {
        python = "python3";
    } else if (system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") == 0) {
        python = "/usr/bin/python3";
    } else {
        printf("SKIPPED: scripts/read_states.py, for want of python3-numpy (scripts/setup.sh)\n");
        return 0;
    }
    int file = mkstemp(path);
    if (file < 0) {
        return EXIT_IO;
    }
    close(file);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
