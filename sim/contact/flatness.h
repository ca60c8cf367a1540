/* flatness.h: a certificate that two neighbouring groups of a lattice are so flat that no two of
 * their features are near (contact.md, Lists): features without a common vertex are at least an altitude
 * of a triangle apart in the plane, and slopes.h bounds how much nearer they come. */
#ifndef TOILE_CONTACT_FLATNESS_H
#define TOILE_CONTACT_FLATNESS_H

#include "sim/contact/slope_batch.h"
#include "sim/contact/slopes.h"

typedef struct Flatness {
    const SlopeKernel *kernel;
    double *altitude; /* [m] (panel_count) of lattices: material distance of such features */
    Slopes *slopes;   /* (group_count) of lattice groups, at the positions they were fitted to */
} Flatness;

Flatness flatness_create(const Surface *surface, Arena *arena);

/* Slopes of these lattice groups at positions x. */
void flatness_fit(const Flatness *flatness, const Surface *surface, const Points *x,
                  const int *groups, int count);

/* Is a lattice at places x so flat as a whole that it is the graph of a function over a plane? Then it does not
 * meet itself. False where that is not known, and where u runs around. */
bool flatness_is_graph(const SurfacePanel *panel, const Points *x);

/* s_min of the matrix of two gradients. */
double flatness_stretch(Vec3 a, Vec3 b);

/* -1, 0, 1: from a block to its neighbour, of `count` in a row; 2: farther. */
static inline int flatness_step(int from, int to, int count, bool wrap) {
    int step = to - from;
    if (wrap && step == count - 1) {
        step = -1;
    } else if (wrap && step == 1 - count) {
        step = 1;
    }
    return step < -1 || step > 1 ? 2 : step;
}

/* The groups of the rectangle of blocks that holds two neighbouring ones, each once: 1, 2 or 4; 0
 * where two groups are no neighbours on a lattice. */
int flatness_groups(const Surface *surface, int first, int second, int group[4]);

/* [m] lower bound of the distance of features of two groups without a common vertex; at most 0
 * where there is no certificate. The slopes of flatness_groups are those at the positions of now. */
double flatness_distance(const Flatness *flatness, const Surface *surface, int first, int second);

#endif
