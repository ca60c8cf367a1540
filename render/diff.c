/* Rows of pictures and bytes, verdicts, and which pictures are kept. */
#include "render/diff.h"
#include "render/image_exr.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/image_source.h"

#define MOST_KEPT 20 /* pairs of pictures that stay in memory for the reports */

DiffRow *diff_add_row(Diff *diff, DiffItem *item, int frame) {
    if (diff->row_count == diff->row_room) {
        int room = diff->row_room ? 2 * diff->row_room : 256;
        diff->rows = arena_grow(&diff->arena, DiffRow, diff->rows, diff->row_count, room);
        diff->row_room = room;
    }
    DiffRow *row = &diff->rows[diff->row_count++];
    *row = (DiffRow){.item = (int)(item - diff->items), .frame = frame};
    for (int i = 0; i < DIFF_METRIC_COUNT; i++) {
        row->value[i] = NAN;
    }
    item->row_count++;
    return row;
}

void diff_judge_row(const Diff *diff, const DiffItem *item, DiffRow *row) {
    DiffGate gate = diff_rules_gate(&diff->def.rules, item->name);
    for (int i = 0; i < DIFF_METRIC_COUNT && !row->failed; i++) {
        const DiffMetric *metric = &diff_metrics[i];
        double value = row->value[i], limit = gate.limit[i];
        if (isnan(limit) || isnan(value) || (metric->at_least ? value >= limit : value <= limit)) {
            continue;
        }
        row->failed = true;
        const char *space = metric->unit[0] ? " " : "";
        snprintf(row->why, sizeof row->why, "%s %.4g%s%s %s %.4g%s%s (%s)", metric->name,
                 metric->scale * value, space, metric->unit, metric->at_least ? "<" : ">",
                 metric->scale * limit, space, metric->unit, diff->def.rules.profile);
    }
}

/* ---- pictures ---- */

/* Colours times alpha: what a picture adds to a black background. True if any pixel is not opaque. */
static bool premultiply(Image *image) {
    bool clear = false;
    for (size_t i = 0; i < (size_t)image->width * (size_t)image->height; i++) {
        uint8_t *p = image->rgba + IMAGE_CHANNELS * i;
        clear = clear || p[3] < 255;
        for (int k = 0; p[3] < 255 && k < 3; k++) {
            p[k] = (uint8_t)((p[k] * p[3] + 127) / 255);
        }
    }
    return clear;
}

/* Common part of what is more than half opaque, over both; 1 when there is none. */
static double compare_silhouettes(const Image *a, const Image *b) {
    size_t both = 0, any = 0;
    for (size_t i = 3; i < IMAGE_CHANNELS * (size_t)a->width * (size_t)a->height;
         i += IMAGE_CHANNELS) {
        bool in_a = a->rgba[i] > 127, in_b = b->rgba[i] > 127;
        both += in_a && in_b;
        any += in_a || in_b;
    }
    return any ? (double)both / (double)any : 1.0;
}

/* Largest difference and share over the step with alpha as a fourth channel. */
static void count_steps(const Image *a, const Image *b, double step, DiffRow *row) {
    size_t pixels = (size_t)a->width * (size_t)a->height, over = 0;
    int largest = 0;
    for (size_t i = 0; i < pixels; i++) {
        const uint8_t *p = a->rgba + IMAGE_CHANNELS * i, *q = b->rgba + IMAGE_CHANNELS * i;
        int most = 0;
        for (int k = 0; k < IMAGE_CHANNELS; k++) {
            int d = abs(q[k] - p[k]);
            most = d > most ? d : most;
        }
        over += most > step;
        largest = most > largest ? most : largest;
    }
    row->value[DIFF_LARGEST] = largest;
    row->value[DIFF_SHARE] = (double)over / (double)pixels;
}

/* What 8 bits would not show: the largest difference at the depth of the files; NAN: they have no more. */
static double compare_deep(const char *a, const char *b) {
    double largest = NAN;
    bool deep = a && b && (exr_compare(a, b, &largest) || image_compare_png16(a, b, &largest));
    return deep ? largest : NAN;
}

