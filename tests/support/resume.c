#include "tests/support/resume.h"

#include <stdio.h>

#include "tests/support/check.h"
#include "tests/support/folder.h"
#include "tests/support/shell.h"

static void run(const char *arguments) {
    char command[1000], text[4096];
    snprintf(command, sizeof command, "%s/scripts/toile %s 2>&1", TOILE_SOURCE_DIR, arguments);
    if (shell_run(command, text, sizeof text) != 0) {
        fail_msg("%s\n%s", command, text);
    }
}

static void simulate(const char *into, int frames, const char *more) {
    char arguments[800];
    snprintf(arguments, sizeof arguments, "sim %s -o %s --frames %d %s --quiet",
             folder_path("resume.yaml"), folder_path(into), frames, more);
    run(arguments);
}

void resume_check(const char *scene, int stop, int frames) {
    char arguments[800];
    FILE *file = fopen(folder_path("resume.yaml"), "w");
    assert_non_null(file);
    fputs(scene, file);
    assert_int_equal(fclose(file), 0);
    simulate("whole", frames, "--threads 1");
    simulate("parts", stop, "--threads 2");
    simulate("parts", frames, "--resume --threads 3");
    snprintf(arguments, sizeof arguments, "diff --profile exact %s %s", folder_path("whole"),
             folder_path("parts"));
    run(arguments);
}
