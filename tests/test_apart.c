/* Drawn cloth does not cross itself where its triangles do not: layers of pleats, near each other, counted
 * by the exact predicates. */
#include <stdlib.h>
#include <string.h>

#include "render/measure.h"
#include "sim/base/hash.h"
#include "sim/geom/crossing.h"
#include "tests/support/check.h"

#define SPACING 0.02  /* [m] of nodes */
#define SIDE 0.014    /* [m] of a zigzag, across and up */
#define SIDES 6       /* of a zigzag */
#define GAP 0.0015    /* [m] of layers, up */
#define JITTER 0.0002 /* [m] */
#define ROWS 7        /* of nodes, along the folds */
#define MOST 64       /* nodes across the folds */

typedef enum Kind { LATTICE, TURNED, TUBE, SCATTERED, KIND_COUNT } Kind;

/* One cloth: a line of nodes in the plane of x and z, drawn out along y. */
typedef struct Cloth {
    int across, triangle_count;
    int32_t lattice[4], nodes[2], triangles_begin[2], triangles[6 * MOST * ROWS];
    double material[2 * MOST * ROWS], x[3 * MOST * ROWS];
    StateLayout layout;
    StateFrame frame;
} Cloth;

static double jitter(int seed, int number) {
    return seed ? JITTER * (2.0 * hash_random((uint64_t)seed, (uint64_t)number) - 1.0) : 0.0;
}

static int node_of(const Cloth *cloth, Kind kind, int i, int j) {
    return kind == TURNED ? i * ROWS + j : j * cloth->across + i;
}

static void fill_triangles(Cloth *cloth, Kind kind) {
    int cells = kind == TUBE ? cloth->across : cloth->across - 1;
    for (int j = 0; j + 1 < ROWS; j++) {
        for (int i = 0; i < cells; i++) {
            int right = (i + 1) % cloth->across;
            int a = node_of(cloth, kind, i, j), b = node_of(cloth, kind, right, j);
            int c = node_of(cloth, kind, i, j + 1), d = node_of(cloth, kind, right, j + 1);
            int32_t even[6] = {a, b, d, a, d, c}, odd[6] = {a, b, c, b, d, c};
            memcpy(cloth->triangles + 3 * cloth->triangle_count, (i + j) % 3 ? even : odd,
                   sizeof even);
            cloth->triangle_count += 2;
        }
    }
}

static void fill(Cloth *cloth, Kind kind, double (*line)[2], int across, int seed) {
    *cloth = (Cloth){.across = across, .lattice = {across, ROWS, kind == TUBE, 0}};
    for (int j = 0; j < ROWS; j++) {
        for (int i = 0; i < across; i++) {
            int node = node_of(cloth, kind, i, j);
            cloth->material[2 * node] = SPACING * i;
            cloth->material[2 * node + 1] = SPACING * j;
            cloth->x[3 * node] = line[i][0] + jitter(seed, 3 * node);
            cloth->x[3 * node + 1] = SPACING * j + jitter(seed, 3 * node + 1);
            cloth->x[3 * node + 2] = line[i][1] + jitter(seed, 3 * node + 2);
        }
    }
    fill_triangles(cloth, kind);
    if (kind == SCATTERED) {
        memset(cloth->lattice, 0, sizeof cloth->lattice);
    }
    cloth->nodes[1] = across * ROWS;
    cloth->triangles_begin[1] = cloth->triangle_count;
    cloth->frame.x = cloth->x;
    cloth->layout = (StateLayout){.cloth_count = 1,
                                  .node_count = across * ROWS,
                                  .vertex_count = across * ROWS,
                                  .triangle_count = cloth->triangle_count,
                                  .lattice = cloth->lattice,
                                  .node_begin = cloth->nodes,
                                  .vertex_begin = cloth->nodes,
                                  .triangle_begin = cloth->triangles_begin,
                                  .material = cloth->material,
                                  .vertex_material = cloth->material,
                                  .triangles = cloth->triangles};
}

/* Layers of the same zigzag, to and fro, whose sides have one node spacing or two, in turn. */
static int fill_zigzag(double (*line)[2], int layers) {
    int count = 0;
    for (int k = 0; k < layers; k++) {
        int cuts = 1 + k % 2;
        for (int i = 0; i <= SIDES * cuts; i++, count++) {
            double at = (double)(k % 2 ? SIDES * cuts - i : i) / cuts, down = fmod(at, 2.0);
            line[count][0] = SIDE * at;
            line[count][1] = GAP * k + SIDE * (down > 1.0 ? 2.0 - down : down);
        }
    }
    return count;
}

