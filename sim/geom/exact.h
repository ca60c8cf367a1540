/* exact.h: on which side a point lies, decided without rounding.
 *
 * The coordinates are doubles and taken as they stand; the answer is the sign of the determinant
 * in exact arithmetic. A floating-point filter decides nearly always:
 *
 *   orient3d  |det| > (7 + 56 e) e permanent,  orient2d  |det| > (3 + 16 e) e permanent,
 *   e = 2^-53, permanent = the same sum with absolute values
 *
 * [Shewchuk 1997, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
 * Predicates, section 4.3]; an absolute margin covers underflow, which that proof leaves out.
 * What the filter leaves open is computed with rationals (GMP, known to exact.c only): some 5 us.
 *
 * Coordinates must be finite (asserted where rationals are needed). Thread-safe.
 */
#ifndef TOILE_GEOM_EXACT_H
#define TOILE_GEOM_EXACT_H

/* Sign of (b - a) x (c - a) . (d - a): 1 when d is on the side of the plane abc from which a, b, c
 * run anticlockwise, -1 on the other, 0 when the four points are coplanar. */
int exact_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]);

/* Sign of the area of abc seen along axis `drop` (0, 1, 2 = x, y, z; from its positive end): 1 when
 * a, b, c run anticlockwise, 0 when they are collinear there. */
int exact_orient2d(const double a[3], const double b[3], const double c[3], int drop);

/* The same without the filter; for tests. */
int exact_orient3d_rational(const double a[3], const double b[3], const double c[3],
                            const double d[3]);
int exact_orient2d_rational(const double a[3], const double b[3], const double c[3], int drop);

#endif
