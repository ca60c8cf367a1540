/* air.h: the air that a scene is in. */
#ifndef TOILE_SCENE_AIR_H
#define TOILE_SCENE_AIR_H

#include <stdbool.h>

#include "sim/base/vec.h"

/* Force per area of cloth with velocity v_r against the air, of which v_n lies along the unit normal n
 * and v_t in the plane:
 *   -(drag v_r + normal_drag v_n n + density / 2 (across |v_n| v_n n + along |v_t| v_t)).
 * The air that the cloth carries along is left out: about 0.9 kg/m2 for a flat sheet of 1 m. */
typedef struct AirDef {
    double drag;          /* [kg/(m2 s)]; 0 */
    double normal_drag;   /* [kg/(m2 s)]; 0 */
    double density;       /* [kg/m3]; 0 */
    double across, along; /* of a plate, 1.2; of its skin, 0.03 */
    Vec3 wind;            /* [m/s]; 0 */
} AirDef;

/* Does a force depend on where faces point? */
static inline bool air_has_faces(const AirDef *air) {
    return air->normal_drag > 0.0 || air->density > 0.0;
}

AirDef air_default(void);

#endif
