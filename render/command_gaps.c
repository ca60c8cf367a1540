/* measure --gaps: two detections of contact side by side. */
#include <math.h>
#include <stdio.h>

#include "render/command.h"
#include "render/gaps.h"
#include "render/json.h"

typedef struct GapTotals {
    double seconds[2], most;
    long crossed;
    int frames;
    GapSides sides;
    Arena kept; /* holds the sides */
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

static void begin_gaps(const Options *options) {
    printf(options->json ? "{\"schema\": \"toile-gaps-1\", \"unit\": \"m\", \"frames\": ["
                         : "frame  time [s]  points  outside   triangles     smooth  rms diff. "
                           " largest [mm]  crossed\n");
}

static bool compare_frame(const Options *options, const StateHeader *header,
                          const StateLayout *layout, int layout_index, const StateFrame *frame,
                          bool first, void *context, Error *error) {
    (void)error, (void)layout_index;
    GapTotals *totals = context;
    Arena scratch = {0};
    Gaps gaps = gaps_measure(header, layout, frame, gaps_spacing(layout), &scratch, &totals->sides,
                             &totals->kept);
    arena_free(&scratch);
    print_frame(frame, &gaps, options->json, first);
    totals->frames++;
    totals->crossed += gaps.crossed;
    totals->most = fmax(totals->most, gaps.most);
    totals->seconds[0] += gaps.seconds[0], totals->seconds[1] += gaps.seconds[1];
    return true;
}

static void end_gaps(const Options *options, bool complete, const void *context) {
    const GapTotals *totals = context;
    if (options->json) {
        printf("\n], \"crossed\": %ld, \"largest_difference\": ", totals->crossed);
        json_number(stdout, totals->most);
        printf(", \"complete\": %s}\n", complete ? "true" : "false");
    } else if (complete) {
        printf(
            "%ld crossed in %d frames; largest difference %.4f mm; %.1f ms a frame by triangles, "
            "%.1f ms by the smooth surface\n",
            totals->crossed, totals->frames, 1e3 * totals->most,
            1e3 * totals->seconds[0] / totals->frames, 1e3 * totals->seconds[1] / totals->frames);
    }
}

ExitCode command_gaps(const Options *options, Error *error) {
    const FrameMeasure measure = {"--gaps", begin_gaps, compare_frame, end_gaps};
    GapTotals totals = {0};
    bool good = command_measure_frames(options, &measure, &totals, error);
    arena_free(&totals.kept);
    return good ? EXIT_OK : error->code;
}
