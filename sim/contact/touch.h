/* touch.h: cloth at convex solids on the explicit road: what is kept of each vertex and triangle, and
 * what the files that keep it offer to the others of the explicit contact (engine.h). */
#ifndef TOILE_CONTACT_TOUCH_H
#define TOILE_CONTACT_TOUCH_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/base/vec.h"
#include "sim/contact/contact.h"

/* A vertex (place[1] < 0) or a triangle at an obstacle. What every step asks of a vertex over a flat
 * face lies in one cache line. */
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
    Vec3 bristle; /* of a triangle */
} Touch;

/* A group at an obstacle: the same rules as for a GroupPair. */
typedef struct GroupTouch {
    double path, limit, near, speed;
    double earliest;  /* [m] path at which the first of its touches must be looked at */
    double gap;       /* [m] smallest distance of those that are near */
    double dhat;      /* [m] contact distance, where there are touches: a group is of one cloth */
    int begin, count; /* its touches */
    int looked, near_count; /* at the last look: triangles that were due; touches that are near */
} GroupTouch;

/* Distance and normal of a vertex at an obstacle, kept while positions stay. */
typedef struct VertexDistance {
    long stamp;
    double distance;
    Vec3 place, normal; /* in the frame of the obstacle */
} VertexDistance;

/* A pose as its axes, which is quicker to apply. */
typedef struct Frame {
    Vec3 origin, axis[3];
} Frame;

static inline int touch_corners(const Touch *touch) { return touch->place[1] < 0 ? 1 : 3; }

/* obstacle_distance.c: distance, normal, feature of a touch at the positions of now. A vertex is known
 * from then on to the triangles at it. */
void obstacle_evaluate(Contact *c, const Points *x, Touch *touch);
/* [m] how far a vertex can go until that must be done again: on a flat face to its end, elsewhere a
 * small share of the contact distance; -1: not at all. Until then it is as far as from its plane. */
double obstacle_frozen(const Contact *c, const Touch *touch);
void obstacle_project(const Points *x, Touch *touch);

/* obstacle_lists.c: touches that are near */
void obstacle_begin(Contact *c, double dt);
/* Searches the groups that spent their path, or that became too fast for their list; then another
 * look is due, and true. */
bool obstacle_search(Contact *c, bool by_path, double dt);
void obstacle_look(Contact *c);                       /* at all that are due by their path */
void obstacle_find(Contact *c, double dt);            /* the touches that are near now */
void obstacle_forget(const Contact *c, Touch *touch); /* its bristle */
void obstacle_restore(Contact *c, int first); /* kept bristles to the touches from `first` on */
int obstacle_remember(const Contact *c, PairMemory *memory, int room);

/* obstacle_motion.c */
void obstacle_place(Contact *c, int obstacle); /* its frame, from its pose */
void obstacle_demand(Contact *c, double dt, double time_end);
/* [m/s] of a moving solid at a point, from its demanded motion */
Vec3 obstacle_velocity(const Contact *c, int obstacle, Vec3 point, double dt);
/* [m] how far it will reach along the normal beyond the plane of now */
double obstacle_reach(const Contact *c, const Touch *touch);
void obstacle_move(Contact *c, double dt);

/* obstacle.c: forces and guard */
double touch_friction(const Contact *c, const Touch *touch); /* mu */
void obstacle_forces(Contact *c, double dt, double share);
void obstacle_refresh(Contact *c, double dt);
void obstacle_impulses(Contact *c, double dt);
void obstacle_shorten(Contact *c, double dt);
void obstacle_advance(Contact *c, double dt);
bool obstacle_check(Contact *c, double dt);
double obstacle_energy(Contact *c, double dt);

#endif
