#include "render/command.h"

bool command_choose_frames(const Options *options, const Run *run, RunEnd end, const char *done,
                           int *first, int *last, Error *error) {
    int count = state_frame_count(run->reader);
    *first = options->first;
    *last = options->last < 0 ? count - 1 : options->last;
    if (end == RUN_INTERRUPTED) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    if (end == RUN_DAMAGED && (count == 0 || *last >= count || options->last < 0)) {
        return error_set(error, EXIT_BAD_INPUT, "%s: %s", run->path, state_damage(run->reader));
    }
    if (count == 0) {
        return error_set(error, EXIT_BAD_INPUT, "%s: there is no frame in it", run->path);
    }
    if (*first >= count || *last >= count) {
        return error_set(error, EXIT_USAGE, "--frames: %s holds frames 0 to %d", run->path,
                         count - 1);
    }
    if (end != RUN_FINISHED && options->last < 0 && !options->quiet) {
        fprintf(stderr, "toile: %s is not finished: frames %d to %d are %s\n", run->path, *first,
                *last, done);
    }
    return true;
}
