/* run.h: a run of the simulator as the renderer sees it: a states file that may still grow. */
#ifndef TOILE_RENDER_RUN_H
#define TOILE_RENDER_RUN_H

#include "render/camera.h"
#include "sim/state/state.h"

#define RUN_FILE "run.states" /* inside a run directory */
#define RUN_PATH_SIZE 4096

typedef struct RunDef {
    const char *path; /* of a run directory or a states file */
    bool follow;      /* wait for frames that are not there yet */
    int writer;       /* process that writes the file: the run ends with it; 0 = unknown */
    double patience;  /* [s] without growth until an unknown writer counts as dead; 60 */
} RunDef;

RunDef run_default(void);

typedef enum RunEnd {
    RUN_FRAME,      /* the frame is there */
    RUN_FINISHED,   /* the run ended before it */
    RUN_ABANDONED,  /* the writer died before it: the run can be resumed */
    RUN_DAMAGED,    /* the file is wrong before it, see state_damage */
    RUN_INTERRUPTED /* Ctrl-C */
} RunEnd;

typedef struct Run {
    RunDef def;
    char path[RUN_PATH_SIZE]; /* of the states file */
    StateReader *reader;
    double grown; /* [s] when the file was last seen to grow */
    int seen;     /* frames at that time */
} Run;

/* Opens a run; in follow mode waits for the file and its header.
 * Errors: as state_open; EXIT_INTERRUPTED. */
bool run_open(Run *run, const RunDef *def, Error *error);
void run_close(Run *run);

/* Waits until frame `index` (from 0) can be read, or never will be. Without follow: looks once. */
RunEnd run_wait(Run *run, int index);

/* Waits for the end of the run and returns how it ended (never RUN_FRAME). */
RunEnd run_wait_end(Run *run);

/* Height of the floor that an upright plane among the obstacles gives at the start of the run,
 * and which obstacle that is; NAN and -1 if there is none. Needs the first frame. */
double run_floor(Run *run, int *obstacle, Error *error);

/* How far all frames of the run reach, for a picture of this size. */
bool run_find_reach(Run *run, int width, int height, CameraReach *reach, Error *error);

/* Hash of everything in frames first .. end - 1 that a picture shows. */
bool run_hash(Run *run, int first, int end, uint64_t *hash, Error *error);

#endif
