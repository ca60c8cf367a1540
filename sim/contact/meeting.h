/* meeting.h: what the files of the barrier share: the contacts at given positions. Not for others. */
#ifndef TOILE_CONTACT_MEETING_H
#define TOILE_CONTACT_MEETING_H

#include "sim/contact/barrier.h"

/* Nearest points: weights of the corners of a meeting, negative on the second side. */
typedef struct Foot {
    double distance; /* [m] */
    double weight[4];
    Vec3 normal;
} Foot;

/* A feature near another. */
typedef struct Meeting {
    int key[4];
    int obstacle, count, first; /* count corners, the first so many against the others */
    int place[4];
    double dhat, stiffness, friction; /* [m], k [N/m], mu */
    double share;                     /* that k has of the law's */
    Foot foot;
    double energy, force, curvature; /* [J], [N], [N/m] */
    Vec3 carried;                    /* [m] motion of the obstacle there in this step */
    Vec3 slid;                       /* [m] relative motion in this step, against the friction */
    Vec3 stretch;                    /* [m] of the bristle, tangential */
    double limit;                    /* [m] stretch at which it slips */
    bool slips;
    double tilt; /* [N m] f (R + d) */
    Vec3 gradient[3];
} Meeting;

/* contacts, and a hash table of their keys */
typedef struct Meetings {
    Meeting *items;
    int count, room;
    int *slots, slot_count; /* 1 + index */
} Meetings;

/* a block that is not in the pattern */
typedef struct Lumped {
    int meeting, a, b;
    double factor;
} Lumped;

struct Barrier {
    const ContactDef *def;
    Arena *arena;
    Clamp clamp;
    Meetings now;
    Lumped *lumped;
    int lumped_count, lumped_room;
    /* of the step */
    const ContactMemory *memory;
    int *memory_slots, memory_slot_count;
    double *start, *x, *dx; /* [m] (places x 3) of the step; at work */
    unsigned char *held;    /* (places) */
    Pose *poses;            /* (obstacle_count) of the obstacles, after they moved */
    double *clocks;         /* [s] (obstacle_count) */
    Pose *next;             /* where they want to be, if `driven` */
    double *advance;        /* [s] (obstacle_count) */
    bool driven;            /* the next clamp moves them */
};

/* The cloth has the places from 0, meshes those behind. */
static inline bool is_cloth(const Barrier *b, int place) { return place < b->def->vertex_count; }
static inline bool at_mesh(const Barrier *b, const Meeting *m) {
    return m->count == 4 && !(is_cloth(b, m->place[0]) && is_cloth(b, m->place[3]));
}

void meetings_clear(Meetings *meetings);
/* Slot of a key in a table of so many slots. */
unsigned meeting_slot(const int key[4], int slot_count);
/* Fills b->now at x, with the bristles' stretch since the start of the step. */
void meetings_find(Barrier *b, const double *x);

#endif
