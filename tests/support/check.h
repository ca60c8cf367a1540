/* check.h: cmocka with the headers that it needs before it. */
#ifndef TOILE_TESTS_CHECK_H
#define TOILE_TESTS_CHECK_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>

/* |value - expected| <= tolerance; prints the numbers when it does not hold. NAN fails. */
#define CHECK_NEAR(value, expected, tolerance)                                                     \
    check_near((value), (expected), (tolerance), #value, __FILE__, __LINE__)
/* value <= limit. TOLERANCES=print shows the reached value beside the demanded one. */
#define CHECK_AT_MOST(value, limit) check_at_most((value), (limit), #value, __FILE__, __LINE__)

void check_near(double value, double expected, double tolerance, const char *what, const char *file,
                int line);
void check_at_most(double value, double limit, const char *what, const char *file, int line);

#endif
