#include "render/contour.h"

#include <math.h>
#include <stdlib.h>

#include "sim/base/vec.h"

#define RAY_STEP 0.25 /* [px] along a ray */
#define HALF 0.5f     /* of a pixel: where the outline is */

/* Bilinear between the middles of pixels; 0 outside. */
static float sample(const Coverage *coverage, double x, double y) {
    double column = (x - coverage->x0) / coverage->pixel - 0.5;
    double row = (y - coverage->y0) / coverage->pixel - 0.5;
    int i = (int)floor(column), j = (int)floor(row);
    if (i < 0 || j < 0 || i + 1 >= coverage->width || j + 1 >= coverage->height) {
        return 0.0f;
    }
    const float *p = coverage->part + (size_t)j * (size_t)coverage->width + i;
    float s = (float)(column - i), t = (float)(row - j);
    return (1 - t) * ((1 - s) * p[0] + s * p[1]) +
           t * ((1 - s) * p[coverage->width] + s * p[coverage->width + 1]);
}

/* From outside inwards: the first crossing is the outermost. */
static double trace_ray(const Coverage *coverage, double x, double y, double angle, double reach,
                        int *crossings) {
    double c = cos(angle), s = sin(angle), step = RAY_STEP * coverage->pixel, found = 0.0;
    float before = 0.0f;
    *crossings = 0;
    for (int i = (int)ceil(reach / step); i >= 0; i--) {
        double r = step * i;
        float now = sample(coverage, x + r * c, y + r * s);
        if ((now >= HALF) != (before >= HALF)) {
            if (++*crossings == 1) {
                found = r + step * (now - HALF) / (now - before);
            }
        }
        before = now;
    }
    return found;
}

Contour contour_trace(const Coverage *coverage, double x, double y, double start) {
    Contour contour = {.multivalued = 0};
    double wide = coverage->width * coverage->pixel, high = coverage->height * coverage->pixel;
    double across = fmax(x - coverage->x0, coverage->x0 + wide - x);
    double along = fmax(y - coverage->y0, coverage->y0 + high - y);
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        int crossings;
        contour.r[i] = trace_ray(coverage, x, y, start + 2.0 * PI * i / CONTOUR_RAYS,
                                 hypot(across, along), &crossings);
        contour.multivalued += crossings > 1;
        contour.missed += crossings == 0;
    }
    return contour;
}

void coverage_free(Coverage *coverage) {
    free(coverage->part);
    *coverage = (Coverage){0};
}

Harmonics harmonics_find(const double *r, int count) {
    Harmonics h = {.dominant = 1};
    double total = 0.0;
    for (int i = 0; i < count; i++) {
        h.mean += r[i] / count;
    }
    for (int n = 1; n <= CONTOUR_HARMONICS; n++) {
        for (int i = 0; i < count; i++) {
            double angle = 2.0 * PI * n * i / count;
            h.a[n] += 2.0 / count * r[i] * cos(angle);
            h.b[n] += 2.0 / count * r[i] * sin(angle);
        }
        h.amplitude[n] = hypot(h.a[n], h.b[n]);
        h.phase[n] = atan2(h.b[n], h.a[n]);
        total += h.amplitude[n] * h.amplitude[n];
        h.dominant = h.amplitude[n] > h.amplitude[h.dominant] ? n : h.dominant;
    }
    for (int n = 1; total > 0.0 && n <= CONTOUR_HARMONICS; n++) {
        h.share[n] = h.amplitude[n] * h.amplitude[n] / total;
    }
    return h;
}

void harmonics_draw(const Harmonics *h, int most, double *r) {
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        r[i] = h->mean;
        for (int n = 1; n <= most; n++) {
            double angle = 2.0 * PI * n * i / CONTOUR_RAYS;
            r[i] += h->a[n] * cos(angle) + h->b[n] * sin(angle);
        }
    }
}

static int around(int i) { return (i + 2 * CONTOUR_RAYS) % CONTOUR_RAYS; }

/* The lowest value from i in one direction until higher ground; the whole circle: the lowest. */
static double find_low(const double *r, int i, int direction) {
    double low = r[i];
    for (int k = 1; k < CONTOUR_RAYS; k++) {
        double value = r[around(i + direction * k)];
        if (value > r[i]) {
            break;
        }
        low = fmin(low, value);
    }
    return low;
}

/* The lowest value from peak to peak. */
static double find_trough(const double *r, int from, int to) {
    double low = r[from];
    for (int i = from; i != to; i = around(i + 1)) {
        low = fmin(low, r[i]);
    }
    return low;
}

Nodes contour_find_nodes(const double *r, double prominence) {
    Nodes nodes = {0};
    int at[CONTOUR_MOST_NODES];
    for (int i = 0; i < CONTOUR_RAYS && nodes.count < CONTOUR_MOST_NODES; i++) {
        double before = r[around(i - 1)], after = r[around(i + 1)];
        if (!(r[i] > before && r[i] >= after) ||
            r[i] - fmax(find_low(r, i, -1), find_low(r, i, 1)) < prominence) {
            continue;
        }
        double bend = before - 2.0 * r[i] + after; /* parabola through the three */
        double shift = bend < 0.0 ? 0.5 * (before - after) / bend : 0.0;
        nodes.angle[nodes.count] = 2.0 * PI * (i + shift) / CONTOUR_RAYS;
        nodes.peak[nodes.count] = r[i] - 0.25 * (before - after) * shift;
        at[nodes.count++] = i;
    }
    for (int k = 0; k < nodes.count; k++) {
        int before = at[(k + nodes.count - 1) % nodes.count], after = at[(k + 1) % nodes.count];
        bool alone = nodes.count == 1;
        double left = alone ? find_low(r, at[k], -1) : find_trough(r, before, at[k]);
        double right = alone ? left : find_trough(r, at[k], after);
        nodes.depth[k] = nodes.peak[k] - 0.5 * (left + right);
    }
    return nodes;
}

double contour_area(const double *r) {
    double sum = 0.0, sine = sin(2.0 * PI / CONTOUR_RAYS);
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        sum += 0.5 * sine * r[i] * r[around(i + 1)];
    }
    return sum;
}

double contour_perimeter(const double *r) {
    double sum = 0.0, cosine = cos(2.0 * PI / CONTOUR_RAYS);
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double a = r[i], b = r[around(i + 1)];
        sum += sqrt(fmax(a * a + b * b - 2.0 * a * b * cosine, 0.0));
    }
    return sum;
}

double contour_asymmetry(const Harmonics *harmonics, double axis) {
    double odd = 0.0, all = 0.0;
    for (int n = 1; n <= CONTOUR_HARMONICS; n++) {
        double a = harmonics->a[n], b = harmonics->b[n];
        double sine = b * cos(n * axis) - a * sin(n * axis); /* r(axis + t) = .. + sine sin(n t) */
        odd += sine * sine;
        all += a * a + b * b;
    }
    return all > 0.0 ? odd / all : NAN;
}
