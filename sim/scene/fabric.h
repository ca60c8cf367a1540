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
    const char *written;     /* as in the file, "0.067 gf*cm2/cm"; NULL for a fallback */
    const char *from;        /* where it comes from; NULL */
    const char *note;        /* NULL */
    const struct Yaml *mark; /* the value in its file, for messages; NULL */
} FabricNumber;

/* One measured drape of this fabric, to compare with. */
typedef struct FabricDrape {
    double coefficient;    /* drape coefficient, 0..1 */
    int nodes;             /* folds around the rim; 0 = not given */
    double specimen, disc; /* [m] diameters; NAN */
    FabricFlag flag;       /* of coefficient and nodes */
    FabricFlag geometry;   /* of the diameters: only FABRIC_MEASURED may be a hard gate */
} FabricDrape;

/* Measured curves of first loading; counts 0: not given, the numbers above say it. */
typedef enum FabricCurveKind {
    FABRIC_CURVE_WARP, /* moment per width [N] over curvature [1/m] */
    FABRIC_CURVE_WEFT,
    FABRIC_CURVE_SHEAR, /* force per width [N/m] over angle [rad] */
    FABRIC_CURVES
} FabricCurveKind;
#define FABRIC_CURVE_MOST 32

typedef struct FabricCurve {
    int count;                /* of points, without the origin */
    const double *at, *value; /* (count) positive, rising */
} FabricCurve;

typedef struct Fabric {
    const char *name, *about, *licence;      /* NULL when not given */
    const char *source, *doi, *read;         /* `read`: how the source was read, "second hand" */
    FabricNumber weight;                     /* [kg/m2] areal density */
    FabricNumber thickness;                  /* [m] */
    FabricNumber bend_warp, bend_weft;       /* [N m] bending rigidity per width, D11, D22 */
    FabricNumber bend_bias;                  /* [N m] rigidity of a strip cut at 45 degrees */
    FabricNumber bend_poisson;               /* D12 = this * sqrt(D11 D22); 0 */
    FabricNumber bend_hysteresis;            /* [N] 2HB, the full width of the loop */
    FabricNumber bend_onset;                 /* [1/m] curvature at which yarns slip */
    FabricNumber stretch_warp, stretch_weft; /* [N/m] E1, E2: Young's modulus times thickness */
    FabricNumber stretch_poisson;            /* nu12 */
    FabricNumber stretch_limit;              /* Green strain where the cloth locks; INFINITY */
    FabricNumber shear;                      /* [N/m] G per radian of shear angle */
    FabricNumber shear_hysteresis;           /* [N/m] 2HG at 0.5 degrees */
    FabricNumber shear_hysteresis5;          /* [N/m] 2HG5 at 5 degrees */
    FabricCurve curves[FABRIC_CURVES];       /* for model particles */
    FabricNumber friction;                   /* cloth against a smooth solid */
    double threads_per_cm;                   /* [1/cm] for the picture only; 20 */
    bool isotropic;                          /* a test material: no warp, weft, hysteresis */
    int drape_count;
    const FabricDrape *drapes;
    int warning_count; /* of fabric_read: values that no fabric has */
    const char *const *warnings;
} Fabric;

/* What a model computes with (bending D12 = 0 for yarns). */
typedef struct Material {
    double density;            /* [kg/m2] */
    double c11, c12, c22, c66; /* [N/m] membrane: C11 = E1 / (1 - nu12 nu21), ... */
    double d11, d12, d22, d66; /* [N m] bending, D66 = twist (isotropic: (1 - nu) D / 2) */
    double thickness, friction;
} Material;

Material fabric_material(const Fabric *fabric);

/* [m] bending length (B / (weight g))^(1/3) for a rigidity B [N m] */
double fabric_bending_length(const Fabric *fabric, double rigidity);

/* The fabric of a given areal weight [kg/m2] when nothing else is known. */
Fabric fabric_from_weight(double weight);

/* Gives every number that is not known (NAN) the median of real fabrics of that weight, flag
 * FABRIC_FALLBACK. The weight must be known. */
void fabric_fill(Fabric *fabric);

/* Sets bend_bias so that the twisting rigidity D66 [N m] is `twist`; bending must be known. */
void fabric_set_twist(Fabric *fabric, double twist);

/* A fabric of which nothing is known: every number NAN. */
Fabric fabric_unknown(void);

/* Reads assets/fabrics/NAME.yaml (or a path with a '/' or ending in .yaml). Assets are in
 * $TOILE_ASSETS, else beside the sources. Doubtful values pass here; fabric_print shows them. */
bool fabric_read(const char *name_or_path, Arena *arena, Fabric *fabric, Error *error);

/* `toile fabrics` and `toile fabrics NAME`. */
bool fabric_print_list(FILE *out, bool json, Error *error);
bool fabric_print(const char *name, FILE *out, bool json, Error *error);

#endif
