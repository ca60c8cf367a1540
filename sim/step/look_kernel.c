/* look_kernel.c: the row loops of looks.h. Compiled once per vector width (see the Makefile). The order of
 * largest values does not matter: a row ends with a whole vector that begins within the one before. */
#include <stddef.h>

#include "sim/base/vector.h"
#include "sim/step/looks.h"

#define WHOLE_VECTORS 8 /* numbers of the widest kind */

typedef struct Most {
    double lane[WHOLE_VECTORS];
} Most;

static double most_of(const Most *most) {
    double all = 0.0;
    for (int k = 0; k < WHOLE_VECTORS; k++) {
        all = most->lane[k] > all ? most->lane[k] : all;
    }
    return all;
}

static inline void keep_larger(Most *most, int k, double x, double y, double z) {
    double square = x * x + y * y + z * z;
    most->lane[k] = square > most->lane[k] ? square : most->lane[k];
}

static inline void most_speed(const Lanes *lanes, size_t at, int width, Most *most) {
    const double *restrict x = lanes->v[0] + at, *restrict y = lanes->v[1] + at;
    const double *restrict z = lanes->v[2] + at;
    VECTOR_LOOP
    for (int k = 0; k < width; k++) {
        keep_larger(most, k, x[k], y[k], z[k]);
    }
}

/* of x, each against that `next` slots later */
static inline void most_difference(double *const x[3], size_t at, size_t next, int width,
                                   Most *most) {
    const double *restrict p = x[0] + at, *restrict q = x[1] + at, *restrict r = x[2] + at;
    VECTOR_LOOP
    for (int k = 0; k < width; k++) {
        size_t n = (size_t)k + next;
        keep_larger(most, k, p[n] - p[k], q[n] - q[k], r[n] - r[k]);
    }
}

/* of x - from, likewise */
static inline void most_spread(double *const x[3], double *const from[3], size_t at, size_t next,
                               int width, Most *most) {
    const double *restrict p = x[0] + at, *restrict q = x[1] + at, *restrict r = x[2] + at;
    const double *restrict u = from[0] + at, *restrict v = from[1] + at, *restrict w = from[2] + at;
    VECTOR_LOOP
    for (int k = 0; k < width; k++) {
        size_t n = (size_t)k + next;
        keep_larger(most, k, (p[n] - p[k]) - (u[n] - u[k]), (q[n] - q[k]) - (v[n] - v[k]),
                    (r[n] - r[k]) - (w[n] - w[k]));
    }
}

/* where the vector of a row begins whose nodes from i on are not done */
static int vector_start(int i, int count) {
    return i + WHOLE_VECTORS <= count ? i : count - WHOLE_VECTORS;
}

static double fastest_of_rows(const SweepLattice *l, const Lanes *lanes, int row_begin,
                              int row_end) {
    Most most = {{0.0}};
    for (int j = row_begin; j < row_end; j++) {
        size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
        if (l->nu < WHOLE_VECTORS) {
            most_speed(lanes, at, l->nu, &most);
            continue;
        }
        for (int i = 0; i < l->nu; i += WHOLE_VECTORS) {
            most_speed(lanes, at + (size_t)vector_start(i, l->nu), WHOLE_VECTORS, &most);
        }
    }
    return most_of(&most);
}

static void spread_row(double *const x[3], double *const from[3], size_t at, size_t next, int count,
                       Most *most) {
    bool whole = count >= WHOLE_VECTORS;
    for (int i = 0; i < count; i += WHOLE_VECTORS) {
        size_t begin = at + (size_t)(whole ? vector_start(i, count) : 0);
        if (whole && from) {
            most_spread(x, from, begin, next, WHOLE_VECTORS, most);
        } else if (whole) {
            most_difference(x, begin, next, WHOLE_VECTORS, most);
        } else if (from) {
            most_spread(x, from, begin, next, count, most);
        } else {
            most_difference(x, begin, next, count, most);
        }
    }
}

/* a wrapped row has its first node once more behind the last one */
static double spread_of_rows(const SweepLattice *l, double *const x[3], double *const from[3],
                             int row_begin, int row_end) {
    Most most = {{0.0}};
    for (int j = row_begin; j < row_end; j++) {
        size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
        spread_row(x, from, at, 1, l->wrap ? l->nu : l->nu - 1, &most);
        if (j + 1 < l->nv) {
            spread_row(x, from, at, (size_t)l->stride, l->nu, &most);
        }
    }
    return most_of(&most);
}

const LookKernel VECTOR_JOIN(look_kernel_, VECTOR_VARIANT) = {fastest_of_rows, spread_of_rows};
