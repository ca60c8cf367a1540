/* main.c: the program toile-sim: sim, check, fabrics, help, version. */
#include <errno.h>
#include <getopt.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sim/base/parallel.h"
#include "sim/base/progress.h"
#include "sim/base/text.h"
#include "sim/plan.h"
#include "sim/scene/mesh_import.h"
#include "sim/summary.h"
#include "sim/tester.h"

#define BREAKING_STRETCH 0.3

typedef struct Arguments {
    const char *program, *output, *model;
    bool resume, force, json, quiet, effective;
    int frames; /* simulate only so many; 0 = all */
    SimOptions options;
    ProgressKind progress;
} Arguments;

static void on_interrupt(int signal_number) {
    (void)signal_number;
    step_interrupted = 1;
}

static int fail(const Error *error) {
    fprintf(stderr, "%s\n", error->text);
    return error->code;
}

static int usage_error(const char *text, const char *word) {
    fprintf(stderr, "toile: %s%s%s\nusage: toile help\n", text, word ? ": " : "", word ? word : "");
    return EXIT_USAGE;
}

static void print_usage(FILE *out) {
    fprintf(out,
            "usage: toile sim SCENE -o RUN   simulate a scene; writes RUN/run.states\n"
            "       toile check SCENE        validate, print the plan and its cost\n"
            "       toile fabrics [NAME]     list the fabrics, or show one\n"
            "       toile test NAME FABRIC   a virtual tester: bending, shear, picture, tensile,\n"
            "                                cantilever; rows as CSV (see help tests)\n"
            "       toile help scene         every key of the scene language\n"
            "       toile help models        cloth models and steppers\n"
            "       toile help tests         the virtual testers\n"
            "       toile version            versions of toile and its libraries\n"
            "options: -o RUN  --resume  --force  --frames N  --threads N  --seed N  --json\n"
            "         --effective  --model NAME  --quiet  --progress auto|json|none\n");
}

static bool parse_number(const char *text, long least, long most, long *value) {
    char *end;
    errno = 0;
    *value = strtol(text, &end, 10);
    return *text && !*end && errno == 0 && *value >= least && *value <= most;
}

enum {
    OPT_RESUME = 256,
    OPT_FORCE,
    OPT_FRAMES,
    OPT_THREADS,
    OPT_SEED,
    OPT_JSON,
    OPT_QUIET,
    OPT_PROGRESS,
    OPT_EFFECTIVE,
    OPT_MODEL,
    OPT_HELP
};

static const struct option long_options[] = {
    {"output", required_argument, NULL, 'o'},
    {"resume", no_argument, NULL, OPT_RESUME},
    {"force", no_argument, NULL, OPT_FORCE},
    {"frames", required_argument, NULL, OPT_FRAMES},
    {"threads", required_argument, NULL, OPT_THREADS},
    {"seed", required_argument, NULL, OPT_SEED},
    {"json", no_argument, NULL, OPT_JSON},
    {"quiet", no_argument, NULL, OPT_QUIET},
    {"progress", required_argument, NULL, OPT_PROGRESS},
    {"effective", no_argument, NULL, OPT_EFFECTIVE},
    {"model", required_argument, NULL, OPT_MODEL},
    {"help", no_argument, NULL, OPT_HELP},
    {0},
};

/* what the value of an option may be */
static const char *expected(int option) {
    switch (option) {
    case OPT_FRAMES:
        return "a whole number from 1";
    case OPT_THREADS:
        return "a whole number from 1 to 1024";
    case OPT_SEED:
        return "a whole number from 0";
    case OPT_PROGRESS:
        return "auto, json or none";
    case OPT_MODEL:
        return "a model; see toile help models";
    default:
        return "a value";
    }
}

/* why getopt_long or take_option did not take an option: `word` is the last that was read */
static int option_error(int option, const char *word) {
    if (option == ':') {
        return usage_error("a value is missing after", word);
    }
    if (option != '?') {
        fprintf(stderr, "toile: '%s': expected %s\n", word, expected(option));
        return EXIT_USAGE;
    }
    if (optopt >= OPT_RESUME) {
        return usage_error("an option takes no value", word);
    }
    const char *names[sizeof long_options / sizeof *long_options];
    int count = 0;
    while (long_options[count].name) {
        names[count] = long_options[count].name;
        count++;
    }
    names[count] = NULL;
    const char *near = optopt ? NULL : text_nearest(word + 2, names);
    fprintf(stderr, "toile: no option is called '%s'%s%s%s\n", word,
            near ? "; did you mean '--" : "; see toile-sim --help", near ? near : "",
            near ? "'?" : "");
    return EXIT_USAGE;
}

