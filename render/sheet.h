/* sheet.h: drawing of lines, areas and text, for plots and legends; the only door to cairo.
 *
 * Coordinates are pixels from the upper left. Colours are sRGB, 0..1.
 */
#ifndef TOILE_RENDER_SHEET_H
#define TOILE_RENDER_SHEET_H

#include "render/image.h"

typedef struct Sheet Sheet;

typedef struct SheetColor {
    double red, green, blue, alpha;
} SheetColor;

typedef enum SheetAnchor { SHEET_LEFT, SHEET_MIDDLE, SHEET_RIGHT } SheetAnchor;

/* A white sheet that becomes an SVG or a PNG by the ending of the path (.svg, .png), written as
 * PATH.part until sheet_close. Errors: EXIT_USAGE, EXIT_IO. */
Sheet *sheet_create(const char *path, int width, int height, Error *error);
/* On top of a picture, which is changed by sheet_close; its alpha becomes 1. */
Sheet *sheet_over(Image *image);
/* Finishes and frees. Errors: EXIT_IO. */
bool sheet_close(Sheet *sheet, Error *error);

void sheet_line(Sheet *sheet, const double *points, int count, bool closed, double width,
                SheetColor color);
void sheet_fill(Sheet *sheet, const double *points, int count, SheetColor color);
void sheet_box(Sheet *sheet, double x, double y, double width, double height, SheetColor color);
void sheet_dot(Sheet *sheet, double x, double y, double radius, SheetColor color);
/* size: [px] of the letters; (x, y): of the base line. */
void sheet_text(Sheet *sheet, double x, double y, double size, SheetAnchor anchor, SheetColor color,
                const char *text);
double sheet_text_width(Sheet *sheet, double size, const char *text);

void sheet_print_versions(FILE *out);

#endif
