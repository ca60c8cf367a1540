/* scene_cloth_mesh.c: cloth out of a file: where it starts by positions, what it is at rest by (u, v). */
#include <math.h>

#include "sim/scene/mesh_import.h"
#include "sim/scene/scene_schema.h"

static const char *const up_names[] = {"auto", "y", "z", NULL}; /* by MeshUp */

/* A sheet that starts stretched or squeezed this much in area is doubtful. */
#define DOUBTFUL_AREA 1.5

typedef struct ClothMeshKeys {
    const char *file;
    double scale, uv; /* [m] */
    int up;
} ClothMeshKeys;

static void set_default(void *object) { *(ClothMeshKeys *)object = (ClothMeshKeys){.uv = 1.0}; }

static const Field fields[] = {
    {"file", FIELD_TEXT, offsetof(ClothMeshKeys, file), .required = true,
     .help = ".obj, .ply, .gltf, .glb or .fbx, with texture coordinates"},
    {"scale", FIELD_NUMBER, offsetof(ClothMeshKeys, scale), .unit = "m", .min = 1e-9, .max = 1e9,
     .word = "auto", .word_value = 0.0, .help = "what 1 in its positions means, as for obstacles"},
    {"uv", FIELD_NUMBER, offsetof(ClothMeshKeys, uv), .unit = "m", .min = 1e-9, .max = 1e9,
     .help = "what 1 in its texture coordinates means: u is warp, v weft of the flat cloth"},
    {"up", FIELD_WORD, offsetof(ClothMeshKeys, up), .words = up_names,
     .help = "axis of the file that points up; auto: z for .ply, y else"},
    {0}};
const Schema cloth_mesh_schema = {.name = "mesh",
                                  .help = "triangles out of a file",
                                  .fields = fields,
                                  .size = sizeof(ClothMeshKeys),
                                  .set_default = set_default,
                                  .shorthand = 1};

/* [m2] of a triangle in (u, v), negative when it is turned over there */
static double area_in_uv(const MeshDef *mesh, int t) {
    const double *uv = mesh->frames + 3 * (size_t)mesh->vertex_count;
    const int32_t *n = mesh->triangles + 3 * (size_t)t;
    const double *a = uv + 3 * (size_t)n[0], *b = uv + 3 * (size_t)n[1], *c = uv + 3 * (size_t)n[2];
    return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

double cloth_mesh_area(const MeshDef *mesh) {
    double area = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        area += fabs(area_in_uv(mesh, t));
    }
    return area;
}

void cloth_mesh_extents(const MeshDef *mesh, double extents[2]) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < mesh->vertex_count; i++) {
        const double *uv = mesh->frames + 3 * (size_t)(mesh->vertex_count + i);
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], uv[k]), high[k] = fmax(high[k], uv[k]);
        }
    }
    extents[0] = high[0] - low[0], extents[1] = high[1] - low[1];
}

static double area_at_start(const MeshDef *mesh) {
    double area = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *n = mesh->triangles + 3 * (size_t)t;
        Vec3 a = vec3_load(mesh->frames + 3 * (size_t)n[0]);
        Vec3 b = vec3_load(mesh->frames + 3 * (size_t)n[1]);
        Vec3 c = vec3_load(mesh->frames + 3 * (size_t)n[2]);
        area += 0.5 * vec3_length(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
    }
    return area;
}

bool cloth_mesh_read(Reader *reader, const Yaml *value, ShapeDef *shape) {
    ClothMeshKeys keys = {.uv = 1.0};
    if (!schema_read(reader, &cloth_mesh_schema, value, &keys)) {
        return false;
    }
    Sources sources = scene_context(reader)->sources;
    MeshImportDef def = mesh_import_default();
    def.path = source_resolve(&sources, value->place.source, keys.file);
    def.scale = keys.scale, def.uv = keys.uv, def.up = (MeshUp)keys.up;
    def.farthest = SCENE_FARTHEST;
    MeshDef *mesh = arena_push(reader->arena, MeshDef, 1);
    Error error = {0};
    const char *quote = report_quote_long(reader->report, keys.file);
    if (!mesh_import(&def, reader->arena, mesh, &error)) {
        report_error(reader->report, value->place, error.code, "mesh '%s': %s", quote, error.text);
        return false;
    }
    mesh->file = keys.file;
    shape->mesh = mesh, shape->uv = keys.uv;
    double ratio = area_at_start(mesh) / cloth_mesh_area(mesh);
    if (ratio > DOUBTFUL_AREA || ratio < 1.0 / DOUBTFUL_AREA) {
        report_warning(reader->report, value->place,
                       "mesh '%s': it starts with %.3g times the area that it has at rest; is 'uv' "
                       "right?",
                       quote, ratio);
    }
    return true;
}

/* The comment makes the content of the file a part of the scene's hash. */
void cloth_mesh_print(FILE *out, int indent, const ShapeDef *shape) {
    fprintf(out, "%*sfile: ", indent, "");
    schema_print_text(out, shape->mesh->file);
    fprintf(out, " # content %016llx\n%*sscale: ", (unsigned long long)shape->mesh->hash, indent,
            "");
    schema_print_quantity(out, shape->mesh->scale, "m");
    fprintf(out, "\n%*suv: ", indent, "");
    schema_print_quantity(out, shape->uv, "m");
    fprintf(out, "\n%*sup: %s\n", indent, "", up_names[shape->mesh->up]);
}
