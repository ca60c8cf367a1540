/* glTF 2.0 binary (.glb) with morph targets: web viewers, Blender, Godot, Unity, Windows.
 *
 *   12 bytes "glTF", u32 2, u32 length; chunk u32 length, "JSON", text padded with spaces to 4; chunk
 *   u32 length, "BIN\0", bytes padded with zeros to 4
 *
 * One mesh and node a cloth. The first key frame is the base shape; each other one is a morph target
 * (POSITION and NORMAL, differences from the base). One animation blends from key to key: its weights
 * are a row a key, with a single 1. Metres and y up, as the format demands; time starts at 0.
 * Vertices at the seam of a closed panel are doubled, at the end, for their texture coordinates.
 *
 * Limits: 24 bytes a vertex and key, 4 bytes a key squared; some engines stop at 64 or 256 targets.
 */
#include <stdlib.h>
#include <string.h>

#include "render/export.h"
#include "render/json.h"
#include "render/look.h"
#include "sim/base/memory.h"

#define MOST_BYTES 3.0e9 /* of shapes held in memory, and of the file (its lengths are 32 bits) */
#define FLOAT_TYPE 5126
#define UINT_TYPE 5125

typedef struct Gltf {
    PartFile file;
    size_t number_count; /* coordinates of all bodies: 3 a vertex */
    float *positions;    /* [m] (frame_count x number_count) */
    float *normals;      /* the same */
    double *times;       /* [s] (frame_count) */
    int key_count;
    int *keys; /* (key_count) frames, from 0 */
    /* the binary chunk, and the JSON text about it */
    unsigned char *bytes;
    size_t size;
    FILE *json;
    int accessor_count;
} Gltf;

static bool start(Export *export, Error *error) {
    Gltf *gltf = export->state = arena_push(&export->arena, Gltf, 1);
    for (int i = 0; i < export->body_count; i++) {
        gltf->number_count += 3 * (size_t) export->bodies[i].vertex_count;
    }
    double bytes = 8.0 * (double)gltf->number_count * export->frame_count;
    if (bytes > MOST_BYTES) {
        return error_set(error, EXIT_USAGE,
                         "%d frames need %.1f GB of memory; --frames A-B takes fewer",
                         export->frame_count, 1e-9 * bytes);
    }
    gltf->positions = malloc((size_t)bytes / 2 + 1);
    gltf->normals = malloc((size_t)bytes / 2 + 1);
    gltf->times = arena_push(&export->arena, double, export->frame_count);
    gltf->keys = arena_push(&export->arena, int, export->frame_count);
    if (!gltf->positions || !gltf->normals) {
        return error_set(error, EXIT_IO, "out of memory; --frames A-B takes fewer frames");
    }
    return export_start_file(export, &gltf->file, export->path, error);
}

static bool add(Export *export, Error *error) {
    (void)error;
    Gltf *gltf = export->state;
    size_t at = gltf->number_count * (size_t) export->frame_index;
    gltf->times[export->frame_index] = export->time;
    for (int i = 0; i < export->body_count; i++) {
        const ExportBody *body = &export->bodies[i];
        size_t count = 3 * (size_t)body->vertex_count;
        memcpy(gltf->positions + at, body->position, sizeof(float) * count);
        memcpy(gltf->normals + at, body->normal, sizeof(float) * count);
        at += count;
    }
    return true;
}

/* ---- accessors: what the binary chunk holds, in four views ---- */

enum { VIEW_INDEX, VIEW_VECTOR, VIEW_UV, VIEW_ANIMATION, VIEW_COUNT };

/* Writes one accessor of `count` items; range: of its numbers, NULL where none is wanted. */
static int add_accessor(Gltf *gltf, int view, size_t offset, size_t count, const char *type,
                        int components, const float *range) {
    fprintf(gltf->json,
            "%s{\"bufferView\":%d,\"byteOffset\":%zu,\"componentType\":%d,\"count\":%zu,"
            "\"type\":\"%s\"",
            gltf->accessor_count ? "," : "", view, offset,
            view == VIEW_INDEX ? UINT_TYPE : FLOAT_TYPE, count, type);
    for (int end = 0; range && end < 2; end++) {
        fprintf(gltf->json, ",\"%s\":[", end ? "max" : "min");
        for (int k = 0; k < components; k++) {
            fprintf(gltf->json, "%s%.9g", k ? "," : "", range[end * components + k]);
        }
        fputc(']', gltf->json);
    }
    fputc('}', gltf->json);
    return gltf->accessor_count++;
}

