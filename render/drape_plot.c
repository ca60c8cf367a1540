/* Contour and spectrum of drapes, on one sheet. */
#include <math.h>
#include <string.h>

#include "render/drape_report.h"
#include "render/sheet.h"

#define WIDTH 1100
#define HEIGHT 600
#define MIDDLE_X 300.0 /* [px] of the contour */
#define MIDDLE_Y 310.0
#define HALF 230.0 /* [px] of the specimen's radius */
#define SPECTRUM_LEFT 660.0
#define SPECTRUM_RIGHT 1060.0
#define SPECTRUM_TOP 110.0
#define SPECTRUM_BOTTOM 500.0

static const SheetColor ink = {0.13, 0.13, 0.15, 1}, pale = {0.62, 0.62, 0.66, 1};
/* told apart also by those who see no red or green [Okabe, Ito 2008] */
static const SheetColor colors[] = {{0.0, 0.447, 0.698, 1}, {0.835, 0.369, 0.0, 1},
                                    {0.0, 0.62, 0.451, 1},  {0.8, 0.475, 0.655, 1},
                                    {0.902, 0.624, 0.0, 1}, {0.337, 0.706, 0.914, 1}};
#define COLOR_COUNT ((int)(sizeof colors / sizeof *colors))

static void draw_circle(Sheet *sheet, double radius, double scale) {
    double points[2 * 180];
    for (int i = 0; i < 180; i++) {
        points[2 * i] = MIDDLE_X + scale * radius * cos(PI * i / 90.0);
        points[2 * i + 1] = MIDDLE_Y - scale * radius * sin(PI * i / 90.0);
    }
    sheet_line(sheet, points, 180, true, 1.0, pale);
}

static void draw_contour(Sheet *sheet, const Drape *drape, double scale, SheetColor color) {
    double points[2 * CONTOUR_RAYS];
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double angle = 2.0 * PI * i / CONTOUR_RAYS, r = scale * drape->contour.r[i];
        points[2 * i] = MIDDLE_X + r * cos(angle);
        points[2 * i + 1] = MIDDLE_Y - r * sin(angle);
    }
    sheet_line(sheet, points, CONTOUR_RAYS, true, 1.8, color);
    for (int i = 0; i < drape->nodes.count; i++) {
        double angle = drape->nodes.angle[i], r = scale * drape->nodes.peak[i];
        sheet_dot(sheet, MIDDLE_X + r * cos(angle), MIDDLE_Y - r * sin(angle), 4.0, color);
    }
}

static void draw_contours(Sheet *sheet, const Drape *drapes, int count) {
    double scale = HALF / drapes[0].specimen;
    char text[64];
    draw_circle(sheet, drapes[0].specimen, scale);
    if (isfinite(drapes[0].support.radius)) {
        draw_circle(sheet, drapes[0].support.radius, scale);
    }
    double axis[4] = {MIDDLE_X, MIDDLE_Y, MIDDLE_X + HALF + 20.0, MIDDLE_Y};
    sheet_line(sheet, axis, 2, false, 1.0, pale);
    sheet_text(sheet, MIDDLE_X + HALF + 24.0, MIDDLE_Y + 4.0, 12, SHEET_LEFT, pale, "warp");
    for (int i = 0; i < count; i++) {
        draw_contour(sheet, &drapes[i], scale, colors[i % COLOR_COUNT]);
    }
    /* a scale bar of a round length */
    double length = pow(10.0, floor(log10(drapes[0].specimen)));
    double bar[4] = {MIDDLE_X - HALF, HEIGHT - 30.0, MIDDLE_X - HALF + scale * length,
                     HEIGHT - 30.0};
    sheet_line(sheet, bar, 2, false, 3.0, ink);
    snprintf(text, sizeof text, "%g mm", 1e3 * length);
    sheet_text(sheet, bar[2] + 8.0, HEIGHT - 26.0, 12, SHEET_LEFT, ink, text);
}

