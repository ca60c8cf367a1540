#include "sim/step/bounds.h"

Bounds bounds_create(const Steer *steer, const SweepLattice *lattices, const int *grain,
                     const Lanes *lanes, const int *slot, size_t chunks) {
    const System *system = steer->system;
    Bounds b = {.steer = steer, .lattices = lattices, .grain = grain, .lanes = lanes};
    b.inertia = inertia_create(system, lanes->slot_count, chunks);
    b.sides = arena_push(system->arena, Sides, system->cloth_count);
    b.limits = arena_push(system->arena, Limit, system->cloth_count);
    for (int c = 0; c < system->cloth_count; c++) {
        b.sides[c] = sides_create(&lattices[c], b.inertia.pulled, system->arena);
        b.limits[c] = limit_create(&system->cloths[c], slot + system->first[c], system->arena);
    }
    return b;
}

static int cloth_count(const Bounds *b) { return b->steer->system->cloth_count; }

static void add_work(Bounds *b, SidesWork work) {
    b->taken += work.taken;
    b->handles += work.handles;
}

/* [J] now, of all cells */
static double stored(Bounds *b) {
    double energy = 0.0;
    bounds_find(b, true, 0.0);
    for (int c = 0; c < cloth_count(b); c++) {
        energy += sides_energy(&b->sides[c]);
    }
    return energy;
}

void bounds_begin(Bounds *b, const int *slot, bool enters) {
    inertia_begin(&b->inertia, b->steer, slot);
    for (int c = 0; c < cloth_count(b) && enters; c++) {
        if (b->lattices[c].scaled) {
            inertia_enter(&b->inertia, &b->lattices[c], b->lanes, c, b->grain[c]);
        }
    }
    double begins = stored(b); /* forgets what was listed before */
    b->taken = begins;
    b->handles = 0.0;
}

double bounds_hidden(Bounds *b) {
    double energy = 0.0;
    for (int c = 0; c < cloth_count(b); c++) {
        if (b->lattices[c].scaled) {
            energy += inertia_hidden(&b->inertia, &b->lattices[c], b->lanes, c, b->grain[c]);
        }
    }
    return energy;
}

double bounds_end(Bounds *b) {
    double left = stored(b);
    return b->taken - left;
}

void bounds_find(Bounds *b, bool all, double kick_time) {
    for (int c = 0; c < cloth_count(b); c++) {
        const unsigned char *held = b->steer->held + b->steer->system->first[c];
        add_work(b, sides_find(&b->sides[c], b->lanes, held, all, kick_time));
        limit_see(&b->limits[c], held);
    }
}

void bounds_spread(Bounds *b) {
    for (int c = 0; c < cloth_count(b); c++) {
        if (b->lattices[c].scaled) {
            inertia_spread(&b->inertia, &b->lattices[c], b->lanes, c, b->grain[c]);
        }
    }
}

void bounds_hold(Bounds *b, double dt, double share) {
    for (int c = 0; c < cloth_count(b); c++) {
        Sides *sides = &b->sides[c];
        sides_hold(sides, b->lanes, dt, share);
        if (sides->count > 0 && b->lattices[c].scaled) {
            inertia_spread_blocks(&b->inertia, &b->lattices[c], b->lanes, c, SIDES_SCALED_MOBILITY,
                                  &sides->blocks, b->grain[c]);
        }
        b->taken += limit_hold(&b->limits[c], b->lanes, dt, &b->handles);
    }
}

void bounds_count(Bounds *b) {
    for (int c = 0; c < cloth_count(b); c++) {
        add_work(b, sides_work(&b->sides[c], b->lanes));
        sides_forget(&b->sides[c]);
    }
}
