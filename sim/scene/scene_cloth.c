#include <math.h>
#include <string.h>

#include "sim/scene/fabric_schema.h"
#include "sim/scene/scene_schema.h"

#define SMALLEST_SIZE 1e-4     /* [m] of a cloth */
#define LARGEST_SIZE 1e3       /* [m] */
#define SCATTERED_DIVISIONS 40 /* default spacing = extent / this */
#define FEWEST_NODES 3         /* in each direction: fewer cannot bend */
#define FEWEST_AROUND 5        /* of a sleeve: with fewer a stencil meets itself */
#define MOST_CLOTHS 1000

static const char *const rest_words[] = {"flat", "curved", NULL};
static const char *const sides_words[] = {"free", "bounded", NULL};
static const char *const kinematics_words[] = {"green", "corotational", NULL};
const char *const bending_words[] = {"auto",   "stencil", "rbf",   "choi_ko", "chord", "provot",
                                     "morley", "tensor",  "hinge", "angle",   "sine",  NULL};
static const char *const membrane_words[] = {"auto", "pairs", "triangles", NULL};
static const char *const thread_words[] = {"line", "breen", NULL};
static const char *const buckle_words[] = {"elastica", "arc", "quartic", "none", NULL};

typedef struct PolygonKeys {
    const Yaml *outline, *holes;
} PolygonKeys;

#define SIZE(name, member, text)                                                                   \
    {                                                                                              \
        .key = name, .type = FIELD_NUMBER, .offset = offsetof(ShapeDef, member), .unit = "m",      \
        .min = SMALLEST_SIZE, .max = LARGEST_SIZE, .required = true, .help = text                  \
    }

static const Field rectangle_fields[] = {
    SIZE("width", width, "along u, the warp"),
    SIZE("height", height, "along v, the weft"),
    {"rest_curvature", FIELD_POINT, offsetof(ShapeDef, rest_curvature), .unit = "1/m", .max = 1e4,
     .help = "curvature along u and v of the cloth at rest"},
    {0}};
static const Field sleeve_fields[] = {
    SIZE("radius", radius, "of the cylinder"),
    SIZE("length", length, "along the axis"),
    {"rest", FIELD_BOOL, offsetof(ShapeDef, rest_curved), .words = rest_words,
     .help = "flat: it wants to be the flat panel; curved: the cylinder"},
    {0}};
static const Field disc_fields[] = {SIZE("radius", radius, "of the rim"), {0}};
static const Field annulus_fields[] = {SIZE("radius", radius, "of the outer rim"),
                                       SIZE("inner", inner_radius, "radius of the hole"),
                                       {0}};
static const Field polygon_fields[] = {
    {"outline", FIELD_RAW, offsetof(PolygonKeys, outline), .required = true,
     .help = "corners [[u, v], ...], any direction"},
    {"holes", FIELD_RAW, offsetof(PolygonKeys, holes), .help = "a list of outlines"},
    {0}};

static void shape_set_default(void *object) { *(ShapeDef *)object = shape_default(); }

#define SHAPE(name, list, text)                                                                    \
    { name, text, list, sizeof(ShapeDef), shape_set_default, 0 }
static const Schema rectangle_schema = SHAPE("rectangle", rectangle_fields, "a rectangle");
static const Schema sleeve_schema = SHAPE("sleeve", sleeve_fields, "an open cylinder");
static const Schema disc_schema = SHAPE("disc", disc_fields, "a disc");
static const Schema annulus_schema = SHAPE("annulus", annulus_fields, "a disc with a hole");
const Schema polygon_schema = {.name = "polygon",
                               .help = "any outline",
                               .fields = polygon_fields,
                               .size = sizeof(PolygonKeys)};

