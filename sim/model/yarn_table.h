/* yarn_table.h: a measured curve through the origin: piecewise cubic, monotone, once differentiable
 * (Fritsch, Carlson 1980; slopes by Butland's mean), straight beyond the last knot. The curve is odd;
 * arguments are >= 0 here. */
#ifndef TOILE_MODEL_YARN_TABLE_H
#define TOILE_MODEL_YARN_TABLE_H

#include <stdbool.h>

#define YARN_TABLE_MOST 33 /* knots, with the origin */

typedef struct YarnTable {
    int count; /* of knots, the origin first */
    double at[YARN_TABLE_MOST];
    double c[YARN_TABLE_MOST][4]; /* from knot k on: c0 + d (c1 + d (c2 + d c3)), d = at - knot */
    double work[YARN_TABLE_MOST]; /* integral from 0 to the knot */
} YarnTable;

/* `count` points without the origin, at least 1; `at` rises. Returns the index of the first point
 * whose value does not rise, or -1: the table is made. */
int yarn_table_create(int count, const double *at, const double *value, YarnTable *table);

/* always inlined: loops over rows are vector code */
__attribute__((always_inline)) static inline double yarn_table_value(const YarnTable *t, double at,
                                                                     double *slope) {
    int k = 0;
    for (int i = 1; i < t->count; i++) {
        k += at >= t->at[i];
    }
    const double *c = t->c[k];
    double d = at - t->at[k];
    *slope = c[1] + d * (2.0 * c[2] + 3.0 * d * c[3]);
    return c[0] + d * (c[1] + d * (c[2] + d * c[3]));
}

double yarn_table_work(const YarnTable *table, double at); /* integral from 0 */
/* integral of value times cosine from 0 */
double yarn_table_cosine_work(const YarnTable *table, double at);
double yarn_table_stiffest(const YarnTable *table); /* largest slope */

#endif
