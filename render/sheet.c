#include "render/sheet.h"

#include <cairo/cairo-svg.h>
#include <cairo/cairo.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/file.h"
#include "sim/base/memory.h"

struct Sheet {
    cairo_surface_t *surface;
    cairo_t *cairo;
    Image *image; /* that it lies on, or NULL */
    bool svg;
    char path[FILE_PATH_SIZE], part[FILE_PART_SIZE];
};

static Sheet *start(cairo_surface_t *surface) {
    Sheet *sheet = memory_zeroed(1, sizeof *sheet);
    sheet->surface = surface;
    sheet->cairo = cairo_create(surface);
    cairo_select_font_face(sheet->cairo, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_line_join(sheet->cairo, CAIRO_LINE_JOIN_ROUND);
    return sheet;
}

Sheet *sheet_create(const char *path, int width, int height, Error *error) {
    const char *ending = file_ending(path);
    bool svg = strcmp(ending, "svg") == 0;
    char part[FILE_PART_SIZE];
    if ((!svg && strcmp(ending, "png") != 0) || strlen(path) >= FILE_PATH_SIZE) {
        error_set(error, EXIT_USAGE, "%s: expected an ending .svg or .png", path);
        return NULL;
    }
    snprintf(part, sizeof part, "%s.part", path);
    cairo_surface_t *surface = svg ? cairo_svg_surface_create(part, width, height)
                                   : cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
    if (cairo_surface_status(surface) != CAIRO_STATUS_SUCCESS) {
        cairo_surface_destroy(surface);
        error_set_errno(error, EXIT_IO, "%s", path);
        return NULL;
    }
    Sheet *sheet = start(surface);
    sheet->svg = svg;
    snprintf(sheet->path, sizeof sheet->path, "%s", path);
    snprintf(sheet->part, sizeof sheet->part, "%s", part);
    sheet_box(sheet, 0, 0, width, height, (SheetColor){1, 1, 1, 1});
    return sheet;
}

Sheet *sheet_over(Image *image) {
    cairo_surface_t *surface =
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, image->width, image->height);
    unsigned char *data = cairo_image_surface_get_data(surface);
    ASSERT(data);
    int stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < image->height; y++) {
        uint32_t *row = (uint32_t *)(void *)(data + (size_t)y * (size_t)stride);
        const uint8_t *p = image->rgba + IMAGE_CHANNELS * (size_t)y * (size_t)image->width;
        for (int x = 0; x < image->width; x++, p += IMAGE_CHANNELS) {
            row[x] = (uint32_t)p[0] << 16 | (uint32_t)p[1] << 8 | p[2];
        }
    }
    cairo_surface_mark_dirty(surface);
    Sheet *sheet = start(surface);
    sheet->image = image;
    return sheet;
}

static void take_back(Sheet *sheet) {
    cairo_surface_flush(sheet->surface);
    const unsigned char *data = cairo_image_surface_get_data(sheet->surface);
    int stride = cairo_image_surface_get_stride(sheet->surface);
    for (int y = 0; y < sheet->image->height; y++) {
        const uint32_t *row = (const uint32_t *)(const void *)(data + (size_t)y * (size_t)stride);
        uint8_t *p = sheet->image->rgba + IMAGE_CHANNELS * (size_t)y * (size_t)sheet->image->width;
        for (int x = 0; x < sheet->image->width; x++, p += IMAGE_CHANNELS) {
            p[0] = (uint8_t)(row[x] >> 16);
            p[1] = (uint8_t)(row[x] >> 8);
            p[2] = (uint8_t)row[x];
            p[3] = 255;
        }
    }
}

bool sheet_close(Sheet *sheet, Error *error) {
    bool good = true;
    if (sheet->image) {
        take_back(sheet);
    } else {
        cairo_status_t status = cairo_status(sheet->cairo);
        if (!sheet->svg && status == CAIRO_STATUS_SUCCESS) {
            status = cairo_surface_write_to_png(sheet->surface, sheet->part);
        }
        cairo_surface_finish(sheet->surface);
        status = status ? status : cairo_surface_status(sheet->surface);
        good = status == CAIRO_STATUS_SUCCESS ? file_commit(sheet->part, sheet->path, error)
                                              : error_set(error, EXIT_IO, "%s: %s", sheet->path,
                                                          cairo_status_to_string(status));
        if (!good) {
            unlink(sheet->part);
        }
    }
    cairo_destroy(sheet->cairo);
    cairo_surface_destroy(sheet->surface);
    free(sheet);
    return good;
}

static void set_color(Sheet *sheet, SheetColor color) {
    cairo_set_source_rgba(sheet->cairo, color.red, color.green, color.blue, color.alpha);
}

static void trace(Sheet *sheet, const double *points, int count, bool closed) {
    cairo_new_path(sheet->cairo);
    for (int i = 0; i < count; i++) {
        cairo_line_to(sheet->cairo, points[2 * i], points[2 * i + 1]);
    }
    if (closed) {
        cairo_close_path(sheet->cairo);
    }
}

void sheet_line(Sheet *sheet, const double *points, int count, bool closed, double width,
                SheetColor color) {
    trace(sheet, points, count, closed);
    set_color(sheet, color);
    cairo_set_line_width(sheet->cairo, width);
    cairo_stroke(sheet->cairo);
}

void sheet_fill(Sheet *sheet, const double *points, int count, SheetColor color) {
    trace(sheet, points, count, true);
    set_color(sheet, color);
    cairo_fill(sheet->cairo);
}

void sheet_box(Sheet *sheet, double x, double y, double width, double height, SheetColor color) {
    cairo_rectangle(sheet->cairo, x, y, width, height);
    set_color(sheet, color);
    cairo_fill(sheet->cairo);
}

void sheet_dot(Sheet *sheet, double x, double y, double radius, SheetColor color) {
    cairo_new_path(sheet->cairo);
    cairo_arc(sheet->cairo, x, y, radius, 0.0, 6.283185307179586);
    set_color(sheet, color);
    cairo_fill(sheet->cairo);
}

double sheet_text_width(Sheet *sheet, double size, const char *text) {
    cairo_text_extents_t extents;
    cairo_set_font_size(sheet->cairo, size);
    cairo_text_extents(sheet->cairo, text, &extents);
    return extents.x_advance;
}

void sheet_text(Sheet *sheet, double x, double y, double size, SheetAnchor anchor, SheetColor color,
                const char *text) {
    double width = sheet_text_width(sheet, size, text);
    set_color(sheet, color);
    cairo_move_to(sheet->cairo,
                  anchor == SHEET_LEFT    ? x
                  : anchor == SHEET_RIGHT ? x - width
                                          : x - 0.5 * width,
                  y);
    cairo_show_text(sheet->cairo, text);
}

void sheet_print_versions(FILE *out) { fprintf(out, "cairo %s\n", cairo_version_string()); }