/* in the order of ShapeKind */
static const Field shape_fields[] = {
    {"rectangle", FIELD_GROUP, .group = &rectangle_schema, .help = "u along the warp, v the weft"},
    {"sleeve", FIELD_GROUP, .group = &sleeve_schema, .help = "u runs around, v along the axis z"},
    {"disc", FIELD_GROUP, .group = &disc_schema, .help = "u, v from its centre"},
    {"annulus", FIELD_GROUP, .group = &annulus_schema, .help = "u, v from its centre"},
    {"polygon", FIELD_GROUP, .group = &polygon_schema, .help = "a pattern piece"},
    {"garment", FIELD_GROUP, .group = &garment_schema, .help = "pattern pieces sewn together"},
    {"mesh", FIELD_GROUP, .group = &cloth_mesh_schema,
     .help = "triangles out of a file, flat by UV"},
    {0}};
const Schema shape_schema = {.name = "shape", .help = "one of these", .fields = shape_fields};

bool polygon_read_value(Reader *reader, const Yaml *value, ShapeDef *shape) {
    PolygonKeys keys = {0};
    return schema_read(reader, &polygon_schema, value, &keys) &&
           polygon_read(reader, keys.outline, keys.holes, shape);
}

bool shape_read(Reader *reader, const Field *field, const Yaml *value, void *member) {
    (void)field;
    ShapeDef *shape = member;
    if (value->kind != YAML_MAP || value->count != 1) {
        return schema_error(reader, value,
                            "'shape' wants one of rectangle, sleeve, disc, annulus, polygon, "
                            "garment, mesh, found %s",
                            value->kind == YAML_MAP && value->count
                                ? "several"
                                : yaml_describe(value, reader->report));
    }
    int kind = 0;
    while (shape_fields[kind].key && strcmp(shape_fields[kind].key, value->first->key->text)) {
        kind++;
    }
    if (!shape_fields[kind].key) {
        struct {
            char unused;
        } nothing;
        return schema_read(reader, &shape_schema, value, &nothing);
    }
    shape->kind = (ShapeKind)kind;
    if (kind == SHAPE_POLYGON) {
        return polygon_read_value(reader, value->first, shape);
    }
    if (kind == SHAPE_GARMENT) {
        return garment_read(reader, value->first, shape);
    }
    if (kind == SHAPE_MESH) {
        return cloth_mesh_read(reader, value->first, shape);
    }
    if (!schema_read(reader, shape_fields[kind].group, value->first, shape)) {
        return false;
    }
    return kind != SHAPE_ANNULUS || shape->inner_radius < shape->radius ||
           schema_error(reader, value->first, "'inner' is not smaller than 'radius'");
}

void outlines_print(FILE *out, int indent, const int *begin, int loop_count, const double *points) {
    for (int loop = 0; loop < loop_count; loop++) {
        const char *head = loop == 0 ? "outline:" : loop == 1 ? "holes:" : NULL;
        if (head) {
            fprintf(out, "%*s%s\n", indent, "", head);
        }
        for (int i = begin[loop]; i < begin[loop + 1]; i++) {
            bool opens = loop > 0 && i == begin[loop];
            fprintf(out, "%*s%s- [", indent + (loop > 0 && !opens ? 4 : 2), "", opens ? "- " : "");
            schema_print_quantity(out, points[2 * i], "m");
            fputs(", ", out);
            schema_print_quantity(out, points[2 * i + 1], "m");
            fputs("]\n", out);
        }
    }
}

void shape_print(FILE *out, int indent, const Field *field, const void *member) {
    const ShapeDef *shape = member;
    const Field *row = &shape_fields[shape->kind];
    fprintf(out, "%*s%s:\n%*s%s:\n", indent, "", field->key, indent + 2, "", row->key);
    if (shape->kind == SHAPE_POLYGON) {
        outlines_print(out, indent + 4, shape->loop_begin, shape->loop_count, shape->outline);
    } else if (shape->kind == SHAPE_GARMENT) {
        garment_print(out, indent + 4, shape);
    } else if (shape->kind == SHAPE_MESH) {
        cloth_mesh_print(out, indent + 4, shape);
    } else {
        schema_print(out, indent + 4, row->group, shape);
    }
}

