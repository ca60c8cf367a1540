/* FLIP for pictures of a screen [Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild 2020:
 * FLIP: a difference evaluator for alternating images]. Numbers and names of the paper, section 4.
 *
 * Colour: both pictures in an opponent space, blurred as the eye blurs them at that distance, then
 * HyAB distance in a Lab whose chroma shrinks in the dark. Features: edges and points of the
 * lightness. Both meet in one number a pixel: colour ^ (1 - feature). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/image.h"
#include "render/srgb.h"
#include "sim/base/memory.h"
#include "sim/base/vec.h"

#define MOST_TAPS 64
#define COLOR_POWER 0.7     /* q_c */
#define COLOR_KNEE 0.4      /* p_c */
#define COLOR_KNEE_AT 0.95  /* p_t */
#define FEATURE_WIDTH 0.082 /* [deg] w */
#define FEATURE_POWER 0.5   /* q_f */

typedef struct Kernel {
    int radius;
    float taps[2 * MOST_TAPS + 1];
} Kernel;

/* Planes of one picture: lightness and two opponent colours, (height x width) each. */
typedef struct Planes {
    int width, height;
    float *plane[3];
} Planes;

static float *new_plane(const Image *image) {
    float *plane = memory_zeroed((size_t)image->width * (size_t)image->height, sizeof *plane);
    return plane;
}

/* ---- colour spaces ---- */

static const double to_xyz[3][3] = {
    {10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0},
    {2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0},
    {1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0}};

/* XYZ over the white of the screen. */
static void find_xyz(const double rgb[3], double xyz[3]) {
    for (int i = 0; i < 3; i++) {
        double white = to_xyz[i][0] + to_xyz[i][1] + to_xyz[i][2];
        xyz[i] = (to_xyz[i][0] * rgb[0] + to_xyz[i][1] * rgb[1] + to_xyz[i][2] * rgb[2]) / white;
    }
}

/* The inverse of find_xyz, by Cramer's rule. */
static void find_rgb(const double xyz[3], double rgb[3]) {
    Vec3 row[3], right;
    double b[3];
    for (int i = 0; i < 3; i++) {
        row[i] = vec3(to_xyz[i][0], to_xyz[i][1], to_xyz[i][2]);
        b[i] = xyz[i] * (row[i].x + row[i].y + row[i].z);
    }
    double det = vec3_dot(row[0], vec3_cross(row[1], row[2]));
    right = vec3_scale(b[0] / det, vec3_cross(row[1], row[2]));
    right = vec3_axpy(right, b[1] / det, vec3_cross(row[2], row[0]));
    right = vec3_axpy(right, b[2] / det, vec3_cross(row[0], row[1]));
    vec3_store(rgb, right);
}

static void find_opponent(const double xyz[3], float out[3]) {
    out[0] = (float)(116.0 * xyz[1] - 16.0);
    out[1] = (float)(500.0 * (xyz[0] - xyz[1]));
    out[2] = (float)(200.0 * (xyz[1] - xyz[2]));
}

static double lab_curve(double t) {
    const double d = 6.0 / 29.0;
    return t > d * d * d ? cbrt(t) : t / (3.0 * d * d) + 4.0 / 29.0;
}

/* Lab whose colour fades with the lightness (Hunt effect). */
static void find_lab(const double rgb[3], double lab[3]) {
    double xyz[3];
    find_xyz(rgb, xyz);
    double x = lab_curve(xyz[0]), y = lab_curve(xyz[1]), z = lab_curve(xyz[2]);
    lab[0] = 116.0 * y - 16.0;
    lab[1] = 0.01 * lab[0] * 500.0 * (x - y);
    lab[2] = 0.01 * lab[0] * 200.0 * (y - z);
}

