/* Forces of contacts: they carry what rests on something, on both roads; only scenes that show them
 * keep them, and a picture of a run without them is refused. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/state/state.h"
#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/play.h"
#include "tests/support/resume.h"
#include "tests/support/shell.h"

#define STANDARD_GRAVITY 9.81 /* [m/s2] default of a scene */
#define WEIGHT 0.15           /* [kg/m2] of the fabric below */
#define SIDE 0.2              /* [m] */

/* A square over a box of this width; damped, so that it comes to rest. */
static void write_scene(char *text, size_t size, const char *look, const char *solver, double box) {
    snprintf(text, size,
             "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  sheet:\n    damping: 8 1/s\n"
             "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n"
             "    fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3, "
             "bending: 1e-5 N m}}\n    nodes: 11 x 11\n    sides: bounded\n    at: [0, 0, 5 mm]\n  "
             "  look: %s\n"
             "obstacles:\n  box: {box: {size: [%g m, %g m, 10 cm]}, at: [0, 0, -5 cm]}\n%s",
             look, box, box, solver);
}

static Vec3 sum_now(const Play *play) {
    Vec3 sum = vec3(0, 0, 0);
    assert_non_null(play->sim.state.contact_force);
    for (int i = 0; i < play->sim.system.place_count; i++) {
        sum = vec3_add(sum, vec3_load(play->sim.state.contact_force + 3 * (size_t)i));
    }
    return sum;
}

/* [N] all forces together when it has come to rest: their mean over half a second. */
static Vec3 sum_of_forces(const char *solver, double box) {
    char text[1200];
    Play play;
    Vec3 sum = vec3(0, 0, 0);
    write_scene(text, sizeof text, "contact-force", solver, box);
    play_start(&play, text);
    for (int frame = 91; frame <= 105; frame++) {
        play_to(&play, frame / 30.0);
        sum = vec3_axpy(sum, 1.0 / 15.0, sum_now(&play));
    }
    CHECK_AT_MOST(play.sim.statistics.kinetic, 1e-9); /* [J] */
    play_end(&play);
    return sum;
}

/* flat on a wide box, and hanging over the edges of a small one */
static void test_rest(void **unused) {
    (void)unused;
    const double weight = WEIGHT * SIDE * SIDE * STANDARD_GRAVITY;
    const char *solvers[2] = {"solver: {stepper: central}\n",
                              "solver: {stepper: bdf2, step: 1/240 s}\n"};
    for (int k = 0; k < 2; k++) {
        Vec3 flat = sum_of_forces(solvers[k], 0.3);
        CHECK_NEAR(flat.z / weight, 1.0, 1e-6);
        CHECK_AT_MOST(hypot(flat.x, flat.y) / weight, 1e-9);
        Vec3 hanging = sum_of_forces(solvers[k], 0.1);
        CHECK_NEAR(hanging.z / weight, 1.0, 1e-3);
        CHECK_AT_MOST(hypot(hanging.x, hanging.y) / weight, 1e-3);
    }
}

static void write_file(const char *name, const char *look) {
    char text[1200];
    write_scene(text, sizeof text, look, "", 0.1);
    FILE *file = fopen(folder_path(name), "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    fclose(file);
}

static int run(const char *format, char *text, size_t size) {
    char command[1200];
    snprintf(command, sizeof command, format, TOILE_SOURCE_DIR, folder_path(""), folder_path(""));
    return shell_run(command, text, size);
}

static void test_files(void **unused) {
    (void)unused;
    char text[4096];
    Error error = {0};
    write_file("shown.yaml", "contact-force");
    write_file("plain.yaml", "linen");
    assert_int_equal(run("%s/scripts/toile sim %s/shown.yaml -o %s/shown --frames 20 --quiet", text,
                         sizeof text),
                     0);
    assert_int_equal(run("%s/scripts/toile sim %s/plain.yaml -o %s/plain --frames 20 --quiet", text,
                         sizeof text),
                     0);
    for (int k = 0; k < 2; k++) {
        StateReader *reader =
            state_open(folder_path(k == 0 ? "shown/run.states" : "plain/run.states"), &error);
        StateFrame frame;
        StateLayout layout;
        int index;
        assert_non_null(reader);
        state_refresh(reader);
        assert_true(state_read_frame(reader, 19, &frame, &layout, &index, &error));
        assert_int_equal(frame.contact_force != NULL, k == 0);
        state_reader_close(reader);
    }
    assert_int_equal(run("%s/scripts/toile render %s/shown -o %s/shown.png --size 320x180 --quiet",
                         text, sizeof text),
                     0);
    assert_int_equal(run("%s/scripts/toile render %s/plain --look contact-force -o %s/plain.png "
                         "--quiet 2>&1",
                         text, sizeof text),
                     EXIT_BAD_INPUT);
    assert_non_null(strstr(text, "look: contact-force"));
}

/* forces and all */
static void test_resume(void **unused) {
    (void)unused;
    char text[1200];
    write_scene(text, sizeof text, "contact-force", "", 0.1);
    resume_check(text, 12, 30);
}

static int set_up(void **unused) {
    (void)unused;
    return folder_make("contact-force") ? 0 : 1;
}

static int tear_down(void **unused) {
    (void)unused;
    return folder_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_rest), cmocka_unit_test(test_files),
                                       cmocka_unit_test(test_resume)};
    return cmocka_run_group_tests_name("contact_force", tests, set_up, tear_down);
}
