#include "render/overlay.h"

#include <math.h>
#include <stdio.h>

#include "render/sheet.h"

/* Lengths are parts of the picture's height. */
#define LETTERS 0.026
#define MARGIN 0.035
#define TITLE 0.042
#define SCALE_PART 0.25 /* of the width: longest scale bar */
#define BAR_LENGTH 0.42
#define BAR_THICKNESS 0.022
#define PAD 0.018 /* of the panel behind a legend */
#define TICK 0.008
#define TICKS 4 /* intervals between labels */
#define LEGEND_HEIGHT (2.0 * PAD + 2.0 * LETTERS + BAR_THICKNESS + 3.0 * TICK)

static const SheetColor PANEL = {0.08, 0.08, 0.09, 0.62};
static const SheetColor INK = {0.96, 0.96, 0.94, 1.0};

static void draw_bar(Sheet *sheet, const ColorMap *map, double x, double y, double unit) {
    int columns = (int)(BAR_LENGTH * unit);
    for (int i = 0; i < columns; i++) {
        double rgb[3];
        colormap_color(map, (i + 0.5) / columns, rgb);
        sheet_box(sheet, x + i, y, 1.0, BAR_THICKNESS * unit,
                  (SheetColor){rgb[0], rgb[1], rgb[2], 1});
    }
}

static void draw_ticks(Sheet *sheet, const Quantity *quantity, QuantityRange range, double x,
                       double y, double unit) {
    for (int i = 0; i <= TICKS; i++) {
        double part = (double)i / TICKS, at = x + part * BAR_LENGTH * unit;
        double value = (range.low + part * (range.high - range.low)) * quantity->scale;
        double tick[4] = {at, y, at, y + TICK * unit};
        char text[32];
        if (fabs(value) < 1e-9 * fabs(range.high * quantity->scale)) {
            value = 0.0; /* not -0, not 1e-17 */
        }
        snprintf(text, sizeof text, "%.4g", value);
        sheet_line(sheet, tick, 2, false, fmax(1.0, 0.0018 * unit), INK);
        sheet_text(sheet, at, y + (2.0 * TICK + LETTERS) * unit, LETTERS * unit, SHEET_MIDDLE, INK,
                   text);
    }
}

/* bottom: [px] of the panel. */
static void draw_legend(Sheet *sheet, const Quantity *quantity, QuantityRange range, double bottom,
                        double unit) {
    double side = PAD + 1.2 * LETTERS; /* labels stand out at both ends */
    double left = MARGIN * unit, top = bottom - LEGEND_HEIGHT * unit, x = left + side * unit;
    double y = top + (PAD + LETTERS + TICK) * unit;
    char title[128];
    snprintf(title, sizeof title, "%s [%s]", quantity->title, quantity->unit);
    sheet_box(sheet, left, top, (BAR_LENGTH + 2.0 * side) * unit, LEGEND_HEIGHT * unit, PANEL);
    sheet_text(sheet, x, top + (PAD + 0.8 * LETTERS) * unit, LETTERS * unit, SHEET_LEFT, INK,
               title);
    draw_bar(sheet, quantity->map, x, y, unit);
    draw_ticks(sheet, quantity, range, x, y + BAR_THICKNESS * unit, unit);
}

/* Letters with a dark seam, readable on anything. */
static void write_text(Sheet *sheet, double x, double y, double size, SheetAnchor anchor,
                       const char *text) {
    const SheetColor seam = {0.05, 0.05, 0.06, 0.55};
    double step = fmax(1.0, 0.06 * size);
    for (int i = 0; i < 9; i++) {
        sheet_text(sheet, x + step * (i % 3 - 1), y + step * (i / 3 - 1), size, anchor, seam, text);
    }
    sheet_text(sheet, x, y, size, anchor, INK, text);
}

/* The longest round length under a part of the picture's width, and its bar. */
static void draw_scale(Sheet *sheet, double pixels_per_metre, const Image *image) {
    double most = SCALE_PART * image->width / pixels_per_metre,
           power = pow(10.0, floor(log10(most)));
    double length = power * (most >= 5.0 * power ? 5.0 : most >= 2.0 * power ? 2.0 : 1.0);
    double unit = image->height, right = image->width - MARGIN * unit;
    double left = right - length * pixels_per_metre, y = (1.0 - MARGIN) * unit;
    char text[32];
    double shown = length >= 1.0 ? length : length >= 0.01 ? 100.0 * length : 1000.0 * length;
    snprintf(text, sizeof text, "%.4g %s", shown,
             length >= 1.0    ? "m"
             : length >= 0.01 ? "cm"
                              : "mm");
    sheet_box(sheet, left - 2, y - 2, right - left + 4, 0.008 * unit + 4, PANEL);
    sheet_box(sheet, left, y, right - left, 0.008 * unit, INK);
    write_text(sheet, 0.5 * (left + right), y - 0.4 * LETTERS * unit, LETTERS * unit, SHEET_MIDDLE,
               text);
}

void overlay_draw(const Overlay *overlay, Image *image) {
    double unit = image->height, bottom = (1.0 - MARGIN) * unit;
    Sheet *sheet = sheet_over(image);
    for (int kind = QUANTITY_NONE + 1; kind < QUANTITY_COUNT; kind++) {
        if (overlay->shown[kind]) {
            draw_legend(sheet, &quantities[kind], overlay->ranges[kind], bottom, unit);
            bottom -= (LEGEND_HEIGHT + 0.5 * MARGIN) * unit;
        }
    }
    if (overlay->title && overlay->title[0]) {
        write_text(sheet, MARGIN * unit, (MARGIN + TITLE) * unit, TITLE * unit, SHEET_LEFT,
                   overlay->title);
    }
    if (!isnan(overlay->time)) {
        char text[32];
        snprintf(text, sizeof text, "%.2f s", overlay->time);
        write_text(sheet, image->width - MARGIN * unit, (MARGIN + TITLE) * unit,
                   1.2 * LETTERS * unit, SHEET_RIGHT, text);
    }
    if (overlay->pixels_per_metre > 0.0) {
        draw_scale(sheet, overlay->pixels_per_metre, image);
    }
    sheet_close(sheet, NULL);
}
