#include "tests/support/render_states.h"

#include <math.h>
#include <string.h>

#include "sim/scene/mesh_import.h"
#include "sim/state/state.h"

#define RATE 30.0
#define SPEED_STEP 1e-4 /* [s] of the differences that give velocities */
#define TABLE_HEIGHT 0.74
#define TABLE_RADIUS 0.60
#define TABLE_SIDE 2.0
#define TABLE_BEND 0.035 /* [m] radius of the cloth over the rim */
#define SLEEVE_RADIUS 0.08
#define SLEEVE_LENGTH 0.30
#define BALL_RADIUS 0.20
#define BALL_SIDE 0.75
#define DISC_RADIUS 0.30
#define CAPE_WIDTH 1.10
#define CAPE_LENGTH 0.65
#define CAPE_TOP 1.07 /* [m] above the ground, over the shoulders */

const RenderMotion render_motions[] = {
    {"table", "a square cloth over a round table, swaying"},
    {"sleeve", "a closed sleeve that is twisted"},
    {"ball", "a square cloth over a sphere on the floor"},
    {"disc", "a scattered disc that waves"},
    {"figure", "a cape around a figure that turns hips and chest"},
    {"patch", "a flat sheet, strained alike everywhere, on its way"},
    {"roll", "a quarter of a cylinder, at rest"},
};
const int render_motion_count = sizeof render_motions / sizeof render_motions[0];

typedef Vec3 PlaceFunction(double u, double v, double time);

static double smooth(double x) {
    x = x < 0 ? 0 : x > 1 ? 1 : x;
    return x * x * (3 - 2 * x);
}

/* A cloth over a disc of `radius` and rounded rim, hanging in folds; (x, y) from the middle. */
static Vec3 drape(double x, double y, double radius, double bend, double height, double time) {
    double r = hypot(x, y), angle = atan2(y, x), down = r - radius;
    if (down <= 0) {
        return vec3(x, y, height);
    }
    double arc = 0.5 * PI * bend, turn = fmin(down / bend, 0.5 * PI);
    double out = radius + bend * sin(turn), fall = bend * (1 - cos(turn));
    double hang = fmax(down - arc, 0.0), grown = smooth(hang / (0.35 * radius));
    double sway = 0.10 * sin(2.0 * time + angle) * smooth(hang / radius);
    double fold =
        cos(14 * angle + 1.3 * sin(2 * angle + 0.4) + sway * 4) + 0.35 * cos(5 * angle + 1.0);
    double reach = out + (0.075 * fold + 0.035) * grown * radius / 0.6 * smooth(hang / 0.25 + 0.2);
    double twist = 0.05 * grown * sin(7 * angle + 0.5 + time);
    return vec3(reach * cos(angle + twist), reach * sin(angle + twist),
                height - fall - 0.97 * hang);
}

static Vec3 place_table(double u, double v, double time) {
    return drape(u - 0.5 * TABLE_SIDE, v - 0.5 * TABLE_SIDE, TABLE_RADIUS, TABLE_BEND, TABLE_HEIGHT,
                 time);
}

static Vec3 place_sleeve(double u, double v, double time) {
    double angle = u / SLEEVE_RADIUS, z = v - 0.5 * SLEEVE_LENGTH, part = v / SLEEVE_LENGTH;
    double turn = 2.2 * smooth(time / 3.0);
    double waist = sin(PI * part) * sin(PI * part) * turn / 2.2;
    double wrinkle = cos(7 * angle + 9 * (part - 0.5) * turn) * 0.006 * waist;
    double r = SLEEVE_RADIUS * (1 - 0.38 * waist) + wrinkle;
    double a = angle + turn * (smooth(part) - 0.5);
    return vec3(r * cos(a), r * sin(a), z * (1 - 0.08 * turn / 2.2));
}

static Vec3 place_ball(double u, double v, double time) {
    double x = u - 0.5 * BALL_SIDE, y = v - 0.5 * BALL_SIDE, r = hypot(x, y);
    double angle = atan2(y, x), turn = fmin(r / BALL_RADIUS, 0.55 * PI);
    double rest = r - turn * BALL_RADIUS, bigger = BALL_RADIUS + 0.003;
    double grown = smooth(turn / (0.5 * PI) - 0.25) * smooth(0.5 + rest / 0.1);
    double fold = 0.02 * cos(8 * angle + 0.6 * sin(time)) + 0.025;
    double reach = bigger * sin(turn) + 1.6 * grown * fold + 0.25 * rest;
    double z = BALL_RADIUS + bigger * cos(turn) - 0.9 * rest;
    return vec3(reach * cos(angle), reach * sin(angle), fmax(z, 0.004 + 0.01 * r));
}

