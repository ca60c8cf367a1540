#include "render/swatch.h"

#include <math.h>
#include <string.h>

#define NODES_U 61
#define NODES_V 61
#define SWATCH_WIDTH 0.26  /* [m] */
#define SWATCH_HEIGHT 0.30 /* [m] */
#define FOLD_LENGTH 0.085  /* [m] of cloth in a fold */
#define FOLD_DEPTH 0.011   /* [m] at the lower border */
#define FOLD_PINCH 0.80    /* width that is left of the cloth's */
#define ROLL_RADIUS 0.016  /* [m] of the corner that is turned over */
#define ROLL_ANGLE 2.9     /* [rad] then it lies flat */
#define ROLL_BEGIN 0.225   /* [m] of the diagonal from the upper left corner */
#define CLOSE_WIDTH 0.016  /* [m] seen by the close view */
#define CLOSE_U 0.215      /* [m] where it looks */
#define CLOSE_V 0.170
#define BALL_RADIUS 0.09 /* [m] */
#define TRIANGLES ((NODES_U - 1) * (NODES_V - 1) * 2)

/* A frame of states without a file. */
typedef struct Swatch {
    StateLayout layout;
    StateFrame frame;
    Arena arena;
} Swatch;

/* Where the point (u, v) hangs, the warp upright: x to the right, y away from the camera, z up. */
static Vec3 place(double u, double v) {
    double down = SWATCH_HEIGHT - u, part = down / SWATCH_HEIGHT, right = SWATCH_WIDTH - v;
    Vec3 diagonal = {0.78, 0.0, -0.6257795138864806}; /* to the right and down */
    double past = diagonal.x * right - diagonal.z * down - ROLL_BEGIN;
    double x = right, z = -down, out = 0.0;
    if (past > 0.0) { /* rolled up towards the camera, the rest straight on */
        double angle = fmin(past / ROLL_RADIUS, ROLL_ANGLE), rest = past - angle * ROLL_RADIUS;
        double along = ROLL_RADIUS * sin(angle) + rest * cos(angle) - past;
        out = ROLL_RADIUS * (1.0 - cos(angle)) + rest * sin(angle);
        x += diagonal.x * along;
        z += diagonal.z * along;
    }
    double wave = 2.0 * PI * (x / FOLD_LENGTH + 0.12 * sin(5.0 * part));
    double depth = FOLD_DEPTH * (0.25 + 0.75 * part);
    return vec3((x - 0.5 * SWATCH_WIDTH) * FOLD_PINCH, -out - depth * sin(wave),
                z + 0.5 * SWATCH_HEIGHT);
}

static void fill_nodes(Swatch *swatch) {
    int count = NODES_U * NODES_V;
    double *material = arena_push(&swatch->arena, double, 2 * count);
    double *x = arena_push(&swatch->arena, double, 3 * count);
    double *v = arena_push(&swatch->arena, double, 3 * count);
    double *force = arena_push(&swatch->arena, double, 3 * count);
    for (int i = 0; i < count; i++) {
        double a = SWATCH_HEIGHT * (i % NODES_U) / (NODES_U - 1);
        double b = SWATCH_WIDTH * (i / NODES_U) / (NODES_V - 1);
        material[2 * i] = a, material[2 * i + 1] = b;
        vec3_store(x + 3 * i, place(a, b));
        v[3 * i + 1] =
            SWATCH_HEIGHT - a; /* it swings about its upper border, once round a second */
        force[3 * i + 1] = fmax(x[3 * i + 1], 0.0); /* a wall would press on the folds behind */
    }
    swatch->layout.material = swatch->layout.vertex_material = material;
    swatch->frame.x = x;
    swatch->frame.v = v;
    swatch->frame.contact_force = force;
}

static void fill_triangles(Swatch *swatch) {
    int32_t *t = arena_push(&swatch->arena, int32_t, 3 * TRIANGLES);
    swatch->layout.triangles = t;
    for (int j = 0; j + 1 < NODES_V; j++) {
        for (int i = 0; i + 1 < NODES_U; i++, t += 6) {
            int32_t a = j * NODES_U + i, c = a + NODES_U;
            int32_t corners[6] = {a, a + 1, c + 1, a, c + 1, c};
            memcpy(t, corners, sizeof corners);
        }
    }
}

