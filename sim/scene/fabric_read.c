#include <math.h>
#include <stddef.h>
#include <string.h>

#include "sim/scene/fabric_schema.h"
#include "sim/scene/units.h"

const char *const fabric_flag_names[] = {"stated",   "measured", "derived", "estimated",
                                         "recalled", "fallback", NULL};

/* a number with its provenance: {value: 41 N/m, flag: estimated, from: analogy} */
typedef struct MeasuredKeys {
    const Yaml *value, *low, *high;
    int flag;
    const char *from, *note;
} MeasuredKeys;

static const Field measured_fields[] = {
    {"value", FIELD_RAW, offsetof(MeasuredKeys, value), .required = true, .help = "the number"},
    {"low", FIELD_RAW, offsetof(MeasuredKeys, low), .help = "10 % of real fabrics are below"},
    {"high", FIELD_RAW, offsetof(MeasuredKeys, high), .help = "10 % are above"},
    {"flag", FIELD_WORD, offsetof(MeasuredKeys, flag), .words = fabric_flag_names,
     .help = "how it is known"},
    {"from", FIELD_TEXT, offsetof(MeasuredKeys, from), .help = "where an estimate comes from"},
    {"note", FIELD_TEXT, offsetof(MeasuredKeys, note), .help = "what to know when using it"},
    {0}};
static const Schema measured_schema = {.name = "measured number",
                                       .help = "a number and where it comes from",
                                       .fields = measured_fields,
                                       .size = sizeof(MeasuredKeys)};

static bool read_measured(Reader *reader, const Field *field, const Yaml *value, void *member) {
    MeasuredKeys keys = {.flag = FABRIC_STATED};
    FabricNumber number = {.value = NAN, .low = NAN, .high = NAN};
    if (value->kind == YAML_MAP) {
        if (!schema_read(reader, &measured_schema, value, &keys)) {
            return false;
        }
    } else {
        keys.value = value;
    }
    Field plain = *field;
    plain.type = FIELD_NUMBER;
    bool ok = schema_read_field(reader, &plain, keys.value, &number.value);
    ok = (!keys.low || schema_read_field(reader, &plain, keys.low, &number.low)) && ok;
    ok = (!keys.high || schema_read_field(reader, &plain, keys.high, &number.high)) && ok;
    if (!ok) {
        return false;
    }
    if (number.low > number.value || number.high < number.value) {
        return schema_error(reader, keys.value, "'%s' is not between its low and high", field->key);
    }
    number.flag = (FabricFlag)keys.flag;
    number.written = keys.value->text;
    number.from = keys.from;
    number.note = keys.note;
    number.mark = keys.value;
    *(FabricNumber *)member = number;
    return true;
}

static void print_text_key(FILE *out, const char *key, const char *text) {
    if (text) {
        fprintf(out, ", %s: ", key);
        schema_print_text(out, text);
    }
}

static void print_measured(FILE *out, int indent, const Field *field, const void *member) {
    const FabricNumber *number = member;
    if (isnan(number->value)) {
        return;
    }
    schema_print_key(out, indent, field->key);
    fputs("{value: ", out);
    if (isinf(number->value)) {
        fputs(field->word, out);
    } else {
        schema_print_quantity(out, number->value, field->unit);
    }
    if (!isnan(number->low)) {
        fputs(", low: ", out);
        schema_print_quantity(out, number->low, field->unit);
    }
    if (!isnan(number->high)) {
        fputs(", high: ", out);
        schema_print_quantity(out, number->high, field->unit);
    }
    fprintf(out, ", flag: %s", fabric_flag_names[number->flag]);
    print_text_key(out, "from", number->from);
    print_text_key(out, "note", number->note);
    fputs("}\n", out);
}

/* ---- curves: lists of [at, value] ---- */

static bool is_shear(const Field *field) { return strcmp(field->unit, "angle") == 0; }
static const char *value_unit(const Field *field) { return is_shear(field) ? "N/m" : "N"; }

