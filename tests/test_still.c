/* A frame that shows what the last one showed is not drawn again, and is the same picture. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#include "render/draw.h"
#include "sim/base/hash.h"
#include "sim/state/state.h"
#include "tests/support/render_child.h"
#include "tests/support/render_states.h"

#define FRAMES 6
#define NODES 16
#define WIDTH 320
#define HEIGHT 180

static char path[] = "/tmp/toile-still-XXXXXX";

typedef struct Task {
    void (*change)(Film *film); /* NULL */
    int first, expected;        /* frame that is drawn first; pictures that may be drawn */
} Task;

/* Hash of the last frame; 0: another number of pictures was drawn than expected. */
static uint64_t draw_task(void *context) {
    const Task *task = context;
    RunDef run_def = run_default();
    run_def.path = path;
    Run run;
    if (!run_open(&run, &run_def, NULL)) {
        return 0;
    }
    Film film = state_header(run.reader)->film;
    if (task->change) {
        task->change(&film);
    }
    DrawDef def = {
        .width = WIDTH, .height = HEIGHT, .film = &film, .quality = quality_find("draft")};
    Drawer *drawer = draw_create(&run, &def, NULL);
    uint64_t hash = 0;
    for (int i = task->first; drawer && i < FRAMES; i++) {
        const Image *image = draw_frame(drawer, i, NULL);
        hash = image ? hash_bytes(image->rgba, (size_t)WIDTH * HEIGHT * IMAGE_CHANNELS) : 0;
    }
    return drawer && draw_count(drawer) == task->expected ? hash : 0;
}

/* The last frame after all others is what it is alone. */
static void check_task(void (*change)(Film *film), int expected) {
    Task all = {change, 0, expected}, alone = {change, FRAMES - 1, 1};
    uint64_t hash = render_child_value(draw_task, &all);
    assert_true(hash != 0);
    assert_true(render_child_value(draw_task, &alone) == hash);
}

static void test_cloth_at_rest(void **state) {
    (void)state;
    check_task(NULL, 1);
}

static void show_time(Film *film) { film->show_time = true; }

static void test_time_is_written_anew(void **state) {
    (void)state;
    check_task(show_time, FRAMES);
}

static void orbit(Film *film) {
    film->move.orbit = 1.0;
    film->move.orbit_end = 2.5 / film->rate; /* frames 0, 1, 2, 3 differ */
}

static void test_camera_comes_to_rest(void **state) {
    (void)state;
    check_task(orbit, 4);
}

static int set_up(void **state) {
    (void)state;
    int file = mkstemp(path);
    return file >= 0 && close(file) == 0 &&
                   render_states_write("roll", path, 0, FRAMES, NODES, NULL, true, NULL)
               ? 0
               : 1;
}

static int tear_down(void **state) {
    (void)state;
    return unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cloth_at_rest),
        cmocka_unit_test(test_time_is_written_anew),
        cmocka_unit_test(test_camera_comes_to_rest),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
