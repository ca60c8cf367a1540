/* measure: numbers out of a run. */
#include <stdio.h>

#include "render/command.h"
#include "render/interrupt.h"
#include "render/json.h"
#include "render/measure.h"

typedef struct Totals {
    int64_t crossings;
    int frames, bad_frames;
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

static bool measure_frame(const Options *options, Run *run, int index, bool first, Arena *arena,
                          Totals *totals, Error *error) {
    const StateHeader *header = state_header(run->reader);
    StateFrame frame;
    StateLayout layout;
    MeasureCrossings found;
    int layout_index;
    ArenaMark mark = arena_mark(arena);
    if (!state_read_frame(run->reader, index, &frame, &layout, &layout_index, error) ||
        !measure_crossings(header, &layout, &frame, arena, &found, error)) {
        return false;
    }
    if (options->json) {
        print_json_frame(header, &frame, &found, first);
    } else {
        printf("%5d %9.4f %8lld %8lld  %s\n", frame.frame, frame.time, (long long)found.cloth,
               (long long)found.obstacles, found.place);
    }
    totals->frames++;
    totals->crossings += found.cloth + found.obstacles;
    totals->bad_frames += found.cloth + found.obstacles > 0;
    arena_rewind(arena, mark);
    return true;
}

static bool measure_range(const Options *options, Run *run, int first, int last, Totals *totals,
                          Error *error) {
    Arena arena = {0};
    bool good = true;
    printf(options->json ? "{\"schema\": \"toile-crossings-1\", \"frames\": ["
                         : "frame  time [s]    cloth obstacle\n");
    for (int i = first; good && i <= last; i++) {
        good = measure_frame(options, run, i, i == first, &arena, totals, error) &&
               (!interrupt_requested() || error_set(error, EXIT_INTERRUPTED, "interrupted"));
    }
    if (options->json) {
        printf("\n], \"crossings\": %lld, \"frames_checked\": %d, \"frames_crossing\": %d, "
               "\"complete\": %s}\n",
               (long long)totals->crossings, totals->frames, totals->bad_frames,
               good ? "true" : "false");
    } else if (good) {
        printf("%lld crossings in %d of %d frames\n", (long long)totals->crossings,
               totals->bad_frames, totals->frames);
    }
    arena_free(&arena);
    return good;
}

ExitCode command_measure(const Options *options, Error *error) {
    if (options->gaps) {
        return command_gaps(options, error);
    }
    if (!options->crossings) {
        return command_drape(options, error);
    }
    if (options->argument_count > 1) {
        error_set(error, EXIT_USAGE, "measure --crossings looks at one run");
        return EXIT_USAGE;
    }
    Run run = {0};
    Totals totals = {0};
    int first, last;
    bool good = run_open(&run, &options->run, error);
    if (good) {
        RunEnd end = run_wait_end(&run);
        good = command_choose_frames(options, &run, end, "measured", &first, &last, error) &&
               measure_range(options, &run, first, last, &totals, error);
    }
    run_close(&run);
    if (!good) {
        return error->code;
    }
    return totals.crossings > 0 ? EXIT_DIFFERS : EXIT_OK;
}
