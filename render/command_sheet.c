/* sheet: a contact sheet of a run. */
#include <math.h>
#include <stdio.h>

#include "render/command.h"
#include "render/interrupt.h"
#include "render/output.h"

#define TILE_WIDTH 480 /* [px] */
#define TILE_GAP 8     /* [px] */
#define SHEET_GREY 24  /* of the gaps, 0..255 */

typedef struct Sheet {
    Image image;
    int columns, rows, tile_height;
} Sheet;

static Sheet sheet_create(int count, int width, int height) {
    Sheet sheet = {.columns = (int)ceil(sqrt(count))};
    sheet.rows = (count + sheet.columns - 1) / sheet.columns;
    sheet.tile_height = TILE_WIDTH * height / width;
    sheet.image = image_create(sheet.columns * (TILE_WIDTH + TILE_GAP) + TILE_GAP,
                               sheet.rows * (sheet.tile_height + TILE_GAP) + TILE_GAP);
    size_t bytes = IMAGE_CHANNELS * (size_t)sheet.image.width * (size_t)sheet.image.height;
    for (size_t i = 0; i < bytes; i++) {
        sheet.image.rgba[i] = SHEET_GREY;
    }
    return sheet;
}

static bool fill_sheet(const Options *options, Drawer *drawer, Sheet *sheet, int first, int last,
                       int count, Error *error) {
    Progress progress =
        progress_start("sheet", options->quiet ? PROGRESS_NONE : options->progress, 0, count);
    bool good = true;
    for (int i = 0; good && i < count; i++) {
        int frame = count > 1 ? first + (int)((double)(last - first) * i / (count - 1)) : last;
        const Image *image = draw_frame(drawer, frame, error);
        good =
            image && (!interrupt_requested() || error_set(error, EXIT_INTERRUPTED, "interrupted"));
        if (good) {
            int x = TILE_GAP + i % sheet->columns * (TILE_WIDTH + TILE_GAP);
            int y = TILE_GAP + i / sheet->columns * (sheet->tile_height + TILE_GAP);
            image_paste_shrunk(&sheet->image, image, x, y, TILE_WIDTH, sheet->tile_height);
            progress_show(&progress, i + 1, "");
        }
    }
    progress_end(&progress);
    return good;
}

static bool make_sheet(const Options *options, const OutputDef *target, Run *run, Drawer **drawer,
                       Sheet *sheet, Error *error) {
    RunEnd end;
    *drawer = command_open(options, run, &end, error);
    if (!*drawer || !output_may_write(target, 0, error)) {
        return false;
    }
    end = end == RUN_FRAME ? run_wait_end(run) : end;
    if (end == RUN_INTERRUPTED) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    int last = state_frame_count(run->reader) - 1;
    last = options->last >= 0 && options->last < last ? options->last : last;
    int first = options->first < last ? options->first : last;
    int count = options->count < last - first + 1 ? options->count : last - first + 1;
    *sheet = sheet_create(count, draw_width(*drawer), draw_height(*drawer));
    return fill_sheet(options, *drawer, sheet, first, last, count, error) &&
           output_write_picture(target, &sheet->image, error);
}

ExitCode command_sheet(const Options *options, Error *error) {
    OutputDef target = {.force = options->force};
    if (!options->output) {
        error_set(error, EXIT_USAGE, "sheet: -o FILE.png is missing");
        return EXIT_USAGE;
    }
    if (!output_plan(options->output, &target, error)) {
        return error->code;
    }
    if (target.kind != OUTPUT_PICTURE) {
        error_set(error, EXIT_USAGE, "sheet: -o %s: expected a .png", options->output);
        return EXIT_USAGE;
    }
    Run run = {0};
    Drawer *drawer = NULL;
    Sheet sheet = {0};
    bool good = make_sheet(options, &target, &run, &drawer, &sheet, error);
    image_free(&sheet.image);
    draw_destroy(drawer);
    run_close(&run);
    return good ? EXIT_OK : error->code;
}
