#include "tests/support/shell.h"

#include <stdio.h>
#include <sys/wait.h>

#include "tests/support/check.h"

int shell_run(const char *command, char *text, size_t size) {
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t length = fread(text, 1, size - 1, pipe);
    text[length] = 0;
    int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}
