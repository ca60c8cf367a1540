/* scene.h: every parameter of a scene, with unit, meaning and default.
 *
 * scene_read fills a Scene from a YAML file (the tables of scene_schema.h name each key, its unit,
 * default, limits and help text; `toile help scene` prints them). Everything inside is SI; z is
 * up. A Scene is constant once read; all its memory belongs to the arena that was passed in. */
#ifndef TOILE_SCENE_SCENE_H
#define TOILE_SCENE_SCENE_H

#include <stdint.h>

#include "sim/base/arena.h"
#include "sim/base/error.h"
#include "sim/base/film.h"
#include "sim/geom/solid.h"
#include "sim/scene/air.h"
#include "sim/scene/fabric.h"
#include "sim/scene/garment.h"
#include "sim/scene/mesh.h"
#include "sim/scene/motion.h"
#include "sim/scene/reference.h"

#define SCENE_VERSION 1
typedef enum ShapeKind {
    SHAPE_RECTANGLE, /* width along u (warp), height along v (weft) */
    SHAPE_SLEEVE,    /* a rectangle joined to itself: u runs around, v along the axis */
    SHAPE_DISC,
    SHAPE_ANNULUS,
    SHAPE_POLYGON, /* closed outline with holes */
    SHAPE_GARMENT, /* polygons sewn together */
    SHAPE_MESH     /* out of a file, its places by texture coordinates */
} ShapeKind;

typedef struct ShapeDef {
    ShapeKind kind;
    double width, height;                /* [m] rectangle */
    double radius, inner_radius, length; /* [m] sleeve, disc, annulus; sleeve */
    const MeshDef *mesh;                 /* frame 0: where it starts, frame 1: (u, v, 0) */
    double uv;                           /* [m] of the mesh: what 1 in the file's (u, v) meant */
    bool rest_curved;          /* sleeve: the rest shape is the cylinder; false: the flat panel */
    double rest_curvature[2];  /* [1/m] rectangle: rest curvature along u, v; 0 */
    const GarmentDef *garment; /* NULL: one panel */
    int loop_count;            /* polygon: outer outline, anticlockwise, then holes, clockwise */
    const int *loop_begin;     /* (loop_count + 1) */
    const double *outline;     /* [m] (loop_begin[loop_count] x 2) */
} ShapeDef;

typedef enum SidesKind { SIDES_FREE, SIDES_BOUNDED } SidesKind; /* sim/model/side_bound.h */
typedef enum KinematicsKind { KINEMATICS_GREEN, KINEMATICS_COROTATIONAL } KinematicsKind;
typedef enum BendingKind {
    BENDING_AUTO,    /* of those that the model knows on such nodes the first in this list */
    BENDING_STENCIL, /* 13-point stencil: boundary integral of 2-node edge slopes (lattices) */
    BENDING_RBF,     /* boundary integral of RBF edge slopes (any nodes) */
    BENDING_CHOI_KO, /* springs between second neighbours that push like a buckled strip */
    BENDING_CHORD,   /* the same, with the moment of a linear hinge at every angle */
    BENDING_PROVOT,  /* linear springs between second neighbours */
    BENDING_MORLEY,  /* triangles, no lattice: the next with a free slope at every edge */
    BENDING_TENSOR,  /* triangles: curvature tensor from the turns of three edges */
    BENDING_HINGE,   /* triangles: each edge turns by itself */
    BENDING_ANGLE,   /* particles: curvature = turn / spacing */
    BENDING_SINE,    /* particles: curvature of the circle through three nodes */
    BENDING_COUNT
} BendingKind;
extern const char *const bending_words[]; /* by BendingKind; NULL-terminated */

/* Where triangles sample the membrane strain. */
typedef enum MembraneKind {
    MEMBRANE_AUTO,  /* pairs on lattices, triangles elsewhere */
    MEMBRANE_PAIRS, /* both triangles of a lattice cell share one sample: folds lock less */
    MEMBRANE_TRIANGLES
} MembraneKind;

