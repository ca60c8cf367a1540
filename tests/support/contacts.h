/* contacts.h: what every kind of contact on the explicit road must pass: friction with known answers, solids
 * to throw cloth at, a sheet that falls on its edge. `solver`: the line of the scene. */
#ifndef TOILE_TESTS_CONTACTS_H
#define TOILE_TESTS_CONTACTS_H

#define CONTACTS_FABRIC                                                                            \
    "fabric: {weight: 150 g/m2, thickness: 1 mm, stretch: {warp: 1000 N/m, weft: 1000 N/m, "       \
    "poisson: 0.3}, shear: 385 N/m, bending: {warp: 10 uN m, weft: 10 uN m}, friction: 0.3}\n"

/* 60 cm, dropped on its edge from 1 cm; without solver */
#define CONTACTS_FOLDED                                                                            \
    "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  sheet:\n"                                   \
    "    shape: {rectangle: {width: 60 cm, height: 60 cm}}\n    " CONTACTS_FABRIC                  \
    "    nodes: 21 x 21\n    at: [0, 0, 31 cm]\n    turn: {axis: x, by: 90 deg}\n"                 \
    "    noise: 1 mm\n    bending_damping: 0 s\n    membrane_damping: 0 s\nobstacles:\n  floor: "  \
    "{plane: {}, friction: 0.3}\n"

/* A sheet on a plane with mu = 0.3 sticks at 0.99 of the limit, slides at 1.01 and 1.05 with the acceleration of
 * a block. */
void contacts_check_incline(const char *solver);
/* At 1 m/s it comes to rest after v^2 / (2 mu g) = 0.16995 m. */
void contacts_check_stop(const char *solver);

/* Obstacles, each with its place, below cloth of 40 cm around the origin; the last one is a plane. */
#define CONTACTS_SOLIDS 7
extern const char *const contacts_solids[CONTACTS_SOLIDS];

#endif
