/* clamp.h: makes any motion of the cloth legal.
 *
 * Stage 1, *projection*, repairs the direction: of a pair that would come too near only the
 * approaching part of the motion along its normal is taken out, so that cloth slides around an
 * edge instead of locking. Pairs in list order, changes seen at once; serial.
 * Stage 2, *shortening*, is the guarantee. Every vertex keeps a share of what is left; a pair that
 * is still blocked lowers the shares of its vertices; every pair whose motion changed is looked at
 * again until all are proven. Shares only fall and are read from the round before, so the result
 * does not depend on any order.
 *
 * A pair at the distance d0 keeps `target`: from outside CONTACT_ENTRY dhat, from inside the core
 * and a share of what lies above it. Pairs that touch or cross already are left to the force. */
#ifndef TOILE_CONTACT_CLAMP_H
#define TOILE_CONTACT_CLAMP_H

#include "sim/contact/candidates.h"

/* Where the obstacles are, and where they want to go during a motion. A pair with a solid that
 * moves is judged in the frame of the solid, along the straight line there from where it is to
 * where it will be; the vertices of a mesh go straight to where they will be. Obstacles must turn
 * little in one motion (CONTACT_MOST_TURN). */
typedef struct ClampObstacles {
    const Pose *from;
    Pose *to;             /* (obstacle_count) where they are after the motion */
    const double *clocks; /* [s] */
    double *advance;      /* [s] of their clocks; made shorter where cloth cannot yield; NULL: all
                             stand still, and `to` is not used */
} ClampObstacles;

typedef struct Clamp {
    Candidates near;
    Candidate *items; /* (item_count) of near that this motion could bring too near */
    int item_count, item_room;
    double *share, *next;         /* (places) */
    int *stamp;                   /* (places) round in which the motion changed last */
    unsigned char *changed;       /* (places) 1: clamped by the last motion */
    double *yields, *next_yields; /* (obstacle_count) share of its motion that an obstacle keeps */
    int *obstacle_stamp;          /* round in which that changed last */
} Clamp;

Clamp clamp_create(const ContactDef *def, Arena *arena);

/* [m] what a pair of contact distance dhat at the distance d0 must keep in one motion. */
double clamp_target(double dhat, double d0);

/* Changes dx so that x + t dx is legal for all t in [0, 1], if x is. Held vertices keep their
 * direction. A motion that is not finite becomes 0. x, dx: [m] (places x 3); the clamp
 * sets dx of meshes. Returns the smallest share that a vertex keeps in stage 2: 1 when projection was
 * enough, 0 also for a motion that is not finite. */
double clamp_motion(Clamp *clamp, const ClampObstacles *obstacles, const unsigned char *held,
                    const double *x, double *dx);

#endif
