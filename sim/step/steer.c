#include "sim/step/steer.h"

#include <math.h>
#include <string.h>

Steer steer_create(const System *system) {
    return (Steer){.system = system,
                   .held = arena_push(system->arena, unsigned char, system->place_count),
                   .held_places = arena_push(system->arena, int, system->place_count),
                   .targets = arena_push(system->arena, double, 3 * system->place_count),
                   .before = arena_push(system->arena, double, 3 * system->place_count),
                   .force = arena_push(system->arena, double, 3 * system->place_count),
                   .placed = arena_push(system->arena, Placed, system->handle_count),
                   .turns = arena_push(system->arena, unsigned char, system->cloth_count),
                   .ghost_force = arena_push(system->arena, double, 3 * system->place_count),
                   .v_held = arena_push(system->arena, double, 3 * system->place_count)};
}

void steer_begin(Steer *s, const State *state) {
    system_mark_held(s->system, state->time, s->held);
    s->held_count = 0;
    for (int i = 0; i < s->system->place_count; i++) {
        s->held_places[s->held_count] = i;
        s->held_count += s->held[i] != 0;
    }
    memset(s->turns, 0, (size_t)s->system->cloth_count);
    for (int h = 0; h < s->system->handle_count; h++) {
        const HandleDef *def = s->system->handles[h].def;
        if (def->kind == HANDLE_CLAMP && motion_end(&def->motion) > state->time) {
            s->turns[def->cloth] = 1;
        }
    }
    memcpy(s->v_held, state->v, 3 * (size_t)s->system->place_count * sizeof *s->v_held);
    steer_place_targets(s, state->time);
    s->targets_move = true;
}

/* Targets of a handle that rests stay; where two handles hold the same place the later one counts, so
 * all that follow a moved one are placed again. */
void steer_place_targets(Steer *s, double time) {
    const System *system = s->system;
    bool again = !s->targets_known;
    for (int k = 0; k < s->held_count && s->targets_move; k++) {
        size_t i = 3 * (size_t)s->held_places[k];
        memcpy(s->before + i, s->targets + i, 3 * sizeof *s->before);
    }
    for (int h = 0; h < system->handle_count && !again; h++) {
        again = s->placed[h].holds != (time <= system->handles[h].def->release);
    }
    for (int h = 0; h < system->handle_count; h++) {
        const Handle *handle = &system->handles[h];
        Placed now = {time <= handle->def->release, motion_pose(&handle->def->motion, time)};
        again = again || memcmp(&s->placed[h].pose, &now.pose, sizeof now.pose) != 0;
        s->placed[h] = now;
        for (int i = 0; i < handle->count && again && now.holds; i++) {
            Vec3 p = pose_apply(now.pose, vec3_load(handle->start + 3 * i));
            vec3_store(s->targets + 3 * (size_t)handle->places[i], p);
        }
    }
    s->targets_known = true;
    s->targets_move = again;
}

void steer_take_forces(Steer *s, const Lanes *lanes, const int *slot, int c) {
    int first = s->system->first[c] + s->system->cloths[c].node_count;
    for (int i = first; i < s->system->first[c + 1] && s->turns[c]; i++) {
        for (int a = 0; a < 3; a++) {
            s->ghost_force[3 * i + a] = lanes->f[a][slot[i]];
        }
    }
}

void steer_find_forces(Steer *s, int c, const double *x, double *gradient) {
    const Cloth *cloth = &s->system->cloths[c];
    size_t nodes = 3 * (size_t)cloth->node_count, ghosts = 3 * (size_t)cloth->ghost_count;
    memset(gradient + nodes, 0, ghosts * sizeof *gradient);
    cloth->model->add_ghost_gradient(cloth, x, gradient);
    double *force = s->ghost_force + 3 * (size_t)s->system->first[c] + nodes;
    for (size_t k = 0; k < ghosts; k++) {
        force[k] = -gradient[nodes + k];
    }
}

/* share of the way to where it should be by now that a place does not go in dt */
static double share_left(const Steer *s, const Lanes *lanes, int i, int slot, double dt) {
    double square = 0.0, least = STEER_CATCH_UP * dt;
    for (int a = 0; a < 3; a++) {
        double behind = s->before[3 * i + a] - lanes->x[a][slot];
        square += behind * behind;
    }
    if (square <= least * least) { /* nearly always */
        return 0.0;
    }
    return fmax(1.0 - dt / STEER_CATCH_UP_TIME - least / sqrt(square), 0.0);
}

static void steer_place(Steer *s, const Lanes *lanes, int i, int slot, const SweepKick *kick,
                        double dt, double *work) {
    double mass = s->system->mass[i], *v_held = s->v_held + 3 * i;
    double left = share_left(s, lanes, i, slot, dt);
    double push[3] = {kick->push.x, kick->push.y, kick->push.z};
    for (int a = 0; a < 3; a++) {
        double *v = &lanes->v[a][slot];
        double x = lanes->x[a][slot], moved = s->targets[3 * i + a] - x;
        if (left > 0.0) {
            moved -= left * (s->before[3 * i + a] - x);
        }
        if (moved == 0.0) {
            *v = v_held[a] = s->force[3 * i + a] = 0.0;
            continue;
        }
        double force = mass > 0.0 ? mass * ((*v / kick->keep - v_held[a]) / kick->dt - push[a])
                                  : s->ghost_force[3 * i + a];
        s->force[3 * i + a] = force;
        *work -= force * moved;
        *v = v_held[a] = moved / dt;
    }
}

void steer_cloth(Steer *s, const Lanes *lanes, const int *slot, int c, const SweepKick *kick,
                 double dt, double *work) {
    const int *first = s->system->first;
    for (int k = 0; k < s->held_count && s->held_places[k] < first[c + 1]; k++) {
        int i = s->held_places[k];
        if (i >= first[c]) {
            steer_place(s, lanes, i, slot[i], kick, dt, work);
        }
    }
}

void steer_changed(Steer *s, const Lanes *lanes, const int *slot, double dt, double *work) {
    for (int k = 0; k < s->held_count; k++) {
        int i = s->held_places[k];
        for (int a = 0; a < 3; a++) {
            double v = lanes->v[a][slot[i]], *v_held = &s->v_held[3 * i + a];
            *work -= s->force[3 * i + a] * (v - *v_held) * dt;
            *v_held = v;
        }
    }
}

void steer_end(const Steer *s, const Lanes *lanes, const int *slot) {
    for (int k = 0; k < s->held_count; k++) {
        int i = s->held_places[k];
        for (int a = 0; a < 3; a++) {
            lanes->v[a][slot[i]] = s->v_held[3 * i + a];
        }
    }
}
