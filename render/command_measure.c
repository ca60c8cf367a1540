/* measure: numbers out of a run. */
#include <stdio.h>

#include "render/command.h"
#include "render/interrupt.h"
#include "render/json.h"
#include "render/measure.h"

typedef struct Totals {
    int64_t crossings;
    int frames, bad_frames;
    Resampler *resampler; /* of what is drawn, for this layout */
    int layout_index;
} Totals;

static void print_json_frame(const StateHeader *header, const StateFrame *frame,
                             const MeasureCrossings *found, bool first) {
    printf("%s\n  {\"frame\": %d, \"time\": %.9g, \"cloth\": %lld, \"obstacles\": {",
           first ? "" : ",", frame->frame, frame->time, (long long)found->cloth);
    for (int i = 0; i < header->obstacle_count; i++) {
        printf("%s", i ? ", " : "");
        json_string(stdout, header->obstacles[i].name);
        printf(": %lld", (long long)found->obstacle[i]);
    }
    printf("}, \"place\": ");
    json_string(stdout, found->place);
    printf("}");
}

static void begin_crossings(const Options *options) {
    printf(options->json ? "{\"schema\": \"toile-crossings-1\", \"frames\": ["
                         : "frame  time [s]    cloth obstacle\n");
}

/* The surface as dense as a film's, or as --triangles says. */
static void use_layout(const Options *options, const StateLayout *layout, int layout_index,
                       Totals *totals) {
    if (totals->resampler && totals->layout_index == layout_index) {
        return;
    }
    ResampleDef def = {.triangles = options->triangles > 0 ? options->triangles
                                                           : options->quality->triangle_cap};
    resample_destroy(totals->resampler);
    totals->resampler = resample_create(layout, &def);
    totals->layout_index = layout_index;
}

static bool count_frame(const Options *options, const StateHeader *header,
                        const StateLayout *layout, int layout_index, const StateFrame *frame,
                        bool first, void *context, Error *error) {
    Totals *totals = context;
    Arena arena = {0};
    MeasureCrossings found;
    bool good;
    if (options->drawn) {
        use_layout(options, layout, layout_index, totals);
        good = measure_drawn(header, layout, frame, totals->resampler, &arena, &found, error);
    } else {
        good = measure_crossings(header, layout, frame, &arena, &found, error);
    }
    if (good && options->json) {
        print_json_frame(header, frame, &found, first);
    } else if (good) {
        printf("%5d %9.4f %8lld %8lld  %s\n", frame->frame, frame->time, (long long)found.cloth,
               (long long)found.obstacles, found.place);
    }
    if (good) {
        totals->frames++;
        totals->crossings += found.cloth + found.obstacles;
        totals->bad_frames += found.cloth + found.obstacles > 0;
    }
    arena_free(&arena);
    return good;
}

static void end_crossings(const Options *options, bool complete, const void *context) {
    const Totals *totals = context;
    if (options->json) {
        printf("\n], \"crossings\": %lld, \"frames_checked\": %d, \"frames_crossing\": %d, "
               "\"complete\": %s}\n",
               (long long)totals->crossings, totals->frames, totals->bad_frames,
               complete ? "true" : "false");
    } else if (complete) {
        printf("%lld crossings in %d of %d frames\n", (long long)totals->crossings,
               totals->bad_frames, totals->frames);
    }
}

static bool measure_range(const Options *options, Run *run, int first, int last,
                          const FrameMeasure *measure, void *totals, Error *error) {
    bool good = true;
    measure->begin(options);
    for (int i = first; good && i <= last; i++) {
        StateFrame frame;
        StateLayout layout;
        int index;
        good = state_read_frame(run->reader, i, &frame, &layout, &index, error) &&
               measure->frame(options, state_header(run->reader), &layout, index, &frame,
                              i == first, totals, error) &&
               (!interrupt_requested() || error_set(error, EXIT_INTERRUPTED, "interrupted"));
    }
    measure->end(options, good, totals);
    return good;
}

bool command_measure_frames(const Options *options, const FrameMeasure *measure, void *totals,
                            Error *error) {
    if (options->argument_count > 1) {
        return error_set(error, EXIT_USAGE, "measure %s looks at one run", measure->option);
    }
    Run run = {0};
    int first, last;
    bool good = run_open(&run, &options->run, error);
    if (good) {
        RunEnd end = run_wait_end(&run);
        good = command_choose_frames(options, &run, end, "measured", &first, &last, error) &&
               measure_range(options, &run, first, last, measure, totals, error);
    }
    run_close(&run);
    return good;
}

ExitCode command_measure(const Options *options, Error *error) {
    if (options->drawn && !options->crossings) {
        return error_set(error, EXIT_USAGE, "--drawn goes with --crossings"), error->code;
    }
    if (options->gaps) {
        return command_gaps(options, error);
    }
    if (!options->crossings) {
        return command_drape(options, error);
    }
    const FrameMeasure measure = {"--crossings", begin_crossings, count_frame, end_crossings};
    Totals totals = {0};
    bool good = command_measure_frames(options, &measure, &totals, error);
    resample_destroy(totals.resampler);
    if (!good) {
        return error->code;
    }
    return totals.crossings > 0 ? EXIT_DIFFERS : EXIT_OK;
}
