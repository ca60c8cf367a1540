/* shell.h: programs run by the shell. */
#ifndef TOILE_TESTS_SHELL_H
#define TOILE_TESTS_SHELL_H

#include <stddef.h>

/* Runs a command; what it prints goes to `text`, cut to size - 1 characters. Returns its exit code,
 * -1 when a signal ended it. */
int shell_run(const char *command, char *text, size_t size);

#endif