static bool take_option(int option, Arguments *a) {
    long number;
    switch (option) {
    case 'o':
        a->output = optarg;
        return true;
    case OPT_RESUME:
        return a->resume = true;
    case OPT_FORCE:
        return a->force = true;
    case OPT_JSON:
        return a->json = true;
    case OPT_QUIET:
        a->progress = PROGRESS_NONE;
        return a->quiet = true;
    case OPT_EFFECTIVE:
        return a->effective = true;
    case OPT_MODEL:
        a->model = optarg;
        return cloth_model_find(optarg) != NULL;
    case OPT_PROGRESS:
        return progress_parse(optarg, &a->progress);
    case OPT_FRAMES:
        a->frames = parse_number(optarg, 1, 1 << 30, &number) ? (int)number : 0;
        return a->frames > 0;
    case OPT_THREADS:
        a->options.threads = parse_number(optarg, 1, 1024, &number) ? (int)number : 0;
        return a->options.threads > 0;
    case OPT_SEED:
        a->options.seed = parse_number(optarg, 0, 1L << 62, &number) ? (uint64_t)number : 0;
        return parse_number(optarg, 0, 1L << 62, &number);
    default:
        return false;
    }
}

static bool read_scene(const char *path, Arena *arena, Scene *scene, const Arguments *a,
                       Error *error) {
    const char *models[16] = {0}, *stepper_names[16] = {"auto"};
    for (int i = 0; cloth_models[i]; i++) {
        models[i] = cloth_models[i]->name;
    }
    for (int i = 0; steppers[i]; i++) {
        stepper_names[i + 1] = steppers[i]->name;
    }
    SceneWords words = {.models = models, .steppers = stepper_names};
    if (!scene_read(path, &words, arena, scene, error)) {
        return false;
    }
    for (int i = 0; i < scene->warning_count && !a->quiet; i++) {
        fprintf(stderr, "%s\n", scene->warnings[i]);
    }
    return true;
}

static int run_check(const char *path, const Arguments *a) {
    Arena arena = {0};
    Scene scene;
    Error error = {0};
    Sim *sim = arena_push(&arena, Sim, 1);
    bool ok = read_scene(path, &arena, &scene, a, &error);
    if (ok && a->effective) {
        scene_print_effective(&scene, stdout);
    } else if (ok) {
        ok = sim_create(sim, &scene, &a->options, &error);
        if (ok) {
            plan_print(sim, stdout, a->json);
            sim_destroy(sim);
        }
    }
    arena_free(&arena);
    return ok ? EXIT_OK : fail(&error);
}

/* The states file of a run, opened at its start, at its last whole frame, or not at all. */
typedef enum Opened { OPENED, OPENED_COMPLETE, OPENED_ERROR } Opened;

static Opened open_new(Sim *sim, const char *path, StateWriter **writer, Error *error) {
    *writer = state_create(path, error);
    if (!*writer) {
        return OPENED_ERROR;
    }
    return sim_write_start(sim, *writer, error) && sim_write_frame(sim, *writer, error)
               ? OPENED
               : OPENED_ERROR;
}

static Opened open_run(Sim *sim, const char *path, int frames, const Arguments *a,
                       StateWriter **writer, Error *error) {
    if (a->force || access(path, F_OK) != 0) {
        return open_new(sim, path, writer, error);
    }
    StateReader *reader = state_open(path, error);
    if (!reader) {
        size_t used = strlen(error->text);
        snprintf(error->text + used, sizeof error->text - used, "\n(--force starts it anew)");
        return OPENED_ERROR;
    }
    StateStatus status = state_refresh(reader);
    int whole = state_frame_count(reader);
    bool same = state_header(reader)->scene_hash == sim->hash &&
                strcmp(state_header(reader)->program, "toile " TOILE_VERSION) == 0;
    Opened result = OPENED_ERROR;
    if (!same) {
        error_set(error, EXIT_BAD_INPUT,
                  "%s was made from another scene, seed or version (--force starts it anew)", path);
    } else if (status == STATE_FINISHED && whole >= frames) {
        result = OPENED_COMPLETE;
    } else if (!a->resume && status != STATE_FINISHED) {
        error_set(error, EXIT_BAD_INPUT,
                  "%s holds %d of %d frames (--resume goes on, --force starts it anew)", path,
                  whole, frames);
    } else if (whole == 0) {
        result = open_new(sim, path, writer, error);
    } else if (sim_load_frame(sim, reader, whole - 1, error)) {
        if (status == STATE_DAMAGED && !a->quiet) {
            fprintf(stderr, "%s: %s; going on after them\n", path, state_damage(reader));
        }
        *writer = state_append(path, whole - 1, error);
        result = *writer ? OPENED : OPENED_ERROR;
    }
    state_reader_close(reader);
    return result;
}

