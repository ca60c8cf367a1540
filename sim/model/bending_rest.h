/* bending_rest.h: the part of the bending energy that rest curvature adds (see bending.h). */
#ifndef TOILE_MODEL_BENDING_REST_H
#define TOILE_MODEL_BENDING_REST_H

#include "sim/model/bending.h"

typedef struct BendingRest {
    int solved_count;          /* nodes below this number are unknowns */
    BendingSamples samples;    /* one entry a node */
    double (*moment)[3];       /* [N m3] A (D k0) of each sample: 11, 22, and 4 A D66 k0_12 */
    double *turning;           /* [N m] A k0 D k0 of each sample */
    double energy;             /* [J] the constant */
    int *border, border_count; /* samples with nodes that are no unknowns */
    int *place_start;          /* (sample_count + 1) */
    BlockPlace *places;        /* lower pairs of every sample, in order; base -1: not solved */
} BendingRest;

/* rest_curvature: [1/m] 11, 22, 12, the same for all samples */
BendingRest *bending_rest_create(const BendingSamples *samples, int solved_count,
                                 const double rest_curvature[3], Arena *arena);
/* Sets the rest curvature of one sample, for shapes where it varies. w: its weights. */
void bending_rest_set(BendingRest *rest, int sample, const double w[4], const double k0[3]);
double bending_rest_energy(const BendingRest *rest, const double *x);
void bending_rest_add_gradient(const BendingRest *rest, const double *x, double *gradient);
/* only of nodes that are no unknowns */
void bending_rest_add_border_gradient(const BendingRest *rest, const double *x, double *gradient);
int bending_rest_couple(const BendingRest *rest, int *pairs);
void bending_rest_bind(BendingRest *rest, const BlockMatrix *matrix, int first, Arena *arena);
void bending_rest_add_hessian(const BendingRest *rest, const double *x, double *values);

#endif
