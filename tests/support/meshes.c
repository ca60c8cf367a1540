#include "tests/support/meshes.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char obj[] = "o tet\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n"
                          "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
                          "property float y\nproperty float z\nelement face 4\n"
                          "property list uchar int vertex_indices\nend_header\n"
                          "0 0 0\n1 0 0\n0 2 0\n0 0 3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

static const char fbx[] =
    "; FBX 7.5.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n"
    "\tFBXVersion: 7500\n}\nGlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n"
    "\t\tP: \"UpAxis\", \"int\", \"Integer\", \"\", 2\n"
    "\t\tP: \"UpAxisSign\", \"int\", \"Integer\", \"\", 1\n"
    "\t\tP: \"FrontAxis\", \"int\", \"Integer\", \"\", 1\n"
    "\t\tP: \"FrontAxisSign\", \"int\", \"Integer\", \"\", -1\n"
    "\t\tP: \"CoordAxis\", \"int\", \"Integer\", \"\", 0\n"
    "\t\tP: \"CoordAxisSign\", \"int\", \"Integer\", \"\", 1\n"
    "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\", 1\n\t}\n}\nObjects:  {\n"
    "\tGeometry: 1, \"Geometry::\", \"Mesh\" {\n\t\tVertices: *12 {\n"
    "\t\t\ta: 0,0,0,1,0,0,0,2,0,0,0,3\n\t\t}\n\t\tPolygonVertexIndex: *12 {\n"
    "\t\t\ta: 0,2,-2,0,1,-4,0,3,-3,1,2,-4\n\t\t}\n\t\tGeometryVersion: 124\n\t}\n"
    "\tModel: 2, \"Model::tet\", \"Mesh\" {\n\t\tVersion: 232\n\t\tProperties70:  {\n"
    "\t\t\tP: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\", 5,0,0\n\t\t}\n\t}\n}\n"
    "Connections:  {\n\tC: \"OO\", 2, 0\n\tC: \"OO\", 1, 2\n}\n";

static const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
static const uint16_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

typedef struct Bytes {
    unsigned char *data;
    size_t size;
} Bytes;

static void add(Bytes *bytes, const void *data, size_t size) {
    bytes->data = realloc(bytes->data, bytes->size + size);
    memcpy(bytes->data + bytes->size, data, size);
    bytes->size += size;
}

static Bytes binary_ply(void) {
    static const char head[] = "ply\nformat binary_little_endian 1.0\nelement vertex 4\n"
                               "property float x\nproperty float y\nproperty float z\n"
                               "element face 4\nproperty list uchar int vertex_indices\n"
                               "end_header\n";
    Bytes bytes = {0};
    add(&bytes, head, sizeof head - 1);
    add(&bytes, corners, sizeof corners);
    for (int i = 0; i < 4; i++) {
        int32_t face[3] = {faces[i][0], faces[i][1], faces[i][2]};
        add(&bytes, "\3", 1);
        add(&bytes, face, sizeof face);
    }
    return bytes;
}

static Bytes binary_stl(void) {
    static const char head[80] = "tetrahedron";
    Bytes bytes = {0};
    uint32_t count = 4;
    add(&bytes, head, sizeof head);
    add(&bytes, &count, sizeof count);
    for (int i = 0; i < 4; i++) {
        static const float normal[3];
        add(&bytes, normal, sizeof normal);
        for (int k = 0; k < 3; k++) {
            add(&bytes, corners[faces[i][k]], sizeof corners[0]);
        }
        add(&bytes, "\0\0", 2);
    }
    return bytes;
}

static Bytes text_stl(void) {
    char text[2000] = "solid tet\n";
    size_t at = strlen(text);
    for (int i = 0; i < 4; i++) {
        at += (size_t)snprintf(text + at, sizeof text - at, "facet normal 0 0 0\nouter loop\n");
        for (int k = 0; k < 3; k++) {
            const float *p = corners[faces[i][k]];
            at += (size_t)snprintf(text + at, sizeof text - at, "vertex %g %g %g\n", (double)p[0],
                                   (double)p[1], (double)p[2]);
        }
        at += (size_t)snprintf(text + at, sizeof text - at, "endloop\nendfacet\n");
    }
    strcat(text, "endsolid tet\n");
    Bytes bytes = {0};
    add(&bytes, text, strlen(text));
    return bytes;
}

