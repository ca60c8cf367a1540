/* jobs.h: frames drawn by several processes, handed back in their order.
 *
 * A process has one GL context, and llvmpipe lets only one draw at a time in a process: frames go
 * to processes, not to threads. Frames are the same bytes whoever draws them. The caller must not
 * have opened GL or started threads before jobs_start.
 */
#ifndef TOILE_RENDER_JOBS_H
#define TOILE_RENDER_JOBS_H

#include "render/command.h"

#define JOBS_MOST 64

typedef struct Jobs Jobs;

/* Starts `count` processes that draw the run of the options. Errors: EXIT_IO. */
Jobs *jobs_start(const Options *options, int count, int width, int height, Error *error);

/* True if every process has two frames: then jobs_next must come before jobs_give. */
bool jobs_are_full(Jobs *jobs);
/* Gives a frame, which must be there, to the process whose turn it is; key comes back with it. */
bool jobs_give(Jobs *jobs, int frame, uint64_t key, Error *error);

/* Waits for the frame that was given first; false in *any: there is none. *image is valid until the
 * next jobs_give. Errors: those of drawing; EXIT_OUR_BUG: the process died; EXIT_INTERRUPTED. */
bool jobs_next(Jobs *jobs, bool *any, Image *image, int *frame, uint64_t *key, Error *error);

/* Ends the processes, whatever they do, and frees. */
void jobs_stop(Jobs *jobs);

#endif
