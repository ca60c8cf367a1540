/* render: a run becomes a video, a sequence or a picture. */
#include <stdio.h>
#include <string.h>

#include "render/command.h"
#include "render/interrupt.h"
#include "render/jobs.h"
#include "render/output.h"
#include "render/video.h"
#include "sim/base/clock.h"
#include "sim/base/hash.h"

/* What one call of render works on. */
typedef struct Job {
    const Options *options;
    Run run;
    Drawer *drawer;
    OutputDef target;
    Output *output;
    Jobs *jobs;      /* NULL: this process draws */
    ExrPicture exr;  /* for .exr files */
    RunEnd end;      /* how the run ended; RUN_FRAME: not yet */
    int first, last; /* frames to draw; last -1: until the run ends */
    int drawn, kept; /* frames written, frames that were still valid */
    uint64_t key;    /* of the frames so far */
} Job;

static void say(const Options *options, const char *text) {
    if (!options->quiet) {
        fprintf(stderr, "toile: %s\n", text);
    }
}

Drawer *command_open(const Options *options, Run *run, RunEnd *end, Error *error) {
    if (!run_open(run, &options->run, error)) {
        return NULL;
    }
    *end = run_wait(run, 0);
    if (*end == RUN_INTERRUPTED) {
        error_set(error, EXIT_INTERRUPTED, "interrupted");
        return NULL;
    }
    if (*end != RUN_FRAME) {
        error_set(error, EXIT_BAD_INPUT, "%s: there is no frame in it%s%s", run->path,
                  *end == RUN_DAMAGED ? ": " : "",
                  *end == RUN_DAMAGED ? state_damage(run->reader) : "");
        return NULL;
    }
    Film film;
    if (!command_film(options, &state_header(run->reader)->film, &film, error)) {
        return NULL;
    }
    DrawDef def = {.width = options->width,
                   .height = options->height,
                   .quality = options->quality,
                   .film = &film,
                   .linear = options->linear,
                   .clear = options->clear,
                   .look = options->look,
                   .triangles = options->triangles,
                   .backdrop = options->backdrop,
                   .prints = options->prints,
                   .print_count = options->print_count,
                   .range = options->range,
                   .threads = options->threads > 1 ? options->threads : 0};
    bool waits = draw_needs_end(run, &def, error);
    if (options->run.follow && waits) {
        say(options, "the camera, the floor or a range depends on the whole motion: waiting for "
                     "its end");
    }
    *end = !options->run.follow || waits ? run_wait_end(run) : RUN_FRAME;
    if (*end == RUN_INTERRUPTED) {
        error_set(error, EXIT_INTERRUPTED, "interrupted");
        return NULL;
    }
    return draw_create(run, &def, error);
}

/* Which frames are wanted, as far as that is known. */
static bool choose_frames(Job *job, Error *error) {
    const Options *options = job->options;
    int count = state_frame_count(job->run.reader);
    job->first = options->first;
    job->last = options->last;
    if (job->target.kind == OUTPUT_PICTURE) { /* the frame asked for, or the last one */
        if (job->end == RUN_FRAME && !options->frames_given) {
            job->end = run_wait_end(&job->run);
            count = state_frame_count(job->run.reader);
        }
        job->first = options->frames_given ? options->first : count - 1;
        if (options->frames_given && options->last != options->first) {
            return error_set(error, EXIT_USAGE, "one picture shows one frame: --frames N");
        }
        job->last = job->first;
    }
    if (job->end != RUN_FRAME) {
        job->last = job->last < 0 || (job->last >= count && job->end != RUN_FINISHED) ? count - 1
                                                                                      : job->last;
        if (job->first >= count || job->last >= count) {
            return error_set(error, EXIT_BAD_INPUT,
                             "%s: frame %d was asked for, the last one is %d", job->run.path,
                             job->first >= count ? job->first : job->last, count - 1);
        }
    }
    return true;
}

static bool add_key(Job *job, int frame, uint64_t *frame_key, Error *error) {
    if (!draw_frame_key(job->drawer, frame, frame_key, error)) {
        return false;
    }
    uint64_t both[2] = {job->key, *frame_key};
    job->key = hash_bytes(both, sizeof both);
    return true;
}

