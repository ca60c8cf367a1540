/* mlpg.h: the meshless Kirchhoff-Love shell (after Yuan et al. 2008); see mlpg.md beside this
 * file for what is kept of the paper and what is corrected.
 *
 * The panel is tiled with sub-domains. In each, strain and curvature are boundary integrals of
 * the trial function (Heaviside test functions), used on both sides of the weak form, so that
 * energy, gradient and Hessian belong together. Membrane and bending are sampled separately:
 *   lattices:  membrane once per cell between four nodes (with bounded hourglass stiffness),
 *              bending once per node cell, from 2-node edge slopes (the 13-point stencil) or
 *              from RBF edge slopes;
 *   scattered: both once per Voronoi cell, from RBF edge values.
 */
#ifndef TOILE_MODEL_MLPG_H
#define TOILE_MODEL_MLPG_H

#include "sim/model/bending.h"
#include "sim/model/model.h"
#include "sim/model/strain.h"

/* k_h = min(HOURGLASS_SHARE Eh, m D / h^2) (mlpg.md). A larger m locks, a smaller one
 * lets the cells zigzag; 300..3000 is a flat optimum on lattices. */
#define MLPG_HOURGLASS_SHARE 0.05
#define MLPG_HOURGLASS_LATTICE 1000.0
#define MLPG_HOURGLASS_SCATTERED 100.0

typedef struct Mlpg {
    StrainSamples membrane;
    BendingSamples samples; /* of the residual */
    Bending bending;        /* residual */
    Bending *tangent;       /* Hessian: the 13-point stencil, or `bending` itself */
    SweepLattice sweep;     /* all zero: scattered nodes */
} Mlpg;

/* [N/m] k_h of a material for spacings h1, h2 [m]; factor: the m above. */
double mlpg_hourglass(const Material *m, double h1, double h2, double factor);

/* Sample builders (mlpg_lattice.c, mlpg_scattered.c). */
void mlpg_lattice_membrane(const Cloth *cloth, StrainSamples *samples, Arena *arena);
void mlpg_lattice_bending(const Cloth *cloth, BendingSamples *samples, Arena *arena);
void mlpg_rbf_bending(const Cloth *cloth, BendingSamples *samples, Arena *arena);
void mlpg_scattered_membrane(const Cloth *cloth, StrainSamples *samples, Arena *arena);

#endif
