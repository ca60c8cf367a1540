/* tester.h: virtual testers: `toile test NAME FABRIC`. A family: a new tester is one function and one
 * line in the table of tester.c. What they do: tester_loop.h, tester_strip.h. */
#ifndef TOILE_SIM_TESTER_H
#define TOILE_SIM_TESTER_H

#include <stdio.h>

#include "sim/base/arena.h"
#include "sim/base/error.h"
#include "sim/scene/fabric.h"

enum { TESTER_COLUMNS = 6, TESTER_NUMBERS = 8 };

typedef struct TesterNumber {
    const char *key, *label, *unit; /* of JSON; printed */
    double value, fabric;           /* NAN: the fabric does not say */
} TesterNumber;

/* What a tester found: rows of numbers, and numbers of the whole. */
typedef struct TesterReport {
    const char *columns[TESTER_COLUMNS];   /* with units; the last are what the fabric says */
    int column_count, row_count, weft_row; /* first row along the weft; row_count: none */
    double *rows;                          /* (row_count x column_count) */
    TesterNumber numbers[TESTER_NUMBERS];
    int number_count;
    double curve_error; /* of the first loading, see tester_curve_error; NAN */
} TesterReport;

typedef struct Tester {
    const char *name, *about;
    bool both; /* along warp and weft: rows begin with the word */
    bool (*run)(const Fabric *fabric, const char *model, Arena *arena, TesterReport *report,
                Error *error);
} Tester;

extern const Tester testers[]; /* ends with a name that is NULL */

/* The rows as CSV on out, the numbers beside those of the fabric on stderr; `json`: the numbers alone
 * on out. Errors: EXIT_USAGE when there is no such test, those of the fabric, of the model. */
bool tester_print(const char *test, const char *fabric, const char *model, bool json, FILE *out,
                  Error *error);

#endif
