/* Fuzzes the reader of thresholds files: whatever the bytes are, the answer is limits for any picture, or
 * a message that names the line.
 * Needs clang -fsanitize=fuzzer; corpus: thresholds files (scripts/fuzz.sh makes them). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/diff.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const char *path, const DiffProfile *profile) {
    static const char *const names[] = {"a.png", "some/hero-2.png", "", "[", "x.states"};
    DiffRules rules = diff_rules_of(profile);
    Error error = {0};
    if (!diff_rules_read(path, &rules, &error)) {
        ASSERT(error.code == EXIT_BAD_INPUT && strstr(error.text, path));
        return;
    }
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        DiffGate gate = diff_rules_gate(&rules, names[i]);
        for (int k = 0; k < DIFF_METRIC_COUNT; k++) { /* off of a lower limit is minus infinity */
            ASSERT(isnan(gate.limit[k]) || isinf(gate.limit[k]) || gate.limit[k] >= 0.0);
        }
        ASSERT(isnan(gate.step) || gate.step >= 0.0);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static char path[64];
    if (!path[0]) {
        char folder[32] = "/tmp/toile_fuzz_XXXXXX";
        ASSERT(mkdtemp(folder));
        snprintf(path, sizeof path, "%s/limits", folder);
    }
    FILE *file = fopen(path, "wb");
    ASSERT(file && fwrite(data, 1, size, file) == size);
    fclose(file);
    for (int i = 0; i < diff_profile_count; i++) {
        check(path, &diff_profiles[i]);
    }
    return 0;
}