static Swatch swatch_create(void) {
    Swatch swatch = {0};
    int count = NODES_U * NODES_V;
    int32_t lattice[4] = {NODES_U, NODES_V, 0, 0};
    int32_t ranges[4] = {0, count, 0, TRIANGLES};
    int32_t *kept = arena_push(&swatch.arena, int32_t, 8);
    memcpy(kept, lattice, sizeof lattice);
    memcpy(kept + 4, ranges, sizeof ranges);
    swatch.layout = (StateLayout){.cloth_count = 1,
                                  .node_count = count,
                                  .vertex_count = count,
                                  .triangle_count = TRIANGLES,
                                  .lattice = kept,
                                  .node_begin = kept + 4,
                                  .vertex_begin = kept + 4,
                                  .triangle_begin = kept + 6};
    fill_nodes(&swatch);
    fill_triangles(&swatch);
    return swatch;
}

static Film film_of(Vec3 eye, Vec3 target, double floor) {
    Film film = film_default();
    film.camera = CAMERA_PERSPECTIVE;
    film.eye = eye;
    film.target = target;
    film.fov = 0.42;
    film.floor_height = floor;
    return film;
}

static Film film_of_cloth(SwatchView view, int width, int height) {
    if (view == SWATCH_WHOLE) {
        return film_of(vec3(-0.20, -0.92, 0.16), vec3(-0.005, 0, -0.006), -0.20);
    }
    Vec3 target = place(CLOSE_U, CLOSE_V);
    double distance = 0.5 * CLOSE_WIDTH / (tan(0.5 * 0.42) * width / height);
    return film_of(vec3_axpy(target, distance, vec3_unit(vec3(-0.3, -1.0, 0.15), target)), target,
                   -0.20);
}

/* The numbers of a measuring look over the cloth, and a range that they fill. */
static void fill_values(Swatch *swatch, QuantityKind kind, Resampler *resampler,
                        QuantityRange *range) {
    int count = swatch->layout.vertex_count;
    double *values = arena_push(&swatch->arena, double, count), most = 0.0;
    quantity_compute(kind, &swatch->layout, &swatch->frame, 0, &swatch->arena, values);
    for (int i = 0; i < count; i++) {
        most = fmax(most, fabs(values[i]));
    }
    most *= 0.7; /* the corner is far from the rest */
    *range = (QuantityRange){quantities[kind].map->diverging ? -most : 0.0, most};
    resample_values(resampler, &swatch->layout, 0, values);
}

static bool paint(const PaintDef *def, const Surface *surface, const Pose *poses, Image *image,
                  Error *error) {
    Painter *painter = paint_create(def, error);
    if (painter) {
        *image = image_create(def->width, def->height);
        paint_set_surface(painter, surface);
        paint_frame(painter, surface, poses, image);
    }
    paint_destroy(painter);
    return painter != NULL;
}

bool swatch_draw_cloth(const Look *look, const Quality *quality, SwatchView view, int width,
                       int height, Image *image, Error *error) {
    Swatch swatch = swatch_create();
    Film film = film_of_cloth(view, width, height);
    QuantityRange ranges[QUANTITY_COUNT] = {{0.0, 1.0}};
    PaintDef def = {.width = width,
                    .height = height,
                    .quality = quality,
                    .camera = camera_create(&film, width, height, NULL, film.floor_height),
                    .floor = true,
                    .cloth_count = 1,
                    .looks = &look,
                    .ranges = ranges};
    ResampleDef density = {.pixels_per_metre = camera_pixels_per_metre(&def.camera, height),
                           .triangle_cap = quality->triangle_cap,
                           .values = look->quantity != QUANTITY_NONE};
    Resampler *resampler = resample_create(&swatch.layout, &density);
    const Surface *surface = resample_frame(resampler, &swatch.layout, swatch.frame.x);
    if (density.values) {
        fill_values(&swatch, look->quantity, resampler, &ranges[look->quantity]);
    }
    bool good = paint(&def, surface, NULL, image, error);
    resample_destroy(resampler);
    arena_free(&swatch.arena);
    return good;
}

bool swatch_draw_prop(const PropLook *look, const Quality *quality, int width, int height,
                      Image *image, Error *error) {
    Film film = film_of(vec3(-0.15, -0.62, 0.20), vec3(0, 0, 0.085), 0.0);
    PaintProp prop = {.solid = {SOLID_SPHERE, {0, 0, 0}, BALL_RADIUS}, .look = look};
    PaintDef def = {.width = width,
                    .height = height,
                    .quality = quality,
                    .camera = camera_create(&film, width, height, NULL, film.floor_height),
                    .floor = true,
                    .prop_count = 1,
                    .props = &prop};
    Pose pose = pose_identity();
    pose.shift.z = BALL_RADIUS;
    Surface nothing = {.low = {0, 0, 0}, .high = {0, 0, 0}};
    return paint(&def, &nothing, &pose, image, error);
}
