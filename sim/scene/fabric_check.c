#include <math.h>
#include <stdio.h>

#include "sim/scene/fabric_schema.h"

/* Values outside warn are unusual, outside fail impossible; both in `unit` = SI * scale. */
typedef struct Plausible {
    const char *what, *unit;
    double scale;
    double warn_low, warn_high, fail_low, fail_high;
    const char *too_low, *too_high; /* "is lighter than any woven fabric" */
} Plausible;

/* A mistake that would explain a wrong value: true value = found * factor. */
typedef struct Hint {
    double factor;
    const char *format; /* with %g for the corrected value, or without */
} Hint;

#define WIDENING 0.0785398163 /* [rad] 4.5 degrees, from 2HG to 2HG5 */

static const Plausible weight_range = {"weight",
                                       "g/m2",
                                       1e3,
                                       15,
                                       900,
                                       2,
                                       5000,
                                       "is lighter than any woven fabric",
                                       "is heavier than any woven fabric"};
static const Plausible bulk_range = {"weight/thickness",
                                     "kg/m3",
                                     1.0,
                                     150,
                                     900,
                                     20,
                                     3000,
                                     "is fluffier than any fabric; is 'thickness' in mm?",
                                     "is denser than glass; is 'weight' per volume? toile wants "
                                     "g/m2"};
static const Plausible length_range = {
    "bending length",           "mm", 1e3, 9, 32, 1, 300, "is limper than any woven fabric",
    "is stiffer than cardboard"};
static const Plausible ratio_range = {
    "bending warp/weft", "", 1.0, 0.35, 5, 0.02, 50, "is far from 1", "is far from 1"};
static const Plausible bias_range = {
    "bending bias/mean", "", 1.0, 0.4, 2, 0, 1e9, "is low", "is high"};
static const Plausible hysteresis_range = {"hysteresis 2HB/B",
                                           "1/m",
                                           1.0,
                                           15,
                                           130,
                                           0,
                                           500,
                                           "is low; is 2HB in gf*cm/cm and B in gf*cm2/cm?",
                                           "is high; is 2HB in gf*cm/cm and B in gf*cm2/cm?"};
static const Plausible shear_range = {"shear",        "N/m",          1.0, 5, 900, 0.1, 1e5,
                                      "is very soft", "is very stiff"};
static const Plausible stretch_range = {"stretch",      "N/m",          1.0, 20, 20000, 0.1, 1e7,
                                        "is very soft", "is very stiff"};
static const Plausible limit_range = {"stretch limit", "%",           1e2, 2, 60, 0.1, 300,
                                      "is very low",   "is very high"};
static const Plausible friction_range = {"friction",     "", 1.0, 0.05, 1, 0, 5, "is very slippery",
                                         "is very rough"};

static bool inside(double value, double low, double high) { return value >= low && value <= high; }

static bool check_value(Reader *reader, const Plausible *range, double si, Place place,
                        const Hint *hint) {
    double value = si * range->scale;
    if (inside(value, range->warn_low, range->warn_high)) {
        return true;
    }
    char clue[160] = "";
    if (hint && inside(value * hint->factor, range->warn_low, range->warn_high)) {
        snprintf(clue, sizeof clue, hint->format, value * hint->factor);
    }
    const char *blank = range->unit[0] && range->unit[0] != '%' ? " " : "";
    char text[400];
    snprintf(text, sizeof text, "%s %.4g%s%s %s (fabrics: %g .. %g%s%s)%s", range->what, value,
             blank, range->unit, value < range->warn_low ? range->too_low : range->too_high,
             range->warn_low, range->warn_high, blank, range->unit, clue);
    if (inside(value, range->fail_low, range->fail_high)) {
        report_warning(reader->report, place, "%s", text);
        return true;
    }
    return report_error(reader->report, place, EXIT_BAD_INPUT, "%s", text);
}

/* Was it written, or filled in? */
static bool is_given(const FabricNumber *number) { return number->mark != NULL; }

static Place place_of(const FabricNumber *number, Place fallback) {
    return number->mark ? number->mark->place : fallback;
}

static bool check_number(Reader *reader, const Plausible *range, const FabricNumber *number,
                         double value, Place place, const Hint *hint) {
    return !is_given(number) || check_value(reader, range, value, place_of(number, place), hint);
}

static bool check_weight(Reader *reader, const Fabric *fabric, Place place) {
    double weight = fabric->weight.value;
    Hint light = {1e3, "; did you mean %g g/m2?"}, heavy = {1e-3, "; did you mean %g g/m2?"};
    bool ok = check_number(reader, &weight_range, &fabric->weight, weight, place,
                           weight < 0.015 ? &light : &heavy);
    /* a weight that is wrong by itself would only repeat the complaint */
    bool both = is_given(&fabric->thickness) && inside(weight, 0.015, 0.9);
    return (!both || check_value(reader, &bulk_range, weight / fabric->thickness.value,
                                 place_of(&fabric->thickness, place), NULL)) &&
           ok;
}

