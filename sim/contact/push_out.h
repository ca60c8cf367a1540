/* push_out.h: cloth that starts in a solid is moved out of it. */
#ifndef TOILE_CONTACT_PUSH_OUT_H
#define TOILE_CONTACT_PUSH_OUT_H

#include "sim/contact/contact.h"

typedef struct PushOut {
    int moved, farthest; /* vertices; the one that moved most, -1: none */
    double way;          /* [m] of that one */
} PushOut;

/* Moves vertices and triangles that are nearer to a solid than half the contact distance, or inside,
 * along the shortest way to that distance. Held vertices stay, meshes do not count. Cloth that a solid
 * pierces cannot be moved out so: the exact check tells.
 * poses: (obstacle_count); held: (vertex_count); x: [m] (vertex_count x 3). */
PushOut push_out(const ContactDef *def, const Pose *poses, const unsigned char *held, double *x);

#endif
