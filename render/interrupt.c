#include "render/interrupt.h"

#include <signal.h>

static volatile sig_atomic_t requested;

static void on_signal(int number) {
    requested = 1;
    signal(number, SIG_DFL);
}

void interrupt_install(void) {
    signal(SIGINT, on_signal);
    signal(SIGTERM, on_signal);
    signal(SIGPIPE, SIG_IGN);
}

bool interrupt_requested(void) { return requested != 0; }
