#include "sim/base/progress.h"
#include "sim/base/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PLAIN_INTERVAL 10.0   /* [s] between plain lines */
#define TERMINAL_INTERVAL 0.1 /* [s] between redraws */
#define BAR_WIDTH 30

Progress progress_start(const char *stage, ProgressKind kind, int first, int total) {
    const char *term = getenv("TERM");
    bool terminal = isatty(STDERR_FILENO) && term && strcmp(term, "dumb") != 0;
    double start = clock_seconds();
    return (Progress){.stage = stage,
                      .kind = kind,
                      .total = total,
                      .first = first,
                      .start = start,
                      .last = start,
                      .terminal = terminal};
}

static void show_bar(const Progress *p, int done, double rate, double left, const char *detail) {
    int filled = p->total > 0 ? (int)((double)BAR_WIDTH * done / p->total) : 0;
    char bar[BAR_WIDTH + 1];
    memset(bar, '-', BAR_WIDTH);
    memset(bar, '#', (size_t)filled);
    bar[BAR_WIDTH] = 0;
    fprintf(stderr, "\r%-6s [%s] %d/%d  %.1f/s  %.0f s left  %s\033[K", p->stage, bar, done,
            p->total, rate, left, detail);
}

void progress_show(Progress *p, int done, const char *detail) {
    double time = clock_seconds(), since = time - p->last;
    bool last = done >= p->total;
    double rate = (done - p->first) / (time - p->start + 1e-9);
    double left = rate > 0.0 ? (p->total - done) / rate : 0.0;
    if (p->kind == PROGRESS_NONE) {
        return;
    }
    if (p->kind == PROGRESS_JSON) {
        fprintf(stderr,
                "{\"stage\": \"%s\", \"frame\": %d, \"frames\": %d, \"rate\": %.4g, "
                "\"eta_s\": %.4g}\n",
                p->stage, done, p->total, rate, left);
        return;
    }
    if (since < (p->terminal ? TERMINAL_INTERVAL : PLAIN_INTERVAL) && !last) {
        return;
    }
    p->last = time;
    if (p->terminal) {
        show_bar(p, done, rate, left, detail);
    } else {
        fprintf(stderr, "%s: frame %d of %d, %.1f frames/s, %.0f s left  %s\n", p->stage, done,
                p->total, rate, left, detail);
    }
}

void progress_end(Progress *p) {
    if (p->kind == PROGRESS_AUTO && p->terminal) {
        fprintf(stderr, "\n");
    }
}

bool progress_parse(const char *word, ProgressKind *kind) {
    static const char *const words[] = {"auto", "json", "none"};
    for (int i = 0; i < 3; i++) {
        if (strcmp(word, words[i]) == 0) {
            *kind = (ProgressKind)i;
            return true;
        }
    }
    return false;
}
