/* drape_report.h: a drape as text, JSON, CSV and as a plot. */
#ifndef TOILE_RENDER_DRAPE_REPORT_H
#define TOILE_RENDER_DRAPE_REPORT_H

#include <stdio.h>

#include "render/drape.h"

/* settling: [s] from when on the cloth rests, or NAN. */
void drape_print_text(const Drape *drape, double settling, FILE *out);
/* No newline at the end. */
void drape_print_json(const Drape *drape, double settling, FILE *out);

/* One line a frame. */
void drape_print_csv_head(FILE *out);
void drape_print_csv(const Drape *drape, FILE *out);

/* theta_deg, r_m at whole degrees; n, amplitude_m, phase_deg, share. */
void drape_print_contour(const Drape *drape, FILE *out);
void drape_print_harmonics(const Drape *drape, FILE *out);

/* Contour and spectrum of up to DRAPE_PLOT_MOST drapes on one sheet, .svg or .png by the ending of
 * the path. names: of each. Errors: EXIT_USAGE (another ending), EXIT_IO. */
#define DRAPE_PLOT_MOST 16
bool drape_plot(const Drape *drapes, const char *const *names, int count, const char *path,
                Error *error);

/* ---- several runs of one test ---- */

typedef struct Ensemble {
    int count;
    double mean, deviation, half_interval; /* of DC [%]; 95 % by Student's t */
    int modes[CONTOUR_MOST_NODES + 1];     /* how many runs have so many nodes */
    int mode;       /* the most frequent number of nodes; the lower one of two */
    double dc_mode; /* [%] mean DC of the runs that have it */
} Ensemble;

Ensemble ensemble_find(const Drape *drapes, int count);
void ensemble_print_text(const Ensemble *ensemble, FILE *out);
void ensemble_print_json(const Ensemble *ensemble, FILE *out);

#endif