static Vec3 place_disc(double u, double v, double time) {
    double r = hypot(u, v), angle = atan2(v, u);
    double z = 0.045 * sin(14 * u - 5 * time) * (0.4 + r / DISC_RADIUS) +
               0.03 * sin(9 * v + 3 * time) - 0.5 * r * r * (1 + 0.5 * cos(3 * angle));
    return vec3(u, v, 0.35 + z);
}

/* ---- layouts ---- */

typedef struct Mesh {
    int32_t lattice[4], node_begin[2], triangle_begin[2];
    int node_count, triangle_count, outline_count;
    double *material, *rest, *outline;
    int32_t *triangles;
    int32_t outline_begin[2], loop_begin[2];
} Mesh;

static void add_triangle(Mesh *mesh, int a, int b, int c) {
    int32_t *t = mesh->triangles + 3 * mesh->triangle_count++;
    t[0] = a, t[1] = b, t[2] = c;
}

static Mesh lattice_mesh(Arena *arena, int nu, int nv, bool around, double width, double height) {
    int columns = around ? nu : nu - 1;
    Mesh mesh = {.lattice = {nu, nv, around, 0}, .node_count = nu * nv};
    mesh.material = arena_push(arena, double, 2 * nu * nv);
    mesh.triangles = arena_push(arena, int32_t, 6 * columns * (nv - 1));
    for (int i = 0; i < nu * nv; i++) {
        mesh.material[2 * i] = width * (i % nu) / columns;
        mesh.material[2 * i + 1] = height * (i / nu) / (nv - 1);
    }
    for (int j = 0; j + 1 < nv; j++) {
        for (int i = 0; i < columns; i++) {
            int a = j * nu + i, b = j * nu + (i + 1) % nu;
            add_triangle(&mesh, a, b, b + nu);
            add_triangle(&mesh, a, b + nu, a + nu);
        }
    }
    double corners[8] = {0, 0, width, 0, width, height, 0, height};
    mesh.outline_count = 4;
    mesh.outline = memcpy(arena_push(arena, double, 8), corners, sizeof corners);
    return mesh;
}

/* Rings of 6 k nodes: a disc without a lattice. */
static Mesh disc_mesh(Arena *arena, int rings, double radius) {
    int nodes = 1 + 3 * rings * (rings + 1);
    Mesh mesh = {.node_count = nodes, .outline_count = 6 * rings};
    mesh.material = arena_push(arena, double, 2 * nodes);
    mesh.triangles = arena_push(arena, int32_t, 3 * 6 * rings * rings);
    for (int k = 1, node = 1; k <= rings; k++) {
        for (int i = 0; i < 6 * k; i++, node++) {
            double angle = 2 * PI * i / (6 * k), r = radius * k / rings;
            mesh.material[2 * node] = r * cos(angle);
            mesh.material[2 * node + 1] = r * sin(angle);
        }
    }
    for (int k = 1; k <= rings; k++) {
        int inner = k == 1 ? 0 : 1 + 3 * (k - 1) * (k - 2), outer = 1 + 3 * k * (k - 1);
        int inner_count = k == 1 ? 1 : 6 * (k - 1);
        for (int side = 0; side < 6; side++) {
            for (int i = 0; i < k; i++) {
                int a = outer + side * k + i, b = outer + (side * k + i + 1) % (6 * k);
                int c = inner + (side * (k - 1) + i) % inner_count;
                add_triangle(&mesh, a, b, c);
                if (i + 1 < k) {
                    add_triangle(&mesh, b, inner + (side * (k - 1) + i + 1) % inner_count, c);
                }
            }
        }
    }
    mesh.outline = mesh.material + 2 * (nodes - 6 * rings);
    return mesh;
}

static bool write_layout(StateWriter *writer, Mesh *mesh, Arena *arena, Error *error) {
    mesh->node_begin[1] = mesh->node_count;
    mesh->triangle_begin[1] = mesh->triangle_count;
    mesh->outline_begin[1] = mesh->outline_count;
    mesh->loop_begin[1] = 1;
    mesh->rest = arena_push(arena, double, 3 * mesh->node_count);
    for (int i = 0; i < mesh->node_count; i++) {
        mesh->rest[3 * i] = mesh->material[2 * i];
        mesh->rest[3 * i + 1] = mesh->material[2 * i + 1];
    }
    StateLayout layout = {.cloth_count = 1,
                          .node_count = mesh->node_count,
                          .vertex_count = mesh->node_count,
                          .triangle_count = mesh->triangle_count,
                          .lattice = mesh->lattice,
                          .node_begin = mesh->node_begin,
                          .vertex_begin = mesh->node_begin,
                          .triangle_begin = mesh->triangle_begin,
                          .material = mesh->material,
                          .rest = mesh->rest,
                          .vertex_material = mesh->material,
                          .triangles = mesh->triangles,
                          .loop_count = 1,
                          .outline_count = mesh->outline_count,
                          .outline = mesh->outline,
                          .outline_begin = mesh->outline_begin,
                          .loop_begin = mesh->loop_begin};
    return state_write_layout(writer, &layout, error);
}

