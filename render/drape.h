/* drape.h: metrology of a drape test: a cloth over a support, as a drapemeter sees it and as the
 * geometry has it.
 *
 * Drape coefficient DC = 100 (A - A_d) / (A_s - A_d): A what the cloth and the support cover seen from
 * above, A_d the top of the support, A_s the flat cloth. Flat: 100. Values of other sizes of specimen
 * and support are not comparable [ISO 9073-9; Cusick 1965, J. Text. Inst. 56].
 *
 * Silhouette: 4 x 4 samples a pixel of R_s / 600, of the smooth surface, orthographic. Geometry: the
 * sum of the signed areas of its triangles, projected. Both are equal unless folds undercut.
 */
#ifndef TOILE_RENDER_DRAPE_H
#define TOILE_RENDER_DRAPE_H

#include "render/field.h"
#include "render/run.h"
#include "render/silhouette.h"

#define DRAPE_SLICES 3
#define DRAPE_PERCENTILES 5   /* 0 5 50 95 100 */
#define DRAPE_PROMINENCE 0.03 /* of R_s: a node is a fold that stands out by as much */
#define DRAPE_CUT 0.25        /* of R_s: billows are counted so far below the support's top */
#define DRAPE_BILLOW_PROMINENCE 0.07 /* of R_s: how far they stand out */
#define DRAPE_MOST_BILLOWS 64
#define DRAPE_REST 1e-7 /* kinetic energy over weight and R_s that counts as rest */

typedef struct DrapeDef {
    const char *cloth;       /* name; NULL: the first one */
    double disc;             /* [m] radius of the support; NAN: of the obstacle below the cloth */
    double centre[2];        /* [m]; NAN: its axis */
    double camera_height;    /* [m] of the camera above the support; INFINITY */
    double camera_offset[2]; /* [m] of the camera from the support's middle; 0 0 */
    double cut;        /* [m] below the support's top, where billows are counted; NAN: DRAPE_CUT */
    double prominence; /* [m] by which they stand out; NAN: DRAPE_BILLOW_PROMINENCE */
} DrapeDef;

DrapeDef drape_default(void);

/* What the cloth hangs on. */
typedef struct DrapeSupport {
    char name[STATE_WORD_SIZE]; /* of the obstacle; "" */
    double centre[2], plane;    /* [m] the middle of its top and its height */
    double radius;              /* [m] of a disc of the same area; NAN: there is none */
    double *outline;            /* [m] (count x 2) of its top */
    int count;
} DrapeSupport;

/* Horizontal cut so far below the top of the support. */
typedef struct DrapeSlice {
    double depth;           /* [m] */
    double mean, low, high; /* [m] radius; NAN where no ray meets the cloth */
    int nodes, missed;      /* rays that meet nothing */
} DrapeSlice;

/* What stands off the support in a cut. */
typedef struct Billow {
    double angle;      /* [rad] of its peak, from warp, seen from the middle of the support */
    double off;        /* [m] of its peak from the support's outline */
    double prominence; /* [m] as contour_find_peaks has it, of the distance from that outline */
    int corner;        /* of a box, in the order of the support's outline; else -1 */
} Billow;

/* The curve in which the plane z = top - depth meets the cloth, folds that undercut and open ends at
 * the rim included. */
typedef struct DrapeCut {
    double depth, prominence; /* [m] */
    int count;
    Billow billows[DRAPE_MOST_BILLOWS]; /* by angle; none where the plane misses the cloth */
    int corners;                        /* 4 of a box, 0 */
    int at_corner[4];                   /* billows at each */
    double skew[4]; /* how much of what stands off at a corner, as far as the middle sees it, has
                           no mirror image about its diagonal, 0..1; NAN: nothing stands off */
    double skew_common; /* the same of the mean over the corners, mirrored into one: what is the
                           fabric's doing and not chance */
} DrapeCut;

typedef struct Drape {
    char cloth[STATE_WORD_SIZE], fabric[STATE_WORD_SIZE];
    int frame;
    double time; /* [s] */
    DrapeSupport support;
    double specimen;                 /* [m] R_s: radius of a disc with the area of the flat cloth */
    double warp;                     /* [rad] direction of warp seen from above */
    double area_specimen, area_disc; /* [m2] */
    double area, area_signed;        /* [m2] silhouette, geometry */
    double dc, dc_geometry, undercut; /* [%, points] NAN without a support */
    Contour contour;                  /* theta = 0 is warp */
    Harmonics harmonics;
    Nodes nodes;                        /* at DRAPE_PROMINENCE */
    int nodes_most, nodes_least;        /* at 2 % and 4.5 % */
    double node_spacing_cv;             /* scatter of the angles between nodes over their mean */
    double ddr, fold_index;             /* [%] drape-distance ratio, fold depth index */
    double circularity;                 /* 4 pi A / P^2 of the contour */
    double fold_depth;                  /* [m] mean of the nodes */
    double rim_mean, rim_low, rim_high; /* [m] height of the rim over the top of the support */
    double rim_fold_depth;              /* [m] the same of the height along the rim */
    int rim_nodes;
    DrapeSlice slices[DRAPE_SLICES];
    DrapeCut cut;
    double asymmetry[2];    /* of the contour in warp and weft, in the diagonals between: means of
                            contour_asymmetry */
    double lowest, highest; /* [m] of the cloth */
    double rim_stretch, area_strain;     /* 0 at rest */
    double kinetic;                      /* kinetic energy over weight and R_s, at 9.81 m/s2 */
    double strain[3][DRAPE_PERCENTILES]; /* warp, weft, shear [rad] */
} Drape;

/* Measures frame `index`. What it allocates lives in arena. Errors: EXIT_BAD_INPUT, EXIT_USAGE (no
 * such cloth), as state_read_frame. */
bool drape_measure(Run *run, const DrapeDef *def, int index, Arena *arena, Drape *drape,
                   Error *error);

/* [s] from when on the cloth is at rest (DRAPE_REST) in all frames; NAN: it is not at the end. */
bool drape_find_settling(Run *run, const DrapeDef *def, double *time, Error *error);

/* A frame that is looked at from several cameras: its smooth surface is made once. */
typedef struct DrapeView DrapeView;

/* Sizes and places of the drape; numbers that come from a silhouette are not filled in. What it
 * allocates lives in arena until the view is closed. NULL: error, as drape_measure. */
DrapeView *drape_view_open(Run *run, const DrapeDef *def, int index, Arena *arena, Drape *drape,
                           Error *error);
/* What this camera sees. `pixel` [m]; NAN: R_s / 600. False: the cloth is far from the support. */
bool drape_view_cover(DrapeView *view, const DrapeDef *camera, double pixel, Drape *drape,
                      Coverage *coverage);
void drape_view_close(DrapeView *view);

/* The sentence that is to be read with it, "" if none: off-centre, stretched, undercut. */
const char *drape_warning(const Drape *drape, char *text, size_t size);

#endif
