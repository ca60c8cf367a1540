/* lead.h: damping inside the fabrics. Bending, or the stretch of the membrane, is taken at places
 * ahead of the motion, x + tau v (sweep.h). */
#ifndef TOILE_STEP_LEAD_H
#define TOILE_STEP_LEAD_H

#include "sim/step/system.h"

typedef struct Lead {
    /* [s] the longest stable tau, sweep_bending_time or sweep_membrane_time */
    double (*limit)(const SweepLattice *lattice, double density, double wished, double dt);
    double *wished, *time; /* [s] (cloth_count) tau in the scene; tau in these steps */
    double *place[3];      /* [m] (slot_count) */
} Lead;

Lead lead_create(const System *system, int slot_count,
                 double (*limit)(const SweepLattice *, double, double, double));

/* For steps of dt: finds the times, and sets `taken` to the places of the lead where some cloth is
 * damped, else to x. `lattices`: (cloth_count); nu = 0: the limits of the model, if any. */
void lead_start(Lead *lead, const System *system, const SweepLattice *lattices, double dt,
                double *const x[3], double *taken[3]);

#endif