/* positions 48, faces 24, morph 48, times 8, turns 32, weights 8 bytes */
const void *test_gltf_bytes(size_t *size) {
    static struct {
        float position[4][3];
        uint16_t face[4][3];
        float morph[4][3], time[2], turn[2][4], weight[2];
    } data = {.morph = {{0}, {0}, {1, 0, 0}, {0}},
              .time = {0, 1},
              .turn = {{0, 0, 0, 1}, {0, 0, 0.70710678f, 0.70710678f}},
              .weight = {0, 1}};
    memcpy(data.position, corners, sizeof corners);
    memcpy(data.face, faces, sizeof faces);
    *size = sizeof data;
    return &data;
}

char *test_gltf(const char *uri, const char *extra) {
    static const char format[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
        "\"nodes\":[{\"name\":\"tet\",\"mesh\":0}],\"meshes\":[{\"weights\":[0],\"primitives\":[{"
        "\"attributes\":{\"POSITION\":0},\"indices\":1,\"targets\":[{\"POSITION\":2}]}]}],"
        "\"animations\":[{\"samplers\":[{\"input\":3,\"output\":4},{\"input\":3,\"output\":5}],"
        "\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"rotation\"}},"
        "{\"sampler\":1,\"target\":{\"node\":0,\"path\":\"weights\"}}]}],"
        "\"buffers\":[{%s%s%s\"byteLength\":168}],\"bufferViews\":["
        "{\"buffer\":0,\"byteOffset\":0,\"byteLength\":48},"
        "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":24},"
        "{\"buffer\":0,\"byteOffset\":72,\"byteLength\":48},"
        "{\"buffer\":0,\"byteOffset\":120,\"byteLength\":8},"
        "{\"buffer\":0,\"byteOffset\":128,\"byteLength\":32},"
        "{\"buffer\":0,\"byteOffset\":160,\"byteLength\":8}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\","
        "\"min\":[0,0,0],\"max\":[1,2,3]},"
        "{\"bufferView\":1,\"componentType\":5123,\"count\":12,\"type\":\"SCALAR\"},"
        "{\"bufferView\":2,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
        "{\"bufferView\":3,\"componentType\":5126,\"count\":2,\"type\":\"SCALAR\"},"
        "{\"bufferView\":4,\"componentType\":5126,\"count\":2,\"type\":\"VEC4\"},"
        "{\"bufferView\":5,\"componentType\":5126,\"count\":2,\"type\":\"SCALAR\"}]%s}";
    size_t room = sizeof format + strlen(extra) + (uri ? strlen(uri) + 16 : 0);
    char *text = malloc(room);
    snprintf(text, room, format, uri ? "\"uri\":\"" : "", uri ? uri : "", uri ? "\"," : "", extra);
    return text;
}

unsigned char *test_glb(const char *json, const void *data, size_t byte_count, size_t *size) {
    Bytes bytes = {0};
    size_t text = (strlen(json) + 3) / 4 * 4;
    uint32_t head[5] = {0x46546c67, 2, (uint32_t)(28 + text + byte_count), (uint32_t)text,
                        0x4e4f534a};
    uint32_t chunk[2] = {(uint32_t)byte_count, 0x004e4942};
    add(&bytes, head, sizeof head);
    add(&bytes, json, strlen(json));
    add(&bytes, "   ", text - strlen(json));
    add(&bytes, chunk, sizeof chunk);
    add(&bytes, data, byte_count);
    *size = bytes.size;
    return bytes.data;
}

const TestMesh *test_meshes(void) {
    static TestMesh meshes[TEST_MESH_COUNT];
    if (!meshes[0].name) {
        Bytes bply = binary_ply(), stl = text_stl(), bstl = binary_stl();
        size_t data_size, glb_size;
        const void *data = test_gltf_bytes(&data_size);
        char *gltf = test_gltf("part.bin", ""), *json = test_gltf(NULL, "");
        unsigned char *glb = test_glb(json, data, data_size, &glb_size);
        TestMesh all[TEST_MESH_COUNT] = {{"obj", (const unsigned char *)obj, sizeof obj - 1},
                                         {"ply", (const unsigned char *)ply, sizeof ply - 1},
                                         {"ply", bply.data, bply.size},
                                         {"stl", stl.data, stl.size},
                                         {"stl", bstl.data, bstl.size},
                                         {"gltf", (const unsigned char *)gltf, strlen(gltf)},
                                         {"glb", glb, glb_size},
                                         {"fbx", (const unsigned char *)fbx, sizeof fbx - 1}};
        memcpy(meshes, all, sizeof meshes);
        free(json);
    }
    return meshes;
}
