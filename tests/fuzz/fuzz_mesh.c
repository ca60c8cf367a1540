/* Fuzzes the import of meshes, one format a program (-DMESH_ENDING='"obj"'): whatever the file holds,
 * the child may crash or loop, but mesh_import answers in time, with a clean mesh or with a message.
 * The parser itself runs in the child, out of the fuzzer's sight: mutation is blind behind the door.
 * Needs clang -fsanitize=fuzzer; corpus: the files of tests/support/meshes.c and assets/meshes. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/scene/mesh_import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define PATIENCE 2.0 /* [s] */

static void check_mesh(const MeshDef *mesh) {
    ASSERT(mesh->triangle_count > 0 && mesh->triangle_count <= MESH_MOST_TRIANGLES);
    ASSERT(mesh->vertex_count > 0 && mesh->frame_count > 0);
    for (int i = 0; i < 3 * mesh->triangle_count; i++) {
        ASSERT(mesh->triangles[i] >= 0 && mesh->triangles[i] < mesh->vertex_count);
    }
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count * (size_t)mesh->frame_count; i++) {
        ASSERT(fabs(mesh->frames[i]) <= mesh_import_default().farthest);
    }
    double *positions = malloc(3 * sizeof(double) * (size_t)mesh->vertex_count);
    ASSERT(positions);
    mesh_positions(mesh, 0.37, positions);
    free(positions);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static char path[64];
    if (!path[0]) {
        strcpy(path, "/tmp/toile_fuzz_XXXXXX");
        ASSERT(mkdtemp(path));
        strcat(path, "/input." MESH_ENDING);
    }
    FILE *file = fopen(path, "wb");
    ASSERT(file && fwrite(data, 1, size, file) == size);
    fclose(file);
    Arena arena = {0};
    for (int animated = 0; animated < 2; animated++) {
        MeshImportDef def = mesh_import_default();
        def.path = path;
        def.patience = PATIENCE;
        def.animated = animated;
        MeshDef mesh;
        Error error = {0};
        if (mesh_import(&def, &arena, &mesh, &error)) {
            check_mesh(&mesh);
        } else {
            ASSERT(error.text[0] && (error.code == EXIT_BAD_INPUT || error.code == EXIT_IO));
        }
    }
    arena_free(&arena);
    return 0;
}