/* A video also depends on how fast it is shown. */
static void start_key(Job *job) {
    const Film *film = draw_film(job->drawer);
    double numbers[] = {film->play > 0.0 ? film->play : film->rate, job->options->every};
    job->key = hash_bytes(numbers, sizeof numbers);
}

/* True if a video or picture of a finished run is there and shows exactly what is asked for. */
static bool is_made(Job *job, bool *made, Error *error) {
    *made = false;
    start_key(job);
    if (job->end == RUN_FRAME || job->target.kind == OUTPUT_SEQUENCE || job->target.force) {
        return true;
    }
    uint64_t frame_key = 0;
    start_key(job);
    for (int i = job->first; i <= job->last; i += job->options->every) {
        if (!add_key(job, i, &frame_key, error)) {
            return false;
        }
    }
    uint64_t key = job->target.kind == OUTPUT_VIDEO ? job->key : frame_key;
    *made = output_look(&job->target, job->first, key) == OUTPUT_VALID;
    start_key(job);
    return true;
}

static bool open_output(Job *job, Error *error) {
    job->target.width = draw_width(job->drawer);
    job->target.height = draw_height(job->drawer);
    const Film *film = draw_film(job->drawer);
    job->target.rate = film->play > 0.0 ? film->play : film->rate;
    job->target.background = job->options->threads > 1;
    if (!output_may_write(&job->target, job->first, error)) {
        return false;
    }
    int processes = job->options->jobs;
    if (processes > 1 &&
        job->target.kind != OUTPUT_PICTURE) { /* before the encoder's thread starts */
        job->jobs =
            jobs_start(job->options, processes, job->target.width, job->target.height, error);
        if (!job->jobs) {
            return false;
        }
    }
    if (job->target.exr) {
        job->exr = exr_create(job->target.width, job->target.height);
    }
    job->output = output_create(&job->target, error);
    return job->output != NULL;
}

/* Takes the oldest frame that other processes have; all: every one of them. */
static bool collect(Job *job, bool all, Error *error) {
    bool any = true;
    do {
        Image image;
        int frame = 0;
        uint64_t key = 0;
        if (!jobs_next(job->jobs, &any, &image, &frame, &key, error) ||
            (any && !output_write(job->output, frame, &image, key, error))) {
            return false;
        }
        job->drawn += any;
    } while (any && all);
    return true;
}

static bool draw_one(Job *job, int frame, Error *error) {
    uint64_t key;
    if (!add_key(job, frame, &key, error)) {
        return false;
    }
    if (job->target.kind == OUTPUT_SEQUENCE && !job->target.force) {
        OutputState state = output_look(&job->target, frame, key);
        if (state == OUTPUT_VALID) {
            job->kept++;
            return true;
        }
        if (state == OUTPUT_FOREIGN && !output_may_write(&job->target, frame, error)) {
            return false;
        }
    }
    if (job->target.exr) {
        job->drawn++;
        return draw_exr(job->drawer, frame, &job->exr, error) &&
               output_write_exr(job->output, frame, &job->exr, key, error);
    }
    if (job->jobs) {
        return (!jobs_are_full(job->jobs) || collect(job, false, error)) &&
               jobs_give(job->jobs, frame, key, error);
    }
    const Image *image = draw_frame(job->drawer, frame, error);
    job->drawn += image != NULL;
    return image && output_write(job->output, frame, image, key, error);
}

static bool draw_all(Job *job, Error *error) {
    int expected = state_header(job->run.reader)->film.frame_count;
    int total = (job->last >= 0 ? job->last + 1 : expected) - job->first;
    int every = job->options->every;
    ProgressKind kind = job->options->quiet ? PROGRESS_NONE : job->options->progress;
    Progress progress = progress_start("render", kind, 0, total);
    bool good = true;
    for (int i = job->first; good && (job->last < 0 || i <= job->last); i += every) {
        RunEnd end = run_wait(&job->run, i);
        if (interrupt_requested() || end == RUN_INTERRUPTED) {
            good = error_set(error, EXIT_INTERRUPTED, "interrupted");
        } else if (end != RUN_FRAME) {
            job->end = end;
            break;
        } else {
            good = draw_one(job, i, error);
            progress_show(&progress, i - job->first + 1, "");
        }
    }
    good = good && (!job->jobs || collect(job, true, error));
    progress_end(&progress);
    return good;
}

