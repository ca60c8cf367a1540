#include "tests/support/photos.h"

#include <math.h>
#include <stdlib.h>

#include "sim/base/error.h"
#include "sim/base/vec.h"

#define SAMPLES 3 /* along the side of a pixel */
#define RAYS 4096

PhotoDef photo_default(void) {
    return (PhotoDef){.width = 560,
                      .height = 560,
                      .scale = 1600,
                      .x = 280,
                      .y = 280,
                      .camera_height = INFINITY,
                      .cloth = {0.10, 0.22, 0.35},
                      .ground = {0.55, 0.52, 0.47},
                      .plate = {0.45, 0.20, 0.08},
                      .plated = true,
                      .relief = 0.2,
                      .seed = 1};
}

double photo_outline(const DrapeShape *shape, const PhotoDef *def, double theta) {
    double own = def->mirrored ? def->turn - theta : theta - def->turn;
    double out = drape_shape_radius(shape, own) - shape->support;
    double free = shape->specimen - shape->support;
    double down = sqrt(fmax(free * free - out * out, 0.0)), best = 0.0;
    for (int i = 0; i <= 64; i++) { /* along the line from the table to the rim */
        double part = i / 64.0, height = def->camera_height;
        double shrink = isinf(height) ? 1.0 : height / (height + part * down);
        best = fmax(best, shrink * (shape->support + part * out));
    }
    return best;
}

static double random_unit(unsigned *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (*seed >> 8) / 16777216.0;
}

static double random_normal(unsigned *seed) {
    double u = random_unit(seed) + 1e-12, v = random_unit(seed);
    return sqrt(-2.0 * log(u)) * cos(2.0 * PI * v);
}

static double pattern_at(PhotoGround pattern, double x, double y) {
    switch (pattern) {
    case GROUND_STRIPES:
        return sin(0.5 * (x + 0.4 * y)) > 0.0 ? 1.06 : 0.94;
    case GROUND_WOVEN:
        return 1.0 + 0.05 * sin(1.1 * x) * sin(1.1 * y);
    default:
        return 1.0;
    }
}

/* One sample in linear light. */
static void shade(const PhotoDef *def, const double *outline, double radius, double px, double py,
                  double out[3]) {
    double x = (px - def->x) / def->scale, y = (def->y - py) / def->scale;
    double r = hypot(x, y), theta = atan2(y, x);
    int ray = (int)((theta < 0.0 ? theta + 2.0 * PI : theta) / (2.0 * PI) * RAYS) % RAYS;
    double off = hypot(x - 0.6 * outline[0], y + 0.5 * outline[0]) / outline[0];
    for (int k = 0; k < 3; k++) {
        if (def->plated && r < radius) {
            out[k] = def->plate[k];
        } else if (r < outline[ray]) {
            double fold = 0.6 * cos(5.0 * theta) + 0.4 * cos(9.0 * theta + 1.0);
            out[k] = def->cloth[k] * (1.0 + def->relief * fold);
        } else {
            out[k] = def->ground[k] * pattern_at(def->pattern, px, py) *
                     (1.0 - def->shadow * 0.5 * (1.0 - tanh(12.0 * (off - 0.95))));
        }
        double u = px / def->width - 0.5, v = py / def->height - 0.5;
        out[k] *= (1.0 + def->gradient * u) * (1.0 - 2.0 * def->vignette * (u * u + v * v));
    }
}

/* Gaussian of three boxes would do; the taps are few, so the real one. */
static void blur(float *plane, int width, int height, double sigma) {
    int radius = (int)ceil(3.0 * sigma);
    size_t count = (size_t)width * (size_t)height;
    float *copy = malloc(sizeof *copy * count);
    ASSERT(copy);
    for (int axis = 0; axis < 2; axis++) {
        for (size_t i = 0; i < count; i++) {
            copy[i] = plane[i];
        }
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                double sum = 0.0, total = 0.0;
                for (int d = -radius; d <= radius; d++) {
                    int i = axis ? x : x + d, j = axis ? y + d : y;
                    i = i < 0 ? 0 : i >= width ? width - 1 : i;
                    j = j < 0 ? 0 : j >= height ? height - 1 : j;
                    double tap = exp(-0.5 * d * d / (sigma * sigma));
                    sum += tap * copy[(size_t)j * (size_t)width + (size_t)i];
                    total += tap;
                }
                plane[(size_t)y * (size_t)width + (size_t)x] = (float)(sum / total);
            }
        }
    }
    free(copy);
}

static uint8_t encode(double linear, double noise) {
    double x = fmax(0.0, fmin(1.0, linear));
    double s = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
    double value = 255.0 * s + noise + 0.5;
    return (uint8_t)fmax(0.0, fmin(255.0, value));
}

Image photo_paint(const DrapeShape *shape, const PhotoDef *def) {
    static double outline[RAYS];
    Image image = image_create(def->width, def->height);
    size_t count = (size_t)def->width * (size_t)def->height;
    float *planes = calloc(3 * count, sizeof *planes);
    ASSERT(planes);
    for (int i = 0; i < RAYS; i++) {
        outline[i] = photo_outline(shape, def, 2.0 * PI * (i + 0.5) / RAYS);
    }
    for (size_t i = 0; i < count; i++) {
        for (int s = 0; s < SAMPLES * SAMPLES; s++) {
            double x = (double)(i % (size_t)def->width) + (s % SAMPLES + 0.5) / SAMPLES, sample[3];
            double y = (double)(i / (size_t)def->width) + (s / SAMPLES + 0.5) / SAMPLES;
            shade(def, outline, shape->support, x, y, sample);
            for (size_t k = 0; k < 3; k++) {
                planes[k * count + i] += (float)(sample[k] / (SAMPLES * SAMPLES));
            }
        }
    }
    unsigned seed = def->seed;
    for (size_t k = 0; k < 3; k++) {
        if (def->blur > 0.0) {
            blur(planes + k * count, def->width, def->height, def->blur);
        }
        for (size_t i = 0; i < count; i++) {
            double noise = def->noise > 0.0 ? def->noise * random_normal(&seed) : 0.0;
            image.rgba[IMAGE_CHANNELS * i + k] = encode(planes[k * count + i], noise);
        }
    }
    for (size_t i = 0; i < count; i++) {
        image.rgba[IMAGE_CHANNELS * i + 3] = 255;
    }
    free(planes);
    return image;
}
