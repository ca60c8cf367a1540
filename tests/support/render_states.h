/* render_states.h: states files of made-up motions, for tests of everything that reads states. */
#ifndef TOILE_TESTS_RENDER_STATES_H
#define TOILE_TESTS_RENDER_STATES_H

#include <stdbool.h>

#include "sim/base/error.h"

/* One motion: a closed form, no simulation. */
typedef struct RenderMotion {
    const char *name, *about;
} RenderMotion;

/* The motion "patch": a flat upright sheet with these strains, which moves without turning. */
#define RENDER_PATCH_WARP 0.04
#define RENDER_PATCH_WEFT (-0.03)
#define RENDER_PATCH_SHEAR 0.1 /* [rad] */
#define RENDER_PATCH_SPEED 0.5 /* [m/s] */
/* "roll": bent along the warp without a strain, the face outside. */
#define RENDER_ROLL_RADIUS 0.1 /* [m] */

extern const RenderMotion render_motions[];
extern const int render_motion_count;

/* Writes frames first .. first + frame_count - 1 at 30 frames a second; nodes: about how many
 * along a side. finish: with a DONE record. look: of the cloth, NULL = the motion's own. */
bool render_states_write(const char *motion, const char *path, int first, int frame_count,
                         int nodes, const char *look, bool finish, Error *error);

#endif
