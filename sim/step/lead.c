#include "sim/step/lead.h"

#include <math.h>

/* of tau omega^2 dt of bending or of the membrane: leapfrog wants dt^2 omega^2 + 2 tau omega_b^2 dt < 4 */
#define DAMPING_SHARE 0.1

const Fastest *lead_find_fastest(const System *system) {
    Fastest *fastest = arena_push(system->arena, Fastest, system->cloth_count);
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        bool asked = !cloth->lattice && cloth->model->fastest;
        if (asked) {
            fastest[c] = cloth->model->fastest(cloth);
        }
    }
    return fastest;
}

Lead lead_create(const System *system, int slot_count, bool membrane, const Fastest *fastest) {
    Lead lead = {.membrane = membrane,
                 .fastest = fastest,
                 .wished = arena_push(system->arena, double, system->cloth_count),
                 .time = arena_push(system->arena, double, system->cloth_count)};
    for (int a = 0; a < 3; a++) {
        lead.place[a] = arena_push(system->arena, double, slot_count);
    }
    return lead;
}

double lead_time(double fastest2, double wished, double dt) {
    return fmin(wished, DAMPING_SHARE / (fastest2 * dt));
}

void lead_start(Lead *lead, const System *system, const SweepLattice *lattices, double dt,
                double *const x[3], double *taken[3]) {
    bool damped = false;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        Fastest fastest = lattices[c].nu > 0 ? sweep_fastest(&lattices[c], cloth->material.density)
                                             : lead->fastest[c];
        double fastest2 = lead->membrane ? fastest.membrane : fastest.bending;
        bool possible = fastest2 > 0.0 && lead->wished[c] > 0.0;
        lead->time[c] = possible ? lead_time(fastest2, lead->wished[c], dt) : 0.0;
        damped = damped || possible;
    }
    for (int a = 0; a < 3; a++) {
        taken[a] = damped ? lead->place[a] : x[a];
    }
}
