/* How much two pictures differ. SSIM: Wang, Bovik, Sheikh, Simoncelli 2004, on luma, with an
 * 11 x 11 Gaussian window of sigma 1.5, K1 = 0.01, K2 = 0.03, windows inside the picture. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/image.h"
#include "sim/base/memory.h"

#define WINDOW 11
#define SIGMA 1.5
#define RANGE 255.0
#define C1 (0.01 * RANGE * 0.01 * RANGE)
#define C2 (0.03 * RANGE * 0.03 * RANGE)
#define MOMENTS 5 /* a, b, a a, b b, a b */

static double luma(const uint8_t *p) { return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]; }

static void find_window(double window[WINDOW]) {
    double sum = 0.0;
    for (int i = 0; i < WINDOW; i++) {
        double d = i - WINDOW / 2;
        window[i] = exp(-0.5 * d * d / (SIGMA * SIGMA));
        sum += window[i];
    }
    for (int i = 0; i < WINDOW; i++) {
        window[i] /= sum;
    }
}

/* Moments of row y, blurred along x: out (width x MOMENTS), valid away from the ends. */
static void blur_row(const Image *a, const Image *b, int y, const double window[WINDOW],
                     double *raw, double *out) {
    int width = a->width;
    for (int x = 0; x < width; x++) {
        size_t at = IMAGE_CHANNELS * ((size_t)y * width + x);
        double p = luma(a->rgba + at), q = luma(b->rgba + at);
        double moments[MOMENTS] = {p, q, p * p, q * q, p * q};
        memcpy(raw + MOMENTS * x, moments, sizeof moments);
    }
    for (int x = WINDOW / 2; x < width - WINDOW / 2; x++) {
        for (int m = 0; m < MOMENTS; m++) {
            double sum = 0.0;
            for (int k = 0; k < WINDOW; k++) {
                sum += window[k] * raw[MOMENTS * (x + k - WINDOW / 2) + m];
            }
            out[MOMENTS * x + m] = sum;
        }
    }
}

static double ssim_of(const double m[MOMENTS]) {
    double va = m[2] - m[0] * m[0], vb = m[3] - m[1] * m[1], vab = m[4] - m[0] * m[1];
    return (2.0 * m[0] * m[1] + C1) * (2.0 * vab + C2) /
           ((m[0] * m[0] + m[1] * m[1] + C1) * (va + vb + C2));
}

static double compare_structure(const Image *a, const Image *b) {
    int width = a->width, height = a->height;
    if (width < WINDOW || height < WINDOW) {
        return 1.0;
    }
    double window[WINDOW], sum = 0.0;
    size_t row = MOMENTS * (size_t)width;
    double *raw = memory_new(sizeof *raw * row);
    double *rows = memory_zeroed(row * WINDOW, sizeof *rows); /* the last WINDOW blurred rows */
    find_window(window);
    for (int y = 0; y < height; y++) {
        blur_row(a, b, y, window, raw, rows + row * (size_t)(y % WINDOW));
        for (int x = WINDOW / 2; y >= WINDOW - 1 && x < width - WINDOW / 2; x++) {
            double moments[MOMENTS] = {0};
            for (int k = 0; k < WINDOW; k++) {
                const double *from = rows + row * (size_t)((y - k) % WINDOW) + MOMENTS * x;
                for (int m = 0; m < MOMENTS; m++) {
                    moments[m] += window[k] * from[m];
                }
            }
            sum += ssim_of(moments);
        }
    }
    free(raw);
    free(rows);
    return sum / ((double)(width - WINDOW + 1) * (height - WINDOW + 1));
}

/* ---- ffmpeg's windows: sums over 4 x 4 pixels, four of which make a window ---- */

#define BLOCK 4
#define BLOCK_C1 ((double)(int64_t)(0.01 * 0.01 * 255 * 255 * 64 + 0.5))
#define BLOCK_C2 ((double)(int64_t)(0.03 * 0.03 * 255 * 255 * 64 * 63 + 0.5))