static double hyab(const double a[3], const double b[3]) {
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

static Planes create_planes(const Image *image) {
    Planes planes = {image->width, image->height, {NULL}};
    double curve[256];
    for (int i = 0; i < 256; i++) {
        curve[i] = srgb_light(i / 255.0);
    }
    for (int k = 0; k < 3; k++) {
        planes.plane[k] = new_plane(image);
    }
    for (size_t i = 0; i < (size_t)image->width * (size_t)image->height; i++) {
        const uint8_t *p = image->rgba + IMAGE_CHANNELS * i;
        double rgb[3] = {curve[p[0]], curve[p[1]], curve[p[2]]}, xyz[3];
        float opponent[3];
        find_xyz(rgb, xyz);
        find_opponent(xyz, opponent);
        for (int k = 0; k < 3; k++) {
            planes.plane[k][i] = opponent[k];
        }
    }
    return planes;
}

static void free_planes(Planes *planes) {
    for (int k = 0; k < 3; k++) {
        free(planes->plane[k]);
    }
}

/* ---- filters; pixels beyond the border are those at it ---- */

static int clamp_index(int i, int count) { return i < 0 ? 0 : i < count ? i : count - 1; }

static void filter(const float *in, int width, int height, const Kernel *along,
                   const Kernel *across, float *scratch, float *out) {
    for (int y = 0; y < height; y++) {
        const float *row = in + (size_t)y * width;
        for (int x = 0; x < width; x++) {
            float sum = 0.0f;
            for (int k = -along->radius; k <= along->radius; k++) {
                sum += along->taps[k + along->radius] * row[clamp_index(x + k, width)];
            }
            scratch[(size_t)y * width + x] = sum;
        }
    }
    for (int y = 0; y < height; y++) {
        float *to = out + (size_t)y * width;
        memset(to, 0, sizeof *to * (size_t)width);
        for (int k = -across->radius; k <= across->radius; k++) {
            const float *row = scratch + (size_t)clamp_index(y + k, height) * width;
            float tap = across->taps[k + across->radius];
            for (int x = 0; x < width; x++) {
                to[x] += tap * row[x];
            }
        }
    }
}

/* exp(-x^2 factor) with sum 1; *sum: before that. */
static Kernel gauss(double factor, int radius, double *sum) {
    Kernel kernel = {.radius = radius};
    double values[2 * MOST_TAPS + 1] = {0};
    *sum = 0.0;
    for (int i = -radius; i <= radius; i++) {
        values[i + radius] = exp(-factor * i * i);
        *sum += values[i + radius];
    }
    for (int i = 0; i <= 2 * radius; i++) {
        kernel.taps[i] = (float)(values[i] / *sum);
    }
    return kernel;
}

/* Contrast sensitivity: a1 sqrt(pi / b1) exp(-pi^2 x^2 / b1) + ..., x in degrees. */
static void blur_plane(Planes *planes, int k, float *scratch[2]) {
    static const double a[3][2] = {{1.0, 0.0}, {1.0, 0.0}, {34.1, 13.5}};
    static const double b[3][2] = {{0.0047, 1e-5}, {0.0053, 1e-5}, {0.04, 0.025}};
    const double density = IMAGE_FLIP_DENSITY;
    int radius = (int)ceil(3.0 * sqrt(0.04 / (2.0 * PI * PI)) * density);
    size_t count = (size_t)planes->width * (size_t)planes->height;
    double weights[2], total = 0.0, sum;
    Kernel kernels[2];
    for (int i = 0; i < 2; i++) {
        kernels[i] = gauss(PI * PI / (b[k][i] * density * density), radius, &sum);
        weights[i] = a[k][i] * sqrt(PI / b[k][i]) * sum * sum;
        total += weights[i];
    }
    float *result = memory_new(sizeof *result * count);
    filter(planes->plane[k], planes->width, planes->height, &kernels[0], &kernels[0], scratch[0],
           result);
    if (weights[1] > 0.0) {
        filter(planes->plane[k], planes->width, planes->height, &kernels[1], &kernels[1],
               scratch[0], scratch[1]);
        float first = (float)(weights[0] / total), second = (float)(weights[1] / total);
        for (size_t i = 0; i < count; i++) {
            result[i] = first * result[i] + second * scratch[1][i];
        }
    }
    free(planes->plane[k]);
    planes->plane[k] = result;
}

/* First or second derivative of a Gaussian; its positive and negative taps sum to 1 and -1. */
static Kernel derivative(double sigma, int radius, int order) {
    Kernel kernel = {.radius = radius};
    double positive = 0.0, negative = 0.0, values[2 * MOST_TAPS + 1] = {0};
    for (int i = -radius; i <= radius; i++) {
        double g = exp(-i * i / (2.0 * sigma * sigma));
        double value = order == 1 ? -i * g : (i * i / (sigma * sigma) - 1.0) * g;
        values[i + radius] = value;
        positive += value > 0.0 ? value : 0.0;
        negative -= value < 0.0 ? value : 0.0;
    }
    for (int i = 0; i <= 2 * radius; i++) {
        kernel.taps[i] = (float)(values[i] / (values[i] > 0.0 ? positive : negative));
    }
    return kernel;
}

/* How strong edges (order 1) or points (order 2) are, out (height x width). */
static void find_features(const Planes *planes, int order, float *scratch[2], float *out) {
    double sigma = 0.5 * FEATURE_WIDTH * IMAGE_FLIP_DENSITY, sum;
    int radius = (int)ceil(3.0 * sigma);
    size_t count = (size_t)planes->width * (size_t)planes->height;
    Kernel blur = gauss(0.5 / (sigma * sigma), radius, &sum);
    Kernel slope = derivative(sigma, radius, order);
    const float *lightness = planes->plane[0];
    filter(lightness, planes->width, planes->height, &slope, &blur, scratch[0], out);
    filter(lightness, planes->width, planes->height, &blur, &slope, scratch[0], scratch[1]);
    for (size_t i = 0; i < count; i++) {
        out[i] = hypotf(out[i], scratch[1][i]) / 116.0f; /* the lightness is 116 (0..1) - 16 */
    }
}

/* ---- the two parts ---- */

/* Largest difference of edges and of points, 0..1, to the power q_f. */
static void compare_features(const Planes *a, const Planes *b, float *scratch[2], float *out) {
    size_t count = (size_t)a->width * (size_t)a->height;
    float *of_a = memory_zeroed(count, sizeof *of_a), *of_b = memory_zeroed(count, sizeof *of_b);
    memset(out, 0, sizeof *out * count);
    for (int order = 1; order <= 2; order++) {
        find_features(a, order, scratch, of_a);
        find_features(b, order, scratch, of_b);
        for (size_t i = 0; i < count; i++) {
            float d = fabsf(of_a[i] - of_b[i]);
            out[i] = d > out[i] ? d : out[i];
        }
    }
    for (size_t i = 0; i < count; i++) {
        out[i] = (float)pow(sqrt(0.5) * out[i], FEATURE_POWER);
    }
    free(of_a);
    free(of_b);
}

static void lab_at(const Planes *planes, size_t i, double lab[3]) {
    double y = (planes->plane[0][i] + 16.0) / 116.0, rgb[3];
    double xyz[3] = {y + planes->plane[1][i] / 500.0, y, y - planes->plane[2][i] / 200.0};
    find_rgb(xyz, rgb);
    for (int k = 0; k < 3; k++) {
        rgb[k] = fmax(0.0, fmin(1.0, rgb[k]));
    }
    find_lab(rgb, lab);
}

/* Distance of colours, 0..1, of pictures that were blurred. */
static double compare_color(const Planes *a, const Planes *b, size_t i, double most) {
    double lab_a[3], lab_b[3];
    lab_at(a, i, lab_a);
    lab_at(b, i, lab_b);
    double d = pow(hyab(lab_a, lab_b), COLOR_POWER), knee = COLOR_KNEE * most;
    return d < knee ? COLOR_KNEE_AT * d / knee
                    : COLOR_KNEE_AT + (d - knee) / (most - knee) * (1.0 - COLOR_KNEE_AT);
}

static double largest_distance(void) {
    const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    double lab_green[3], lab_blue[3];
    find_lab(green, lab_green);
    find_lab(blue, lab_blue);
    return pow(hyab(lab_green, lab_blue), COLOR_POWER);
}

double image_compare_flip(const Image *a, const Image *b, float *map) {
    ASSERT(a->width == b->width && a->height == b->height);
    size_t count = (size_t)a->width * (size_t)a->height;
    Planes planes[2] = {create_planes(a), create_planes(b)};
    float *scratch[2] = {new_plane(a), new_plane(a)}, *feature = new_plane(a);
    compare_features(&planes[0], &planes[1], scratch, feature);
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 3; k++) {
            blur_plane(&planes[i], k, scratch);
        }
    }
    double sum = 0.0, most = largest_distance();
    for (size_t i = 0; i < count; i++) {
        double color = compare_color(&planes[0], &planes[1], i, most);
        double flip = pow(color, 1.0 - feature[i]);
        sum += flip;
        if (map) {
            map[i] = (float)flip;
        }
    }
    for (int i = 0; i < 2; i++) {
        free_planes(&planes[i]);
        free(scratch[i]);
    }
    free(feature);
    return count ? sum / (double)count : 0.0;
}
