#include "sim/scene/units.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <udunits2.h>

#include "sim/base/error.h"
#include "sim/base/text.h"
#include "sim/base/vec.h"

#define UNIT_LONGEST 63 /* [byte] of a unit's text; the parser of UDUNITS recurses */

/* what quantities are called in messages; the unit of a key must be one of these */
static const struct {
    const char *unit, *name;
} dimensions[] = {
    {"", "a plain number"},
    {"m", "a length"},
    {"s", "a time"},
    {"kg", "a mass"},
    {"angle", "an angle"},
    {"angle/s", "a turning speed"},
    {"1/s", "a rate"},
    {"1/m", "a curvature"},
    {"m2", "an area"},
    {"m/s", "a speed"},
    {"m/s2", "an acceleration"},
    {"N", "a force"},
    {"N/m", "a force per width"},
    {"N/m/angle", "a force per width and angle"},
    {"N m", "a bending rigidity"},
    {"N m2", "the rigidity of a whole strip, not per width"},
    {"Pa", "a pressure"},
    {"kg/m2", "a weight per area"},
    {"kg/m3", "a density"},
    {"kg/m", "a mass per length"},
    {"kg/(m2 s)", "a drag"},
    {"frame", "a number of frames"},
    {"K", "a temperature"},
};
#define DIMENSION_COUNT (sizeof dimensions / sizeof dimensions[0])

/* for did-you-mean only */
static const char *const common_units[] = {
    "m",    "cm",    "mm",    "um",   "km",    "in",     "ft",    "yd",     "s",     "ms",    "min",
    "h",    "deg",   "rad",   "turn", "turns", "degree", "frame", "frames", "kg",    "g",     "mg",
    "oz",   "lb",    "N",     "mN",   "uN",    "gf",     "lbf",   "Pa",     "kPa",   "MPa",   "Hz",
    "g/m2", "kg/m2", "kg/m3", "m/s",  "cm/s",  "m/s2",   "N/m",   "N m",    "deg/s", "rad/s", NULL};

static ut_system *the_system; /* read at the first use */
static ut_unit *dimension_units[DIMENSION_COUNT];

/* `name` shall mean `unit` from now on, whatever it meant before */
static void rename_unit(ut_system *system, const char *name, ut_unit *unit) {
    ut_unmap_name_to_unit(system, name, UT_UTF8);
    ut_unmap_symbol_to_unit(system, name, UT_UTF8);
    ASSERT(ut_map_name_to_unit(name, UT_UTF8, unit) == UT_SUCCESS);
}

static void rename_parsed(ut_system *system, const char *name, const char *definition) {
    ut_unit *unit = ut_parse(system, definition, UT_UTF8);
    ASSERT(unit);
    rename_unit(system, name, unit);
    ut_free(unit);
}

/* angles get a base unit of their own, so that dimensions tell them from plain numbers */
static void add_angles(ut_system *system) {
    static const struct {
        const char *name;
        double radians;
    } angles[] = {
        {"angle", 1.0},
        {"rad", 1.0},
        {"radian", 1.0},
        {"radians", 1.0},
        {"deg", PI / 180.0},
        {"degree", PI / 180.0},
        {"degrees", PI / 180.0},
        {"\u00B0", PI / 180.0},
        {"turn", 2.0 * PI},
        {"turns", 2.0 * PI},
        {"rev", 2.0 * PI},
        {"revolution", 2.0 * PI},
        {"revolutions", 2.0 * PI},
        {"cycle", 2.0 * PI},
        {"circle", 2.0 * PI},
        {"arcmin", PI / 10800.0},
    };
    ut_unit *radian = ut_new_base_unit(system);
    for (size_t i = 0; i < sizeof angles / sizeof angles[0]; i++) {
        ut_unit *unit = ut_scale(angles[i].radians, radian);
        rename_unit(system, angles[i].name, unit);
        ut_free(unit);
    }
    ut_free(radian);
    rename_parsed(system, "rpm", "turn/min");
}

