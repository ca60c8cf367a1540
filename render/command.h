/* command.h: the verbs of toile-render and what can be said on their command lines. */
#ifndef TOILE_RENDER_COMMAND_H
#define TOILE_RENDER_COMMAND_H

#include "render/compare.h"
#include "render/drape.h"
#include "render/draw.h"
#include "render/export.h"
#include "sim/base/progress.h"
#include "sim/base/version.h"

#define OPTIONS_MOST_PRINTS 16

typedef struct Options {
    const char *const *arguments; /* (argument_count) what stands after the verb */
    int argument_count;
    RunDef run;         /* the first argument, --follow, --writer PID, --patience S */
    const char *output; /* -o FILE */
    int first, last;    /* --frames A-B, from 0; last -1 = to the end */
    bool frames_given;
    int width, height;                       /* [px] --size WxH; 0 = the film's */
    const Quality *quality;                  /* --quality; standard */
    const char *camera;                      /* --camera NAME, of film: cameras; NULL: the first */
    const char *surface;                     /* --surface mesh|splats; NULL: the film's */
    const char *backdrop;                    /* --backdrop FILE or #rrggbb; NULL */
    const char *prints[OPTIONS_MOST_PRINTS]; /* --print [CLOTH=]FILE[@WIDTH] */
    int print_count;
    int triangles;                    /* --triangles N of the smooth surface; 0 */
    const char *title;                /* --title TEXT; NULL: the film's */
    double blur, play;                /* --blur PART, --play RATE; negative: the film's */
    bool clear;                       /* --alpha: no backdrop */
    bool linear;                      /* light instead of display code; set for .exr */
    bool show_time, show_scale;       /* --show-time --show-scale, besides the film's */
    int jobs;                         /* --jobs N processes; 1 */
    int every;                        /* --every N frames; 1 */
    const char *look;                 /* --look NAME, instead of the cloths' own; NULL */
    QuantityRange range;              /* --range LOW,HIGH; low = high: automatic */
    int threads;                      /* --threads; all processors */
    int count;                        /* --count, pictures on a contact sheet; 12 */
    bool force, json, quiet;          /* --force --json --quiet */
    bool crossings;                   /* --crossings, of measure */
    bool drawn;                       /* --drawn, of measure --crossings */
    bool gaps;                        /* --gaps, of measure */
    ExportDef export;                 /* --as, --keys, --up, --unit, --pc2-frames, --vtp-ascii */
    DrapeDef drape;                   /* --cloth, --disc, --centre */
    CompareDef compare;               /* --photo-*, --mask, --threshold, --face-only */
    bool csv;                         /* of measure */
    const char *plot;                 /* --plot FILE, of measure; NULL */
    const char *profile, *thresholds; /* of diff; NULL */
    bool resize, update;              /* of diff */
    ProgressKind progress;            /* --progress=auto|json|none */
} Options;

Options options_default(void);

/* One verb. Returns an exit code; on failure the error is filled in and printed by main. */
typedef struct Command {
    const char *name, *usage, *about;
    ExitCode (*run)(const Options *options, Error *error);
    int least, most; /* arguments */
    bool hidden;
} Command;

extern const Command commands[];
extern const int command_count;

/* Reads the command line and runs the verb on it. */
ExitCode command_run(int argc, char **argv, Error *error);

ExitCode command_render(const Options *options, Error *error);
ExitCode command_sheet(const Options *options, Error *error);
ExitCode command_measure(const Options *options, Error *error);
ExitCode command_gaps(const Options *options, Error *error);
ExitCode command_drape(const Options *options, Error *error);
ExitCode command_export(const Options *options, Error *error);
ExitCode command_diff(const Options *options, Error *error);
ExitCode command_compare(const Options *options, Error *error);
ExitCode command_looks(const Options *options, Error *error);
ExitCode command_frames(const Options *options, Error *error);
ExitCode command_versions(const Options *options, Error *error);
ExitCode command_bench(const Options *options, Error *error);

/* The film of a run with what the command line changes. Errors: EXIT_USAGE. */
bool command_film(const Options *options, const Film *film, Film *changed, Error *error);

/* Opens the run, waits as long as the pictures need, and prepares to draw it. *end: how the run
 * ended, RUN_FRAME while it is still going. NULL: error. */
Drawer *command_open(const Options *options, Run *run, RunEnd *end, Error *error);

/* The frames that are asked for and there. Who was asked for a whole run does not pass over what is
 * missing: a damaged file is an error, an unfinished one a note on stderr ("are `done`"). */
bool command_choose_frames(const Options *options, const Run *run, RunEnd end, const char *done,
                           int *first, int *last, Error *error);

/* What is measured frame by frame. */
typedef struct FrameMeasure {
    const char *option; /* "--crossings", for messages */
    void (*begin)(const Options *options);
    bool (*frame)(const Options *options, const StateHeader *header, const StateLayout *layout,
                  int layout_index, const StateFrame *frame, bool first, void *totals,
                  Error *error);
    void (*end)(const Options *options, bool complete, const void *totals);
} FrameMeasure;

/* Measures the frames that were asked for of one run. `begin` and `end` are called in pairs, when
 * there are frames; `end` also after an error, with complete = false. */
bool command_measure_frames(const Options *options, const FrameMeasure *measure, void *totals,
                            Error *error);

#endif
