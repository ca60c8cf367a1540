/* choose.h: what a step costs, for `stepper: auto` and for `toile check`. Fixed numbers, measured on
 * one core of a Xeon with AVX-512 (make bench SUITE=sweep, implicit, auto) and good to a factor 2,
 * so that a scene takes the same stepper on every machine. */
#ifndef TOILE_STEP_CHOOSE_H
#define TOILE_STEP_CHOOSE_H

#include "sim/step/system.h"

#define CHOOSE_IMPLICIT_STEP (1.0 / 60.0) /* [s] of bdf2 when a scene gives none */

/* [s] CPU time of one explicit step, of one implicit step. */
double choose_explicit_cost(const System *system);
double choose_implicit_cost(const System *system);

#endif