/* once, when cloth is asked for more than cloth can do */
static void warn_of_stretch(const Sim *sim, bool *warned) {
    if (sim->statistics.stretch > BREAKING_STRETCH && !*warned) {
        *warned = true;
        fprintf(
            stderr,
            "sim: t = %.4g s: cloth '%s' is stretched by %.0f %% along its threads; woven cloth "
            "tears at 10 to 30 %%, so from here on no real one follows\n",
            sim->state.time, sim->scene->cloths[sim->stretched].name,
            100.0 * sim->statistics.stretch);
    }
}

/* once, when contact does not let held cloth follow */
static void warn_of_handle(const Sim *sim, bool *warned) {
    if (sim->statistics.behind > sim->system.contact.distance && !*warned) {
        *warned = true;
        fprintf(stderr,
                "sim: t = %.4g s: cloth '%s' is held %.3g mm behind its handle: an obstacle or "
                "cloth is in its way, and it follows as far as that lets it\n",
                sim->state.time, sim->scene->cloths[sim->behind].name,
                1e3 * sim->statistics.behind);
    }
}

static bool make_frames(Sim *sim, StateWriter *writer, int frames, const Arguments *a,
                        Error *error) {
    Progress progress = progress_start("sim", a->progress, sim->frame + 1, frames);
    bool ok = true, warned[2] = {a->quiet, a->quiet};
    while (ok && sim->frame + 1 < frames) {
        char detail[64];
        ok = sim_advance(sim, error) && sim_write_frame(sim, writer, error);
        snprintf(detail, sizeof detail, "t = %.3f s", sim->state.time);
        if (ok) {
            progress_show(&progress, sim->frame + 1, detail);
            warn_of_stretch(sim, &warned[0]);
            warn_of_handle(sim, &warned[1]);
        }
    }
    progress_end(&progress);
    return ok && state_write_done(writer, "all frames were made", error);
}

static int finish_run(Sim *sim, const char *scene_path, const Arguments *a, bool ok,
                      const Error *error) {
    if (ok) {
        if (!a->quiet || a->json) {
            summary_print(sim, a->json ? stdout : stderr, a->json);
        }
        return EXIT_OK;
    }
    if (error->code == EXIT_INTERRUPTED) {
        fprintf(stderr,
                "toile: stopped after frame %d; go on with: toile sim '%s' -o '%s' --resume",
                sim->frame, scene_path, a->output);
        if (a->options.seed != sim_options_default().seed) {
            fprintf(stderr, " --seed %llu", (unsigned long long)a->options.seed);
        }
        fputc('\n', stderr);
        return EXIT_INTERRUPTED;
    }
    return fail(error);
}

static int run_sim(const char *scene_path, const Arguments *a) {
    if (!a->output) {
        return usage_error("sim needs -o RUN (a folder for run.states)", NULL);
    }
    Arena arena = {0};
    Scene scene;
    Error error = {0};
    Sim *sim = arena_push(&arena, Sim, 1);
    if (!read_scene(scene_path, &arena, &scene, a, &error) ||
        !sim_create(sim, &scene, &a->options, &error)) {
        arena_free(&arena);
        return fail(&error);
    }
    if (sim->moves.untangled > 0 && !a->quiet) {
        fprintf(stderr, "sim: cloth crossed cloth at the start: %d nodes were pulled apart\n",
                sim->moves.untangled);
    }
    if (sim->moves.pushed_out > 0 && !a->quiet) {
        fprintf(stderr, "sim: %d nodes started too near to obstacles and were moved out\n",
                sim->moves.pushed_out);
    }
    if (mkdir(a->output, 0755) != 0 && errno != EEXIST) {
        error_set_errno(&error, EXIT_IO, "cannot make the folder %s", a->output);
    }
    char *path = arena_alloc(&arena, strlen(a->output) + sizeof "/run.states");
    sprintf(path, "%s/run.states", a->output);
    int frames = scene.film.frame_count;
    if (a->frames > frames && !a->quiet) {
        fprintf(stderr, "sim: --frames %d: the film has only %d, and all of them are made\n",
                a->frames, frames);
    }
    frames = a->frames > 0 && a->frames < frames ? a->frames : frames;
    StateWriter *writer = NULL;
    Opened opened = error.code ? OPENED_ERROR : open_run(sim, path, frames, a, &writer, &error);
    bool ok = opened == OPENED && make_frames(sim, writer, frames, a, &error);
    if (writer) {
        ok = state_close(writer, &error) && ok;
    }
    int code;
    if (opened == OPENED_COMPLETE) {
        code = EXIT_OK;
        if (!a->quiet) {
            fprintf(stderr, "sim: %s is complete already\n", path);
        }
    } else {
        code = finish_run(sim, scene_path, a, ok, &error);
    }
    sim_destroy(sim);
    arena_free(&arena);
    return code;
}

