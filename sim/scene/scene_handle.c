#include <math.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define MOST_HANDLES 10000
#define ON_PANEL 1e-6 /* [m] a point that far outside still is on the panel */

/* Words for regions; `start` and `end` are for sleeves alone. */
static const char *const region_words[] = {
    "left",    "right",  "bottom", "top", "bottom-left", "bottom-right", "top-left", "top-right",
    "midline", "border", "inner",  "all", "start",       "end",          NULL};
enum { WORD_START = 12, WORD_END = 13 };

typedef struct HandleKeys {
    const Yaml *hold, *clamp, *nearest, *circle;
    MotionKeys motion;
    double release; /* [s] */
} HandleKeys;

typedef struct CircleKeys {
    double centre[2], radius; /* [m] */
} CircleKeys;

static const Field circle_fields[] = {
    {"centre", FIELD_POINT, offsetof(CircleKeys, centre), .unit = "m", .max = SCENE_FARTHEST,
     .required = true, .help = "(u, v)"},
    {"radius", FIELD_NUMBER, offsetof(CircleKeys, radius), .unit = "m", .min = 1e-6, .max = 1e3,
     .required = true, .help = "all nodes within it"},
    {0}};
static const Schema circle_schema = {.name = "circle",
                                     .help = "all nodes within a circle on the panel",
                                     .fields = circle_fields,
                                     .size = sizeof(CircleKeys)};

static void handle_keys_default(void *object) {
    *(HandleKeys *)object = (HandleKeys){.release = INFINITY};
}

static const Field handle_fields[] = {
    {"hold", FIELD_RAW, offsetof(HandleKeys, hold),
     .help = "cloth.region, or a list: left, right, bottom, top, bottom-left, ..., start and end "
             "of a sleeve, border, inner, midline, all; or cloth with nearest or circle"},
    {"clamp", FIELD_RAW, offsetof(HandleKeys, clamp),
     .help = "the same, and the slope across the edge follows too"},
    {"nearest", FIELD_RAW, offsetof(HandleKeys, nearest), .help = "the node nearest to [u, v]"},
    {"circle", FIELD_RAW, offsetof(HandleKeys, circle), .group = &circle_schema,
     .help = "all nodes within a circle on the panel"},
    {"turn", FIELD_RAW, offsetof(HandleKeys, motion.turn), .help = "as in motion"},
    {"move", FIELD_RAW, offsetof(HandleKeys, motion.move), .help = "as in motion"},
    {"motion", FIELD_RAW, offsetof(HandleKeys, motion.motion), .group = &motion_schema,
     .help = "turns and moves in their order, one mapping or a list"},
    {"release", FIELD_NUMBER, offsetof(HandleKeys, release), .unit = "s", .min = 1e-6, .max = 1e6,
     .word = "never", .word_value = INFINITY, .help = "when the nodes are let go"},
    {0}};
const Schema handle_schema = {.name = "handle",
                              .help = "nodes that are held",
                              .fields = handle_fields,
                              .size = sizeof(HandleKeys),
                              .set_default = handle_keys_default};

static bool is_corner_or_side(RegionKind region) {
    return region == REGION_LEFT || region == REGION_RIGHT ||
           (region >= REGION_BOTTOM_LEFT && region <= REGION_TOP_RIGHT);
}

/* Does a shape have that region? */
static bool has_region(const ShapeDef *shape, int word) {
    RegionKind region = (RegionKind)word;
    if (shape->kind == SHAPE_GARMENT) {
        return region == REGION_TOP || region == REGION_BOTTOM || region == REGION_ALL;
    }
    if (shape->kind == SHAPE_MESH) {
        return region == REGION_BORDER || region == REGION_ALL;
    }
    bool rectangle = shape->kind == SHAPE_RECTANGLE, sleeve = shape->kind == SHAPE_SLEEVE;
    if (word == WORD_START || word == WORD_END) {
        return sleeve;
    }
    if (is_corner_or_side(region)) {
        return rectangle;
    }
    if (region == REGION_BOTTOM || region == REGION_TOP || region == REGION_MIDLINE) {
        return rectangle || sleeve;
    }
    if (region == REGION_INNER) {
        return shape->kind == SHAPE_ANNULUS ||
               (shape->kind == SHAPE_POLYGON && shape->loop_count > 1);
    }
    return true;
}

static bool read_region(Reader *reader, const Yaml *value, const char *text, const ClothDef *cloth,
                        RegionKind *region) {
    static const char *const shapes[] = {"rectangle", "sleeve",  "disc", "annulus",
                                         "polygon",   "garment", "mesh"};
    const char *words[16];
    int count = 0, word = 0;
    for (int i = 0; region_words[i]; i++) {
        if (has_region(&cloth->shape, i)) {
            words[count++] = region_words[i];
        }
    }
    words[count] = NULL;
    while (region_words[word] && strcmp(region_words[word], text) != 0) {
        word++;
    }
    if (!region_words[word] || !has_region(&cloth->shape, word)) {
        const char *what = cloth->shape.kind == SHAPE_POLYGON ? " without holes" : "";
        return schema_error(reader, value, "'%s' is not a region of '%s', a %s%s%s",
                            report_quote(reader->report, text), cloth->name,
                            shapes[cloth->shape.kind], strcmp(text, "inner") ? "" : what,
                            schema_suggest(reader, text, words));
    }
    *region = word == WORD_START ? REGION_BOTTOM : word == WORD_END ? REGION_TOP : (RegionKind)word;
    return true;
}

