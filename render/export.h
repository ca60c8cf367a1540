/* export.h: the moving surface of a run in the formats of other programs.
 *
 * What is written are the vertices and triangles of the states file itself, in their order, not the
 * smooth surface of the pictures. Positions are rounded to 32-bit floats. Vertex numbers, triangles
 * and material coordinates are the same in every frame. Times are seconds of the run.
 *
 * Layouts of the files and their limits: at the top of each export_*.c.
 */
#ifndef TOILE_RENDER_EXPORT_H
#define TOILE_RENDER_EXPORT_H

#include "render/field.h"
#include "render/file.h"
#include "sim/state/state.h"

typedef struct ExportFormat ExportFormat;

typedef struct ExportDef {
    const ExportFormat *format;
    char up;          /* 'y' or 'z'; 0: what the format wants */
    const char *unit; /* "m" */
    double scale;     /* units in a metre; 1 */
    int keys;         /* key shapes in glTF; 60 */
    bool pc2_frames;  /* PC2 counts in frames, not in seconds */
    bool vtp_ascii;
    bool force; /* overwrite what others wrote */
} ExportDef;

ExportDef export_default(void);

/* Corners with texture coordinates. Where a panel closes on itself a vertex has two places on it, and
 * so a second corner: numbers from vertex_count on. */
typedef struct ExportCorners {
    int count;
    const int32_t *vertex;    /* (count) of which vertex it is */
    const float *uv;          /* (count x 2) 0..1 over the panel's bounding box */
    const int32_t *triangles; /* (triangle_count x 3) corner numbers */
} ExportCorners;

/* One cloth. Numbers for the file are in its axes and unit. */
typedef struct ExportBody {
    char name[STATE_WORD_SIZE]; /* fit for a file name */
    const char *look;
    int vertex_count, triangle_count, vertex_begin;
    const int32_t *triangles; /* (triangle_count x 3) from 0 */
    FieldMesh mesh;           /* the same with its material coordinates [m] */
    double panel[2];          /* [m] size of the panel's bounding box */
    ExportCorners corners;
    float *rest; /* (vertex_count x 3) rest positions, for the file */
    /* of the frame at hand: */
    float *position; /* (vertex_count x 3) for the file */
    float *normal;   /* (vertex_count x 3) unit, for the file */
    float *velocity; /* (vertex_count x 3) per second, for the file */
    Field field;     /* in metres and z up; all of it only where the format wants it */
} ExportBody;

typedef struct Export {
    const ExportDef *def;
    const char *path; /* given with -o */
    const StateHeader *header;
    char up;
    double rate;     /* [1/s] */
    int frame_count; /* that will come */
    int frame_index; /* of the one at hand among them, from 0 */
    int frame;       /* its number */
    double time;     /* [s] */
    int body_count;
    ExportBody *bodies;  /* (body_count); new after a change of the mesh */
    Arena arena, layout; /* for the whole export; as long as the bodies */
    void *state;         /* of the format */
    char note[160];      /* a sentence for the user, or "" */
} Export;

struct ExportFormat {
    const char *name, *about;
    const char *ending; /* of the path; NULL: a folder */
    char up;            /* 'y' or 'z' */
    bool fixed_up;      /* the format allows no other axis and no unit but metres */
    bool one_mesh;      /* cannot hold a mesh that changes */
    bool fields;        /* wants strain and curvature */
    bool (*start)(Export *export, Error *error); /* the first frame is at hand */
    bool (*add)(Export *export, Error *error);   /* the frame at hand */
    bool (*finish)(Export *export, Error *error);
    void (*abandon)(Export *export); /* closes and removes what is not whole; also after finish */
};

extern const ExportFormat *const export_formats[]; /* NULL-terminated */
extern const ExportFormat export_obj_pc2, export_obj_mdd, export_ply, export_vtp, export_gltf,
    export_usd;

/* By name. Errors: EXIT_USAGE. */
const ExportFormat *export_format_find(const char *name, Error *error);

/* Bodies of a layout. Errors: EXIT_BAD_INPUT when a number does not fit into a float. */
bool export_set_layout(Export *export, const StateLayout *layout, Error *error);
/* Positions, velocities, normals and fields of a frame. Errors: as above. */
bool export_set_frame(Export *export, const StateLayout *layout, const StateFrame *frame,
                      Error *error);

/* Frames to keep, `keep` of them, the first and the last among them, so that straight lines between
 * their shapes miss the others by little: those whose loss costs least go first. x: all shapes
 * (frame_count x number_count), times (frame_count). chosen: (keep) in rising order. Returns the
 * largest miss of a coordinate that is left. */
double export_choose_keys(const float *x, const double *times, int frame_count, size_t number_count,
                          int keep, int *chosen);

/* Starts a file, unless something that toile did not write stands there. Errors: EXIT_IO. */
bool export_start_file(const Export *export, PartFile *file, const char *path, Error *error);

#endif
