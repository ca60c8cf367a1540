/* The command line of toile-render. */
#include <getopt.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/command.h"
#include "sim/base/text.h"

#define MOST_PIXELS 16384 /* along a side: the driver's largest texture, without supersampling */

const Command commands[] = {
    {"render", "RUN -o FILE", "video (mp4, mov, webm), sequence (%04d.png or a folder), picture",
     command_render, false},
    {"sheet", "RUN -o FILE.png", "contact sheet of a run", command_sheet, false},
    {"measure", "RUN --crossings",
     "triangles that cross in any frame; exit code 1 if there are any", command_measure, false},
    {"looks", "", "what cloths and obstacles can look like", command_looks, false},
    {"versions", "", "versions of the libraries in use", command_versions, false},
    {"bench", "RUN", "CPU time of each stage of a frame, as CSV", command_bench, true},
};
const int command_count = sizeof commands / sizeof commands[0];

Options options_default(void) {
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    return (Options){.run = run_default(),
                     .last = -1,
                     .quality = quality_find(QUALITY_DEFAULT),
                     .threads = processors > 0 ? (int)processors : 1,
                     .count = 12,
                     .progress = PROGRESS_AUTO};
}

enum {
    FRAMES = 256,
    SIZE,
    QUALITY,
    LOOK,
    FOLLOW,
    WRITER,
    PATIENCE,
    THREADS,
    COUNT,
    FORCE,
    CROSSINGS,
    JSON,
    QUIET,
    PROGRESS,
    HELP,
    VERSION
};

static const struct option long_options[] = {{"output", required_argument, NULL, 'o'},
                                             {"frames", required_argument, NULL, FRAMES},
                                             {"size", required_argument, NULL, SIZE},
                                             {"quality", required_argument, NULL, QUALITY},
                                             {"look", required_argument, NULL, LOOK},
                                             {"follow", no_argument, NULL, FOLLOW},
                                             {"writer", required_argument, NULL, WRITER},
                                             {"patience", required_argument, NULL, PATIENCE},
                                             {"threads", required_argument, NULL, THREADS},
                                             {"count", required_argument, NULL, COUNT},
                                             {"force", no_argument, NULL, FORCE},
                                             {"crossings", no_argument, NULL, CROSSINGS},
                                             {"json", no_argument, NULL, JSON},
                                             {"quiet", no_argument, NULL, QUIET},
                                             {"progress", required_argument, NULL, PROGRESS},
                                             {"help", no_argument, NULL, HELP},
                                             {"version", no_argument, NULL, VERSION},
                                             {0}};

static void print_help(FILE *out) {
    fprintf(out, "toile-render: draws the runs of toile-sim\n\n");
    for (int i = 0; i < command_count; i++) {
        if (!commands[i].hidden) {
            fprintf(out, "  toile-render %-8s %-16s %s\n", commands[i].name, commands[i].usage,
                    commands[i].about);
        }
    }
    fprintf(out, "\n  RUN                 a run directory, or its " RUN_FILE "\n"
                 "  --frames A-B        only these frames, from 0; A or A- too\n"
                 "  --size WxH          [px] even; default: the film's\n"
                 "  --quality NAME      ");
    for (int i = 0; i < quality_count; i++) {
        fprintf(out, "%s%-8s  %s\n", i ? "                      " : "", qualities[i].name,
                qualities[i].about);
    }
    fprintf(out,
            "  --look NAME         of all cloths, instead of their own (see looks)\n"
            "  --follow            wait for frames while the run is still written\n"
            "  --writer PID        with --follow: the process that writes it\n"
            "  --patience SECONDS  with --follow: without a writer, give up after so long; 60\n"
            "  --threads N         default: all processors\n"
            "  --count N           pictures on a contact sheet; 12\n"
            "  --crossings         measure: pairs of triangles that cross, exactly, and triangles\n"
            "                      inside an obstacle\n"
            "  --force             make it again; overwrite files of others\n"
            "  --json  --progress=auto|json|none  --quiet  --help  --version\n");
}

static bool read_int(const char *text, int least, int most, int *value, const char **rest) {
    char *end;
    long number = strtol(text, &end, 10);
    if (end == text || number < least || number > most || (!rest && *end)) {
        return false;
    }
    *value = (int)number;
    if (rest) {
        *rest = end;
    }
    return true;
}

