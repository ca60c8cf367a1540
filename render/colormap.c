/* Controls: viridis by S. van der Walt and N. Smith (CC0), every 28th of its 256; cool to warm by
 * Moreland 2009, Diverging color maps for scientific visualization, every 4th of its 33. */
#include "render/colormap.h"
#include "render/srgb.h"

#include <math.h>

#define MOST_CONTROLS 16

static const uint8_t viridis[][3] = {{68, 1, 84},    {72, 40, 120},  {62, 74, 137},  {49, 104, 142},
                                     {38, 130, 142}, {31, 158, 137}, {53, 183, 121}, {109, 205, 89},
                                     {180, 222, 44}, {253, 231, 37}};
static const uint8_t cool_warm[][3] = {{59, 76, 192},   {98, 130, 234},  {141, 176, 254},
                                       {184, 208, 249}, {221, 221, 221}, {245, 196, 173},
                                       {244, 154, 123}, {222, 96, 77},   {180, 4, 38}};

#define COUNT(array) ((int)(sizeof(array) / sizeof(array)[0]))
const ColorMap colormap_sequential = {"viridis", false, COUNT(viridis), viridis};
const ColorMap colormap_diverging = {"cool-warm", true, COUNT(cool_warm), cool_warm};

/* ---- CIELAB, white D65 ---- */

static const double WHITE[3] = {0.95047, 1.0, 1.08883};
#define LAB_CUT 0.008856451679 /* (6/29)^3: below it the root is a line */
#define LAB_SLOPE 7.787037037  /* (29/6)^2 / 3 */

static double encode(double light) { return fmin(fmax(srgb_code(light), 0.0), 1.0); }

void colormap_lab(const double rgb[3], double lab[3]) {
    static const double m[3][3] = {{0.4124564, 0.3575761, 0.1804375},
                                   {0.2126729, 0.7151522, 0.0721750},
                                   {0.0193339, 0.1191920, 0.9503041}};
    double light[3] = {srgb_light(rgb[0]), srgb_light(rgb[1]), srgb_light(rgb[2])}, f[3];
    for (int i = 0; i < 3; i++) {
        double x = (m[i][0] * light[0] + m[i][1] * light[1] + m[i][2] * light[2]) / WHITE[i];
        f[i] = x > LAB_CUT ? cbrt(x) : LAB_SLOPE * x + 16.0 / 116.0;
    }
    lab[0] = 116.0 * f[1] - 16.0;
    lab[1] = 500.0 * (f[0] - f[1]);
    lab[2] = 200.0 * (f[1] - f[2]);
}

void colormap_rgb(const double lab[3], double rgb[3]) {
    static const double m[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                   {-0.9692660, 1.8760108, 0.0415560},
                                   {0.0556434, -0.2040259, 1.0572252}};
    double fy = (lab[0] + 16.0) / 116.0, x[3];
    double f[3] = {fy + lab[1] / 500.0, fy, fy - lab[2] / 200.0};
    for (int i = 0; i < 3; i++) {
        double cube = f[i] * f[i] * f[i];
        x[i] = WHITE[i] * (cube > LAB_CUT ? cube : (f[i] - 16.0 / 116.0) / LAB_SLOPE);
    }
    for (int i = 0; i < 3; i++) {
        rgb[i] = encode(m[i][0] * x[0] + m[i][1] * x[1] + m[i][2] * x[2]);
    }
}

/* ---- the line through the controls ---- */

static double distance(const double a[3], const double b[3]) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

/* The point at part t of the length of the line through points first .. last. */
static void walk(double points[][3], int first, int last, double t, double lab[3]) {
    double whole = 0.0;
    for (int i = first; i < last; i++) {
        whole += distance(points[i], points[i + 1]);
    }
    double rest = t * whole;
    int i = first;
    double length = distance(points[i], points[i + 1]);
    while (i + 2 <= last && rest > length) {
        rest -= length;
        i++;
        length = distance(points[i], points[i + 1]);
    }
    double part = length > 0.0 ? fmin(rest / length, 1.0) : 0.0;
    for (int k = 0; k < 3; k++) {
        lab[k] = points[i][k] + part * (points[i + 1][k] - points[i][k]);
    }
}

void colormap_color(const ColorMap *map, double t, double rgb[3]) {
    double points[MOST_CONTROLS][3] = {{0}}, lab[3] = {0};
    int last = map->count - 1, middle = last / 2;
    for (int i = 0; i <= last; i++) {
        double color[3];
        for (int k = 0; k < 3; k++) {
            color[k] = map->controls[i][k] / 255.0;
        }
        colormap_lab(color, points[i]);
    }
    t = fmin(fmax(t, 0.0), 1.0);
    if (!map->diverging) {
        walk(points, 0, last, t, lab);
    } else if (t < 0.5) {
        walk(points, 0, middle, 2.0 * t, lab);
    } else {
        walk(points, middle, last, 2.0 * t - 1.0, lab);
    }
    colormap_rgb(lab, rgb);
}

void colormap_fill(const ColorMap *map, float colors[COLORMAP_STEPS + 1][4]) {
    for (int i = 0; i <= COLORMAP_STEPS; i++) {
        double rgb[3];
        colormap_color(map, (double)i / COLORMAP_STEPS, rgb);
        for (int k = 0; k < 3; k++) {
            colors[i][k] = (float)rgb[k];
        }
        colors[i][3] = 1.0f;
    }
}
