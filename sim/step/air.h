/* air.h: the push of the air against the face of the cloth, beyond the drag that is part of a
 * kick: c (w - v).n n per area, with c = air.normal_drag, w the wind, v and n velocity and unit
 * normal of a triangle; a third of it goes to each corner. It lets a flag wave: cloth that lies
 * along the wind is not pushed, cloth across it is. */
#ifndef TOILE_STEP_AIR_H
#define TOILE_STEP_AIR_H

#include "sim/geom/lanes.h"
#include "sim/model/model.h"

/* Adds to lanes->f [N]; returns the power [W] at the velocities of now. slot: (node_count) of this
 * cloth. */
double air_add_push(const AirDef *air, const Cloth *cloth, const Lanes *lanes, const int *slot);

#endif
