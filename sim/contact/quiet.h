/* quiet.h: a proof that nothing can touch for many steps, so that these need not look.
 *
 * Every panel is a tree of blocks: on a lattice 2 x 2 blocks make one of the next level, elsewhere
 * two neighbours do; its leaves are the groups of the surface. From the roots down, each pair of
 * blocks is proved apart, or its children are:
 * - a block and itself or its neighbour on a lattice by slopes (flatness.h). When no two nodes
 *   next to each other move by more than p against each other, no gradient changes by more than
 *   p sqrt(1/h1^2 + 1/h2^2);
 * - two others by their boxes. They come nearer by at most n p, n the lines of the lattice from one
 *   to the other, and by at most the paths of the fastest vertices;
 * - a block and a solid by the ball around its box.
 * So the proof holds while two paths stay below their rooms: the spread of neighbours since then,
 * and the sum of the fastest motions. The spread is bounded by the fastest motions since it was
 * looked at last. */
#ifndef TOILE_CONTACT_QUIET_H
#define TOILE_CONTACT_QUIET_H

#include "sim/contact/contact.h"

typedef struct QuietBlock {
    Box place, gradient[2]; /* [m]; gradients on lattices only */
} QuietBlock;

typedef struct QuietLevel {
    int across, along; /* blocks along u and v; one row where there is no lattice */
    QuietBlock *blocks;
} QuietLevel;

#define QUIET_MOST_LEVELS 32

typedef struct QuietPanel {
    int level_count; /* the last one has one block; 0: no triangles */
    QuietLevel level[QUIET_MOST_LEVELS];
} QuietPanel;

typedef struct Quiet {
    QuietPanel *panels; /* (panels of the surface) */
    bool holds;
    double near_room, near_path; /* [m] of neighbours against each other */
    double far_room, far_path;   /* [m] of two bodies towards each other */
    double spread_room;          /* [m] a larger spread is worth a new proof */
    double fastest;              /* [m/s] vertex in the last step */
    double retry;                /* step of the interval from which on to try again */
} Quiet;

Quiet quiet_create(const Surface *surface, Arena *arena);

/* Tries to prove that nothing can touch in the next steps of dt, with the positions and velocities
 * gathered in the contact. */
bool quiet_prove(Contact *contact, double dt);

/* Does the proof hold for the step of dt that follows, if nothing becomes twice as fast in it? */
bool quiet_has_room(Contact *contact, double dt);

/* Takes a step of dt out of the rooms, in which no vertex was faster than `fastest` [m/s]; false: it
 * was too long. */
bool quiet_spend(Contact *contact, double fastest, double dt);

#endif
