#include "sim/model/spring_law.h"

#include <math.h>
#include <stddef.h>

static double polynomial(const double *c, int count, double x) {
    double sum = 0.0;
    while (count-- > 0) {
        sum = sum * x + c[count];
    }
    return sum;
}

/* ---- elastica: fit to the exact curve, 0.06 % on d = 0 .. 1 ---- */

#define PI2 9.8696044010893586

static double elastica_energy(double d) {
    static const double c[7] = {0, 1, 0.5 / 2, 0.24554 / 3, 0.40613 / 4, -0.4311 / 5, 0.4613 / 6};
    return PI2 * polynomial(c, 7, d);
}

static double elastica_force(double d) {
    static const double c[6] = {1, 0.5, 0.24554, 0.40613, -0.4311, 0.4613};
    return PI2 * polynomial(c, 6, d);
}

static double elastica_slope(double d) {
    static const double c[5] = {0.5, 2 * 0.24554, 3 * 0.40613, -4 * 0.4311, 5 * 0.4613};
    return PI2 * polynomial(c, 5, d);
}

/* ---- arc: half angle a with sin a / a = r; energy 2 a^2 k/L ---- */

#define SMALL_ANGLE 0.02 /* below it differences of sin and cos lose digits: series */

static double arc_angle(double d) {
    double a2 = d * (6.0 + 1.8 * d); /* series of sin a / a = 1 - d, to d^2 */
    double a = sqrt(a2);
    for (int k = 0; k < 6 && a > SMALL_ANGLE; k++) {
        double excess = sin(a) / a - (1.0 - d), down = (sin(a) / a - cos(a)) / a;
        a += excess / down;
    }
    return a;
}

static double arc_energy(double d) {
    double a = arc_angle(d);
    return 2.0 * a * a;
}

static double arc_force(double d) {
    double a = arc_angle(d);
    return a < SMALL_ANGLE ? 12.0 + a * a * (1.2 + 0.077143 * a * a)
                           : 4.0 * a * a / (sin(a) / a - cos(a));
}

static double arc_slope(double d) {
    double a = arc_angle(d), g = sin(a) / a - cos(a);
    return a < SMALL_ANGLE ? 7.2 + 9.8743 * d : (12.0 - 4.0 * a * sin(a) / g) * (a / g) * (a / g);
}

/* ---- quartic in r ---- */

static const double quartic[5] = {9.713, -23.116, 39.083, -34.193, 11.541};

static double quartic_integral(double r) {
    double c[6] = {0};
    for (int k = 0; k < 5; k++) {
        c[k + 1] = quartic[k] / (k + 1);
    }
    return 4.0 * polynomial(c, 6, r);
}

static double quartic_energy(double d) { return quartic_integral(1.0) - quartic_integral(1.0 - d); }
static double quartic_force(double d) { return 4.0 * polynomial(quartic, 5, 1.0 - d); }

static double quartic_slope(double d) {
    double c[4];
    for (int k = 0; k < 4; k++) {
        c[k] = (k + 1) * quartic[k + 1];
    }
    return -4.0 * polynomial(c, 4, 1.0 - d);
}

/* ---- chord: r = cos(psi/2), energy 4 (psi/2)^2 k/L ---- */

#define SMALL_CHORD 1e-6

/* half = acos(1 - d) without loss of digits */
static double chord_half(double d) { return 2.0 * asin(sqrt(0.5 * d)); }

static double chord_energy(double d) {
    double half = chord_half(d);
    return 4.0 * half * half;
}

static double chord_force(double d) {
    double half = chord_half(d);
    return d < SMALL_CHORD ? 8.0 * (1.0 + d / 3.0) : 8.0 * half / sin(half);
}

/* d(half / sin)/dd = (sin - half cos) / sin^3; the force at r = 0 is finite */
static double chord_slope(double d) {
    double half = chord_half(d), s = sin(half);
    return half < SMALL_ANGLE ? 8.0 * (1.0 / 3.0 + 4.0 / 15.0 * d)
                              : 8.0 * (s - half * cos(half)) / (s * s * s);
}

const BuckleLaw buckle_elastica = {"elastica", "pinned strip, exact to 0.06 %", elastica_energy,
                                   elastica_force, elastica_slope};
const BuckleLaw buckle_arc = {"arc", "circular arc (Choi, Ko 2002)", arc_energy, arc_force,
                              arc_slope};
const BuckleLaw buckle_quartic = {"quartic", "published fit of the arc", quartic_energy,
                                  quartic_force, quartic_slope};
const BuckleLaw buckle_chord = {"chord", "two links with a linear hinge", chord_energy, chord_force,
                                chord_slope};

/* smallest d with stiffness L d = f(d) k/L2 */
static double find_onset(const SpringKind *kind) {
    double line = kind->stiffness * pow(kind->rest, 3.0) / kind->rigidity;
    double low = 0.0, high = 1.0;
    if (line <= kind->law->force(1.0)) {
        return INFINITY;
    }
    for (int k = 0; k < 60; k++) {
        double middle = 0.5 * (low + high);
        *(line * middle < kind->law->force(middle) ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

SpringKind spring_kind(double rest, double stiffness, const BuckleLaw *law, double rigidity) {
    SpringKind kind = {.rest = rest,
                       .stiffness = stiffness,
                       .law = law,
                       .rigidity = rigidity,
                       .onset = INFINITY,
                       .limit = INFINITY};
    if (law) {
        kind.onset = find_onset(&kind);
    }
    return kind;
}

/* [m] beyond the limit; d = 1 - l/L */
static double beyond_limit(const SpringKind *kind, double d) {
    return -d > kind->limit ? (-d - kind->limit) * kind->rest : 0.0;
}

double spring_energy(const SpringKind *kind, double length) {
    double stretch = length - kind->rest, d = -stretch / kind->rest;
    if (stretch > 0.0 && kind->pushes) {
        return 0.0;
    }
    if (stretch > 0.0 && kind->fifth > 0.0) {
        return kind->fifth * pow(-d, 5.0);
    }
    double line = fmin(d, kind->onset) * kind->rest;
    double energy = 0.5 * kind->stiffness * line * line;
    if (d > kind->onset) {
        energy +=
            kind->rigidity / kind->rest * (kind->law->energy(d) - kind->law->energy(kind->onset));
    }
    return energy + 0.5 * kind->stiffen * beyond_limit(kind, d) * beyond_limit(kind, d);
}

double spring_tension(const SpringKind *kind, double length, double *slope) {
    double stretch = length - kind->rest, d = -stretch / kind->rest, unused;
    slope = slope ? slope : &unused;
    if (stretch > 0.0 && kind->pushes) {
        return *slope = 0.0;
    }
    if (stretch > 0.0 && kind->fifth > 0.0) {
        *slope = 20.0 * kind->fifth / (kind->rest * kind->rest) * pow(-d, 3.0);
        return 5.0 * kind->fifth / kind->rest * pow(-d, 4.0);
    }
    if (!(d > kind->onset)) { /* also what is no number: there may be no law */
        *slope = kind->stiffness + (-d > kind->limit ? kind->stiffen : 0.0);
        return kind->stiffness * stretch + kind->stiffen * beyond_limit(kind, d);
    }
    double scale = kind->rigidity / (kind->rest * kind->rest);
    *slope = scale / kind->rest * kind->law->slope(d);
    return -scale * kind->law->force(d);
}
