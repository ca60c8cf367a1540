/* touched.h: what contacts do in a step of the explicit road, one by one and to single vertices, and which
 * vertices they touch. Not for others than the files of the explicit contact. */
#ifndef TOILE_CONTACT_TOUCHED_H
#define TOILE_CONTACT_TOUCHED_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "sim/base/vec.h"

/* What one contact does in this step, found for all of them at once and then added in turn. */
typedef struct ContactForce {
    Vec3 sum, damping, friction; /* [N] all of it, and its parts that take energy */
    double stiffness;            /* [N/m] for the inertia of the kick */
    Vec3 carried;                /* [m/s] of what is met and follows a programme */
    double approach;             /* [m/s] */
} ContactForce;

/* The vertices that a force pushes. */
typedef struct ForceEnds {
    int place[4];
    double weight[4];
} ForceEnds;

/* Of two pairs that stand for one contact, the second follows the bristle of the first. */
typedef struct Follower {
    int second, first;
} Follower;

/* Forces of one kind of contact at a time, of pairs or of touches; a growing room. */
typedef struct Forces {
    int *pushing; /* (pushing_count) those that push: pairs, or touches and sides (obstacle.c) */
    int pushing_count, room;
    ContactForce *found; /* (room) of those, or of a part of them */
    ForceEnds *ends;     /* (room) of pairs, where threads share the vertices */
    int *left;           /* (room) of touches: those that are added after the others */
    Follower *followers; /* (follower_count) pairs of this step */
    int follower_count;
} Forces;

/* A vertex is not touched; it has a Push; its force, the only one, is in the lanes. */
enum { UNTOUCHED = 0, TOUCHED = 1, TOUCHED_ALONE = 2 };

/* What contact does to a vertex in the kick of this step; zero between steps. */
typedef struct Push {
    Vec3 force;       /* [N] */
    double stiffness; /* [N/m] sum over contacts, see CONTACT_STABLE_SHARE */
} Push;

/* What takes energy out of a vertex in this step [N s]: the work of each is known when the guard has
 * settled the velocity, of which it meets the mean with that before the kick. */
typedef struct Toll {
    Vec3 damping, friction, inertia; /* inertia: what the kick kept from a crowded vertex */
    Vec3 before;                     /* [m/s] */
} Toll;

/* [J] of some vertices in a step. */
typedef struct Loss {
    double damping, friction, guard;
} Loss;

/* Touched vertices, eight at a time: the lowest byte is the first. */
typedef struct TouchedWalk {
    const unsigned char *flags;
    uint64_t wanted, left; /* bits that are asked for; those of the vertices from `first` on */
    int first, end;
} TouchedWalk;

/* From `first` on, a multiple of 8; all that are touched, or only those that have a push. Eight zeros follow
 * the last of the flags. */
static inline TouchedWalk touched_walk(const unsigned char *flags, int first, int end, bool all) {
    uint64_t wanted = (all ? TOUCHED | TOUCHED_ALONE : TOUCHED) * 0x0101010101010101U;
    return (TouchedWalk){flags, wanted, 0, first - 8, end};
}

/* -1: there is none */
static inline int touched_next(TouchedWalk *walk) {
    while (walk->left == 0) {
        walk->first += 8;
        if (walk->first >= walk->end) {
            return -1;
        }
        memcpy(&walk->left, walk->flags + walk->first, 8);
        walk->left &= walk->wanted;
    }
    int place = walk->first + __builtin_ctzll(walk->left) / 8;
    walk->left &= walk->left - 1;
    return place;
}

#endif