static void compare_images(Diff *diff, DiffItem *item, int frame, double deep, Image *a, Image *b) {
    DiffRow *row = diff_add_row(diff, item, frame);
    row->value[DIFF_DEEP] = deep;
    DiffGate gate = diff_rules_gate(&diff->def.rules, item->name);
    bool clear_a = premultiply(a), clear_b = premultiply(b);
    ImageDifference d = image_compare(a, b);
    count_steps(a, b, isnan(gate.step) ? IMAGE_STEP : gate.step, row);
    bool same = d.largest == 0.0;
    row->value[DIFF_PSNR] = d.psnr;
    row->value[DIFF_SSIM] = d.ssim;
    row->value[DIFF_BLOCKS] = same ? 1.0 : image_compare_blocks(a, b);
    row->value[DIFF_FLIP] = same ? 0.0 : image_compare_flip(a, b, NULL);
    row->value[DIFF_MEAN] = 0.0;
    for (int k = 0; k < 3; k++) {
        row->mean_signed[k] = d.mean_signed[k];
        row->value[DIFF_MEAN] = fmax(row->value[DIFF_MEAN], fabs(d.mean_signed[k]));
    }
    if (clear_a || clear_b) {
        row->value[DIFF_IOU] = compare_silhouettes(a, b);
    }
    diff_judge_row(diff, item, row);
}

/* How bad a row is, for the choice of the worst: what an eye sees, or how far the cloth is off. */
static double badness(const DiffRow *row) {
    double flip = row->value[DIFF_FLIP], moved = row->value[DIFF_MOVED];
    return (row->failed ? 1e6 : 0.0) + (isnan(flip) ? 0.0 : flip) + (isnan(moved) ? 0.0 : moved);
}

static void keep_worst(Diff *diff, DiffItem *item, int row, Image *a, Image *b) {
    bool worse = item->worst < 0 || badness(&diff->rows[row]) > badness(&diff->rows[item->worst]);
    int kept = 0;
    for (int i = 0; i < diff->item_count; i++) {
        kept += diff->items[i].worst_a.rgba != NULL && &diff->items[i] != item;
    }
    bool wanted = diff->rows[row].failed || item == &diff->items[0];
    if (worse) {
        item->worst = row;
    }
    if (a && worse && wanted && kept < MOST_KEPT) {
        image_free(&item->worst_a);
        image_free(&item->worst_b);
        item->worst_a = *a;
        item->worst_b = *b;
        *a = *b = (Image){0};
    }
}

static void note_trouble(DiffItem *item, ExitCode code, const char *text) {
    if (!item->trouble[0]) {
        snprintf(item->trouble, sizeof item->trouble, "%.500s", text);
        item->code = code;
    }
}

typedef struct Watcher {
    bool (*go_on)(void *context, const DiffRow *row);
    void *context;
    bool stopped;
} Watcher;

/* Both pictures are there: compares and frees them. */
static void compare_pair(Diff *diff, DiffItem *item, int frame, double deep, Image *a, Image *b,
                         Watcher *watcher) {
    if (a->width != b->width || a->height != b->height) {
        if (!diff->def.resize) {
            char text[160];
            snprintf(text, sizeof text, "frame %d: sizes differ: %d x %d and %d x %d; --resize",
                     frame, a->width, a->height, b->width, b->height);
            note_trouble(item, EXIT_BAD_INPUT, text);
        } else {
            Image other = video_resize(b, a->width, a->height);
            image_free(b);
            *b = other;
        }
    }
    if (!item->trouble[0]) {
        compare_images(diff, item, frame, deep, a, b);
        watcher->stopped = !watcher->go_on(watcher->context, &diff->rows[diff->row_count - 1]);
        keep_worst(diff, item, diff->row_count - 1, a, b);
    }
    image_free(a);
    image_free(b);
}

