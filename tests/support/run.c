#include "tests/support/run.h"

#include <math.h>

#include "tests/support/check.h"

void run_start(Run *r, const char *stepper, double step) {
    Error error = {0};
    r->bench.scene.solver.stepper = stepper;
    r->bench.scene.solver.step = step;
    r->stepper = stepper_find(stepper);
    if (!r->stepper->create(&r->bench.system, &r->data, &error)) {
        fail_msg("%s", error.text);
    }
    r->state = state_allocate(&r->bench.system, &r->bench.arena);
    r->held = arena_push(&r->bench.arena, unsigned char, r->bench.system.place_count);
    state_start(&r->bench.system, &r->state);
    system_mark_held(&r->bench.system, 0.0, r->held);
    r->statistics = (Statistics){.smallest_gap = INFINITY, .smallest_self_gap = INFINITY};
}

void run_to(Run *r, double time) {
    Error error = {0};
    if (!r->stepper->advance(&r->bench.system, r->data, &r->state, time, &r->statistics, &error)) {
        fail_msg("%s: %s", r->stepper->name, error.text);
    }
}

void run_end(Run *r) {
    if (r->stepper->destroy) {
        r->stepper->destroy(r->data);
    }
    arena_free(&r->bench.arena);
}

double run_energy(const Run *r) {
    const System *s = &r->bench.system;
    return system_kinetic_energy(s, r->state.v, r->held) + system_elastic_energy(s, r->state.x) +
           system_gravity_energy(s, r->state.x, r->held) + r->state.hidden;
}