static bool read_fabric(Reader *reader, const Field *field, const Yaml *value, void *member) {
    (void)field;
    return fabric_read_value(reader, &scene_context(reader)->sources, value, member);
}

static void print_fabric(FILE *out, int indent, const Field *field, const void *member) {
    fprintf(out, "%*s%s:\n", indent, "", field->key);
    fabric_print_keys(out, indent + 2, member);
}

/* one of nodes, spacing, accuracy: they exclude each other */
static void print_nodes(FILE *out, int indent, const Field *field, const void *member) {
    const ClothDef *cloth = (const void *)((const char *)member - offsetof(ClothDef, nodes));
    if (cloth->spacing == 0.0 && cloth->accuracy == 0.0) {
        fprintf(out, "%*s%s: %d x %d\n", indent, "", field->key, cloth->nodes[0], cloth->nodes[1]);
    }
}

static void print_positive(FILE *out, int indent, const Field *field, double value) {
    if (value > 0.0) {
        schema_print_key(out, indent, field->key);
        schema_print_quantity(out, value, field->unit);
        fputc('\n', out);
    }
}

static void print_spacing(FILE *out, int indent, const Field *field, const void *member) {
    const ClothDef *cloth = (const void *)((const char *)member - offsetof(ClothDef, spacing));
    print_positive(out, indent, field, cloth->accuracy > 0.0 ? 0.0 : cloth->spacing);
}

static void print_accuracy(FILE *out, int indent, const Field *field, const void *member) {
    print_positive(out, indent, field, *(const double *)member);
}

#define AT(member) offsetof(ClothDef, member)
static bool read_plain(Reader *reader, const Field *field, const Yaml *value, void *member) {
    Field plain = *field;
    plain.type = FIELD_NUMBER;
    return schema_read_field(reader, &plain, value, member);
}

static bool read_nodes(Reader *reader, const Field *field, const Yaml *value, void *member) {
    Field plain = *field;
    plain.type = FIELD_GRID;
    return schema_read_field(reader, &plain, value, member);
}

