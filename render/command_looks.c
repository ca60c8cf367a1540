/* looks: what cloths and obstacles can look like, as a list and as a sheet of swatches. */
#include <stdio.h>
#include <string.h>

#include "render/command.h"
#include "render/gl.h"
#include "render/interrupt.h"
#include "render/output.h"
#include "render/sheet.h"
#include "render/swatch.h"

#define MOST_TILES 128

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

static void print_looks(void) {
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
}

/* ---- the swatch sheet ---- */

#define COLUMNS 4
#define TILE_WIDTH 400 /* [px] */
#define TILE_HEIGHT 330
#define INSET 116       /* [px] side of the close view */
#define GAP 8           /* [px] */
#define LABEL_HEIGHT 30 /* [px] */
#define LABEL_SIZE 15.0 /* [px] */
#define SHEET_GREY 24

static const SheetColor LABEL_INK = {0.93, 0.93, 0.91, 1.0};

static void paste(Image *sheet, const Image *part, int x, int y) {
    image_paste_shrunk(sheet, part, x, y, part->width, part->height);
}

/* Draws tile `number` of the cloths, then of the obstacles; *name: what to write under it. */
static bool draw_tile(int number, const Quality *quality, Image *sheet, int x, int y,
                      const char **name, Error *error) {
    Image tile = {0}, inset = {0};
    bool good;
    if (number < look_count) {
        const Look *look = &looks[number];
        *name = look->name;
        good =
            swatch_draw_cloth(look, quality, SWATCH_WHOLE, TILE_WIDTH, TILE_HEIGHT, &tile, error);
        if (good && is_fabric(number)) {
            good = swatch_draw_cloth(look, quality, SWATCH_CLOSE, INSET, INSET, &inset, error);
        }
    } else {
        const PropLook *look = &prop_looks[number - look_count];
        *name = look->name;
        good = swatch_draw_prop(look, quality, TILE_WIDTH, TILE_HEIGHT, &tile, error);
    }
    if (good) {
        paste(sheet, &tile, x, y);
    }
    if (good && inset.rgba) {
        paste(sheet, &inset, x + TILE_WIDTH - INSET - GAP, y + GAP);
    }
    image_free(&tile);
    image_free(&inset);
    return good;
}

static bool draw_swatches(const Options *options, Image *sheet, Error *error) {
    int count = look_count + prop_look_count, rows = (count + COLUMNS - 1) / COLUMNS;
    int width = TILE_WIDTH + GAP, height = TILE_HEIGHT + LABEL_HEIGHT + GAP;
    const char *names[MOST_TILES];
    ASSERT(count <= MOST_TILES);
    *sheet = image_create(COLUMNS * width + GAP, rows * height + GAP);
    memset(sheet->rgba, SHEET_GREY, IMAGE_CHANNELS * (size_t)sheet->width * (size_t)sheet->height);
    Progress progress =
        progress_start("looks", options->quiet ? PROGRESS_NONE : options->progress, 0, count);
    bool good = gl_open(options->threads > 1 ? options->threads : 0, error);
    for (int i = 0; good && i < count; i++) {
        good = draw_tile(i, options->quality, sheet, GAP + i % COLUMNS * width,
                         GAP + i / COLUMNS * height, &names[i], error) &&
               (!interrupt_requested() || error_set(error, EXIT_INTERRUPTED, "interrupted"));
        progress_show(&progress, i + 1, "");
    }
    progress_end(&progress);
    if (!good) {
        return false;
    }
    Sheet *labels = sheet_over(sheet);
    for (int i = 0; i < count; i++) {
        sheet_text(labels, GAP + i % COLUMNS * width + 0.5 * TILE_WIDTH,
                   GAP + i / COLUMNS * height + TILE_HEIGHT + 0.68 * LABEL_HEIGHT, LABEL_SIZE,
                   SHEET_MIDDLE, LABEL_INK, names[i]);
    }
    return sheet_close(labels, error);
}

static bool write_swatches(const Options *options, Error *error) {
    OutputDef target = {.force = options->force};
    Image sheet = {0};
    if (!output_plan(options->output, &target, error)) {
        return false;
    }
    if (target.kind != OUTPUT_PICTURE) {
        return error_set(error, EXIT_USAGE, "looks: -o %s: expected a .png", options->output);
    }
    bool good = output_may_write(&target, 0, error) && draw_swatches(options, &sheet, error) &&
                output_write_picture(&target, &sheet, error);
    image_free(&sheet);
    return good;
}

ExitCode command_looks(const Options *options, Error *error) {
    if (options->json) {
        print_looks_json();
    } else if (!options->output) {
        print_looks();
    }
    return !options->output || write_swatches(options, error) ? EXIT_OK : error->code;
}
