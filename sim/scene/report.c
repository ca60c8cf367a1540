#include "sim/scene/report.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MESSAGE_SIZE 512  /* [byte] of one complaint */
#define KEPT_LIMIT 1000   /* complaints kept for sorting; a broken file can have millions */
#define EXCERPT_BEFORE 60 /* [character] of a source line shown before the column */
#define EXCERPT_AFTER 40  /* and after it */
#define QUOTE_LONGEST 48  /* [byte] of a found word that is repeated in a message */

struct Complaint {
    Complaint *older;
    Place place;
    ExitCode code;
    int number; /* order of discovery, breaks ties */
    char message[MESSAGE_SIZE];
};

static Complaint *complaint_create(Report *report, Place place, const char *format,
                                   va_list arguments) {
    Complaint *complaint = arena_push(report->arena, Complaint, 1);
    complaint->place = place;
    vsnprintf(complaint->message, sizeof complaint->message, format, arguments);
    return complaint;
}

bool report_error(Report *report, Place place, ExitCode code, const char *format, ...) {
    if (report->error_count++ >= KEPT_LIMIT) {
        return false;
    }
    va_list arguments;
    va_start(arguments, format);
    Complaint *complaint = complaint_create(report, place, format, arguments);
    va_end(arguments);
    complaint->code = code;
    complaint->number = report->error_count;
    complaint->older = report->errors;
    report->errors = complaint;
    return false;
}

void report_warning(Report *report, Place place, const char *format, ...) {
    if (report->warning_count >= KEPT_LIMIT) {
        return;
    }
    va_list arguments;
    va_start(arguments, format);
    Complaint *complaint = complaint_create(report, place, format, arguments);
    va_end(arguments);
    complaint->number = ++report->warning_count;
    complaint->older = report->warnings;
    report->warnings = complaint;
}

typedef struct Entry {
    const Complaint *complaint;
} Entry;

static int compare_entries(const void *a, const void *b) {
    const Complaint *p = ((const Entry *)a)->complaint, *q = ((const Entry *)b)->complaint;
    int p_order = p->place.source ? p->place.source->order : -1;
    int q_order = q->place.source ? q->place.source->order : -1;
    int keys[4][2] = {{p_order, q_order},
                      {p->place.line, q->place.line},
                      {p->place.column, q->place.column},
                      {p->number, q->number}};
    for (int i = 0; i < 4; i++) {
        if (keys[i][0] != keys[i][1]) {
            return keys[i][0] < keys[i][1] ? -1 : 1;
        }
    }
    return 0;
}

/* in file order; *count: how many */
static Entry *sorted(const Report *report, const Complaint *newest, int *count) {
    *count = 0;
    for (const Complaint *c = newest; c; c = c->older) {
        ++*count;
    }
    Entry *list = arena_push(report->arena, Entry, *count);
    int i = 0;
    for (const Complaint *c = newest; c; c = c->older) {
        list[i++].complaint = c;
    }
    qsort(list, (size_t)*count, sizeof(Entry), compare_entries);
    return list;
}

const char *report_where(const Report *report, Place place) {
    const char *path = place.source->path;
    size_t size = strlen(path) + 32;
    char *where = arena_alloc(report->arena, size);
    snprintf(where, size, "%s:%d:%d", path, place.line, place.column);
    return where;
}

/* where a line starts, or NULL behind the end */
static const char *find_line(const Source *source, int line) {
    const char *p = source->text, *end = p + source->bytes;
    for (int i = 1; i < line; i++) {
        p = memchr(p, '\n', (size_t)(end - p));
        if (!p) {
            return NULL;
        }
        p++;
    }
    return p;
}

static bool is_continuation(char c) { return ((unsigned char)c & 0xC0) == 0x80; }

/* bytes of the next `characters` characters of a line, less at its end */
static size_t span(const char *p, int characters) {
    size_t bytes = 0;
    for (; characters > 0 && p[bytes] && p[bytes] != '\n' && p[bytes] != '\r'; characters--) {
        do {
            bytes++;
        } while (is_continuation(p[bytes]));
    }
    return bytes;
}

