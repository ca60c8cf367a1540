/* state.h: run.states, the one file between the simulator and everything that reads it.
 *
 * An append-only file of checksummed records. All numbers are little-endian.
 *
 *   offset 0    char[8]  "TOILEST\n"
 *          8    u32      format version, 1
 *         12    u32      0
 *         16    records, one after the other
 *
 *   record      u32      kind: 'HEAD', 'LAYO', 'FRAM' or 'DONE' (four ASCII letters in file order)
 *               u32      number of arrays
 *               u64      payload bytes P, a multiple of 8
 *               u64      XXH3-64 of the payload
 *               payload  arrays, one after the other
 *
 *   array       char[24] name, zero-padded
 *               u32      type: 1 = u8, 2 = i32, 3 = i64, 4 = f64
 *               u32      components per item (3 for vectors)
 *               u64      item count
 *               data     components * count numbers, then zeros up to a multiple of 8
 *
 * HEAD comes first and once. A LAYO follows, and another one whenever a model changes its
 * mesh; each FRAM belongs to the last LAYO before it. DONE is last when a run has ended by
 * itself; without it the run is still going or was stopped, and can be resumed. A killed
 * program leaves at most one torn record at the end, which the reader reports and ignores.
 *
 * HEAD  program u8[], scene_text u8[] (as read), scene_path u8[], scene_hash i64[1],
 *       film f64[18] (the fields of Film in their order), obstacle.text u8[] ("name look" lines),
 *       film.more f64[8] (surface, range from, to, blur, blur_samples, play, show_time, show_scale),
 *       film.view f64[cameras][16] (kind, eye, target, up, fov, pixels_per_mm, orbit angle, from, to, keys,
 *       + 0.5 to follow; the film's own first), film.name u8[] (a line each), film.key f64[keys][8] (time,
 *       eye, target, fov; those of the first camera first), film.title u8[], film.backdrop u8[],
 *       obstacle.solid f64[obstacles][5] (kind, half x y z, radius; kind 6: a mesh, the radius of the
 *       ball around its origin that holds it), and when there are meshes
 *       obstacle.mesh_begin i32[obstacles + 1][2] (ranges of the next two),
 *       obstacle.vertex f64[][3] [m], obstacle.triangle i32[][3] (from 0 in each mesh),
 *       obstacle.flags u8[obstacles] (sum of 1: FRAM has its vertices, 2: closed),
 *       cloth.text u8[] ("name fabric look" lines), cloth.thickness f64[cloths],
 *       cloth.print u8[] (a path and a line's end each), cloth.print_width f64[cloths] [m]
 * LAYO  lattice i32[cloths][4]    nodes along u, along v, 1 = u wraps around, 0; 0 0 0 0 = scattered
 *       node_begin, vertex_begin, triangle_begin i32[cloths + 1]   ranges of each cloth
 *       material f64[nodes][2]            (u, v) of each node on its panel [m]
 *       rest f64[nodes][3]                rest positions [m]
 *       vertex_material f64[vertices][2]  (u, v) of each surface vertex [m]
 *       triangles i32[triangles][3]       vertex numbers, anticlockwise seen from the face side
 *       w.start i32[vertices + 1], w.column i32[], w.value f64[]   s = W x, rows of W (CSR);
 *                                         all three empty: W is the identity
 *       outline f64[points][2], outline_begin i32[loops + 1], loop_begin i32[cloths + 1]
 *                                         closed outlines [m], outer loop first, anticlockwise
 * FRAM  frame i32[1], time f64[1] [s], x f64[nodes][3] [m], v f64[nodes][3] [m/s],
 *       pose f64[obstacles][7]            shift x y z [m], unit quaternion w x y z
 *       contact.force f64[nodes][3]       [N] on the cloth; only where a look shows it (film.h)
 *       obstacle.moved f64[][3]           [m] vertices of the meshes that move by themselves, one
 *                                         after the other, before the pose
 *       stat f64[] with names in statistics u8[] (one per line), and whatever the stepper
 *       needs to go on with the same bits, under names that begin with "step."
 * DONE  reason u8[]
 */
#ifndef TOILE_STATE_STATE_H
#define TOILE_STATE_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "sim/base/arena.h"
#include "sim/base/error.h"
#include "sim/base/film.h"
#include "sim/base/vec.h"
#include "sim/geom/solid.h"

#define STATE_VERSION 1
#define STATE_NAME_SIZE 24
#define STATE_KIND_MESH SOLID_KIND_COUNT /* kind of an obstacle.solid that is a mesh */
#define STATE_WORD_SIZE 48 /* names of cloths, looks, obstacles, with the final zero */

typedef enum StateKind { STATE_HEAD, STATE_LAYOUT, STATE_FRAME, STATE_DONE } StateKind;
typedef enum StateType { STATE_U8 = 1, STATE_I32, STATE_I64, STATE_F64 } StateType;

/* One array of a record; data is borrowed. */
typedef struct StateArray {
    char name[STATE_NAME_SIZE];
    StateType type;
    int components;
    int64_t count; /* items of `components` numbers */
    const void *data;
} StateArray;

/* ---- what the header means: decoded forms shared by writer and reader ---- */

typedef struct StateCloth {
    char name[STATE_WORD_SIZE];
    char fabric[STATE_WORD_SIZE];
    char look[STATE_WORD_SIZE]; /* name of a look, see render/look.h */
    double thickness;           /* [m] */
    FilmPicture print;          /* on its face */
} StateCloth;

