/* overlay.h: what is written over a picture: a title, the time, a scale bar, legends. */
#ifndef TOILE_RENDER_OVERLAY_H
#define TOILE_RENDER_OVERLAY_H

#include "render/image.h"
#include "render/quantity.h"

typedef struct Overlay {
    const char *title;           /* "" = none */
    double time;                 /* [s]; NAN = not shown */
    double pixels_per_metre;     /* of a scale bar; 0 = none */
    const bool *shown;           /* (QUANTITY_COUNT) quantities whose legend is drawn */
    const QuantityRange *ranges; /* (QUANTITY_COUNT) */
} Overlay;

/* Letters are a part of the picture's height, so all sizes look alike. */
void overlay_draw(const Overlay *overlay, Image *image);

#endif
