/* mesh_assimp.h: the child's side of mesh_import.h, and the only file that knows assimp.
 *
 * What goes through the pipe, in the byte order of the machine:
 *   MeshReply; when `text` is empty: triangles i32[triangle_count][3], then for every frame
 *   positions f64[vertex_count][3] in units and axes of the file; with `uv` one frame more, which
 *   holds texture coordinates u, v, 0.
 */
#ifndef TOILE_SCENE_MESH_ASSIMP_H
#define TOILE_SCENE_MESH_ASSIMP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MESH_REPLY_TEXT 240
#define MESH_REPLY_MAGIC 0x4853454du
#define MESH_MOST_PARTS 8 /* files beside a .gltf */

/* A file in memory, under the name by which the parser asks for it. */
typedef struct MeshPart {
    const char *name;
    const unsigned char *bytes;
    size_t size;
} MeshPart;

typedef struct MeshJob {
    MeshPart parts[1 + MESH_MOST_PARTS]; /* the file itself comes first */
    int part_count;
    bool animated;
    bool uv;         /* not with `animated` */
    double rate;     /* [1/s] */
    int frame_count; /* frames that are wanted, at least 1 */
    int most_triangles;
    size_t most_bytes; /* of positions */
} MeshJob;

typedef struct MeshReply {
    uint32_t magic;
    char text[MESH_REPLY_TEXT]; /* why it failed, one sentence; "" when it did not */
    int64_t vertex_count, triangle_count, frame_count;
    double unit; /* [m] of the file, as far as it says; 0 */
    int32_t up;  /* 0 x, 1 y, 2 z, as far as the file says; -1 */
} MeshReply;

/* Parses, writes the reply to `out`. Only in a process of its own: it may crash, loop, or end. */
void mesh_assimp_answer(const MeshJob *job, int out);

#endif
