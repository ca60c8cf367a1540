/* flatness.h: a certificate that two neighbouring groups of a lattice are so flat that no two of
 * their features are near (explicit.md 5). With all gradients of x(u, v) within e of a matrix C,
 *
 *     |x(p) - x(q)| >= (s_min(C) - e) |p - q|,
 *
 * and features without a common vertex are at least an altitude of a triangle apart in the plane. */
#ifndef TOILE_CONTACT_FLATNESS_H
#define TOILE_CONTACT_FLATNESS_H

#include "sim/contact/surface.h"

typedef struct GroupSlopes {
    Box gradient[2]; /* of dx/du, dx/dv over the cells of a lattice group */
    long stamp;      /* of the positions that they belong to */
} GroupSlopes;

/* Bounds of the slopes of a lattice group. */
void flatness_slopes(const Surface *surface, const Points *x, int group, Box gradient[2]);

/* s_min of the matrix of two gradients. */
double flatness_stretch(Vec3 a, Vec3 b);

/* s_min(C) - e, where bounds of slopes hold. */
double flatness_least(const Box gradient[2]);

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

/* The groups of the rectangle of blocks that holds two neighbouring ones (4, some more than once); 0
 * where two groups are no neighbours on a lattice. */
int flatness_groups(const Surface *surface, int first, int second, int group[4]);

/* Finds their slopes for these positions, when that was not done yet. The stamp, never 0, changes when
 * positions change. */
void flatness_refresh(const Surface *surface, GroupSlopes *slopes, const Points *x, long stamp,
                      int first, int second);

/* [m] lower bound of the distance of features of two groups without a common vertex; at most 0
 * where there is no certificate. slopes: (group_count), of those groups at the positions of now. */
double flatness_distance(const Surface *surface, const GroupSlopes *slopes, int first, int second);

#endif
