/* stable.h: the largest explicit step of a cloth whose frequencies have no closed form, and what bounds
 * its damping. */
#ifndef TOILE_MODEL_STABLE_H
#define TOILE_MODEL_STABLE_H

#include "sim/model/model.h"

/* [s] 2 / the fastest frequency at the start, by the power method on differences of the model's
 * gradient. */
double stable_step_by_power(const Cloth *cloth);

/* Cloth.limits of a lattice, from its material. */
SweepLattice damping_limits(const Cloth *cloth);

#endif
