/* drapes.h: states of drapes whose outline seen from above is known: a round cloth on a round table, flat
 * on it, straight lines from its edge to the rim r(theta), whose length is that of the cloth. */
#ifndef TOILE_TESTS_DRAPES_H
#define TOILE_TESTS_DRAPES_H

#include <stdbool.h>

#define DRAPE_SHAPE_TERMS 17

typedef struct DrapeShape {
    double specimen, support;    /* [m] radii of cloth and table */
    double a[DRAPE_SHAPE_TERMS]; /* [m] rim: a[0] + sum a[n] cos(n theta) + b[n] sin(n theta) */
    double b[DRAPE_SHAPE_TERMS];
    double warp;         /* [rad] the cloth turned on the table: theta counts from here */
    double table_height; /* [m] */
    double centre[2];    /* [m] of table and cloth */
    int rings;           /* of vertices */
    const char *look;
} DrapeShape;

/* 30 cm on 18 cm, a rim of 12 cm in 6 folds of 1 cm, 30 rings, linen. */
DrapeShape drape_shape_default(void);

double drape_shape_radius(const DrapeShape *shape, double theta); /* [m] of the rim */
double drape_shape_dc(const DrapeShape *shape);                   /* [%] exact */

/* Two frames: flat above the table, with the velocity of a fall, and draped, at rest. */
bool drape_shape_write(const DrapeShape *shape, const char *path);

#endif
