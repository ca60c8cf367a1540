/* overlay.h: what is written over a picture: legends of measuring looks. */
#ifndef TOILE_RENDER_OVERLAY_H
#define TOILE_RENDER_OVERLAY_H

#include "render/image.h"
#include "render/quantity.h"

typedef struct Overlay {
    const bool *shown;           /* (QUANTITY_COUNT) quantities whose legend is drawn */
    const QuantityRange *ranges; /* (QUANTITY_COUNT) */
} Overlay;

/* Letters are a part of the picture's height, so all sizes look alike. */
void overlay_draw(const Overlay *overlay, Image *image);

#endif