#define CURVE_MOST_VALUE 1e6 /* [N], [N/m] */
#define CURVE_LEAST 1e-12

/* one point; both numbers rise from those before */
static bool read_point(Reader *reader, const Field *field, const Yaml *row, double point[2],
                       const double *before) {
    if (row->kind != YAML_LIST || row->count != 2) {
        return schema_error(reader, row, "a point of '%s' is a pair [%s], found %s", field->key,
                            is_shear(field) ? "angle, force" : "curvature, moment",
                            yaml_describe(row, reader->report));
    }
    const Yaml *parts[2] = {row->first, row->first->next};
    const char *units[2] = {field->unit, value_unit(field)};
    for (int k = 0; k < 2; k++) {
        if (!schema_read_number(reader, field->key, units[k], CURVE_LEAST,
                                k ? CURVE_MOST_VALUE : field->max, parts[k], &point[k])) {
            return false;
        }
        if (before && point[k] <= before[k]) {
            return schema_error(reader, parts[k], "'%s' must rise from point to point", field->key);
        }
    }
    return true;
}

static bool read_curve(Reader *reader, const Field *field, const Yaml *list, void *member) {
    if (list->kind != YAML_LIST || list->count < 2 || list->count > FABRIC_CURVE_MOST) {
        return schema_error(reader, list, "'%s' wants a list of 2 to %d pairs, found %s",
                            field->key, FABRIC_CURVE_MOST, yaml_describe(list, reader->report));
    }
    double *at = arena_push(reader->arena, double, list->count);
    double *value = arena_push(reader->arena, double, list->count);
    double points[2][2] = {{0.0}};
    const Yaml *row = list->first;
    for (int k = 0; k < list->count; k++, row = row->next) {
        if (!read_point(reader, field, row, points[k % 2], k > 0 ? points[1 - k % 2] : NULL)) {
            return false;
        }
        at[k] = points[k % 2][0], value[k] = points[k % 2][1];
    }
    *(FabricCurve *)member = (FabricCurve){list->count, at, value};
    return true;
}

static void print_curve(FILE *out, int indent, const Field *field, const void *member) {
    const FabricCurve *curve = member;
    for (int k = 0; k < curve->count; k++) {
        if (k == 0) {
            schema_print_key(out, indent, field->key);
        }
        fputs(k ? ", [" : "[[", out);
        schema_print_quantity(out, curve->at[k], field->unit);
        fputs(", ", out);
        schema_print_quantity(out, curve->value[k], value_unit(field));
        fputs(k + 1 < curve->count ? "]" : "]]\n", out);
    }
}

#define CURVE(name, kind, si, most)                                                                \
    .key = name, .type = FIELD_CUSTOM, .offset = offsetof(FabricKeys, fabric.curves[kind]),        \
    .unit = si, .max = most, .read = read_curve, .print = print_curve

#define MEASURED(name, member, si, least, most)                                                    \
    .key = name, .type = FIELD_CUSTOM, .offset = offsetof(FabricKeys, member), .unit = si,         \
    .min = least, .max = most, .read = read_measured, .print = print_measured
#define TEXT(name, member) .key = name, .type = FIELD_TEXT, .offset = offsetof(FabricKeys, member)

