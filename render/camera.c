#include "render/camera.h"

#include <math.h>

#define AUTO_FILL 0.80        /* part of the picture that an automatic camera fills */
#define AUTO_SMALLEST 1e-3    /* [m] a motion smaller than this is framed as if it were this big */
#define NEAR_PART 0.04        /* of the distance to the target */
#define FAR_SCALES 60.0       /* of the scale, behind the target: well behind the wall */
#define FLOOR_GAP 0.03        /* of the scale: free space under the lowest point */
#define ORTHOGRAPHIC_BACK 4.0 /* half views from the target to a fitted orthographic eye */
#define METRES_PER_MM 1e-3

typedef struct Basis {
    Vec3 right, up, forward;
} Basis;

static Basis basis_of(const Film *film) {
    Vec3 forward = vec3_unit(vec3_sub(film->target, film->eye), vec3(0, 1, 0));
    Vec3 side = vec3_cross(forward, film->up);
    if (vec3_length(side) < 1e-6) { /* looking along `up` */
        side = vec3_cross(forward, vec3(0, 1, 0));
    }
    Vec3 right = vec3_unit(side, vec3(1, 0, 0));
    return (Basis){right, vec3_cross(right, forward), forward};
}

bool camera_needs_reach(const Film *film, bool floor_known) {
    bool fits = film->camera == CAMERA_AUTO ||
                (film->camera == CAMERA_ORTHOGRAPHIC && film->pixels_per_mm <= 0.0);
    return fits || (film->floor && isnan(film->floor_height) && !floor_known);
}

CameraReach camera_reach_start(const Film *film, int width, int height) {
    Basis basis = basis_of(film);
    bool perspective = film->camera != CAMERA_ORTHOGRAPHIC;
    double tan_y = perspective ? tan(0.5 * film->fov) : 0.0;
    return (CameraReach){.right = basis.right,
                         .up = basis.up,
                         .forward = basis.forward,
                         .tan_x = tan_y * width / height * AUTO_FILL,
                         .tan_y = tan_y * AUTO_FILL,
                         .left = -INFINITY,
                         .right_most = -INFINITY,
                         .below = -INFINITY,
                         .above = -INFINITY,
                         .nearest = INFINITY,
                         .farthest = -INFINITY,
                         .lowest = INFINITY,
                         .empty = true};
}

void camera_reach_add(CameraReach *reach, Vec3 p) {
    double x = vec3_dot(p, reach->right), y = vec3_dot(p, reach->up);
    double z = vec3_dot(p, reach->forward);
    reach->left = fmax(reach->left, -x - reach->tan_x * z);
    reach->right_most = fmax(reach->right_most, x - reach->tan_x * z);
    reach->below = fmax(reach->below, -y - reach->tan_y * z);
    reach->above = fmax(reach->above, y - reach->tan_y * z);
    reach->nearest = fmin(reach->nearest, z);
    reach->farthest = fmax(reach->farthest, z);
    reach->lowest = fmin(reach->lowest, p.z);
    reach->empty = false;
}

/* The nearest eye that sees every point inside the filled part of the picture: each point asks
 * |p.right - x| <= tan_x (p.forward + back), which is linear in x and `back`. */
static void fit_perspective(Camera *camera, const CameraReach *reach) {
    double x = 0.5 * (reach->right_most - reach->left), y = 0.5 * (reach->above - reach->below);
    double back = fmax(0.5 * (reach->right_most + reach->left) / reach->tan_x,
                       0.5 * (reach->above + reach->below) / reach->tan_y);
    double middle = 0.5 * (reach->nearest + reach->farthest);
    back = fmax(back, AUTO_SMALLEST - reach->nearest);
    Vec3 axis = vec3_axpy(vec3_scale(x, camera->right), y, camera->up);
    camera->eye = vec3_axpy(axis, -back, camera->forward);
    camera->target = vec3_axpy(axis, middle, camera->forward);
}

