/* Where the cloth is in a photograph from the side, and how much of each pixel it covers. */
#include <stdlib.h>
#include <string.h>

#include "render/side_view.h"
#include "sim/base/memory.h"

#define AROUND 4     /* [px] of the outline: where cloth and background are looked at */
#define BLEND 2      /* [px] beside the outline where a pixel may be both */
#define MARGIN 0.025 /* of the diagonal: what lies nearer to an outline may be either */
#define ROUNDS 3     /* of learning the colours from what was cut out */
#define HUES 28      /* bins of log(red / green) and of log(blue / green) */
#define LIGHTS 10    /* bins of the logarithm of the light */
#define BINS (HUES * HUES * LIGHTS)
#define HUE_REACH 1.4  /* largest absolute logarithm of a ratio that is told apart */
#define DARKEST (-6.0) /* logarithm of the light */
#define FLOOR_LIGHT 0.004f
#define QUIET 1       /* [px] the same over which light is averaged */
#define SMOOTH 2      /* [px] half the side of the square over which evidence is averaged */
#define DOUBT 0.69315 /* log 2: twice as likely the one or the other */

/* ---- colours of cloth and background ---- */

static int clamp_bin(double part, int bins) {
    int bin = (int)(part * bins);
    return bin < 0 ? 0 : bin >= bins ? bins - 1 : bin;
}

static int bin_of(const float light[3]) {
    double r = log((double)(light[0] + FLOOR_LIGHT)), g = log((double)(light[1] + FLOOR_LIGHT));
    double b = log((double)(light[2] + FLOOR_LIGHT));
    int red = clamp_bin(0.5 + 0.5 * (r - g) / HUE_REACH, HUES);
    int blue = clamp_bin(0.5 + 0.5 * (b - g) / HUE_REACH, HUES);
    return (red * HUES + blue) * LIGHTS + clamp_bin(1.0 - (r + g + b) / (3.0 * DARKEST), LIGHTS);
}

/* Each bin gives half of what it has to its neighbours along an axis, which are `step` apart. */
static void spread(float *histogram, int step, int bins) {
    float *copy = memory_zeroed(BINS, sizeof *copy);
    memcpy(copy, histogram, BINS * sizeof *copy);
    for (int i = 0; i < BINS; i++) {
        int place = i / step % bins;
        float less = copy[place > 0 ? i - step : i], more = copy[place + 1 < bins ? i + step : i];
        histogram[i] = 0.5f * copy[i] + 0.25f * (less + more);
    }
    free(copy);
}

/* Logarithm of how much likelier each colour is in the cloth (1) than in the background (2 in seeds). */
static void learn(const int *bins, const uint8_t *seeds, size_t count, float *evidence) {
    float *histogram[2] = {memory_zeroed(BINS, sizeof(float)), memory_zeroed(BINS, sizeof(float))};
    double total[2] = {1.0, 1.0};
    for (size_t i = 0; i < count; i++) {
        if (seeds[i]) {
            histogram[seeds[i] - 1][bins[i]] += 1.0f;
            total[seeds[i] - 1] += 1.0;
        }
    }
    for (int k = 0; k < 2; k++) {
        spread(histogram[k], 1, LIGHTS);
        spread(histogram[k], LIGHTS, HUES);
        spread(histogram[k], LIGHTS * HUES, HUES);
    }
    for (int i = 0; i < BINS; i++) {
        evidence[i] = (float)log(((double)histogram[0][i] / total[0] + 1e-6) /
                                 ((double)histogram[1][i] / total[1] + 1e-6));
    }
    free(histogram[0]);
    free(histogram[1]);
}