static void report(const Job *job, double seconds, bool made) {
    if (job->options->json) {
        printf("{\"schema\": \"toile-render-1\", \"file\": \"%s\", \"width\": %d, \"height\": %d, "
               "\"frames_drawn\": %d, \"frames_kept\": %d, \"already_made\": %s, "
               "\"seconds\": %.3f}\n",
               job->target.path, draw_width(job->drawer), draw_height(job->drawer), job->drawn,
               job->kept, made ? "true" : "false", seconds);
    } else if (made && !job->options->quiet) {
        fprintf(stderr, "toile: %s is still valid; --force makes it again\n", job->target.path);
    } else if (!job->options->quiet) {
        fprintf(stderr, "toile: %s: %d frames drawn, %d kept\n", job->target.path, job->drawn,
                job->kept);
    }
}

/* 0 for a whole run; a run that stopped early gives a film of what there is, and 1. */
static ExitCode judge_end(const Job *job, Error *error) {
    if (job->options->run.follow && job->end == RUN_ABANDONED) {
        error_set(error, EXIT_DIFFERS, "%s: the run stopped after frame %d; the film ends there",
                  job->run.path, state_frame_count(job->run.reader) - 1);
        return EXIT_DIFFERS;
    }
    if (job->end == RUN_DAMAGED) {
        error_set(error, EXIT_BAD_INPUT, "%s: %s; the film ends before it", job->run.path,
                  state_damage(job->run.reader));
        return EXIT_BAD_INPUT;
    }
    return EXIT_OK;
}

static bool make_film(Job *job, Error *error) {
    double start = clock_seconds();
    bool made;
    job->drawer = command_open(job->options, &job->run, &job->end, error);
    if (!job->drawer || !choose_frames(job, error) || !is_made(job, &made, error)) {
        return false;
    }
    if (!made) {
        if (!open_output(job, error) || !draw_all(job, error)) {
            return false;
        }
        Output *output = job->output;
        job->output = NULL;
        if (!output_close(output, job->key, error)) {
            return false;
        }
    }
    report(job, clock_seconds() - start, made);
    return true;
}

/* What a kind of file cannot hold. */
static bool check_target(const Options *options, const OutputDef *target, Error *error) {
    if (options->clear && target->kind == OUTPUT_VIDEO &&
        !video_format_of(target->path)->clear_format) {
        char endings[256] = "";
        for (int i = 0; i < video_format_count; i++) {
            size_t used = strlen(endings);
            if (video_formats[i].clear_format) {
                snprintf(endings + used, sizeof endings - used, ".%s, ", video_formats[i].ending);
            }
        }
        return error_set(error, EXIT_USAGE, "--alpha: %s has none; use %s.png or .exr",
                         target->path, endings);
    }
    if (target->exr && (options->jobs > 1 || options->blur > 0.0)) {
        return error_set(error, EXIT_USAGE, ".exr pictures take no --%s",
                         options->jobs > 1 ? "jobs" : "blur: depth has no mean");
    }
    return true;
}

ExitCode command_render(const Options *options, Error *error) {
    Job job = {.options = options};
    if (!options->output) {
        error_set(error, EXIT_USAGE, "render: -o FILE is missing");
        return EXIT_USAGE;
    }
    if (!output_plan(options->output, &job.target, error)) {
        return error->code;
    }
    job.target.force = options->force;
    job.target.clear = options->clear;
    Options linear = *options;
    linear.linear = job.target.exr;
    job.options = &linear;
    if (!check_target(options, &job.target, error)) {
        return error->code;
    }
    bool good = make_film(&job, error);
    ExitCode code = good ? judge_end(&job, error) : error->code;
    output_abandon(job.output);
    jobs_stop(job.jobs);
    exr_free(&job.exr);
    draw_destroy(job.drawer);
    run_close(&job.run);
    return code;
}