static void find_range(const float *p, size_t count, int components, float *range) {
    for (size_t i = 0; i < count * (size_t)components; i++) {
        float *low = range + i % (size_t)components, *high = low + components;
        *low = i < (size_t)components || p[i] < *low ? p[i] : *low;
        *high = i < (size_t)components || p[i] > *high ? p[i] : *high;
    }
}

/* Sizes of the four views, one after the other. */
static void plan_views(const Export *export, size_t begin[VIEW_COUNT + 1]) {
    const Gltf *gltf = export->state;
    size_t keys = (size_t)gltf->key_count, size[VIEW_COUNT] = {0};
    for (int i = 0; i < export->body_count; i++) {
        const ExportBody *body = &export->bodies[i];
        size[VIEW_INDEX] += 12 * (size_t)body->triangle_count;
        size[VIEW_VECTOR] += 24 * keys * (size_t)body->corners.count;
        size[VIEW_UV] += 8 * (size_t)body->corners.count;
    }
    size[VIEW_ANIMATION] = 4 * keys * keys;
    begin[0] = 0;
    for (int i = 0; i < VIEW_COUNT; i++) {
        begin[i + 1] = begin[i] + size[i];
    }
}

/* One vector field of a body at a key, as a difference from the base when key > 0. */
static int add_vectors(Gltf *gltf, const ExportBody *body, const float *all, size_t first, int key,
                       bool ranged, size_t view_begin, size_t *offset) {
    const float *base = all + first + gltf->number_count * (size_t)gltf->keys[0];
    const float *now = all + first + gltf->number_count * (size_t)gltf->keys[key];
    size_t count = (size_t)body->corners.count;
    float *out = (float *)(void *)(gltf->bytes + view_begin + *offset), range[6] = {0};
    for (size_t i = 0; i < count; i++) {
        size_t from = 3 * (size_t)body->corners.vertex[i];
        for (size_t k = 0; k < 3; k++) {
            out[3 * i + k] = now[from + k] - (key > 0 ? base[from + k] : 0.0f);
        }
    }
    find_range(out, count, 3, range);
    int number = add_accessor(gltf, VIEW_VECTOR, *offset, count, "VEC3", 3, ranged ? range : NULL);
    *offset += 12 * count;
    return number;
}

/* What the accessors of the bodies are, in the order in which they are added: indices, uv, then
 * position and normal of each key. */
static void add_bodies(Export *export, const size_t begin[VIEW_COUNT + 1]) {
    Gltf *gltf = export->state;
    size_t index = 0, vector = 0, uv = 0, first = 0;
    for (int i = 0; i < export->body_count; i++) {
        const ExportBody *body = &export->bodies[i];
        size_t corners = (size_t)body->corners.count, triangles = (size_t)body->triangle_count;
        memcpy(gltf->bytes + begin[VIEW_INDEX] + index, body->corners.triangles, 12 * triangles);
        add_accessor(gltf, VIEW_INDEX, index, 3 * triangles, "SCALAR", 1, NULL);
        index += 12 * triangles;
        float *to = (float *)(void *)(gltf->bytes + begin[VIEW_UV] + uv);
        for (size_t n = 0; n < corners; n++) { /* v points down in glTF */
            to[2 * n] = body->corners.uv[2 * n];
            to[2 * n + 1] = 1.0f - body->corners.uv[2 * n + 1];
        }
        add_accessor(gltf, VIEW_UV, uv, corners, "VEC2", 2, NULL);
        uv += 8 * corners;
        for (int key = 0; key < gltf->key_count; key++) {
            add_vectors(gltf, body, gltf->positions, first, key, true, begin[VIEW_VECTOR], &vector);
            add_vectors(gltf, body, gltf->normals, first, key, false, begin[VIEW_VECTOR], &vector);
        }
        first += 3 * (size_t)body->vertex_count;
    }
}

