/* side_view.h: what any camera sees of cloth among obstacles, as the part of each pixel that is covered, and the
 * distance between two such pictures' outlines.
 *
 * A depth buffer of SIDE_SAMPLES x SIDE_SAMPLES samples a pixel: cloth hides obstacles and is hidden by them.
 */
#ifndef TOILE_RENDER_SIDE_VIEW_H
#define TOILE_RENDER_SIDE_VIEW_H

#include "render/camera_fit.h"
#include "render/segment.h"

#define SIDE_SAMPLES 3 /* along the side of a pixel */

typedef struct SideView {
    Camera camera;
    int width, height; /* [px] */
    float *depth;      /* [m] along the view (samples), owned; INFINITY: nothing */
    uint8_t *cloth;    /* (samples) 1: cloth is nearest, owned */
    bool behind;       /* a triangle reached behind the camera and was left out */
} SideView;

SideView side_view_create(const Camera *camera, int width, int height);
void side_view_free(SideView *view);
void side_view_add(SideView *view, const Vec3 corners[3], bool cloth);

/* (height x width) 0..1, for the caller to free; *depth: [m] mean of the cloth that is seen, NAN: none is. */
float *side_view_cover(const SideView *view, double *depth);

/* Cuts the cloth out of a photograph by its colours, which are learned where a guess (a cover of the same size) is
 * sure of cloth or background, then where the cut is. No guess at the outline itself: what lies within a margin of it counts
 * by its colour alone. Errors: as segment_photo; the cloth looks like what lies beside it. */
bool side_cut_photo(const Image *image, const float *guess, const SegmentDef *def, Segment *segment,
                    Error *error);

/* The same of a photograph whose cloth is cut out: pixels along the outline are shared by where their light lies
 * between that of the cloth and of the background beside them. */
float *side_photo_cover(const Image *image, const Segment *segment);

typedef struct SideNumbers {
    double iou;                          /* common part over both */
    double area[2];                      /* [px2] first, second */
    double mean, hausdorff95, hausdorff; /* [px] of the outlines, both ways */
} SideNumbers;

/* Compares two covers. False: one of them is empty. */
bool side_compare(const float *first, const float *second, int width, int height,
                  SideNumbers *numbers);

#endif
