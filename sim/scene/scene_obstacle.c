#include <math.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define SMALLEST_SIZE 1e-4 /* [m] of a solid */
#define LARGEST_SIZE 1e3   /* [m] */
#define MOST_OBSTACLES 1000

/* the keys of all solids; each schema uses some of them */
typedef struct SolidKeys {
    Vec3 normal, size;               /* size [m]; NAN: not given */
    double radius, rounding, length; /* [m] */
    Vec3 from, to;                   /* [m] ends of the axis; NAN */
} SolidKeys;

typedef struct ObstacleKeys {
    ObstacleDef obstacle;
    const Yaml *solids[SOLID_KIND_COUNT];
    const Yaml *mesh, *motion;
} ObstacleKeys;

static void solid_keys_default(void *object) {
    *(SolidKeys *)object = (SolidKeys){
        .normal = {0.0, 0.0, 1.0}, .length = NAN, .from = {NAN, NAN, NAN}, .to = {NAN, NAN, NAN}};
}

static void obstacle_keys_default(void *object) {
    *(ObstacleKeys *)object = (ObstacleKeys){.obstacle = obstacle_default()};
}

#define RADIUS(text)                                                                               \
    {                                                                                              \
        "radius", FIELD_NUMBER, offsetof(SolidKeys, radius),                                       \
            .unit = "m", .min = SMALLEST_SIZE, .max = LARGEST_SIZE, .required = true, .help = text \
    }
#define LENGTH                                                                                     \
    {                                                                                              \
        "length", FIELD_NUMBER, offsetof(SolidKeys, length),                                       \
            .unit = "m", .min = SMALLEST_SIZE, .max = LARGEST_SIZE,                                \
            .help = "along z, in place of from and to"                                             \
    }
#define END(name, member, text)                                                                    \
    {                                                                                              \
        name, FIELD_VECTOR, offsetof(SolidKeys, member), .unit = "m", .max = SCENE_FARTHEST,       \
                                                         .help = text                              \
    }

static const Field plane_fields[] = {{"normal", FIELD_VECTOR, offsetof(SolidKeys, normal),
                                      .unit = "", .max = 1e9, .help = "points out of the solid"},
                                     {0}};
static const Field sphere_fields[] = {RADIUS("of the sphere"), {0}};
static const Field box_fields[] = {
    {"size", FIELD_VECTOR, offsetof(SolidKeys, size), .unit = "m", .max = LARGEST_SIZE,
     .required = true, .help = "whole extents along x, y, z"},
    {"rounding", FIELD_NUMBER, offsetof(SolidKeys, rounding), .unit = "m", .min = 0.0,
     .max = LARGEST_SIZE, .help = "radius of the edges, inside the extents"},
    {0}};
static const Field cylinder_fields[] = {RADIUS("of the cylinder"),
                                        LENGTH,
                                        END("from", from, "centre of one end"),
                                        END("to", to, "centre of the other end"),
                                        {0}};
static const Field capsule_fields[] = {RADIUS("of the capsule"),
                                       LENGTH,
                                       END("from", from, "centre of one end ball"),
                                       END("to", to, "centre of the other"),
                                       {0}};
static const Field cone_fields[] = {RADIUS("of the base"),
                                    LENGTH,
                                    END("from", from, "centre of the base"),
                                    END("to", to, "apex"),
                                    {0}};

#define SOLID(name, text, list)                                                                    \
    { name, text, list, sizeof(SolidKeys), solid_keys_default, 0 }
/* by SolidKind */
static const Schema solid_schemas[SOLID_KIND_COUNT] = {
    SOLID("plane", "a half space", plane_fields),
    SOLID("sphere", "a ball", sphere_fields),
    SOLID("box", "a box", box_fields),
    SOLID("cylinder", "with flat ends", cylinder_fields),
    SOLID("capsule", "with round ends", capsule_fields),
    SOLID("cone", "a cone", cone_fields)};

#define SOLID_FIELD(name, kind, text)                                                              \
    {                                                                                              \
        name, FIELD_RAW, offsetof(ObstacleKeys, solids) + sizeof(const Yaml *) * (kind),           \
            .group = &solid_schemas[kind], .help = text                                            \
    }
