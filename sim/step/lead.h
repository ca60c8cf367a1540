/* lead.h: damping inside the fabrics. Bending, or the stretch of the membrane, is taken at places
 * ahead of the motion, x + tau v: a damping tau K of either, which keeps momentum. (A rigid turn of bent
 * cloth is damped too, by D tau |omega x kappa|^2 per area: some 1e-4 W/m2 for cloth that swings.) */
#ifndef TOILE_STEP_LEAD_H
#define TOILE_STEP_LEAD_H

#include "sim/step/system.h"

typedef struct Lead {
    bool membrane;          /* else bending */
    const Fastest *fastest; /* (cloth_count) of cloth without a sweep; 0: not damped */
    double *wished, *time;  /* [s] (cloth_count) tau in the scene; tau in these steps */
    double *place[3];       /* [m] (slot_count) */
} Lead;

/* (cloth_count) of models without a sweep, for lead_create */
const Fastest *lead_find_fastest(const System *system);
Lead lead_create(const System *system, int slot_count, bool membrane, const Fastest *fastest);

/* [s] the longest tau up to `wished` with which steps of dt stay stable; fastest2 [1/s2] as in Fastest. */
double lead_time(double fastest2, double wished, double dt);

/* For steps of dt: finds the times, and sets `taken` to the places of the lead where some cloth is
 * damped, else to x. `lattices`: (cloth_count); nu = 0: by `fastest`. */
void lead_start(Lead *lead, const System *system, const SweepLattice *lattices, double dt,
                double *const x[3], double *taken[3]);

#endif
