#include "tests/support/play.h"

#include <string.h>

#include "tests/support/check.h"

void play_start(Play *play, const char *text) { play_start_threads(play, text, 1); }

void play_start_threads(Play *play, const char *text, int threads) {
    Error error = {0};
    SimOptions options = sim_options_default();
    options.threads = threads;
    memset(play, 0, sizeof *play);
    if (!scene_parse("play", text, strlen(text), NULL, &play->arena, &play->scene, &error) ||
        !sim_create(&play->sim, &play->scene, &options, &error)) {
        fail_msg("%s", error.text);
    }
}

void play_to(Play *play, double time) {
    Error error = {0};
    while (play->sim.state.time < time - 1e-9) {
        if (!sim_advance(&play->sim, &error)) {
            fail_msg("%s", error.text);
        }
    }
}

long play_crossings(const Play *play) {
    return system_crossings(&play->sim.system, &play->sim.state);
}

void play_end(Play *play) {
    sim_destroy(&play->sim);
    arena_free(&play->arena);
}

Vec3 play_x(const Play *play, int place) {
    return vec3_load(play->sim.state.x + 3 * (size_t)place);
}
Vec3 play_v(const Play *play, int place) {
    return vec3_load(play->sim.state.v + 3 * (size_t)place);
}

static Vec3 mean(const Play *play, const double *values) {
    Vec3 sum = {0, 0, 0};
    int count = play->sim.system.place_count;
    for (int i = 0; i < count; i++) {
        sum = vec3_axpy(sum, 1.0 / count, vec3_load(values + 3 * (size_t)i));
    }
    return sum;
}

Vec3 play_mean_x(const Play *play) { return mean(play, play->sim.state.x); }
Vec3 play_mean_v(const Play *play) { return mean(play, play->sim.state.v); }
