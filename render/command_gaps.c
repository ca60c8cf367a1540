/* measure --gaps: two detections of contact side by side. */
#include <math.h>
#include <stdio.h>

#include "render/command.h"
#include "render/gaps.h"
#include "render/interrupt.h"
#include "render/json.h"

typedef struct GapTotals {
    double seconds[2], most;
    long crossed;
    int frames;
} GapTotals;

static void print_frame(const StateFrame *frame, const Gaps *gaps, bool json, bool first) {
    if (!json) {
        printf("%5d %9.4f %7d %8d %10.4f %10.4f %10.4f %10.4f %8d\n", frame->frame, frame->time,
               gaps->points, gaps->outside, 1e3 * gaps->triangles, 1e3 * gaps->smooth,
               1e3 * gaps->mean, 1e3 * gaps->most, gaps->crossed);
        return;
    }
    const char *names[4] = {"triangles", "smooth", "rms_difference", "largest_difference"};
    const double values[4] = {gaps->triangles, gaps->smooth, gaps->mean, gaps->most};
    printf("%s\n  {\"frame\": %d, \"time\": %.9g, \"points\": %d, \"outside\": %d",
           first ? "" : ",", frame->frame, frame->time, gaps->points, gaps->outside);
    for (int k = 0; k < 4; k++) {
        printf(", \"%s\": ", names[k]);
        json_number(stdout, values[k]);
    }
    printf(", \"crossed\": %d}", gaps->crossed);
}

static bool measure_frame(const Options *options, Run *run, int index, bool first, Arena *scratch,
                          GapSides *sides, Arena *kept, GapTotals *totals, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    ArenaMark mark = arena_mark(scratch);
    if (!state_read_frame(run->reader, index, &frame, &layout, &layout_index, error)) {
        return false;
    }
    Gaps gaps = gaps_measure(state_header(run->reader), &layout, &frame, gaps_spacing(&layout),
                             scratch, sides, kept);
    print_frame(&frame, &gaps, options->json, first);
    totals->frames++;
    totals->crossed += gaps.crossed;
    totals->most = fmax(totals->most, gaps.most);
    totals->seconds[0] += gaps.seconds[0], totals->seconds[1] += gaps.seconds[1];
    arena_rewind(scratch, mark);
    return true;
}

static bool measure_range(const Options *options, Run *run, int first, int last, GapTotals *totals,
                          Error *error) {
    Arena scratch = {0}, kept = {0};
    GapSides sides = {0};
    bool good = true;
    printf(options->json ? "{\"schema\": \"toile-gaps-1\", \"unit\": \"m\", \"frames\": ["
                         : "frame  time [s]  points  outside   triangles     smooth  rms diff. "
                           " largest [mm]  crossed\n");
    for (int i = first; good && i <= last; i++) {
        good = measure_frame(options, run, i, i == first, &scratch, &sides, &kept, totals, error) &&
               (!interrupt_requested() || error_set(error, EXIT_INTERRUPTED, "interrupted"));
    }
    if (options->json) {
        printf("\n], \"crossed\": %ld, \"largest_difference\": ", totals->crossed);
        json_number(stdout, totals->most);
        printf(", \"complete\": %s}\n", good ? "true" : "false");
    } else if (good) {
        printf(
            "%ld crossed in %d frames; largest difference %.4f mm; %.1f ms a frame by triangles, "
            "%.1f ms by the smooth surface\n",
            totals->crossed, totals->frames, 1e3 * totals->most,
            1e3 * totals->seconds[0] / totals->frames, 1e3 * totals->seconds[1] / totals->frames);
    }
    arena_free(&scratch);
    arena_free(&kept);
    return good;
}

ExitCode command_gaps(const Options *options, Error *error) {
    if (options->argument_count > 1) {
        error_set(error, EXIT_USAGE, "measure --gaps looks at one run");
        return EXIT_USAGE;
    }
    Run run = {0};
    GapTotals totals = {0};
    int first, last;
    bool good = run_open(&run, &options->run, error);
    if (good) {
        RunEnd end = run_wait_end(&run);
        good = command_choose_frames(options, &run, end, "measured", &first, &last, error) &&
               measure_range(options, &run, first, last, &totals, error);
    }
    run_close(&run);
    return good ? EXIT_OK : error->code;
}
