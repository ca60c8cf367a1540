/* quiet.h: a proof that nothing can touch for many steps, so that these need not look.
 *
 * Every panel is a tree of blocks: on a lattice 2 x 2 blocks make one of the next level, elsewhere
 * two neighbours do; its leaves are the groups of the surface. From the roots down, each pair of
 * blocks is proved apart, or its children are:
 * - a block and itself or its neighbour on a lattice by slopes (slopes.h). When nodes next to each
 *   other along u and v move by at most p and q against each other, no gradient changes by more than
 *   g = sqrt(p^2/h1^2 + q^2/h2^2). Where that fails in a sharp fold, the columns or rows of cells of
 *   both are taken instead: a few next to each other by slopes, others by boxes;
 * - two others by their boxes. They come nearer by at most g times the length of cloth from one to
 *   the other, and by at most the paths of the fastest vertices. If they are not far from each
 *   other, also by the slopes of all blocks in the rectangle between them;
 * - a block and a solid by the ball around its box.
 * So the proof holds while two paths stay below their rooms: the spread of neighbours against where they
 * were proven, and what any two vertices have moved against each other since then. Where there is nothing but
 * cloth, it is proven for a place ahead, to which the velocities of now lead while they use up a part of the
 * room: cloth comes nearer to that place before it leaves it, so the proof lasts longer.
 * The spread is bounded by the sum, since it was looked at last, of how fast neighbours were at most in each
 * step: the drift says so, by the speeds of all nodes or, closer, by those in the frame of each row (sweep.h).
 * Where that is too much it is bounded by the fastest relative motion of neighbours: after the kick the
 * velocities of a step are known. Motions are straight and the spread of a pair is convex along them: what
 * holds at both ends of a step holds in it. A proof is about positions, so it goes on in the next interval
 * where these are the same. */
#ifndef TOILE_CONTACT_QUIET_H
#define TOILE_CONTACT_QUIET_H

#include "sim/contact/contact.h"
#include "sim/contact/quiet_blocks.h"

typedef struct BlockRef {
    int panel, level, i, j;
} BlockRef;

typedef struct QuietPair {
    BlockRef a, b;
    bool is_known;
} QuietPair;

typedef struct Quiet {
    QuietPanel *panels; /* (panels of the surface) */
    const SlopeKernel *kernel;
    bool holds;
    double near_room, near_path; /* [m] of neighbours against each other */
    double far_room, far_path;   /* [m] of two bodies towards each other */
    double spread;               /* [m] of neighbours as looked at last */
    double begun;    /* [m] of neighbours as the proof was made, which was ahead of them */
    double far_seen; /* [m] far_path as looked at last */
    double near_step, far_step; /* [m] of the step that follows, if looked at; else infinite */
    ContactSpeeds speeds;       /* of the last step */
    bool close; /* is a close bound of `relative` wanted? Until the proof ends: without it leaps */
    double lasting;  /* [steps] of the last proof, as far as was known */
    QuietPair tight; /* that let it last no longer */
    double proven;   /* step of the interval before which it was proven */
    double cost;     /* [looks] of the proof, and of looking since then */
    double retry;    /* step of the interval from which on to try again */
} Quiet;

Quiet quiet_create(const Surface *surface, Arena *arena);

/* Tries to prove that nothing can touch in the next steps of dt, with the positions and velocities
 * in the lanes. */
bool quiet_prove(Contact *contact, double dt);

/* Does the proof of the last interval hold on, with positions unchanged and no obstacles? The steps of this
 * interval count from 0; the last one had `steps`. */
bool quiet_continues(Contact *contact, double steps);

/* Does the proof hold for the step of dt that follows, if nothing becomes twice as fast in it? To be asked
 * when its velocities are known. */
bool quiet_has_room(Contact *contact, double dt);

/* Takes a step of dt out of the rooms; false: it was too long. */
bool quiet_spend(Contact *c, const ContactSpeeds *speeds, double dt);

#endif
