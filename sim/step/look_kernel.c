/* look_kernel.c: the row loops of looks.h. Compiled once per vector width (see the Makefile). The order of
 * largest values does not matter: a row ends with a whole vector that begins within the one before. */
#include <math.h>
#include <stddef.h>

#include "sim/base/vector.h"
#include "sim/step/looks.h"

/* numbers of a vector: a loop over one keeps what it needs in registers */
#if defined __AVX512F__
#define WHOLE_VECTORS 8
#elif defined __AVX2__
#define WHOLE_VECTORS 4
#else
#define WHOLE_VECTORS 2
#endif
/* a loop for each use, with its flags known */
#define ONE_LOOP static inline __attribute__((always_inline))

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

/* Of x - from, or of x where `from` is NULL: each against that right of it, if `right`, into most[0], and against
 * that `up` slots later, if `above`, into most[1]. */
ONE_LOOP void most_apart(double *const x[3], double *const from[3], size_t at, bool right,
                         bool above, size_t up, int width, Most most[2]) {
    const double *restrict p = x[0] + at, *restrict q = x[1] + at, *restrict r = x[2] + at;
    const double *restrict u = from ? from[0] + at : p, *restrict v = from ? from[1] + at : q;
    const double *restrict w = from ? from[2] + at : r;
    VECTOR_LOOP
    for (int k = 0; k < width; k++) {
        size_t n = (size_t)k + 1, m = (size_t)k + up;
        double a = from ? p[k] - u[k] : p[k], b = from ? q[k] - v[k] : q[k];
        double c = from ? r[k] - w[k] : r[k];
        if (right) {
            keep_larger(most, k, (from ? p[n] - u[n] : p[n]) - a, (from ? q[n] - v[n] : q[n]) - b,
                        (from ? r[n] - w[n] : r[n]) - c);
        }
        if (above) {
            keep_larger(most + 1, k, (from ? p[m] - u[m] : p[m]) - a,
                        (from ? q[m] - v[m] : q[m]) - b, (from ? r[m] - w[m] : r[m]) - c);
        }
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

/* nodes of a row from `begin` on */
ONE_LOOP void spread_nodes(double *const x[3], double *const from[3], size_t at, int begin,
                           int count, bool right, bool above, size_t up, Most most[2]) {
    bool whole = count >= WHOLE_VECTORS;
    for (int i = begin; whole && i < count; i += WHOLE_VECTORS) {
        most_apart(x, from, at + (size_t)vector_start(i, count), right, above, up, WHOLE_VECTORS,
                   most);
    }
    if (!whole && begin < count) {
        most_apart(x, from, at + (size_t)begin, right, above, up, count - begin, most);
    }
}

/* a wrapped row has its first node once more behind the last one */
ONE_LOOP void spread_all(const SweepLattice *l, double *const x[3], double *const from[3],
                         int row_begin, int row_end, double out[2]) {
    Most most[2] = {{{0.0}}, {{0.0}}};
    int pairs = l->wrap ? l->nu : l->nu - 1;
    for (int j = row_begin; j < row_end; j++) {
        size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
        if (j + 1 == l->nv) {
            spread_nodes(x, from, at, 0, pairs, true, false, 0, most);
            continue;
        }
        spread_nodes(x, from, at, 0, pairs, true, true, (size_t)l->stride, most);
        for (int i = pairs; i < l->nu; i++) {
            most_apart(x, from, at + (size_t)i, false, true, (size_t)l->stride, 1, most);
        }
    }
    out[0] = most_of(&most[0]), out[1] = most_of(&most[1]);
}

static void spread_of_rows(const SweepLattice *l, double *const x[3], double *const from[3],
                           int row_begin, int row_end, double most[2]) {
    if (from) {
        spread_all(l, x, from, row_begin, row_end, most);
    } else {
        spread_all(l, x, NULL, row_begin, row_end, most);
    }
}

/* x - from, in lanes */
typedef struct Moved {
    double low[WHOLE_VECTORS], high[WHOLE_VECTORS];
} Moved;

static inline void keep_moved(Moved *moved, const double *restrict x, const double *restrict from,
                              int width) {
    VECTOR_LOOP
    for (int k = 0; k < width; k++) {
        double d = x[k] - from[k];
        moved->low[k] = d < moved->low[k] ? d : moved->low[k];
        moved->high[k] = d > moved->high[k] ? d : moved->high[k];
    }
}

/* of one axis */
static void moved_of_rows(const SweepLattice *l, const double *x, const double *from, int row_begin,
                          int row_end, double *low, double *high) {
    Moved moved;
    for (int k = 0; k < WHOLE_VECTORS; k++) {
        moved.low[k] = INFINITY, moved.high[k] = -INFINITY;
    }
    for (int j = row_begin; j < row_end; j++) {
        size_t at = (size_t)l->first + (size_t)j * (size_t)l->stride;
        if (l->nu < WHOLE_VECTORS) {
            keep_moved(&moved, x + at, from + at, l->nu);
            continue;
        }
        for (int i = 0; i < l->nu; i += WHOLE_VECTORS) {
            size_t n = at + (size_t)vector_start(i, l->nu);
            keep_moved(&moved, x + n, from + n, WHOLE_VECTORS);
        }
    }
    *low = INFINITY, *high = -INFINITY;
    for (int k = 0; k < WHOLE_VECTORS; k++) {
        *low = moved.low[k] < *low ? moved.low[k] : *low;
        *high = moved.high[k] > *high ? moved.high[k] : *high;
    }
}

static Box box_of_rows(const SweepLattice *l, double *const x[3], double *const from[3],
                       int row_begin, int row_end) {
    Box box;
    moved_of_rows(l, x[0], from[0], row_begin, row_end, &box.low.x, &box.high.x);
    moved_of_rows(l, x[1], from[1], row_begin, row_end, &box.low.y, &box.high.y);
    moved_of_rows(l, x[2], from[2], row_begin, row_end, &box.low.z, &box.high.z);
    return box;
}

static void lead_slots(double *const x[3], double *const v[3], double *const out[3], double ahead,
                       int count) {
    for (int a = 0; a < 3; a++) {
        const double *restrict p = x[a], *restrict q = v[a];
        double *restrict to = out[a];
        VECTOR_LOOP
        for (int k = 0; k < count; k++) {
            to[k] = p[k] + ahead * q[k];
        }
    }
}

const LookKernel VECTOR_JOIN(look_kernel_, VECTOR_VARIANT) = {fastest_of_rows, spread_of_rows,
                                                              box_of_rows, lead_slots};
