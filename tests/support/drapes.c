#include "tests/support/drapes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/state/state.h"

#define LIFT 0.0005 /* [m] of the cloth over the table */

DrapeShape drape_shape_default(void) {
    DrapeShape shape = {.specimen = 0.15,
                        .support = 0.09,
                        .table_height = 0.10,
                        .rings = 30,
                        .look = "linen",
                        .camera_height = INFINITY,
                        .half_view = 0.19,
                        .pixels = 800};
    shape.a[0] = 0.12;
    shape.a[6] = 0.01;
    return shape;
}

double drape_shape_radius(const DrapeShape *shape, double theta) {
    double r = shape->a[0];
    for (int n = 1; n < DRAPE_SHAPE_TERMS; n++) {
        r += shape->a[n] * cos(n * theta) + shape->b[n] * sin(n * theta);
    }
    return r;
}

double drape_shape_cut(const DrapeShape *shape, double theta, double depth) {
    double free = shape->specimen - shape->support;
    double out = drape_shape_radius(shape, theta) - shape->support;
    double part = (depth + LIFT) / sqrt(fmax(free * free - out * out, 0.0));
    return part <= 1.0 ? shape->support + part * out : NAN;
}

double drape_shape_dc(const DrapeShape *shape) {
    double area = PI * shape->a[0] * shape->a[0], disc = PI * shape->support * shape->support;
    for (int n = 1; n < DRAPE_SHAPE_TERMS; n++) {
        area += 0.5 * PI * (shape->a[n] * shape->a[n] + shape->b[n] * shape->b[n]);
    }
    return 100.0 * (area - disc) / (PI * shape->specimen * shape->specimen - disc);
}

typedef struct Disc {
    int node_count, triangle_count, rim;
    double *material, *x, *v, *rest;
    int32_t *triangles;
} Disc;

static void add_triangle(Disc *disc, int a, int b, int c) {
    int32_t *t = disc->triangles + 3 * disc->triangle_count++;
    t[0] = a, t[1] = b, t[2] = c;
}

/* Rings of 6 k vertices. */
static Disc make_disc(const DrapeShape *shape, Arena *arena) {
    int rings = shape->rings, nodes = 1 + 3 * rings * (rings + 1);
    Disc disc = {.node_count = nodes, .rim = 6 * rings};
    disc.material = arena_push(arena, double, 2 * nodes);
    disc.x = arena_push(arena, double, 3 * nodes);
    disc.v = arena_push(arena, double, 3 * nodes);
    disc.rest = arena_push(arena, double, 3 * nodes);
    disc.triangles = arena_push(arena, int32_t, 18 * rings * rings);
    for (int k = 1, node = 1; k <= rings; k++) {
        for (int i = 0; i < 6 * k; i++, node++) {
            disc.material[2 * node] = shape->specimen * k / rings * cos(PI * i / (3 * k));
            disc.material[2 * node + 1] = shape->specimen * k / rings * sin(PI * i / (3 * k));
        }
    }
    for (int k = 1; k <= rings; k++) {
        int inner = k == 1 ? 0 : 1 + 3 * (k - 1) * (k - 2), outer = 1 + 3 * k * (k - 1);
        int inner_count = k == 1 ? 1 : 6 * (k - 1);
        for (int i = 0; i < 6 * k; i++) {
            int side = i / k, j = i % k, a = outer + i, b = outer + (i + 1) % (6 * k);
            int c = inner + (side * (k - 1) + j) % inner_count;
            add_triangle(&disc, a, b, c);
            if (j + 1 < k) {
                add_triangle(&disc, b, inner + (side * (k - 1) + j + 1) % inner_count, c);
            }
        }
    }
    for (int i = 0; i < nodes; i++) {
        disc.rest[3 * i] = disc.material[2 * i];
        disc.rest[3 * i + 1] = disc.material[2 * i + 1];
    }
    return disc;
}

static void place(const DrapeShape *shape, bool draped, Disc *disc) {
    for (int i = 0; i < disc->node_count; i++) {
        const double *m = disc->material + 2 * i;
        double rho = hypot(m[0], m[1]), theta = atan2(m[1], m[0]), down = 0.0, r = rho;
        double free = shape->specimen - shape->support;
        if (draped && rho > shape->support) {
            double part = (rho - shape->support) / free;
            double out = drape_shape_radius(shape, theta) - shape->support;
            r = shape->support + part * out;
            down = part * sqrt(fmax(free * free - out * out, 0.0));
        }
        disc->x[3 * i] = shape->centre[0] + r * cos(theta + shape->warp);
        disc->x[3 * i + 1] = shape->centre[1] + r * sin(theta + shape->warp);
        disc->x[3 * i + 2] = shape->table_height + LIFT - down + (draped ? 0.0 : 0.02);
        disc->v[3 * i + 2] = draped ? 0.0 : -0.6;
    }
}

