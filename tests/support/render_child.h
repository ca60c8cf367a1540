/* render_child.h: work in a child process. A process has one GL context and reads the number of
 * raster threads once, so tests that vary it need fresh processes. */
#ifndef TOILE_TESTS_RENDER_CHILD_H
#define TOILE_TESTS_RENDER_CHILD_H

#include <stdint.h>
#include <sys/types.h>

/* Runs work(context) in a child and returns what it returned; 0 when it died. */
uint64_t render_child_value(uint64_t (*work)(void *), void *context);

/* Starts a child that exits with work(context); wait returns its exit code, -1 when it died. */
pid_t render_child_start(int (*work)(void *), void *context);
int render_child_wait(pid_t child);

#endif
