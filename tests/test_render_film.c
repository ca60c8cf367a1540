/* From a run to files: videos, sequences, following a growing run, interruption, determinism. */
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "render/command.h"
#include "render/gl.h"
#include "render/interrupt.h"
#include "render/output.h"
#include "render/video.h"
#include "sim/base/hash.h"
#include "tests/support/render_child.h"
#include "tests/support/render_states.h"

#define FRAMES 6
#define NODES 16
#define WIDTH 320
#define HEIGHT 180

static char folder[] = "/tmp/toile-film-XXXXXX";
static char paths[8][128]; /* a ring of names inside the folder */

static const char *in_folder(const char *name) {
    static int next = 0;
    char *path = paths[next++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static Options options_for(const char *run, const char *output) {
    Options options = options_default();
    options.run.path = run;
    options.output = output;
    options.width = WIDTH;
    options.height = HEIGHT;
    options.quality = quality_find("draft");
    options.threads = 1;
    options.quiet = true;
    return options;
}

static int render_in_child(void *context) {
    Error error = {0};
    interrupt_install();
    ExitCode code = command_render(context, &error);
    return (int)code;
}

static int render(Options options) {
    return render_child_wait(render_child_start(render_in_child, &options));
}

static int set_up(void **state) {
    (void)state;
    return mkdtemp(folder) &&
                   render_states_write("table", in_folder("table.states"), 0, FRAMES, NODES, NULL,
                                       true, NULL) &&
                   render_states_write("sleeve", in_folder("sleeve.states"), 0, FRAMES, NODES, NULL,
                                       true, NULL)
               ? 0
               : 1;
}

static int tear_down(void **state) {
    (void)state;
    char command[256];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

/* ---- determinism ---- */

typedef struct DrawTask {
    int threads, first, last; /* draws frames first .. last */
    const char *backend;      /* NULL: the usual one */
} DrawTask;

/* Hash of the last picture. */
static uint64_t draw_task(void *context) {
    const DrawTask *task = context;
    if (task->backend) {
        setenv("TOILE_GL", task->backend, 1);
    }
    RunDef run_def = run_default();
    run_def.path = in_folder("table.states");
    DrawDef def = {.width = WIDTH,
                   .height = HEIGHT,
                   .quality = quality_find("standard"),
                   .threads = task->threads};
    Run run;
    uint64_t hash = 0;
    if (run_open(&run, &run_def, NULL)) {
        Drawer *drawer = draw_create(&run, &def, NULL);
        for (int i = task->first; drawer && i <= task->last; i++) {
            const Image *image = draw_frame(drawer, i, NULL);
            hash = image ? hash_bytes(image->rgba, (size_t)WIDTH * HEIGHT * IMAGE_CHANNELS) : 0;
        }
    }
    return hash;
}

static void test_same_bits(void **state) {
    (void)state;
    DrawTask alone = {.first = 3, .last = 3};
    uint64_t hash = render_child_value(draw_task, &alone);
    assert_true(hash != 0);
    DrawTask tasks[] = {{1, 3, 3, NULL}, {2, 3, 3, NULL}, {3, 3, 3, NULL}, {0, 0, 3, NULL}};
    for (size_t i = 0; i < sizeof tasks / sizeof *tasks; i++) {
        assert_true(render_child_value(draw_task, &tasks[i]) == hash);
    }
}

static uint64_t open_egl(void *context) {
    (void)context;
    Error error = {0};
    setenv("TOILE_GL", "egl", 1);
    return gl_open(0, &error) ? 1 : 0;
}

static void test_same_bits_by_egl(void **state) {
    (void)state;
    if (render_child_value(open_egl, NULL) == 0) {
        printf("SKIPPED: no EGL without a screen here\n");
        return;
    }
    DrawTask osmesa = {.first = 3, .last = 3, .backend = "osmesa"};
    DrawTask egl = {.first = 3, .last = 3, .backend = "egl"};
    uint64_t hash = render_child_value(draw_task, &osmesa);
    assert_true(hash != 0);
    assert_true(render_child_value(draw_task, &egl) == hash);
}

/* ---- videos ---- */

static void check_video(const char *path, const char *codec, int frames) {
    VideoInfo info;
    assert_true(video_probe(path, &info, -1, NULL, NULL));
    assert_string_equal(info.codec, codec);
    assert_int_equal(info.width, WIDTH);
    assert_int_equal(info.height, HEIGHT);
    assert_int_equal(info.frames, frames);
    assert_true(info.rate == 30.0);
    assert_string_equal(info.pixel_format, "yuv420p");
    assert_string_equal(info.range, "tv");
    assert_string_equal(info.space, "bt709");
    assert_string_equal(info.primaries, "bt709");
    assert_string_equal(info.transfer, "bt709");
}

static void test_video(void **state) {
    (void)state;
    const char *path = in_folder("film.mp4");
    Options options = options_for(in_folder("table.states"), path);
    assert_int_equal(render(options), EXIT_OK);
    check_video(path, "h264", FRAMES);
    VideoInfo info;
    Image shown, drawn;
    assert_true(video_probe(path, &info, 2, &shown, NULL));
    assert_true(info.index_first);
    const char *still = in_folder("still.png");
    options.output = still;
    options.first = options.last = 2;
    options.frames_given = true;
    assert_int_equal(render(options), EXIT_OK);
    assert_true(image_read_png(still, &drawn, NULL));
    ImageDifference difference = image_compare(&drawn, &shown);
    assert_true(difference.psnr > 36 && difference.ssim > 0.97);
    for (int k = 0; k < 3; k++) { /* no colour shift */
        assert_true(difference.mean_signed[k] < 1 && difference.mean_signed[k] > -1);
    }
    image_free(&shown);
    image_free(&drawn);
}

static void test_webm(void **state) {
    (void)state;
    const char *path = in_folder("film.webm");
    assert_int_equal(render(options_for(in_folder("table.states"), path)), EXIT_OK);
    check_video(path, "vp9", FRAMES);
}

/* Every format holds the pictures that were drawn: exactly where nothing is lost. */
static void test_formats(void **state) {
    (void)state;
    const char *still = in_folder("of-formats.png");
    Options options = options_for(in_folder("table.states"), still);
    Image drawn, shown;
    options.first = options.last = 4;
    options.frames_given = true;
    assert_int_equal(render(options), EXIT_OK);
    assert_true(image_read_png(still, &drawn, NULL));
    for (int i = 0; i < video_format_count; i++) {
        char name[64];
        snprintf(name, sizeof name, "formats.%s", video_formats[i].ending);
        const char *path = in_folder(name);
        assert_ptr_equal(video_format_of(path), &video_formats[i]);
        assert_int_equal(render(options_for(in_folder("table.states"), path)), EXIT_OK);
        VideoInfo info;
        Error error = {0};
        bool good = video_probe(path, &info, 4, &shown, &error);
        assert_true(good || (print_message("%s\n", error.text), false));
        assert_int_equal(info.frames, FRAMES);
        ImageDifference d = image_compare(&drawn, &shown);
        bool lossless = strcmp(info.codec, "ffv1") == 0 || strcmp(info.codec, "apng") == 0;
        print_message("%-12s %-8s %-12s PSNR %.1f dB\n", video_formats[i].ending, info.codec,
                      info.pixel_format, d.psnr);
        bool few_colors = strcmp(info.codec, "gif") == 0;
        assert_true(lossless     ? d.largest == 0
                    : few_colors ? d.psnr > 30 && d.ssim > 0.85
                                 : d.psnr > 34 && d.ssim > 0.96);
        for (int k = 0; k < 3; k++) {
            assert_true(d.mean_signed[k] < 1 && d.mean_signed[k] > -1);
        }
        image_free(&shown);
    }
    image_free(&drawn);
}

/* Mean and largest difference of alpha. */
static double alpha_difference(const Image *a, const Image *b, int *largest) {
    double sum = 0.0;
    *largest = 0;
    for (int i = 0; i < a->width * a->height; i++) {
        int d = abs(a->rgba[IMAGE_CHANNELS * i + 3] - b->rgba[IMAGE_CHANNELS * i + 3]);
        *largest = d > *largest ? d : *largest;
        sum += d;
    }
    return sum / (a->width * a->height);
}

/* Films with alpha, and a refusal by those that have none. FFmpeg's own decoder of VP9 leaves alpha out:
 * libvpx's is asked through its program. */
static void test_alpha_formats(void **state) {
    (void)state;
    const char *still = in_folder("of-alpha.png");
    Options options = options_for(in_folder("table.states"), still);
    Image drawn, shown;
    char command[512];
    options.clear = true;
    options.quality = quality_find("standard"); /* draft has no half covered pixels */
    options.first = options.last = 4;
    options.frames_given = true;
    assert_int_equal(render(options), EXIT_OK);
    assert_true(image_read_png(still, &drawn, NULL));
    assert_int_equal(drawn.rgba[3], 0);
    for (int i = 0; i < video_format_count; i++) {
        const VideoFormat *format = &video_formats[i];
        char name[64];
        snprintf(name, sizeof name, "alpha.%s", format->ending);
        options = options_for(in_folder("table.states"), in_folder(name));
        options.clear = true;
        options.quality = quality_find("standard");
        assert_int_equal(render(options), format->clear_format ? EXIT_OK : EXIT_USAGE);
        if (!format->clear_format) {
            continue;
        }
        const char *path = in_folder(name);
        if (strcmp(format->ending, "webm") == 0) {
            snprintf(command, sizeof command,
                     "ffmpeg -v error -y -c:v libvpx-vp9 -i %s -vf 'select=eq(n\\,4)' -frames:v 1 "
                     "-pix_fmt rgba %s/webm.png",
                     path, folder);
            if (system(command) != 0) {
                print_message("alpha of webm: not looked at, ffmpeg is missing\n");
                continue;
            }
            assert_true(image_read_png(in_folder("webm.png"), &shown, NULL));
        } else {
            VideoInfo info;
            assert_true(video_probe(path, &info, 4, &shown, NULL));
        }
        int largest;
        double mean = alpha_difference(&drawn, &shown, &largest);
        print_message("%-12s alpha off by %.3f, at most %d\n", format->ending, mean, largest);
        bool lossless = strcmp(format->ending, "mkv") == 0 || strcmp(format->ending, "apng") == 0;
        assert_true(lossless ? largest == 0
                             : mean < 1.0); /* gif: all or nothing along the outline */
        image_free(&shown);
    }
    image_free(&drawn);
}

static struct timespec changed(const char *path) {
    struct stat status = {0};
    assert_int_equal(stat(path, &status), 0);
    return status.st_mtim;
}

static bool same_time(struct timespec a, struct timespec b) {
    return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec;
}

static void test_made_once(void **state) {
    (void)state;
    const char *path = in_folder("once.mp4");
    Options options = options_for(in_folder("table.states"), path);
    assert_int_equal(render(options), EXIT_OK);
    struct timespec first = changed(path);
    assert_int_equal(render(options), EXIT_OK);
    assert_true(same_time(first, changed(path)));
    options.look = "velvet"; /* something else: made again without asking */
    assert_int_equal(render(options), EXIT_OK);
    assert_false(same_time(first, changed(path)));
}

static void test_foreign_file_is_kept(void **state) {
    (void)state;
    const char *path = in_folder("foreign.mp4");
    FILE *file = fopen(path, "w");
    fputs("somebody else's", file);
    fclose(file);
    Options options = options_for(in_folder("table.states"), path);
    assert_int_equal(render(options), EXIT_IO);
    options.force = true;
    assert_int_equal(render(options), EXIT_OK);
    check_video(path, "h264", FRAMES);
}

static void test_sequence(void **state) {
    (void)state;
    Options options = options_for(in_folder("table.states"), in_folder("frames/"));
    options.first = 2;
    options.last = 4;
    assert_int_equal(render(options), EXIT_OK);
    const char *names[] = {in_folder("frames/0002.png"), in_folder("frames/0003.png"),
                           in_folder("frames/0004.png")};
    struct timespec kept = changed(names[0]), lost = changed(names[1]);
    assert_true(access(in_folder("frames/0001.png"), F_OK) != 0);
    assert_true(access(in_folder("frames/0005.png"), F_OK) != 0);
    unlink(names[1]);
    assert_int_equal(render(options), EXIT_OK);
    assert_true(same_time(kept, changed(names[0])));
    assert_false(same_time(lost, changed(names[1])));
}

/* ---- several processes ---- */

static uint64_t hash_file(const char *path) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    static unsigned char bytes[1 << 22];
    size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    assert_true(size > 0 && size < sizeof bytes);
    return hash_bytes(bytes, size);
}

static void test_jobs_give_the_same_bytes(void **state) {
    (void)state;
    Options options = options_for(in_folder("table.states"), in_folder("jobs.mkv"));
    options.force = true;
    assert_int_equal(render(options), EXIT_OK);
    uint64_t one = hash_file(options.output);
    for (int jobs = 2; jobs <= 8; jobs += 3) { /* 8: more than frames */
        options.jobs = jobs;
        assert_int_equal(render(options), EXIT_OK);
        assert_true(hash_file(options.output) == one);
    }
    options.output = in_folder("jobs/");
    options.jobs = 1;
    assert_int_equal(render(options), EXIT_OK);
    uint64_t picture = hash_file(in_folder("jobs/0003.png"));
    options.jobs = 3;
    assert_int_equal(render(options), EXIT_OK);
    assert_true(hash_file(in_folder("jobs/0003.png")) == picture);
    unlink(in_folder("jobs/0002.png")); /* only what is missing is drawn */
    struct timespec kept = changed(in_folder("jobs/0001.png"));
    options.force = false;
    assert_int_equal(render(options), EXIT_OK);
    assert_true(access(in_folder("jobs/0002.png"), F_OK) == 0);
    assert_true(same_time(kept, changed(in_folder("jobs/0001.png"))));
}

static void test_jobs_tell_what_is_wrong(void **state) {
    (void)state;
    Options options = options_for(in_folder("table.states"), "/dev/full");
    options.output = in_folder("no/such/../jobs.mp4");
    options.jobs = 2;
    assert_int_equal(render(options), EXIT_IO);
    options = options_for(in_folder("table.states"), in_folder("wrong-jobs.mp4"));
    options.jobs = 2;
    options.last = 100; /* frames that never come */
    assert_int_equal(render(options), EXIT_BAD_INPUT);
    assert_true(access(options.output, F_OK) != 0);
}

/* ---- growing, stopped, damaged runs ---- */

typedef struct Growth {
    const char *from, *to;
    double part; /* of the file that is written before the writer stops */
} Growth;

/* Copies a states file in pieces that end in the middle of records. */
static int grow(void *context) {
    const Growth *growth = context;
    FILE *in = fopen(growth->from, "rb"), *out = fopen(growth->to, "wb");
    char piece[7001];
    fseek(in, 0, SEEK_END);
    long left = (long)(growth->part * (double)ftell(in));
    rewind(in);
    while (left > 0) {
        size_t count =
            fread(piece, 1, (size_t)left < sizeof piece ? (size_t)left : sizeof piece, in);
        fwrite(piece, 1, count, out);
        fflush(out);
        usleep(4000);
        left -= (long)count;
    }
    fclose(in);
    fclose(out);
    return 0;
}

static void follow(const char *motion, double part, int expected, ExitCode wanted) {
    char from[128], to[128], output[128];
    snprintf(from, sizeof from, "%s/%s.states", folder, motion);
    snprintf(to, sizeof to, "%s/%s-growing.states", folder, motion);
    snprintf(output, sizeof output, "%s/%s-growing.mp4", folder, motion);
    unlink(to);
    unlink(output);
    Growth growth = {from, to, part};
    pid_t writer = render_child_start(grow, &growth);
    Options options = options_for(to, output);
    options.run.follow = true;
    options.run.patience = 0.5; /* a writer that waits to be collected still has its number */
    options.threads = 2;
    assert_int_equal(render(options), wanted);
    assert_int_equal(render_child_wait(writer), 0);
    check_video(output, "h264", expected);
}

static void test_follow(void **state) {
    (void)state;
    follow("table", 1.0, FRAMES, EXIT_OK);
    follow("sleeve", 1.0, FRAMES, EXIT_OK); /* automatic camera: waits */
}

static void test_follow_writer_dies(void **state) {
    (void)state;
    follow("table", 0.75, 4, EXIT_DIFFERS);
}

static void test_followed_frames_are_the_same(void **state) {
    (void)state;
    const char *to = in_folder("again.states"), *frames = in_folder("again/");
    Growth growth = {in_folder("table.states"), to, 1.0};
    pid_t writer = render_child_start(grow, &growth);
    Options options = options_for(to, frames);
    options.run.follow = true;
    assert_int_equal(render(options), EXIT_OK);
    render_child_wait(writer);
    options = options_for(in_folder("table.states"), in_folder("whole/"));
    assert_int_equal(render(options), EXIT_OK);
    for (int i = 0; i < FRAMES; i++) {
        char name[32];
        Image a, b;
        snprintf(name, sizeof name, "again/%04d.png", i);
        assert_true(image_read_png(in_folder(name), &a, NULL));
        snprintf(name, sizeof name, "whole/%04d.png", i);
        assert_true(image_read_png(in_folder(name), &b, NULL));
        assert_memory_equal(a.rgba, b.rgba, (size_t)WIDTH * HEIGHT * IMAGE_CHANNELS);
        image_free(&a);
        image_free(&b);
    }
}

static void test_interrupted(void **state) {
    (void)state;
    const char *states = in_folder("long.states"), *path = in_folder("long.mp4");
    assert_true(render_states_write("table", states, 0, 300, 8, NULL, true, NULL));
    Options options = options_for(states, path);
    options.threads = 2;
    pid_t child = render_child_start(render_in_child, &options);
    const char *part = in_folder("long.mp4.part");
    for (int i = 0; i < 1000 && access(part, F_OK) != 0; i++) {
        usleep(10000);
    }
    kill(child, SIGINT);
    assert_int_equal(render_child_wait(child), EXIT_INTERRUPTED);
    assert_true(access(path, F_OK) != 0);
    assert_true(access(part, F_OK) != 0);
}

static void test_damaged_run(void **state) {
    (void)state;
    char command[512];
    const char *path = in_folder("damaged.states");
    snprintf(command, sizeof command, "cp %s %s", in_folder("table.states"), path);
    assert_int_equal(system(command), 0);
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    FILE *file = fopen(path, "r+b");
    fseek(file, status.st_size / 2 + status.st_size / 4, SEEK_SET);
    fputs("scratched", file);
    fclose(file);
    const char *film = in_folder("damaged.mp4");
    assert_int_equal(render(options_for(path, film)), EXIT_BAD_INPUT);
    VideoInfo info;
    assert_true(video_probe(film, &info, -1, NULL, NULL));
    assert_true(info.frames > 0 && info.frames < FRAMES);
}

static void test_wrong_requests(void **state) {
    (void)state;
    const char *table = in_folder("table.states"), *film = in_folder("wrong.mp4");
    Options options = options_for(in_folder("nothing.states"), film);
    assert_int_equal(render(options), EXIT_MISSING_INPUT);
    options = options_for(table, film);
    options.first = 100;
    assert_int_equal(render(options), EXIT_BAD_INPUT);
    options = options_for(table, in_folder("wrong.avi"));
    assert_int_equal(render(options), EXIT_USAGE);
    options = options_for(table, film);
    options.look = "linnen";
    assert_int_equal(render(options), EXIT_BAD_INPUT);
    options = options_for(table, "/nowhere/at/all.mp4");
    assert_int_equal(render(options), EXIT_IO);
    options = options_for(in_folder(""), film); /* a folder without a run */
    assert_int_equal(render(options), EXIT_MISSING_INPUT);
    assert_true(access(film, F_OK) != 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_same_bits_by_egl),
        cmocka_unit_test(test_video),
        cmocka_unit_test(test_webm),
        cmocka_unit_test(test_formats),
        cmocka_unit_test(test_alpha_formats),
        cmocka_unit_test(test_made_once),
        cmocka_unit_test(test_foreign_file_is_kept),
        cmocka_unit_test(test_sequence),
        cmocka_unit_test(test_jobs_give_the_same_bytes),
        cmocka_unit_test(test_jobs_tell_what_is_wrong),
        cmocka_unit_test(test_follow),
        cmocka_unit_test(test_follow_writer_dies),
        cmocka_unit_test(test_followed_frames_are_the_same),
        cmocka_unit_test(test_interrupted),
        cmocka_unit_test(test_damaged_run),
        cmocka_unit_test(test_wrong_requests),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
