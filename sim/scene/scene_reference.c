/* scene_reference.c: `reference`, the exact places of points at the end of the film. */
#include <math.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define MOST_REFERENCES 1000
#define ON_PANEL 1e-6 /* [m] that a point may lie off the panel */

typedef struct ReferenceKeys {
    const char *cloth, *from;
    double at[2];
    Vec3 is;
} ReferenceKeys;

static const Field reference_fields[] = {
    {"cloth", FIELD_TEXT, offsetof(ReferenceKeys, cloth), .required = true, .help = "its name"},
    {"at", FIELD_POINT, offsetof(ReferenceKeys, at), .unit = "m", .max = SCENE_FARTHEST,
     .required = true, .help = "[u, v] on the panel"},
    {"is", FIELD_VECTOR, offsetof(ReferenceKeys, is), .unit = "m", .max = SCENE_FARTHEST,
     .required = true, .help = "where that point is in the last frame"},
    {"from", FIELD_TEXT, offsetof(ReferenceKeys, from), .help = "who says so"},
    {0}};
const Schema reference_schema = {.name = "reference",
                                 .help = "places that are known exactly, for study",
                                 .fields = reference_fields,
                                 .size = sizeof(ReferenceKeys)};

static bool read_entry(Reader *reader, const Yaml *map, Scene *scene) {
    ReferenceKeys keys = {0};
    if (!schema_read(reader, &reference_schema, map, &keys)) {
        return false;
    }
    ReferenceDef *reference = &scene->references[scene->reference_count];
    *reference = (ReferenceDef){.at = {keys.at[0], keys.at[1]}, .is = keys.is, .from = keys.from};
    const Yaml *name = yaml_find(map, "cloth");
    if (!scene_find_cloth(reader, name, keys.cloth, &reference->cloth)) {
        return false;
    }
    double off = shape_distance(&scene->cloths[reference->cloth].shape, keys.at);
    if (off > ON_PANEL) {
        return schema_error(reader, yaml_find(map, "at"), "this is %.3g m off the panel", off);
    }
    scene->reference_count++;
    return true;
}

bool scene_read_references(Reader *reader, const Field *field, const Yaml *value, void *member) {
    Scene *scene = member;
    bool ok = true;
    if (value->kind != YAML_LIST || value->count > MOST_REFERENCES) {
        return schema_error(reader, value, "'%s' wants a list of at most %d points, found %s",
                            field->key, MOST_REFERENCES, yaml_describe(value, reader->report));
    }
    scene->references = arena_push(reader->arena, ReferenceDef, value->count);
    for (const Yaml *map = value->first; map; map = map->next) {
        ok = read_entry(reader, map, scene) && ok;
    }
    return ok;
}

void scene_print_references(FILE *out, int indent, const Field *field, const void *member) {
    const Scene *scene = member;
    if (scene->reference_count > 0) {
        schema_print_key(out, indent, field->key);
        fputc('\n', out);
    }
    for (int i = 0; i < scene->reference_count; i++) {
        const ReferenceDef *reference = &scene->references[i];
        fprintf(out, "%*s- cloth: %s\n", indent + 2, "", scene->cloths[reference->cloth].name);
        fprintf(out, "%*sat: [", indent + 4, "");
        schema_print_quantity(out, reference->at[0], "m");
        fputs(", ", out);
        schema_print_quantity(out, reference->at[1], "m");
        fprintf(out, "]\n%*sis: ", indent + 4, "");
        print_vector(out, reference->is, "m");
        fputc('\n', out);
        if (reference->from) {
            fprintf(out, "%*sfrom: ", indent + 4, "");
            schema_print_text(out, reference->from);
            fputc('\n', out);
        }
    }
}
