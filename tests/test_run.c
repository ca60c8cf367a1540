/* The program toile-sim as a user runs it: killed at any moment and resumed, interrupted, given
 * damaged files. Needs the program beside this test (build/CONFIG/toile-sim). */
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "sim/base/hash.h"
#include "sim/state/state.h"
#include "tests/support/check.h"
#include "tests/support/shell.h"

static char folder[] = "/tmp/toile_test_run_XXXXXX";
static char program[4096];

/* a scene with everything that a stepper must remember: friction, a moving obstacle, a clamp */
static const char scene_text[] =
    "toile: 1\n"
    "film: {rate: 30, seconds: 3}\n"
    "cloth:\n"
    "  sheet:\n"
    "    shape: {rectangle: {width: 20 cm, height: 16 cm}}\n"
    "    fabric: {weight: 160 g/m2}\n"
    "    nodes: 31 x 25\n"
    "    at: [0, 0, 6 cm]\n"
    "    noise: 0.5 mm\n"
    "handles:\n"
    "  - {clamp: sheet.left}\n"
    "obstacles:\n"
    "  ball: {sphere: {radius: 3 cm}, at: [0, 0, 1 cm], friction: 0.3,\n"
    "         motion: {move: {by: [0, 0, 3 cm], from: 0.2 s, to: 2 s}}}\n";

static void write_text(const char *name, const char *text) {
    char path[4200];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    fputs(text, file);
    fclose(file);
}

/* starts toile-sim on the scene; returns its process */
static pid_t start_sim(const char *run, const char *mode, const char *threads) {
    char scene[4200], out[4200];
    snprintf(scene, sizeof scene, "%s/scene.yaml", folder);
    snprintf(out, sizeof out, "%s/%s", folder, run);
    pid_t child = fork();
    if (child == 0) {
        execl(program, "toile-sim", "sim", scene, "-o", out, "--quiet", "--threads", threads, mode,
              (char *)NULL);
        _exit(127);
    }
    return child;
}

static int wait_for(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

/* hash over every frame's x, v and poses */
static uint64_t run_hash(const char *run, int *frames) {
    char path[4200];
    Error error = {0};
    snprintf(path, sizeof path, "%s/%s/run.states", folder, run);
    StateReader *reader = state_open(path, &error);
    if (!reader) {
        fail_msg("%s", error.text);
    }
    state_refresh(reader);
    uint64_t hash = 0;
    *frames = state_frame_count(reader);
    for (int i = 0; i < *frames; i++) {
        StateFrame frame;
        StateLayout layout;
        assert_true(state_read_frame(reader, i, &frame, &layout, NULL, &error));
        size_t bytes = 3 * (size_t)layout.node_count * sizeof(double);
        uint64_t parts[4] = {hash, hash_bytes(frame.x, bytes), hash_bytes(frame.v, bytes),
                             hash_bytes(frame.pose, (size_t)frame.pose_count * sizeof(Pose))};
        hash = hash_bytes(parts, sizeof parts);
    }
    state_reader_close(reader);
    return hash;
}

static void nap(double seconds) {
    struct timespec t = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};
    nanosleep(&t, NULL);
}

