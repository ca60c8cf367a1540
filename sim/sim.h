/* sim.h: owns a simulation and advances it frame by frame. For files of this folder and tests. */
#ifndef TOILE_SIM_H
#define TOILE_SIM_H

#include "sim/base/version.h"
#include "sim/start.h"
#include "sim/state/state.h"
#include "sim/step/stepper.h"

typedef struct SimOptions {
    int threads;   /* 1 */
    uint64_t seed; /* of noise and scattered nodes; 0 */
} SimOptions;

typedef struct Sim {
    const Scene *scene;
    SimOptions options;
    uint64_t hash; /* of everything that determines the states: scene, seed */
    Arena arena;
    System system;
    const Stepper *stepper;
    const char *stepper_why;
    void *stepper_data;
    State state;
    int frame;             /* number of the frame that `state` is */
    Statistics statistics; /* of the last frame */
    Statistics total;      /* sums over the frames made by this process */
    StartMoves moves;      /* before the first step */
    int stretched, behind; /* the cloths of statistics.stretch and of statistics.behind */
    double *packed;        /* (node_count x 9) positions, velocities, forces without ghosts */
} Sim;

SimOptions sim_options_default(void);

/* Builds everything and stands at frame 0. Errors: EXIT_BAD_INPUT. */
bool sim_create(Sim *sim, const Scene *scene, const SimOptions *options, Error *error);
void sim_destroy(Sim *sim);

/* From frame n to frame n + 1. Errors: EXIT_DIFFERS, EXIT_INTERRUPTED; the state is kept. */
bool sim_advance(Sim *sim, Error *error);

/* Header and layout of the states file. */
bool sim_write_start(const Sim *sim, StateWriter *writer, Error *error);
/* The present frame, with everything that is needed to go on with the same bits. */
bool sim_write_frame(Sim *sim, StateWriter *writer, Error *error);

/* Takes over frame `index` of a states file of the same scene. Errors: EXIT_BAD_INPUT. */
bool sim_load_frame(Sim *sim, StateReader *reader, int index, Error *error);

/* Hash of positions and velocities of all nodes. */
uint64_t sim_state_hash(const Sim *sim);

#endif
