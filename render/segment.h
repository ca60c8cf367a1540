/* segment.h: where the cloth is in a photograph from above.
 *
 * 1. The light of the background is fitted to a border of the picture, per channel: a quadratic in x and
 *    y of the logarithm, twice without outliers. The picture over it, as a logarithm, is 0 where
 *    nothing lies: uneven light is gone.
 * 2. Four features are tried: colour without brightness (which a shadow does not change), brighter,
 *    darker, any difference. Otsu's threshold [Otsu 1979, IEEE Trans. SMC 9] parts each; the first one
 *    whose parts stand apart and whose piece around the seed is neither tiny nor cut off is taken.
 * 3. Close 3 px, fill holes, keep the piece around the seed.
 * 4. Along each ray from the seed the outline is put where the picture, in linear light, is half way
 *    between what lies inside and outside of it there.
 *
 * The picture is refused when the share of the piece changes by more than SEGMENT_UNSURE as the
 * threshold moves by a tenth either way.
 */
#ifndef TOILE_RENDER_SEGMENT_H
#define TOILE_RENDER_SEGMENT_H

#include "render/contour.h"
#include "render/image.h"

#define SEGMENT_UNSURE 0.04 /* of the area */

typedef struct SegmentDef {
    double threshold;  /* of the feature; NAN: Otsu's */
    const Image *mask; /* brighter than half is cloth, nothing is guessed; NULL */
    double x, y;       /* [px] from the upper left, somewhere in the middle of the cloth */
} SegmentDef;

typedef struct Segment {
    int width, height;
    uint8_t *inside;     /* (height x width) 0 or 1, owned */
    const char *feature; /* that told cloth from background: "colour", "brighter", ... "mask" */
    double threshold;    /* of it */
    double area;         /* [px2] of the piece */
    double change;       /* of the area, when the threshold moves by 10 % */
} Segment;

/* Errors: EXIT_BAD_INPUT with what stands in the way. */
bool segment_photo(const Image *image, const SegmentDef *def, Segment *segment, Error *error);
void segment_free(Segment *segment);

/* r [px] along rays from (x, y), anticlockwise as seen, the first one to the right. */
Contour segment_trace(const Image *image, const Segment *segment, double x, double y);

/* The plate on the cloth, when there is one that stands out in colour: a circle inside the piece. */
typedef struct SegmentDisc {
    double x, y, radius; /* [px] */
    double ratio;        /* long over short axis: a tilted camera sees an ellipse */
} SegmentDisc;

/* Hough transform of the edges inside the piece; false when no circle stands out. */
bool segment_find_disc(const Image *image, const Segment *segment, SegmentDisc *disc);

/* Linear light of a channel, and the curve back. */
float segment_linear(uint8_t value);

#endif
