/* image.h: pictures in memory. */
#ifndef TOILE_RENDER_IMAGE_H
#define TOILE_RENDER_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/base/error.h"

#define IMAGE_CHANNELS 4

/* 8-bit sRGB, rows from the top down, red green blue alpha, without padding. */
typedef struct Image {
    int width, height;
    uint8_t *rgba; /* (height x width x IMAGE_CHANNELS), owned */
    bool clear;    /* alpha counts: PNG files keep it */
} Image;

Image image_create(int width, int height); /* black and transparent */
void image_free(Image *image);             /* leaves a zeroed image */

/* One tEXt entry of a PNG file. */
typedef struct ImageText {
    const char *key, *value;
} ImageText;

/* Writes a PNG, with alpha if the picture is clear: filter SUB, fastest compression, an sRGB chunk, no time stamp, so
 * that the same picture gives the same bytes. texts may be NULL. Errors: EXIT_IO. */
bool image_write_png(const char *path, const Image *image, const ImageText *texts, int text_count,
                     Error *error);

/* The same into an open stream; false when writing failed. */
bool image_put_png(FILE *out, const Image *image, const ImageText *texts, int text_count);

/* Reads any PNG as 8-bit RGBA. Errors: EXIT_MISSING_INPUT, EXIT_BAD_INPUT. */
bool image_read_png(const char *path, Image *image, Error *error);

/* The value of a tEXt entry of a PNG file into text (size bytes); false if there is none, or no
 * such file, or it is no PNG. */
bool image_read_png_text(const char *path, const char *key, char *text, int size);

/* The largest difference of two 16-bit PNG files in any channel, 0..1. False: one is none, or sizes
 * differ. */
bool image_compare_png16(const char *a, const char *b, double *largest);

void image_print_versions(FILE *out); /* of libpng, one line */

/* ---- differences (of golden pictures) ---- */

typedef struct ImageDifference {
    double largest;        /* of 255, any channel */
    double share;          /* of pixels with a channel that differs by more than IMAGE_STEP */
    double mean_signed[3]; /* of 255, b - a */
    double psnr;           /* [dB] of red, green, blue; INFINITY if equal */
    double ssim;           /* of luma, 11 x 11 Gaussian, sigma 1.5 */
} ImageDifference;

/* SSIM as ffmpeg's filter has it: 8 x 8 windows, 4 pixels apart, mean over red, green, blue. NAN under
 * 8 pixels. */
double image_compare_blocks(const Image *a, const Image *b);

/* FLIP [Andersson et al. 2020], mean over all pixels, 0..1: what an eye sees when the pictures are
 * flipped, from IMAGE_FLIP_DENSITY pixels a degree. map: (height x width) of each pixel, or NULL. */
#define IMAGE_FLIP_DENSITY 67.020643 /* [px/deg] 3840 pixels on 0.7 m, seen from 0.7 m */
double image_compare_flip(const Image *a, const Image *b, float *map);

#define IMAGE_STEP 3

/* The gate of stored pictures: what another processor's rasteriser may move. */
#define IMAGE_GATE_PSNR 50.0   /* [dB] */
#define IMAGE_GATE_SHARE 0.002 /* of all pixels */
#define IMAGE_GATE_MEAN 0.5    /* of 255 */
#define IMAGE_GATE_SSIM 0.999

/* Compares red, green, blue. Sizes must be equal. */
ImageDifference image_compare(const Image *a, const Image *b);
bool image_passes(const ImageDifference *difference);

/* Grey a with the difference to b as heat on it. */
Image image_difference_picture(const Image *a, const Image *b);

/* Copies `part`, shrunk by averaging over whole pixels of area, into `sheet` at (x, y) with this
 * width and height. */
void image_paste_shrunk(Image *sheet, const Image *part, int x, int y, int width, int height);

#endif