/* NULL when the unit table of UDUNITS is not installed */
static ut_system *system_get(void) {
    if (the_system) {
        return the_system;
    }
    ut_set_error_message_handler(ut_ignore);
    ut_system *system = ut_read_xml(NULL);
    if (!system) {
        return NULL;
    }
    add_angles(system);
    rename_parsed(system, "oz", "avoirdupois_ounce");
    rename_parsed(system, "yd", "yard");
    rename_parsed(system, "fps", "1/s");
    ut_unit *frame = ut_new_base_unit(system);
    rename_unit(system, "frame", frame);
    rename_unit(system, "frames", frame);
    ut_free(frame);
    for (size_t i = 0; i < DIMENSION_COUNT; i++) {
        dimension_units[i] = ut_parse(system, dimensions[i].unit, UT_UTF8);
        ASSERT(dimension_units[i]);
    }
    return the_system = system;
}

static int dimension_find(const char *unit, size_t bytes) {
    for (size_t i = 0; i < DIMENSION_COUNT; i++) {
        if (strlen(dimensions[i].unit) == bytes && memcmp(dimensions[i].unit, unit, bytes) == 0) {
            return (int)i;
        }
    }
    return -1;
}

const char *units_wanted(const char *unit, char text[UNITS_WANTED_SIZE]) {
    ASSERT(unit);
    int i = dimension_find(unit, strcspn(unit, "|"));
    ASSERT(i >= 0);
    size_t used = (size_t)snprintf(text, UNITS_WANTED_SIZE, "%s", dimensions[i].name);
    if (!unit[0]) {
        return text;
    }
    used += (size_t)snprintf(text + used, UNITS_WANTED_SIZE - used, " [");
    for (const char *p = unit; *p && *p != '|';) {
        bool angle = strncmp(p, "angle", 5) == 0;
        used += (size_t)snprintf(text + used, UNITS_WANTED_SIZE - used, "%.*s", angle ? 3 : 1,
                                 angle ? "rad" : p);
        p += angle ? 5 : 1;
    }
    snprintf(text + used, UNITS_WANTED_SIZE - used, "]");
    return text;
}

size_t units_read_number(const char *text, double *value) {
    static locale_t c_locale;
    size_t i = text[0] == '-' || text[0] == '+', digits = 0;
    for (; text[i] >= '0' && text[i] <= '9'; i++) {
        digits++;
    }
    if (text[i] == '.') {
        for (i++; text[i] >= '0' && text[i] <= '9'; i++) {
            digits++;
        }
    }
    if (digits == 0) {
        return 0;
    }
    if (text[i] == 'e' || text[i] == 'E') {
        size_t j = i + 1;
        j += text[j] == '-' || text[j] == '+';
        if (text[j] >= '0' && text[j] <= '9') {
            i = j + strspn(text + j, "0123456789");
        }
    }
    if (!c_locale) {
        c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    }
    *value = strtod_l(text, NULL, c_locale);
    return i;
}

/* number [ "/" number ]; *rest: what follows, without leading blanks */
static bool read_ratio(const char *text, double *value, const char **rest) {
    text += strspn(text, " \t\n");
    size_t bytes = units_read_number(text, value);
    const char *p = text + bytes, *q = p + strspn(p, " ");
    if (bytes > 0 && *q == '/') {
        double divisor;
        q += 1 + strspn(q + 1, " ");
        size_t more = units_read_number(q, &divisor);
        if (more > 0) {
            *value /= divisor;
            p = q + more;
        }
    }
    *rest = p + strspn(p, " \t\n");
    return bytes > 0;
}

/* letters, digits, and . * / ^ ( ) + - % blank, UTF-8; no dates and offsets */
static bool is_plain_unit(const char *unit) {
    if (strlen(unit) > UNIT_LONGEST) {
        return false;
    }
    int digits = 0;
    for (const char *p = unit; *p; p++) {
        bool digit = *p >= '0' && *p <= '9';
        bool letter = (*p >= 'a' && *p <= 'z') || (*p >= 'A' && *p <= 'Z') || (*p & 0x80);
        if (!digit && !letter && !strchr(".*/^()+-% ", *p)) {
            return false;
        }
        digits = digit ? digits + 1 : 0;
        if (digits > 3) {
            return false; /* m99999: the exponent would overflow */
        }
    }
    return true;
}

