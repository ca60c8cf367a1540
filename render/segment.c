#include "render/segment.h"
#include "render/srgb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/memory.h"

#define BORDER 0.03   /* of the shorter side: where the background is looked at */
#define TERMS 6       /* of the quadratic: 1 x y xx xy yy */
#define CLIP 2.5      /* times the scatter: what lies further off is no background */
#define ROUNDS 12     /* of the fit */
#define CLOSE 3       /* [px] */
#define SMALLEST 0.02 /* of the picture: less is no cloth */
#define LARGEST 0.95
#define BINS 512
#define APART 3.0   /* times what the border has of a feature, which the cloth must have */
#define ROUND 0.997 /* area^2 over 2 pi times the moment: more is a disc, most likely a plate */
#define SEPARABLE_LEAST 0.3
#define SEPARABLE 0.6 /* Otsu's criterion, 0..1, of a feature that is good enough */

enum { COLOUR, BRIGHTER, DARKER, ANY, FEATURES };
static const char *const feature_names[FEATURES] = {"colour", "brighter", "darker",
                                                    "any difference"};

/* Logarithms of linear light over the background's, one plane a channel. */
typedef struct Field3 {
    int width, height;
    float *plane[3];
} Field3;

float segment_linear(uint8_t value) {
    static float curve[256];
    if (curve[255] == 0.0f) {
        for (int i = 0; i < 256; i++) {
            curve[i] = (float)srgb_light(i / 255.0);
        }
    }
    return curve[value];
}

/* Mean of 5 x 5 pixels, then the logarithm; 0.002 keeps black finite. */
static Field3 create_field(const Image *image) {
    Field3 field = {image->width, image->height, {NULL}};
    size_t count = (size_t)image->width * (size_t)image->height;
    float *rows = memory_zeroed(count, sizeof *rows);
    for (int k = 0; k < 3; k++) {
        float *out = field.plane[k] = memory_zeroed(count, sizeof *out);
        for (int y = 0; y < image->height; y++) {
            for (int x = 0; x < image->width; x++) {
                float sum = 0.0f;
                for (int i = -2; i <= 2; i++) {
                    int at = x + i < 0 ? 0 : x + i >= image->width ? image->width - 1 : x + i;
                    sum += segment_linear(
                        image->rgba[IMAGE_CHANNELS *
                                        ((size_t)y * (size_t)image->width + (size_t)at) +
                                    (size_t)k]);
                }
                rows[(size_t)y * (size_t)image->width + (size_t)x] = 0.2f * sum;
            }
        }
        for (int y = 0; y < image->height; y++) {
            for (int x = 0; x < image->width; x++) {
                float sum = 0.0f;
                for (int i = -2; i <= 2; i++) {
                    int at = y + i < 0 ? 0 : y + i >= image->height ? image->height - 1 : y + i;
                    sum += rows[(size_t)at * (size_t)image->width + (size_t)x];
                }
                out[(size_t)y * (size_t)image->width + (size_t)x] = logf(0.2f * sum + 0.002f);
            }
        }
    }
    free(rows);
    return field;
}

static void free_field(Field3 *field) {
    for (int k = 0; k < 3; k++) {
        free(field->plane[k]);
    }
}

static int border_of(const Field3 *field) {
    int shorter = field->width < field->height ? field->width : field->height;
    int border = (int)(BORDER * shorter);
    return border < 2 ? 2 : border;
}

static bool at_border(const Field3 *field, int x, int y, int border) {
    return x < border || y < border || x >= field->width - border || y >= field->height - border;
}

static void terms_at(const Field3 *field, int x, int y, double terms[TERMS]) {
    double u = 2.0 * x / field->width - 1.0, v = 2.0 * y / field->height - 1.0;
    double all[TERMS] = {1.0, u, v, u * u, u * v, v * v};
    memcpy(terms, all, sizeof all);
}

/* Gauss with pivots, in place; what cannot be told stays 0. */
static void solve(double m[TERMS][TERMS + 1], double out[TERMS]) {
    for (int c = 0; c < TERMS; c++) {
        int pivot = c;
        for (int r = c + 1; r < TERMS; r++) {
            pivot = fabs(m[r][c]) > fabs(m[pivot][c]) ? r : pivot;
        }
        for (int k = 0; k <= TERMS; k++) {
            double swap = m[c][k];
            m[c][k] = m[pivot][k];
            m[pivot][k] = swap;
        }
        for (int r = 0; r < TERMS; r++) {
            double factor = r != c && fabs(m[c][c]) > 1e-9 ? m[r][c] / m[c][c] : 0.0;
            for (int k = c; k <= TERMS; k++) {
                m[r][k] -= factor * m[c][k];
            }
        }
    }
    for (int c = 0; c < TERMS; c++) {
        out[c] = fabs(m[c][c]) > 1e-9 ? m[c][TERMS] / m[c][c] : 0.0;
    }
}

