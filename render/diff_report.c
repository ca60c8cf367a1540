/* The table, JSON, and JUnit XML of a comparison. */
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "render/diff.h"
#include "render/json.h"
#include "render/markup.h"

static const char *verdict_word(const DiffItem *item) {
    return item->trouble[0] ? item->trouble : item->failed ? "differs" : "same";
}

/* True if any row of the comparison has this metric. */
static bool is_used(const Diff *diff, int metric) {
    for (int i = 0; i < diff->row_count; i++) {
        if (!isnan(diff->rows[i].value[metric])) {
            return true;
        }
    }
    return false;
}

static void print_head(const Diff *diff, FILE *out) {
    fprintf(out, "frame");
    for (int m = 0; m < DIFF_METRIC_COUNT; m++) {
        if (is_used(diff, m)) {
            char name[32];
            snprintf(name, sizeof name, "%s%s%s", diff_metrics[m].name,
                     diff_metrics[m].unit[0] ? " " : "", diff_metrics[m].unit);
            fprintf(out, " %10s", name);
        }
    }
    fputc('\n', out);
}

static void print_row(const Diff *diff, const DiffRow *row, FILE *out) {
    fprintf(out, "%5d", row->frame);
    for (int m = 0; m < DIFF_METRIC_COUNT; m++) {
        if (is_used(diff, m)) {
            if (isnan(row->value[m])) {
                fprintf(out, " %10s", "-");
            } else {
                fprintf(out, " %10.5g", diff_metrics[m].scale * row->value[m]);
            }
        }
    }
    fprintf(out, "%s%s\n", row->failed ? "  " : "", row->why);
}

void diff_print_table(const Diff *diff, FILE *out) {
    if (diff->row_count > 0) {
        print_head(diff, out);
    }
    for (int i = 0; i < diff->item_count; i++) {
        const DiffItem *item = &diff->items[i];
        if (diff->item_count > 1 || item->trouble[0]) {
            fprintf(out, "%s: %s\n", item->name, verdict_word(item));
        }
        for (int r = 0; r < item->row_count; r++) {
            print_row(diff, &diff->rows[item->row_begin + r], out);
        }
    }
    if (diff->item_count > 1) {
        fprintf(out, "%d of %d differ\n", diff->failed_items, diff->item_count);
    } else if (diff->row_count > 0) {
        fprintf(out, "%d of %d frames differ (%s)\n", diff->items[0].failed, diff->row_count,
                diff->def.rules.profile);
    }
}

/* ---- JSON ---- */

static void print_json_row(const DiffRow *row, FILE *out) {
    fprintf(out, "{\"frame\": %d, \"differs\": %s, \"why\": ", row->frame,
            row->failed ? "true" : "false");
    json_string(out, row->why);
    for (int m = 0; m < DIFF_METRIC_COUNT; m++) {
        if (!isnan(row->value[m])) {
            fprintf(out, ", \"%s\": ", diff_metrics[m].name);
            json_number(out, row->value[m]);
        }
    }
    if (!isnan(row->value[DIFF_MEAN])) {
        fprintf(out, ", \"mean_signed\": [%.9g, %.9g, %.9g]", row->mean_signed[0],
                row->mean_signed[1], row->mean_signed[2]);
    }
    fputc('}', out);
}

void diff_print_json(const Diff *diff, FILE *out) {
    fprintf(out, "{\"schema\": \"toile-diff-1\", \"a\": ");
    json_string(out, diff->def.a);
    fprintf(out, ", \"b\": ");
    json_string(out, diff->def.b);
    fprintf(out, ", \"profile\": \"%s\", \"items\": %d, \"items_differ\": %d, \"results\": [",
            diff->def.rules.profile, diff->item_count, diff->failed_items);
    for (int i = 0; i < diff->item_count; i++) {
        const DiffItem *item = &diff->items[i];
        fprintf(out, "%s\n {\"name\": ", i ? "," : "");
        json_string(out, item->name);
        fprintf(out, ", \"differs\": %s, \"trouble\": ",
                item->failed || item->trouble[0] ? "true" : "false");
        json_string(out, item->trouble);
        fprintf(out, ", \"frames\": [");
        for (int r = 0; r < item->row_count; r++) {
            fprintf(out, "%s\n  ", r ? "," : "");
            print_json_row(&diff->rows[item->row_begin + r], out);
        }
        fprintf(out, "]}");
    }
    fprintf(out, "\n]}\n");
}

