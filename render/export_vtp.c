/* VTK PolyData: NAME.pvd, which lists NAME/0000.vtp with their times: ParaView, VTK, PyVista. The mesh
 * may change between frames. All cloths are in one piece; the array `cloth` tells them apart.
 *
 * VTP: an XML head, then raw blocks, each a UInt64 byte count and the numbers; the offset of a block
 * counts from the byte after '_'. With --vtp-ascii the numbers stand in the XML.
 */
#include <string.h>

#include "render/export.h"

typedef enum Kind { FLOATS, CELLS, OFFSETS, CLOTH } Kind;

/* One array of a body. */
typedef struct VtpArray {
    const char *name;
    int components;
    Kind kind;
    size_t field; /* of ExportBody: float * or double * */
    bool doubles;
} VtpArray;

#define IN_BODY(member) offsetof(ExportBody, member)

static const VtpArray point_arrays[] = {
    {"Normals", 3, FLOATS, IN_BODY(normal), false},
    {"velocity", 3, FLOATS, IN_BODY(velocity), false},
    {"displacement", 3, FLOATS, 0, false}, /* from the rest position */
    {"material", 2, FLOATS, IN_BODY(mesh.uv), true},
    {"strain", 3, FLOATS, IN_BODY(field.strain), true},
    {"curvature", 3, FLOATS, IN_BODY(field.curvature), true},
    {"cloth", 1, CLOTH, 0, false},
};
static const VtpArray points = {"Points", 3, FLOATS, IN_BODY(position), false};
static const VtpArray connectivity = {"connectivity", 1, CELLS, 0, false};
static const VtpArray offsets = {"offsets", 1, OFFSETS, 0, false};
#define POINT_ARRAYS ((int)(sizeof point_arrays / sizeof *point_arrays))

typedef struct Vtp {
    const Export *export;
    FILE *out;
    size_t vertices, triangles, offset;
} Vtp;

static double number_of(const VtpArray *array, const ExportBody *body, size_t i) {
    if (array->field == 0) {
        return body->position[i] - body->rest[i];
    }
    const void *field = (const char *)body + array->field;
    return array->doubles ? (*(const double *const *)field)[i] : (*(const float *const *)field)[i];
}

static void put_float(const Vtp *vtp, bool ascii, double value) {
    float number = (float)value;
    if (ascii) {
        fprintf(vtp->out, "%.9g ", number);
    } else {
        fwrite(&number, sizeof number, 1, vtp->out);
    }
}

static void put_long(const Vtp *vtp, bool ascii, int64_t number) {
    if (ascii) {
        fprintf(vtp->out, "%lld ", (long long)number);
    } else {
        fwrite(&number, sizeof number, 1, vtp->out);
    }
}

static size_t bytes_of(const Vtp *vtp, const VtpArray *array) {
    switch (array->kind) {
    case FLOATS:
        return sizeof(float) * (size_t)array->components * vtp->vertices;
    case CLOTH:
        return sizeof(int64_t) * vtp->vertices;
    case CELLS:
        return sizeof(int64_t) * 3 * vtp->triangles;
    default:
        return sizeof(int64_t) * vtp->triangles;
    }
}

static void put_numbers(const Vtp *vtp, const VtpArray *array, bool ascii) {
    int64_t triangles = 0;
    for (int b = 0; b < vtp->export->body_count; b++) {
        const ExportBody *body = &vtp->export->bodies[b];
        size_t vertices = (size_t)body->vertex_count;
        size_t corners = 3 * (size_t)body->triangle_count;
        if (array->kind == FLOATS) {
            for (size_t i = 0; i < vertices * (size_t)array->components; i++) {
                put_float(vtp, ascii, number_of(array, body, i));
            }
        } else if (array->kind == CELLS) {
            for (size_t i = 0; i < corners; i++) {
                put_long(vtp, ascii, body->triangles[i] + body->vertex_begin);
            }
        } else {
            size_t count = array->kind == CLOTH ? vertices : corners / 3;
            for (size_t i = 0; i < count; i++) {
                put_long(vtp, ascii, array->kind == CLOTH ? b : 3 * ++triangles);
            }
        }
    }
}

/* The element that announces an array; in ASCII the numbers are in it. */
static void put_element(Vtp *vtp, const VtpArray *array) {
    bool ascii = vtp->export->def->vtp_ascii;
    fprintf(vtp->out, "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" format=\"%s\"",
            array->kind == FLOATS ? "Float32" : "Int64", array->name, array->components,
            ascii ? "ascii" : "appended");
    if (ascii) {
        fputs(">", vtp->out);
        put_numbers(vtp, array, true);
        fputs("</DataArray>\n", vtp->out);
    } else {
        fprintf(vtp->out, " offset=\"%zu\"/>\n", vtp->offset);
        vtp->offset += sizeof(uint64_t) + bytes_of(vtp, array);
    }
}

