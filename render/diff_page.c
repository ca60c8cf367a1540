/* One HTML page that needs nothing else: verdict, pictures with a slider, table. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/diff.h"
#include "render/markup.h"

#define GAP 8          /* [px] between the pictures of a strip */
#define MOST_ROWS 2000 /* of the table; the rest is in diff.json */

Image diff_strip(const Image *a, const Image *b) {
    Image heat = image_difference_picture(a, b);
    Image strip = image_create(3 * a->width + 2 * GAP, a->height);
    const Image *parts[3] = {a, b, &heat};
    memset(strip.rgba, 255, IMAGE_CHANNELS * (size_t)strip.width * (size_t)strip.height);
    for (int i = 0; i < 3; i++) {
        for (int y = 0; y < a->height; y++) {
            size_t to = (size_t)y * (size_t)strip.width + (size_t)(i * (a->width + GAP));
            memcpy(strip.rgba + IMAGE_CHANNELS * to,
                   parts[i]->rgba + IMAGE_CHANNELS * (size_t)y * (size_t)a->width,
                   IMAGE_CHANNELS * (size_t)a->width);
        }
    }
    image_free(&heat);
    return strip;
}

static void put_base64(FILE *out, const unsigned char *bytes, size_t size) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        unsigned word = (unsigned)bytes[i] << 16;
        word |= i + 1 < size ? (unsigned)bytes[i + 1] << 8 : 0;
        word |= i + 2 < size ? bytes[i + 2] : 0;
        char four[5] = {digits[word >> 18], digits[word >> 12 & 63], digits[word >> 6 & 63],
                        digits[word & 63], 0};
        if (i + 1 >= size) {
            four[2] = '=';
        }
        if (i + 2 >= size) {
            four[3] = '=';
        }
        fputs(four, out);
    }
}

static void put_image(FILE *out, const char *class, const Image *image) {
    char *bytes = NULL;
    size_t size = 0;
    FILE *memory = open_memstream(&bytes, &size);
    ASSERT(memory);
    image_put_png(memory, image, NULL, 0);
    fclose(memory);
    fprintf(out, "<img class=\"%s\" alt=\"%s\" src=\"data:image/png;base64,", class, class);
    put_base64(out, (unsigned char *)bytes, size);
    fputs("\">", out);
    free(bytes);
}

static void put_head(const Diff *diff, FILE *out) {
    bool same = diff_verdict(diff) == EXIT_OK;
    fputs(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>toile diff</title>"
        "<style>\nbody{font:15px/1.4 system-ui,sans-serif;margin:2em;max-width:1400px;color:#222}\n"
        "table{border-collapse:collapse;font-variant-numeric:tabular-nums}\n"
        "td,th{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd}\n"
        "td:last-child,th:last-child{text-align:left}\n.bad{color:#b00020}.good{color:#1b6e2c}\n"
        ".pair{position:relative;display:inline-block;line-height:0}\n"
        ".pair img{max-width:100%}\n.pair .b{position:absolute;left:0;top:0;"
        "clip-path:inset(0 0 0 50%)}\n.pair .line{position:absolute;top:0;bottom:0;left:50%;"
        "width:2px;background:#f0f;pointer-events:none}\ninput[type=range]{width:100%}\n"
        ".heat{max-width:100%;margin-top:.5em}\n</style></head><body>\n",
        out);
    fprintf(out, "<h1>toile diff: <span class=\"%s\">%s</span></h1>\n<p>a: ", same ? "good" : "bad",
            same ? "same" : "differs");
    markup_put(out, diff->def.a, false);
    fputs("<br>b: ", out);
    markup_put(out, diff->def.b, false);
    fprintf(out, "<br>%d of %d differ, profile %s</p>\n", diff->failed_items, diff->item_count,
            diff->def.rules.profile);
}

static void put_pair(const Diff *diff, const DiffItem *item, FILE *out) {
    const DiffRow *row = &diff->rows[item->worst];
    fputs("<h2>", out);
    markup_put(out, item->name, false);
    fprintf(out, ", frame %d</h2>\n<p class=\"%s\">", row->frame, row->failed ? "bad" : "good");
    markup_put(out, row->failed ? row->why : "same", false);
    fputs("</p>\n<div class=\"pair\">", out);
    put_image(out, "a", &item->worst_a);
    put_image(out, "b", &item->worst_b);
    fputs(
        "<div class=\"line\"></div><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" "
        "aria-label=\"a left, b right\"></div>\n<p>left of the line a, right of it b; below, where "
        "they differ</p>\n",
        out);
    Image heat = image_difference_picture(&item->worst_a, &item->worst_b);
    put_image(out, "heat", &heat);
    image_free(&heat);
}

static void put_row(const DiffItem *item, const DiffRow *row, FILE *out) {
    fprintf(out, "<tr%s><td>", row->failed ? " class=\"bad\"" : "");
    markup_put(out, item->name, false);
    fprintf(out, "</td><td>%d</td>", row->frame);
    for (int m = 0; m < DIFF_METRIC_COUNT; m++) {
        if (isnan(row->value[m])) {
            fputs("<td></td>", out);
        } else {
            fprintf(out, "<td>%.5g</td>", diff_metrics[m].scale * row->value[m]);
        }
    }
    fputs("<td>", out);
    markup_put(out, row->why, false);
    fputs("</td></tr>\n", out);
}

static void put_table(const Diff *diff, FILE *out) {
    fputs("<h2>All frames</h2>\n<table><tr><th>name</th><th>frame</th>", out);
    for (int m = 0; m < DIFF_METRIC_COUNT; m++) {
        fprintf(out, "<th title=\"%s\">%s%s%s</th>", diff_metrics[m].about, diff_metrics[m].name,
                diff_metrics[m].unit[0] ? " " : "", diff_metrics[m].unit);
    }
    fputs("<th></th></tr>\n", out);
    int count = diff->row_count < MOST_ROWS ? diff->row_count : MOST_ROWS;
    for (int i = 0; i < count; i++) {
        put_row(&diff->items[diff->rows[i].item], &diff->rows[i], out);
    }
    for (int i = 0; i < diff->item_count; i++) {
        if (diff->items[i].trouble[0]) {
            fputs("<tr class=\"bad\"><td>", out);
            markup_put(out, diff->items[i].name, false);
            fprintf(out, "</td><td colspan=\"%d\"></td><td>", DIFF_METRIC_COUNT + 1);
            markup_put(out, diff->items[i].trouble, false);
            fputs("</td></tr>\n", out);
        }
    }
    fputs("</table>\n", out);
}

void diff_print_page(const Diff *diff, FILE *out) {
    put_head(diff, out);
    for (int i = 0; i < diff->item_count; i++) {
        if (diff->items[i].worst_a.rgba) {
            put_pair(diff, &diff->items[i], out);
        }
    }
    put_table(diff, out);
    fputs("<script>\nfor (const pair of document.querySelectorAll('.pair')) {\n"
          "  const slider = pair.querySelector('input');\n  slider.addEventListener('input', () => "
          "{\n"
          "    pair.querySelector('.b').style.clipPath = `inset(0 0 0 ${slider.value}%)`;\n"
          "    pair.querySelector('.line').style.left = slider.value + '%';\n  });\n}\n"
          "document.body.dataset.ready = document.querySelectorAll('.pair').length;\n"
          "</script></body></html>\n",
          out);
}