static int run_fabrics(const char *name, const Arguments *a) {
    Error error = {0};
    bool ok = name ? fabric_print(name, stdout, a->json, &error)
                   : fabric_print_list(stdout, a->json, &error);
    return ok ? EXIT_OK : fail(&error);
}

static int run_test(const char *test, const char *fabric, const Arguments *a) {
    Error error = {0};
    if (!test || !fabric) {
        return usage_error("test needs the name of a test (see toile help tests) and a fabric",
                           NULL);
    }
    if (a->output) {
        return usage_error("toile-sim draws nothing; scripts/toile test has -o", NULL);
    }
    bool ok = tester_print(test, fabric, a->model ? a->model : cloth_models[0]->name, a->json,
                           stdout, &error);
    return ok ? EXIT_OK : fail(&error);
}

static int run_help(const char *topic) {
    if (topic && strcmp(topic, "scene") == 0) {
        scene_print_reference(stdout);
    } else if (topic && strcmp(topic, "models") == 0) {
        for (const ClothModel *const *model = cloth_models; *model; model++) {
            printf("model    %-16s %s\n", (*model)->name, (*model)->about);
        }
        for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
            printf("stepper  %-16s %s\n", (*stepper)->name, (*stepper)->about);
        }
    } else if (topic && strcmp(topic, "tests") == 0) {
        for (const Tester *tester = testers; tester->name; tester++) {
            printf("test     %-16s %s\n", tester->name, tester->about);
        }
    } else if (topic) {
        return usage_error("there is help for 'scene', 'models' and 'tests', not for", topic);
    } else {
        print_usage(stdout);
    }
    return EXIT_OK;
}

static int run_version(void) {
    printf("toile %s\n%s\n%s\n", TOILE_VERSION, factor_version(), mesh_import_version());
    return EXIT_OK;
}

static int dispatch(const char *verb, char *const *operands, int operand_count,
                    const Arguments *a) {
    static const char *const verbs[] = {"sim", "check", "fabrics", "test", "help", "version", NULL};
    const char *operand = operand_count > 0 ? operands[0] : NULL;
    bool test = strcmp(verb, "test") == 0;
    int most = strcmp(verb, "version") == 0 ? 0 : test ? 2 : 1;
    if (operand_count > most) {
        return usage_error("too many words after", verb);
    }
    bool needs_scene = strcmp(verb, "sim") == 0 || strcmp(verb, "check") == 0;
    if (needs_scene && !operand) {
        return usage_error("a scene file is missing after", verb);
    }
    if (strcmp(verb, "sim") == 0) {
        return run_sim(operand, a);
    }
    if (strcmp(verb, "check") == 0) {
        return run_check(operand, a);
    }
    if (strcmp(verb, "fabrics") == 0) {
        return run_fabrics(operand, a);
    }
    if (test) {
        return run_test(operand, operand_count > 1 ? operands[1] : NULL, a);
    }
    if (strcmp(verb, "help") == 0) {
        return run_help(operand);
    }
    if (strcmp(verb, "version") == 0) {
        return run_version();
    }
    const char *near = text_nearest(verb, verbs);
    fprintf(stderr, "toile: no verb '%s'%s%s%s\n", verb, near ? "; did you mean '" : "",
            near ? near : "", near ? "'?" : "");
    return EXIT_USAGE;
}

int main(int argc, char **argv) {
    parallel_fix_environment(argv);
    Arguments arguments = {.options = sim_options_default()};
    struct sigaction action = {.sa_handler = on_interrupt};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    opterr = 0;
    for (int option; (option = getopt_long(argc, argv, ":o:h", long_options, NULL)) != -1;) {
        if (option == 'h' || option == OPT_HELP) {
            print_usage(stdout);
            return EXIT_OK;
        }
        if (option == '?' || option == ':' || !take_option(option, &arguments)) {
            return option_error(option, argv[optind - 1]);
        }
    }
    if (optind >= argc) {
        print_usage(stderr);
        return EXIT_USAGE;
    }
    int code = dispatch(argv[optind], argv + optind + 1, argc - optind - 1, &arguments);
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fprintf(stderr, "toile: stdout could not be written\n");
        return code == EXIT_OK ? EXIT_IO : code;
    }
    return code;
}
