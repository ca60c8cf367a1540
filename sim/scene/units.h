/* units.h: a number with a unit, as text, into SI.
 *
 *   quantity  = number [ "/" number ] [ unit ]      30 cm, 1/60 s, -72 deg/s, 4 turns, 1e-3
 *
 * The unit is anything that UDUNITS-2 understands (gf*cm2/cm, kg/(m2 s), uN m, lbf/in, %), plus
 * deg, oz (a mass here, not a volume), fps and `frame` (the time of one film frame). Angles are
 * a dimension of their own here: radians are never a plain number. A bare number is SI, but for
 * an angle, where it is refused: degrees taken for radians cost days.
 * Thread-safety: unsafe; the unit table is read once and kept.
 */
#ifndef TOILE_SCENE_UNITS_H
#define TOILE_SCENE_UNITS_H

#include <stdbool.h>
#include <stddef.h>

#define UNITS_PROBLEM_SIZE 256
#define UNITS_WANTED_SIZE 80

/* What went wrong: a phrase that follows "'key' ", such as "wants a length [m], found a time". */
typedef struct UnitsProblem {
    char text[UNITS_PROBLEM_SIZE];
} UnitsProblem;

/* Reads `text` as a quantity of dimension `unit`: an SI unit, or several with '|' between them of
 * which the first is meant by a bare number; "" = a plain number. `frame_seconds`: what the unit
 * `frame` stands for. False with a problem; *value is then unchanged. */
bool units_read(const char *text, const char *unit, double frame_seconds, double *value,
                UnitsProblem *problem);

/* A plain finite decimal number with optional exponent at the start of `text`, in the C locale.
 * Returns the bytes read, 0 when there is none; *value may be infinite for 1e999. */
size_t units_read_number(const char *text, double *value);

/* Writes "a length [m]" for "m", "a plain number" for ""; returns `text`. */
const char *units_wanted(const char *unit, char text[UNITS_WANTED_SIZE]);

#endif
