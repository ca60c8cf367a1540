/* Fuzzes the scene reader: no text may crash it, leak, hang, or pass with a number that is not
 * finite. What it accepts must read back from the effective scene to the same hash.
 * Needs clang -fsanitize=fuzzer; corpus: assets/scenes, assets/fabrics, tests/bad. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim/scene/mesh_import.h"
#include "sim/scene/scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
const char *__lsan_default_suppressions(void);

/* the lexer of UDUNITS drops a few bytes at a unit that it cannot read */
const char *__lsan_default_suppressions(void) { return "leak:utlex"; }

/* A failed ASSERT ends in _exit; here it is a crash, of which the fuzzer keeps the input. */
_Noreturn void _exit(int status) {
    (void)status;
    abort();
}

/* Meshes have a fuzzer of their own; here no process is started and no file is opened for them. */
MeshImportDef mesh_import_default(void) { return (MeshImportDef){0}; }
bool mesh_import(const MeshImportDef *def, Arena *arena, MeshDef *mesh, Error *error) {
    (void)def, (void)arena, (void)mesh;
    return error_set(error, EXIT_BAD_INPUT, "no meshes here");
}

static void check_numbers(const Scene *scene) {
    for (int i = 0; i < scene->cloth_count; i++) {
        const ClothDef *cloth = &scene->cloths[i];
        Material m = fabric_material(&cloth->fabric);
        ASSERT(isfinite(m.c11) && isfinite(m.c22) && isfinite(m.c12) && m.c66 > 0.0);
        ASSERT(m.density > 0.0 && m.thickness > 0.0 && m.c11 > 0.0 && m.c22 > 0.0);
        ASSERT(m.c11 * m.c22 - m.c12 * m.c12 > 0.0);
        ASSERT(m.d11 > 0.0 && m.d22 > 0.0 && m.d66 > 0.0 && isfinite(m.d66));
        ASSERT(shape_area(&cloth->shape) > 0.0);
        ASSERT(cloth->nodes[0] >= 3 && cloth->nodes[1] >= 3);
    }
    for (int i = 0; i < scene->handle_count; i++) {
        ASSERT(scene->handles[i].cloth >= 0 && scene->handles[i].cloth < scene->cloth_count);
        Pose pose = motion_pose(&scene->handles[i].motion, 1.0);
        ASSERT(isfinite(pose.shift.x + pose.shift.y + pose.shift.z + pose.turn.w));
    }
    for (int i = 0; i < scene->obstacle_count; i++) {
        const ObstacleDef *obstacle = &scene->obstacles[i];
        Pose pose = pose_compose(motion_pose(&obstacle->motion, 1.0), obstacle->pose);
        ASSERT(isfinite(pose.shift.x + pose.shift.y + pose.shift.z + pose.turn.w));
    }
    ASSERT(scene->film.frame_count > 0 && scene->film.rate > 0.0);
}

static void check_effective(const Scene *scene, Arena *arena) {
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    ASSERT(out);
    scene_print_effective(scene, out);
    fclose(out);
    Scene again;
    Error error = {0};
    bool ok = scene_parse("fuzz.yaml", text, bytes, NULL, arena, &again, &error);
    if (!ok || again.hash != scene->hash) {
        fprintf(stderr, "%s\n%s\n", text, error.text);
    }
    ASSERT(ok);
    ASSERT(again.hash == scene->hash);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    Arena arena = {0};
    Scene scene;
    Error error = {0};
    if (scene_parse("fuzz.yaml", (const char *)data, size, NULL, &arena, &scene, &error)) {
        check_numbers(&scene);
        check_effective(&scene, &arena);
    } else {
        ASSERT(error.text[0] && (error.code == EXIT_BAD_INPUT || error.code == EXIT_IO ||
                                 error.code == EXIT_MISSING_INPUT));
    }
    arena_free(&arena);
    return 0;
}