static const Field bending_fields[] = {
    {MEASURED("warp", fabric.bend_warp, "N m", 1e-12, 1e3), .help = "rigidity along the warp"},
    {MEASURED("weft", fabric.bend_weft, "N m", 1e-12, 1e3), .help = "rigidity along the weft"},
    {MEASURED("bias", fabric.bend_bias, "N m", 1e-12, 1e3),
     .help = "rigidity of a strip cut at 45 degrees"},
    {MEASURED("twist", bend_twist, "N m", 1e-12, 1e3), .help = "twisting rigidity, or give bias"},
    {MEASURED("poisson", fabric.bend_poisson, "", -0.99, 0.99),
     .help = "coupling of warp and weft bending; 0 for yarns"},
    {MEASURED("hysteresis", fabric.bend_hysteresis, "N", 0.0, 1e3),
     .help = "full width 2HB of the loop at 1/cm"},
    {MEASURED("onset", fabric.bend_onset, "1/m", 1e-3, 1e5),
     .help = "curvature at which yarns slip"},
    {CURVE("curve_warp", FABRIC_CURVE_WARP, "1/m", 1e5),
     .help = "measured [curvature, moment] pairs of first loading, for particles"},
    {CURVE("curve_weft", FABRIC_CURVE_WEFT, "1/m", 1e5), .help = "the same along the weft"},
    {0}};
static const Schema bending_schema = {
    .name = "bending", .fields = bending_fields, .shorthand = 2, .help = "bending rigidity"};

static const Field length_fields[] = {
    {MEASURED("warp", length_warp, "m", 1e-4, 10.0),
     .help = "half the overhang at 41.5 degrees, ASTM D1388"},
    {MEASURED("weft", length_weft, "m", 1e-4, 10.0), .help = "bending length along the weft"},
    {0}};
static const Schema length_schema = {.name = "bending_length",
                                     .fields = length_fields,
                                     .shorthand = 2,
                                     .help = "half the overhang at 41.5 degrees (ASTM D1388)"};

static const Field shear_fields[] = {
    {MEASURED("stiffness", fabric.shear, "N/m|N/m/angle", 1e-6, 1e12),
     .help = "shear stiffness G per radian"},
    {MEASURED("hysteresis", fabric.shear_hysteresis, "N/m", 0.0, 1e6),
     .help = "full width 2HG of the loop at 0.5 degrees"},
    {MEASURED("hysteresis_5", fabric.shear_hysteresis5, "N/m", 0.0, 1e6),
     .help = "full width 2HG5 of the loop at 5 degrees; as at 0.5 when left out"},
    {CURVE("curve", FABRIC_CURVE_SHEAR, "angle", 0.5),
     .help = "measured [angle, force] pairs of first loading, for particles"},
    {0}};
static const Schema shear_schema = {
    .name = "shear", .fields = shear_fields, .shorthand = 1, .help = "in-plane shear"};

static const Field stretch_fields[] = {
    {MEASURED("warp", fabric.stretch_warp, "N/m", 1e-6, 1e15), .help = "stiffness along the warp"},
    {MEASURED("weft", fabric.stretch_weft, "N/m", 1e-6, 1e15), .help = "stiffness along the weft"},
    {MEASURED("poisson", fabric.stretch_poisson, "", -0.99, 10.0),
     .help = "nu12: narrowing along the weft when pulled along the warp"},
    {MEASURED("limit", fabric.stretch_limit, "", 1e-6, 1e3), .word = "none", .word_value = INFINITY,
     .help = "Green strain where the cloth locks"},
    {0}};
static const Schema stretch_schema = {.name = "stretch",
                                      .fields = stretch_fields,
                                      .shorthand = 2,
                                      .help = "Young's modulus times thickness"};

static const Field isotropic_fields[] = {
    {MEASURED("stretch", iso_stretch, "N/m", 1e-6, 1e15), .required = true,
     .help = "Young's modulus times thickness"},
    {MEASURED("poisson", iso_poisson, "", -0.99, 0.5), .required = true, .help = "Poisson's ratio"},
    {MEASURED("bending", iso_bending, "N m", 1e-12, 1e6), .required = true,
     .help = "plate rigidity D"},
    {0}};
static const Schema isotropic_schema = {
    .name = "isotropic", .fields = isotropic_fields, .help = "a test material"};

static const Field source_fields[] = {
    {TEXT("text", fabric.source), .help = "authors, year, journal"},
    {TEXT("doi", fabric.doi), .help = "digital object identifier"},
    {TEXT("read", fabric.read), .help = "how it was read: paper, second hand"},
    {0}};
