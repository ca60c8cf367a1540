/* repel.h: the force that keeps Breen's particles (1994) a spacing s apart,
 *   R(r) = C0 ((s - r) / s)^5 s / r   for r < s,
 * between particles that share no unit: neither near each other on a thread nor in one cell. It holds
 * layers 2 cm apart where cloth is 0.4 mm thick, lets a particle slip through the middle of a cell, and
 * stiffens sheared cells; contact stands in its place, this is to compare with. */
#ifndef TOILE_MODEL_REPEL_H
#define TOILE_MODEL_REPEL_H

#include "sim/geom/box_tree.h"
#include "sim/model/panel.h"

typedef struct Repel {
    double spacing, strength; /* [m] s, [J] C0 */
    int nu, node_count;
    bool wrap;
    Arena *arena;
    BoxTree tree;
    Box *places; /* (node_count) when the pairs were found */
    int *pairs;  /* (pair_count x 2) that may come near before a particle has moved by s/4 */
    int pair_count, pair_room;
    bool found;
} Repel;

/* start: [m] (node_count x 3). */
Repel *repel_create(const Panel *panel, double strength, const double *start, Arena *arena);

/* Both find the pairs anew when a particle has moved too far. */
double repel_energy(Repel *repel, const double *x);
void repel_add_gradient(Repel *repel, const double *x, double *gradient);

#endif