/* Sums along rows and columns: mean of a square of side 2 radius + 1, cut at the border. */
static void average(float *values, int width, int height, int radius) {
    size_t most = (size_t)(width > height ? width : height);
    double *sums = memory_zeroed(most + 1, sizeof *sums);
    for (int axis = 0; axis < 2; axis++) {
        int lines = axis ? width : height, length = axis ? height : width;
        size_t step = axis ? (size_t)width : 1, next = axis ? 1 : (size_t)width;
        for (int line = 0; line < lines; line++) {
            float *at = values + next * (size_t)line;
            for (int i = 0; i < length; i++) {
                sums[i + 1] = sums[i] + (double)at[step * (size_t)i];
            }
            for (int i = 0; i < length; i++) {
                int low = i - radius < 0 ? 0 : i - radius;
                int high = i + radius + 1 > length ? length : i + radius + 1;
                at[step * (size_t)i] = (float)((sums[high] - sums[low]) / (high - low));
            }
        }
    }
    free(sums);
}

/* The bin of each pixel, whose noise its neighbours take away. */
static int *find_bins(const Image *image) {
    size_t count = (size_t)image->width * (size_t)image->height;
    int *bins = memory_zeroed(count, sizeof *bins);
    float *plane[3];
    for (size_t k = 0; k < 3; k++) {
        plane[k] = memory_zeroed(count, sizeof *plane[k]);
        for (size_t i = 0; i < count; i++) {
            plane[k][i] = segment_linear(image->rgba[IMAGE_CHANNELS * i + k]);
        }
        average(plane[k], image->width, image->height, QUIET);
    }
    for (size_t i = 0; i < count; i++) {
        const float light[3] = {plane[0][i], plane[1][i], plane[2][i]};
        bins[i] = bin_of(light);
    }
    for (int k = 0; k < 3; k++) {
        free(plane[k]);
    }
    return bins;
}

/* 1 well inside of what is covered, 2 well outside, 0 along its outline. */
static void plant(const float *cover, int width, int height, uint8_t *seeds) {
    size_t count = (size_t)width * (size_t)height;
    float *near = memory_zeroed(count, sizeof *near);
    memcpy(near, cover, count * sizeof *near);
    average(near, width, height, (int)(MARGIN * hypot(width, height)));
    for (size_t i = 0; i < count; i++) {
        seeds[i] = near[i] > 0.999f ? 1 : near[i] < 0.001f ? 2 : 0;
    }
    free(near);
}

/* Cuts where the evidence exceeds a limit; the piece around the seed, without holes. */
static bool cut_at(const Image *image, const float *evidence, double limit, const SegmentDef *def,
                   Segment *segment, Error *error) {
    Image mask = image_create(image->width, image->height);
    size_t count = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < count; i++) {
        memset(mask.rgba + IMAGE_CHANNELS * i, (double)evidence[i] > limit ? 255 : 0,
               IMAGE_CHANNELS);
    }
    SegmentDef cut = {.mask = &mask, .threshold = NAN, .x = def->x, .y = def->y};
    bool good = segment_photo(image, &cut, segment, error);
    image_free(&mask);
    return good;
}

static double find_change(const Image *image, const float *evidence, const SegmentDef *def,
                          double area) {
    double change = 0.0;
    for (int side = -1; side <= 1; side += 2) {
        Segment other;
        if (!cut_at(image, evidence, side * DOUBT, def, &other, NULL)) {
            return 1.0;
        }
        change = fmax(change, fabs(other.area / area - 1.0));
        segment_free(&other);
    }
    return change;
}

