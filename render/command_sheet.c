/* sheet: a contact sheet of a run. looks: what cloths and obstacles can look like. */
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

static bool write_sheet(const OutputDef *target, const Image *image, Error *error) {
    OutputDef def = *target;
    def.width = image->width;
    def.height = image->height;
    Output *output = output_create(&def, error);
    if (!output) {
        return false;
    }
    if (!output_write(output, 0, image, 0, error)) {
        output_abandon(output);
        return false;
    }
    return output_close(output, 0, error);
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
           write_sheet(target, &sheet->image, error);
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

static bool is_fabric(int look) { return looks[look].quantity == QUANTITY_NONE; }

static void print_looks_json(void) {
    printf("{\"schema\": \"toile-looks-1\", \"cloths\": [");
    const char *comma = "";
    for (int i = 0; i < look_count; i++) {
        if (is_fabric(i)) {
            printf("%s{\"name\": \"%s\", \"about\": \"%s\", \"ends_per_cm\": %g, "
                   "\"picks_per_cm\": %g}",
                   comma, looks[i].name, looks[i].about, (double)looks[i].ends / 100.0,
                   (double)looks[i].picks / 100.0);
            comma = ", ";
        }
    }
    printf("], \"measuring\": [");
    comma = "";
    for (int i = 0; i < look_count; i++) {
        if (!is_fabric(i)) {
            printf("%s{\"name\": \"%s\", \"about\": \"%s\", \"unit\": \"%s\"}", comma,
                   looks[i].name, looks[i].about, quantities[looks[i].quantity].unit);
            comma = ", ";
        }
    }
    printf("], \"obstacles\": [");
    for (int i = 0; i < prop_look_count; i++) {
        printf("%s{\"name\": \"%s\", \"about\": \"%s\"}", i ? ", " : "", prop_looks[i].name,
               prop_looks[i].about);
    }
    printf("]}\n");
}

ExitCode command_looks(const Options *options, Error *error) {
    (void)error;
    if (options->json) {
        print_looks_json();
        return EXIT_OK;
    }
    printf("cloths (threads a cm, warp x weft):\n");
    for (int i = 0; i < look_count; i++) {
        if (is_fabric(i)) {
            printf("  %-12s %3.0f x %-3.0f %s\n", looks[i].name, (double)looks[i].ends / 100.0,
                   (double)looks[i].picks / 100.0, looks[i].about);
        }
    }
    printf("cloths, measuring (--range LOW,HIGH; by itself from the whole run):\n");
    for (int i = 0; i < look_count; i++) {
        if (!is_fabric(i)) {
            printf("  %-12s %-9s %s\n", looks[i].name, quantities[looks[i].quantity].unit,
                   looks[i].about);
        }
    }
    printf("obstacles:\n");
    for (int i = 0; i < prop_look_count; i++) {
        printf("  %-12s           %s\n", prop_looks[i].name, prop_looks[i].about);
    }
    return EXIT_OK;
}
