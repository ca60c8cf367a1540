/* report.h: everything that is wrong with the files of one reading, in file order.
 *
 * A reader goes on after an error as long as that makes sense, so that one run shows up to
 * REPORT_LIMIT of them. Every complaint has the form
 *
 *     scene.yaml:14:11: error: 'drga' is not a key of 'air'; did you mean 'drag'?
 *       air: {drga: 0.02 kg/(m2 s)}
 *             ^
 *
 * Lines and columns count from 1, columns in characters. All memory is the arena's.
 */
#ifndef TOILE_SCENE_REPORT_H
#define TOILE_SCENE_REPORT_H

#include <stdbool.h>
#include <stddef.h>

#include "sim/base/arena.h"
#include "sim/base/error.h"

#define REPORT_LIMIT 10 /* errors printed a run; more would scroll the first one away */

/* The text of one file that was read. */
typedef struct Source {
    const char *path; /* as the user would write it */
    const char *text; /* (bytes + 1), zero-terminated */
    size_t bytes;
    int order;                   /* files are numbered as they are opened */
    const struct Source *parent; /* the file that names this one; NULL for the first */
} Source;

/* A place in a source; source NULL: nowhere in particular. */
typedef struct Place {
    const Source *source;
    int line, column; /* from 1 */
} Place;

typedef struct Complaint Complaint;

typedef struct Report {
    Arena *arena;
    int error_count, warning_count;
    Complaint *errors, *warnings; /* newest first */
} Report;

/* "FILE:LINE:COLUMN", for messages of later stages. */
const char *report_where(const Report *report, Place place);

/* `code` is EXIT_BAD_INPUT, EXIT_MISSING_INPUT or EXIT_IO. Returns false, always. */
bool report_error(Report *report, Place place, ExitCode code, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Something that is allowed but hardly meant. One line, no source text. */
void report_warning(Report *report, Place place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* True when there was no error; else fills `error` with the first REPORT_LIMIT of them. */
bool report_finish(const Report *report, Error *error);

/* The warnings in file order (report->warning_count), "file:line:column: warning: ...". */
const char *const *report_warnings(const Report *report);

/* Text that is safe to print in quotes: control characters replaced, long words cut. */
const char *report_quote(Report *report, const char *text);
const char *report_quote_long(Report *report, const char *text); /* a phrase, cut much later */

#endif
