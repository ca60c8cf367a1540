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
    camera.half_x = camera.half_y * aspect;
    camera.distance = vec3_dot(vec3_sub(camera.target, camera.eye), camera.forward);
    camera.scale = camera.half_y * (camera.perspective ? camera.distance : 1.0);
    camera.near = camera.perspective ? NEAR_PART * camera.distance
                                     : fmin(0.0, camera.distance - FAR_SCALES * camera.scale);
    camera.far = camera.distance + FAR_SCALES * camera.scale;
    camera.floor_height = floor_of(film, &camera, reach, floor);
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
