/* measure: metrology of drapes, one run or an ensemble of them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/command.h"
#include "render/drape_report.h"
#include "render/interrupt.h"
#include "sim/base/memory.h"

typedef struct Measured {
    Drape drape;
    double settling;
} Measured;

static bool write_file(const char *folder, const char *name, const Measured *measured,
                       void (*print)(const Drape *drape, FILE *out), Error *error) {
    char path[FILE_PATH_SIZE];
    PartFile file;
    snprintf(path, sizeof path, "%.4000s/%s", folder, name);
    if (!file_create_folders(path, error) || !file_start(&file, path, error)) {
        return false;
    }
    if (print) {
        print(&measured->drape, file.out);
    } else {
        drape_print_json(&measured->drape, measured->settling, file.out);
        fputc('\n', file.out);
    }
    return file_finish(&file, error);
}

static bool write_files(const char *folder, const Measured *measured, Error *error) {
    return write_file(folder, "drape.json", measured, NULL, error) &&
           write_file(folder, "contour.csv", measured, drape_print_contour, error) &&
           write_file(folder, "harmonics.csv", measured, drape_print_harmonics, error);
}

static bool open_run(const Options *options, const char *path, Run *run, int *first, int *last,
                     Error *error) {
    RunDef def = options->run;
    def.path = path;
    return run_open(run, &def, error) &&
           command_choose_frames(options, run, run_wait_end(run), "measured", first, last, error);
}

/* A row of CSV for every frame of a range. */
static bool print_series(const Options *options, Run *run, int first, int last, Arena *arena,
                         Error *error) {
    drape_print_csv_head(stdout);
    for (int i = first; i <= last; i++) {
        Drape drape;
        ArenaMark mark = arena_mark(arena);
        if (interrupt_requested()) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        if (!drape_measure(run, &options->drape, i, arena, &drape, error)) {
            return false;
        }
        drape_print_csv(&drape, stdout);
        arena_rewind(arena, mark);
    }
    return true;
}

/* The last frame asked for of one run. *series: rows were printed instead. */
static bool measure_run(const Options *options, const char *path, Arena *arena, Measured *measured,
                        bool *series, Error *error) {
    Run run = {0};
    int first, last;
    bool good = open_run(options, path, &run, &first, &last, error);
    *series = good && options->csv && options->argument_count == 1;
    if (*series) {
        good =
            print_series(options, &run, options->frames_given ? first : last, last, arena, error);
    } else if (good) {
        good = drape_measure(&run, &options->drape, last, arena, &measured->drape, error) &&
               drape_find_settling(&run, &options->drape, &measured->settling, error);
    }
    run_close(&run);
    return good;
}

static void print_all(const Options *options, const Measured *measured, const Drape *drapes,
                      int count) {
    bool together = count > 1;
    Ensemble ensemble = ensemble_find(drapes, count);
    if (options->json) {
        fputs(together ? "{\"schema\": \"toile-ensemble-1\", \"runs\": [\n" : "", stdout);
        for (int i = 0; i < count; i++) {
            fputs(i ? ",\n" : "", stdout);
            drape_print_json(&measured[i].drape, measured[i].settling, stdout);
        }
        if (together) {
            fputs("],\n\"ensemble\": ", stdout);
            ensemble_print_json(&ensemble, stdout);
            fputc('}', stdout);
        }
        fputc('\n', stdout);
        return;
    }
    if (options->csv) {
        drape_print_csv_head(stdout);
    }
    for (int i = 0; i < count; i++) {
        if (options->csv) {
            drape_print_csv(&drapes[i], stdout);
        } else if (together) {
            printf("%s: %.2f %%, %d nodes\n", options->arguments[i], drapes[i].dc,
                   drapes[i].nodes.count);
        } else {
            drape_print_text(&drapes[i], measured[i].settling, stdout);
        }
    }
    if (together && !options->csv) {
        ensemble_print_text(&ensemble, stdout);
    }
}

static bool measure_all(const Options *options, Measured *measured, Drape *drapes, Arena *arena,
                        Error *error) {
    int count = options->argument_count;
    for (int i = 0; i < count; i++) {
        bool series;
        if (!measure_run(options, options->arguments[i], arena, &measured[i], &series, error)) {
            return false;
        }
        if (series) {
            return true;
        }
        drapes[i] = measured[i].drape;
        if (count > 1 && isnan(drapes[i].dc)) {
            return error_set(error, EXIT_BAD_INPUT, "%s: no support below the cloth; --disc RADIUS",
                             options->arguments[i]);
        }
    }
    print_all(options, measured, drapes, count);
    int shown = count < DRAPE_PLOT_MOST ? count : DRAPE_PLOT_MOST;
    return (!options->plot ||
            drape_plot(drapes, options->arguments, shown, options->plot, error)) &&
           (!options->output || write_files(options->output, &measured[0], error));
}

ExitCode command_drape(const Options *options, Error *error) {
    size_t count = (size_t)options->argument_count;
    Measured *measured = memory_zeroed(count, sizeof *measured);
    Drape *drapes = memory_zeroed(count, sizeof *drapes);
    Arena arena = {0};
    bool good = measure_all(options, measured, drapes, &arena, error);
    arena_free(&arena);
    free(measured);
    free(drapes);
    return good ? EXIT_OK : error->code;
}
