/* model.h: the door of the cloth models.
 *
 * A Cloth is one panel with its model. Its unknowns x are node positions (node_count x 3),
 * followed by the positions of ghost nodes (ghost_count x 3), which a clamp moves and nobody
 * solves for. All models stand in one const table; tests and --help loop over it. A new model
 * is one new file and one line in models.c.
 */
#ifndef TOILE_MODEL_MODEL_H
#define TOILE_MODEL_MODEL_H

#include "sim/model/panel.h"
#include "sim/model/sweep.h"
#include "sim/solve/block_matrix.h"

typedef struct ClothModel ClothModel;

/* A ghost node continues a clamped border by one spacing: it lies at border + h * slope. */
typedef struct Ghost {
    int border;    /* node on the clamped border */
    int side;      /* 0 left, 1 right, 2 bottom, 3 top; -1 on scattered nodes */
    double out[2]; /* unit, out of the panel in material space */
} Ghost;

typedef struct SpringLimit {
    int a, b;       /* nodes */
    double longest; /* [m] */
} SpringLimit;

typedef struct Cloth {
    const ClothModel *model;
    const ClothDef *def;
    Panel panel;
    Material material;
    BendingKind bending; /* never auto */
    int node_count, ghost_count;
    const Ghost *ghosts;           /* (ghost_count) */
    bool clamp[4];                 /* lattice borders with prescribed slope */
    double *mass;                  /* [kg] (node_count) lumped */
    int strain_count;              /* numbers in a stress state of add_hessian */
    const SweepLattice *lattice;   /* explicit sweep (first slot not set); NULL: none */
    void *data;                    /* of the model */
    struct YarnFriction *friction; /* NULL: the cloth is elastic */
    int history_count;
    double *history;  /* (history_count) of accepted steps; see commit */
    const char *note; /* what the model cannot have of this fabric; NULL: nothing */
    int spring_limit_count;
    const SpringLimit *spring_limits; /* (spring_limit_count) see sim/step/limit.h */
} Cloth;

struct ClothModel {
    const char *name, *about;
    /* 1 << BendingKind of all that it knows on lattices, on scattered nodes; the lowest is that of
     * 'auto'; 0: it cannot have such nodes. cloth_create refuses the others. */
    unsigned lattice_bendings, scattered_bendings;
    bool seams; /* it knows garments, whose vertices are more than its nodes */
    /* Fills mass, strain_count, lattice, data, note; material becomes what the model computes
     * with. Errors: EXIT_BAD_INPUT. */
    bool (*create)(Cloth *cloth, Arena *arena, Error *error);
    /* [J] stored in the cloth. x: ((node_count + ghost_count) x 3). */
    double (*energy)(const Cloth *cloth, const double *x);
    /* gradient += dE/dx [N]; (node_count + ghost_count) x 3. */
    void (*add_gradient)(const Cloth *cloth, const double *x, double *gradient);
    /* The same with stretch and shear taken at `stretched`, curvature at `bent`, a little ahead of
     * the motion: damping inside the fabric. NULL: there is none. */
    void (*add_damped_gradient)(const Cloth *cloth, const double *stretched, const double *bent,
                                double *gradient);
    /* What bounds that damping where there is no sweep; NULL like it. */
    Fastest (*fastest)(const Cloth *cloth);
    /* Only the rest-curvature part of dE/dx, which the sweep of `lattice` leaves out unless
     * lattice->rest; NULL: nothing. */
    void (*add_rest_gradient)(const Cloth *cloth, const double *x, double *gradient);
    /* Only dE/dx of the ghosts, on which the sweep of `lattice` has no forces; NULL without one. */
    void (*add_ghost_gradient)(const Cloth *cloth, const double *x, double *gradient);
    /* Stress per strain sample [N/m], as mixed-point Newton keeps it: stress = C strain(x);
     * (strain_count). */
    void (*stress)(const Cloth *cloth, const double *x, double *stress);
    /* stress = C (strain(x_new) - quadratic part of strain in dx): the stress that the linear
     * model predicted for x_new. dx like x; ghosts are zero. */
    void (*predict_stress)(const Cloth *cloth, const double *x_new, const double *dx,
                           double *stress);
    /* Node pairs that the Hessian couples (2 ints each) appended to pairs; NULL: only counts. */
    int (*couple)(const Cloth *cloth, int *pairs);
    /* values += B'CB at x plus the geometric part of `stress` (all positive semidefinite when
     * `definite`). `places` from bind_hessian. */
    void (*add_hessian)(const Cloth *cloth, const double *x, const double *stress, bool definite,
                        double *values);
    /* Looks up the places of all blocks; node i of the cloth is node first + i of the matrix. */
    void (*bind_hessian)(Cloth *cloth, const BlockMatrix *matrix, int first, Arena *arena);
    /* [s] largest stable explicit step. */
    double (*stable_step)(const Cloth *cloth);
    /* x is accepted: changes cloth->history, which energy and forces depend on; NULL: the model has
     * none. */
    void (*commit)(Cloth *cloth, const double *x);
};

extern const ClothModel *const cloth_models[]; /* NULL-terminated */

const ClothModel *cloth_model_find(const char *name); /* NULL when there is none */

/* Makes panel, ghosts of clamped borders, and the model. `handles` are those of this cloth. */
bool cloth_create(Cloth *cloth, const ClothDef *def, const HandleDef *handles, int handle_count,
                  uint64_t seed, Arena *arena, Error *error);

/* Start positions in the world: ((node_count + ghost_count) x 3). */
void cloth_start(const Cloth *cloth, double *x);

#endif