static const Field cloth_fields[] = {
    {"shape", FIELD_CUSTOM, AT(shape), .group = &shape_schema, .read = shape_read,
     .print = shape_print, .required = true, .help = "the panel"},
    {"fabric", FIELD_CUSTOM, AT(fabric), .group = &fabric_schema, .read = read_fabric,
     .print = print_fabric, .required = true, .help = "a name, a path, or a mapping of keys"},
    {"model", FIELD_NAME, AT(model), .min = 0, .help = "how cloth becomes mathematics"},
    {"nodes", FIELD_CUSTOM, AT(nodes), .read = read_nodes, .print = print_nodes, .min = 1,
     .max = 1e6, .help = "along u and v, 60 x 40; around and along for a sleeve; default 41 x 41"},
    {"spacing", FIELD_CUSTOM, AT(spacing), .unit = "m", .min = 1e-5, .max = 100.0,
     .read = read_plain, .print = print_spacing,
     .help = "distance of nodes, in place of nodes; default for discs, polygons: extent / 40"},
    {"accuracy", FIELD_CUSTOM, AT(accuracy), .unit = "", .min = 1e-5, .max = 0.5,
     .read = read_plain, .print = print_accuracy,
     .help = "wished relative error, 1 %, in place of nodes: toile chooses nodes and step"},
    {"scattered", FIELD_BOOL, AT(scattered), .help = "a rectangle with scattered nodes"},
    {"jitter", FIELD_NUMBER, AT(jitter), .unit = "", .min = 0.0, .max = 0.4,
     .help = "random shift of scattered nodes / spacing"},
    {"at", FIELD_VECTOR, AT(pose.shift), .unit = "m", .max = SCENE_FARTHEST,
     .help = "where the centre starts"},
    {"turn", FIELD_CUSTOM, AT(pose.turn), .group = &pose_turn_schema, .read = pose_turn_read,
     .print = pose_turn_print, .help = "how it starts: a turn or a list of them"},
    {"velocity", FIELD_VECTOR, AT(velocity), .unit = "m/s", .max = 1e3, .help = "at the start"},
    {"noise", FIELD_NUMBER, AT(noise), .unit = "m", .min = 0.0, .max = 0.1,
     .help = "amplitude of random shifts off the panel at the start"},
    {"damping", FIELD_NUMBER, AT(damping), .unit = "1/s", .min = 0.0, .max = 1e6,
     .help = "mass damping"},
    {"bending_damping", FIELD_NUMBER, AT(bending_damping), .unit = "s", .min = 0.0, .max = 1.0,
     .help = "damping inside the fabric: moment per rate of curvature / bending stiffness"},
    {"membrane_damping", FIELD_NUMBER, AT(membrane_damping), .unit = "s", .min = 0.0, .max = 1.0,
     .help = "the same in its plane: force per rate of strain / stiffness"},
    {"sides", FIELD_WORD, AT(sides), .words = sides_words,
     .help = "mlpg, lattices: sides of cells stretch as they will, or little more than their cell"},
    {"kinematics", FIELD_WORD, AT(kinematics), .words = kinematics_words, .help = "strain"},
    {"bending", FIELD_WORD, AT(bending), .words = bending_words,
     .help = "curvature; each model knows some of these"},
    {"hysteresis", FIELD_BOOL, AT(hysteresis),
     .help = "yarns stick and slip, so that bends and shears stay in part; lattices"},
    {"stiffening", FIELD_NUMBER, AT(stiffening), .unit = "", .max = 1e3, .word = "none",
     .word_value = 0.0,
     .help = "springs: stiffness beyond the stretch limit of the fabric / its modulus, on top"},
    {"limit_rounds", FIELD_NUMBER, AT(limit_rounds), .unit = "", .max = 1e3, .word = "none",
     .word_value = 0.0,
     .help =
         "springs, explicit: rounds a step that shorten what is beyond the stretch limit, or 10 %"},
    {"buckling", FIELD_WORD, AT(buckling), .words = buckle_words,
     .help = "how springs give way in compression"},
    {"membrane", FIELD_WORD, AT(membrane), .words = membrane_words,
     .help = "strain of triangles: of pairs (lattices), or of each"},
    {"threads", FIELD_BOOL, AT(fifth_power), .words = thread_words,
     .help = "particles: threads stretch along a line, or with the fifth power of the paper"},
    {"repel", FIELD_BOOL, AT(repel),
     .help = "particles keep a spacing apart, as in the paper; explicit; to compare with contact"},
    {"look", FIELD_NAME, AT(look), .min = 2, .help = "in the picture; default: that of the film"},
    {"print", FIELD_CUSTOM, AT(print), .group = &print_schema, .read = print_read,
     .print = print_print, .help = "a picture printed on the face"},
    {0}};

static void cloth_set_default(void *object) { *(ClothDef *)object = cloth_default(); }

const Schema cloth_schema = {.name = "cloth",
                             .help = "one piece of cloth",
                             .fields = cloth_fields,
                             .size = sizeof(ClothDef),
                             .set_default = cloth_set_default};

static double loop_area(const ShapeDef *shape, int loop) {
    double twice = 0.0;
    int begin = shape->loop_begin[loop], end = shape->loop_begin[loop + 1];
    for (int i = begin; i < end; i++) {
        const double *p = shape->outline + 2 * i;
        const double *q = shape->outline + 2 * (i + 1 < end ? i + 1 : begin);
        twice += p[0] * q[1] - p[1] * q[0];
    }
    return 0.5 * twice;
}