static const Schema source_schema = {.name = "source",
                                     .fields = source_fields,
                                     .shorthand = 1,
                                     .help = "where the numbers are from"};

/* one row of `drape` */
static const Field drape_fields[] = {
    {"dc", FIELD_NUMBER, offsetof(FabricDrape, coefficient), .unit = "", .min = 0.0, .max = 1.0,
     .required = true, .help = "drape coefficient"},
    {"nodes", FIELD_COUNT, offsetof(FabricDrape, nodes), .min = 0, .max = 100, .help = "folds"},
    {"specimen", FIELD_NUMBER, offsetof(FabricDrape, specimen), .unit = "m", .min = 0.01,
     .max = 10.0, .help = "diameter of the cloth"},
    {"disc", FIELD_NUMBER, offsetof(FabricDrape, disc), .unit = "m", .min = 0.01, .max = 10.0,
     .help = "diameter of the support"},
    {"flag", FIELD_WORD, offsetof(FabricDrape, flag), .words = fabric_flag_names,
     .help = "how dc and nodes are known"},
    {"geometry", FIELD_WORD, offsetof(FabricDrape, geometry), .words = fabric_flag_names,
     .help = "how the diameters are known"},
    {0}};
static const Schema drape_schema = {.name = "drape",
                                    .help = "a measured drape",
                                    .fields = drape_fields,
                                    .size = sizeof(FabricDrape)};

#define GROUP(name, schema)                                                                        \
    .key = name, .type = FIELD_GROUP, .group = &(schema), .print = print_group

static void print_group(FILE *out, int indent, const Field *field, const void *member);

static const Field fabric_fields[] = {
    {.key = "toile-fabric",
     .type = FIELD_COUNT,
     .offset = offsetof(FabricKeys, version),
     .min = 0,
     .max = 1e9,
     .print = print_group,
     .help = "version of the format, first key of a fabric file"},
    {TEXT("name", fabric.name), .help = "as the file is called"},
    {TEXT("about", fabric.about), .help = "fibre, weave, use"},
    {GROUP("source", source_schema), .help = "where the numbers are from"},
    {TEXT("licence", fabric.licence), .help = "of the numbers"},
    {.key = "like",
     .type = FIELD_RAW,
     .offset = offsetof(FabricKeys, like),
     .help = "another fabric, whose numbers hold where none is given here"},
    {MEASURED("weight", fabric.weight, "kg/m2", 1e-6, 1e4), .help = "areal weight"},
    {MEASURED("thickness", fabric.thickness, "m", 1e-6, 0.1), .help = "offsets contact only"},
    {GROUP("bending", bending_schema), .help = "bending rigidity; one value is both directions"},
    {GROUP("bending_length", length_schema), .help = "in place of bending"},
    {GROUP("stretch", stretch_schema), .help = "membrane stiffness; one value is both directions"},
    {GROUP("shear", shear_schema), .help = "shear stiffness"},
    {GROUP("isotropic", isotropic_schema), .help = "a test material"},
    {MEASURED("friction", fabric.friction, "", 0.0, 100.0), .help = "against a smooth solid"},
    {.key = "threads_per_cm",
     .type = FIELD_NUMBER,
     .offset = offsetof(FabricKeys, fabric.threads_per_cm),
     .unit = "",
     .min = 1.0,
     .max = 500.0,
     .help = "yarns in the picture [1/cm]"},
    {.key = "drape",
     .type = FIELD_RAW,
     .offset = offsetof(FabricKeys, drape),
     .group = &drape_schema,
     .help = "a list of measured drapes, to compare with"},
    {0}};

static void set_default(void *object) { *(FabricKeys *)object = fabric_keys_default(); }

