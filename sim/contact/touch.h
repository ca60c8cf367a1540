/* touch.h: cloth at convex solids on the explicit road: what is kept of each vertex and triangle, and
 * what the files that keep it offer to the others of the explicit contact (engine.h). */
#ifndef TOILE_CONTACT_TOUCH_H
#define TOILE_CONTACT_TOUCH_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/base/parallel.h"
#include "sim/base/vec.h"
#include "sim/contact/box_batch.h"
#include "sim/contact/contact.h"

/* A vertex (place[1] < 0) or a triangle at an obstacle. Vertices push, and sides and faces of triangles; their
 * planes part them from it. What every step asks of a vertex over a flat face lies in one cache line. */
typedef struct Touch {
    _Alignas(ARENA_ALIGNMENT) int obstacle;
    int place[3];
    int owner;       /* which group at which obstacle */
    short feature;   /* corners that hold the closest point of the cloth */
    bool spare;      /* a triangle over a flat face: the planes of its corners do for it */
    double distance; /* [m] */
    Vec3 normal;     /* from the obstacle to the cloth */
    double level;    /* [m] of the closest point of the obstacle along the normal */
    Vec3 point;      /* that point */
    double frozen;   /* [m] of a vertex: path of its group until which normal and point stay */
    double margin;   /* [m] of motion while it stays spare */
    double weight[3];
    Vec3 bristle; /* of a face */
    double share; /* of the stiffness of a face */
    int triangle;
    unsigned sides; /* bit k: the side from corner k on is near, and found here */
} Touch;

/* The nearest point of an edge of the surface at an obstacle, where it lies inside: found with the first triangle
 * that has the edge. */
typedef struct SideTouch {
    double at, distance; /* share of the way from its first vertex; [m] */
    double share;        /* of the stiffness */
    Vec3 normal, point;  /* point: at solids that move */
} SideTouch;

/* A group at an obstacle: the same rules as for a GroupPair. What every step asks stands first. */
typedef struct GroupTouch {
    double path, limit, near, speed;
    double earliest;  /* [m] path at which the first of its touches must be looked at */
    int begin, count; /* its touches */
    bool fresh;       /* all that it has is listed; the next look keeps what is within its reach */
    double gap;       /* [m] smallest distance of those that are near */
    double dhat;      /* [m] contact distance, where there are touches: a group is of one cloth */
    double reach;     /* [m] what is farther away is not listed */
    int room;         /* of its block of touches; 0: none */
    int listed;       /* its touches before this look */
    int near_count;   /* touches that are near, at the last look */
    int looked;       /* triangles that were due, then ... */
    int pushing;      /* ... after a look for forces: touches that push or whose sides may */
} GroupTouch;

/* What a look at some groups found. */
typedef struct LookSum {
    int listed;  /* touches more than before */
    int near;    /* that are near */
    int resting; /* vertices of groups that rest */
    double gap;  /* [m] smallest */
    double room; /* smallest gap / contact distance */
} LookSum;

/* Distance and normal of a vertex at an obstacle, kept while positions stay. */
typedef struct VertexDistance {
    long stamp;
    double distance;
    Vec3 place, normal; /* in the frame of the obstacle */
} VertexDistance;

#define CORNERS 64 /* of two rows of cells of some groups that are looked at one after the other */

/* Corners of triangles that one thread found while positions stay, of vertices that are not known. */
typedef struct Corner {
    size_t next_index; /* one more than that of the vertex and its obstacle; 0: none */
    VertexDistance found;
} Corner;

typedef struct Corners {
    Corner one[CORNERS];
} Corners;

static inline void corners_clear(Corners *corners) {
    for (int k = 0; k < CORNERS; k++) {
        corners->one[k].next_index = 0;
    }
}

/* Triangles at boxes whose nearest points are found together. */
typedef struct TouchBatch {
    Touch *touches[BOX_BATCH]; /* those that wait */
    BoxBatch boxes;
} TouchBatch;

/* A pose as its axes, which is quicker to apply. */
typedef struct Frame {
    Vec3 origin, axis[3];
} Frame;

/* All that is listed of cloth at solids. Groups of cloth at obstacles: group g at obstacle o is number
 * g x obstacle_count + o, its *owner*. */
typedef struct Touches {
    GroupTouch *groups;    /* (owners) */
    Touch *list;           /* (end) in blocks of groups, which are not full */
    double *due;           /* [m] (end) path of the group at which it must be looked at */
    int *looked;           /* (room) triangles of each group from its `begin` on */
    int *near;             /* (room) likewise: touches that are near */
    int count, end, room;  /* count: of all groups */
    VertexDistance *known; /* (vertex_count x obstacle_count) */
    SideTouch *sides;      /* (side_count: edges of cloth x obstacle_count) where a solid is */
    int side_count;
} Touches;