static const Field obstacle_fields[] = {
    SOLID_FIELD("plane", SOLID_PLANE, "a half space; at is a point on it"),
    SOLID_FIELD("sphere", SOLID_SPHERE, "around at"),
    SOLID_FIELD("box", SOLID_BOX, "around at"),
    SOLID_FIELD("cylinder", SOLID_CYLINDER, "flat ends; around at, or from end to end"),
    SOLID_FIELD("capsule", SOLID_CAPSULE, "round ends; around at, or from end to end"),
    SOLID_FIELD("cone", SOLID_CONE, "around at, apex up, or from base to apex"),
    {"mesh", FIELD_RAW, offsetof(ObstacleKeys, mesh), .group = &mesh_schema,
     .help = "triangles out of a file; its origin at at"},
    {"at", FIELD_VECTOR, offsetof(ObstacleKeys, obstacle.pose.shift), .unit = "m",
     .max = SCENE_FARTHEST, .help = "where its centre starts; shifts from and to as well"},
    {"turn", FIELD_CUSTOM, offsetof(ObstacleKeys, obstacle.pose.turn), .group = &pose_turn_schema,
     .read = pose_turn_read, .print = pose_turn_print,
     .help = "how it starts: a turn about at, or a list of them"},
    {"motion", FIELD_RAW, offsetof(ObstacleKeys, motion), .group = &motion_schema,
     .help = "turns and moves over time, one mapping or a list; file: as the mesh has it"},
    {"friction", FIELD_NUMBER, offsetof(ObstacleKeys, obstacle.friction), .unit = "", .min = 0.0,
     .max = 10.0, .word = "fabric", .word_value = -1.0, .help = "against cloth"},
    {"look", FIELD_NAME, offsetof(ObstacleKeys, obstacle.look), .min = 2, .help = "in the picture"},
    {0}};
const Schema obstacle_schema = {.name = "obstacle",
                                .help = "a solid that cloth meets",
                                .fields = obstacle_fields,
                                .size = sizeof(ObstacleKeys),
                                .set_default = obstacle_keys_default};

/* the turn that brings z to `axis` */
static Quat turn_from_z(Vec3 axis) {
    Vec3 z = {0.0, 0.0, 1.0}, side = vec3_cross(z, axis);
    double sine = vec3_length(side);
    if (sine < 1e-12) {
        return axis.z > 0.0 ? (Quat){1, 0, 0, 0} : (Quat){0, 1, 0, 0};
    }
    return quat_from_axis_angle(side, atan2(sine, axis.z));
}

/* length along z, or from one end to the other */
static bool read_axis(Reader *reader, const Yaml *map, const SolidKeys *keys, Solid *solid,
                      Pose *pose) {
    bool ends = !isnan(keys->from.x) || !isnan(keys->to.x);
    if (ends == !isnan(keys->length) || isnan(keys->from.x) != isnan(keys->to.x)) {
        return schema_error(reader, map->key, "'%s' needs 'length', or 'from' and 'to'",
                            map->key->text);
    }
    if (!ends) {
        solid->half.z = 0.5 * keys->length;
        return true;
    }
    Vec3 axis = vec3_sub(keys->to, keys->from);
    double length = vec3_length(axis);
    if (length < SMALLEST_SIZE) {
        return schema_error(reader, map->key, "'from' and 'to' are the same point");
    }
    solid->half.z = 0.5 * length;
    pose->shift = vec3_scale(0.5, vec3_add(keys->from, keys->to));
    pose->turn = turn_from_z(vec3_scale(1.0 / length, axis));
    return true;
}

static bool read_box(Reader *reader, const Yaml *map, const SolidKeys *keys, Solid *solid) {
    solid->half = vec3_scale(0.5, keys->size);
    solid->radius = keys->rounding;
    double smallest = fmin(solid->half.x, fmin(solid->half.y, solid->half.z));
    if (smallest < 0.5 * SMALLEST_SIZE) {
        return schema_error(reader, yaml_find(map, "size"),
                            "'size' must be positive, at least "
                            "0.0001 m");
    }
    return keys->rounding <= smallest ||
           schema_error(reader, yaml_find(map, "rounding"),
                        "'rounding' is larger than half of the smallest extent, %g m", smallest);
}

static bool read_solid(Reader *reader, const Yaml *map, SolidKind kind, Solid *solid, Pose *pose) {
    SolidKeys keys;
    solid_keys_default(&keys);
    if (!schema_read(reader, &solid_schemas[kind], map, &keys)) {
        return false;
    }
    solid->kind = kind;
    solid->radius = keys.radius;
    *pose = pose_identity();
    switch (kind) {
    case SOLID_PLANE:
        if (vec3_length(keys.normal) < 1e-9) {
            return schema_error(reader, yaml_find(map, "normal"), "'normal' has no direction");
        }
        pose->turn = turn_from_z(vec3_unit(keys.normal, vec3(0, 0, 1)));
        return true;
    case SOLID_SPHERE:
        return true;
    case SOLID_BOX:
        return read_box(reader, map, &keys, solid);
    case SOLID_CYLINDER:
    case SOLID_CAPSULE:
    case SOLID_CONE:
        return read_axis(reader, map, &keys, solid, pose);
    }
    return false;
}

