#include "sim/base/vector.h"

#include <stdlib.h>
#include <string.h>

bool vector_runs_here(VectorWidth width) {
    switch (width) {
    case VECTOR_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl");
    case VECTOR_AVX2:
        return __builtin_cpu_supports("avx2");
    default:
        return true;
    }
}

VectorWidth vector_best(void) {
    static const char *const names[] = {"scalar", "sse2", "avx2", "avx512"};
    const char *wanted = getenv("TOILE_VECTORS");
    VectorWidth best = VECTOR_SCALAR;
    for (VectorWidth width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
        if (vector_runs_here(width)) {
            best = width;
            if (wanted && strcmp(wanted, names[width]) == 0) {
                break;
            }
        }
    }
    return best;
}
