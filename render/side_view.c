#include "render/side_view.h"

#include <stdlib.h>
#include <string.h>

#include "sim/base/memory.h"

#define NEAREST 1e-3 /* [m] before the camera */

SideView side_view_create(const Camera *camera, int width, int height) {
    SideView view = {.camera = *camera, .width = width, .height = height};
    size_t samples = (size_t)width * (size_t)height * SIDE_SAMPLES * SIDE_SAMPLES;
    view.depth = memory_zeroed(samples, sizeof *view.depth);
    view.cloth = memory_zeroed(samples, 1);
    for (size_t i = 0; i < samples; i++) {
        view.depth[i] = INFINITY;
    }
    return view;
}

void side_view_free(SideView *view) {
    free(view->depth);
    free(view->cloth);
    *view = (SideView){0};
}

/* One row of a triangle; p: samples and 1 / depth, which is linear in the picture. */
static void fill_row(SideView *view, double p[3][3], const double slope[2], int row, bool cloth) {
    int width = SIDE_SAMPLES * view->width;
    double y = row + 0.5, left = INFINITY, right = -INFINITY;
    for (int k = 0; k < 3; k++) {
        const double *a = p[k], *b = p[(k + 1) % 3];
        if ((a[1] <= y) != (b[1] <= y)) {
            double x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            left = fmin(left, x), right = fmax(right, x);
        }
    }
    int begin = (int)fmax(ceil(left - 0.5), 0.0), end = (int)fmin(ceil(right - 0.5), width);
    for (int i = begin; i < end; i++) {
        double inverse = p[0][2] + slope[0] * (i + 0.5 - p[0][0]) + slope[1] * (y - p[0][1]);
        size_t at = (size_t)row * (size_t)width + (size_t)i;
        if (inverse * view->depth[at] > 1.0) {
            view->depth[at] = (float)(1.0 / inverse);
            view->cloth[at] = cloth;
        }
    }
}

void side_view_add(SideView *view, const Vec3 corners[3], bool cloth) {
    double p[3][3], low = INFINITY, high = -INFINITY;
    int rows = SIDE_SAMPLES * view->height;
    for (int k = 0; k < 3; k++) {
        camera_see(&view->camera, SIDE_SAMPLES * view->width, rows, corners[k], p[k]);
        if (!(p[k][2] > NEAREST)) {
            view->behind = true;
            return;
        }
        p[k][2] = 1.0 / p[k][2];
        low = fmin(low, p[k][1]), high = fmax(high, p[k][1]);
    }
    double a[2] = {p[1][0] - p[0][0], p[1][1] - p[0][1]},
           b[2] = {p[2][0] - p[0][0], p[2][1] - p[0][1]};
    double area = a[0] * b[1] - a[1] * b[0], da = p[1][2] - p[0][2], db = p[2][2] - p[0][2];
    if (fabs(area) < 1e-12) {
        return;
    }
    const double slope[2] = {(da * b[1] - db * a[1]) / area, (db * a[0] - da * b[0]) / area};
    int first = (int)fmax(ceil(low - 0.5), 0.0), last = (int)fmin(ceil(high - 0.5), rows);
    for (int row = first; row < last; row++) {
        fill_row(view, p, slope, row, cloth);
    }
}

float *side_view_cover(const SideView *view, double *depth) {
    size_t wide = SIDE_SAMPLES * (size_t)view->width, count = 0;
    float *cover = memory_zeroed((size_t)view->width * (size_t)view->height, sizeof *cover);
    double sum = 0.0;
    for (size_t j = 0; j < SIDE_SAMPLES * (size_t)view->height; j++) {
        for (size_t i = 0; i < wide; i++) {
            if (view->cloth[j * wide + i]) {
                cover[j / SIDE_SAMPLES * (size_t)view->width + i / SIDE_SAMPLES] +=
                    1.0f / (SIDE_SAMPLES * SIDE_SAMPLES);
                sum += (double)view->depth[j * wide + i];
                count++;
            }
        }
    }
    *depth = count > 0 ? sum / (double)count : NAN;
    return cover;
}
