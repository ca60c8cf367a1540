#include "sim/geom/exact.h"

#include <gmp.h>
#include <math.h>

#include "sim/base/error.h"

#define UNIT 0x1p-53 /* rounding unit of double */
#define BOUND_3D ((7.0 + 56.0 * UNIT) * UNIT)
#define BOUND_2D ((3.0 + 16.0 * UNIT) * UNIT)
/* Underflow of a product loses at most 2^-1074, times a height of at most LARGEST: far below
 * SMALLEST. Determinants or heights outside go to the rationals. */
#define SMALLEST 1e-250
#define LARGEST 1e50

static void set_difference(mpq_t result, double a, double b, mpq_t work) {
    ASSERT(isfinite(a) && isfinite(b));
    mpq_set_d(result, a);
    mpq_set_d(work, b);
    mpq_sub(result, result, work);
}

/* result = a d - b c */
static void set_minor(mpq_t result, mpq_t a, mpq_t b, mpq_t c, mpq_t d, mpq_t work) {
    mpq_mul(result, a, d);
    mpq_mul(work, b, c);
    mpq_sub(result, result, work);
}

int exact_orient3d_rational(const double a[3], const double b[3], const double c[3],
                            const double d[3]) {
    const double *points[3] = {b, c, d};
    mpq_t m[3][3], minor, sum, work;
    mpq_inits(minor, sum, work, NULL);
    for (int i = 0; i < 9; i++) {
        mpq_init(m[i / 3][i % 3]);
        set_difference(m[i / 3][i % 3], points[i / 3][i % 3], a[i % 3], work);
    }
    for (int i = 0; i < 3; i++) { /* by the last column */
        int j = (i + 1) % 3, k = (i + 2) % 3;
        set_minor(minor, m[j][0], m[j][1], m[k][0], m[k][1], work);
        mpq_mul(minor, minor, m[i][2]);
        mpq_add(sum, sum, minor);
    }
    int sign = mpq_sgn(sum);
    for (int i = 0; i < 9; i++) {
        mpq_clear(m[i / 3][i % 3]);
    }
    mpq_clears(minor, sum, work, NULL);
    return sign;
}

int exact_orient2d_rational(const double a[3], const double b[3], const double c[3], int drop) {
    int i = (drop + 1) % 3, j = (drop + 2) % 3;
    mpq_t m[4], det, work;
    mpq_inits(m[0], m[1], m[2], m[3], det, work, NULL);
    set_difference(m[0], b[i], a[i], work);
    set_difference(m[1], b[j], a[j], work);
    set_difference(m[2], c[i], a[i], work);
    set_difference(m[3], c[j], a[j], work);
    set_minor(det, m[0], m[1], m[2], m[3], work);
    int sign = mpq_sgn(det);
    mpq_clears(m[0], m[1], m[2], m[3], det, work, NULL);
    return sign;
}

static int sign_of(double x) { return (x > 0.0) - (x < 0.0); }

/* all four points in a plane across an axis: common, and exactly 0 */
static int share_coordinate(const double *a, const double *b, const double *c, const double *d) {
    for (int i = 0; i < 3; i++) {
        if (a[i] == d[i] && b[i] == d[i] && c[i] == d[i]) {
            return 1;
        }
    }
    return 0;
}

int exact_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]) {
    double adx = a[0] - d[0], bdx = b[0] - d[0], cdx = c[0] - d[0];
    double ady = a[1] - d[1], bdy = b[1] - d[1], cdy = c[1] - d[1];
    double adz = a[2] - d[2], bdz = b[2] - d[2], cdz = c[2] - d[2];
    double bxcy = bdx * cdy, cxby = cdx * bdy;
    double cxay = cdx * ady, axcy = adx * cdy;
    double axby = adx * bdy, bxay = bdx * ady;
    double det = adz * (bxcy - cxby) + bdz * (cxay - axcy) + cdz * (axby - bxay);
    double permanent = fabs(adz) * (fabs(bxcy) + fabs(cxby)) +
                       fabs(bdz) * (fabs(cxay) + fabs(axcy)) +
                       fabs(cdz) * (fabs(axby) + fabs(bxay));
    double height = fmax(fabs(adz), fmax(fabs(bdz), fabs(cdz)));
    if (fabs(det) > BOUND_3D * permanent + SMALLEST && height < LARGEST) {
        return -sign_of(det); /* differences to d: the other way round */
    }
    return share_coordinate(a, b, c, d) ? 0 : exact_orient3d_rational(a, b, c, d);
}

int exact_orient2d(const double a[3], const double b[3], const double c[3], int drop) {
    int i = (drop + 1) % 3, j = (drop + 2) % 3;
    double left = (a[i] - c[i]) * (b[j] - c[j]), right = (a[j] - c[j]) * (b[i] - c[i]);
    double det = left - right;
    if (fabs(det) > BOUND_2D * (fabs(left) + fabs(right)) + SMALLEST) {
        return sign_of(det);
    }
    if ((a[i] == c[i] && b[i] == c[i]) || (a[j] == c[j] && b[j] == c[j])) {
        return 0;
    }
    return exact_orient2d_rational(a, b, c, drop);
}
