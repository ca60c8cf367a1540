/* reach.h: do handles ask for more than cloth can be? A path through cloth of length L whose ends are held
 * D apart is D/L times as long, in the mean, whatever the fabric and however slowly it is pulled. */
#ifndef TOILE_REACH_H
#define TOILE_REACH_H

#include "sim/step/system.h"

/* False (EXIT_BAD_INPUT), with the place of the handle, when in some frame of the film two handles hold
 * some path through a cloth at more than ten times its length. Not all such paths are tried. */
bool reach_check(const System *system, Error *error);

#endif