typedef enum BuckleKind {
    BUCKLE_ELASTICA, /* compressed springs give way like the exact pinned strip */
    BUCKLE_ARC,      /* like a circular arc (Choi, Ko 2002) */
    BUCKLE_QUARTIC,  /* their published fit of the arc */
    BUCKLE_NONE      /* never */
} BuckleKind;

typedef struct ClothDef {
    const char *name, *where; /* where: "FILE:LINE:COLUMN", for messages; NULL: in no file */
    ShapeDef shape;
    Fabric fabric;
    const char *look;  /* name of a look (assets/looks); "teal-twill" */
    FilmPicture print; /* on its face; none */
    const char *model; /* name in cloth_models[]; "mlpg" */
    int nodes[2];      /* of lattices: along u, along v; around, along for a sleeve; 41 x 41 */
    double spacing;    /* [m] of nodes that are no lattice, never 0 there (default: extent / 40). On
                          lattices: what `nodes` was computed from, 0 when nodes were given */
    double jitter;     /* scattered layout: random shift of inner nodes / spacing, 0..0.4; 0 */
    bool scattered;    /* rectangle with scattered nodes; false */
    double grid_turn;  /* [rad] scattered layout: inner nodes on a square lattice turned by it, as
                          they fall; NAN: jittered or relaxed nodes. For tests; it has no key */
    double accuracy;   /* wished relative error, chooses nodes and step; 0 = not asked */
    Pose pose;         /* where the panel's origin (rectangle: centre; sleeve: middle of its
                          axis, v along z; disc, annulus: centre; polygon: (0, 0) of its outline)
                          starts; a flat panel lies in x, y with its face up */
    Vec3 velocity;     /* [m/s] at the start; 0 */
    double noise;      /* [m] amplitude of seeded out-of-plane noise at the start; 0 */
    double damping;    /* [1/s] mass damping; 0 */
    double bending_damping; /* [s] moment per rate of curvature / bending stiffness; explicit steps;
                                5 ms (a loss factor of 0.3 at 10 Hz) */
    double membrane_damping;   /* [s] force by rate of strain likewise; 0.1 ms; never unstable */
    KinematicsKind kinematics; /* green */
    SidesKind sides;           /* of model mlpg on lattices; free */
    BendingKind bending;       /* auto */
    bool hysteresis;           /* yarns stick and slip, by 2HB and 2HG of the fabric; false */
    BuckleKind buckling;       /* of model springs; elastica */
    double stiffening;         /* of model springs beyond the fabric's stretch limit / modulus; 0 */
    double limit_rounds;       /* a step, of Provot's limit on springs (sim/step/limit.h); 0 */
    MembraneKind membrane;     /* of model triangles; auto */
    bool fifth_power;          /* of model particles: how threads stretch in the paper; false */
    bool repel;                /* of model particles: the paper's instead of contact; false */
} ClothDef;

typedef enum HandleKind {
    HANDLE_HOLD, /* positions follow the motion; slopes are free (a hinge, a pin) */
    HANDLE_CLAMP /* positions and the slope across the edge follow the motion */
} HandleKind;

typedef enum RegionKind {
    REGION_LEFT,   /* u = 0 */
    REGION_RIGHT,  /* u = width */
    REGION_BOTTOM, /* v = 0; `start` of a sleeve */
    REGION_TOP,    /* v = height; `end` of a sleeve */
    REGION_BOTTOM_LEFT,
    REGION_BOTTOM_RIGHT,
    REGION_TOP_LEFT,
    REGION_TOP_RIGHT, /* one corner node */
    REGION_MIDLINE,   /* the nodes nearest to the line v = height / 2 */
    REGION_BORDER,    /* all border nodes; the outer outline of a disc, an annulus, a polygon */
    REGION_INNER,     /* inner outline of an annulus; all holes of a polygon */
    REGION_ALL,
    REGION_NEAREST, /* the node nearest to `point` (u, v) */
    REGION_CIRCLE   /* all nodes within `radius` of `point` (u, v) */
} RegionKind;

