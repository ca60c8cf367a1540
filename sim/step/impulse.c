#include "sim/step/impulse.h"

#include <string.h>

void impulse_start(Impulse *impulse, const System *system, const State *state) {
    size_t count = 3 * (size_t)system->place_count;
    if (!state->contact_force) {
        return;
    }
    if (!impulse->sum) {
        impulse->sum = arena_push(system->arena, double, count);
    }
    memset(impulse->sum, 0, count * sizeof *impulse->sum);
    impulse->time = 0.0;
}

void impulse_add(Impulse *impulse, const System *system, const Lanes *lanes, const int *slot,
                 double time) {
    for (int i = 0; i < system->place_count && impulse->sum; i++) {
        for (int a = 0; a < 3; a++) {
            impulse->sum[3 * i + a] += time * lanes->f[a][slot[i]];
        }
    }
    impulse->time += time;
}

void impulse_add_momentum(Impulse *impulse, const System *system, const Lanes *lanes,
                          const int *slot, double sign) {
    for (int i = 0; i < system->place_count && impulse->sum; i++) {
        for (int a = 0; a < 3; a++) {
            impulse->sum[3 * i + a] += sign * system->mass[i] * lanes->v[a][slot[i]];
        }
    }
}

void impulse_end(const Impulse *impulse, const System *system, State *state) {
    double scale = impulse->time > 0.0 ? 1.0 / impulse->time : 0.0;
    for (int i = 0; i < 3 * system->place_count && impulse->sum; i++) {
        state->contact_force[i] = scale * impulse->sum[i];
    }
}
