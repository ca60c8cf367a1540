/* scripts/study.py: a table, a CSV and plots of runs that it makes itself. Skipped, aloud, where Python
 * has no numpy or matplotlib. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/base/error.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/shell.h"

static const char *python; /* one that has numpy and matplotlib */

static const char scene_head[] = "toile: 1\n"
                                 "film: {rate: 30, seconds: 2}\n"
                                 "cloth:\n"
                                 "  strip:\n"
                                 "    shape: {rectangle: {width: 5 cm, height: 2 cm}}\n"
                                 "    fabric: wool-tropical\n"
                                 "    nodes: 21 x 9\n"
                                 "    at: [2.5 cm, 0, 0]\n"
                                 "    damping: 8 1/s\n"
                                 "handles: [{clamp: strip.left}]\n";

static void write_scene(const char *name, const char *more) {
    FILE *file = fopen(folder_path(name), "w");
    assert_non_null(file);
    fprintf(file, "%s%s", scene_head, more);
    fclose(file);
}

static int study(const char *scene, const char *options, char *text, size_t size) {
    char command[1024];
    snprintf(command, sizeof command,
             "PYTHON=%s TOILE_BUILD=%s/build/${TOILE_CONFIG:-release} %s/scripts/toile study %s "
             "-o %s.study %s 2>&1",
             python, TOILE_SOURCE_DIR, TOILE_SOURCE_DIR, folder_path(scene), folder_path(scene),
             options);
    return shell_run(command, text, size);
}

static void read_csv(const char *scene, char *text, size_t size) {
    char name[64];
    snprintf(name, sizeof name, "%s.study/study.csv", scene);
    FILE *file = fopen(folder_path(name), "r");
    assert_non_null(file);
    text[fread(text, 1, size - 1, file)] = '\0';
    fclose(file);
}

/* column `index` of the row of a model, a stepper and a number of nodes */
static void cell(const char *csv, const char *row, int index, char out[64]) {
    const char *at = strstr(csv, row);
    assert_non_null(at);
    for (int k = 0; k < index; k++) {
        at = strchr(at, ',') + 1;
    }
    size_t length = strcspn(at, ",\n");
    assert_true(length < 64);
    memcpy(out, at, length);
    out[length] = '\0';
}

/* after "study,": scene, model, stepper, nodes, dt, quantity, value, reference, error */
static double error_of(const char *csv, const char *row) {
    char text[64];
    cell(csv, row, 8, text);
    assert_true(text[0] != '\0');
    return strtod(text, NULL);
}

static bool is_there(const char *file) { return access(folder_path(file), R_OK) == 0; }

/* the exact tip of a strip that hangs: half the spacing, far smaller errors */
static void test_reference(void **unused) {
    (void)unused;
    char text[8192], csv[8192], again[8192];
    write_scene("exact.yaml", "reference: [{cloth: strip, at: [5 cm, 1 cm], is: [16.98862 mm, 0, "
                              "-43.71138 mm]}]\n");
    const char *options = "--nodes 0.5,1 --steppers static --models mlpg,triangles";
    assert_int_equal(study("exact.yaml", options, text, sizeof text), 0);
    read_csv("exact.yaml", csv, sizeof csv);
    double coarse = error_of(csv, "exact,mlpg,static,55,"), fine;
    fine = error_of(csv, "exact,mlpg,static,189,");
    CHECK_NEAR(coarse, 0.0131, 2e-4);
    CHECK_AT_MOST(3.0, coarse / fine);
    CHECK_AT_MOST(error_of(csv, "exact,triangles,static,189,"), 0.003);
    assert_true(is_there("exact.yaml.study/study.png") && is_there("exact.yaml.study/study.svg"));
    /* nothing is done again: the same CPU times */
    assert_int_equal(study("exact.yaml", options, text, sizeof text), 0);
    read_csv("exact.yaml", again, sizeof again);
    assert_string_equal(csv, again);
}

/* without a reference the finest run of the scene's own model counts; what is refused says why;
 * another scene under the same name starts anew */
static void test_finest(void **unused) {
    (void)unused;
    char text[8192], csv[8192], note[64];
    write_scene("swing.yaml", "solver: {stepper: central}\n");
    const char *options = "--nodes 0.5,1 --models mlpg,springs --steppers central,relaxation,typo";
    assert_int_equal(study("swing.yaml", options, text, sizeof text), 0);
    read_csv("swing.yaml", csv, sizeof csv);
    cell(csv, "swing,mlpg,central,189,", 10, note);
    assert_string_equal(note, "the reference");
    CHECK_AT_MOST(error_of(csv, "swing,springs,central,189,"), 0.01);
    CHECK_AT_MOST(error_of(csv, "swing,springs,central,189,"),
                  error_of(csv, "swing,springs,central,55,"));
    assert_non_null(strstr(text, "'typo' is not a stepper")); /* said in the table */
    double before = error_of(csv, "swing,springs,central,189,");
    write_scene("swing.yaml", "solver: {stepper: central}\ngravity: 1 m/s2\n");
    assert_int_equal(study("swing.yaml", "--nodes 1 --models mlpg,springs", text, sizeof text), 0);
    read_csv("swing.yaml", csv, sizeof csv);
    assert_true(error_of(csv, "swing,springs,central,189,") != before);
}

static void test_bad(void **unused) {
    (void)unused;
    char text[8192];
    write_scene("bad.yaml", "gravty: 1 m/s2\n");
    assert_int_equal(study("bad.yaml", "", text, sizeof text), EXIT_BAD_INPUT);
    assert_non_null(strstr(text, "did you mean 'gravity'"));
    assert_int_equal(study("nowhere.yaml", "", text, sizeof text), EXIT_MISSING_INPUT);
    assert_int_equal(study("bad.yaml", "--nodes 0", text, sizeof text), EXIT_USAGE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reference),
        cmocka_unit_test(test_finest),
        cmocka_unit_test(test_bad),
    };
    const char *pythons[] = {getenv("PYTHON"), "/usr/bin/python3", "python3"};
    for (int k = 0; k < 3 && !python; k++) {
        char command[512];
        if (pythons[k]) {
            snprintf(command, sizeof command, "%s -c 'import numpy, matplotlib' 2>/dev/null",
                     pythons[k]);
            python = system(command) == 0 ? pythons[k] : NULL;
        }
    }
    if (!python) {
        printf("SKIPPED: scripts/study.py, for want of python3-matplotlib (scripts/setup.sh)\n");
        return 0;
    }
    if (!folder_make("study")) {
        return EXIT_IO;
    }
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    return folder_remove() == 0 ? failed : EXIT_IO;
}
