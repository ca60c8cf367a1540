/* candidates.h: which features may meet while every vertex moves straight from x to x + dx, for
 * the implicit road (contact.md 3): one query per Newton iteration, nothing kept between them.
 *
 * A tree over the cells of sim/contact/surface.h is refitted to the swept boxes; cells that come
 * near give vertex-triangle and edge-edge pairs without common vertices, each once. Triangles come
 * near a solid by the distances of their corners. Always in the same order. */
#ifndef TOILE_CONTACT_CANDIDATES_H
#define TOILE_CONTACT_CANDIDATES_H

#include "sim/contact/contact.h"

typedef struct Candidate {
    int obstacle; /* -1: cloth with cloth */
    PairKind kind;
    int place[4];  /* as in Pair; with an obstacle the three corners of a triangle and -1 */
    double dhat;   /* [m] contact distance */
    double target; /* [m] distance that a motion must keep; negative: the pair is not judged */
} Candidate;

typedef struct Candidates {
    const ContactDef *def;
    Arena *arena;
    Surface surface;
    BoxTree tree;
    Box *swept;        /* (vertex_count) of a vertex */
    Box *cells;        /* (cell_count) */
    double *distances; /* [m] (vertex_count) from the obstacle at work */
    double *motions;   /* [m] (vertex_count) relative to it */
    Candidate *items;  /* (count) */
    int count, room;
} Candidates;

Candidates candidates_create(const ContactDef *def, Arena *arena);

/* All pairs that may come nearer than their contact distance while obstacles go from poses to `to`.
 * x, dx: [m] (vertex_count x 3); dx NULL: no vertex moves. */
void candidates_find(Candidates *c, const Pose *poses, const Pose *to, const double *x,
                     const double *dx);

#endif