/* a KES number that lost its unit */
static bool check_length(Reader *reader, const Fabric *fabric, const FabricNumber *rigidity,
                         Place place) {
    Hint no_unit = {cbrt(9.80665e-5), "; the rigidity may be in gf*cm2/cm without its unit"};
    double length = fabric_bending_length(fabric, rigidity->value);
    return check_number(reader, &length_range, rigidity, length, place, &no_unit);
}

static bool check_bending(Reader *reader, const Fabric *fabric, Place place) {
    const FabricNumber *warp = &fabric->bend_warp, *weft = &fabric->bend_weft;
    double mean = 0.5 * (warp->value + weft->value);
    bool ok = check_length(reader, fabric, warp, place);
    if (weft->value != warp->value) {
        ok = check_length(reader, fabric, weft, place) && ok;
        ok = check_number(reader, &ratio_range, weft, warp->value / weft->value, place, NULL) && ok;
    }
    const FabricNumber *bias = &fabric->bend_bias, *hysteresis = &fabric->bend_hysteresis;
    if (is_given(bias) && !(fabric_material(fabric).d66 > 0.0)) {
        ok = report_error(reader->report, place_of(bias, place), EXIT_BAD_INPUT,
                          "bias %.3g of the mean: no positive twisting stiffness fits",
                          bias->value / mean);
    }
    ok = check_number(reader, &bias_range, bias, bias->value / mean, place, NULL) && ok;
    bool plain = hysteresis->value > 0.0 && ok;
    return (!plain || check_number(reader, &hysteresis_range, hysteresis, hysteresis->value / mean,
                                   place, NULL)) &&
           ok;
}

static bool check_stretch(Reader *reader, const Fabric *fabric, Place place) {
    const FabricNumber *warp = &fabric->stretch_warp, *weft = &fabric->stretch_weft;
    Hint modulus = {fabric->thickness.value,
                    "; it looks like a Young's modulus: multiply by the thickness"};
    bool ok = check_number(reader, &stretch_range, warp, warp->value, place, &modulus);
    if (weft->value != warp->value) {
        ok = check_number(reader, &stretch_range, weft, weft->value, place, &modulus) && ok;
    }
    Hint per_degree = {57.29578, "; given per degree? write gf/cm/deg or N/m/deg"};
    const FabricNumber *shear = &fabric->shear, *limit = &fabric->stretch_limit;
    ok = check_number(reader, &shear_range, shear, shear->value, place, &per_degree) && ok;
    if (is_given(shear) && shear->value > fmax(warp->value, weft->value)) {
        report_warning(reader->report, place_of(shear, place),
                       "shear stiffer than the yarns: is this a coated fabric?");
    }
    if (isfinite(limit->value)) {
        ok = check_number(reader, &limit_range, limit, limit->value, place, NULL) && ok;
    }
    return ok;
}

/* positive definite: nu12 nu21 < 1 */
static bool check_poisson(Reader *reader, const Fabric *fabric, Place place) {
    double ratio = fabric->stretch_warp.value / fabric->stretch_weft.value;
    double poisson = fabric->stretch_poisson.value;
    return poisson * poisson < ratio ||
           report_error(reader->report, place_of(&fabric->stretch_poisson, place), EXIT_BAD_INPUT,
                        "poisson %.3g with stretch warp/weft = %.3g is not positive definite: it "
                        "must be under %.2f",
                        poisson, ratio, sqrt(ratio));
}

/* a branch of the loop must not fall while the shear grows: G > (2HG5 - 2HG)/(2 * 4.5 degrees) */
static bool check_widening(Reader *reader, const Fabric *fabric, Place place) {
    const FabricNumber *wide = &fabric->shear_hysteresis5;
    double most = fabric->shear_hysteresis.value + WIDENING * 2.0 * fabric->shear.value;
    return wide->value < most ||
           report_error(
               reader->report, place_of(wide, place), EXIT_BAD_INPUT,
               "hysteresis_5 %.3g N/m: with this stiffness and hysteresis it must be under "
               "%.3g N/m, or the force would fall as the shear grows",
               wide->value, most);
}

bool fabric_check(Reader *reader, const Fabric *fabric, Place place) {
    bool ok = check_poisson(reader, fabric, place);
    ok = check_weight(reader, fabric, place) && ok;
    if (fabric->isotropic) {
        return ok; /* a test material may be as stiff as it likes */
    }
    ok = check_bending(reader, fabric, place) && ok;
    ok = check_stretch(reader, fabric, place) && ok;
    ok = check_widening(reader, fabric, place) && ok;
    return check_number(reader, &friction_range, &fabric->friction, fabric->friction.value, place,
                        NULL) &&
           ok;
}
