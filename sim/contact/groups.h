/* groups.h: how the groups of a surface move in a step, each (motion.h) and all of them together. Not for others
 * than the files of the explicit contact. */
#ifndef TOILE_CONTACT_GROUPS_H
#define TOILE_CONTACT_GROUPS_H

#include <stdbool.h>

#include "sim/contact/contact.h"
#include "sim/contact/motion.h"

typedef struct GroupsMove GroupsMove;

typedef struct Groups {
    MotionRows rows;         /* where their vertices lie in the lanes */
    int *begin;              /* (places + 1) of each place's in of_vertex */
    int *of_vertex;          /* groups that have it */
    GroupMotion *motion;     /* (group_count) in this step */
    Vec3 mean;               /* [m/s] of groups of cloth in the last step */
    double fastest_relative; /* [m/s] no group is faster against `mean` */
    bool outgrown;           /* does a group move too fast for its `near` at a solid? */
    bool narrow;             /* ... so fast that the guard has to look at touches? */
    GroupsMove *moves;       /* of chunks of them */
} Groups;

/* vertex_count: of the cloth; `places`: with those of meshes. */
Groups groups_create(const Surface *surface, int vertex_count, int places, Arena *arena);

/* Velocities from the lanes, and how groups move by them in a step of dt [s]. */
void contact_move_groups(Contact *c, double dt);
/* ... those with vertices that the guard changed */
void contact_move_changed_groups(Contact *c, double dt);

#endif
