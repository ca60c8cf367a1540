/* mesh.h: triangle meshes as obstacles.
 *
 * Vertices are in the obstacle's own frame, in metres, z up; ObstacleDef.pose and .motion place
 * them in the world, as they do with a Solid. A mesh may move by itself besides (a walking figure):
 * then `frames` holds the positions of all vertices at evenly spaced times, and between two of them
 * every vertex moves on a straight line.
 */
#ifndef TOILE_SCENE_MESH_H
#define TOILE_SCENE_MESH_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/base/arena.h"

#define MESH_MOST_TRIANGLES 1000000 /* a scanned body has 200,000; more eat time, not accuracy */
#define MESH_MOST_NOTES 8

/* Which axis of a file points up. */
typedef enum MeshUp {
    MESH_UP_AUTO, /* as the format has it: see mesh_import.h */
    MESH_UP_Y,
    MESH_UP_Z
} MeshUp;

typedef struct MeshDef {
    const char *file; /* as the scene names it */
    double scale;     /* [m] one unit of length in the file; what was used */
    MeshUp up;        /* what was used, never auto */
    bool animated;    /* `motion: file` */
    uint64_t hash;    /* of everything below */
    int vertex_count, triangle_count;
    const double *vertices;   /* [m] (vertex_count x 3) at t = 0 */
    const int32_t *triangles; /* (triangle_count x 3), anticlockwise seen from outside */
    bool closed;            /* no border, every edge has two triangles that agree: has an inside */
    double low[3], high[3]; /* [m] box around all frames */
    int frame_count;        /* 1: does not move by itself */
    double frame_rate;      /* [1/s] */
    const double *frames;   /* [m] (frame_count x vertex_count x 3); frame 0 is `vertices` */
    int note_count;
    const char *notes[MESH_MOST_NOTES]; /* what was repaired or is doubtful, one sentence each */
} MeshDef;

/* Positions at `time` [s] in the obstacle's frame: (vertex_count x 3) [m]. After its last frame a
 * mesh stands still. */
void mesh_positions(const MeshDef *mesh, double time, double *positions);

/* Joins vertices that coincide in all frames, drops triangles without area and vertices without
 * triangle, turns closed pieces that are inside out, fills box, `closed`, hash and notes. The arrays
 * of `mesh` are replaced by copies in arena. False: nothing was left. */
bool mesh_clean(MeshDef *mesh, Arena *arena);

#endif
