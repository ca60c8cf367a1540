#include "tests/support/check.h"

#include <stdlib.h>

void check_near(double value, double expected, double tolerance, const char *what, const char *file,
                int line) {
    if (getenv("TOLERANCES")) {
        print_message("  %s = %.9g, expected %.9g +- %.3g\n", what, value, expected, tolerance);
    }
    if (!(fabs(value - expected) <= tolerance)) {
        print_error("%s = %.12g, expected %.12g +- %.3g\n", what, value, expected, tolerance);
        _fail(file, line);
    }
}

void check_at_most(double value, double limit, const char *what, const char *file, int line) {
    if (getenv("TOLERANCES")) {
        print_message("  %s = %.4g, at most %.4g\n", what, value, limit);
    }
    if (!(value <= limit)) {
        print_error("%s = %.6g, at most %.6g was demanded\n", what, value, limit);
        _fail(file, line);
    }
}
