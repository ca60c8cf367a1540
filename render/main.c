/* main.c: the program toile-render: runs a verb and prints its error. */
#include <stdio.h>

#include "render/command.h"
#include "render/interrupt.h"
#include "sim/base/parallel.h"

int main(int argc, char **argv) {
    parallel_fix_environment(argv);
    Error error = {0};
    interrupt_install();
    ExitCode code = command_run(argc, argv, &error);
    if (error.code != EXIT_OK) {
        fprintf(stderr, "toile: %s\n", error.text);
    }
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == EXIT_OK) {
        fprintf(stderr, "toile: stdout could not be written\n");
        code = EXIT_IO;
    }
    return code;
}
