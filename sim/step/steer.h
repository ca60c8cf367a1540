/* steer.h: what handles hold on the explicit road: where it must be at the end of a step, and the
 * work that takes: at nodes by what a kick would have given them, at the ghosts of clamps, which turn
 * the slope of the border, by the forces there. */
#ifndef TOILE_STEP_STEER_H
#define TOILE_STEP_STEER_H

#include "sim/geom/lanes.h"
#include "sim/model/sweep.h"
#include "sim/step/system.h"

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
    Placed *placed;   /* (handle_count) what the targets are made of */
    bool targets_known;
    double *v_held;       /* [m/s] (place_count x 3) of held places before a kick */
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

/* After a kick of cloth c: gives its held places the velocities that lead to their targets in dt.
 * slot: (place_count). Adds the work [J] on the cloth, minus inner force times motion. */
void steer_cloth(Steer *steer, const Lanes *lanes, const int *slot, int c, const SweepKick *kick,
                 double dt, double *work);

/* The velocities v (place_count x 3) of held places at the end: no kick moves a handle. */
void steer_end(const Steer *steer, double *v);

#endif