/* Times of the keys, then the weights: row r is key r, its column r - 1 is 1. */
static void add_animation(Gltf *gltf, const size_t begin[VIEW_COUNT + 1]) {
    size_t keys = (size_t)gltf->key_count, targets = keys - 1;
    float *out = (float *)(void *)(gltf->bytes + begin[VIEW_ANIMATION]), range[2] = {0};
    for (size_t i = 0; i < keys; i++) {
        out[i] = (float)(gltf->times[gltf->keys[i]] - gltf->times[gltf->keys[0]]);
        if (i > 0) {
            out[keys + targets * i + i - 1] = 1.0f;
        }
    }
    find_range(out, keys, 1, range);
    add_accessor(gltf, VIEW_ANIMATION, 0, keys, "SCALAR", 1, range);
    add_accessor(gltf, VIEW_ANIMATION, 4 * keys, keys * targets, "SCALAR", 1, NULL);
}

/* ---- the text ---- */

static void write_mesh(const Gltf *gltf, const ExportBody *body, int material, int first) {
    FILE *out = gltf->json;
    fputs("{\"name\":", out);
    json_string(out, body->name);
    fprintf(out,
            ",\"extras\":{\"panel_m\":[%.9g,%.9g]},\"primitives\":[{\"material\":%d,\"indices\":%d,"
            "\"attributes\":{\"POSITION\":%d,\"NORMAL\":%d,\"TEXCOORD_0\":%d}",
            body->panel[0], body->panel[1], material, first, first + 2, first + 3, first + 1);
    for (int key = 1; key < gltf->key_count; key++) {
        fprintf(out, "%s{\"POSITION\":%d,\"NORMAL\":%d}", key > 1 ? "," : ",\"targets\":[",
                first + 2 + 2 * key, first + 3 + 2 * key);
    }
    fputs(gltf->key_count > 1 ? "]}]" : "}]", out);
    for (int key = 1; key < gltf->key_count; key++) {
        fputs(key > 1 ? ",0" : ",\"weights\":[0", out);
    }
    fputs(gltf->key_count > 1 ? "]}" : "}", out);
}

static void write_material(FILE *out, const char *name) {
    const Look *look = look_find(name, NULL);
    float color[3] = {0.5f, 0.5f, 0.5f};
    for (int k = 0; look && k < 3; k++) {
        color[k] = 0.5f * (look->warp[k] + look->weft[k]);
    }
    fputs("{\"name\":", out);
    json_string(out, name);
    fprintf(
        out,
        ",\"doubleSided\":true,\"pbrMetallicRoughness\":{\"baseColorFactor\":[%.4g,%.4g,%.4g,1],"
        "\"metallicFactor\":0,\"roughnessFactor\":0.9}}",
        color[0], color[1], color[2]);
}

static void write_views(const Gltf *gltf, const size_t begin[VIEW_COUNT + 1]) {
    static const char *const more[VIEW_COUNT] = {",\"target\":34963",
                                                 ",\"byteStride\":12,\"target\":34962",
                                                 ",\"byteStride\":8,\"target\":34962", ""};
    int count = gltf->key_count > 1 ? VIEW_COUNT : VIEW_ANIMATION;
    fputs(",\"bufferViews\":[", gltf->json);
    for (int i = 0; i < count; i++) {
        fprintf(gltf->json, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu%s}",
                i ? "," : "", begin[i], begin[i + 1] - begin[i], more[i]);
    }
    fprintf(gltf->json, "],\"buffers\":[{\"byteLength\":%zu}]", gltf->size);
}

static void write_scene(const Export *export) {
    Gltf *gltf = export->state;
    FILE *out = gltf->json;
    int bodies = export->body_count, each = 2 + 2 * gltf->key_count;
    fputs(",\"scene\":0,\"scenes\":[{\"nodes\":[", out);
    for (int i = 0; i < bodies; i++) {
        fprintf(out, "%s%d", i ? "," : "", i);
    }
    fputs("]}],\"nodes\":[", out);
    for (int i = 0; i < bodies; i++) {
        fprintf(out, "%s{\"mesh\":%d,\"name\":", i ? "," : "", i);
        json_string(out, export->bodies[i].name);
        fputc('}', out);
    }
    fputs("],\"meshes\":[", out);
    for (int i = 0; i < bodies; i++) {
        fputs(i ? "," : "", out);
        write_mesh(gltf, &export->bodies[i], i, i * each);
    }
    fputs("],\"materials\":[", out);
    for (int i = 0; i < bodies; i++) {
        fputs(i ? "," : "", out);
        write_material(out, export->bodies[i].look);
    }
    fputc(']', out);
    if (gltf->key_count > 1) {
        fprintf(out,
                ",\"animations\":[{\"name\":\"cloth\",\"samplers\":[{\"input\":%d,\"output\":%d,"
                "\"interpolation\":\"LINEAR\"}],\"channels\":[",
                bodies * each, bodies * each + 1);
        for (int i = 0; i < bodies; i++) {
            fprintf(out, "%s{\"sampler\":0,\"target\":{\"node\":%d,\"path\":\"weights\"}}",
                    i ? "," : "", i);
        }
        fputs("]}]", out);
    }
}