double shape_area(const ShapeDef *shape) {
    double r = shape->radius, area = 0.0;
    switch (shape->kind) {
    case SHAPE_RECTANGLE:
        return shape->width * shape->height;
    case SHAPE_SLEEVE:
        return 2.0 * PI * r * shape->length;
    case SHAPE_DISC:
        return PI * r * r;
    case SHAPE_ANNULUS:
        return PI * (r * r - shape->inner_radius * shape->inner_radius);
    case SHAPE_POLYGON:
    case SHAPE_GARMENT:
        for (int loop = 0; loop < shape->loop_count; loop++) {
            area += loop_area(shape, loop);
        }
        return area;
    case SHAPE_MESH:
        return cloth_mesh_area(shape->mesh);
    }
    return 0.0;
}

void shape_extents(const ShapeDef *shape, double extents[2]) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    switch (shape->kind) {
    case SHAPE_RECTANGLE:
        extents[0] = shape->width, extents[1] = shape->height;
        return;
    case SHAPE_SLEEVE:
        extents[0] = 2.0 * PI * shape->radius, extents[1] = shape->length;
        return;
    case SHAPE_DISC:
    case SHAPE_ANNULUS:
        extents[0] = extents[1] = 2.0 * shape->radius;
        return;
    case SHAPE_POLYGON:
    case SHAPE_GARMENT: /* of the first panel */
        for (int i = 0; i < 2 * shape->loop_begin[1]; i++) {
            low[i % 2] = fmin(low[i % 2], shape->outline[i]);
            high[i % 2] = fmax(high[i % 2], shape->outline[i]);
        }
        extents[0] = high[0] - low[0], extents[1] = high[1] - low[1];
        return;
    case SHAPE_MESH:
        cloth_mesh_extents(shape->mesh, extents);
        return;
    }
}

static bool is_lattice(const ClothDef *cloth) {
    return cloth->shape.kind == SHAPE_SLEEVE ||
           (cloth->shape.kind == SHAPE_RECTANGLE && !cloth->scattered);
}

/* of a lattice, along u */
static int fewest_along(const ClothDef *cloth) {
    return cloth->shape.kind == SHAPE_SLEEVE ? FEWEST_AROUND : FEWEST_NODES;
}

/* nodes from spacing on a lattice, spacing from the size elsewhere; returns the node count */
static double choose_nodes(ClothDef *cloth) {
    double extents[2];
    shape_extents(&cloth->shape, extents);
    if (cloth->shape.kind == SHAPE_MESH) {
        return cloth->shape.mesh->vertex_count;
    }
    if (!is_lattice(cloth)) {
        if (cloth->spacing == 0.0) {
            cloth->spacing = fmax(extents[0], extents[1]) / SCATTERED_DIVISIONS;
        }
        double cells = shape_area(&cloth->shape) / (cloth->spacing * cloth->spacing);
        double border = (extents[0] + extents[1]) / cloth->spacing;
        return cells + border + 1.0;
    }
    if (cloth->spacing > 0.0) {
        bool around = cloth->shape.kind == SHAPE_SLEEVE;
        for (int i = 0; i < 2; i++) {
            double count = round(extents[i] / cloth->spacing) + (i == 0 && around ? 0.0 : 1.0);
            int fewest = i == 0 ? fewest_along(cloth) : FEWEST_NODES;
            cloth->nodes[i] = (int)fmax(fewest, fmin(count, SCENE_MOST_NODES));
        }
    }
    return (double)cloth->nodes[0] * cloth->nodes[1];
}

