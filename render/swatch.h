/* swatch.h: what a look looks like: a hanging piece of cloth with one corner turned over, or a ball.
 * Closed forms, no simulation.
 */
#ifndef TOILE_RENDER_SWATCH_H
#define TOILE_RENDER_SWATCH_H

#include "render/paint.h"

typedef enum SwatchView {
    SWATCH_WHOLE, /* all of it */
    SWATCH_CLOSE  /* the threads: CLOSE_WIDTH of cloth */
} SwatchView;

/* Pictures of width x height, both even; the caller frees them. Need an open GL context.
 * Errors: as paint_create. */
bool swatch_draw_cloth(const Look *look, const Quality *quality, SwatchView view, int width,
                       int height, Image *image, Error *error);
bool swatch_draw_prop(const PropLook *look, const Quality *quality, int width, int height,
                      Image *image, Error *error);

#endif
