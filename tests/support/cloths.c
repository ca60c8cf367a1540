#include "tests/support/cloths.h"

#include <math.h>

#include "sim/base/hash.h"

static FabricNumber stated(double value) {
    return (FabricNumber){.value = value, .low = NAN, .high = NAN, .flag = FABRIC_STATED};
}

Fabric cloths_fabric(double weight, double stretch, double poisson, double bending,
                     double bending_poisson) {
    Fabric f = fabric_from_weight(0.2);
    f.name = "test";
    f.weight = stated(weight);
    f.stretch_warp = f.stretch_weft = stated(stretch);
    f.stretch_poisson = stated(poisson);
    f.shear = stated(stretch / (2.0 * (1.0 + poisson)));
    f.bend_warp = f.bend_weft = stated(bending);
    f.bend_poisson = stated(bending_poisson);
    fabric_set_twist(&f, 0.5 * (1.0 - bending_poisson) * bending);
    return f;
}

Fabric cloths_orthotropic(void) {
    Fabric f = cloths_fabric(0.17, 900.0, 0.25, 3e-5, 0.1);
    f.stretch_weft = stated(500.0);
    f.shear = stated(60.0);
    f.bend_weft = stated(1.7e-5);
    return f;
}

ClothDef cloths_rectangle(double width, double height, int nu, int nv, Fabric fabric) {
    ClothDef def = cloth_default();
    def.bending_damping = def.membrane_damping = 0.0; /* energy is compared */
    def.name = "cloth";
    def.shape.kind = SHAPE_RECTANGLE;
    def.shape.width = width;
    def.shape.height = height;
    def.nodes[0] = nu;
    def.nodes[1] = nv;
    def.fabric = fabric;
    return def;
}

ClothDef cloths_sleeve(double radius, double length, int nu, int nv, bool curved, Fabric fabric) {
    ClothDef def = cloths_rectangle(0, 0, nu, nv, fabric);
    def.shape.kind = SHAPE_SLEEVE;
    def.shape.radius = radius;
    def.shape.length = length;
    def.shape.rest_curved = curved;
    return def;
}

Scene cloths_scene(ClothDef *cloth) {
    Scene scene = scene_default();
    scene.path = "test.yaml";
    scene.text = "";
    scene.title = "test";
    scene.cloth_count = 1;
    scene.cloths = cloth;
    return scene;
}

void cloths_shake(double *x, int places, double amplitude, uint64_t seed) {
    for (int i = 0; i < 3 * places; i++) {
        x[i] += amplitude * hash_random(seed, (uint64_t)i);
    }
}
