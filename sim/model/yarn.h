/* yarn.h: moment and shear force of woven cloth as curves through the Kawabata numbers (B, 2HB; G,
 * 2HG), not as constants: yarns stick first and slip then.
 *
 *   M(K)   = (B + 2 HB'/K1) K - HB'/K1^2 K^2   up to the onset K1,   HB' + B K beyond;  HB' = 2HB/2
 *   F(phi) the same with G, HG' = 2HG/2, phi1 (force per width where the measuring device holds the
 *          threads' length); its moment about the crossings is tau = F cos(phi).
 * Beyond SHEAR_MEASURED the trellis closes up: tau' = g_e D^2/(lock - phi)^2, twice differentiable,
 * stiffer and stiffer, until tau' is `stiffest`, from where it stays (an explicit step must not meet
 * a singular force). Both curves are odd; K, phi >= 0 here. A measured table stands for either; the
 * trellis then closes up beyond its last angle. */
#ifndef TOILE_MODEL_YARN_H
#define TOILE_MODEL_YARN_H

#include "sim/model/yarn_table.h"

#define SHEAR_MEASURED 0.13962634 /* [rad] 8 degrees: as far as the KES shear tester goes */
#define SHEAR_LOCK 1.05           /* [rad] where the yarns would fill all space */
#define SHEAR_ONSET 0.0087266463  /* [rad] half a degree, estimated */

typedef struct YarnCurve {
    double slope;           /* B [N m] or G [N/m] */
    double step;            /* HB' [N] or HG' [N/m] */
    double onset;           /* K1 [1/m] or phi1 [rad] */
    const YarnTable *table; /* in place of these; NULL */
} YarnCurve;

double yarn_value(const YarnCurve *curve, double at, double *slope); /* *slope unless NULL */
double yarn_work(const YarnCurve *curve, double at);                 /* integral from 0 */
double yarn_stiffest(const YarnCurve *curve);                        /* largest slope */

typedef struct TrellisCurve {
    YarnCurve force;
    double measured; /* [rad] as far as `force` goes: SHEAR_MEASURED, or the end of the table */
    double end[3];   /* tau, tau', work there */
    double from;     /* [rad] from here on the moment is linear */
    double last[3];  /* tau, tau', work there */
} TrellisCurve;

TrellisCurve trellis_curve(YarnCurve force, double stiffest);
double trellis_moment(const TrellisCurve *curve, double phi, double *slope); /* tau [N/m] */
double trellis_work(const TrellisCurve *curve, double phi);                  /* [J/m2] */

#endif