static void fit_orthographic(Camera *camera, const CameraReach *reach, double aspect) {
    double x = 0.5 * (reach->right_most - reach->left), y = 0.5 * (reach->above - reach->below);
    double half_x = 0.5 * (reach->right_most + reach->left);
    double half_y = 0.5 * (reach->above + reach->below);
    double middle = 0.5 * (reach->nearest + reach->farthest);
    camera->half_y = fmax(fmax(half_y, half_x / aspect), AUTO_SMALLEST) / AUTO_FILL;
    Vec3 axis = vec3_axpy(vec3_scale(x, camera->right), y, camera->up);
    camera->target = vec3_axpy(axis, middle, camera->forward);
    camera->eye = vec3_axpy(camera->target, -ORTHOGRAPHIC_BACK * camera->half_y, camera->forward);
}

static double floor_of(const Film *film, const Camera *camera, const CameraReach *reach,
                       double floor) {
    if (!isnan(film->floor_height)) {
        return film->floor_height;
    }
    if (!isnan(floor)) {
        return floor;
    }
    return reach && !reach->empty ? reach->lowest - FLOOR_GAP * camera->scale
                                  : camera->target.z - camera->scale;
}

/* What follows from eye, target, basis and half_y. */
static void set_depths(Camera *camera, double aspect) {
    camera->half_x = camera->half_y * aspect;
    camera->distance = vec3_dot(vec3_sub(camera->target, camera->eye), camera->forward);
    camera->scale = camera->half_y * (camera->perspective ? camera->distance : 1.0);
    camera->near = camera->perspective ? NEAR_PART * camera->distance
                                       : fmin(0.0, camera->distance - FAR_SCALES * camera->scale);
    camera->far = camera->distance + FAR_SCALES * camera->scale;
}

Camera camera_create(const Film *film, int width, int height, const CameraReach *reach,
                     double floor) {
    double aspect = (double)width / height;
    Basis basis = basis_of(film);
    Camera camera = {.perspective = film->camera != CAMERA_ORTHOGRAPHIC,
                     .eye = film->eye,
                     .target = film->target,
                     .right = basis.right,
                     .up = basis.up,
                     .forward = basis.forward};
    bool reached = reach && !reach->empty;
    if (camera.perspective) {
        camera.half_y = tan(0.5 * film->fov);
        if (film->camera == CAMERA_AUTO && reached) {
            fit_perspective(&camera, reach);
        }
    } else if (film->pixels_per_mm > 0.0) {
        camera.half_y = 0.5 * height / film->pixels_per_mm * METRES_PER_MM;
    } else if (reached) {
        fit_orthographic(&camera, reach, aspect);
    } else {
        camera.half_y = 1.0;
    }
    set_depths(&camera, aspect);
    camera.floor_height = floor_of(film, &camera, reach, floor);
    return camera;
}

bool camera_moves(const Film *film) {
    return film->move.orbit != 0.0 || film->move.follow || film->move.key_count > 0;
}

/* Slope of a key's number: of the parabola through it and its neighbours, one-sided at the ends. */
static double slope_at(const FilmKey *keys, int count, int i, double (*number)(const FilmKey *)) {
    int a = i > 0 ? i - 1 : i, b = i + 1 < count ? i + 1 : i;
    if (a == i || b == i) {
        return (number(&keys[b]) - number(&keys[a])) / (keys[b].time - keys[a].time);
    }
    double h = keys[i].time - keys[a].time, k = keys[b].time - keys[i].time;
    double left = (number(&keys[i]) - number(&keys[a])) / h;
    double right = (number(&keys[b]) - number(&keys[i])) / k;
    return (k * left + h * right) / (h + k);
}

/* Hermite's cubic between the two keys around a time; the first and last hold outside. */
static double along_keys(const FilmKey *keys, int count, double time,
                         double (*number)(const FilmKey *)) {
    if (time <= keys[0].time || time >= keys[count - 1].time) {
        return number(time <= keys[0].time ? &keys[0] : &keys[count - 1]);
    }
    int i = 0;
    while (i + 2 < count && time >= keys[i + 1].time) {
        i++;
    }
    double h = keys[i + 1].time - keys[i].time, t = (time - keys[i].time) / h, r = 1.0 - t;
    return (1 + 2 * t) * r * r * number(&keys[i]) + t * t * (3 - 2 * t) * number(&keys[i + 1]) +
           t * r * r * h * slope_at(keys, count, i, number) -
           t * t * r * h * slope_at(keys, count, i + 1, number);
}

