#include "render/silhouette.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/memory.h"

Silhouette silhouette_create(const SilhouetteDef *def) {
    Silhouette silhouette = {.def = *def};
    int pixels = 2 * (int)ceil(def->reach / def->pixel);
    silhouette.side = SILHOUETTE_SAMPLES * pixels;
    silhouette.def.reach = 0.5 * pixels * def->pixel;
    silhouette.sample = memory_zeroed((size_t)silhouette.side * (size_t)silhouette.side, 1);
    return silhouette;
}

void silhouette_free(Silhouette *silhouette) {
    free(silhouette->sample);
    *silhouette = (Silhouette){0};
}

/* Sets the samples whose middles are in the triangle; p in samples. */
static void fill_triangle(Silhouette *silhouette, double p[3][2]) {
    double low = fmin(p[0][1], fmin(p[1][1], p[2][1])),
           high = fmax(p[0][1], fmax(p[1][1], p[2][1]));
    int first = (int)fmax(ceil(low - 0.5), 0.0);
    int last = (int)fmin(floor(high - 0.5), silhouette->side - 1.0);
    for (int j = first; j <= last; j++) {
        double y = j + 0.5, left = INFINITY, right = -INFINITY;
        for (int k = 0; k < 3; k++) {
            const double *a = p[k], *b = p[(k + 1) % 3];
            if ((a[1] <= y) == (b[1] <= y)) {
                continue;
            }
            double x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            left = fmin(left, x);
            right = fmax(right, x);
        }
        int begin = (int)fmax(ceil(left - 0.5), 0.0);
        int end = (int)fmin(floor(right - 0.5), silhouette->side - 1.0);
        if (end >= begin) {
            memset(silhouette->sample + (size_t)j * (size_t)silhouette->side + begin, 1,
                   (size_t)(end - begin + 1));
        }
    }
}

/* Where a point is, in samples from the lower left corner. */
static void place(const Silhouette *silhouette, double x, double y, double z, double out[2]) {
    const SilhouetteDef *def = &silhouette->def;
    double below = def->plane - z, height = def->camera_height;
    double scale = isinf(height) ? 1.0 : height / fmax(height + below, 1e-3 * height);
    double samples = SILHOUETTE_SAMPLES / def->pixel;
    const double at[2] = {x, y};
    for (int k = 0; k < 2; k++) {
        double seen = def->camera[k] + scale * (at[k] - def->camera[k]);
        out[k] = samples * (seen - def->centre[k] + def->reach);
    }
}

void silhouette_add_surface(Silhouette *silhouette, const Surface *surface,
                            const SurfacePart *part) {
    const uint32_t *triangles = surface->fine + 3 * (size_t)part->fine_begin;
    for (size_t t = 0; t < (size_t)part->fine_count; t++) {
        double p[3][2];
        for (int k = 0; k < 3; k++) {
            const float *at = surface->vertices[triangles[3 * t + (size_t)k]].position;
            place(silhouette, at[0], at[1], at[2], p[k]);
        }
        fill_triangle(silhouette, p);
    }
}

void silhouette_add_polygon(Silhouette *silhouette, const double *points, int count) {
    for (int i = 1; i + 1 < count; i++) {
        double p[3][2];
        const int corner[3] = {0, i, i + 1};
        for (int k = 0; k < 3; k++) {
            const double *at = points + 2 * corner[k];
            place(silhouette, at[0], at[1], silhouette->def.plane, p[k]);
        }
        fill_triangle(silhouette, p);
    }
}

double silhouette_area(const Silhouette *silhouette) {
    int64_t count = 0;
    size_t samples = (size_t)silhouette->side * (size_t)silhouette->side;
    for (size_t i = 0; i < samples; i++) {
        count += silhouette->sample[i];
    }
    double side = silhouette->def.pixel / SILHOUETTE_SAMPLES;
    return (double)count * side * side;
}

Coverage silhouette_cover(const Silhouette *silhouette) {
    const SilhouetteDef *def = &silhouette->def;
    int pixels = silhouette->side / SILHOUETTE_SAMPLES;
    Coverage coverage = {
        pixels, pixels, def->pixel, def->centre[0] - def->reach, def->centre[1] - def->reach, NULL};
    coverage.part = memory_zeroed((size_t)pixels * (size_t)pixels, sizeof *coverage.part);
    const float one = 1.0f / (SILHOUETTE_SAMPLES * SILHOUETTE_SAMPLES);
    for (size_t j = 0; j < (size_t)silhouette->side; j++) {
        const unsigned char *row = silhouette->sample + j * (size_t)silhouette->side;
        float *out = coverage.part + j / SILHOUETTE_SAMPLES * (size_t)pixels;
        for (size_t i = 0; i < (size_t)silhouette->side; i++) {
            out[i / SILHOUETTE_SAMPLES] += row[i] ? one : 0.0f;
        }
    }
    return coverage;
}