static int64_t count_drawn(const Cloth *cloth, int triangles, bool splats, bool crossing) {
    const StateCloth named = {.name = "pleats"};
    const StateHeader header = {.cloth_count = 1, .cloths = &named};
    ResampleDef def = {.triangles = triangles, .splats = splats, .crossing = crossing};
    Resampler *resampler = resample_create(&cloth->layout, &def);
    MeasureCrossings found;
    Arena arena = {0};
    assert_true(
        measure_drawn(&header, &cloth->layout, &cloth->frame, resampler, &arena, &found, NULL));
    assert_int_equal(found.place[0] != 0, found.cloth != 0);
    arena_free(&arena);
    resample_destroy(resampler);
    return found.cloth;
}

static int64_t count_simulated(const Cloth *cloth) {
    Arena arena = {0};
    CrossingMesh mesh = {cloth->layout.vertex_count, cloth->triangle_count, cloth->x,
                         cloth->triangles};
    int64_t count = crossing_count_self(&mesh, &arena).count;
    arena_free(&arena);
    return count;
}

/* The plain smooth surface crosses in every one of these, so a surface that is not drawn back fails. */
static void test_folds(void **state) {
    (void)state;
    static Cloth cloth;
    double line[MOST][2];
    for (Kind kind = 0; kind < KIND_COUNT; kind++) {
        for (int seed = 0; seed < 12; seed++) {
            fill(&cloth, kind, line, fill_zigzag(line, kind == TUBE ? 2 : 2 + seed % 3), seed);
            assert_int_equal(count_simulated(&cloth), 0);
            int triangles = seed % 2 ? 12000 : 5000;
            assert_true(count_drawn(&cloth, triangles, false, true) > 300);
            assert_int_equal(count_drawn(&cloth, triangles, false, false), 0);
            assert_int_equal(count_drawn(&cloth, triangles, true, false), 0);
        }
    }
}

/* A half turn over three cells. */
static int fill_bend(double (*line)[2]) {
    int count = 0;
    for (int i = 0; i <= 16; i++, count++) {
        double angle = PI * (i < 6 ? 0 : i > 10 ? 1 : (i - 6) / 4.0), radius = 4 * SPACING / PI;
        double beyond = i < 6 ? i - 6 : i > 10 ? 10 - i : 0;
        line[count][0] = beyond * SPACING + radius * sin(angle);
        line[count][1] = radius * (1 - cos(angle));
    }
    return count;
}

/* Where nothing is near, the smooth surface is drawn to the bit. */
static void test_smooth_is_left_alone(void **state) {
    (void)state;
    static Cloth cloth;
    double line[MOST][2];
    for (Kind kind = 0; kind < KIND_COUNT; kind++) {
        if (kind == TUBE) {
            continue;
        }
        fill(&cloth, kind, line, fill_bend(line), 0);
        ResampleDef def = {.triangles = 12000};
        Resampler *kept = resample_create(&cloth.layout, &def);
        def.crossing = true;
        Resampler *plain = resample_create(&cloth.layout, &def);
        const Surface *a = resample_frame(kept, &cloth.layout, cloth.x);
        const Surface *b = resample_frame(plain, &cloth.layout, cloth.x);
        assert_int_equal(a->vertex_count, b->vertex_count);
        assert_memory_equal(a->vertices, b->vertices,
                            sizeof *a->vertices * (size_t)a->vertex_count);
        resample_destroy(kept);
        resample_destroy(plain);
    }
}

/* Drawn back or not, seams of tubes and of pieces stay closed, with one normal; the nodes stay. */
static void test_nothing_opens(void **state) {
    (void)state;
    static Cloth cloth;
    double line[MOST][2];
    const Kind kinds[2] = {TUBE, SCATTERED};
    for (int k = 0; k < 2; k++) {
        fill(&cloth, kinds[k], line, fill_zigzag(line, 2), 5);
        ResampleDef def = {.triangles = 5000};
        Resampler *resampler = resample_create(&cloth.layout, &def);
        const Surface *surface = resample_frame(resampler, &cloth.layout, cloth.x);
        const float *uv = surface->uv;
        float period = kinds[k] == TUBE ? (float)surface->parts[0].size[0] : 0.0f;
        int twins = 0, moved = 0, nodes = 0;
        for (int i = 0; i < surface->vertex_count; i++) {
            moved += surface->moved[i];
            for (int j = i + 1; j < surface->vertex_count; j++) {
                float du = fabsf(uv[2 * i] - uv[2 * j]), dv = fabsf(uv[2 * i + 1] - uv[2 * j + 1]);
                if (dv < 1e-6f && (du < 1e-6f || fabsf(du - period) < 1e-6f)) {
                    assert_memory_equal(&surface->vertices[i], &surface->vertices[j],
                                        sizeof *surface->vertices);
                    twins++;
                }
            }
            for (int n = 0; n < cloth.layout.node_count; n++) {
                if (hypot((double)uv[2 * i] - cloth.material[2 * n],
                          (double)uv[2 * i + 1] - cloth.material[2 * n + 1]) < 1e-6) {
                    for (int c = 0; c < 3; c++) {
                        CHECK_NEAR((double)surface->vertices[i].position[c], cloth.x[3 * n + c],
                                   1e-7);
                    }
                    nodes++;
                }
            }
        }
        assert_true(twins > 20 && moved > 500 && nodes >= cloth.layout.node_count);
        resample_destroy(resampler);
    }
}

