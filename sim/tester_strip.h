/* tester_strip.h: testers that wait for the equilibrium of a strip, along the warp and the weft:
 *
 *   tensile:    20 x 5 cm, both short ends held across their width and pulled apart, up to 500 N/m or
 *               the stretch limit of the fabric. Ends that cannot narrow stiffen the strip (by
 *               1 / (1 - nu12 nu21) if it were short), so the strain is that of the middle half.
 *               Springs narrow by their diagonals only, particles not at all.
 *   cantilever: ASTM D1388, 2.5 cm wide, slid out under its own weight until its tip lies on the plane
 *               41.5 degrees below the edge. c = overhang / 2, B = weight g c^3. The elastica has
 *               rho g l^3 / B = 8.00419703 there: the rule reads B 0.05 % too large.
 *
 * The strips are elastic: 2HB and 2HG of the fabric are left out. */
#ifndef TOILE_SIM_TESTER_STRIP_H
#define TOILE_SIM_TESTER_STRIP_H

#include "sim/step/system.h"

typedef enum StripWay { STRIP_WARP, STRIP_WEFT } StripWay;

/* A strip along x from 0 to its length, and its system; do not move it once made. */
typedef struct Strip {
    Arena arena;
    ClothDef def;
    HandleDef ends[2];
    Scene scene;
    System system;
    State state;
    bool weft;
    int along, across; /* nodes */
} Strip;

/* `nodes` along and across; both ends held, or the first clamped. Errors: EXIT_BAD_INPUT. */
bool strip_create(Strip *strip, const Fabric *fabric, const char *model, StripWay way,
                  const double size[2], const int nodes[2], bool pulled, Error *error);
void strip_destroy(Strip *strip);
/* place of the node i along, j across; and its share of the width */
int strip_node(const Strip *strip, int i, int j);
double strip_share(const Strip *strip, int j);

typedef struct TesterPull {
    int count;         /* of rows */
    double *strain;    /* (count) of the middle half, rising */
    double *force;     /* [N/m] per width at rest */
    double *narrowing; /* of the middle / strain */
    double stiffness;  /* [N/m] E, from strains up to 2e-4 */
    double poisson;    /* narrowing there */
} TesterPull;

/* `steps` up to the limit, or fewer up to 500 N/m. Errors: EXIT_BAD_INPUT; EXIT_DIFFERS when no
 * equilibrium is found. */
bool tester_pull(const Fabric *fabric, const char *model, StripWay way, int steps, Arena *arena,
                 TesterPull *pull, Error *error);

typedef struct TesterHang {
    int count;               /* nodes along the strip */
    double *at;              /* [m] (count) from the edge, along the strip */
    double *reach, *drop;    /* [m] (count) of its middle line */
    double overhang, length; /* [m] l, c = l / 2 */
    double stiffness;        /* [N m] B = weight g c^3 */
} TesterHang;

/* `segments` along the overhang. Errors likewise. */
bool tester_hang(const Fabric *fabric, const char *model, StripWay way, int segments, Arena *arena,
                 TesterHang *hang, Error *error);

/* The heavy elastica of gamma = rho g l^3 / B, clamped level: places over l at s = k / (count - 1). */
void tester_elastica(double gamma, int count, double *reach, double *drop);

#endif