/* open in front, from the shoulders down, wider below */
static Vec3 place_cape(double u, double v, double time) {
    double down = 1.0 - v / CAPE_LENGTH, angle = (u / CAPE_WIDTH - 0.5) * 1.5 * PI + 0.5 * PI;
    double fold = 0.02 * down * cos(9 * angle + sin(2 * PI * time)) + 0.10 * down + 0.015;
    angle += 0.2 * (1 - down) * sin(2 * PI * time);
    double wide = 0.185 + fold, deep = 0.115 + fold + 0.03 * down;
    return vec3(wide * cos(angle), deep * sin(angle), CAPE_TOP - 0.97 * CAPE_LENGTH * down);
}

static Vec3 place_patch(double u, double v, double time) {
    double weft = (1.0 + RENDER_PATCH_WEFT) * v, along = RENDER_PATCH_SPEED * time;
    return vec3((1.0 + RENDER_PATCH_WARP) * u + weft * sin(RENDER_PATCH_SHEAR) - 0.3 + 0.6 * along,
                0, weft * cos(RENDER_PATCH_SHEAR) - 0.2 + 0.8 * along);
}

static Vec3 place_roll(double u, double v, double time) {
    (void)time;
    double angle = u / RENDER_ROLL_RADIUS - 0.25 * PI;
    return vec3(RENDER_ROLL_RADIUS * sin(angle), -RENDER_ROLL_RADIUS * cos(angle), v - 0.1);
}

/* ---- motions ---- */

typedef struct Setup {
    PlaceFunction *place;
    Mesh mesh;
    Film film;
    const char *look;
    int obstacle_count;
    StateObstacle obstacles[3];
    Pose poses[3];
    MeshDef figure;
    StateMesh mesh_of_figure;
} Setup;

static void add_obstacle(Setup *setup, const char *name, const char *look, Solid solid, Vec3 at) {
    StateObstacle *obstacle = &setup->obstacles[setup->obstacle_count];
    strcpy(obstacle->name, name);
    strcpy(obstacle->look, look);
    obstacle->solid = solid;
    setup->poses[setup->obstacle_count] = pose_identity();
    setup->poses[setup->obstacle_count++].shift = at;
}

static bool add_figure(Setup *setup, Arena *arena) {
    MeshImportDef def = mesh_import_default();
    def.path = TOILE_SOURCE_DIR "/assets/meshes/mannequin.glb";
    def.animated = true;
    MeshDef *mesh = &setup->figure;
    if (!mesh_import(&def, arena, mesh, NULL)) {
        return false;
    }
    setup->mesh_of_figure =
        (StateMesh){mesh->vertex_count, mesh->triangle_count, mesh->vertices, mesh->triangles, true,
                    mesh->closed};
    add_obstacle(setup, "figure", "clay", (Solid){SOLID_SPHERE, {0, 0, 0}, mesh->high[2]},
                 vec3(0, 0, 0));
    setup->obstacles[0].mesh = &setup->mesh_of_figure;
    return true;
}