bool scene_find_cloth(Reader *reader, const Yaml *value, const char *name, int *cloth) {
    const Scene *scene = scene_context(reader)->scene;
    const char **names = arena_push(reader->arena, const char *, scene->cloth_count + 1);
    for (int i = 0; i < scene->cloth_count; i++) {
        names[i] = scene->cloths[i].name;
        if (strcmp(names[i], name) == 0) {
            *cloth = i;
            return true;
        }
    }
    return schema_error(reader, value, "no cloth is called '%s'%s",
                        report_quote(reader->report, name), schema_suggest(reader, name, names));
}

static bool read_point(Reader *reader, const HandleKeys *keys, HandleDef *handle) {
    const ShapeDef *shape = &scene_context(reader)->scene->cloths[handle->cloth].shape;
    const Yaml *place = keys->nearest ? keys->nearest : keys->circle;
    if (shape->kind == SHAPE_GARMENT) {
        return schema_error(reader, place, "places on a garment have no (u, v); hold its top");
    }
    if (keys->nearest && keys->circle) {
        return schema_error(reader, place, "'nearest' and 'circle' exclude each other");
    }
    if (keys->nearest) {
        handle->region = REGION_NEAREST;
        if (!schema_read_vector(reader, "nearest", "m", SCENE_FARTHEST, place, handle->point, 2)) {
            return false;
        }
    } else {
        CircleKeys circle = {0};
        handle->region = REGION_CIRCLE;
        if (!schema_read(reader, &circle_schema, place, &circle)) {
            return false;
        }
        memcpy(handle->point, circle.centre, sizeof circle.centre);
        handle->radius = circle.radius;
    }
    double away = shape_distance(shape, handle->point);
    if (away > handle->radius + ON_PANEL) {
        return schema_error(reader, place, "this is %.3g m off the panel: there is no node to hold",
                            away - handle->radius);
    }
    return true;
}

/* "sleeve.end", or "sleeve" with nearest or circle */
static bool read_target(Reader *reader, const HandleKeys *keys, const Yaml *value,
                        HandleDef *handle) {
    if (value->kind != YAML_TEXT || !value->text[0]) {
        return schema_error(reader, value, "'%s' wants cloth.region such as sheet.top, found %s",
                            keys->hold ? "hold" : "clamp", yaml_describe(value, reader->report));
    }
    char *name = arena_strdup(reader->arena, value->text);
    char *dot = strchr(name, '.');
    if (dot) {
        *dot = '\0';
    }
    if (!scene_find_cloth(reader, value, name, &handle->cloth)) {
        return false;
    }
    const ClothDef *cloth = &scene_context(reader)->scene->cloths[handle->cloth];
    if (cloth->shape.kind == SHAPE_RECTANGLE && cloth->shape.width == 0.0) {
        return false; /* its shape was wrong: that is reported already */
    }
    bool point = keys->nearest || keys->circle;
    if (point == (dot != NULL)) {
        return schema_error(reader, value,
                            point ? "'%s' names a region already; leave out 'nearest' and 'circle'"
                                  : "which nodes of '%s'? write %s.top, or add 'nearest' or "
                                    "'circle'",
                            report_quote(reader->report, value->text), name);
    }
    return point ? read_point(reader, keys, handle)
                 : read_region(reader, value, dot + 1, cloth, &handle->region);
}

static bool check_clamp(Reader *reader, const Yaml *value, const HandleDef *handle) {
    const ClothDef *cloth = &scene_context(reader)->scene->cloths[handle->cloth];
    bool sewn = cloth->shape.kind == SHAPE_GARMENT || cloth->shape.kind == SHAPE_MESH;
    if (handle->kind == HANDLE_CLAMP && sewn) {
        return schema_error(reader, value, "a garment cannot be clamped; 'hold' it");
    }
    bool single = handle->region == REGION_NEAREST ||
                  (handle->region >= REGION_BOTTOM_LEFT && handle->region <= REGION_TOP_RIGHT);
    return handle->kind == HANDLE_HOLD || !single ||
           schema_error(reader, value, "a single node has no edge to clamp; 'hold' it");
}

static bool check_twice(Reader *reader, const Yaml *value, const HandleDef *handle) {
    const Scene *scene = scene_context(reader)->scene;
    for (int i = 0; i < scene->handle_count; i++) {
        const HandleDef *other = &scene->handles[i];
        if (other->cloth == handle->cloth && other->region == handle->region &&
            other->point[0] == handle->point[0] && other->point[1] == handle->point[1] &&
            other->radius == handle->radius) {
            return schema_error(reader, value, "these nodes are held already, at %s", other->where);
        }
    }
    return true;
}

