/* colormap.h: colours for numbers, in equal steps for the eye.
 *
 * A map is a line through a few colours in CIELAB; equal steps of the number are equal lengths on
 * it, so no step stands out that is not in the data. A diverging map has its middle in the middle
 * and both halves equally long: equal distances from zero look equally strong.
 */
#ifndef TOILE_RENDER_COLORMAP_H
#define TOILE_RENDER_COLORMAP_H

#include <stdbool.h>
#include <stdint.h>

#define COLORMAP_STEPS 64 /* pieces of a filled table; between them colours are blended */

typedef struct ColorMap {
    const char *name;
    bool diverging;
    int count;                    /* of controls, odd for a diverging one */
    const uint8_t (*controls)[3]; /* sRGB, 0..255 */
} ColorMap;

extern const ColorMap colormap_sequential; /* viridis: dark blue, green, yellow */
extern const ColorMap colormap_diverging;  /* blue, grey, red */

/* The colour at t, 0..1 (clamped), as sRGB 0..1. */
void colormap_color(const ColorMap *map, double t, double rgb[3]);

/* The same in a table, sRGB 0..1, the fourth number 1. */
void colormap_fill(const ColorMap *map, float colors[COLORMAP_STEPS + 1][4]);

/* sRGB 0..1 to CIELAB (D65) and back, clipped to what sRGB holds. */
void colormap_lab(const double rgb[3], double lab[3]);
void colormap_rgb(const double lab[3], double rgb[3]);

#endif
