/* silhouette.h: what a surface covers seen from straight above, by 4 x 4 samples a pixel.
 *
 * A camera at height H above the plane z = plane sees a point of height z at (x, y) times
 * H / (H + plane - z) around what is below the camera: parts below the plane shrink. H = INFINITY: orthographic.
 */
#ifndef TOILE_RENDER_SILHOUETTE_H
#define TOILE_RENDER_SILHOUETTE_H

#include "render/contour.h"
#include "render/resample.h"

#define SILHOUETTE_SAMPLES 4 /* along the side of a pixel */

typedef struct SilhouetteDef {
    double centre[2];     /* [m] the middle of the picture */
    double camera[2];     /* [m] below the camera */
    double plane;         /* [m] z at which the scale is 1 */
    double camera_height; /* [m] above it; INFINITY */
    double pixel;         /* [m] */
    double reach;         /* [m] half the side of the picture */
} SilhouetteDef;

typedef struct Silhouette {
    SilhouetteDef def;
    int side;              /* samples along a side */
    unsigned char *sample; /* (side x side) 0 or 1 */
} Silhouette;

Silhouette silhouette_create(const SilhouetteDef *def);
void silhouette_free(Silhouette *silhouette);

/* Triangles of one cloth. */
void silhouette_add_surface(Silhouette *silhouette, const Surface *surface,
                            const SurfacePart *part);
/* A convex polygon at the height of the plane: points [m] (count x 2). */
void silhouette_add_polygon(Silhouette *silhouette, const double *points, int count);

double silhouette_area(const Silhouette *silhouette); /* [m2] */
Coverage silhouette_cover(const Silhouette *silhouette);

#endif
