/* mesh_import.h: triangle meshes out of files of strangers: OBJ, PLY, STL, glTF, GLB, FBX.
 *
 * The file is read whole, then parsed by assimp in a child process that may do nothing else: no new
 * file descriptor, no written byte, limited time and memory. It hands triangles back through a pipe;
 * every count, index and number is checked here. A file that makes the parser crash, loop or eat
 * memory ends in a message.
 *
 *   format          up   unit of length
 *   .glb .gltf      y    1 m (both fixed by the format); parts in files beside it (.bin) are read
 *   .fbx            as the file says, y without a word; 1 cm times UnitScaleFactor of the file
 *   .obj            y    1 m      no unit and no axis in the file: a habit of most programs
 *   .ply .stl       z    1 m      the same
 *
 * Transforms of nodes are applied; several objects become one mesh. Normals, materials and
 * textures are left out. With `animated`, the first animation of the file is sampled: moving nodes,
 * skins (weights normalised, linear blending) and morph targets.
 */
#ifndef TOILE_SCENE_MESH_IMPORT_H
#define TOILE_SCENE_MESH_IMPORT_H

#include "sim/base/error.h"
#include "sim/scene/mesh.h"

#define MESH_MOST_BYTES (256 << 20)          /* of a file */
#define MESH_SECONDS 10.0                    /* until the parser is ended */
#define MESH_MEMORY ((size_t)2 << 30)        /* [byte] address space of the child */
#define MESH_FRAME_BYTES ((size_t)512 << 20) /* of all frames of an animated mesh */

typedef struct MeshImportDef {
    const char *path; /* of the file */
    double scale;     /* [m] a unit of the file; 0: as in the table above */
    MeshUp up;        /* auto */
    bool animated;    /* false: as the file stands, without its animation */
    double uv;        /* [m] 1 of its texture coordinates, which become frame 1, as (u, v, 0); not
                             with `animated`; 0: not wanted */
    double rate, seconds; /* [1/s] [s] of the frames that are wanted */
    double farthest;      /* [m] no coordinate may be larger */
    double patience;      /* [s] until the parser is ended; MESH_SECONDS */
} MeshImportDef;

MeshImportDef mesh_import_default(void);

/* Reads and cleans (mesh_clean). Errors: EXIT_MISSING_INPUT, EXIT_BAD_INPUT, EXIT_IO; the text is
 * one sentence without the name of the file. */
bool mesh_import(const MeshImportDef *def, Arena *arena, MeshDef *mesh, Error *error);

const char *mesh_import_version(void); /* "assimp 5.2.4" */

#endif
