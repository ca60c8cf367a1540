#include "sim/scene/fabric.h"

#include <math.h>
#include <string.h>

#define GRAVITY 9.80665 /* [m/s2] in the definition of the bending length */

/* medians of 618 real fabrics by weight; a fabric that has its own number never sees these */
#define FALLBACK_LENGTH 0.0195     /* [m] bending length at the reference weight */
#define FALLBACK_LENGTH_WEIGHT 0.2 /* [kg/m2] */
#define FALLBACK_LENGTH_EXPONENT 0.095
#define FALLBACK_WARP 1.19 /* warp rigidity / mean */
#define FALLBACK_WEFT 0.81
#define FALLBACK_TWIST 0.41      /* D66 / sqrt(D11 D22) */
#define FALLBACK_HYSTERESIS 45.0 /* [1/m] 2HB / B */
#define FALLBACK_ONSET 15.0      /* [1/m] */
#define FALLBACK_BULK 450.0      /* [kg/m3] weight / thickness */
#define FALLBACK_STRETCH 3000.0  /* [N/m] warp; half of it along the weft */
#define FALLBACK_POISSON 0.2
#define FALLBACK_SHEAR 45.0           /* [N/m] */
#define FALLBACK_SHEAR_HYSTERESIS 0.5 /* [N/m] */
#define FALLBACK_LIMIT 0.06           /* Green strain */
#define FALLBACK_FRICTION 0.3
#define FALLBACK_THREADS 20.0 /* [1/cm] */

static const FabricNumber unknown = {.value = NAN, .low = NAN, .high = NAN};

Fabric fabric_unknown(void) {
    return (Fabric){.weight = unknown,
                    .thickness = unknown,
                    .bend_warp = unknown,
                    .bend_weft = unknown,
                    .bend_bias = unknown,
                    .bend_poisson = unknown,
                    .bend_hysteresis = unknown,
                    .bend_onset = unknown,
                    .stretch_warp = unknown,
                    .stretch_weft = unknown,
                    .stretch_poisson = unknown,
                    .stretch_limit = unknown,
                    .shear = unknown,
                    .shear_hysteresis = unknown,
                    .shear_hysteresis5 = unknown,
                    .friction = unknown,
                    .threads_per_cm = FALLBACK_THREADS};
}

double fabric_bending_length(const Fabric *fabric, double rigidity) {
    return cbrt(rigidity / (fabric->weight.value * GRAVITY));
}

static void fill(FabricNumber *number, double value) {
    if (isnan(number->value)) {
        *number = (FabricNumber){
            .value = value, .low = NAN, .high = NAN, .flag = FABRIC_FALLBACK, .from = "left out"};
    }
}

static void fill_bending(Fabric *fabric) {
    double w = fabric->weight.value;
    double length = FALLBACK_LENGTH * pow(w / FALLBACK_LENGTH_WEIGHT, FALLBACK_LENGTH_EXPONENT);
    double mean = w * GRAVITY * length * length * length;
    if (!isnan(fabric->bend_warp.value)) {
        mean = fabric->bend_warp.value / FALLBACK_WARP;
    } else if (!isnan(fabric->bend_weft.value)) {
        mean = fabric->bend_weft.value / FALLBACK_WEFT;
    }
    fill(&fabric->bend_warp, FALLBACK_WARP * mean);
    fill(&fabric->bend_weft, FALLBACK_WEFT * mean);
}

/* B45 of the strip whose twist is `d66`; the inverse of twist_from_bias */
static double bias_from_twist(double d11, double d12, double d22, double d66) {
    double bend = (d11 + d22 - 2.0 * d12) / (d11 * d22 - d12 * d12);
    return 4.0 / (1.0 / d66 + bend);
}

/* 1/D66 = 4/B45 - (D11 + D22 - 2 D12) / (D11 D22 - D12^2); not positive: no such cloth */
static double twist_from_bias(double d11, double d12, double d22, double bias) {
    double bend = (d11 + d22 - 2.0 * d12) / (d11 * d22 - d12 * d12);
    return 1.0 / (4.0 / bias - bend);
}

void fabric_set_twist(Fabric *fabric, double twist) {
    double d11 = fabric->bend_warp.value, d22 = fabric->bend_weft.value;
    double d12 = fabric->bend_poisson.value * sqrt(d11 * d22);
    fabric->bend_bias.value = bias_from_twist(d11, d12, d22, twist);
}

void fabric_fill(Fabric *fabric) {
    fill_bending(fabric);
    double d11 = fabric->bend_warp.value, d22 = fabric->bend_weft.value;
    bool isotropic = fabric->isotropic;
    fill(&fabric->bend_poisson, 0.0);
    if (isnan(fabric->bend_bias.value)) {
        fill(&fabric->bend_bias, 0.0);
        fabric_set_twist(fabric, FALLBACK_TWIST * sqrt(d11 * d22));
    }
    fill(&fabric->bend_hysteresis, isotropic ? 0.0 : FALLBACK_HYSTERESIS * 0.5 * (d11 + d22));
    fill(&fabric->bend_onset, FALLBACK_ONSET);
    fill(&fabric->thickness, fabric->weight.value / FALLBACK_BULK);
    if (isnan(fabric->stretch_warp.value) && isnan(fabric->stretch_weft.value)) {
        fill(&fabric->stretch_warp, FALLBACK_STRETCH);
    }
    fill(&fabric->stretch_warp, 2.0 * fabric->stretch_weft.value);
    fill(&fabric->stretch_weft, 0.5 * fabric->stretch_warp.value);
    double largest = sqrt(fabric->stretch_warp.value / fabric->stretch_weft.value);
    fill(&fabric->stretch_poisson, fmin(FALLBACK_POISSON, 0.5 * largest));
    fill(&fabric->stretch_limit, isotropic ? INFINITY : FALLBACK_LIMIT);
    fill(&fabric->shear, FALLBACK_SHEAR);
    fill(&fabric->shear_hysteresis, isotropic ? 0.0 : FALLBACK_SHEAR_HYSTERESIS);
    fill(&fabric->shear_hysteresis5, fabric->shear_hysteresis.value);
    fill(&fabric->friction, FALLBACK_FRICTION);
}

Fabric fabric_from_weight(double weight) {
    Fabric fabric = fabric_unknown();
    fabric.name = "estimated";
    fabric.weight = (FabricNumber){.value = weight, .low = NAN, .high = NAN};
    fabric_fill(&fabric);
    return fabric;
}

Material fabric_material(const Fabric *fabric) {
    double e1 = fabric->stretch_warp.value, e2 = fabric->stretch_weft.value;
    double nu12 = fabric->stretch_poisson.value, nu21 = nu12 * e2 / e1;
    double d11 = fabric->bend_warp.value, d22 = fabric->bend_weft.value;
    double d12 = fabric->bend_poisson.value * sqrt(d11 * d22);
    double bias = fabric->bend_bias.value;
    Material material = {.density = fabric->weight.value,
                         .c11 = e1 / (1.0 - nu12 * nu21),
                         .c22 = e2 / (1.0 - nu12 * nu21),
                         .c66 = fabric->shear.value,
                         .d11 = d11,
                         .d12 = d12,
                         .d22 = d22,
                         .thickness = fabric->thickness.value,
                         .friction = fabric->friction.value};
    material.c12 = nu12 * material.c22;
    material.d66 =
        bias > 0.0 ? twist_from_bias(d11, d12, d22, bias) : FALLBACK_TWIST * sqrt(d11 * d22);
    return material;
}