static void write_text(Export *export, const size_t begin[VIEW_COUNT + 1]) {
    Gltf *gltf = export->state;
    fprintf(gltf->json,
            "{\"asset\":{\"version\":\"2.0\",\"generator\":\"toile\",\"extras\":{\"scene_hash\":"
            "\"%016llx\",\"first_frame\":%d,\"first_time\":%.9g}},\"accessors\":[",
            (unsigned long long)export->header->scene_hash, export->frame - export->frame_index,
            gltf->times[0]);
    add_bodies(export, begin);
    if (gltf->key_count > 1) {
        add_animation(gltf, begin);
    }
    fputc(']', gltf->json);
    write_views(gltf, begin);
    write_scene(export);
    fputc('}', gltf->json);
}

/* ---- the file ---- */

static void put_u32(FILE *out, size_t value) {
    uint32_t word = (uint32_t)value;
    fwrite(&word, sizeof word, 1, out);
}

static void write_chunks(const Gltf *gltf, const char *text, size_t length) {
    FILE *out = gltf->file.out;
    size_t text_pad = (4 - length % 4) % 4, pad = (4 - gltf->size % 4) % 4;
    fwrite("glTF", 1, 4, out);
    put_u32(out, 2);
    put_u32(out, 12 + 8 + length + text_pad + 8 + gltf->size + pad);
    put_u32(out, length + text_pad);
    fwrite("JSON", 1, 4, out);
    fwrite(text, 1, length, out);
    fwrite("   ", 1, text_pad, out);
    put_u32(out, gltf->size + pad);
    fwrite("BIN", 1, 4, out);
    fwrite(gltf->bytes, 1, gltf->size, out);
    fwrite("\0\0", 1, pad, out);
}

static bool choose_keys(Export *export, Error *error) {
    Gltf *gltf = export->state;
    int frames = export->frame_count, wanted = export->def->keys;
    gltf->key_count = wanted < frames ? wanted : frames;
    double miss = 0.0;
    if (frames > 1) {
        miss = export_choose_keys(gltf->positions, gltf->times, frames, gltf->number_count,
                                  gltf->key_count, gltf->keys);
    }
    snprintf(export->note, sizeof export->note,
             "%d of %d frames are keys; between them the shape is at most %.3g mm off",
             gltf->key_count, frames, 1e3 * miss);
    size_t begin[VIEW_COUNT + 1];
    plan_views(export, begin);
    gltf->size = begin[gltf->key_count > 1 ? VIEW_COUNT : VIEW_ANIMATION];
    return (double)gltf->size <= MOST_BYTES ||
           error_set(error, EXIT_USAGE, "%d keys make %.1f GB, too much for glTF; --keys N",
                     gltf->key_count, 1e-9 * (double)gltf->size);
}

static bool finish(Export *export, Error *error) {
    Gltf *gltf = export->state;
    size_t begin[VIEW_COUNT + 1], length = 0;
    char *text = NULL;
    if (!choose_keys(export, error)) {
        return false;
    }
    plan_views(export, begin);
    gltf->bytes = memory_zeroed(1, gltf->size);
    gltf->json = open_memstream(&text, &length);
    ASSERT(gltf->json);
    write_text(export, begin);
    fclose(gltf->json);
    write_chunks(gltf, text, length);
    free(text);
    return file_finish(&gltf->file, error);
}

static void abandon(Export *export) {
    Gltf *gltf = export->state;
    if (gltf) {
        file_abandon(&gltf->file);
        free(gltf->positions);
        free(gltf->normals);
        free(gltf->bytes);
    }
}

const ExportFormat export_gltf = {
    .name = "gltf",
    .about = "glTF 2.0 (.glb) with morph targets, metres, y up: web viewers, Blender, engines",
    .ending = "glb",
    .up = 'y',
    .fixed_up = true,
    .one_mesh = true,
    .start = start,
    .add = add,
    .finish = finish,
    .abandon = abandon,
};
