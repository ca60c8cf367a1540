/* bench: what the stages of a frame cost. versions: what the program is built from. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/command.h"
#include "render/gl.h"
#include "render/sheet.h"
#include "render/video.h"
#include "sim/base/clock.h"

#define BENCH_ROUNDS 5 /* each number is the smallest of so many */
#define BENCH_STAGES (PAINT_STAGE_COUNT + 3)
#define ENCODE_FRAMES 24 /* encoded at once: encoders look ahead */

typedef struct Bench {
    bool splats;
    const char *names[BENCH_STAGES];
    double best[BENCH_STAGES]; /* [s] CPU time a frame */
    double still;              /* [s] the same of a frame like the one before */
    int triangles, width, height;
} Bench;

static void keep_best(Bench *bench, const DrawTimes *times) {
    double now[PAINT_STAGE_COUNT + 2] = {times->read, times->resample};
    memcpy(now + 2, times->paint, sizeof times->paint);
    for (int i = 0; i < PAINT_STAGE_COUNT + 2; i++) {
        bench->best[i] = fmin(bench->best[i], now[i] / times->frames);
    }
}

static bool time_drawing(Bench *bench, Drawer *drawer, int first, int count, Error *error) {
    for (int round = -1; round < BENCH_ROUNDS; round++) { /* round -1 warms up */
        DrawTimes times = {0};
        draw_measure(drawer, &times);
        for (int i = 0; i < count; i++) {
            if (!draw_frame(drawer, first + i, error)) {
                return false;
            }
        }
        if (round >= 0) {
            keep_best(bench, &times);
        }
    }
    return true;
}

/* [s] CPU time a frame of H.264, drawing left out of the account. */
static bool time_encoding(const Bench *bench, Drawer *drawer, int first, int count, double *cost,
                          Error *error) {
    char path[] = "/tmp/toile-bench-XXXXXX.mp4";
    int file = mkstemps(path, 4);
    if (file < 0) {
        return error_set_errno(error, EXIT_IO, "%s", path);
    }
    close(file);
    double start = clock_process_seconds(), spent = 0.0;
    Video *video =
        video_create(path, video_format_of(path), bench->width, bench->height, 30.0, false, error);
    spent += clock_process_seconds() - start;
    bool good = video != NULL;
    for (int i = 0; good && i < ENCODE_FRAMES; i++) {
        const Image *image = draw_frame(drawer, first + i % count, error);
        start = clock_process_seconds();
        good = image && video_write(video, image, error);
        spent += clock_process_seconds() - start;
    }
    start = clock_process_seconds();
    if (good) {
        good = video_close(video, NULL, error);
    } else {
        video_abandon(video);
    }
    spent += clock_process_seconds() - start;
    unlink(path);
    *cost = spent / ENCODE_FRAMES;
    return good;
}

/* A film of a cloth at rest: every frame is looked at and shown, none is drawn. */
static bool time_still(Bench *bench, Drawer *drawer, int frame, Error *error) {
    uint64_t key;
    bool good = draw_frame(drawer, frame, error) != NULL;
    bench->still = INFINITY;
    for (int round = 0; good && round < BENCH_ROUNDS; round++) {
        double start = clock_process_seconds();
        good = draw_frame_key(drawer, frame, &key, error) && draw_frame(drawer, frame, error);
        bench->still = fmin(bench->still, clock_process_seconds() - start);
    }
    double encoded = 0.0;
    good = good && time_encoding(bench, drawer, frame, 1, &encoded, error);
    bench->still += encoded;
    return good;
}

/* CPU time of a whole frame on one core that is asked for. */
static const struct {
    const char *quality;
    int width;
    double frame_ms;
} limits[] = {{"draft", 1280, 150.0}, {"standard", 1280, 330.0}, {"standard", 1920, 670.0}};
#define LIMIT_OUTPUT_PART 0.10 /* of a standard frame: reading back and encoding */

#define STILL_PART (1.0 / 3.0) /* of a moving frame: one that shows the same as the last */

static double limit_of(const Bench *bench, const Options *options) {
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++) {
        if (strcmp(limits[i].quality, options->quality->name) == 0 &&
            limits[i].width == bench->width) {
            return limits[i].frame_ms;
        }
    }
    return 0.0;
}

static void print_row(const Bench *bench, const Options *options, const char *quantity,
                      double seconds, double limit_ms) {
    char reference[32] = "", error[32] = "";
    if (limit_ms > 0.0) {
        snprintf(reference, sizeof reference, "%g", limit_ms);
        snprintf(error, sizeof error, "%.3f", 1e3 * seconds / limit_ms - 1.0);
    }
    printf("render,%s,%s,,%d,,%s_ms,%.3f,%s,%s,%.6f,%dx%d\n", options->quality->name,
           bench->splats ? "splats" : "mesh", bench->triangles, quantity, 1e3 * seconds, reference,
           error, seconds, bench->width, bench->height);
}

static void print_bench(const Bench *bench, const Options *options) {
    double total = 0.0, limit = limit_of(bench, options);
    printf("suite,case,model,stepper,nodes,dt,quantity,value,reference,error,cpu_s,note\n");
    for (int i = 0; i < BENCH_STAGES; i++) {
        print_row(bench, options, bench->names[i], bench->best[i], 0.0);
        total += bench->best[i];
    }
    double output = bench->best[PAINT_READ + 2] + bench->best[BENCH_STAGES - 1];
    print_row(bench, options, "read_back_and_encode", output, LIMIT_OUTPUT_PART * limit);
    print_row(bench, options, "frame", total, limit);
    print_row(bench, options, "still_frame", bench->still, 1e3 * STILL_PART * total);
}

ExitCode command_bench(const Options *options, Error *error) {
    Run run = {0};
    RunEnd end;
    Options alone = *options;
    alone.threads = 1; /* costs are those of one core */
    Drawer *drawer = command_open(&alone, &run, &end, error);
    bool good = drawer != NULL;
    if (good) {
        Bench bench = {.names = {"read_states", "resample"},
                       .width = draw_width(drawer),
                       .height = draw_height(drawer),
                       .splats = draw_film(drawer)->surface == FILM_SPLATS};
        for (int i = 0; i < PAINT_STAGE_COUNT; i++) {
            bench.names[i + 2] = paint_stage_names[i];
        }
        bench.names[BENCH_STAGES - 1] = "encode_h264";
        for (int i = 0; i < BENCH_STAGES; i++) {
            bench.best[i] = INFINITY;
        }
        int last = state_frame_count(run.reader) - 1;
        int first = options->first < last ? options->first : last;
        int count = last - first + 1 < 3 ? last - first + 1 : 3;
        good = time_drawing(&bench, drawer, first, count, error);
        bench.triangles = draw_triangles(drawer);
        draw_measure(drawer, NULL);
        good = good &&
               time_encoding(&bench, drawer, first, last - first + 1, &bench.best[BENCH_STAGES - 1],
                             error) &&
               time_still(&bench, drawer, first, error);
        if (good) {
            print_bench(&bench, options);
        }
    }
    draw_destroy(drawer);
    run_close(&run);
    return good ? EXIT_OK : error->code;
}

ExitCode command_versions(const Options *options, Error *error) {
    (void)options;
    if (gl_open(0, error)) {
        printf("%s\n", gl_describe());
    } else {
        printf("no OpenGL: %s\n", error->text);
    }
    video_print_versions(stdout);
    image_print_versions(stdout);
    exr_print_versions(stdout);
    sheet_print_versions(stdout);
    return EXIT_OK;
}