/* the unit of a text, NULL when UDUNITS knows none or it has an offset, as degC */
static ut_unit *parse_unit(const char *text) {
    char padded[UNIT_LONGEST + 2];
    if (!is_plain_unit(text)) {
        return NULL;
    }
    snprintf(padded, sizeof padded, "%s%s", text[0] == '/' ? "1" : "", text);
    ut_trim(padded, UT_UTF8);
    return ut_parse(the_system, padded, UT_UTF8);
}

/* how many `to` one `from` is; 0 when the dimension differs or zero is not zero */
static double conversion(ut_unit *from, ut_unit *to) {
    if (!ut_are_convertible(from, to)) {
        return 0.0;
    }
    cv_converter *converter = ut_get_converter(from, to);
    if (!converter) {
        return 0.0;
    }
    double zero = cv_convert_double(converter, 0.0), one = cv_convert_double(converter, 1.0);
    cv_free(converter);
    return zero == 0.0 && isfinite(one) ? one : 0.0;
}

static const char *describe_unit(ut_unit *unit) {
    for (size_t i = 0; i < DIMENSION_COUNT; i++) {
        if (conversion(unit, dimension_units[i]) != 0.0) {
            return dimensions[i].name;
        }
    }
    return "another quantity";
}

static bool fail_unit(const char *unit_text, ut_unit *unit, const char *wanted,
                      UnitsProblem *problem) {
    char want[UNITS_WANTED_SIZE];
    units_wanted(wanted, want);
    if (unit) {
        snprintf(problem->text, sizeof problem->text, "wants %s, but '%s' is %s", want, unit_text,
                 describe_unit(unit));
        return false;
    }
    const char *nearest = text_nearest(unit_text, common_units);
    snprintf(problem->text, sizeof problem->text, "wants %s; '%.40s' is not a unit%s%s%s", want,
             unit_text, nearest ? "; did you mean '" : "", nearest ? nearest : "",
             nearest ? "'?" : "");
    return false;
}

/* factor from the text of a unit to one of the wanted units */
static bool find_factor(const char *unit_text, const char *wanted, double frame_seconds,
                        double *factor, UnitsProblem *problem) {
    ut_unit *unit = parse_unit(unit_text);
    *factor = 0.0;
    for (const char *p = wanted; unit && p && *factor == 0.0;) {
        size_t bytes = strcspn(p, "|");
        int i = dimension_find(p, bytes);
        ASSERT(i >= 0);
        *factor = conversion(unit, dimension_units[i]);
        if (*factor == 0.0 && strcmp(dimensions[i].unit, "s") == 0) {
            int frame = dimension_find("frame", 5);
            *factor = frame_seconds * conversion(unit, dimension_units[frame]);
        }
        p = p[bytes] ? p + bytes + 1 : NULL;
    }
    bool ok = *factor != 0.0 || fail_unit(unit_text, unit, wanted, problem);
    ut_free(unit);
    return ok;
}

bool units_read(const char *text, const char *unit, double frame_seconds, double *value,
                UnitsProblem *problem) {
    const char *rest;
    double number, factor = 1.0;
    if (!read_ratio(text, &number, &rest)) {
        char want[UNITS_WANTED_SIZE];
        snprintf(problem->text, sizeof problem->text, "wants %s, found '%.60s'",
                 units_wanted(unit, want), text);
        return false;
    }
    if (!system_get()) {
        snprintf(problem->text, sizeof problem->text,
                 "cannot be read: the unit table of UDUNITS-2 is not installed");
        return false;
    }
    if (*rest) {
        if (!find_factor(rest, unit, frame_seconds, &factor, problem)) {
            return false;
        }
    } else if (strncmp(unit, "angle", 5) == 0) {
        snprintf(problem->text, sizeof problem->text,
                 "needs a unit: '%.40s' could be degrees or radians; write '%.40s deg%s'", text,
                 text, strcmp(unit, "angle/s") == 0 ? "/s" : "");
        return false;
    }
    if (!isfinite(number * factor)) {
        snprintf(problem->text, sizeof problem->text, "is not a finite number: '%.60s'", text);
        return false;
    }
    *value = number * factor;
    return true;
}
