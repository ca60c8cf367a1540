#include "render/image.h"

#include <stdlib.h>

#include "sim/base/memory.h"

Image image_create(int width, int height) {
    return (Image){.width = width,
                   .height = height,
                   .rgba = memory_zeroed((size_t)width * (size_t)height, IMAGE_CHANNELS)};
}

void image_free(Image *image) {
    free(image->rgba);
    *image = (Image){0};
}

void image_paste_shrunk(Image *sheet, const Image *part, int x, int y, int width, int height) {
    for (int j = 0; j < height; j++) {
        int y0 = j * part->height / height, y1 = (j + 1) * part->height / height;
        y1 = y1 > y0 ? y1 : y0 + 1;
        for (int i = 0; i < width; i++) {
            int x0 = i * part->width / width, x1 = (i + 1) * part->width / width;
            x1 = x1 > x0 ? x1 : x0 + 1;
            unsigned sum[IMAGE_CHANNELS] = {0}, count = (unsigned)((x1 - x0) * (y1 - y0));
            for (int v = y0; v < y1; v++) {
                for (int u = x0; u < x1; u++) {
                    const uint8_t *p = part->rgba + IMAGE_CHANNELS * ((size_t)v * part->width + u);
                    for (int k = 0; k < IMAGE_CHANNELS; k++) {
                        sum[k] += p[k];
                    }
                }
            }
            uint8_t *out =
                sheet->rgba + IMAGE_CHANNELS * ((size_t)(y + j) * sheet->width + (x + i));
            for (int k = 0; k < IMAGE_CHANNELS; k++) {
                out[k] = (uint8_t)((sum[k] + count / 2) / count);
            }
        }
    }
}