const Schema fabric_schema = {.name = "fabric",
                              .help = "a measured fabric",
                              .fields = fabric_fields,
                              .size = sizeof(FabricKeys),
                              .set_default = set_default};

FabricKeys fabric_keys_default(void) {
    FabricNumber unknown = {.value = NAN, .low = NAN, .high = NAN};
    return (FabricKeys){.fabric = fabric_unknown(),
                        .bend_twist = unknown,
                        .length_warp = unknown,
                        .length_weft = unknown,
                        .iso_stretch = unknown,
                        .iso_poisson = unknown,
                        .iso_bending = unknown};
}

static bool has_value(const Field *field, const char *object) {
    const void *member = object + field->offset;
    if (field->print == print_curve) {
        return ((const FabricCurve *)member)->count > 0;
    }
    return field->type == FIELD_TEXT ? *(const char *const *)member != NULL
                                     : !isnan(((const FabricNumber *)member)->value);
}

/* a group only when something in it is known */
static void print_group(FILE *out, int indent, const Field *field, const void *member) {
    const Field *inner = field->group ? field->group->fields : NULL;
    while (inner && inner->key && !has_value(inner, member)) {
        inner++;
    }
    if (inner && inner->key) {
        fprintf(out, "%*s%s:\n", indent, "", field->key);
        schema_print(out, indent + 2, field->group, member);
    }
}

bool fabric_read_drapes(Reader *reader, const Yaml *list, Fabric *fabric) {
    if (list->kind != YAML_LIST) {
        return schema_error(reader, list, "'drape' wants a list of mappings, found %s",
                            yaml_describe(list, reader->report));
    }
    FabricDrape *drapes = arena_push(reader->arena, FabricDrape, list->count);
    bool ok = true;
    const Yaml *row = list->first;
    for (int i = 0; i < list->count; i++, row = row->next) {
        drapes[i] = (FabricDrape){.specimen = NAN, .disc = NAN};
        ok = schema_read(reader, &drape_schema, row, &drapes[i]) && ok;
    }
    fabric->drape_count = list->count;
    fabric->drapes = drapes;
    return ok;
}

/* three numbers say it all; the others follow from them */
static void use_isotropic_keys(FabricKeys *keys) {
    static const size_t derived[] = {offsetof(Fabric, bend_warp),
                                     offsetof(Fabric, bend_weft),
                                     offsetof(Fabric, bend_bias),
                                     offsetof(Fabric, bend_poisson),
                                     offsetof(Fabric, bend_hysteresis),
                                     offsetof(Fabric, bend_onset),
                                     offsetof(Fabric, stretch_warp),
                                     offsetof(Fabric, stretch_weft),
                                     offsetof(Fabric, stretch_poisson),
                                     offsetof(Fabric, stretch_limit),
                                     offsetof(Fabric, shear),
                                     offsetof(Fabric, shear_hysteresis),
                                     offsetof(Fabric, shear_hysteresis5)};
    keys->iso_stretch = keys->fabric.stretch_warp;
    keys->iso_poisson = keys->fabric.stretch_poisson;
    keys->iso_bending = keys->fabric.bend_warp;
    for (size_t i = 0; i < sizeof derived / sizeof derived[0]; i++) {
        ((FabricNumber *)(void *)((char *)&keys->fabric + derived[i]))->value = NAN;
    }
}

void fabric_print_keys(FILE *out, int indent, const Fabric *fabric) {
    FabricKeys keys = fabric_keys_default();
    keys.fabric = *fabric;
    if (fabric->isotropic) {
        use_isotropic_keys(&keys);
    }
    schema_print(out, indent, &fabric_schema, &keys);
    for (int i = 0; i < fabric->drape_count; i++) {
        const char *head = i == 0 ? "drape:\n" : "";
        fprintf(out, "%*s%s%*s-\n", i == 0 ? indent : 0, "", head, indent + 2, "");
        schema_print(out, indent + 4, &drape_schema, &fabric->drapes[i]);
    }
}
