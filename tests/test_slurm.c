/* scripts/slurm_array.sh against a real slurmctld and slurmd, where they are installed. */
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include "tests/support/check.h"

static void test_array(void **state) {
    (void)state;
    char line[1024];
    FILE *out =
        popen("TOILE_BUILD=" TOILE_SOURCE_DIR "/build/${TOILE_CONFIG:-release} " TOILE_SOURCE_DIR
              "/scripts/test_slurm.sh 2>&1",
              "r");
    assert_non_null(out);
    while (fgets(line, sizeof line, out)) {
        fputs(line, stdout); /* SKIPPED stands at the beginning of a line */
    }
    int status = pclose(out);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_array)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
