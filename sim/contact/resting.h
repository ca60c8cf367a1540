/* resting.h: groups of cloth over one flat face of a solid that stands still. As long as no vertex can
 * leave the face, their distances and forces are found in rows (rest_batch.h) and not touch by touch;
 * vertices that nothing else touches get theirs without being added up. The same forces. */
#ifndef TOILE_CONTACT_RESTING_H
#define TOILE_CONTACT_RESTING_H

#include "sim/contact/rest_batch.h"
#include "sim/contact/touch.h"

/* A group at an obstacle. */
typedef struct RestGroup {
    double until; /* [m] path of the group up to which it rests; negative: it does not */
    Vec3 normal;
    int count; /* its vertices */
} RestGroup;

/* What some of them did. */
typedef struct RestPush {
    bool some;
    double approach; /* [m/s] fastest of those that push */
} RestPush;

/* All of them. */
typedef struct Resting {
    RestGroup *groups; /* (group_count x obstacle_count) */
    /* (touch_room) of the vertices of each group, from the first of its touches on */
    int *place;
    double *level;    /* [m] as in Touch */
    double *distance; /* [m] at the last look */
    RestPush *pushes; /* of each chunk of groups, in this step */
    RestKernel *kernel;
} Resting;

Resting resting_create(int owners, Arena *arena);
void resting_clear(Resting *resting, int owners); /* nothing rests */
void resting_make_room(Resting *resting, int used, int room, Arena *arena);

static inline bool resting_holds(const Resting *resting, int owner) {
    return resting->groups[owner].until >= 0.0;
}

/* vertices of a group that rests */
static inline int resting_count(const Resting *resting, int owner) {
    return resting_holds(resting, owner) ? resting->groups[owner].count : 0;
}

/* After a look at all that is due: does the group rest from now on? */
void resting_settle(Contact *c, int owner);
/* Instead of a look at its touches, at the path and positions of now. False: it rests no more, and all of
 * them are due. */
bool resting_look(Contact *c, const Points *x, int owner);
/* Rests no more: its vertices are known at the positions of now, and due. */
void resting_wake(Contact *c, int owner);

/* Forces of the groups of this look, after those of all other contacts. */
void resting_forces(Contact *c, double dt, double share);

#endif