typedef struct HandleDef {
    HandleKind kind;
    int cloth; /* index into Scene.cloths */
    RegionKind region;
    double point[2];   /* [m] (u, v) */
    double radius;     /* [m] */
    Motion motion;     /* of the held nodes, from where they start; identity at t = 0 */
    double release;    /* [s] when the nodes are let go; INFINITY */
    const char *where; /* "FILE:LINE:COLUMN", for messages; NULL */
} HandleDef;

typedef struct ObstacleDef {
    const char *name;
    Solid solid;         /* with a mesh: the ball around its origin that holds all its frames */
    const MeshDef *mesh; /* NULL: the solid is the obstacle */
    Pose pose;           /* at t = 0 */
    Motion motion;       /* in world space, applied after `pose` */
    double friction;     /* against cloth; negative: the fabric's own; -1 */
    const char *look;    /* "clay" */
} ObstacleDef;

typedef struct SolverDef {
    const char *stepper;           /* name in steppers[]; "auto" */
    const char *where;             /* "FILE:LINE:COLUMN" of the stepper, for messages; NULL */
    double step;                   /* [s] time step; 0 = the stepper's own choice */
    int newton_iterations, sweeps; /* of an implicit step, 2; of one of three_phase, 20 */
    double courant;                /* explicit step / stability limit; 0.8 */
    double tolerance;        /* [m] by which a step of rk45 may put a node wrong in a frame; 1e-5 */
    bool breen;              /* the second phase of three_phase as published; false */
    double contact_distance; /* [m] kept from obstacles and other cloth; 0 = by the thickness */
    bool self_contact;       /* cloth meets itself and other cloth; true */
    bool impulses;           /* contact by impulses, not by a force law; false */
    bool mass_scaling;       /* of the shortest waves of lattices; true */
    double lag; /* [s] an obstacle that pinched cloth keeps further behind ends the run; 1 s */
} SolverDef;

typedef struct Scene {
    const char *path;  /* as given */
    const char *text;  /* the whole file */
    uint64_t hash;     /* of every value, fabrics and includes too; how it is written is left out */
    const char *title; /* file name without ending, or `title` */
    Film film;         /* frame_count = seconds * rate */
    Vec3 gravity;      /* [m/s2] (0, 0, -9.81) */
    AirDef air;
    SolverDef solver;
    int cloth_count, handle_count, obstacle_count, reference_count;
    ClothDef *cloths;
    HandleDef *handles;
    ObstacleDef *obstacles;
    ReferenceDef *references;
    int warning_count;
    const char *const *warnings; /* one line each, "file:line:column: warning: ..." */
} Scene;

ShapeDef shape_default(void);
ClothDef cloth_default(void);
HandleDef handle_default(void);
ObstacleDef obstacle_default(void);
SolverDef solver_default(void);
Scene scene_default(void);

/* Names that later stages know, each list NULL-terminated; a NULL list allows any name. */
typedef struct SceneWords {
    const char *const *models, *const *steppers, *const *looks;
} SceneWords;

/* Reads and checks a scene. False with up to ten errors ("file:line:column: error: ...", the source line, a
 * caret) in error->text, code EXIT_BAD_INPUT, EXIT_MISSING_INPUT or EXIT_IO. `words` NULL: any name. */
bool scene_read(const char *path, const SceneWords *words, Arena *arena, Scene *scene,
                Error *error);

/* The same for text that is already in memory; `path` is used for messages and includes. */
bool scene_parse(const char *path, const char *text, size_t bytes, const SceneWords *words,
                 Arena *arena, Scene *scene, Error *error);

double shape_area(const ShapeDef *shape); /* [m2] of the flat panel */
/* [m] extents of the panel along u and v */
void shape_extents(const ShapeDef *shape, double extents[2]);

void scene_print_reference(FILE *out);                     /* every key: unit, meaning, default */
void scene_print_effective(const Scene *scene, FILE *out); /* valid YAML with defaults filled in */

#endif
