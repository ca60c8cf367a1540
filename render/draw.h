/* draw.h: from a run to pictures: camera, looks, resampling and painting of its frames. */
#ifndef TOILE_RENDER_DRAW_H
#define TOILE_RENDER_DRAW_H

#include "render/paint.h"
#include "render/run.h"

typedef struct DrawDef {
    int width, height; /* [px] even; 0 = the film's */
    const Quality *quality;
    bool linear, clear;   /* light instead of display code (draw_exr); no backdrop */
    bool splats;          /* draw surfels, whatever the film says */
    const char *backdrop; /* a picture, or #rrggbb, in place of the studio; NULL */
    /* (print_count) [CLOTH=]FILE[@WIDTH]: pictures on the faces of cloths */
    const char *const *prints;
    int print_count;
    int triangles;    /* of the smooth surface, about; 0: as the picture needs */
    const char *look; /* of all cloths instead of their own; NULL = their own */
    const Film *film; /* instead of the run's, copied; NULL */
    int threads;      /* raster threads of the driver besides this one; 0 */
    /* of measuring looks, in the units of their legend; low = high: automatic */
    QuantityRange range;
} DrawDef;

typedef struct Drawer Drawer;

/* Prepares to draw a run whose first frame is there. An automatic camera, floor or range looks at all
 * frames that the run has now, so the caller waits for its end first (draw_needs_end).
 * Errors: EXIT_BAD_INPUT (unknown looks); EXIT_USAGE (a range for two quantities). */
Drawer *draw_create(Run *run, const DrawDef *def, Error *error);
void draw_destroy(Drawer *drawer);

/* True if the pictures depend on frames that are still to come. Needs the first frame. */
bool draw_needs_end(Run *run, const DrawDef *def, Error *error);

const Film *draw_film(const Drawer *drawer); /* as it is drawn */
int draw_width(const Drawer *drawer);
int draw_height(const Drawer *drawer);
int draw_triangles(const Drawer *drawer); /* of the surface drawn last */

/* Changes whenever the picture of frame `index` would: states, film, looks, quality, shaders. */
bool draw_frame_key(Drawer *drawer, int index, uint64_t *key, Error *error);

/* Draws frame `index`. The image belongs to the drawer and is valid until the next call; a frame that
 * shows the same as the last one is not drawn again. NULL: error, EXIT_MISSING_INPUT (no GL driver) or as
 * state_read_frame. */
const Image *draw_frame(Drawer *drawer, int index, Error *error);

/* The same for compositing, by a drawer that is linear: into picture, of the film's size. */
bool draw_exr(Drawer *drawer, int index, ExrPicture *picture, Error *error);

/* Adds the CPU time [s] of reading and resampling, and of each stage of painting. */
typedef struct DrawTimes {
    double read, resample, paint[PAINT_STAGE_COUNT];
    int frames;
} DrawTimes;
void draw_measure(Drawer *drawer, DrawTimes *times);
int draw_count(const Drawer *drawer); /* frames that really were drawn */

#endif
