/* OBJ with a point cache beside it: Blender (modifier Mesh Cache), Houdini, 3ds Max, Modo.
 * One pair a cloth, FOLDER/CLOTH.obj and FOLDER/CLOTH.pc2 or .mdd.
 *
 * OBJ: the rest shape; v x y z, vt u v (0..1 over the panel), f v/vt, from 1. No normals: they would
 * be those of the rest shape for ever; programs make their own.
 *
 * PC2, little-endian:  0 char[12] "POINTCACHE2\0", 12 i32 version 1, 16 i32 vertices, 20 f32 start,
 *   24 f32 step (both [s], or frames), 28 i32 frames, 32 f32 xyz[frames][vertices]
 * MDD, big-endian:  i32 frames, i32 vertices, f32 time[frames] [s], f32 xyz[frames][vertices]
 */
#include <stdlib.h>
#include <string.h>

#include "render/export.h"

#define PC2_HEAD 32 /* [byte] */

typedef struct Caches {
    PartFile *files; /* (count) one a body */
    int count;
    bool big_endian;
} Caches;

static void put(FILE *out, const void *word, bool big_endian) {
    unsigned char bytes[4];
    memcpy(bytes, word, 4);
    for (int i = 0; i < 4; i++) { /* the machine is little-endian, as the states file demands */
        putc(bytes[big_endian ? 3 - i : i], out);
    }
}

static void put_int(FILE *out, int value, bool big_endian) {
    int32_t word = value;
    put(out, &word, big_endian);
}

static void put_float(FILE *out, double value, bool big_endian) {
    float word = (float)value;
    put(out, &word, big_endian);
}

static void write_obj(const Export *export, const ExportBody *body, FILE *out) {
    fprintf(out, "# toile: cloth '%s' at rest, unit %s, %c up; u, v 0..1 over %.9g x %.9g m\n",
            body->name, export->def->unit, export->up, body->panel[0], body->panel[1]);
    fprintf(out, "o %s\n", body->name);
    for (int i = 0; i < body->vertex_count; i++) {
        const float *p = body->rest + 3 * (size_t)i;
        fprintf(out, "v %.9g %.9g %.9g\n", p[0], p[1], p[2]);
    }
    const ExportCorners *corners = &body->corners;
    for (int i = 0; i < corners->count; i++) {
        fprintf(out, "vt %.9g %.9g\n", corners->uv[2 * (size_t)i], corners->uv[2 * (size_t)i + 1]);
    }
    for (size_t t = 0; t < 3 * (size_t)body->triangle_count; t += 3) {
        const int32_t *v = body->triangles + t, *c = corners->triangles + t;
        fprintf(out, "f %d/%d %d/%d %d/%d\n", v[0] + 1, c[0] + 1, v[1] + 1, c[1] + 1, v[2] + 1,
                c[2] + 1);
    }
}

static void write_head(const Export *export, const ExportBody *body, bool mdd, FILE *out) {
    if (mdd) {
        put_int(out, export->frame_count, true);
        put_int(out, body->vertex_count, true);
        for (int i = 0; i < export->frame_count; i++) {
            put_float(out, export->time + i / export->rate, true);
        }
        return;
    }
    bool frames = export->def->pc2_frames;
    fwrite("POINTCACHE2", 1, 12, out);
    put_int(out, 1, false);
    put_int(out, body->vertex_count, false);
    put_float(out, frames ? export->frame : export->time, false);
    put_float(out, frames ? 1.0 : 1.0 / export->rate, false);
    put_int(out, export->frame_count, false);
}

static bool start_body(Export *export, Caches *caches, int index, Error *error) {
    const ExportBody *body = &export->bodies[index];
    const char *ending = caches->big_endian ? "mdd" : "pc2";
    char path[FILE_PATH_SIZE + STATE_WORD_SIZE + 8];
    PartFile obj = {0};
    snprintf(path, sizeof path, "%s/%s.%s", export->path, body->name, ending);
    if (!export_start_file(export, &caches->files[index], path, error)) {
        return false;
    }
    caches->count = index + 1;
    write_head(export, body, caches->big_endian, caches->files[index].out);
    snprintf(path, sizeof path, "%s/%s.obj", export->path, body->name);
    if (!export_start_file(export, &obj, path, error)) {
        return false;
    }
    write_obj(export, body, obj.out);
    return file_finish(&obj, error);
}

static bool start(Export *export, bool big_endian, Error *error) {
    Caches *caches = export->state = arena_push(&export->arena, Caches, 1);
    caches->files = arena_push(&export->arena, PartFile, export->body_count);
    caches->big_endian = big_endian;
    bool good = true;
    for (int i = 0; good && i < export->body_count; i++) {
        good = start_body(export, caches, i, error);
    }
    return good;
}

static bool start_pc2(Export *export, Error *error) { return start(export, false, error); }
static bool start_mdd(Export *export, Error *error) { return start(export, true, error); }

static bool add(Export *export, Error *error) {
    const Caches *caches = export->state;
    for (int i = 0; i < caches->count; i++) {
        const ExportBody *body = &export->bodies[i];
        FILE *out = caches->files[i].out;
        for (int n = 0; n < 3 * body->vertex_count; n++) {
            put(out, &body->position[n], caches->big_endian);
        }
        if (ferror(out)) {
            return error_set_errno(error, EXIT_IO, "%s", caches->files[i].path);
        }
    }
    return true;
}

static bool finish(Export *export, Error *error) {
    Caches *caches = export->state;
    for (int i = 0; i < caches->count; i++) {
        long long vertices = export->bodies[i].vertex_count, frames = export->frame_count;
        long long head = caches->big_endian ? 8 + 4 * frames : PC2_HEAD;
        long long size = ftello(caches->files[i].out);
        if (size != head + 12 * vertices * frames) {
            return error_set_errno(error, EXIT_IO, "%s: %lld bytes are missing",
                                   caches->files[i].path, head + 12 * vertices * frames - size);
        }
        if (!file_finish(&caches->files[i], error)) {
            return false;
        }
    }
    return true;
}

static void abandon(Export *export) {
    Caches *caches = export->state;
    for (int i = 0; caches && i < caches->count; i++) {
        file_abandon(&caches->files[i]);
    }
}

const ExportFormat export_obj_pc2 = {
    .name = "obj-pc2",
    .about = "folder of CLOTH.obj and CLOTH.pc2: Blender (Mesh Cache), Houdini, 3ds Max",
    .up = 'z',
    .one_mesh = true,
    .start = start_pc2,
    .add = add,
    .finish = finish,
    .abandon = abandon,
};

const ExportFormat export_obj_mdd = {
    .name = "obj-mdd",
    .about = "folder of CLOTH.obj and CLOTH.mdd: the same as LightWave's point cache",
    .up = 'z',
    .one_mesh = true,
    .start = start_mdd,
    .add = add,
    .finish = finish,
    .abandon = abandon,
};
