/* candidates.h: which features may meet while every vertex moves straight from x to x + dx, for
 * the implicit road.
 *
 * A tree over the groups of sim/contact/surface.h is refitted to the swept boxes; groups that come
 * near and are not certified flat give vertex-triangle and edge-edge pairs without common vertices,
 * each once. Triangles come near a solid by the distances of their corners. Always in the same
 * order.
 *
 * A list is made for boxes with a margin, and serves all motions that stay inside them until
 * candidates_forget: so it never depends on more than what came since then. */
#ifndef TOILE_CONTACT_CANDIDATES_H
#define TOILE_CONTACT_CANDIDATES_H

#include "sim/contact/flatness.h"
#include "sim/contact/places.h"

typedef struct Candidate {
    int obstacle; /* a solid, or -1: cloth with cloth or with a mesh */
    PairKind kind;
    /* as in Pair, and a mesh is like cloth; with a solid the three corners of a triangle and -1 */
    int place[4];
    double dhat;   /* [m] contact distance */
    double target; /* [m] distance that a motion must keep; of the clamp */
} Candidate;

typedef struct Candidates {
    const ContactDef *def;
    Arena *arena;
    Places places;
    BoxTree tree;
    bool known;          /* the items are those of `boxes` */
    Box *boxes;          /* (vertex_count) where a vertex may be */
    Vec3 *middles;       /* (vertex_count) of boxes */
    double *radii;       /* [m] (vertex_count) half the diagonals of boxes */
    Flatness flatness;   /* of the middles */
    int *lattice_groups; /* (lattice_group_count) */
    int lattice_group_count;
    long stamp;        /* of the boxes */
    Box *groups;       /* (group_count) */
    double *rooms;     /* [m] (group_count) largest radius */
    Box *cells;        /* (cell_count) */
    long *boxed;       /* (group_count) stamp of its cells */
    Pose *from, *to;   /* (obstacle_count) where an obstacle may be: one or the other */
    double *distances; /* [m] (vertex_count) from the obstacle at work */
    double *motions;   /* [m] (vertex_count) relative to it, at most */
    Candidate *items;  /* (count) */
    int count, room;
} Candidates;

Candidates candidates_create(const ContactDef *def, Arena *arena);

/* The next candidates_find looks anew. */
void candidates_forget(Candidates *c);

/* At least all pairs that may come nearer than their contact distance while obstacles go from poses to
 * `to`.
 * x, dx: [m] (places.count x 3); dx NULL: no vertex moves. */
void candidates_find(Candidates *c, const Pose *poses, const Pose *to, const double *x,
                     const double *dx);

#endif