static bool check_ways(Reader *reader, const Yaml *map, const ClothDef *cloth) {
    const Yaml *nodes = yaml_find(map, "nodes"), *spacing = yaml_find(map, "spacing");
    const Yaml *accuracy = yaml_find(map, "accuracy"), *jitter = yaml_find(map, "jitter");
    const Yaml *scattered = yaml_find(map, "scattered");
    if ((nodes && spacing) || (accuracy && (nodes || spacing))) {
        const Yaml *second = accuracy ? accuracy : spacing;
        return schema_error(reader, second->key,
                            "'%s' and '%s' exclude each other; give one of them",
                            nodes ? "nodes" : "spacing", second->key->text);
    }
    const Yaml *ways[4] = {nodes, spacing, accuracy, jitter};
    for (int i = 0; i < 4 && cloth->shape.kind == SHAPE_MESH; i++) {
        if (ways[i]) {
            return schema_error(reader, ways[i]->key, "the nodes of a mesh are those of its file");
        }
    }
    if (cloth->scattered && cloth->shape.kind != SHAPE_RECTANGLE) {
        return schema_error(reader, scattered->key, "only a rectangle can be 'scattered'%s",
                            cloth->shape.kind == SHAPE_SLEEVE ? "" : "; this shape always is");
    }
    if (nodes && !is_lattice(cloth)) {
        return schema_error(reader, nodes->key,
                            "'nodes' counts rows of a lattice; a %s has "
                            "scattered nodes: give their 'spacing'",
                            cloth->scattered ? "scattered rectangle"
                                             : shape_fields[cloth->shape.kind].key);
    }
    if (jitter && cloth->jitter > 0.0 && is_lattice(cloth)) {
        return schema_error(reader, jitter->key, "'jitter' needs scattered nodes");
    }
    return true;
}

static bool check_counts(Reader *reader, const Yaml *map, ClothDef *cloth) {
    const Yaml *nodes = yaml_find(map, "nodes"), *spacing = yaml_find(map, "spacing");
    const Yaml *place = nodes ? nodes : spacing ? spacing : map->key;
    double *sum = &scene_context(reader)->node_sum, count = choose_nodes(cloth);
    int along = fewest_along(cloth);
    bool few = is_lattice(cloth) && (cloth->nodes[0] < along || cloth->nodes[1] < FEWEST_NODES);
    if (few || count < FEWEST_NODES) {
        return along == FEWEST_AROUND
                   ? schema_error(reader, place,
                                  "too few nodes: a sleeve needs 5 around and 3 along")
                   : schema_error(reader, place,
                                  "too few nodes: a cloth needs 3 in each direction");
    }
    *sum += count;
    if (*sum > SCENE_MOST_NODES) {
        return schema_error(reader, place, "%.3g nodes in all; at most 4 million fit", *sum);
    }
    return true;
}

static bool read_cloth(Reader *reader, const Yaml *map, ClothDef *cloth) {
    *cloth = cloth_default();
    cloth->name = map->key->text;
    cloth->where = report_where(reader->report, map->key->place);
    cloth->look = scene_context(reader)->look;
    bool ok = name_check(reader, map->key, "a cloth");
    return schema_read(reader, &cloth_schema, map, cloth) && check_ways(reader, map, cloth) &&
           check_counts(reader, map, cloth) && ok;
}

bool scene_read_cloths(Reader *reader, const Field *field, const Yaml *value, void *member) {
    Scene *scene = member;
    if (value->kind != YAML_MAP || value->count == 0 || value->count > MOST_CLOTHS) {
        return schema_error(reader, value,
                            "'%s' wants a mapping of 1 .. %d names to cloths, found %s", field->key,
                            MOST_CLOTHS, yaml_describe(value, reader->report));
    }
    scene->cloths = arena_push(reader->arena, ClothDef, value->count);
    bool ok = true;
    for (const Yaml *map = value->first; map; map = map->next) {
        /* a cloth that is wrong keeps its name, so that handles find it */
        ok = read_cloth(reader, map, &scene->cloths[scene->cloth_count++]) && ok;
    }
    return ok;
}

void scene_print_cloths(FILE *out, int indent, const Field *field, const void *member) {
    const Scene *scene = member;
    fprintf(out, "%*s%s:\n", indent, "", field->key);
    for (int i = 0; i < scene->cloth_count; i++) {
        fprintf(out, "%*s%s:\n", indent + 2, "", scene->cloths[i].name);
        schema_print(out, indent + 4, &cloth_schema, &scene->cloths[i]);
    }
}
