/* touch.h: cloth at convex solids on the explicit road: what is kept of each vertex and triangle. */
#ifndef TOILE_CONTACT_TOUCH_H
#define TOILE_CONTACT_TOUCH_H

#include <stdbool.h>

#include "sim/base/vec.h"

/* A vertex (place[1] < 0) or a triangle at an obstacle. */
typedef struct Touch {
    int obstacle, owner; /* owner: which group at which obstacle */
    int place[3];
    double distance; /* [m] */
    double frozen;   /* [m] of a vertex: path of its group until which normal and point stay */
    Vec3 normal;     /* from the obstacle to the cloth */
    Vec3 point;      /* closest point of the obstacle */
    double weight[3];
    int feature;   /* corners that hold the closest point of the cloth */
    bool spare;    /* a triangle over a flat face: the planes of its corners do for it */
    double margin; /* [m] of motion while it stays spare */
    Vec3 bristle;
} Touch;

/* A group at an obstacle: the same rules as for a GroupPair. */
typedef struct GroupTouch {
    double path, limit, near, speed;
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

#endif
