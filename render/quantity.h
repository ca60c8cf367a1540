/* quantity.h: what measuring looks show: numbers of the cloth at its surface vertices.
 *
 * Strain and curvature are those of render/field.h, as `export` writes them; speed is |v| of the
 * surface. A range is fixed, or found once for a whole run, so that a colour means the same in
 * every frame.
 */
#ifndef TOILE_RENDER_QUANTITY_H
#define TOILE_RENDER_QUANTITY_H

#include "render/colormap.h"
#include "render/run.h"

typedef enum QuantityKind {
    QUANTITY_NONE,
    QUANTITY_STRAIN_WARP,
    QUANTITY_STRAIN_WEFT,
    QUANTITY_SHEAR,
    QUANTITY_CURVATURE, /* mean of both principal ones, positive towards the face */
    QUANTITY_SPEED,
    QUANTITY_ERROR,   /* of the strain: field.h */
    QUANTITY_CONTACT, /* force of contacts over the area of cloth at rest around a vertex [Pa] */
    QUANTITY_COUNT
} QuantityKind;

typedef struct Quantity {
    const char *title, *unit; /* of the legend */
    double scale;             /* units of the legend in an SI unit */
    const ColorMap *map;      /* diverging: the range lies evenly around 0 */
} Quantity;

extern const Quantity quantities[QUANTITY_COUNT];

typedef struct QuantityRange {
    double low, high; /* SI */
} QuantityRange;

/* Whether the frame holds what the quantity is made of. Error: EXIT_BAD_INPUT. */
bool quantity_is_kept(QuantityKind kind, const StateFrame *frame, Error *error);

/* Values [SI] (vertices of that cloth) in this frame; scratch is left as it was. */
void quantity_compute(QuantityKind kind, const StateLayout *layout, const StateFrame *frame,
                      int cloth, Arena *scratch, double *values);

/* The range of one quantity over all frames that the run has now and the cloths whose entry in
 * kinds (cloth_count) names it: what holds 99 % of the vertices of every frame where it is not 0,
 * widened to round numbers. Errors: as state_read_frame and quantity_is_kept. */
bool quantity_find_range(QuantityKind kind, Run *run, const QuantityKind *kinds,
                         QuantityRange *range, Error *error);

/* The next number whose quarters are short: 1, 1.2, 1.6, 2, 2.4, 3, 4, 5, 6, 8 times a power of ten; 1
 * for 0 and less. */
double quantity_round_up(double number);

#endif
