/* slopes.h: bounds of the gradients of x(u, v) over a block of a lattice, and the certificate that they
 * give. With P the projection on a plane, and |P (G - C)| <= e (Frobenius) for all gradients G,
 *
 *     |x(p) - x(q)| >= |P (x(p) - x(q))| >= (s_min(P C) - e) |p - q|,
 *
 * since the mean gradient from q to p is a mean of those G. The plane is that of C: bending turns
 * gradients out of it, and inside it changes them by the square of the angle only. */
#ifndef TOILE_CONTACT_SLOPES_H
#define TOILE_CONTACT_SLOPES_H

#include "sim/base/vec.h"

typedef struct Slopes {
    Vec3 mean[2];       /* C: of dx/du, dx/dv */
    Vec3 normal;        /* of their plane, a unit vector */
    double flat, steep; /* largest |G - C| within the plane; along the normal */
} Slopes;

/* s_min(P C) - e over several blocks. */
double slopes_least(const Slopes *const part[], int count);

#endif