/* The last look at them. */
typedef struct TouchLook {
    bool asked;                 /* due and spent groups are known for the paths of now */
    int *groups;                /* (group_count) owners with touches to be looked at */
    int *spent;                 /* owners that want to be searched */
    int *counts, *spent_counts; /* of chunks of owners */
    LookSum *sums;              /* of chunks of groups */
    int *touches; /* (touch_count) that are near; listed where impulses or motions ask */
    int group_count, touch_count;
} TouchLook;

/* [m] how far friction at solids is stretched; those of faces are in the touches. */
typedef struct SolidBristles {
    double *vertices;   /* (vertex_count x obstacle_count x 3) */
    Vec3 *sides;        /* (side_count) */
    bool sides_rub;     /* does any of them have one? */
    PairMemory *memory; /* (memory_count) of sides and faces, from the last interval */
    int memory_count;
} SolidBristles;

/* Where the programmes of obstacles stand and lead. */
typedef struct Programmes {
    bool some;           /* does any obstacle have one? */
    double *clocks;      /* [s] (obstacle_count) now */
    double *next_clocks; /* [s] demanded at the end of the step */
    Pose *next;          /* (obstacle_count) likewise */
    double *mesh_target; /* [m] (places of meshes x 3) likewise */
} Programmes;

static inline int touch_corners(const Touch *touch) { return touch->place[1] < 0 ? 1 : 3; }

/* obstacle_distance.c: distance, normal, feature of a touch at the positions of now. A vertex is known
 * from then on to the triangles at it; a triangle may wait until all that wait are finished. */
void obstacle_evaluate_vertex(Contact *c, const Points *x, Touch *touch);
void obstacle_evaluate_triangle(const Contact *c, const Points *x, Corners *corners,
                                TouchBatch *batch, Touch *touch);
void obstacle_finish(const Contact *c, TouchBatch *batch);
/* [m] how far a vertex can go until that must be done again: on a flat face to its end, elsewhere a
 * small share of the contact distance; -1: not at all. Until then it is as far as from its plane. */
double obstacle_frozen(const Contact *c, const Touch *touch);
void obstacle_project(const Points *x, Touch *touch);

/* obstacle_lists.c: touches that are near. dt: [s] the step */
void obstacle_begin(Contact *c, double dt); /* makes all lists at the positions of now */
/* Lists the groups that became too fast for their list; then another look is due, and true. */
bool obstacle_search(Contact *c, double dt);
void obstacle_look(Contact *c);                       /* at all that are due by their path */
void obstacle_find(Contact *c, double dt);            /* the touches that are near now */
void obstacle_forget(const Contact *c, Touch *touch); /* its bristles */
void obstacle_forget_sides(const Contact *c, Touch *touch, unsigned sides);
/* Copies out the stretched bristles of sides and faces, at most `room`; returns how many. */
int obstacle_remember(const Contact *c, PairMemory *memory, int room);
ParallelLoop obstacle_advance_loop(Contact *c); /* moves all paths on by this step */

/* obstacle_motion.c */
void obstacle_place(Contact *c, int obstacle); /* its frame, from its pose */
/* Where the programmes lead in a step of dt that ends at time_end: c->programmes. */
void obstacle_demand(Contact *c, double dt, double time_end);
/* [m/s] of a moving solid at a point, from its demanded motion */
Vec3 obstacle_velocity(const Contact *c, int obstacle, Vec3 point, double dt);
/* [m] how far it will reach along the normal beyond the plane of now */
double obstacle_reach(const Contact *c, const Touch *touch);
/* Moves all obstacles there, or as far as the cloth lets them. */
void obstacle_move(Contact *c, double dt);

/* obstacle.c: forces and guard */
/* Does one that is near push, at its vertex or face? */
bool obstacle_pushes(const Contact *c, const Touch *touch);
double touch_friction(const Contact *c, const Touch *touch); /* mu */
void obstacle_create_sides(Contact *c, Arena *arena);
/* Sides have no bristles but those that are remembered, if any. */
void obstacle_begin_sides(Contact *c, bool remembered);
/* As their namesakes in self.h: */
void obstacle_forces(Contact *c, double dt, double share);
void obstacle_refresh(Contact *c, double dt);
void obstacle_impulses(Contact *c, double dt);
void obstacle_shorten(Contact *c, double dt);
bool obstacle_check(Contact *c, double dt);
double obstacle_energy(Contact *c, double dt);

#endif
