/* PLY, binary little-endian: FOLDER/0000.ply, one file a frame, all cloths in it. For Houdini,
 * MeshLab, Open3D, own scripts. The mesh may change between frames.
 *
 *   vertex   float x y z, nx ny nz, u v [m on the panel], vx vy vz, strain_warp strain_weft (parts),
 *            shear [rad], curvature_warp curvature_weft curvature_twist [1/m]; int cloth from 0
 *   face     uchar 3, int vertex_indices
 */
#include <string.h>

#include "render/export.h"

#define VERTEX_FLOATS 17

static const char head[] = "property float x\nproperty float y\nproperty float z\n"
                           "property float nx\nproperty float ny\nproperty float nz\n"
                           "property float u\nproperty float v\n"
                           "property float vx\nproperty float vy\nproperty float vz\n"
                           "property float strain_warp\nproperty float strain_weft\n"
                           "property float shear\nproperty float curvature_warp\n"
                           "property float curvature_weft\nproperty float curvature_twist\n"
                           "property int cloth\n";

static void write_head(const Export *export, int vertices, int triangles, FILE *out) {
    fprintf(out,
            "ply\nformat binary_little_endian 1.0\ncomment toile frame %d time %.9g s unit %s "
            "up +%c\nelement vertex %d\n%selement face %d\n"
            "property list uchar int vertex_indices\nend_header\n",
            export->frame, export->time, export->def->unit, export->up - 'a' + 'A', vertices, head,
            triangles);
}

static void write_vertices(const ExportBody *body, int cloth, FILE *out) {
    int32_t number = cloth;
    for (size_t i = 0; i < (size_t)body->vertex_count; i++) {
        float row[VERTEX_FLOATS];
        memcpy(row, body->position + 3 * i, 3 * sizeof *row);
        memcpy(row + 3, body->normal + 3 * i, 3 * sizeof *row);
        row[6] = (float)body->mesh.uv[2 * i];
        row[7] = (float)body->mesh.uv[2 * i + 1];
        memcpy(row + 8, body->velocity + 3 * i, 3 * sizeof *row);
        for (int k = 0; k < 3; k++) {
            row[11 + k] = (float)body->field.strain[3 * i + (size_t)k];
            row[14 + k] = (float)body->field.curvature[3 * i + (size_t)k];
        }
        fwrite(row, sizeof row, 1, out);
        fwrite(&number, sizeof number, 1, out);
    }
}

static void write_faces(const ExportBody *body, FILE *out) {
    for (size_t t = 0; t < (size_t)body->triangle_count; t++) {
        int32_t row[3];
        for (size_t k = 0; k < 3; k++) {
            row[k] = body->triangles[3 * t + k] + body->vertex_begin;
        }
        putc(3, out);
        fwrite(row, sizeof row, 1, out);
    }
}

static bool start(Export *export, Error *error) {
    (void)export;
    (void)error;
    return true;
}

static bool add(Export *export, Error *error) {
    char path[FILE_PATH_SIZE + 32];
    PartFile file;
    int vertices = 0, triangles = 0;
    for (int i = 0; i < export->body_count; i++) {
        vertices += export->bodies[i].vertex_count;
        triangles += export->bodies[i].triangle_count;
    }
    snprintf(path, sizeof path, "%s/%04d.ply", export->path, export->frame);
    if (!export_start_file(export, &file, path, error)) {
        return false;
    }
    write_head(export, vertices, triangles, file.out);
    for (int i = 0; i < export->body_count; i++) {
        write_vertices(&export->bodies[i], i, file.out);
    }
    for (int i = 0; i < export->body_count; i++) {
        write_faces(&export->bodies[i], file.out);
    }
    return file_finish(&file, error);
}

static void abandon(Export *export) { (void)export; }

const ExportFormat export_ply = {
    .name = "ply",
    .about = "folder of 0000.ply with velocity, strain, curvature: Houdini, MeshLab, scripts",
    .up = 'z',
    .fields = true,
    .start = start,
    .add = add,
    .finish = start,
    .abandon = abandon,
};