/* Sums of a, b, a a + b b, a b over the 8 x 8 pixels at (x, y). */
static double block_ssim(const Image *a, const Image *b, int x, int y, int channel) {
    int64_t s1 = 0, s2 = 0, ss = 0, s12 = 0;
    for (int j = y; j < y + 2 * BLOCK; j++) {
        for (int i = x; i < x + 2 * BLOCK; i++) {
            size_t at = IMAGE_CHANNELS * ((size_t)j * a->width + i) + channel;
            int p = a->rgba[at], q = b->rgba[at];
            s1 += p, s2 += q, ss += p * p + q * q, s12 += p * q;
        }
    }
    double both = (double)(s1 * s2), squares = (double)(s1 * s1 + s2 * s2);
    double variance = (double)(ss * 64) - squares, covariance = (double)(s12 * 64) - both;
    return (2.0 * both + BLOCK_C1) * (2.0 * covariance + BLOCK_C2) /
           ((squares + BLOCK_C1) * (variance + BLOCK_C2));
}

double image_compare_blocks(const Image *a, const Image *b) {
    int columns = a->width / BLOCK - 1, rows = a->height / BLOCK - 1;
    if (columns < 1 || rows < 1) {
        return NAN;
    }
    double sum = 0.0;
    for (int channel = 0; channel < 3; channel++) {
        for (int j = 0; j < rows; j++) {
            for (int i = 0; i < columns; i++) {
                sum += block_ssim(a, b, BLOCK * i, BLOCK * j, channel);
            }
        }
    }
    return sum / (3.0 * columns * rows);
}

ImageDifference image_compare(const Image *a, const Image *b) {
    ASSERT(a->width == b->width && a->height == b->height);
    size_t pixels = (size_t)a->width * (size_t)a->height, over = 0;
    double signed_sum[3] = {0}, squares = 0.0;
    int largest = 0;
    for (size_t i = 0; i < pixels; i++) {
        const uint8_t *p = a->rgba + IMAGE_CHANNELS * i, *q = b->rgba + IMAGE_CHANNELS * i;
        int most = 0;
        for (int k = 0; k < 3; k++) {
            int d = q[k] - p[k];
            signed_sum[k] += d;
            squares += d * d;
            most = abs(d) > most ? abs(d) : most;
        }
        over += most > IMAGE_STEP;
        largest = most > largest ? most : largest;
    }
    double n = (double)pixels, mse = squares / (3.0 * n);
    return (ImageDifference){
        .largest = largest,
        .share = (double)over / n,
        .mean_signed = {signed_sum[0] / n, signed_sum[1] / n, signed_sum[2] / n},
        .psnr = mse > 0.0 ? 10.0 * log10(RANGE * RANGE / mse) : INFINITY,
        .ssim = largest > 0 ? compare_structure(a, b) : 1.0,
    };
}

bool image_passes(const ImageDifference *d) {
    bool level = true;
    for (int k = 0; k < 3; k++) {
        level = level && fabs(d->mean_signed[k]) <= IMAGE_GATE_MEAN;
    }
    return level && d->psnr >= IMAGE_GATE_PSNR && d->share <= IMAGE_GATE_SHARE &&
           d->ssim >= IMAGE_GATE_SSIM;
}

Image image_difference_picture(const Image *a, const Image *b) {
    ASSERT(a->width == b->width && a->height == b->height);
    const int gain = 8; /* a difference of 32 is full heat */
    Image picture = image_create(a->width, a->height);
    for (size_t i = 0; i < (size_t)a->width * (size_t)a->height; i++) {
        const uint8_t *p = a->rgba + IMAGE_CHANNELS * i, *q = b->rgba + IMAGE_CHANNELS * i;
        uint8_t *out = picture.rgba + IMAGE_CHANNELS * i;
        int grey = (int)(luma(p) * 0.5), most = 0;
        for (int k = 0; k < 3; k++) {
            int d = abs(q[k] - p[k]);
            most = d > most ? d : most;
        }
        int heat = most * gain > 255 ? 255 : most * gain;
        out[0] = (uint8_t)(grey + (255 - grey) * heat / 255);
        out[1] = (uint8_t)(grey + (heat > 128 ? (heat - 128) * (255 - grey) / 128 : 0));
        out[2] = (uint8_t)(grey * (255 - heat) / 255);
        out[3] = 255;
    }
    return picture;
}