static double key_eye_x(const FilmKey *key) { return key->eye.x; }
static double key_eye_y(const FilmKey *key) { return key->eye.y; }
static double key_eye_z(const FilmKey *key) { return key->eye.z; }
static double key_target_x(const FilmKey *key) { return key->target.x; }
static double key_target_y(const FilmKey *key) { return key->target.y; }
static double key_target_z(const FilmKey *key) { return key->target.z; }
static double key_fov(const FilmKey *key) { return key->fov; }

static void go_along_keys(const FilmMove *move, double time, Camera *camera) {
    const FilmKey *keys = move->keys;
    int count = move->key_count;
    camera->eye =
        vec3(along_keys(keys, count, time, key_eye_x), along_keys(keys, count, time, key_eye_y),
             along_keys(keys, count, time, key_eye_z));
    camera->target = vec3(along_keys(keys, count, time, key_target_x),
                          along_keys(keys, count, time, key_target_y),
                          along_keys(keys, count, time, key_target_z));
    if (camera->perspective) {
        camera->half_y = tan(0.5 * along_keys(keys, count, time, key_fov));
    }
}

static void go_round(const FilmMove *move, double time, Camera *camera) {
    double span = fmax(move->orbit_end - move->orbit_begin, 1e-9);
    double part = fmin(fmax((time - move->orbit_begin) / span, 0.0), 1.0);
    double angle = move->orbit * part * part * (3.0 - 2.0 * part), c = cos(angle), s = sin(angle);
    Vec3 d = vec3_sub(camera->eye, camera->target);
    camera->eye = vec3_axpy(camera->target, 1.0, vec3(c * d.x - s * d.y, s * d.x + c * d.y, d.z));
}

Camera camera_at(const Film *film, const Camera *start, double time, Vec3 moved) {
    Camera camera = *start;
    const FilmMove *move = &film->move;
    if (!camera_moves(film)) {
        return camera;
    }
    if (move->key_count > 0) {
        go_along_keys(move, time, &camera);
    }
    if (move->orbit != 0.0) {
        go_round(move, time, &camera);
    }
    if (move->follow) {
        camera.eye = vec3_axpy(camera.eye, 1.0, moved);
        camera.target = vec3_axpy(camera.target, 1.0, moved);
    }
    Film seen = *film;
    seen.eye = camera.eye;
    seen.target = camera.target;
    Basis basis = basis_of(&seen);
    camera.right = basis.right, camera.up = basis.up, camera.forward = basis.forward;
    set_depths(&camera, start->half_x / start->half_y);
    return camera;
}

Mat4 camera_clip(const Camera *camera) {
    double n = camera->near, f = camera->far, x = 1.0 / camera->half_x, y = 1.0 / camera->half_y;
    Mat4 view =
        mat4_view(camera->right, camera->up, vec3_scale(-1.0, camera->forward), camera->eye);
    Mat4 clip = camera->perspective ? (Mat4){{x, 0, 0, 0, 0, y, 0, 0, 0, 0, -(f + n) / (f - n), -1,
                                              0, 0, -2.0 * f * n / (f - n), 0}}
                                    : (Mat4){{x, 0, 0, 0, 0, y, 0, 0, 0, 0, -2.0 / (f - n), 0, 0, 0,
                                              -(f + n) / (f - n), 1}};
    return mat4_multiply(clip, view);
}

Mat4 camera_unclip(const Camera *camera) {
    double n = camera->near, f = camera->far, x = camera->half_x, y = camera->half_y;
    Mat4 unclip =
        camera->perspective
            ? (Mat4){{x, 0, 0, 0, 0, y, 0, 0, 0, 0, 0, -(f - n) / (2.0 * f * n), 0, 0, -1,
                      (f + n) / (2.0 * f * n)}}
            : (Mat4){{x, 0, 0, 0, 0, y, 0, 0, 0, 0, -0.5 * (f - n), 0, 0, 0, -0.5 * (f + n), 1}};
    Vec3 r = camera->right, u = camera->up, b = vec3_scale(-1.0, camera->forward), e = camera->eye;
    Mat4 unview = {{r.x, r.y, r.z, 0, u.x, u.y, u.z, 0, b.x, b.y, b.z, 0, e.x, e.y, e.z, 1}};
    return mat4_multiply(unview, unclip);
}

double camera_pixels_per_metre(const Camera *camera, int height) {
    return 0.5 * height / camera->scale;
}