static double value_at(const double fit[TERMS], const double terms[TERMS]) {
    double value = 0.0;
    for (int i = 0; i < TERMS; i++) {
        value += fit[i] * terms[i];
    }
    return value;
}

#define MEDIAN_BINS 2000
#define MEDIAN_STEP 0.002 /* of a logarithm */

/* Scatter of the border around a fit: 1.48 times the median distance, which outliers do not move. */
static double find_scatter(const Field3 *field, const float *plane, const double fit[TERMS]) {
    long histogram[MEDIAN_BINS] = {0}, count = 0, sum = 0;
    int border = border_of(field), bin = 0;
    for (int y = 0; y < field->height; y++) {
        for (int x = 0; x < field->width; x++) {
            if (at_border(field, x, y, border)) {
                double terms[TERMS];
                terms_at(field, x, y, terms);
                double off = plane[(size_t)y * (size_t)field->width + (size_t)x];
                off = fabs(off - value_at(fit, terms)) / MEDIAN_STEP;
                histogram[off < MEDIAN_BINS - 1 ? (int)off : MEDIAN_BINS - 1]++;
                count++;
            }
        }
    }
    while (bin < MEDIAN_BINS - 1 && (sum += histogram[bin]) < count / 2) {
        bin++;
    }
    return 1.48 * MEDIAN_STEP * (bin + 0.5);
}

/* Fits the border anew, without what is further than `limit` from the fit before. */
static void fit_border(const Field3 *field, const float *plane, double limit, double fit[TERMS]) {
    double m[TERMS][TERMS + 1] = {{0}}, terms[TERMS];
    int border = border_of(field);
    for (int y = 0; y < field->height; y++) {
        for (int x = 0; x < field->width; x++) {
            double value = plane[(size_t)y * (size_t)field->width + (size_t)x];
            if (!at_border(field, x, y, border)) {
                continue;
            }
            terms_at(field, x, y, terms);
            if (!(fabs(value - value_at(fit, terms)) <= limit)) {
                continue;
            }
            for (int i = 0; i < TERMS; i++) {
                for (int j = 0; j < TERMS; j++) {
                    m[i][j] += terms[i] * terms[j];
                }
                m[i][TERMS] += terms[i] * value;
            }
        }
    }
    solve(m, fit);
}

/* Takes the background out of each plane. */
static void flatten(Field3 *field) {
    for (int k = 0; k < 3; k++) {
        double fit[TERMS] = {0}, limit = INFINITY, left = 0.0, terms[TERMS];
        for (int round = 0; round < ROUNDS; round++) {
            fit_border(field, field->plane[k], limit, fit);
            left = find_scatter(field, field->plane[k], fit);
            limit = fmax(CLIP * left, 0.01);
        }
        for (int y = 0; y < field->height; y++) {
            for (int x = 0; x < field->width; x++) {
                float *value = &field->plane[k][(size_t)y * (size_t)field->width + (size_t)x];
                terms_at(field, x, y, terms);
                *value -= (float)value_at(fit, terms);
            }
        }
    }
}

static float feature_at(const Field3 *field, size_t i, int feature) {
    float r = field->plane[0][i], g = field->plane[1][i], b = field->plane[2][i];
    float light = (r + g + b) / 3.0f, colour = hypotf(hypotf(r - light, g - light), b - light);
    switch (feature) {
    case COLOUR:
        return colour;
    case BRIGHTER:
        return fmaxf(light, 0.0f);
    case DARKER:
        return fmaxf(-light, 0.0f);
    default:
        return hypotf(light, colour);
    }
}

/* ---- thresholds ---- */

typedef struct Otsu {
    double threshold, quality; /* of the variance, what lies between the parts */
    double apart;              /* means of the parts */
} Otsu;