/* A, A-, or A-B. */
static bool read_frames(const char *text, Options *options, Error *error) {
    const char *rest;
    options->frames_given = true;
    bool good = read_int(text, 0, INT_MAX, &options->first, &rest);
    if (good && *rest == '\0') {
        options->last = options->first;
    } else if (good && strcmp(rest, "-") == 0) {
        options->last = -1;
    } else {
        good = good && *rest == '-' && read_int(rest + 1, 0, INT_MAX, &options->last, NULL) &&
               options->last >= options->first;
    }
    return good || error_set(error, EXIT_USAGE, "--frames %s: expected A, A- or A-B", text);
}

static bool read_size(const char *text, Options *options, Error *error) {
    const char *rest;
    bool good = read_int(text, 16, MOST_PIXELS, &options->width, &rest) && *rest == 'x' &&
                read_int(rest + 1, 16, MOST_PIXELS, &options->height, NULL) &&
                options->width % 2 == 0 && options->height % 2 == 0;
    return good || error_set(error, EXIT_USAGE,
                             "--size %s: expected WIDTHxHEIGHT in pixels, both even, 16 to %d",
                             text, MOST_PIXELS);
}

static bool read_quality(const char *text, Options *options, Error *error) {
    const char *names[8] = {0};
    for (int i = 0; i < quality_count; i++) {
        names[i] = qualities[i].name;
    }
    options->quality = quality_find(text);
    const char *near = text_nearest(text, names);
    return options->quality ||
           error_set(error, EXIT_USAGE, "--quality %s: expected draft, standard or quality%s%s%s",
                     text, near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
}

static bool read_number(const char *name, const char *text, int least, int *value, Error *error) {
    return read_int(text, least, INT_MAX, value, NULL) ||
           error_set(error, EXIT_USAGE, "--%s %s: expected a whole number from %d", name, text,
                     least);
}

static bool read_option(int option, const char *text, Options *options, Error *error) {
    int number = 0;
    switch (option) {
    case 'o':
        options->output = text;
        return true;
    case FRAMES:
        return read_frames(text, options, error);
    case SIZE:
        return read_size(text, options, error);
    case QUALITY:
        return read_quality(text, options, error);
    case LOOK:
        options->look = text;
        return true;
    case FOLLOW:
        return options->run.follow = true;
    case WRITER:
        return read_number("writer", text, 1, &options->run.writer, error);
    case PATIENCE:
        if (!read_number("patience", text, 0, &number, error)) {
            return false;
        }
        options->run.patience = number;
        return true;
    case THREADS:
        return read_number("threads", text, 1, &options->threads, error);
    case COUNT:
        return read_number("count", text, 1, &options->count, error);
    case FORCE:
        return options->force = true;
    case CROSSINGS:
        return options->crossings = true;
    case JSON:
        return options->json = true;
    case QUIET:
        return options->quiet = true;
    case PROGRESS:
        return progress_parse(text, &options->progress) ||
               error_set(error, EXIT_USAGE, "--progress %s: expected auto, json or none", text);
    default:
        return error_set(error, EXIT_USAGE, "see toile-render --help");
    }
}

static const Command *find_command(const char *name, Error *error) {
    const char *names[16] = {0};
    for (int i = 0; i < command_count; i++) {
        if (strcmp(commands[i].name, name) == 0) {
            return &commands[i];
        }
        names[i] = commands[i].name;
    }
    const char *near = text_nearest(name, names);
    error_set(error, EXIT_USAGE, "no verb is called '%s'; %s '%s'", name,
              near ? "did you mean" : "there is for example", near ? near : names[0]);
    return NULL;
}

ExitCode command_run(int argc, char **argv, Error *error) {
    Options options = options_default();
    int option;
    while ((option = getopt_long(argc, argv, "o:h", long_options, NULL)) != -1) {
        if (option == HELP || option == 'h') {
            print_help(stdout);
            return EXIT_OK;
        }
        if (option == VERSION) {
            printf("toile %s\n", TOILE_VERSION);
            return EXIT_OK;
        }
        if (!read_option(option, optarg, &options, error)) {
            return EXIT_USAGE;
        }
    }
    const Command *command =
        optind < argc ? find_command(argv[optind], error)
                      : (error_set(error, EXIT_USAGE, "expected a verb; see --help"), NULL);
    if (!command) {
        return EXIT_USAGE;
    }
    int wanted = command->usage[0] ? 1 : 0;
    if (argc - optind - 1 != wanted) {
        error_set(error, EXIT_USAGE, "usage: toile-render %s %s", command->name, command->usage);
        return EXIT_USAGE;
    }
    options.run.path = wanted ? argv[optind + 1] : NULL;
    return command->run(&options, error);
}