/* of the character at p; 0 for control characters and what is not UTF-8 */
static size_t printable_bytes(const char *p) {
    unsigned char lead = (unsigned char)p[0];
    size_t bytes = lead < 0x80 ? 1 : lead < 0xC2 ? 0 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
    for (size_t i = 1; i < bytes; i++) {
        bytes = is_continuation(p[i]) ? bytes : 0;
    }
    return lead < 32 || lead == 127 || lead > 0xF4 ? 0 : bytes;
}

/* "\n  source line\n      ^", cut around the column */
static void print_excerpt(FILE *out, Place place) {
    const char *line = place.source ? find_line(place.source, place.line) : NULL;
    if (!line || place.column < 1) {
        return;
    }
    int before = place.column - 1 < EXCERPT_BEFORE ? place.column - 1 : EXCERPT_BEFORE;
    const char *start = line + span(line, place.column - 1 - before);
    size_t bytes = span(start, before + EXCERPT_AFTER);
    fprintf(out, "\n  ");
    for (size_t i = 0; i < bytes;) {
        size_t length = printable_bytes(start + i);
        fprintf(out, "%.*s", length ? (int)length : 1, length ? start + i : " ");
        i += length ? length : 1;
    }
    fprintf(out, "\n  %*s", before + 1, "^");
}

static void print_complaint(FILE *out, const Complaint *complaint, const char *severity) {
    Place place = complaint->place;
    if (place.source && place.line > 0) {
        fprintf(out, "%s:%d:%d: ", place.source->path, place.line, place.column);
    } else if (place.source) {
        fprintf(out, "%s: ", place.source->path);
    }
    fprintf(out, "%s: %s", severity, complaint->message);
}

/* the whole complaint with its excerpt, in the arena */
static char *complaint_text(const Report *report, const Complaint *complaint) {
    char *buffer = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&buffer, &bytes);
    ASSERT(out);
    print_complaint(out, complaint, "error");
    print_excerpt(out, complaint->place);
    fclose(out);
    char *text = arena_strdup(report->arena, buffer);
    free(buffer);
    return text;
}

bool report_finish(const Report *report, Error *error) {
    if (report->error_count == 0) {
        return true;
    }
    int count, shown = 0;
    Entry *list = sorted(report, report->errors, &count);
    char all[ERROR_TEXT_SIZE] = "", more[64] = "";
    size_t used = 0, reserve = sizeof more;
    for (; shown < count && shown < REPORT_LIMIT; shown++) {
        const char *text = complaint_text(report, list[shown].complaint);
        size_t bytes = strlen(text);
        if (shown > 0 && used + bytes + 2 + reserve > sizeof all) {
            break;
        }
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", shown ? "\n" : "", text);
        used = used < sizeof all ? used : sizeof all - 1;
    }
    if (report->error_count > shown) {
        snprintf(more, sizeof more, "\n... and %d more", report->error_count - shown);
    }
    return error_set(error, list[0].complaint->code, "%s%s", all, more);
}

const char *const *report_warnings(const Report *report) {
    int count;
    Entry *list = sorted(report, report->warnings, &count);
    const char **lines = arena_push(report->arena, const char *, count + 1);
    for (int i = 0; i < count; i++) {
        char *buffer = NULL;
        size_t bytes = 0;
        FILE *out = open_memstream(&buffer, &bytes);
        ASSERT(out);
        print_complaint(out, list[i].complaint, "warning");
        fclose(out);
        lines[i] = arena_strdup(report->arena, buffer);
        free(buffer);
    }
    return lines;
}

static const char *quote(Report *report, const char *text, size_t longest) {
    size_t bytes = strlen(text), kept = bytes;
    if (bytes > longest) {
        kept = longest - 3;
        while (kept > 0 && is_continuation(text[kept])) {
            kept--;
        }
    }
    char *copy = arena_push(report->arena, char, kept + 4);
    memcpy(copy, text, kept);
    for (size_t i = 0; i < kept; i++) {
        if ((unsigned char)copy[i] < 32 || copy[i] == 127) {
            copy[i] = ' ';
        }
    }
    strcpy(copy + kept, kept < bytes ? "..." : "");
    return copy;
}

const char *report_quote(Report *report, const char *text) {
    return quote(report, text, QUOTE_LONGEST);
}

const char *report_quote_long(Report *report, const char *text) {
    return quote(report, text, MESSAGE_SIZE / 2);
}
