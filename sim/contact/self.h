/* self.h: cloth with cloth and with meshes on the explicit road: what a step asks of the pairs in the lists (lists.h),
 * and what self.c offers. Not for others than the files of the explicit contact. */
#ifndef TOILE_CONTACT_SELF_H
#define TOILE_CONTACT_SELF_H

#include <stdbool.h>

#include "sim/base/parallel.h"
#include "sim/contact/contact.h"

/* The last question to all group pairs, and those of which the answer was yes. */
typedef struct Asked {
    Question question;
    double step; /* [s] for a step of that */
    int *wanted; /* (count) group pairs to be searched */
    int count, room;
    int *counts;       /* of chunks of them */
    bool foreseen;     /* paths.next is where the step that was asked about leads */
    bool advanced;     /* wanted and the answers are those of the paths of now */
    double level_step; /* [m] how much nearer any two groups come in this step, at most */
} Asked;

/* A pair that is near in this step, and its group pair. */
typedef struct DuePair {
    int pair, owner;
} DuePair;

/* The pairs that were looked at in this step, at the positions of now. */
typedef struct DuePairs {
    int *owners;      /* (owner_count) group pairs with pairs to be looked at */
    int *near_counts; /* (owner_count) pairs of each that are near, ... */
    int *near;        /* (room) ... which stand from its `begin` on */
    int owner_count;
    DuePair *pairs; /* (count) all that are near */
    int *tight;     /* (room) those that impulses may have to hold apart */
    int count, room;
} DuePairs;

/* dt: [s] the step. c->groups.motion must be that of the velocities of now. */

/* Makes all lists at the positions of now. */
void self_begin(Contact *c, double dt);
/* The pairs that are near at the positions of now, into c->due. */
void self_find(Contact *c, double dt);
/* ... and their forces into c->pushes, for a kick of `share` dt. */
void self_forces(Contact *c, double dt, double share);
/* After the kick: makes the lists wide enough for the velocities of now. */
void self_refresh(Contact *c, double dt);
/* Takes the approach out of pairs that would come too near. */
void self_impulses(Contact *c, double dt);
/* Notes by how much motions must shrink to stay behind their planes (contact_shorten). */
void self_shorten(Contact *c, double dt);
/* After the velocities were changed: looks for pairs that may now meet. True: shorten again. */
bool self_check(Contact *c, double dt);
/* Moves all paths on by this step; after it: what that leads to is known. */
ParallelLoop self_advance_loop(Contact *c);
void self_advanced(Contact *c);
/* [J] stored in the pairs that were looked at last, for a step of dt. */
double self_energy(Contact *c, double dt);

double pair_friction(const Contact *c, const Pair *pair); /* mu */
/* [m/s] velocity of a mesh at the pair, in the sense of the weights; 0 between cloths */
Vec3 pair_carried(const Contact *c, const Pair *pair);

#endif
