/* Quantities: what the unit table says, and what is refused. */
#include <string.h>

#include "sim/base/vec.h"
#include "sim/scene/units.h"
#include "tests/support/check.h"

#define FRAME (1.0 / 24.0) /* [s] */

static const struct {
    const char *text, *unit;
    double si;
} good[] = {
    {"30 cm", "m", 0.3},
    {"30cm", "m", 0.3},
    {"0.3", "m", 0.3},
    {"-.5e1 mm", "m", -0.005},
    {"+2 in", "m", 0.0508},
    {"1 yd", "m", 0.9144},
    {"1 ft", "m", 0.3048},
    {"1 \xC2\xB5m", "m", 1e-6},
    {"250 um", "m", 250e-6},
    {"1/60 s", "s", 1.0 / 60.0},
    {"1 / 60 s", "s", 1.0 / 60.0},
    {"1/60", "s", 1.0 / 60.0},
    {"20 ms", "s", 0.02},
    {"2 min", "s", 120.0},
    {"12 frames", "s", 0.5},
    {"0.5 frame", "s", 0.5 * FRAME},
    {"30", "1/s", 30.0},
    {"30 1/s", "1/s", 30.0},
    {"30 /s", "1/s", 30.0},
    {"30 Hz", "1/s", 30.0},
    {"24 fps", "1/s", 24.0},
    {"90 deg", "angle", PI / 2.0},
    {"90 degrees", "angle", PI / 2.0},
    {"90\xC2\xB0", "angle", PI / 2.0},
    {"1.5 rad", "angle", 1.5},
    {"250 mrad", "angle", 0.25},
    {"4 turns", "angle", 8.0 * PI},
    {"1/4 turn", "angle", PI / 2.0},
    {"-72 deg/s", "angle/s", -0.4 * PI},
    {"60 rpm", "angle/s", 2.0 * PI},
    {"1 %", "", 0.01},
    {"0.3", "", 0.3},
    {"162.9 g/m2", "kg/m2", 0.1629},
    {"16.29 mg/cm2", "kg/m2", 0.1629},
    {"1 oz/yd2", "kg/m2", 3.3905747e-2},
    {"0.067 gf*cm2/cm", "N m", 0.067 * 9.80665e-5},
    {"0.067 gf cm2/cm", "N m", 0.067 * 9.80665e-5},
    {"6.57 uN m", "N m", 6.57e-6},
    {"6.57 \xC2\xB5N.m", "N m", 6.57e-6},
    {"6.57 uN*m", "N m", 6.57e-6},
    {"0.033 gf*cm/cm", "N", 0.033 * 9.80665e-3},
    {"1 gf/cm", "N/m|N/m/angle", 0.980665},
    {"1 gf/cm/deg", "N/m|N/m/angle", 56.18796},
    {"1 gf/cm/degree", "N/m|N/m/angle", 56.18796},
    {"2 N/m/rad", "N/m|N/m/angle", 2.0},
    {"1 lbf/in", "N/m", 175.12684},
    {"9.81 m/s2", "m/s2", 9.81},
    {"9.81 m s-2", "m/s2", 9.81},
    {"9.81 m/s^2", "m/s2", 9.81},
    {"0.02 kg/(m2 s)", "kg/(m2 s)", 0.02},
    {"0.02 kg m-2 s-1", "kg/(m2 s)", 0.02},
    {"15 1/m", "1/m", 15.0},
    {"1 1/cm", "1/m", 100.0},
};

static void test_good(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        double value = NAN;
        UnitsProblem problem;
        if (!units_read(good[i].text, good[i].unit, FRAME, &value, &problem)) {
            fail_msg("%s: %s", good[i].text, problem.text);
        }
        if (!(fabs(value - good[i].si) <= 1e-7 * fabs(good[i].si))) {
            fail_msg("%s is %.9g, not %.9g", good[i].text, value, good[i].si);
        }
    }
}

static const struct {
    const char *text, *unit, *problem;
} bad[] = {
    {"", "m", "wants a length [m], found ''"},
    {"abc", "m", "wants a length [m], found 'abc'"},
    {"nan", "m", "wants a length [m], found 'nan'"},
    {"inf m", "m", "wants a length [m], found 'inf m'"},
    {"1e999 m", "m", "is not a finite number"},
    {"1/0", "s", "is not a finite number"},
    {"0/0", "s", "is not a finite number"},
    {"3 s", "m", "wants a length [m], but 's' is a time"},
    {"3 1/s", "s", "wants a time [s], but '1/s' is a rate"},
    {"3 s", "1/s", "wants a rate [1/s], but 's' is a time"},
    {"3 fl_oz", "kg", "'fl_oz' is not a unit"},
    {"3 cmm", "m", "'cmm' is not a unit; did you mean 'cm'?"},
    {"90", "angle", "needs a unit: '90' could be degrees or radians; write '90 deg'"},
    {"90", "angle/s", "write '90 deg/s'"},
    {"90 %", "angle", "wants an angle [rad], but '%' is a plain number"},
    {"0.3 rad", "", "wants a plain number, but 'rad' is an angle"},
    {"3 rad/s", "1/s", "wants a rate [1/s], but 'rad/s' is a turning speed"},
    {"3 kg/m3", "kg/m2", "wants a weight per area [kg/m2], but 'kg/m3' is a density"},
    {"3 degC", "m", "is another quantity"},
    {"3 frames", "m", "but 'frames' is a number of frames"},
    {"3 m2", "m", "but 'm2' is an area"},
    {"3 m99999", "m", "is not a unit"},
    {"3 lg(re 1 m)", "m", "is another quantity"},
    {"3 m @ 5", "m", "is not a unit"},
    {"3 m since 2000", "m", "is not a unit"},
    {"3 (m", "m", "is not a unit"},
    {"3 \xC3\xA4", "m", "is not a unit"},
    {"3 4", "m", "'4' is a plain number"},
    {"3,5 m", "m", "is not a unit"},
    {"0x10 m", "m", "is not a unit"},
};

static void test_bad(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        double value = 77.0;
        UnitsProblem problem = {""};
        bool ok = units_read(bad[i].text, bad[i].unit, FRAME, &value, &problem);
        if (ok || value != 77.0 || !strstr(problem.text, bad[i].problem)) {
            fail_msg("%s: wanted '%s', got '%s'", bad[i].text, bad[i].problem, problem.text);
        }
    }
}

static void test_numbers(void **state) {
    (void)state;
    static const struct {
        const char *text;
        size_t bytes;
    } numbers[] = {{"1", 1},     {"1.", 2}, {".5", 2}, {"-1.5e-3x", 7}, {"1e", 1},
                   {"1e+", 1},   {".", 0},  {"-", 0},  {"e5", 0},       {"+.e1", 0},
                   {"1.2.3", 3}, {"", 0},   {"--1", 0}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        double value = 0.0;
        assert_int_equal(units_read_number(numbers[i].text, &value), numbers[i].bytes);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_good),
        cmocka_unit_test(test_bad),
        cmocka_unit_test(test_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