/* skip: pixels that do not count where it is 1; NULL. */
static Otsu find_otsu(const float *feature, size_t count, const uint8_t *skip) {
    double histogram[BINS] = {0}, top = 0.0, total = 0.0, sum = 0.0, squares = 0.0;
    for (size_t i = 0; i < count; i++) {
        top = skip && skip[i] ? top : fmax(top, feature[i]);
    }
    for (size_t i = 0; i < count && top > 0.0; i++) {
        if (!skip || !skip[i]) {
            histogram[(int)(feature[i] / top * (BINS - 1))]++;
        }
    }
    for (int b = 0; b < BINS; b++) {
        total += histogram[b];
        sum += b * histogram[b];
        squares += (double)b * b * histogram[b];
    }
    Otsu best = {0.0, 0.0, 0.0};
    double variance = total > 0.0 ? squares / total - (sum / total) * (sum / total) : 0.0;
    double below = 0.0, below_sum = 0.0;
    for (int b = 0; b + 1 < BINS && variance > 0.0; b++) {
        below += histogram[b];
        below_sum += b * histogram[b];
        double above = total - below;
        if (below <= 0.0 || above <= 0.0) {
            continue;
        }
        double low = below_sum / below, high = (sum - below_sum) / above;
        double between = below / total * (above / total) * (high - low) * (high - low) / variance;
        if (between > best.quality) {
            /* half way between the parts, which is less shy than the bin itself */
            best = (Otsu){0.5 * (low + high) / (BINS - 1) * top, between,
                          (high - low) / (BINS - 1) * top};
        }
    }
    return best;
}

/* ---- pieces ---- */

/* Grows (or, on what is outside, shrinks) a mask by a square. */
static void grow(uint8_t *mask, int width, int height, int radius, uint8_t value,
                 uint8_t *scratch) {
    size_t count = (size_t)width * (size_t)height;
    for (int axis = 0; axis < 2; axis++) {
        memcpy(scratch, mask, count);
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                for (int d = -radius; d <= radius; d++) {
                    int i = axis ? x : x + d, j = axis ? y + d : y;
                    bool in = i >= 0 && j >= 0 && i < width && j < height;
                    if (in && scratch[(size_t)j * (size_t)width + (size_t)i] == value) {
                        mask[(size_t)y * (size_t)width + (size_t)x] = value;
                        break;
                    }
                }
            }
        }
    }
}

/* Marks with `mark` the piece of pixels that are `wanted` around a start; returns its size. */
static long flood(uint8_t *mask, int width, int height, int x, int y, uint8_t wanted, uint8_t mark,
                  int *stack) {
    long size = 0, depth = 0;
    if (mask[(size_t)y * (size_t)width + (size_t)x] != wanted) {
        return 0;
    }
    mask[(size_t)y * (size_t)width + (size_t)x] = mark;
    stack[depth++] = y * width + x;
    while (depth > 0) {
        int at = stack[--depth], i = at % width, j = at / width;
        size++;
        const int next[4][2] = {{i - 1, j}, {i + 1, j}, {i, j - 1}, {i, j + 1}};
        for (int k = 0; k < 4; k++) {
            int a = next[k][0], b = next[k][1];
            if (a >= 0 && b >= 0 && a < width && b < height &&
                mask[(size_t)b * (size_t)width + (size_t)a] == wanted) {
                mask[(size_t)b * (size_t)width + (size_t)a] = mark;
                stack[depth++] = b * width + a;
            }
        }
    }
    return size;
}

typedef enum Piece { PIECE_GOOD, PIECE_NONE, PIECE_CUT, PIECE_TOO_SMALL, PIECE_TOO_LARGE } Piece;

