#include "sim/geom/inside.h"

#include <math.h>

#define REACH 2.5       /* rho / spacing: 1.5 leaves holes between jittered nodes */
#define THRESHOLD 0.106 /* the offset on a straight border */
#define NEAREST 48      /* nodes looked at; some 20 are within reach */

/* Wendland's C2 function of r = distance / rho */
static double weight(double r) {
    double rest = r < 1.0 ? 1.0 - r : 0.0, square = rest * rest;
    return square * square * (4.0 * r + 1.0);
}

double inside_offset(const PointGrid *grid, const double at[2]) {
    int nodes[STENCIL_CAPACITY];
    int count = points_nearest(grid, at, NEAREST, nodes);
    double rho = REACH * grid->spacing, m = 0.0, mu = 0.0, mv = 0.0;
    for (int i = 0; i < count; i++) {
        double u = (grid->points[2 * nodes[i]] - at[0]) / rho;
        double v = (grid->points[2 * nodes[i] + 1] - at[1]) / rho;
        double w = weight(sqrt(u * u + v * v));
        m += w, mu += w * u, mv += w * v;
    }
    return m > 0.0 ? hypot(mu, mv) / m : INFINITY;
}

bool inside_contains(const PointGrid *grid, const double at[2]) {
    return inside_offset(grid, at) < THRESHOLD;
}