static bool set_up(const char *motion, int nodes, Arena *arena, Setup *setup) {
    *setup = (Setup){.film = film_default(), .look = "teal-twill"};
    setup->film.rate = RATE;
    if (strcmp(motion, "table") == 0) {
        setup->place = place_table;
        setup->mesh = lattice_mesh(arena, nodes, nodes, false, TABLE_SIDE, TABLE_SIDE);
        Solid top = {SOLID_CYLINDER, {0, 0, 0.015}, TABLE_RADIUS};
        Solid foot = {SOLID_CYLINDER, {0, 0, 0.015}, 0.30};
        Solid leg = {SOLID_CYLINDER, {0, 0, 0.35}, 0.05};
        add_obstacle(setup, "top", "wood", top, vec3(0, 0, TABLE_HEIGHT - 0.02));
        add_obstacle(setup, "foot", "wood", foot, vec3(0, 0, -0.285));
        add_obstacle(setup, "leg", "wood", leg, vec3(0, 0, 0.08));
        setup->film.floor_height = -0.30;
        setup->film.camera = CAMERA_PERSPECTIVE; /* does not wait for the end of a run */
        setup->film.eye = vec3(1.25, -2.75, 1.35);
        setup->film.target = vec3(0, 0, 0.25);
    } else if (strcmp(motion, "sleeve") == 0) {
        setup->place = place_sleeve;
        setup->mesh =
            lattice_mesh(arena, nodes * 3 / 2, nodes, true, 2 * PI * SLEEVE_RADIUS, SLEEVE_LENGTH);
        setup->look = "wool";
    } else if (strcmp(motion, "ball") == 0) {
        setup->place = place_ball;
        setup->mesh = lattice_mesh(arena, nodes, nodes, false, BALL_SIDE, BALL_SIDE);
        add_obstacle(setup, "ball", "clay", (Solid){SOLID_SPHERE, {0, 0, 0}, BALL_RADIUS},
                     vec3(0, 0, BALL_RADIUS));
        add_obstacle(setup, "floor", "clay", (Solid){SOLID_PLANE, {0, 0, 0}, 0}, vec3(0, 0, 0));
        setup->look = "linen";
    } else if (strcmp(motion, "disc") == 0) {
        setup->place = place_disc;
        setup->mesh = disc_mesh(arena, nodes / 2, DISC_RADIUS);
        add_obstacle(setup, "box", "metal", (Solid){SOLID_BOX, {0.08, 0.06, 0.05}, 0.01},
                     vec3(0.05, -0.05, 0.05));
        setup->look = "satin";
    } else if (strcmp(motion, "figure") == 0) {
        setup->place = place_cape;
        setup->mesh = lattice_mesh(arena, 2 * nodes, nodes, false, CAPE_WIDTH, CAPE_LENGTH);
        setup->look = "wool";
        setup->film.camera = CAMERA_PERSPECTIVE;
        setup->film.eye = vec3(1.1, -2.9, 1.3);
        setup->film.target = vec3(0, 0, 0.8);
        return add_figure(setup, arena);
    } else if (strcmp(motion, "patch") == 0 || strcmp(motion, "roll") == 0) {
        bool roll = motion[0] == 'r';
        setup->place = roll ? place_roll : place_patch;
        setup->mesh =
            roll ? lattice_mesh(arena, nodes, nodes, false, 0.5 * PI * RENDER_ROLL_RADIUS, 0.2)
                 : lattice_mesh(arena, nodes, nodes, false, 0.6, 0.4);
        setup->film.camera = CAMERA_PERSPECTIVE;
        setup->film.eye = vec3(0, -1.5, 0);
        setup->film.floor_height = -0.5;
    } else {
        return false;
    }
    return true;
}

static bool write_frames(StateWriter *writer, const Setup *setup, int first, int count,
                         Arena *arena, Error *error) {
    const Mesh *mesh = &setup->mesh;
    double *x = arena_push(arena, double, 3 * mesh->node_count);
    double *v = arena_push(arena, double, 3 * mesh->node_count);
    double *moved = arena_push(arena, double, 3 * setup->figure.vertex_count);
    bool good = true;
    for (int frame = first; good && frame < first + count; frame++) {
        double time = frame / RATE;
        for (int i = 0; i < mesh->node_count; i++) {
            const double *a = mesh->material + 2 * i;
            Vec3 before = setup->place(a[0], a[1], time - SPEED_STEP);
            Vec3 after = setup->place(a[0], a[1], time + SPEED_STEP);
            vec3_store(x + 3 * i, setup->place(a[0], a[1], time));
            vec3_store(v + 3 * i, vec3_scale(0.5 / SPEED_STEP, vec3_sub(after, before)));
        }
        StateFrame state = {.frame = frame,
                            .time = time,
                            .x = x,
                            .v = v,
                            .pose_count = setup->obstacle_count,
                            .pose = setup->poses,
                            .moved_count = setup->figure.vertex_count,
                            .moved = moved,
                            .contact_force = v}; /* as many newtons: any numbers will do */
        if (setup->figure.vertex_count > 0) {
            mesh_positions(&setup->figure, time, moved);
        }
        good = state_write_frame(writer, &state, mesh->node_count, NULL, 0, error);
    }
    return good;
}

bool render_states_write(const char *motion, const char *path, int first, int frame_count,
                         int nodes, const char *look, bool finish, Error *error) {
    Arena arena = {0};
    Setup setup;
    if (!set_up(motion, nodes, &arena, &setup)) {
        return error_set(error, EXIT_USAGE, "no motion is called '%s'", motion);
    }
    setup.film.frame_count = frame_count;
    StateCloth cloth = {.name = "cloth", .fabric = "made-up", .thickness = 0.0005};
    strcpy(cloth.look, look ? look : setup.look);
    StateHeader header = {.program = "toile tests",
                          .scene_path = motion,
                          .scene_text = "",
                          .film = setup.film,
                          .cloth_count = 1,
                          .cloths = &cloth,
                          .obstacle_count = setup.obstacle_count,
                          .obstacles = setup.obstacles};
    StateWriter *writer = state_create(path, error);
    bool good = writer && state_write_header(writer, &header, error) &&
                write_layout(writer, &setup.mesh, &arena, error) &&
                write_frames(writer, &setup, first, frame_count, &arena, error) &&
                (!finish || state_write_done(writer, "finished", error));
    good = (!writer || state_close(writer, good ? error : NULL)) && good;
    arena_free(&arena);
    return good;
}
