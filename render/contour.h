/* contour.h: the outline of a drape as a function r(theta), its harmonics, its nodes (folds).
 *
 * Angles run anticlockwise seen from above, from the warp (u). Samples are CONTOUR_RAYS equal steps.
 */
#ifndef TOILE_RENDER_CONTOUR_H
#define TOILE_RENDER_CONTOUR_H

#include <stdbool.h>

#define CONTOUR_RAYS 720
#define CONTOUR_HARMONICS 24      /* of the spectrum */
#define CONTOUR_NODE_HARMONICS 16 /* of the curve whose nodes are counted */
#define CONTOUR_MOST_NODES 64

/* How much of each pixel is covered, seen from above. */
typedef struct Coverage {
    int width, height;
    double pixel;  /* [m] */
    double x0, y0; /* [m] of the lower left corner; rows go up */
    float *part;   /* 0..1 (height x width), owned */
} Coverage;

typedef struct Contour {
    double r[CONTOUR_RAYS]; /* [m] the outermost crossing of one half */
    int multivalued;        /* rays with several crossings */
    int missed;             /* rays without any */
} Contour;

/* The rays from (x, y) [m] out; the first one points to `start` [rad]. */
Contour contour_trace(const Coverage *coverage, double x, double y, double start);

/* Raises r (CONTOUR_RAYS, from `start` [rad] on) of the rays that the segment from p to q meets. */
void contour_add_segment(double *r, double start, const double p[2], const double q[2]);

typedef struct Harmonics {
    double mean;                             /* of r */
    double a[CONTOUR_HARMONICS + 1];         /* (1 / pi) times the integral of r cos(n theta) */
    double b[CONTOUR_HARMONICS + 1];         /* the same with the sine */
    double amplitude[CONTOUR_HARMONICS + 1]; /* from 1 */
    double phase[CONTOUR_HARMONICS + 1];     /* [rad] where the first peak is, times n */
    double share[CONTOUR_HARMONICS + 1];     /* of the squared amplitudes */
    int dominant;
} Harmonics;

/* count samples of any closed curve. */
Harmonics harmonics_find(const double *r, int count);

/* The curve of harmonics 1 to `most`, CONTOUR_RAYS samples. */
void harmonics_draw(const Harmonics *harmonics, int most, double *r);

typedef struct Nodes {
    int count;
    double angle[CONTOUR_MOST_NODES];                           /* [rad] of the peaks, rising */
    double peak[CONTOUR_MOST_NODES], depth[CONTOUR_MOST_NODES]; /* depth: over the mean of the two
                                                                   lowest places beside it */
} Nodes;

typedef struct Peak {
    int at;
    /* peak minus the higher of the lowest values met on either side before higher ground; of the
     * highest one: minus the lowest of all */
    double prominence;
} Peak;

/* Maxima of `count` samples, of a ring (closed) or of a row whose ends hide nothing, that stand out by
 * at least `prominence`; the first `most`. Returns how many. */
int contour_find_peaks(const double *value, int count, bool closed, double prominence, Peak *peaks,
                       int most);

/* Peaks of the ring r (CONTOUR_RAYS). */
Nodes contour_find_nodes(const double *r, double prominence);

/* Share of the squared harmonics that is odd about the direction `axis` [rad]: 0 for a curve that is
 * its own mirror image, 1 for one that the mirror turns round; NAN for a circle. */
double contour_asymmetry(const Harmonics *harmonics, double axis);

double contour_area(const double *r);      /* [m2] enclosed, between rays straight */
double contour_perimeter(const double *r); /* [m] */

void coverage_free(Coverage *coverage);

#endif
