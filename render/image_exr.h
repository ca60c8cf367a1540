/* image_exr.h: pictures for compositing: linear light and what is seen in each pixel; the only door to
 * OpenEXR.
 *
 * Channels: R G B A (half, linear Rec.709, premultiplied), Z [m] along the view (1e30: nothing),
 * N.X N.Y N.Z (right, up, towards the viewer), motion.x motion.y ([px] since the frame before, to the
 * right and down), uv.u uv.v (place on the panel, 0..1), id (1.. cloths, then obstacles in the order of
 * the scene; 0: nothing). All but the colours are of one sample a pixel.
 */
#ifndef TOILE_RENDER_IMAGE_EXR_H
#define TOILE_RENDER_IMAGE_EXR_H

#include "render/image.h"

#define EXR_NOTHING 1e30f /* depth where nothing is */

typedef struct ExrPicture {
    int width, height; /* [px] rows from the top down */
    float *rgba;       /* (height x width x 4) */
    float *depth;      /* (height x width) */
    float *normal;     /* (height x width x 3) */
    float *motion;     /* (height x width x 2) [px] */
    float *uv;         /* (height x width x 2) */
    uint32_t *id;      /* (height x width) */
} ExrPicture;

ExrPicture exr_create(int width, int height);
void exr_free(ExrPicture *picture);

/* Writes with ZIP compression; texts become string attributes. Errors: EXIT_IO. */
bool exr_write(const char *path, const ExrPicture *picture, const ImageText *texts, int text_count,
               Error *error);

/* The value of a string attribute into text (size bytes); false if there is none or it is no EXR. */
bool exr_read_text(const char *path, const char *key, char *text, int size);

/* The largest difference of two files in any channel, in the numbers that stand there; INFINITY when
 * their channels or sizes differ or a number is finite in one alone. False: one is no EXR of whole lines. */
bool exr_compare(const char *a, const char *b, double *largest);

void exr_print_versions(FILE *out); /* of OpenEXR, one line */

#endif
