/* interrupt.h: Ctrl-C and SIGTERM end the work between two frames, with nothing half-written. */
#ifndef TOILE_RENDER_INTERRUPT_H
#define TOILE_RENDER_INTERRUPT_H

#include <stdbool.h>

void interrupt_install(void); /* a second Ctrl-C kills at once; SIGPIPE becomes a write error */
bool interrupt_requested(void);

#endif