/* ---- JUnit ---- */

static void put_case(const char *name, const char *frame, bool failed, bool trouble,
                     const char *why, FILE *out) {
    fputs("  <testcase classname=\"toile.diff\" name=\"", out);
    markup_put(out, name, true);
    fprintf(out, "%s\"", frame);
    if (!failed) {
        fputs("/>\n", out);
        return;
    }
    const char *tag = trouble ? "error" : "failure";
    fprintf(out, ">\n    <%s message=\"", tag);
    markup_put(out, why, true);
    fprintf(out, "\"/>\n  </testcase>\n");
}

void diff_print_junit(const Diff *diff, FILE *out) {
    int tests = 0, failures = 0, errors = 0;
    for (int i = 0; i < diff->item_count; i++) {
        const DiffItem *item = &diff->items[i];
        bool error = item->code > EXIT_DIFFERS;
        bool alone = item->trouble[0] || item->row_count == 0; /* a case besides its rows */
        tests += item->row_count + alone;
        failures += item->failed + (item->trouble[0] && !error);
        errors += error;
    }
    fprintf(out,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"%d\" failures=\"%d\" "
            "errors=\"%d\">\n <testsuite name=\"toile diff\" tests=\"%d\" failures=\"%d\" "
            "errors=\"%d\">\n",
            tests, failures, errors, tests, failures, errors);
    for (int i = 0; i < diff->item_count; i++) {
        const DiffItem *item = &diff->items[i];
        for (int r = 0; r < item->row_count; r++) {
            const DiffRow *row = &diff->rows[item->row_begin + r];
            char frame[32];
            snprintf(frame, sizeof frame, " frame %04d", row->frame);
            put_case(item->name, frame, row->failed, false, row->why, out);
        }
        if (item->trouble[0] || item->row_count == 0) {
            put_case(item->name, "", item->trouble[0], item->code > EXIT_DIFFERS, item->trouble,
                     out);
        }
    }
    fputs(" </testsuite>\n</testsuites>\n", out);
}

/* ---- files ---- */

static bool write_with(const Diff *diff, const char *folder, const char *name,
                       void (*print)(const Diff *diff, FILE *out), Error *error) {
    char path[FILE_PATH_SIZE];
    PartFile file;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (!file_create_folders(path, error) || !file_start(&file, path, error)) {
        return false;
    }
    print(diff, file.out);
    return file_finish(&file, error);
}

static bool write_picture(const char *folder, const char *name, const Image *image, Error *error) {
    char path[FILE_PATH_SIZE];
    PartFile file;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (!file_start(&file, path, error)) {
        return false;
    }
    image_put_png(file.out, image, NULL, 0);
    return file_finish(&file, error);
}

bool diff_write_reports(const Diff *diff, const char *folder, Error *error) {
    if (strlen(folder) + 32 > FILE_PATH_SIZE) {
        return error_set(error, EXIT_USAGE, "-o: the path is too long");
    }
    if (!write_with(diff, folder, "diff.json", diff_print_json, error) ||
        !write_with(diff, folder, "junit.xml", diff_print_junit, error) ||
        !write_with(diff, folder, "diff.html", diff_print_page, error)) {
        return false;
    }
    const DiffItem *item = &diff->items[diff->worst_item < 0 ? 0 : diff->worst_item];
    if (!item->worst_a.rgba) {
        return true;
    }
    Image heat = image_difference_picture(&item->worst_a, &item->worst_b);
    Image strip = diff_strip(&item->worst_a, &item->worst_b);
    bool good = write_picture(folder, "difference.png", &heat, error) &&
                write_picture(folder, "side-by-side.png", &strip, error);
    image_free(&heat);
    image_free(&strip);
    return good;
}
