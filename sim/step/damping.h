/* damping.h: the book of damping on the explicit road: inside the fabrics, which are bent and
 * stretched ahead of the motion (lead.h), and by mass damping and drag. The work of a step is
 *
 *   - (f(x + tau v) - f(x)) . w dt     and     c m v . w dt
 *
 * with w the mean of the velocities before the kick and after the guard, as in contact/losses.c. It
 * takes the forces of a step twice more, so an interval is cut into spans of at most DAMPING_SPAN steps,
 * DAMPING_LEAST_SPANS at least, of each of which one step is measured, drawn anew, and counts for all. */
#ifndef TOILE_STEP_DAMPING_H
#define TOILE_STEP_DAMPING_H

#include "sim/geom/lanes.h"
#include "sim/model/sweep.h"
#include "sim/step/lead.h"

#define DAMPING_SPAN 64
#define DAMPING_LEAST_SPANS 4

/* The parts of the engine that the book looks at; borrowed. */
typedef struct DampingView {
    const SweepKernel *kernel;
    const SweepLattice *lattices; /* (cloth_count) nu = 0: no sweep */
    const int *grain;             /* (cloth_count) rows of a chunk */
    const Lanes *lanes;
    const int *slot;           /* (place_count) */
    double *buffers;           /* row buffers, one set a chunk */
    size_t buffer_size;        /* [double] of one chunk */
    double *place[3];          /* [m] (place_count x 3) work space */
    double *gradient;          /* [N] likewise */
    const unsigned char *held; /* (place_count) moved by a handle: mass damping takes nothing */
    const Lead *bending, *membrane;
} DampingView;

typedef struct Damping {
    const System *system;
    DampingView view;
    Lanes ahead;         /* those of the engine, but v: [N] what damping adds to the forces */
    double *before[3];   /* [m/s] (slot_count) velocities before the kick */
    double *rows[2];     /* [J] of rows: fabric, drag */
    long first;          /* steps before this interval, all as long as those of now */
    int step, steps;     /* of this interval */
    int measured;        /* the step of this span that is */
    int span;            /* [1] steps that a measured one counts for; 0: this one is not */
    double fabric, drag; /* [J] taken out in this interval; drag less what the wind does */
} Damping;

Damping damping_create(const System *system, const DampingView *view);

/* An interval of so many steps of dt begins at `time`. */
void damping_start(Damping *damping, double time, double dt, int steps);
/* Before the kick of every step, and when the guard has settled the velocities. */
void damping_before(Damping *damping);
void damping_after(Damping *damping, double dt);

#endif
