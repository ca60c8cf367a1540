/* Bodies and frames of an export: axes, units, normals, corners at seams. */
#include "render/export.h"

#include <ctype.h>
#include <string.h>
#include <sys/stat.h>

#include "sim/base/text.h"

const ExportFormat *const export_formats[] = {
    &export_obj_pc2, &export_obj_mdd, &export_ply, &export_vtp, &export_gltf, &export_usd, NULL,
};

ExportDef export_default(void) { return (ExportDef){.unit = "m", .scale = 1.0, .keys = 60}; }

const ExportFormat *export_format_find(const char *name, Error *error) {
    const char *names[16] = {0};
    for (int i = 0; export_formats[i]; i++) {
        names[i] = export_formats[i]->name;
        if (strcmp(name, names[i]) == 0) {
            return export_formats[i];
        }
    }
    const char *near = text_nearest(name, names);
    error_set(error, EXIT_USAGE, "--as %s: expected obj-pc2, obj-mdd, ply, vtp, gltf or usd%s%s%s",
              name, near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
    return NULL;
}

/* ---- numbers for the file ---- */

/* Turns a vector into the file's axes and rounds it; false when it does not fit. */
static bool place(const Export *export, double scale, const double p[3], float out[3]) {
    double q[3] = {scale * p[0], scale * p[1], scale * p[2]};
    if (export->up == 'y') { /* right-handed: x stays, z goes up */
        double z = q[2];
        q[2] = -q[1];
        q[1] = z;
    }
    for (int k = 0; k < 3; k++) {
        out[k] = (float)q[k];
        if (!isfinite(out[k])) {
            return false;
        }
    }
    return true;
}

static bool place_all(const Export *export, double scale, const double *p, int count, float *out,
                      const char *what, Error *error) {
    for (int i = 0; i < count; i++) {
        if (!place(export, scale, p + 3 * (size_t)i, out + 3 * (size_t)i)) {
            return error_set(error, EXIT_BAD_INPUT, "%s of vertex %d is too large for a file", what,
                             i);
        }
    }
    return true;
}

/* ---- bodies ---- */

static void name_body(Export *export, int index, const char *name) {
    char *out = export->bodies[index].name;
    snprintf(out, STATE_WORD_SIZE, "%s", name);
    for (char *c = out; *c; c++) {
        *c = isalnum((unsigned char)*c) || *c == '-' || *c == '_' ? *c : '_';
    }
    for (int i = 0; i < index; i++) {
        if (strcmp(export->bodies[i].name, out) == 0) { /* two names that only differed in signs */
            snprintf(out, STATE_WORD_SIZE, "cloth_%d", index);
        }
    }
}

/* Corners of triangles across the seam of a closed panel whose u is small get twins, one period
 * further on. */
static void split_seam(const ExportBody *body, ExportCorners *corners, Arena *arena) {
    double period = body->mesh.period;
    size_t triangle_numbers = 3 * (size_t)body->triangle_count;
    int32_t *vertex = arena_push(arena, int32_t, 2 * (size_t)body->vertex_count);
    int32_t *twin = arena_push(arena, int32_t, body->vertex_count);
    int32_t *triangles = arena_push(arena, int32_t, triangle_numbers);
    memcpy(triangles, body->triangles, triangle_numbers * sizeof *triangles);
    for (int i = 0; i < body->vertex_count; i++) {
        vertex[i] = i;
    }
    corners->count = body->vertex_count;
    for (size_t t = 0; period > 0.0 && t < triangle_numbers; t += 3) {
        double low = INFINITY, high = -INFINITY;
        for (int k = 0; k < 3; k++) {
            double u = body->mesh.uv[2 * (size_t)triangles[t + k]];
            low = fmin(low, u);
            high = fmax(high, u);
        }
        for (int k = 0; high - low > 0.5 * period && k < 3; k++) {
            int32_t i = triangles[t + k];
            if (high - body->mesh.uv[2 * (size_t)i] < 0.5 * period) {
                continue;
            }
            if (!twin[i]) {
                twin[i] = corners->count;
                vertex[corners->count++] = i;
            }
            triangles[t + k] = twin[i];
        }
    }
    corners->vertex = vertex;
    corners->triangles = triangles;
}

static void set_corners(ExportBody *body, const double corner[2], Arena *arena) {
    ExportCorners *corners = &body->corners;
    split_seam(body, corners, arena);
    float *uv = arena_push(arena, float, 2 * (size_t)corners->count);
    for (int i = 0; i < corners->count; i++) {
        const double *at = body->mesh.uv + 2 * (size_t)corners->vertex[i];
        double u = at[0] + (i < body->vertex_count ? 0.0 : body->mesh.period);
        uv[2 * (size_t)i] = (float)((u - corner[0]) / body->panel[0]);
        uv[2 * (size_t)i + 1] = (float)((at[1] - corner[1]) / body->panel[1]);
    }
    corners->uv = uv;
}

/* Box of the panel, from its vertices. */
static void set_panel(ExportBody *body, double corner[2]) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < body->vertex_count; i++) {
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], body->mesh.uv[2 * (size_t)i + k]);
            high[k] = fmax(high[k], body->mesh.uv[2 * (size_t)i + k]);
        }
    }
    for (int k = 0; k < 2; k++) {
        body->panel[k] = high[k] > low[k] ? high[k] - low[k] : 1.0;
        corner[k] = low[k];
    }
    if (body->mesh.period > 0.0) {
        body->panel[0] = body->mesh.period;
    }
}

