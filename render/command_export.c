/* export: the moving mesh of a run in a format of other programs. */
#include <stdio.h>
#include <string.h>

#include "render/command.h"
#include "render/interrupt.h"
#include "render/json.h"

static bool plan(const Options *options, Error *error) {
    const ExportFormat *format = options->export.format;
    if (!format || !options->output) {
        return error_set(
            error, EXIT_USAGE,
            "export: expected --as FORMAT and -o PATH; formats: obj-pc2, obj-mdd, ply, "
            "vtp, gltf, usd");
    }
    if (strlen(options->output) >= FILE_PATH_SIZE - 64) {
        return error_set(error, EXIT_USAGE, "-o: the path is too long");
    }
    const char *ending = file_ending(options->output);
    if (format->ending && strcmp(ending, format->ending) != 0) {
        return error_set(error, EXIT_USAGE, "-o %s: %s files end in .%s", options->output,
                         format->name, format->ending);
    }
    if (format->fixed_up &&
        ((options->export.up && options->export.up != format->up) || options->export.scale != 1)) {
        return error_set(error, EXIT_USAGE, "%s is always in metres with %c up", format->name,
                         format->up);
    }
    return true;
}

static bool read_frame(Export *export, Run *run, int index, int *layout_index, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int now;
    if (!state_read_frame(run->reader, index, &frame, &layout, &now, error)) {
        return false;
    }
    if (now != *layout_index) {
        if (export->frame_index > 0 && export->def->format->one_mesh) {
            return error_set(error, EXIT_BAD_INPUT,
                             "the mesh changes at frame %d, which %s cannot hold: --frames A-B "
                             "exports a part, --as ply or vtp everything",
                             frame.frame, export->def->format->name);
        }
        *layout_index = now;
        if (!export_set_layout(export, &layout, error)) {
            return false;
        }
    }
    return export_set_frame(export, &layout, &frame, error);
}

static bool write_frames(const Options *options, Export *export, Run *run, int first,
                         Error *error) {
    int layout_index = -1;
    bool good = true;
    ProgressKind kind = options->quiet ? PROGRESS_NONE : options->progress;
    Progress progress = progress_start("export", kind, 0, export->frame_count);
    for (int i = 0; good && i < export->frame_count; i++) {
        export->frame_index = i;
        good = read_frame(export, run, first + i, &layout_index, error) &&
               (i > 0 || export->def->format->start(export, error)) &&
               export->def->format->add(export, error) &&
               (!interrupt_requested() || error_set(error, EXIT_INTERRUPTED, "interrupted"));
        progress_show(&progress, i + 1, "");
    }
    progress_end(&progress);
    return good && export->def->format->finish(export, error);
}

static void report(const Options *options, const Export *export) {
    if (options->json) {
        printf("{\"schema\": \"toile-export-1\", \"format\": \"%s\", \"path\": ",
               export->def->format->name);
        json_string(stdout, export->path);
        printf(", \"frames\": %d, \"cloths\": %d, \"up\": \"%c\", \"unit\": \"%s\", \"note\": ",
               export->frame_count, export->body_count, export->up, export->def->unit);
        json_string(stdout, export->note);
        printf("}\n");
    } else if (!options->quiet) {
        fprintf(stderr, "toile: %s: %d frames, unit %s, %c up%s%s\n", export->path,
                export->frame_count, export->def->unit, export->up, export->note[0] ? "; " : "",
                export->note);
    }
}

static bool export_run(const Options *options, const ExportDef *def, Run *run, Export *export,
                       Error *error) {
    int first, last;
    if (!plan(options, error) || !run_open(run, &options->run, error) ||
        !command_choose_frames(options, run, run_wait_end(run), "exported", &first, &last, error)) {
        return false;
    }
    *export = (Export){.def = def,
                       .path = options->output,
                       .header = state_header(run->reader),
                       .up = def->up ? def->up : def->format->up,
                       .rate = state_header(run->reader)->film.rate,
                       .frame_count = last - first + 1};
    return write_frames(options, export, run, first, error);
}

ExitCode command_export(const Options *options, Error *error) {
    ExportDef def = options->export;
    Export export = {0};
    Run run = {0};
    def.force = options->force;
    bool good = export_run(options, &def, &run, &export, error);
    if (good) {
        report(options, &export);
    }
    if (export.def && export.state) {
        export.def->format->abandon(&export);
    }
    arena_free(&export.arena);
    arena_free(&export.layout);
    run_close(&run);
    return good ? EXIT_OK : error->code;
}