/* Closes, fills holes, keeps the piece at the seed: 1 inside, 0 elsewhere. */
static Piece keep_piece(Segment *segment, double seed_x, double seed_y) {
    int w = segment->width, h = segment->height, x = (int)seed_x, y = (int)seed_y;
    size_t count = (size_t)w * (size_t)h;
    uint8_t *mask = segment->inside, *scratch = memory_zeroed(count, 1);
    int *stack = memory_zeroed(count, sizeof *stack);
    grow(mask, w, h, CLOSE, 1, scratch);
    grow(mask, w, h, CLOSE, 0, scratch);
    for (int i = 0; i < w; i++) { /* what the border reaches from outside is no hole */
        flood(mask, w, h, i, 0, 0, 2, stack);
        flood(mask, w, h, i, h - 1, 0, 2, stack);
    }
    for (int j = 0; j < h; j++) {
        flood(mask, w, h, 0, j, 0, 2, stack);
        flood(mask, w, h, w - 1, j, 0, 2, stack);
    }
    for (size_t i = 0; i < count; i++) {
        mask[i] = mask[i] == 2 ? 0 : 1;
    }
    bool seeded = x >= 0 && y >= 0 && x < w && y < h;
    long size = seeded ? flood(mask, w, h, x, y, 1, 3, stack) : 0;
    bool cut = false;
    for (size_t i = 0; i < count; i++) {
        mask[i] = mask[i] == 3;
        int column = (int)(i % (size_t)w), row = (int)(i / (size_t)w);
        cut = cut || (mask[i] && (column == 0 || row == 0 || column == w - 1 || row == h - 1));
    }
    free(scratch);
    free(stack);
    segment->area = (double)size;
    return size == 0                                 ? PIECE_NONE
           : (double)size > LARGEST * (double)count  ? PIECE_TOO_LARGE
           : cut                                     ? PIECE_CUT
           : (double)size < SMALLEST * (double)count ? PIECE_TOO_SMALL
                                                     : PIECE_GOOD;
}

static Piece cut_at(const float *feature, double threshold, const SegmentDef *def,
                    Segment *segment) {
    size_t count = (size_t)segment->width * (size_t)segment->height;
    for (size_t i = 0; i < count; i++) {
        segment->inside[i] = feature[i] > threshold;
    }
    segment->threshold = threshold;
    return keep_piece(segment, def->x, def->y);
}

/* The largest relative change of the area as the threshold moves by a tenth. */
static double find_change(const float *feature, const SegmentDef *def, const Segment *segment) {
    Segment other = *segment;
    double change = 0.0;
    other.inside = memory_zeroed((size_t)segment->width * (size_t)segment->height, 1);
    for (int side = -1; side <= 1; side += 2) {
        cut_at(feature, segment->threshold * (1.0 + 0.1 * side), def, &other);
        change = fmax(change, fabs(other.area / segment->area - 1.0));
    }
    free(other.inside);
    return change;
}

static bool refuse(Piece piece, Error *error) {
    static const char *const why[] = {
        "", "nothing at the middle of the picture differs from its border",
        "the cloth is cut off by the picture's edge", "what differs from the border is too small",
        "everything differs from the border"};
    return error_set(error, EXIT_BAD_INPUT,
                     "the photograph cannot be measured: %s; --mask FILE says "
                     "where the cloth is",
                     why[piece]);
}

/* How round the piece is: 1 for a disc. */
static double find_roundness(const Segment *segment) {
    double x = 0.0, y = 0.0, moment = 0.0;
    for (int pass = 0; pass < 2; pass++) {
        for (int j = 0; j < segment->height; j++) {
            for (int i = 0; i < segment->width; i++) {
                if (!segment->inside[(size_t)j * (size_t)segment->width + (size_t)i]) {
                    continue;
                }
                if (pass == 0) {
                    x += i / segment->area;
                    y += j / segment->area;
                } else {
                    moment += (i - x) * (i - x) + (j - y) * (j - y);
                }
            }
        }
    }
    return segment->area * segment->area / (2.0 * 3.141592653589793 * moment);
}

/* What three quarters of the border stay under in a feature. */
static double find_quartile(const Field3 *field, const float *feature) {
    long histogram[MEDIAN_BINS] = {0}, count = 0, sum = 0;
    int border = border_of(field), bin = 0;
    for (int y = 0; y < field->height; y++) {
        for (int x = 0; x < field->width; x++) {
            if (at_border(field, x, y, border)) {
                double value = feature[(size_t)y * (size_t)field->width + (size_t)x] / MEDIAN_STEP;
                histogram[value < MEDIAN_BINS - 1 ? (int)value : MEDIAN_BINS - 1]++;
                count++;
            }
        }
    }
    while (bin < MEDIAN_BINS - 1 && (sum += histogram[bin]) < 3 * count / 4) {
        bin++;
    }
    return MEDIAN_STEP * (bin + 0.5);
}

/* Cuts at the threshold; true when the piece can be trusted. `worst` keeps why not. */
static bool try_threshold(const float *feature, double threshold, const SegmentDef *def,
                          Segment *segment, Piece *worst) {
    Piece piece = cut_at(feature, threshold, def, segment);
    if (piece == PIECE_GOOD) {
        segment->change = find_change(feature, def, segment);
        return segment->change <= SEGMENT_UNSURE;
    }
    *worst = piece != PIECE_NONE ? piece : *worst;
    return false;
}