/* Two squares of PANEL x PANEL vertices, sewn along a side and bent around it. */
#define PANEL 6
typedef struct Sewn {
    int32_t lattice[4], nodes[2], vertices[2], begin[2], triangles[12 * PANEL * PANEL];
    int32_t start[2 * PANEL * PANEL + 1], column[2 * PANEL * PANEL];
    double value[2 * PANEL * PANEL], material[4 * PANEL * PANEL], x[6 * PANEL * PANEL];
} Sewn;

static void fill_sewn(Sewn *sewn, Cloth *cloth) {
    int nodes = 0, count = 0;
    memset(sewn, 0, sizeof *sewn);
    for (int p = 0; p < 2; p++) {
        for (int k = 0; k < PANEL * PANEL; k++) {
            int vertex = p * PANEL * PANEL + k, i = k % PANEL, j = k / PANEL;
            bool joined = p == 1 && i == 0; /* to the last column of the first panel */
            sewn->start[vertex + 1] = vertex + 1;
            sewn->column[vertex] = joined ? j * PANEL + PANEL - 1 : nodes;
            sewn->value[vertex] = 1.0;
            sewn->material[2 * vertex] = SPACING * (i + jitter(1, vertex) * 500) + p;
            sewn->material[2 * vertex + 1] = SPACING * j;
            double angle = 0.35 * (p * (PANEL - 1) + i), radius = SPACING / 0.35;
            double wave = 0.3 * SPACING * sin(2.0 * j + angle);
            if (!joined) {
                vec3_store(sewn->x + 3 * nodes++, vec3((radius + wave) * sin(angle), SPACING * j,
                                                       (radius + wave) * cos(angle)));
            }
            if (i < PANEL - 1 && j < PANEL - 1) {
                int32_t cell[6] = {vertex, vertex + 1,         vertex + PANEL + 1,
                                   vertex, vertex + PANEL + 1, vertex + PANEL};
                memcpy(sewn->triangles + 3 * count, cell, sizeof cell);
                count += 2;
            }
        }
    }
    sewn->nodes[1] = nodes, sewn->vertices[1] = 2 * PANEL * PANEL, sewn->begin[1] = count;
    cloth->frame.x = sewn->x;
    cloth->layout = (StateLayout){.cloth_count = 1,
                                  .node_count = nodes,
                                  .vertex_count = 2 * PANEL * PANEL,
                                  .triangle_count = count,
                                  .lattice = sewn->lattice,
                                  .node_begin = sewn->nodes,
                                  .vertex_begin = sewn->vertices,
                                  .triangle_begin = sewn->begin,
                                  .material = sewn->material,
                                  .vertex_material = sewn->material,
                                  .triangles = sewn->triangles,
                                  .w_count = 2 * PANEL * PANEL,
                                  .w_start = sewn->start,
                                  .w_column = sewn->column,
                                  .w_value = sewn->value};
}

/* Each panel has a smooth surface of its own: plain, they cross along the seam; drawn, they share it. */
static void test_seams(void **state) {
    (void)state;
    static Sewn sewn;
    static Cloth cloth;
    fill_sewn(&sewn, &cloth);
    for (int triangles = 2000; triangles <= 20000; triangles += 6000) {
        assert_true(count_drawn(&cloth, triangles, false, true) > 0);
        assert_int_equal(count_drawn(&cloth, triangles, false, false), 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_folds),
        cmocka_unit_test(test_smooth_is_left_alone),
        cmocka_unit_test(test_nothing_opens),
        cmocka_unit_test(test_seams),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
