/* plan.h: `toile check`: what a run will do, what it will skip and why, and what it will cost. */
#ifndef TOILE_PLAN_H
#define TOILE_PLAN_H

#include "sim/sim.h"

void plan_print(const Sim *sim, FILE *out, bool json);

#endif