/* The piece is round: what remains without it is parted once more, so that a plate that differs much
 * does not hide a cloth that differs little. */
static bool look_around_plate(const Field3 *field, const float *feature, double least,
                              const SegmentDef *def, Segment *segment, Piece *worst) {
    size_t count = (size_t)field->width * (size_t)field->height;
    uint8_t *plate = memory_zeroed(count, 1), *scratch = memory_zeroed(count, 1);
    memcpy(plate, segment->inside, count);
    grow(plate, field->width, field->height, 2 * CLOSE, 1, scratch);
    Otsu otsu = find_otsu(feature, count, plate);
    free(plate);
    free(scratch);
    return otsu.apart >= APART * find_quartile(field, feature) && otsu.quality >= least &&
           try_threshold(feature, otsu.threshold, def, segment, worst) &&
           find_roundness(segment) < ROUND;
}

static bool try_feature(const Field3 *field, int which, float *feature, double least,
                        bool round_too, const SegmentDef *def, Segment *segment, Piece *worst) {
    size_t count = (size_t)field->width * (size_t)field->height;
    for (size_t i = 0; i < count; i++) {
        feature[i] = feature_at(field, i, which);
    }
    Otsu otsu = find_otsu(feature, count, NULL);
    if (otsu.apart < APART * find_quartile(field, feature) || otsu.quality < least) {
        return false;
    }
    segment->feature = feature_names[which];
    bool given = !isnan(def->threshold);
    return try_threshold(feature, given ? def->threshold : otsu.threshold, def, segment, worst) &&
           (round_too || find_roundness(segment) < ROUND ||
            (!given && look_around_plate(field, feature, least, def, segment, worst)));
}

/* In order of their trustworthiness; the first good one wins. Round pieces come last: they are the
 * plate on a cloth that differs from its ground in another way, unless the cloth lies flat. */
static bool try_features(const Field3 *field, const SegmentDef *def, Segment *segment,
                         Error *error) {
    float *feature = memory_zeroed((size_t)field->width * (size_t)field->height, sizeof *feature);
    Piece worst = PIECE_NONE;
    bool good = false;
    for (int round = 0; round < 3 && !good; round++) {
        double least = round == 0 ? SEPARABLE : SEPARABLE_LEAST;
        for (int f = 0; f < FEATURES && !good; f++) {
            good = try_feature(field, f, feature, least, round == 2, def, segment, &worst);
        }
    }
    free(feature);
    if (!good && worst == PIECE_NONE && segment->change > SEGMENT_UNSURE) {
        return error_set(
            error, EXIT_BAD_INPUT,
            "the photograph cannot be measured: the cloth does not stand out, its area "
            "changes by %.0f %% with the threshold; --mask FILE says where it is",
            100 * segment->change);
    }
    return good || refuse(worst, error);
}

static bool use_mask(const Image *image, const SegmentDef *def, Segment *segment, Error *error) {
    if (def->mask->width != image->width || def->mask->height != image->height) {
        return error_set(error, EXIT_BAD_INPUT,
                         "the mask has %d x %d pixels, the photograph %d x %d", def->mask->width,
                         def->mask->height, image->width, image->height);
    }
    size_t count = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < count; i++) {
        segment->inside[i] = def->mask->rgba[IMAGE_CHANNELS * i + 1] > 127;
    }
    segment->feature = "mask";
    segment->threshold = NAN;
    Piece piece = keep_piece(segment, def->x, def->y);
    return piece == PIECE_GOOD || refuse(piece, error);
}

bool segment_photo(const Image *image, const SegmentDef *def, Segment *segment, Error *error) {
    *segment = (Segment){.width = image->width, .height = image->height, .feature = ""};
    if (image->width < 64 || image->height < 64) {
        return error_set(error, EXIT_BAD_INPUT, "a photograph of %d x %d pixels is too small",
                         image->width, image->height);
    }
    segment->inside = memory_zeroed((size_t)image->width * (size_t)image->height, 1);
    bool good;
    if (def->mask) {
        good = use_mask(image, def, segment, error);
    } else {
        Field3 field = create_field(image);
        flatten(&field);
        good = try_features(&field, def, segment, error);
        free_field(&field);
    }
    if (!good) {
        segment_free(segment);
    }
    return good;
}

void segment_free(Segment *segment) {
    free(segment->inside);
    *segment = (Segment){0};
}