static bool check_release(Reader *reader, const Yaml *map, const HandleDef *handle) {
    for (int i = 0; i < handle->motion.piece_count; i++) {
        double from = handle->motion.pieces[i].from;
        if (handle->release <= from) {
            return schema_error(reader, yaml_find(map, "release"),
                                "released at %g s, before its motion starts at %g s",
                                handle->release, from);
        }
    }
    return true;
}

static bool read_handle(Reader *reader, const Yaml *map, const HandleKeys *keys, const Yaml *value,
                        HandleDef *handle) {
    *handle = handle_default();
    handle->kind = keys->hold ? HANDLE_HOLD : HANDLE_CLAMP;
    handle->release = keys->release;
    handle->where = report_where(reader->report, value->place);
    if (!read_target(reader, keys, value, handle)) {
        return false;
    }
    Vec3 centre = scene_context(reader)->scene->cloths[handle->cloth].pose.shift;
    return motion_read(reader, &keys->motion, centre, &handle->motion) &&
           check_release(reader, map, handle) && check_clamp(reader, value, handle) &&
           check_twice(reader, value, handle);
}

static int count_targets(const Yaml *map) {
    const Yaml *value = yaml_find(map, "hold");
    value = value ? value : yaml_find(map, "clamp");
    return value && value->kind == YAML_LIST ? value->count : 1;
}

/* one mapping of the list; each target becomes a handle */
static bool read_entry(Reader *reader, const Yaml *map, Scene *scene) {
    HandleKeys keys;
    handle_keys_default(&keys);
    if (!schema_read(reader, &handle_schema, map, &keys)) {
        return false;
    }
    if (!keys.hold == !keys.clamp) {
        return schema_error(reader, map,
                            keys.hold ? "'hold' and 'clamp' exclude each other"
                                      : "a handle needs 'hold' or 'clamp'");
    }
    const Yaml *targets = keys.hold ? keys.hold : keys.clamp;
    bool list = targets->kind == YAML_LIST, ok = true;
    for (const Yaml *value = list ? targets->first : targets; value;
         value = list ? value->next : NULL) {
        HandleDef handle;
        if (read_handle(reader, map, &keys, value, &handle)) {
            scene->handles[scene->handle_count++] = handle;
        } else {
            ok = false;
        }
    }
    return ok;
}

bool scene_read_handles(Reader *reader, const Field *field, const Yaml *value, void *member) {
    Scene *scene = member;
    int count = 0;
    if (value->kind != YAML_LIST) {
        return schema_error(reader, value,
                            "'%s' wants a list such as - {hold: sheet.top}, found %s", field->key,
                            yaml_describe(value, reader->report));
    }
    for (const Yaml *map = value->first; map; map = map->next) {
        count += count_targets(map);
    }
    if (count > MOST_HANDLES) {
        return schema_error(reader, value, "more than %d handles", MOST_HANDLES);
    }
    scene->handles = arena_push(reader->arena, HandleDef, count);
    bool ok = true;
    for (const Yaml *map = value->first; map; map = map->next) {
        ok = read_entry(reader, map, scene) && ok;
    }
    return ok;
}

static void print_target(FILE *out, int indent, const HandleDef *handle, const char *cloth) {
    fprintf(out, "%s: %s", handle->kind == HANDLE_HOLD ? "hold" : "clamp", cloth);
    if (handle->region < REGION_NEAREST) {
        fprintf(out, ".%s\n", region_words[handle->region]);
        return;
    }
    bool circle = handle->region == REGION_CIRCLE;
    fprintf(out, "\n%*s%s", indent, "", circle ? "circle: {centre: [" : "nearest: [");
    schema_print_quantity(out, handle->point[0], "m");
    fputs(", ", out);
    schema_print_quantity(out, handle->point[1], "m");
    fputc(']', out);
    if (circle) {
        fputs(", radius: ", out);
        schema_print_quantity(out, handle->radius, "m");
        fputc('}', out);
    }
    fputc('\n', out);
}

void scene_print_handles(FILE *out, int indent, const Field *field, const void *member) {
    const Scene *scene = member;
    if (scene->handle_count > 0) {
        fprintf(out, "%*s%s:\n", indent, "", field->key);
    }
    for (int i = 0; i < scene->handle_count; i++) {
        const HandleDef *handle = &scene->handles[i];
        fprintf(out, "%*s- ", indent + 2, "");
        print_target(out, indent + 4, handle, scene->cloths[handle->cloth].name);
        motion_print(out, indent + 4, &handle->motion);
        if (isfinite(handle->release)) {
            schema_print_key(out, indent + 4, "release");
            schema_print_quantity(out, handle->release, "s");
            fputc('\n', out);
        }
    }
}
