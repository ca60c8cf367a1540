/* compare.h: a photograph of a real drape, from above, against a run.
 *
 * The photograph is not straightened: the run is seen with its camera, which stands `camera_height`
 * above the support, straight above the middle of the picture. A rim d below the support shrinks by
 * H / (H + d). All lengths are those in the plane of the top of the support.
 */
#ifndef TOILE_RENDER_COMPARE_H
#define TOILE_RENDER_COMPARE_H

#include "render/drape.h"
#include "render/segment.h"

#define COMPARE_TILTED 1.02 /* ratio of the plate's axes from which on the camera is tilted */

#define COMPARE_MOST_POINTS 64

typedef struct CompareDef {
    DrapeDef drape;          /* camera_height included */
    const char *run, *photo; /* paths */
    int frame;               /* of the run; -1: the last */
    double disc[3];   /* [px] x, y, diameter of the support in the photograph; NAN: looked for */
    double scale;     /* [px/m] with `centre`, instead of `disc`; NAN */
    double centre[2]; /* [px] of the support in the photograph */
    const char *mask; /* path of a picture that is white where the cloth is; NULL */
    double threshold; /* of the feature that tells cloth from background; NAN */
    bool face_only;   /* do not try the mirror image */
    /* A photograph from the side: the camera is found from points, NAME=X,Y [px] */
    bool fit_camera;
    const char *points[COMPARE_MOST_POINTS];
    int point_count;
} CompareDef;

CompareDef compare_default(void);

typedef struct CompareSide {
    double r[CONTOUR_RAYS]; /* [m] theta from the right of the photograph, anticlockwise as seen */
    double dc;              /* [%] as this camera sees it */
    Harmonics harmonics;
    Nodes nodes;
    int nodes_most, nodes_least;
} CompareSide;

typedef struct Compare {
    Drape drape;   /* of the run: cloth, support, sizes */
    Image image;   /* the photograph, upright, as it was measured; owned */
    double shrunk; /* sides of the file over those of `image` */
    Segment segment;
    SegmentDisc disc;        /* [px of `image`] the support */
    double pixels_per_metre; /* of `image` */
    CompareSide photo, run;
    double rotation; /* [rad] from warp to the right of the photograph: theta = theta_run + it */
    bool mirrored;   /* theta = -theta_run + rotation: the other face is up */
    double correlation, correlation_other; /* of the outlines, this way and mirrored */
    double dc_orthographic;                /* [%] of the run as a drapemeter sees it */
    double dc_near; /* [%] of the run from 1 m, when the height of the camera is not known */
    double rms, mean, hausdorff, hausdorff95; /* [m] distances of the outlines; rms: along rays */
    double iou;
    double node_angle;       /* [rad] mean distance of matched nodes; NAN: other numbers */
    double camera_offset[2]; /* [m] of the camera from the middle of the support, axes of the run */
} Compare;

/* Reads the photograph and the mask, if there is one, with sides of at most `longest` pixels. *shrunk: sides of the
 * file over those of the image. */
bool compare_read_photo(const CompareDef *def, int longest, Image *image, double *shrunk,
                        Image *mask, Error *error);

/* Measures the photograph and the run. Errors: EXIT_BAD_INPUT (a photograph that cannot be measured, a tilted camera), EXIT_USAGE (no
 * scale), EXIT_MISSING_INPUT. Free also after a failure. */
bool compare_photo(const CompareDef *def, Compare *compare, Error *error);
void compare_free(Compare *compare);

/* ---- reports ---- */

/* A frame of the run as a film with this camera shows it; image: of the size that is wanted, even. */
bool compare_draw_run(const char *path, const Film *film, int frame, int threads, Image *image,
                      Error *error);
/* Three pictures beside each other, as large as the smallest. */
Image compare_join(const Image *const parts[3]);

void compare_print_text(const Compare *compare, FILE *out);
void compare_print_json(const Compare *compare, FILE *out);
void compare_print_contours(const Compare *compare, FILE *out); /* CSV */

/* The photograph with both outlines; where only one is: shaded. */
Image compare_draw_overlay(const Compare *compare);
/* Photograph, run from the same viewpoint, overlay. `threads` of the rasteriser. */
bool compare_draw_strip(const CompareDef *def, const Compare *compare, int threads, Image *strip,
                        Error *error);

#endif
