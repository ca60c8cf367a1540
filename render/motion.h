/* motion.h: how far what a pixel shows has moved since the frame before, for compositing.
 *
 * Cloth: its triangles are drawn once more, here, with a depth buffer; a pixel takes the place of its
 * sample on the surface of the frame before. Obstacles: by their pose. What stands for the world (backdrop, floor) has no
 * motion, nor has anything in the first frame of a layout.
 */
#ifndef TOILE_RENDER_MOTION_H
#define TOILE_RENDER_MOTION_H

#include "render/camera.h"
#include "render/image_exr.h"
#include "render/resample.h"

typedef struct MotionDef {
    const Camera *camera, *camera_before;
    const Surface *surface;         /* parts and triangles */
    const float *places, *before;   /* [m] (vertex_count x 3) now and in the frame before */
    const Pose *pose, *pose_before; /* (pose_count) of the obstacles */
    int pose_count;
    double
        sample[2]; /* [px] of what the picture's ids and depths show, from a pixel's upper left */
} MotionDef;

/* Fills picture->motion by its ids and depths. */
void motion_fill(const MotionDef *def, ExrPicture *picture);

#endif