static void compare_sources(Diff *diff, DiffItem *item, ImageSource *a, ImageSource *b,
                            Watcher *watcher) {
    for (int frame = 0; !item->trouble[0] && !watcher->stopped; frame++) {
        Image image_a = {0}, image_b = {0};
        Error error = {0};
        VideoNext next_a = image_source_next(a, &image_a, &error);
        VideoNext next_b = image_source_next(b, &image_b, &error);
        if (next_a == VIDEO_PICTURE && next_b == VIDEO_PICTURE) {
            double deep = compare_deep(image_source_file(a), image_source_file(b));
            compare_pair(diff, item, frame, deep, &image_a, &image_b, watcher);
            continue;
        }
        image_free(&image_a);
        image_free(&image_b);
        if (next_a == VIDEO_WRONG || next_b == VIDEO_WRONG) {
            note_trouble(item, error.code, error.text);
        } else if (next_a != next_b) {
            char text[160];
            snprintf(text, sizeof text, "%s ends after %d frames, the other one goes on",
                     next_a == VIDEO_END ? "a" : "b", frame);
            note_trouble(item, EXIT_DIFFERS, text);
        }
        return;
    }
}

static void compare_pictures(Diff *diff, DiffItem *item, Watcher *watcher) {
    ImageSource a, b;
    Error error = {0};
    if (!image_source_open(&a, item->a, &error)) {
        note_trouble(item, error.code, error.text);
        return;
    }
    if (image_source_open(&b, item->b, &error)) {
        compare_sources(diff, item, &a, &b, watcher);
        image_source_close(&b);
    } else {
        note_trouble(item, error.code, error.text);
    }
    image_source_close(&a);
}

/* ---- other files ---- */

static void compare_bytes(DiffItem *item) {
    FILE *a = fopen(item->a, "rb"), *b = fopen(item->b, "rb");
    if (!a || !b) {
        note_trouble(item, EXIT_IO, "cannot be read");
    }
    for (long long at = 0; a && b && !item->trouble[0]; at++) {
        int p = getc(a), q = getc(b);
        if (p != q) {
            char text[64];
            snprintf(text, sizeof text, "differs at byte %lld", at);
            note_trouble(item, EXIT_DIFFERS, text);
        } else if (p == EOF) {
            break;
        }
    }
    if (a) {
        fclose(a);
    }
    if (b) {
        fclose(b);
    }
}

/* ---- all of it ---- */

static void compare_item(Diff *diff, DiffItem *item, Watcher *watcher) {
    item->row_begin = diff->row_count;
    if (item->only_a || item->only_b) {
        note_trouble(item, EXIT_DIFFERS, item->only_a ? "is missing in b" : "is missing in a");
    } else if (item->kind == DIFF_BYTES) {
        compare_bytes(item);
    } else if (item->kind == DIFF_PICTURES) {
        compare_pictures(diff, item, watcher);
    } else {
        diff_compare_states(diff, item);
        for (int i = item->row_begin; i < diff->row_count && !watcher->stopped; i++) {
            watcher->stopped = !watcher->go_on(watcher->context, &diff->rows[i]);
            keep_worst(diff, item, i, NULL, NULL);
        }
    }
    for (int i = item->row_begin; i < diff->row_count; i++) {
        item->failed += diff->rows[i].failed;
    }
}

bool diff_compare(Diff *diff, bool (*go_on)(void *context, const DiffRow *row), void *context,
                  Error *error) {
    Watcher watcher = {go_on, context, false};
    for (int i = 0; i < diff->item_count && !watcher.stopped; i++) {
        DiffItem *item = &diff->items[i];
        compare_item(diff, item, &watcher);
        bool bad = item->failed > 0 || item->trouble[0];
        diff->failed_items += bad;
        if (bad && item->worst >= 0 &&
            (diff->worst_item < 0 ||
             badness(&diff->rows[item->worst]) >
                 badness(&diff->rows[diff->items[diff->worst_item].worst]))) {
            diff->worst_item = i;
        }
    }
    return !watcher.stopped || error_set(error, EXIT_INTERRUPTED, "interrupted");
}

ExitCode diff_verdict(const Diff *diff) {
    ExitCode code = diff->failed_items > 0 ? EXIT_DIFFERS : EXIT_OK;
    for (int i = 0; i < diff->item_count; i++) {
        code = diff->items[i].code > code ? diff->items[i].code : code;
    }
    return code;
}

void diff_free(Diff *diff) {
    for (int i = 0; i < diff->item_count; i++) {
        image_free(&diff->items[i].worst_a);
        image_free(&diff->items[i].worst_b);
    }
    arena_free(&diff->arena);
}