#define PLATE_HALF 0.001 /* [m] of its thickness */

/* Straight down but for the tilt; y of the world is up in the picture. */
static Film make_film(const DrapeShape *shape) {
    Film film = film_default();
    bool far = isinf(shape->camera_height);
    double x = shape->centre[0] + shape->camera_shift[0];
    double y = shape->centre[1] + shape->camera_shift[1], height = far ? 2.0 : shape->camera_height;
    film.frame_count = 2;
    film.camera = far ? CAMERA_ORTHOGRAPHIC : CAMERA_PERSPECTIVE;
    film.target = vec3(x, y, shape->table_height);
    film.eye = vec3(x, y - height * tan(shape->tilt), shape->table_height + height);
    film.up = vec3(0, 1, 0);
    film.fov = 2.0 * atan(shape->half_view / height);
    film.pixels_per_mm = 0.001 * shape->pixels / (2.0 * shape->half_view);
    film.floor_height = 0.0;
    return film;
}

static bool write_frames(StateWriter *writer, const DrapeShape *shape, Disc *disc) {
    bool good = true;
    Pose pose[2] = {pose_identity(), pose_identity()};
    pose[0].shift = vec3(shape->centre[0], shape->centre[1], 0.5 * shape->table_height);
    pose[1].shift = vec3(shape->centre[0], shape->centre[1], shape->table_height + 0.002);
    for (int i = 0; good && i < 2; i++) {
        place(shape, i == 1, disc);
        StateFrame frame = {.frame = i, .time = i / 30.0, .x = disc->x, .v = disc->v};
        frame.pose_count = shape->plate ? 2 : 1;
        frame.pose = pose;
        good = state_write_frame(writer, &frame, disc->node_count, NULL, 0, NULL);
    }
    return good;
}

bool drape_shape_write(const DrapeShape *shape, const char *path) {
    Arena arena = {0};
    Disc disc = make_disc(shape, &arena);
    StateCloth cloth = {.name = "round", .fabric = "made-up", .thickness = 0.0005};
    snprintf(cloth.look, sizeof cloth.look, "%s", shape->look);
    const Solid cylinder = {SOLID_CYLINDER, {0, 0, 0.5 * shape->table_height}, shape->support};
    const Solid box = {SOLID_BOX, {shape->box, shape->box, 0.5 * shape->table_height}, 0.0};
    StateObstacle obstacles[2] = {{"table", "wood", shape->box > 0.0 ? box : cylinder, NULL},
                                  {"plate", "", cylinder, NULL}};
    obstacles[1].solid.half.z = PLATE_HALF;
    snprintf(obstacles[1].look, sizeof obstacles[1].look, "%s", shape->plate ? shape->plate : "");
    StateHeader header = {.program = "toile tests",
                          .scene_path = "drape",
                          .scene_text = "",
                          .film = make_film(shape),
                          .cloth_count = 1,
                          .cloths = &cloth,
                          .obstacle_count = shape->plate ? 2 : 1,
                          .obstacles = obstacles};
    const int32_t lattice[4] = {0}, zero[2] = {0, 1};
    const int32_t nodes[2] = {0, disc.node_count}, triangles[2] = {0, disc.triangle_count};
    const int32_t rim[2] = {0, disc.rim};
    StateLayout layout = {.cloth_count = 1,
                          .node_count = disc.node_count,
                          .vertex_count = disc.node_count,
                          .triangle_count = disc.triangle_count,
                          .lattice = lattice,
                          .node_begin = nodes,
                          .vertex_begin = nodes,
                          .triangle_begin = triangles,
                          .material = disc.material,
                          .rest = disc.rest,
                          .vertex_material = disc.material,
                          .triangles = disc.triangles,
                          .loop_count = 1,
                          .outline_count = disc.rim,
                          .outline = disc.material + 2 * (disc.node_count - disc.rim),
                          .outline_begin = rim,
                          .loop_begin = zero};
    StateWriter *writer = state_create(path, NULL);
    bool good = writer && state_write_header(writer, &header, NULL) &&
                state_write_layout(writer, &layout, NULL) && write_frames(writer, shape, &disc) &&
                state_write_done(writer, "finished", NULL);
    good = writer && state_close(writer, NULL) && good;
    arena_free(&arena);
    return good;
}