static void put_block(const Vtp *vtp, const VtpArray *array) {
    uint64_t bytes = bytes_of(vtp, array);
    fwrite(&bytes, sizeof bytes, 1, vtp->out);
    put_numbers(vtp, array, false);
}

static void write_frame(Vtp *vtp) {
    const Export *export = vtp->export;
    fprintf(
        vtp->out,
        "<?xml version=\"1.0\"?>\n<!-- toile frame %d, time %.9g s, unit %s, %c up; strain: warp, "
        "weft, shear [rad]; curvature: warp, weft, twist [1/m] -->\n"
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n<PolyData>\n<Piece NumberOfPoints=\"%zu\" "
        "NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"%zu\">\n"
        "<PointData Normals=\"Normals\">\n",
        export->frame, export->time, export->def->unit, export->up, vtp->vertices, vtp->triangles);
    for (int i = 0; i < POINT_ARRAYS; i++) {
        put_element(vtp, &point_arrays[i]);
    }
    fputs("</PointData>\n<CellData>\n</CellData>\n<Points>\n", vtp->out);
    put_element(vtp, &points);
    fputs("</Points>\n<Polys>\n", vtp->out);
    put_element(vtp, &connectivity);
    put_element(vtp, &offsets);
    fputs("</Polys>\n</Piece>\n</PolyData>\n", vtp->out);
    if (!export->def->vtp_ascii) {
        fputs("<AppendedData encoding=\"raw\">\n_", vtp->out);
        for (int i = 0; i < POINT_ARRAYS; i++) {
            put_block(vtp, &point_arrays[i]);
        }
        put_block(vtp, &points);
        put_block(vtp, &connectivity);
        put_block(vtp, &offsets);
        fputs("\n</AppendedData>\n", vtp->out);
    }
    fputs("</VTKFile>\n", vtp->out);
}

static bool start(Export *export, Error *error) {
    PartFile *pvd = export->state = arena_push(&export->arena, PartFile, 1);
    if (!export_start_file(export, pvd, export->path, error)) {
        return false;
    }
    fputs("<?xml version=\"1.0\"?>\n<!-- toile -->\n<VTKFile type=\"Collection\" version=\"0.1\" "
          "byte_order=\"LittleEndian\">\n<Collection>\n",
          pvd->out);
    return true;
}

/* "run" of "films/run.pvd"; *stem: "films/run" */
static const char *folder_of(const char *path, char stem[FILE_PATH_SIZE]) {
    snprintf(stem, FILE_PATH_SIZE, "%.*s", (int)(strlen(path) - strlen(".pvd")), path);
    const char *slash = strrchr(stem, '/');
    return slash ? slash + 1 : stem;
}

static bool add(Export *export, Error *error) {
    char stem[FILE_PATH_SIZE], path[FILE_PATH_SIZE + 32];
    PartFile *pvd = export->state, file;
    const char *folder = folder_of(export->path, stem);
    Vtp vtp = {.export = export};
    for (int i = 0; i < export->body_count; i++) {
        vtp.vertices += (size_t) export->bodies[i].vertex_count;
        vtp.triangles += (size_t) export->bodies[i].triangle_count;
    }
    snprintf(path, sizeof path, "%s/%04d.vtp", stem, export->frame);
    if (!export_start_file(export, &file, path, error)) {
        return false;
    }
    vtp.out = file.out;
    write_frame(&vtp);
    fprintf(pvd->out, "<DataSet timestep=\"%.9g\" group=\"\" part=\"0\" file=\"%s/%04d.vtp\"/>\n",
            export->time, folder, export->frame);
    return file_finish(&file, error);
}

static bool finish(Export *export, Error *error) {
    PartFile *pvd = export->state;
    fputs("</Collection>\n</VTKFile>\n", pvd->out);
    return file_finish(pvd, error);
}

static void abandon(Export *export) {
    if (export->state) {
        file_abandon(export->state);
    }
}

const ExportFormat export_vtp = {
    .name = "vtp",
    .about = "NAME.pvd and NAME/0000.vtp with velocity, strain, curvature: ParaView, VTK",
    .ending = "pvd",
    .up = 'z',
    .fields = true,
    .start = start,
    .add = add,
    .finish = finish,
    .abandon = abandon,
};