static void set_body(Export *export, const StateLayout *layout, int index) {
    ExportBody *body = &export->bodies[index];
    Arena *arena = &export->layout;
    body->look = export->header->cloths[index].look;
    body->vertex_begin = layout->vertex_begin[index];
    body->mesh = field_mesh_create(layout, index, arena);
    body->vertex_count = body->mesh.vertex_count;
    body->triangle_count = body->mesh.triangle_count;
    body->triangles = body->mesh.triangles;
    double corner[2];
    set_panel(body, corner);
    set_corners(body, corner, arena);
    size_t numbers = 3 * (size_t)body->vertex_count;
    body->rest = arena_push(arena, float, numbers);
    body->position = arena_push(arena, float, numbers);
    body->normal = arena_push(arena, float, numbers);
    body->velocity = arena_push(arena, float, numbers);
    body->field = field_create(body->vertex_count, arena);
}

bool export_set_layout(Export *export, const StateLayout *layout, Error *error) {
    arena_free(&export->layout);
    export->body_count = layout->cloth_count;
    export->bodies = arena_push(&export->layout, ExportBody, layout->cloth_count);
    double *rest = arena_push(&export->layout, double, 3 * (size_t)layout->vertex_count);
    state_surface(layout, layout->rest, rest);
    for (int i = 0; i < export->body_count; i++) {
        name_body(export, i, export->header->cloths[i].name);
        set_body(export, layout, i);
        ExportBody *body = &export->bodies[i];
        if (!place_all(export, export->def->scale, rest + 3 * (size_t)body->vertex_begin,
                       body->vertex_count, body->rest, "the rest position", error)) {
            return false;
        }
    }
    return true;
}

/* ---- frames ---- */

bool export_set_frame(Export *export, const StateLayout *layout, const StateFrame *frame,
                      Error *error) {
    ArenaMark mark = arena_mark(&export->layout);
    double *x = arena_push(&export->layout, double, 3 * (size_t)layout->vertex_count);
    double *v = arena_push(&export->layout, double, 3 * (size_t)layout->vertex_count);
    bool good = true;
    state_surface(layout, frame->x, x);
    state_surface(layout, frame->v, v);
    export->frame = frame->frame;
    export->time = frame->time;
    for (int i = 0; good && i < export->body_count; i++) {
        ExportBody *body = &export->bodies[i];
        const double *own = x + 3 * (size_t)body->vertex_begin;
        if (export->def->format->fields) {
            field_compute(&body->mesh, own, &body->field);
        } else {
            field_find_normals(&body->mesh, own, &body->field);
        }
        double scale = export->def->scale;
        good = place_all(export, scale, own, body->vertex_count, body->position, "the position",
                         error) &&
               place_all(export, scale, v + 3 * (size_t)body->vertex_begin, body->vertex_count,
                         body->velocity, "the velocity", error) &&
               place_all(export, 1.0, body->field.normal, body->vertex_count, body->normal,
                         "the normal", error);
    }
    arena_rewind(&export->layout, mark);
    return good;
}

/* ---- files ---- */

/* True if toile's name stands near the begin of a file. */
static bool is_ours(const char *path) {
    char head[4096];
    FILE *file = fopen(path, "rb");
    size_t size = file ? fread(head, 1, sizeof head, file) : 0;
    if (file) {
        fclose(file);
    }
    return size == 0 || memmem(head, size, "toile", 5) != NULL;
}

bool export_start_file(const Export *export, PartFile *file, const char *path, Error *error) {
    struct stat status;
    if (!export->def->force && stat(path, &status) == 0 && S_ISREG(status.st_mode)) {
        const char *ending = file_ending(path);
        char beside[FILE_PATH_SIZE]; /* caches have no room for a name: their mesh tells */
        snprintf(beside, sizeof beside, "%.*sobj", (int)(ending - path), path);
        bool cache = strcmp(ending, "pc2") == 0 || strcmp(ending, "mdd") == 0;
        if (!is_ours(cache && stat(beside, &status) == 0 ? beside : path)) {
            return error_set(error, EXIT_IO, "%s was not written by toile; --force overwrites it",
                             path);
        }
    }
    return file_create_folders(path, error) && file_start(file, path, error);
}
