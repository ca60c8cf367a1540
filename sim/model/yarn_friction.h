/* yarn_friction.h: hysteresis of woven cloth: yarns that stick and slip on each other, in bending and
 * in shear, beside the elastic cloth of any model on a lattice.
 *
 * Each unit holds FRICTION_ELEMENTS elastic-perfectly-plastic elements in parallel, all with the
 * stiffness 2 HB'/(N K1) and with limits HB' (2a - 1)/N^2, so that together they give HB' = 2HB/2
 * beyond the onset K1. An element that has slipped by p stores
 *     H(e) = k e^2/2,  |e| <= f/k;   f |e| - f^2/(2k) beyond;   e = q - p
 * with all f times `wide`: stored plus dissipated work, convex, with exact gradient, so that line searches
 * and energy gates hold; q is the signed curvature of a thread or the signed shear angle of a cell. The slips p are the
 * history of the cloth. They change when an accepted step is committed, and in no other place: exact
 * return mapping, the same loop for any step, and no creep.
 *
 * In shear the loop widens from 2HG at 0.5 to 2HG5 at 5 degrees, and not beyond: `wide` follows the
 * angle that was committed last, so that a step has a potential. */
#ifndef TOILE_MODEL_YARN_FRICTION_H
#define TOILE_MODEL_YARN_FRICTION_H

#include "sim/model/model.h"

#define FRICTION_ELEMENTS 4 /* N; the virgin curve is met within 1/(4 N^2) of HB' */

/* Puts friction beside the model of a cloth that has been created: its model becomes one that does
 * both. Errors: EXIT_BAD_INPUT on scattered nodes. */
bool yarn_friction_attach(Cloth *cloth, Arena *arena, Error *error);

/* The law of a unit. */
typedef struct FrictionLaw {
    double step, onset; /* HB' [N], K1 [1/m], or HG' [N/m], phi1 [rad] */
    double wide;        /* factor on all limits; 1 */
} FrictionLaw;

/* Of bending along warp or weft, or of shear at this angle [rad]. */
FrictionLaw yarn_friction_law(const Fabric *fabric, FabricCurveKind kind, double angle);

/* [N] or [N/m] of the elements of one unit at q; potential and tangent unless NULL. slips: (N). */
double yarn_friction_force(FrictionLaw law, const double *slips, double q, double *potential,
                           double *tangent);
/* the slips after q has been accepted */
void yarn_friction_slip(FrictionLaw law, double q, double *slips);

#endif
