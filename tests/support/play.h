/* play.h: a scene given as text, simulated frame by frame, with every frame judged by the exact
 * crossing check. */
#ifndef TOILE_TESTS_PLAY_H
#define TOILE_TESTS_PLAY_H

#include "sim/sim.h"

typedef struct Play {
    Arena arena;
    Scene scene;
    Sim sim;
} Play;

/* Fails the test when the text is no scene. */
void play_start(Play *play, const char *text);
void play_start_threads(Play *play, const char *text, int threads);
/* To the first frame at or after `time` [s]. */
void play_to(Play *play, double time);
/* Crossing pairs now: cloth with itself, other cloth and every obstacle. */
long play_crossings(const Play *play);
void play_end(Play *play);

/* Position and velocity of node `place`. */
Vec3 play_x(const Play *play, int place);
Vec3 play_v(const Play *play, int place);
/* Means over all nodes. */
Vec3 play_mean_x(const Play *play);
Vec3 play_mean_v(const Play *play);

#endif
