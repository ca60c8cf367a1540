#include "tests/support/render_child.h"

#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

uint64_t render_child_value(uint64_t (*work)(void *), void *context) {
    int ends[2];
    uint64_t value = 0;
    fflush(NULL);
    if (pipe(ends) != 0) {
        return 0;
    }
    pid_t child = fork();
    if (child == 0) {
        value = work(context);
        ssize_t written = write(ends[1], &value, sizeof value);
        _exit(written == sizeof value ? 0 : 1);
    }
    close(ends[1]);
    if (read(ends[0], &value, sizeof value) != sizeof value) {
        value = 0;
    }
    close(ends[0]);
    render_child_wait(child);
    return value;
}

pid_t render_child_start(int (*work)(void *), void *context) {
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        _exit(work(context));
    }
    return child;
}

int render_child_wait(pid_t child) {
    int status = 0;
    if (waitpid(child, &status, 0) != child || !WIFEXITED(status)) {
        return -1;
    }
    return WEXITSTATUS(status);
}
