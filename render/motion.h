/* motion.h: how far what a pixel shows has moved since the frame before, for compositing.
 *
 * Cloth, and meshes that move by themselves: their triangles are drawn once more, here, with a depth
 * buffer; a pixel takes the place of its sample on the surface of the frame before. Other obstacles: by
 * their pose. What stands for the world (backdrop, floor) has no motion, nor has anything in the first
 * frame of a layout.
 */
#ifndef TOILE_RENDER_MOTION_H
#define TOILE_RENDER_MOTION_H

#include "render/camera.h"
#include "render/image_exr.h"
#include "render/resample.h"
#include "sim/state/state.h"

typedef struct MotionDef {
    const Camera *camera, *camera_before;
    const Surface *surface;       /* parts and triangles */
    const float *places, *before; /* [m] (vertex_count x 3) now and in the frame before */
    const StateHeader *header;    /* its obstacles */
    const StateFrame *now, *then; /* their poses and vertices, now and in the frame before */
    /* [px] of what the picture's ids and depths show, from a pixel's upper left */
    double sample[2];
} MotionDef;

/* Fills picture->motion by its ids and depths. */
void motion_fill(const MotionDef *def, ExrPicture *picture);

#endif
