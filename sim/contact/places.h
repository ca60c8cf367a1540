/* places.h: the vertices that contact sees, those of the cloth and then those of every mesh. */
#ifndef TOILE_CONTACT_PLACES_H
#define TOILE_CONTACT_PLACES_H

#include "sim/contact/contact.h"

typedef struct Places {
    int count;
    bool meshes;      /* are there any? */
    int *mesh_first;  /* (obstacle_count + 1) first place of each obstacle; a solid has none */
    int *obstacle_of; /* (panels of the surface) -1: cloth */
    Surface surface;  /* cloth, and a panel for every mesh */
    double *x;        /* [m] (count x 3) the start of cloth; meshes as they were read */
} Places;

Places places_create(const ContactDef *def, Arena *arena);

/* The mesh that a place belongs to, or -1. */
static inline int places_obstacle(const Places *places, int place) {
    return places->obstacle_of[places->surface.panel_of[place]];
}

/* x: [m] (vertices of the mesh x 3) at `clock` [s] of the programme whose pose is `pose`. */
void places_pose(const ContactObstacle *obstacle, Pose pose, double clock, double *x);

#endif