/* Triangles in the obstacle's own frame. */
typedef struct StateMesh {
    int vertex_count, triangle_count;
    const double *vertices;   /* [m] (vertex_count x 3) at the start */
    const int32_t *triangles; /* (triangle_count x 3), anticlockwise seen from outside */
    bool moves;               /* its vertices are in every frame */
    bool closed;              /* has an inside */
} StateMesh;

typedef struct StateObstacle {
    char name[STATE_WORD_SIZE];
    char look[STATE_WORD_SIZE]; /* material of the obstacle, see render/look.h */
    Solid solid;                /* with a mesh: the ball that holds it */
    const StateMesh *mesh;      /* NULL: the solid is the obstacle */
} StateObstacle;

typedef struct StateHeader {
    const char *program; /* name and version of the writer */
    const char *scene_path;
    const char *scene_text;
    uint64_t scene_hash;
    Film film;
    int cloth_count;
    const StateCloth *cloths;
    int obstacle_count;
    const StateObstacle *obstacles;
} StateHeader;

/* Shapes as in the table above. The arrays are borrowed from whoever filled it in. */
typedef struct StateLayout {
    int cloth_count, node_count, vertex_count, triangle_count;
    const int32_t *lattice;                                    /* (cloth_count x 4) */
    const int32_t *node_begin, *vertex_begin, *triangle_begin; /* (cloth_count + 1) */
    const double *material;                                    /* [m] (node_count x 2) */
    const double *rest;                                        /* [m] (node_count x 3) */
    const double *vertex_material;                             /* [m] (vertex_count x 2) */
    const int32_t *triangles;                                  /* (triangle_count x 3) */
    int w_count;                                               /* entries of W; 0: identity */
    const int32_t *w_start;  /* (vertex_count + 1), NULL when W is the identity */
    const int32_t *w_column; /* (w_count) */
    const double *w_value;   /* (w_count) */
    int loop_count, outline_count;
    const double *outline;        /* [m] (outline_count x 2) */
    const int32_t *outline_begin; /* (loop_count + 1) */
    const int32_t *loop_begin;    /* (cloth_count + 1) */
} StateLayout;

typedef struct StateFrame {
    int frame;
    double time;     /* [s] */
    const double *x; /* [m] (node_count x 3) */
    const double *v; /* [m/s] (node_count x 3) */
    int pose_count;
    const Pose *pose; /* (obstacle_count) */
    int moved_count;
    const double *moved, *contact_force; /* [m] (moved_count x 3) of all meshes that move;
                                            [N] (node_count x 3), NULL: not kept */
} StateFrame;

/* ---- writing ---- */

typedef struct StateWriter StateWriter;

/* Starts a new file (an existing one is replaced). Errors: EXIT_IO, also when another process is writing it. */
StateWriter *state_create(const char *path, Error *error);

/* Opens an existing file to go on after its last whole frame: cuts off a torn record and a
 * DONE record, and every frame after `last_frame`. Errors: as state_open and state_create. */
StateWriter *state_append(const char *path, int last_frame, Error *error);

bool state_write_header(StateWriter *writer, const StateHeader *header, Error *error);
bool state_write_layout(StateWriter *writer, const StateLayout *layout, Error *error);
/* `extra` holds statistics and what the stepper needs to resume. */
bool state_write_frame(StateWriter *writer, const StateFrame *frame, int node_count,
                       const StateArray *extra, int extra_count, Error *error);
bool state_write_done(StateWriter *writer, const char *reason, Error *error);
bool state_close(StateWriter *writer, Error *error); /* flushes; also frees when it fails */

/* ---- reading ---- */

typedef struct StateReader StateReader;

/* Opens a states file and reads its header. A file that is no states file, of another
 * version, or damaged before its first frame is named as such.
 * Errors: EXIT_MISSING_INPUT, EXIT_BAD_INPUT, EXIT_IO. */
StateReader *state_open(const char *path, Error *error);
void state_reader_close(StateReader *reader);

const StateHeader *state_header(const StateReader *reader); /* valid until it is closed */

typedef enum StateStatus {
    STATE_GROWING, /* no DONE record: still written, or stopped */
    STATE_FINISHED,
    STATE_DAMAGED /* a record is wrong; frames before it are good (see state_damage) */
} StateStatus;

/* Looks again at the file, which may have grown, and counts whole frames. */
StateStatus state_refresh(StateReader *reader);
int state_frame_count(const StateReader *reader); /* whole frames seen by state_refresh */
int64_t state_frame_end(const StateReader *reader, int index); /* offset; -1: no such frame */
const char *state_damage(const StateReader *reader); /* what is wrong and where; "" if nothing */
const char *state_done_reason(const StateReader *reader);

/* Reads frame `index` (0 .. state_frame_count - 1) and its layout. All results are valid until
 * the next call. The index of a layout changes exactly when the layout does. */
bool state_read_frame(StateReader *reader, int index, StateFrame *frame, StateLayout *layout,
                      int *layout_index, Error *error);

/* An array of the frame read last, by name, checked for type and components; NULL if absent. */
const StateArray *state_frame_array(const StateReader *reader, const char *name, StateType type,
                                    int components);

/* A statistic of the frame read last, by name; NAN if absent. */
double state_frame_statistic(const StateReader *reader, const char *name);

/* [m] (vertex_count x 3) of the mesh of an obstacle in this frame, before the pose. */
const double *state_mesh_vertices(const StateHeader *header, const StateFrame *frame, int obstacle);

/* s = W x. surface: (vertex_count x 3), x: (node_count x 3) [m]. */
void state_surface(const StateLayout *layout, const double *x, double *surface);

#endif