/* A round number of millimetres, at least `most`. */
static double round_up(double most) {
    double power = pow(10.0, floor(log10(fmax(most, 1e-9))));
    double steps[4] = {1, 2, 5, 10};
    for (int i = 0; i < 4; i++) {
        if (most <= steps[i] * power) {
            return steps[i] * power;
        }
    }
    return 10.0 * power;
}

static void draw_axes(Sheet *sheet, double top) {
    char text[32];
    for (int i = 0; i <= 4; i++) {
        double y = SPECTRUM_BOTTOM - i * (SPECTRUM_BOTTOM - SPECTRUM_TOP) / 4.0;
        double line[4] = {SPECTRUM_LEFT, y, SPECTRUM_RIGHT, y};
        sheet_line(sheet, line, 2, false, i ? 0.5 : 1.2, i ? pale : ink);
        snprintf(text, sizeof text, "%g", 1e3 * top * i / 4.0);
        sheet_text(sheet, SPECTRUM_LEFT - 8.0, y + 4.0, 12, SHEET_RIGHT, ink, text);
    }
    double step = (SPECTRUM_RIGHT - SPECTRUM_LEFT) / CONTOUR_NODE_HARMONICS;
    for (int n = 1; n <= CONTOUR_NODE_HARMONICS; n++) {
        snprintf(text, sizeof text, "%d", n);
        sheet_text(sheet, SPECTRUM_LEFT + (n - 0.5) * step, SPECTRUM_BOTTOM + 18.0, 12,
                   SHEET_MIDDLE, ink, text);
    }
    sheet_text(sheet, SPECTRUM_LEFT, SPECTRUM_TOP - 16.0, 13, SHEET_LEFT, ink,
               "amplitude of the harmonics of r [mm]");
    sheet_text(sheet, 0.5 * (SPECTRUM_LEFT + SPECTRUM_RIGHT), SPECTRUM_BOTTOM + 42.0, 13,
               SHEET_MIDDLE, ink, "harmonic n");
}

static void draw_spectrum(Sheet *sheet, const Drape *drapes, int count) {
    double most = 0.0, step = (SPECTRUM_RIGHT - SPECTRUM_LEFT) / CONTOUR_NODE_HARMONICS;
    for (int i = 0; i < count; i++) {
        for (int n = 1; n <= CONTOUR_NODE_HARMONICS; n++) {
            most = fmax(most, drapes[i].harmonics.amplitude[n]);
        }
    }
    double top = round_up(most), bar = 0.8 * step / count;
    draw_axes(sheet, top);
    for (int i = 0; i < count; i++) {
        for (int n = 1; n <= CONTOUR_NODE_HARMONICS; n++) {
            double height =
                drapes[i].harmonics.amplitude[n] / top * (SPECTRUM_BOTTOM - SPECTRUM_TOP);
            sheet_box(sheet, SPECTRUM_LEFT + (n - 0.9) * step + i * bar, SPECTRUM_BOTTOM - height,
                      bar, height, colors[i % COLOR_COUNT]);
        }
    }
}

bool drape_plot(const Drape *drapes, const char *const *names, int count, const char *path,
                Error *error) {
    Sheet *sheet = sheet_create(path, WIDTH, HEIGHT, error);
    if (!sheet) {
        return false;
    }
    for (int i = 0; i < count && i < 6; i++) {
        char text[256];
        snprintf(text, sizeof text, "%.80s: DC %.1f %%, %d nodes, fold depth %.1f mm", names[i],
                 drapes[i].dc, drapes[i].nodes.count, 1e3 * drapes[i].fold_depth);
        sheet_text(sheet, i < 3 ? 30.0 : 580.0, 24.0 + 18.0 * (i % 3), 13, SHEET_LEFT,
                   colors[i % COLOR_COUNT], text);
    }
    draw_contours(sheet, drapes, count);
    draw_spectrum(sheet, drapes, count);
    return sheet_close(sheet, error);
}
