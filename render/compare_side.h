/* compare_side.h: a photograph of a real drape from any side, against a run.
 *
 * The camera is found from points of the scene that can be told in the picture (camera_fit.h); the run is
 * seen with it, and what the cloth covers is compared. Nothing is shifted or turned to fit: where the cloth
 * lies on its support is part of the comparison. Distances are in the plane across the view at the mean
 * depth of the cloth that is seen.
 */
#ifndef TOILE_RENDER_COMPARE_SIDE_H
#define TOILE_RENDER_COMPARE_SIDE_H

#include "render/compare.h"
#include "render/side_view.h"

typedef struct CompareFromSide {
    CameraPoint points[CAMERA_FIT_MOST]; /* [px] of the file */
    int point_count, frame;
    CameraFit fit; /* lengths in pixels: of `image` */
    Film film;     /* the run's, with this camera */
    Image image;   /* the photograph, upright, as it was measured; owned */
    double shrunk; /* sides of the file over those of `image` */
    Segment segment;
    float *photo, *run; /* (height x width) covers, owned */
    double depth;       /* [m] */
    double pixel;       /* [m] of `image`, at that depth */
    SideNumbers numbers;
} CompareFromSide;

/* Errors: EXIT_BAD_INPUT (points, a photograph that cannot be measured, cloth out of sight), EXIT_USAGE (a point
 * that is not known), EXIT_MISSING_INPUT. Free also after a failure. */
bool compare_from_side(const CompareDef *def, CompareFromSide *compare, Error *error);
void compare_from_side_free(CompareFromSide *compare);

/* The place in the scene that a point is called by: X,Y,Z in metres; NAME.middle, NAME.start, NAME.end of an obstacle;
 * NAME.+-+ a corner of a box, by the signs of x, y, z in its own frame. */
bool compare_find_place(const StateHeader *header, const StateFrame *frame, const char *name,
                        Vec3 *place, Error *error);

void compare_side_print_text(const CompareFromSide *compare, FILE *out);
void compare_side_print_json(const CompareFromSide *compare, FILE *out);

/* The photograph with both outlines, the points and where the camera sees them; where only one is: shaded. */
Image compare_side_draw_overlay(const CompareFromSide *compare);
/* Photograph, run from the same viewpoint, overlay. */
bool compare_side_draw_strip(const CompareDef *def, const CompareFromSide *compare, int threads,
                             Image *strip, Error *error);

#endif
