/* reference.h: what is known exactly about the end of a film; the simulation does not use it. */
#ifndef TOILE_SCENE_REFERENCE_H
#define TOILE_SCENE_REFERENCE_H

#include "sim/base/vec.h"

typedef struct ReferenceDef {
    int cloth;        /* index into Scene.cloths */
    double at[2];     /* [m] (u, v) on its panel */
    Vec3 is;          /* [m] where that point is in the last frame */
    const char *from; /* who says so; NULL */
} ReferenceDef;

#endif
