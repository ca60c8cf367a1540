/* meshes.h: small mesh files of every format, in memory, for tests that read or damage them. */
#ifndef TOILE_TESTS_MESHES_H
#define TOILE_TESTS_MESHES_H

#include <stddef.h>

/* A tetrahedron (0 0 0), (1 0 0), (0 2 0), (0 0 3) in the file's own axes and units, closed, the
 * right way round. The glTF ones carry a node that turns about z by 90 degrees in one second, and a
 * morph target that lifts the third vertex by 1 along x in that time. */
typedef struct TestMesh {
    const char *name; /* ending of the file */
    const unsigned char *bytes;
    size_t size;
} TestMesh;

#define TEST_MESH_COUNT 8 /* obj, ply, binary ply, stl, binary stl, gltf, glb, fbx */

/* The first call makes them; they live as long as the program. */
const TestMesh *test_meshes(void);

/* A GLB of this JSON text and these bytes; malloc. */
unsigned char *test_glb(const char *json, const void *bytes, size_t byte_count, size_t *size);

/* JSON of the tetrahedron above; `uri` of its buffer, NULL in a GLB; `extra` goes into the root. */
char *test_gltf(const char *uri, const char *extra);
const void *test_gltf_bytes(size_t *size);

#endif
