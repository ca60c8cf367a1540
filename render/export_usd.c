/* USD as text (.usda): one Mesh a cloth with points, normals and extent sampled at every frame;
 * time codes are frame numbers. Houdini, Blender, Omniverse, usdview.
 *
 * Points of a mesh come before its normals, and each frame brings both: so each goes to a temporary
 * file, and the parts are joined at the end.
 */
#include <stdlib.h>
#include <string.h>

#include "render/export.h"

enum { POINTS, NORMALS, EXTENT, SAMPLED };

static const char *const sampled[SAMPLED] = {"point3f[] points", "normal3f[] normals",
                                             "float3[] extent"};

typedef struct Usd {
    PartFile file;
    FILE **samples; /* (body_count x SAMPLED) */
    int sample_count, first, last;
} Usd;

static void put_vectors(FILE *out, int frame, const float *p, int count) {
    fprintf(out, "            %d: [", frame);
    for (int i = 0; i < count; i++) {
        fprintf(out, "%s(%.9g, %.9g, %.9g)", i ? ", " : "", p[3 * (size_t)i], p[3 * (size_t)i + 1],
                p[3 * (size_t)i + 2]);
    }
    fputs("],\n", out);
}

static void find_extent(const ExportBody *body, float extent[6]) {
    memcpy(extent, body->position, 3 * sizeof *extent);
    memcpy(extent + 3, body->position, 3 * sizeof *extent);
    for (size_t i = 0; i < 3 * (size_t)body->vertex_count; i++) {
        float p = body->position[i];
        extent[i % 3] = p < extent[i % 3] ? p : extent[i % 3];
        extent[3 + i % 3] = p > extent[3 + i % 3] ? p : extent[3 + i % 3];
    }
}

static bool start(Export *export, Error *error) {
    Usd *usd = export->state = arena_push(&export->arena, Usd, 1);
    usd->samples = arena_push(&export->arena, FILE *, SAMPLED * (size_t) export->body_count);
    usd->first = export->frame;
    if (!export_start_file(export, &usd->file, export->path, error)) {
        return false;
    }
    for (int i = 0; i < SAMPLED * export->body_count; i++) {
        usd->samples[i] = tmpfile();
        if (!usd->samples[i]) {
            return error_set_errno(error, EXIT_IO, "a temporary file");
        }
        usd->sample_count++;
    }
    return true;
}

static bool add(Export *export, Error *error) {
    Usd *usd = export->state;
    usd->last = export->frame;
    for (int i = 0; i < export->body_count; i++) {
        const ExportBody *body = &export->bodies[i];
        FILE **samples = usd->samples + SAMPLED * i;
        float extent[6];
        find_extent(body, extent);
        put_vectors(samples[POINTS], export->frame, body->position, body->vertex_count);
        put_vectors(samples[NORMALS], export->frame, body->normal, body->vertex_count);
        put_vectors(samples[EXTENT], export->frame, extent, 2);
        if (ferror(samples[POINTS]) || ferror(samples[NORMALS])) {
            return error_set_errno(error, EXIT_IO, "a temporary file");
        }
    }
    return true;
}

static bool copy(FILE *from, FILE *to, Error *error) {
    char buffer[65536];
    size_t size;
    bool good = fflush(from) == 0 && fseeko(from, 0, SEEK_SET) == 0;
    while (good && (size = fread(buffer, 1, sizeof buffer, from)) > 0) {
        good = fwrite(buffer, 1, size, to) == size;
    }
    return (good && !ferror(from)) || error_set_errno(error, EXIT_IO, "a temporary file");
}

static void write_corners(const ExportBody *body, FILE *out) {
    const ExportCorners *corners = &body->corners;
    fputs("        texCoord2f[] primvars:st = [", out);
    for (int i = 0; i < corners->count; i++) {
        fprintf(out, "%s(%.9g, %.9g)", i ? ", " : "", corners->uv[2 * (size_t)i],
                corners->uv[2 * (size_t)i + 1]);
    }
    fputs("] (\n            interpolation = \"faceVarying\"\n        )\n"
          "        int[] primvars:st:indices = [",
          out);
    for (size_t i = 0; i < 3 * (size_t)body->triangle_count; i++) {
        fprintf(out, "%s%d", i ? ", " : "", corners->triangles[i]);
    }
    fputs("]\n", out);
}

static bool write_body(const ExportBody *body, FILE *const samples[SAMPLED], FILE *out,
                       Error *error) {
    /* the names of USD have no minus and begin with no digit */
    char name[STATE_WORD_SIZE + 8];
    snprintf(name, sizeof name, "%s%s",
             body->name[0] >= '0' && body->name[0] <= '9' ? "cloth_" : "", body->name);
    for (char *c = name; *c; c++) {
        *c = *c == '-' ? '_' : *c;
    }
    fprintf(out,
            "    def Mesh \"%s\"\n    {\n        uniform token subdivisionScheme = \"none\"\n"
            "        bool doubleSided = 1\n        int[] faceVertexCounts = [",
            name);
    for (int i = 0; i < body->triangle_count; i++) {
        fputs(i ? ", 3" : "3", out);
    }
    fputs("]\n        int[] faceVertexIndices = [", out);
    for (size_t i = 0; i < 3 * (size_t)body->triangle_count; i++) {
        fprintf(out, "%s%d", i ? ", " : "", body->triangles[i]);
    }
    fputs("]\n", out);
    write_corners(body, out);
    for (int k = 0; k < SAMPLED; k++) {
        fprintf(out, "        %s.timeSamples = {\n", sampled[k]);
        if (!copy(samples[k], out, error)) {
            return false;
        }
        fputs("        }\n", out);
    }
    fputs("        normal3f[] normals (\n            interpolation = \"vertex\"\n        )\n    "
          "}\n\n",
          out);
    return true;
}

static bool finish(Export *export, Error *error) {
    Usd *usd = export->state;
    FILE *out = usd->file.out;
    fprintf(out,
            "#usda 1.0\n(\n    doc = \"toile\"\n    defaultPrim = \"World\"\n"
            "    metersPerUnit = %.9g\n    upAxis = \"%c\"\n    timeCodesPerSecond = %.9g\n"
            "    framesPerSecond = %.9g\n    startTimeCode = %d\n    endTimeCode = %d\n)\n\n"
            "def Xform \"World\"\n{\n",
            1.0 / export->def->scale, export->up - 'a' + 'A', export->rate, export->rate,
            usd->first, usd->last);
    for (int i = 0; i < export->body_count; i++) {
        if (!write_body(&export->bodies[i], usd->samples + SAMPLED * i, out, error)) {
            return false;
        }
    }
    fputs("}\n", out);
    return file_finish(&usd->file, error);
}

static void abandon(Export *export) {
    Usd *usd = export->state;
    for (int i = 0; usd && i < usd->sample_count; i++) {
        fclose(usd->samples[i]);
    }
    if (usd) {
        file_abandon(&usd->file);
    }
}

const ExportFormat export_usd = {
    .name = "usd",
    .about = "text (.usda) with a sample of points and normals at each frame: Houdini, Omniverse",
    .ending = "usda",
    .up = 'z',
    .one_mesh = true,
    .start = start,
    .add = add,
    .finish = finish,
    .abandon = abandon,
};
