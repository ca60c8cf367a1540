/* fabric.h: a measured fabric, as its file states it and in SI.
 *
 * File format and rules: docs in assets/fabrics/README.md; units by UDUNITS-2. A fabric holds
 * numbers for 1 m of width; thickness offsets contact and never enters a stiffness. */
#ifndef TOILE_SCENE_FABRIC_H
#define TOILE_SCENE_FABRIC_H

#include <stdbool.h>
#include <stdio.h>

#include "sim/base/arena.h"
#include "sim/base/error.h"

typedef enum FabricFlag {
    FABRIC_STATED, /* given by the user without provenance */
    FABRIC_MEASURED,
    FABRIC_DERIVED,
    FABRIC_ESTIMATED,
    FABRIC_RECALLED,
    FABRIC_FALLBACK /* left out, filled in by toile */
} FabricFlag;

typedef struct FabricNumber {
    double value;     /* SI */
    double low, high; /* SI; NAN when not given */
    FabricFlag flag;
    const char *written; /* as in the file, "0.067 gf*cm2/cm"; NULL for a fallback */
    const char *from;    /* where it comes from; NULL */
} FabricNumber;

typedef struct Fabric {
    const char *name, *about, *source, *licence;
    FabricNumber weight;                     /* [kg/m2] areal density */
    FabricNumber thickness;                  /* [m] */
    FabricNumber bend_warp, bend_weft;       /* [N m] bending rigidity per width, D11, D22 */
    FabricNumber bend_bias;                  /* [N m] rigidity of a strip cut at 45 degrees */
    FabricNumber bend_poisson;               /* D12 = this * sqrt(D11 D22); 0 */
    FabricNumber bend_hysteresis;            /* [N] 2HB, the full width of the loop */
    FabricNumber bend_onset;                 /* [1/m] curvature at which yarns slip */
    FabricNumber stretch_warp, stretch_weft; /* [N/m] E1, E2: Young's modulus times thickness */
    FabricNumber stretch_poisson;            /* nu12 */
    FabricNumber stretch_limit;              /* Green strain where the cloth locks */
    FabricNumber shear;                      /* [N/m] G per radian of shear angle */
    FabricNumber shear_hysteresis;           /* [N/m] 2HG at 0.5 degrees */
    FabricNumber friction;                   /* cloth against a smooth solid */
    double threads_per_cm;                   /* [1/cm] for the picture only; 20 */
} Fabric;

/* What a model computes with (mlpg.md 1.2, 1.3; fabrics.md 1). */
typedef struct Material {
    double density;            /* [kg/m2] */
    double c11, c12, c22, c66; /* [N/m] membrane: C11 = E1 / (1 - nu12 nu21), ... */
    double d11, d12, d22, d66; /* [N m] bending, D66 = twist (isotropic: (1 - nu) D / 2) */
    double thickness, friction;
} Material;

Material fabric_material(const Fabric *fabric);

/* The fabric of a given areal weight [kg/m2] when nothing else is known (fabrics.md 5). */
Fabric fabric_from_weight(double weight);

/* Reads assets/fabrics/NAME.yaml (or a path with a '/' or ending in .yaml). */
bool fabric_read(const char *name_or_path, Arena *arena, Fabric *fabric, Error *error);

/* `toile fabrics` and `toile fabrics NAME`. */
bool fabric_print_list(FILE *out, bool json, Error *error);
bool fabric_print(const char *name, FILE *out, bool json, Error *error);

#endif
