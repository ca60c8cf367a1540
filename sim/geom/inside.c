#include "sim/geom/inside.h"

#include <math.h>

#define REACH 2.5       /* rho / spacing: 1.5 leaves holes between jittered nodes */
#define THRESHOLD 0.025 /* det M on a straight border, one node for each spacing^2 */
#define NEAREST 48      /* nodes looked at; some 20 are within reach */

/* Wendland's C2 function of r = distance / rho */
static double weight(double r) {
    double rest = r < 1.0 ? 1.0 - r : 0.0, square = rest * rest;
    return square * square * (4.0 * r + 1.0);
}

double inside_determinant(const PointGrid *grid, const double at[2]) {
    int nodes[STENCIL_CAPACITY];
    int count = points_nearest(grid, at, NEAREST, nodes);
    double rho = REACH * grid->spacing;
    double m = 0.0, mu = 0.0, mv = 0.0, muu = 0.0, muv = 0.0, mvv = 0.0;
    for (int i = 0; i < count; i++) {
        double u = (at[0] - grid->points[2 * nodes[i]]) / rho;
        double v = (at[1] - grid->points[2 * nodes[i] + 1]) / rho;
        double w = weight(sqrt(u * u + v * v));
        m += w, mu += w * u, mv += w * v;
        muu += w * u * u, muv += w * u * v, mvv += w * v * v;
    }
    return m * (muu * mvv - muv * muv) - mu * (mu * mvv - muv * mv) + mv * (mu * muv - muu * mv);
}

bool inside_contains(const PointGrid *grid, const double at[2]) {
    return inside_determinant(grid, at) > THRESHOLD;
}