/* The one solid that is given, SOLID_KIND_COUNT for a mesh; -1 and a report. */
static int find_solid(Reader *reader, const Yaml *map, const ObstacleKeys *keys) {
    int kind = -1;
    for (int i = 0; i <= SOLID_KIND_COUNT; i++) {
        const Yaml *value = i < SOLID_KIND_COUNT ? keys->solids[i] : keys->mesh;
        if (value && kind >= 0) {
            schema_error(reader, value->key, "'%s' and '%s' exclude each other", solid_names[kind],
                         value->key->text);
            return -1;
        }
        kind = value ? i : kind;
    }
    if (kind < 0) {
        schema_error(reader, map->key,
                     "'%s' needs a solid: plane, sphere, box, cylinder, capsule, cone or mesh",
                     report_quote(reader->report, map->key->text));
    }
    return kind;
}

static bool read_mesh(Reader *reader, const Yaml *value, bool animated, ObstacleDef *obstacle) {
    obstacle->mesh = mesh_read(reader, value, animated);
    if (!obstacle->mesh) {
        return false;
    }
    Vec3 far = {0, 0, 0};
    const double *low = obstacle->mesh->low, *high = obstacle->mesh->high;
    far.x = fmax(fabs(low[0]), fabs(high[0]));
    far.y = fmax(fabs(low[1]), fabs(high[1]));
    far.z = fmax(fabs(low[2]), fabs(high[2]));
    obstacle->solid = (Solid){.kind = SOLID_SPHERE, .radius = vec3_length(far)};
    return true;
}

/* A solid at its place: that of its own keys, then `at` and `turn`. */
static bool read_placed(Reader *reader, const Yaml *value, SolidKind kind, ObstacleDef *obstacle) {
    Pose own;
    if (!read_solid(reader, value, kind, &obstacle->solid, &own)) {
        return false;
    }
    obstacle->pose = pose_compose(obstacle->pose, own);
    return true;
}

static bool read_obstacle(Reader *reader, const Yaml *map, ObstacleDef *obstacle) {
    ObstacleKeys keys;
    obstacle_keys_default(&keys);
    bool ok = name_check(reader, map->key, "an obstacle");
    if (!schema_read(reader, &obstacle_schema, map, &keys)) {
        return false;
    }
    *obstacle = keys.obstacle;
    obstacle->name = map->key->text;
    bool file = keys.motion && yaml_is(keys.motion, "file");
    int kind = find_solid(reader, map, &keys);
    if (kind < 0 || (kind == SOLID_KIND_COUNT
                         ? !read_mesh(reader, keys.mesh, file, obstacle)
                         : !read_placed(reader, keys.solids[kind], (SolidKind)kind, obstacle))) {
        return false;
    }
    if (file) {
        return ok && (obstacle->mesh ||
                      schema_error(reader, keys.motion, "only a mesh brings its own motion"));
    }
    MotionKeys motion = {.motion = keys.motion};
    return motion_read(reader, &motion, obstacle->pose.shift, &obstacle->motion) && ok;
}

bool scene_read_obstacles(Reader *reader, const Field *field, const Yaml *value, void *member) {
    Scene *scene = member;
    if (value->kind != YAML_MAP || value->count > MOST_OBSTACLES) {
        return schema_error(reader, value, "'%s' wants a mapping of names to obstacles, found %s",
                            field->key, yaml_describe(value, reader->report));
    }
    scene->obstacles = arena_push(reader->arena, ObstacleDef, value->count);
    bool ok = true;
    for (const Yaml *map = value->first; map; map = map->next) {
        ok = read_obstacle(reader, map, &scene->obstacles[scene->obstacle_count++]) && ok;
    }
    return ok;
}

static void print_solid(FILE *out, int indent, const Solid *solid) {
    fprintf(out, "%*s%s: {", indent, "", solid_names[solid->kind]);
    if (solid->kind == SOLID_BOX) {
        fputs("size: ", out);
        print_vector(out, vec3_scale(2.0, solid->half), "m");
        fputs(", rounding: ", out);
        schema_print_quantity(out, solid->radius, "m");
    } else if (solid->kind != SOLID_PLANE) {
        fputs("radius: ", out);
        schema_print_quantity(out, solid->radius, "m");
    }
    if (solid->kind >= SOLID_CYLINDER) {
        fputs(", length: ", out);
        schema_print_quantity(out, 2.0 * solid->half.z, "m");
    }
    fputs("}\n", out);
}

void scene_print_obstacles(FILE *out, int indent, const Field *field, const void *member) {
    const Scene *scene = member;
    if (scene->obstacle_count > 0) {
        fprintf(out, "%*s%s:\n", indent, "", field->key);
    }
    for (int i = 0; i < scene->obstacle_count; i++) {
        const ObstacleDef *obstacle = &scene->obstacles[i];
        ObstacleKeys keys = {.obstacle = *obstacle};
        fprintf(out, "%*s%s:\n", indent + 2, "", obstacle->name);
        if (obstacle->mesh) {
            mesh_print(out, indent + 4, obstacle->mesh);
        } else {
            print_solid(out, indent + 4, &obstacle->solid);
        }
        schema_print(out, indent + 4, &obstacle_schema, &keys);
        motion_print(out, indent + 4, &obstacle->motion);
    }
}
