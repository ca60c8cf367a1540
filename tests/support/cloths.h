/* cloths.h: small cloths made by code, for tests and benchmarks of models and steppers. */
#ifndef TOILE_TESTS_CLOTHS_H
#define TOILE_TESTS_CLOTHS_H

#include "sim/model/model.h"
#include "sim/scene/scene.h"
#include "sim/step/system.h"

/* Fabric with the given constants in SI; isotropic when stiffnesses are equal. */
Fabric cloths_fabric(double weight, double stretch, double poisson, double bending,
                     double bending_poisson);
/* Orthotropic, all constants different. */
Fabric cloths_orthotropic(void);

ClothDef cloths_rectangle(double width, double height, int nu, int nv, Fabric fabric);
ClothDef cloths_sleeve(double radius, double length, int nu, int nv, bool curved, Fabric fabric);

/* A scene of one cloth, without anything else. */
Scene cloths_scene(ClothDef *cloth);

/* Smooth and rough random displacement of all places, amplitude in metres. */
void cloths_shake(double *x, int places, double amplitude, uint64_t seed);

#endif
