/* progress.h: how a long work goes on, on stderr: a bar with rate and time left on a terminal,
 * a plain line every ten seconds otherwise, or one JSON object a frame. */
#ifndef TOILE_BASE_PROGRESS_H
#define TOILE_BASE_PROGRESS_H

#include <stdbool.h>

typedef enum ProgressKind { PROGRESS_AUTO, PROGRESS_JSON, PROGRESS_NONE } ProgressKind;

typedef struct Progress {
    const char *stage; /* "sim", "render" */
    ProgressKind kind;
    int total;          /* frames */
    int first;          /* frames that were there before */
    double start, last; /* [s] clock */
    bool terminal;
} Progress;

Progress progress_start(const char *stage, ProgressKind kind, int first, int total);
/* `detail`: a few words more, or "". */
void progress_show(Progress *progress, int done, const char *detail);
void progress_end(Progress *progress);

/* Reads "auto", "json", "none". */
bool progress_parse(const char *word, ProgressKind *kind);

#endif
