/* scripts/toile as a user types it: names with blanks and quotes, folders of pictures, wrong words, two runs at
 * once, a stdout that is full. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/shell.h"

static char text[16000];

/* runs the front with these words in the folder */
static int toile(const char *words) {
    char command[3000];
    snprintf(command, sizeof command, "cd %s && %s/scripts/toile %s 2>&1", folder_path(""),
             TOILE_SOURCE_DIR, words);
    return shell_run(command, text, sizeof text);
}

static void check_toile(const char *words, int code, const char *said) {
    int got = toile(words);
    if (got != code || !strstr(text, said)) {
        fail_msg("toile %s: %d, not %d with '%s':\n%s", words, got, code, said, text);
    }
}

static void check_file(const char *name) {
    if (access(folder_path(name), F_OK) != 0) {
        fail_msg("no file %s", name);
    }
}

static void test_names(void **state) {
    (void)state;
    check_toile("film scene.yaml -o \"a b/it's.mp4\" --title \"It's \\$HOME \\\"0\\\"\" --quiet", 0,
                "");
    check_file("a b/it's.mp4");
    check_file("a b/it's.run/run.states");
    check_toile("film scene.yaml -o ../$(basename $PWD)/pictures --quiet", 0, "");
    check_file("pictures/0000.png");
    check_file("pictures.run/run.states");
}

static void test_wrong_words(void **state) {
    (void)state;
    check_toile("film", 2, "a scene is missing");
    check_toile("film scene.yaml --titel x", 2, "unknown option --titel");
    check_toile("film scene.yaml --look", 2, "a value is missing after --look");
    check_toile("film scene.yaml --threads x -o w.mp4", 2,
                "expected a whole number from 1 to 1024");
    assert_null(strstr(text, "cannot read")); /* the renderer was not asked */
    check_toile("sim scene.yaml -o r --treads 2", 2, "did you mean '--threads'?");
    check_toile("sim scene.yaml -o r --frames 0", 2, "'0': expected a whole number from 1");
    check_toile("sim scene.yaml -o r --progress loud", 2, "expected auto, json or none");
    check_toile("sim scene.yaml -o", 2, "a value is missing after: -o");
    check_toile("sim scene.yaml --quiet=1", 2, "an option takes no value: --quiet=1");
    check_toile("sim --help", 0, "--threads N");
    check_toile("film --help", 0, "film options:");
    check_toile("help render", 0, "--backdrop FILE");
    check_toile("help film", 0, "film options:");
    check_toile("help reder", 2, "there is help for");
}

static void write_scene(const char *name, const char *shape, const char *more) {
    FILE *file = fopen(folder_path(name), "w");
    fprintf(file,
            "toile: 1\nfilm: {rate: 30, seconds: 0.1, size: 64x64}\ncloth:\n  sheet:\n"
            "    shape: {rectangle: {width: 10 cm, height: 10 cm%s}}\n    fabric: wool-tropical\n"
            "    nodes: 5 x 5\n%s",
            shape, more);
    fclose(file);
}

/* the plan says of nothing that is there that it is skipped */
static void test_skipped(void **state) {
    (void)state;
    check_toile("check scene.yaml", 0, "skipped: air");
    assert_non_null(strstr(text, "skipped: rest curvature"));
    static const char *const airs[] = {"drag: 0.1", "normal_drag: 0.1", "density: 1.2"};
    for (int k = 0; k < 3; k++) {
        char air[64];
        snprintf(air, sizeof air, "air: {%s}\n", airs[k]);
        write_scene("air.yaml", "", air);
        check_toile("check air.yaml", 0, "estimate: ");
        assert_null(strstr(text, "skipped: air"));
    }
    write_scene("rest.yaml", ", rest_curvature: [0 1/m, 5 1/m]", "");
    check_toile("check rest.yaml", 0, "estimate: ");
    assert_null(strstr(text, "skipped: rest curvature"));
}

/* what a model refuses is said with the place of the cloth */
static void test_places(void **state) {
    (void)state;
    write_scene("rbf.yaml", "", "    bending: rbf\nhandles: [{clamp: sheet.left}]\n");
    check_toile("check rbf.yaml", 65, "rbf.yaml:4:3: error: cloth 'sheet': a clamp needs");
    write_scene("inside.yaml", "", "obstacles: {ball: {sphere: {radius: 6 cm}}}\n");
    check_toile("sim inside.yaml -o inside.run", 65,
                "inside.yaml:4:3: error: cloth 'sheet' starts inside obstacle 'ball', 60 mm deep");
}

/* the second of two that would write one run is refused, and the first is not disturbed */
static void test_two_at_once(void **state) {
    (void)state;
    char command[3000];
    snprintf(command, sizeof command,
             "cd %s && { exec 9>>scene.run/run.states; flock 9; %s/scripts/toile sim scene.yaml -o "
             "scene.run "
             "--force; echo code $?; %s/scripts/toile film scene.yaml; echo code $?; } 2>&1",
             folder_path(""), TOILE_SOURCE_DIR, TOILE_SOURCE_DIR);
    if (shell_run("command -v flock", text, sizeof text) != 0) {
        printf("SKIPPED: two at once: flock is not installed\n");
        return;
    }
    check_toile("sim scene.yaml -o scene.run --frames 2 --force --quiet", 0, "");
    assert_int_equal(shell_run(command, text, sizeof text), 0);
    for (const char *at = text, *k = "12"; *k; k++) {
        at = strstr(at, "another process is writing it\n");
        at = at ? strstr(at, "code 74\n") : NULL;
        if (!at) {
            fail_msg("%s", text);
        }
    }
    check_toile("sim scene.yaml -o scene.run --quiet", 0, "");
}

static void test_full_stdout(void **state) {
    (void)state;
    if (access("/dev/full", W_OK) != 0) {
        printf("SKIPPED: a full stdout: there is no /dev/full\n");
        return;
    }
    static const char *const verbs[] = {"check scene.yaml", "help scene", "fabrics",
                                        "measure scene.run --json"};
    for (size_t i = 0; i < sizeof verbs / sizeof *verbs; i++) {
        char command[3000];
        snprintf(command, sizeof command, "cd %s && { %s/scripts/toile %s >/dev/full; } 2>&1",
                 folder_path(""), TOILE_SOURCE_DIR, verbs[i]);
        assert_int_equal(shell_run(command, text, sizeof text), 74);
        assert_non_null(strstr(text, "stdout could not be written"));
    }
}

static int set_up(void **state) {
    (void)state;
    if (!folder_make("front")) {
        return 1;
    }
    write_scene("scene.yaml", "", "");
    return toile("sim scene.yaml -o scene.run --quiet; mkdir 'a b'");
}

static int tear_down(void **state) {
    (void)state;
    return folder_remove();
}

int main(int argc, char **argv) {
    (void)argc;
    char build[4096];
    snprintf(build, sizeof build, "%s", argv[0]);
    char *slash = strstr(build, "/tests/");
    if (!slash) {
        fprintf(stderr, "test_front: must be started as build/CONFIG/tests/test_front\n");
        return 1;
    }
    *slash = '\0';
    char *whole = realpath(build, NULL);
    setenv("TOILE_BUILD", whole, 1);
    free(whole);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_names),       cmocka_unit_test(test_wrong_words),
        cmocka_unit_test(test_skipped),     cmocka_unit_test(test_places),
        cmocka_unit_test(test_two_at_once), cmocka_unit_test(test_full_stdout),
    };
    return cmocka_run_group_tests_name("front", tests, set_up, tear_down);
}
