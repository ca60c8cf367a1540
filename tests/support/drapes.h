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
    double box; /* [m] half side of a box along x and y that is the table instead; 0: none */
    const char *look;
    const char *plate;      /* look of a plate on the cloth, as large as the table; NULL */
    double camera_height;   /* [m] over the cloth on the table; INFINITY */
    double camera_shift[2]; /* [m] of the camera from the middle of the table */
    double tilt;            /* [rad] of its view from straight down, towards y */
    double half_view;       /* [m] half the height of the picture at the table */
    int pixels;             /* height of the picture, from infinity */
} DrapeShape;

/* 30 cm on 18 cm, a rim of 12 cm in 6 folds of 1 cm, 30 rings, linen; seen from infinity. */
DrapeShape drape_shape_default(void);

double drape_shape_radius(const DrapeShape *shape, double theta); /* [m] of the rim */
/* [m] of the cut so far below the top of the table; NAN: the rim is above it */
double drape_shape_cut(const DrapeShape *shape, double theta, double depth);
double drape_shape_dc(const DrapeShape *shape); /* [%] exact */

/* Two frames: flat above the table, with the velocity of a fall, and draped, at rest. */
bool drape_shape_write(const DrapeShape *shape, const char *path);

#endif
