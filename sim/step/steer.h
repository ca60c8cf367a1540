/* steer.h: what handles hold on the explicit road: where it must be at the end of a step, and the
 * work that takes: at nodes by what a kick would have given them, at the ghosts of clamps, which turn
 * the slope of the border, by the forces there. Where contact does not let a place follow, it stays behind and
 * comes after its handle when it can. */
#ifndef TOILE_STEP_STEER_H
#define TOILE_STEP_STEER_H

#include "sim/geom/lanes.h"
#include "sim/model/sweep.h"
#include "sim/step/system.h"

/* What is behind its handle comes after it, beside the handle's own speed, by this [m/s] and by what is missing in
 * this time [s]. */
#define STEER_CATCH_UP 0.5
#define STEER_CATCH_UP_TIME 0.5

/* where the targets of a handle stand */
typedef struct Placed {
    bool holds;
    Pose pose;
} Placed;

typedef struct Steer {
    const System *system;
    unsigned char *held; /* (place_count) */
    int held_count;
    int *held_places; /* (held_count) rising */
    double *targets;  /* [m] (place_count x 3) of held places */
    double *before;   /* [m] likewise, of the step before */
    Placed *placed;   /* (handle_count) what the targets are made of */
    bool targets_known, targets_move;
    double *v_held;       /* [m/s] (place_count x 3) of held places before a kick */
    double *force;        /* [N] (place_count x 3) on held places in the last kick */
    unsigned char *turns; /* (cloth_count) 1: a clamp of this cloth moves in the interval */
    double *ghost_force;  /* [N] (place_count x 3) of ghosts of such cloth at the last kick */
} Steer;

Steer steer_create(const System *system);

/* An interval begins at this state: what is held in it. */
void steer_begin(Steer *steer, const State *state);

/* Targets at `time` [s], for the step that ends there. */
void steer_place_targets(Steer *steer, double time);

/* Forces of cloth c with forces on all places in `lanes->f`, or, with `x` (place_count of the cloth x 3)
 * and `gradient` for work, of a cloth with a sweep. Only where a clamp moves. */
void steer_take_forces(Steer *steer, const Lanes *lanes, const int *slot, int c);
void steer_find_forces(Steer *steer, int c, const double *x, double *gradient);

/* After a kick of cloth c: gives its held places the velocities that lead to their targets in dt, or only nearer
 * where they are behind. slot: (place_count). Adds the work [J] on the cloth, minus inner force
 * times motion. */
void steer_cloth(Steer *steer, const Lanes *lanes, const int *slot, int c, const SweepKick *kick,
                 double dt, double *work);

/* After contact changed velocities: held places may move otherwise in dt, and so does the work. */
void steer_changed(Steer *steer, const Lanes *lanes, const int *slot, double dt, double *work);

/* The velocities of held places at the end: no kick moves a handle. */
void steer_end(const Steer *steer, const Lanes *lanes, const int *slot);

#endif
