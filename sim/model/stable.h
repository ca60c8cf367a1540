/* stable.h: the largest explicit step of a cloth whose frequencies have no closed form, and what bounds
 * its damping. */
#ifndef TOILE_MODEL_STABLE_H
#define TOILE_MODEL_STABLE_H

#include "sim/model/model.h"

/* [s] 2 / the fastest frequency at the start, by the power method on differences of the model's
 * gradient. */
double stable_step_by_power(const Cloth *cloth);

/* ClothModel.fastest: of a lattice with these bending stiffnesses [N m] and its material; by the power method on
 * add_damped_gradient, for cloth that is damped. */
Fastest fastest_of_lattice(const Cloth *cloth, double d11, double d22);
Fastest fastest_by_power(const Cloth *cloth);

#endif