bool side_cut_photo(const Image *image, const float *guess, const SegmentDef *def, Segment *segment,
                    Error *error) {
    size_t count = (size_t)image->width * (size_t)image->height;
    int *bins = find_bins(image);
    uint8_t *seeds = memory_zeroed(count, 1);
    float *table = memory_zeroed(BINS, sizeof *table),
          *evidence = memory_zeroed(count, sizeof *evidence);
    float *cover = memory_zeroed(count, sizeof *cover);
    bool good = true;
    *segment = (Segment){0};
    memcpy(cover, guess, count * sizeof *cover);
    for (int round = 0; round < ROUNDS && good; round++) {
        segment_free(segment);
        plant(cover, image->width, image->height, seeds);
        learn(bins, seeds, count, table);
        for (size_t i = 0; i < count; i++) {
            evidence[i] = table[bins[i]];
        }
        average(evidence, image->width, image->height, SMOOTH);
        good = cut_at(image, evidence, 0.0, def, segment, error);
        for (size_t i = 0; i < count && good; i++) {
            cover[i] = segment->inside[i];
        }
    }
    if (good) {
        segment->feature = "colours";
        segment->threshold = 0.0;
        segment->change = find_change(image, evidence, def, segment->area);
        good =
            segment->change <= SEGMENT_UNSURE ||
            error_set(
                error, EXIT_BAD_INPUT,
                "the photograph cannot be measured: the cloth does not stand out, its area "
                "changes by %.0f %% between twice as likely and half; --mask FILE says where it is",
                100.0 * segment->change);
    }
    free(bins);
    free(seeds);
    free(table);
    free(evidence);
    free(cover);
    return good;
}

/* ---- pixels along the outline ---- */

/* Mean light of what lies inside (1) or outside (0) around a pixel, a little off the outline. False: nothing does. */
static bool find_light(const Image *image, const Segment *segment, const uint8_t *far, int x, int y,
                       int inside, double light[3]) {
    double sum[3] = {0, 0, 0};
    int count = 0;
    for (int j = y - AROUND; j <= y + AROUND; j++) {
        for (int i = x - AROUND; i <= x + AROUND; i++) {
            size_t at = (size_t)j * (size_t)image->width + (size_t)i;
            if (i < 0 || j < 0 || i >= image->width || j >= image->height ||
                segment->inside[at] != inside || !far[at]) {
                continue;
            }
            for (int k = 0; k < 3; k++) {
                sum[k] += (double)segment_linear(image->rgba[IMAGE_CHANNELS * at + (size_t)k]);
            }
            count++;
        }
    }
    for (int k = 0; k < 3; k++) {
        light[k] = sum[k] / (count > 0 ? count : 1);
    }
    return count > 0;
}

/* Pixels whose neighbours within BLEND all lie on the same side. */
static uint8_t *find_far(const Segment *segment) {
    int w = segment->width, h = segment->height;
    uint8_t *far = memory_zeroed((size_t)w * (size_t)h, 1);
    memset(far, 1, (size_t)w * (size_t)h);
    for (int y = 0; y < h; y++) {
        for (int x = 0; x < w; x++) {
            size_t at = (size_t)y * (size_t)w + (size_t)x;
            for (int k = 0; k < 2 * BLEND * 2; k++) {
                int d = k / 4 + 1, i = x + (k % 4 == 0 ? d : k % 4 == 1 ? -d : 0);
                int j = y + (k % 4 == 2 ? d : k % 4 == 3 ? -d : 0);
                bool in = i >= 0 && j >= 0 && i < w && j < h;
                far[at] &= !in || segment->inside[at] ==
                                      segment->inside[(size_t)j * (size_t)w + (size_t)i];
            }
        }
    }
    return far;
}

float *side_photo_cover(const Image *image, const Segment *segment) {
    size_t count = (size_t)image->width * (size_t)image->height;
    float *cover = memory_zeroed(count, sizeof *cover);
    uint8_t *far = find_far(segment);
    for (size_t at = 0; at < count; at++) {
        int x = (int)(at % (size_t)image->width), y = (int)(at / (size_t)image->width);
        double in[3], out[3], along = 0.0, length = 0.0;
        cover[at] = segment->inside[at];
        if (far[at] || !find_light(image, segment, far, x, y, 1, in) ||
            !find_light(image, segment, far, x, y, 0, out)) {
            continue;
        }
        for (int k = 0; k < 3; k++) {
            double light = (double)segment_linear(image->rgba[IMAGE_CHANNELS * at + (size_t)k]);
            along += (light - out[k]) * (in[k] - out[k]);
            length += (in[k] - out[k]) * (in[k] - out[k]);
        }
        cover[at] = length > 0.0 ? (float)fmin(fmax(along / length, 0.0), 1.0) : cover[at];
    }
    free(far);
    return cover;
}