static void test_kill_and_resume(void **unused) {
    (void)unused;
    int frames, whole;
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    assert_int_equal(wait_for(start_sim("whole", "--force", "1")), 0);
    clock_gettime(CLOCK_MONOTONIC, &end);
    double duration =
        (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    uint64_t expected = run_hash("whole", &whole);
    pid_t child = start_sim("killed", "--force", "1");
    for (int k = 0; k < 10; k++) {
        nap(duration * (0.02 + 0.1 * fabs(hash_random(17, (uint64_t)k))));
        kill(child, SIGKILL);
        int code = wait_for(child);
        assert_true(code == 1000 + SIGKILL || code == 0);
        child = start_sim("killed", "--resume", k % 2 ? "2" : "1");
    }
    assert_int_equal(wait_for(child), 0);
    uint64_t hash = run_hash("killed", &frames);
    assert_int_equal(frames, whole);
    assert_true(hash == expected);
}

static void test_interrupt(void **unused) {
    (void)unused;
    pid_t child = start_sim("interrupted", "--force", "1");
    char path[4096];
    snprintf(path, sizeof path, "%s/interrupted/run.states", folder);
    for (int k = 0; k < 3000 && access(path, F_OK) != 0; k++) {
        nap(0.01); /* until it has begun */
    }
    nap(0.1);
    kill(child, SIGINT);
    int code = wait_for(child), frames;
    assert_true(code == EXIT_INTERRUPTED || code == 0);
    assert_int_equal(wait_for(start_sim("interrupted", "--resume", "1")), 0);
    int whole;
    assert_true(run_hash("interrupted", &frames) == run_hash("whole", &whole));
    /* a complete run is left alone */
    assert_int_equal(wait_for(start_sim("interrupted", "--resume", "1")), 0);
}

static void test_foreign_run(void **unused) {
    (void)unused;
    char path[4200];
    snprintf(path, sizeof path, "%s/foreign", folder);
    char command[4400];
    snprintf(command, sizeof command, "mkdir -p %s", path);
    assert_int_equal(system(command), 0);
    write_text("foreign/run.states", "this is not a states file, but somebody may need it\n");
    assert_int_equal(wait_for(start_sim("foreign", "--resume", "1")), EXIT_BAD_INPUT);
    /* nothing of it was lost */
    snprintf(command, sizeof command, "grep -q 'somebody may need it' %s/run.states", path);
    assert_int_equal(system(command), 0);
}

/* a strip that is pulled by 7 cm; what the program says */
static void run_pulled(const char *options, char *text, int room) {
    char command[9000];
    write_text("pulled.yaml",
               "toile: 1\nfilm: {rate: 30, seconds: 1}\ncloth:\n  strip:\n"
               "    shape: {rectangle: {width: 20 cm, height: 8 cm}}\n"
               "    fabric: {weight: 160 g/m2, isotropic: {stretch: 50 N/m, poisson: 0.3, "
               "bending: 1e-5 N m}}\n    nodes: 11 x 5\n"
               "handles:\n  - {hold: strip.left}\n  - {hold: strip.right, move: "
               "{by: [7 cm, 0, 0], from: 0 s, to: 1 s}}\ngravity: 0 m/s2\n"
               "solver: {stepper: central}\n");
    snprintf(command, sizeof command, "%s sim %s/pulled.yaml -o %s/pulled --force %s", program,
             folder, folder, options);
    assert_int_equal(shell_run(command, text, (size_t)room), EXIT_OK);
}

/* pulled farther than cloth can be: said once, with time, cloth and stretch */
static void test_overstretched(void **unused) {
    (void)unused;
    char text[4000];
    run_pulled("--progress none 2>&1", text, sizeof text);
    const char *said = strstr(text, "cloth 'strip' is stretched by 3");
    assert_non_null(said);
    assert_null(strstr(said + 1, "cloth 'strip'"));
}

/* what happened, whether it can be trusted, what it cost */
static void test_summary(void **unused) {
    (void)unused;
    char text[4000];
    run_pulled("--progress none 2>&1", text, sizeof text);
    assert_non_null(strstr(text, "sim: 30 frames, to t = 0.9667 s, in "));
    assert_non_null(strstr(text, " steps by 'central', the last of "));
    assert_non_null(strstr(text, "sim: nothing crossed; least gap of cloth to cloth over 1 mm"));
    assert_non_null(strstr(text, "sim: stretched along its threads by up to 3"));
    assert_non_null(strstr(text, "sim: energy gained from handles "));
    run_pulled("--quiet 2>&1", text, sizeof text);
    assert_string_equal(text, "");
    run_pulled("--quiet --json | python3 -c 'import json, sys; r = json.load(sys.stdin); "
               "print(r[\"frames\"], r[\"quality\"][\"smallest_gap_m\"], "
               "r[\"energy_j\"][\"handles\"] > 0)'",
               text, sizeof text);
    assert_string_equal(text, "30 None True\n");
}

/* more frames than the film has are not promised in silence */
static void test_frames_beyond(void **unused) {
    (void)unused;
    char text[4000];
    run_pulled("--progress none --frames 31 2>&1", text, sizeof text);
    assert_non_null(
        strstr(text, "sim: --frames 31: the film has only 30, and all of them are made\n"));
    run_pulled("--progress none --frames 30 2>&1", text, sizeof text);
    assert_null(strstr(text, "has only"));
}

int main(int argc, char **argv) {
    (void)argc;
    snprintf(program, sizeof program, "%s", argv[0]);
    char *slash = strstr(program, "/tests/");
    if (!slash || !mkdtemp(folder)) {
        fprintf(stderr, "test_run: must be started as build/CONFIG/tests/test_run\n");
        return 1;
    }
    strcpy(slash, "/toile-sim");
    setenv("OMP_WAIT_POLICY", "passive", 1);
    write_text("scene.yaml", scene_text);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kill_and_resume), cmocka_unit_test(test_interrupt),
        cmocka_unit_test(test_foreign_run),     cmocka_unit_test(test_overstretched),
        cmocka_unit_test(test_summary),         cmocka_unit_test(test_frames_beyond),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
