/* lists.h: which pairs of features may meet. Two levels (contact.md, Lists):
 *
 * 1. *Group pairs*: groups whose boxes are near. Each has its own relative path, the integral of
 *    |T_a - T_b| + r_a + r_b, T the velocity of a group's middle and r the largest deviation
 *    from it: no distance between the two groups can change by more. Parts that move together
 *    spend nothing.
 * 2. *Pairs* of features of one group pair: vertex and triangle, edge and edge. They are looked
 *    for again when the group pair's path passes its limit. A flatness certificate says for
 *    lattice neighbours that no two features can be near, and then there are none.
 *
 * Rules that always hold at the start of a step: a group pair that is not listed is farther
 * apart than any `near`; a pair that is not listed is farther apart than the `near` of its group
 * pair; a listed pair that is not due is too. */
#ifndef TOILE_CONTACT_LISTS_H
#define TOILE_CONTACT_LISTS_H

#include "sim/base/vector.h"
#include "sim/contact/flatness.h"
#include "sim/contact/paths.h"

/* More of it is in rows (paths.h). */
typedef struct GroupPair {
    int begin, count;   /* its pairs */
    unsigned evaluated; /* stamp at which they were looked at last */
    bool dense;         /* many were found: the next search reaches less far */
} GroupPair;

typedef enum PairKind {
    PAIR_FACE, /* place[0] a vertex, place[1..3] a triangle */
    PAIR_EDGES /* place[0..1] and place[2..3] edges */
} PairKind;

typedef struct Pair {
    PairKind kind;
    int place[4];
    int feature;      /* what holds the closest points, see closest.h */
    double distance;  /* [m] as evaluated last */
    Vec3 normal;      /* from the second feature to the first */
    double dhat;      /* [m] contact distance of this pair */
    double weight[4]; /* of the closest points: + first, - second feature */
    double soft;      /* share of the stiffness left between almost parallel edges */
    Vec3 bristle;     /* [m] */
} Pair;

/* A stretched bristle on its way from one list to the next, or to the states file. */
typedef struct PairMemory {
    int place[4]; /* place[3] is -1 - place for a pair of edges */
    double bristle[3];
} PairMemory;

typedef struct GroupBounds {
    Box cell[SURFACE_GROUP_CELLS];
    Box all;
} GroupBounds;

/* What one share of a search found. */
typedef struct Found {
    Pair *pairs;
    double *due;
    int count, room;
    bool full; /* there is more: the room grows, and the share is searched again */
} Found;

#define SEARCH_CHUNKS 32

/* What one share of the tree of groups holds: pairs of groups that may meet. */
typedef struct NearGroups {
    PathEnds *ends; /* (count), unless that is more than there is room for */
    int count, room;
} NearGroups;

#define NEAR_GRAIN (BOX_TREE_PARTS / SEARCH_CHUNKS) /* parts of the tree */

typedef struct Lists {
    const Surface *surface;
    bool cloth_meets_cloth;
    VectorWidth width; /* of the code that pairs are evaluated with */
    const PathKernel *path_kernel;
    Arena *arena;
    BoxTree tree;
    GroupBounds *bounds;      /* (group_count) */
    Flatness flatness;        /* with slopes of groups */
    unsigned *boxed, *sloped; /* (group_count) stamps of the positions that those belong to */
    Box *boxes;               /* (group_count) */
    unsigned stamp;           /* changes when positions change */
    GroupPair *group_pairs, *old_group_pairs;
    PathRows paths, old_paths; /* (group_pair_room) of those */
    int group_pair_count, group_pair_room;
    int *renumber;            /* (group_pair_room) */
    int *searched;            /* (group_pair_room) group pairs of this search */
    double *apart;            /* [m] (group_pair_room) bounds of the distance of those */
    int *marked;              /* (group_count) groups whose bounds are to be found, and 8 more */
    unsigned char *is_marked; /* likewise: 1 until they are listed */
    Found found[SEARCH_CHUNKS];
    NearGroups near[SEARCH_CHUNKS];
    int *slots; /* hash of group pairs, for remakes */
    int slot_count;
    double reach;    /* [m] groups farther apart are not listed */
    double spent;    /* [m] of it used up by motion */
    double widest;   /* [m] largest `near` of any group pair */
    Pair *pairs;     /* (pair_end) in blocks of group pairs, and holes */
    double *due;     /* [m] (pair_end) path of the group pair at which it must be looked at */
    Pair *old_pairs; /* the other half of a room that is used in turns */
    double *old_due;
    int pair_count, pair_end, pair_room, old_room; /* pair_count: without holes */
    PairMemory *kept; /* bristles of pairs that were dropped, as a hash table */
    int kept_count, kept_room;
} Lists;

/* cloth_meets_cloth false: only cloth and meshes do. Meshes never meet each other. */
Lists lists_create(const Surface *surface, const double *start, bool cloth_meets_cloth,
                   Arena *arena);

/* Forgets everything; takes over bristles for the pairs to come. */
void lists_clear(Lists *lists, const PairMemory *memory, int memory_count);

/* Level 1. Group pairs that stay keep their pairs. `least_reach` [m]: what near and slack need. */
void lists_remake(Lists *lists, const Points *x, double least_reach);

/* Level 2 for these group pairs, in rising order: near and slack [m] from their speeds and dt. */
void lists_query(Lists *lists, const Points *x, const int *wanted, int count, double dt);

/* Closest points of a pair. */
void pair_evaluate(const Points *points, Pair *pair);
Pair pair_between(PairKind kind, const Vec3 x[4]);

/* [m] a lower bound of the distance, from the normal of the last evaluation: cheap, and tight
 * while the pair has not turned. */
double pair_bound(const Points *points, const Pair *pair);

/* A vertex-face pair that is clamped to an edge or a vertex stands for a contact that other pairs
 * may stand for too. The contact's key: the vertex and the two ends of the edge
 * (low, high), or -1 and two vertices, the same from either side. */
void pair_twin_key(const Pair *pair, int key[3]);

/* [m] contact distance of neighbours: on scattered nodes less than they are apart at rest. */
double pair_rest_limit(const SurfacePanel *panel, const Pair *pair, double dhat);

/* Copies stretched bristles out; returns their number, at most `room`. */
int lists_remember(const Lists *lists, PairMemory *memory, int room);

#endif
