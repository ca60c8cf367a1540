#include "sim/step/lead.h"

Lead lead_create(const System *system, int slot_count,
                 double (*limit)(const SweepLattice *, double, double, double)) {
    Lead lead = {.limit = limit,
                 .wished = arena_push(system->arena, double, system->cloth_count),
                 .time = arena_push(system->arena, double, system->cloth_count)};
    for (int a = 0; a < 3; a++) {
        lead.place[a] = arena_push(system->arena, double, slot_count);
    }
    return lead;
}

void lead_start(Lead *lead, const System *system, const SweepLattice *lattices, double dt,
                double *const x[3], double *taken[3]) {
    bool damped = false;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        const SweepLattice *limits = lattices[c].nu > 0 ? &lattices[c] : cloth->limits;
        bool possible = limits && lead->wished[c] > 0.0;
        double density = cloth->material.density;
        lead->time[c] = possible ? lead->limit(limits, density, lead->wished[c], dt) : 0.0;
        damped = damped || possible;
    }
    for (int a = 0; a < 3; a++) {
        taken[a] = damped ? lead->place[a] : x[a];
    }
}
