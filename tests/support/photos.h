/* photos.h: photographs of drapes that nobody took: painted from outlines that are known. */
#ifndef TOILE_TESTS_PHOTOS_H
#define TOILE_TESTS_PHOTOS_H

#include "render/image.h"
#include "tests/support/drapes.h"

typedef enum PhotoGround { GROUND_PLAIN, GROUND_STRIPES, GROUND_WOVEN } PhotoGround;

typedef struct PhotoDef {
    int width, height;                    /* [px] */
    double scale;                         /* [px/m] at the table */
    double x, y;                          /* [px] middle of the table, from the upper left */
    double turn;                          /* [rad] of the drape, anticlockwise */
    bool mirrored;                        /* turned first, then seen from the other side */
    double camera_height;                 /* [m]; INFINITY */
    double cloth[3], ground[3], plate[3]; /* linear light, 0..1 */
    bool plated;
    PhotoGround pattern;
    double relief;   /* how much brighter and darker folds are; 0.2 */
    double gradient; /* brightness from left to right: 1 -+ half of it */
    double vignette; /* darkness of the corners */
    double shadow;   /* darkness of a soft round shadow beside the cloth; 0 */
    double noise;    /* of 255, standard deviation */
    double blur;     /* [px] standard deviation */
    unsigned seed;
} PhotoDef;

PhotoDef photo_default(void); /* 560 x 560, all of a 30 cm cloth, plate, no flaw */

/* The outline [m] seen from there, theta from the right of the picture, anticlockwise. */
double photo_outline(const DrapeShape *shape, const PhotoDef *def, double theta);

Image photo_paint(const DrapeShape *shape, const PhotoDef *def);

#endif
