/* spring_law.h: springs between two nodes: a line, and in compression the response of a buckled
 * strip that the lattice cannot show.
 *
 * A strip of length L and bending rigidity k [N m2] whose ends are pressed together to r = l/L
 * carries the force f(d) k/L2, d = 1 - r. The table holds f, its integral from 0 and its slope.
 * In compression a spring follows its line until the strip would carry less (the *onset*), then
 * the strip. Stretched beyond a limit it stiffens: the energy
 *     stiffen/2 (l - (1 + limit) L)^2,   l > (1 + limit) L
 * stands for what Provot (1995) did by moving nodes together again after every step. */
#ifndef TOILE_MODEL_SPRING_LAW_H
#define TOILE_MODEL_SPRING_LAW_H

#include <stdbool.h>

/* All of d = 1 - l/L, in 0 .. 1. */
typedef struct BuckleLaw {
    const char *name, *about;
    double (*energy)(double d); /* integral of force from 0 */
    double (*force)(double d);
    double (*slope)(double d);
} BuckleLaw;

/* elastica: the exact pinned strip; arc: circular arc (Choi, Ko 2002); quartic: their published
 * fit; chord: two links that turn by psi with the moment k psi/h, r = cos(psi/2), L = 2h */
extern const BuckleLaw buckle_elastica, buckle_arc, buckle_quartic, buckle_chord;

/* What springs of one kind share. */
typedef struct SpringKind {
    double rest;          /* [m] L */
    double stiffness;     /* [N/m] of the line */
    bool pushes;          /* no force when stretched */
    const BuckleLaw *law; /* NULL: the line alone */
    double rigidity;      /* [N m2] k */
    double onset;         /* d where the strip takes over; INFINITY: never */
    double limit;         /* strain beyond which it stiffens; INFINITY: never */
    double stiffen;       /* [N/m] there, on top of the line */
    double fifth;         /* [J] C0: stretched, C0 (l/L - 1)^5 instead of the line; 0: the line */
} SpringKind;

/* Finds the onset. law NULL: a line. */
SpringKind spring_kind(double rest, double stiffness, const BuckleLaw *law, double rigidity);

double spring_energy(const SpringKind *kind, double length); /* [J] */
/* [N] tension at that length, negative in compression; *slope [N/m] unless NULL */
double spring_tension(const SpringKind *kind, double length, double *slope);

#endif
