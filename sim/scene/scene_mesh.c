#include <string.h>

#include "sim/scene/mesh_import.h"
#include "sim/scene/scene_schema.h"

static const char *const up_names[] = {"auto", "y", "z", NULL}; /* by MeshUp */

typedef struct MeshKeys {
    const char *file;
    double scale; /* [m] */
    int up;
} MeshKeys;

static void mesh_keys_default(void *object) { *(MeshKeys *)object = (MeshKeys){0}; }

static const Field mesh_fields[] = {
    {"file", FIELD_TEXT, offsetof(MeshKeys, file), .required = true,
     .help = ".obj, .ply, .stl, .gltf, .glb or .fbx, beside the scene"},
    {"scale", FIELD_NUMBER, offsetof(MeshKeys, scale), .unit = "m", .min = 1e-9, .max = 1e9,
     .word = "auto", .word_value = 0.0,
     .help = "what 1 in the file means; auto: the format's own, 1 m if it has none"},
    {"up", FIELD_WORD, offsetof(MeshKeys, up), .words = up_names,
     .help = "axis of the file that points up; auto: z for .ply and .stl, y else"},
    {0}};
const Schema mesh_schema = {.name = "mesh",
                            .help = "triangles out of a file",
                            .fields = mesh_fields,
                            .size = sizeof(MeshKeys),
                            .set_default = mesh_keys_default,
                            .shorthand = 1};

const MeshDef *mesh_read(Reader *reader, const Yaml *value, bool animated) {
    const SceneContext *context = scene_context(reader);
    MeshKeys keys = {0};
    if (!schema_read(reader, &mesh_schema, value, &keys)) {
        return NULL;
    }
    Sources sources = context->sources;
    MeshImportDef def = mesh_import_default();
    def.path = source_resolve(&sources, value->place.source, keys.file);
    def.scale = keys.scale;
    def.up = (MeshUp)keys.up;
    def.animated = animated;
    def.rate = context->scene->film.rate;
    def.seconds = context->seconds;
    def.farthest = SCENE_FARTHEST;
    MeshDef *mesh = arena_push(reader->arena, MeshDef, 1);
    Error error = {0};
    const char *quote = report_quote_long(reader->report, keys.file);
    if (!mesh_import(&def, reader->arena, mesh, &error)) {
        report_error(reader->report, value->place, error.code, "mesh '%s': %s", quote, error.text);
        return NULL;
    }
    mesh->file = keys.file;
    for (int i = 0; i < mesh->note_count; i++) {
        report_warning(reader->report, value->place, "mesh '%s': %s", quote, mesh->notes[i]);
    }
    return mesh;
}

/* The comment makes the content of the file a part of the scene's hash. */
void mesh_print(FILE *out, int indent, const MeshDef *mesh) {
    fprintf(out, "%*smesh: {file: ", indent, "");
    schema_print_text(out, mesh->file);
    fputs(", scale: ", out);
    schema_print_quantity(out, mesh->scale, "m");
    fprintf(out, ", up: %s} # content %016llx\n", up_names[mesh->up],
            (unsigned long long)mesh->hash);
    if (mesh->animated) {
        fprintf(out, "%*smotion: file\n", indent, "");
    }
}
