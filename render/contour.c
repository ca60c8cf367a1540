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

void contour_add_segment(double *r, double start, const double p[2], const double q[2]) {
    const double step = 2.0 * PI / CONTOUR_RAYS;
    double from = atan2(p[1], p[0]) - start, turn = atan2(q[1], q[0]) - start - from;
    turn -= 2.0 * PI * round(turn / (2.0 * PI));
    double low = turn < 0.0 ? from + turn : from, high = turn < 0.0 ? from : from + turn;
    double cross = p[0] * q[1] - p[1] * q[0];
    for (int i = (int)ceil(low / step); i <= (int)floor(high / step); i++) {
        double c = cos(step * i + start), s = sin(step * i + start);
        double along = (q[1] - p[1]) * c - (q[0] - p[0]) * s;
        double *ray = &r[((i % CONTOUR_RAYS) + CONTOUR_RAYS) % CONTOUR_RAYS];
        if (fabs(along) > 0.0) {
            *ray = fmax(*ray, cross / along);
        }
    }
}

static int around(int i) { return (i + 2 * CONTOUR_RAYS) % CONTOUR_RAYS; }

/* The lowest value from i in one direction until higher ground; *higher: there is some. */
static double find_low(const double *value, int count, bool closed, int i, int direction,
                       bool *higher) {
    double low = value[i];
    *higher = false;
    for (int k = 1; k < count && !*higher; k++) {
        int j = i + direction * k;
        if (!closed && (j < 0 || j >= count)) {
            break;
        }
        double other = value[(j + count) % count];
        *higher = other > value[i];
        low = fmin(low, other);
    }
    return low;
}

static double find_prominence(const double *value, int count, bool closed, int i) {
    bool before, after;
    double left = find_low(value, count, closed, i, -1, &before);
    double right = find_low(value, count, closed, i, 1, &after);
    double col = before == after ? (before ? fmax(left, right) : fmin(left, right))
                 : before        ? left
                                 : right;
    return value[i] - col;
}

int contour_find_peaks(const double *value, int count, bool closed, double prominence, Peak *peaks,
                       int most) {
    int found = 0;
    for (int i = 0; i < count && found < most; i++) {
        bool first = i == 0 && !closed, last = i == count - 1 && !closed;
        if ((first || value[i] > value[(i + count - 1) % count]) &&
            (last || value[i] >= value[(i + 1) % count])) {
            peaks[found] = (Peak){i, find_prominence(value, count, closed, i)};
            found += peaks[found].prominence >= prominence;
        }
    }
    return found;
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
    Peak peaks[CONTOUR_MOST_NODES] = {{0}};
    nodes.count = contour_find_peaks(r, CONTOUR_RAYS, true, prominence, peaks, CONTOUR_MOST_NODES);
    for (int k = 0; k < nodes.count; k++) {
        int i = peaks[k].at;
        double before = r[around(i - 1)], after = r[around(i + 1)];
        double bend = before - 2.0 * r[i] + after; /* parabola through the three */
        double shift = bend < 0.0 ? 0.5 * (before - after) / bend : 0.0;
        nodes.angle[k] = 2.0 * PI * (i + shift) / CONTOUR_RAYS;
        nodes.peak[k] = r[i] - 0.25 * (before - after) * shift;
    }
    for (int k = 0; k < nodes.count; k++) {
        int at = peaks[k].at;
        int before = peaks[(k + nodes.count - 1) % nodes.count].at;
        int after = peaks[(k + 1) % nodes.count].at;
        bool alone = nodes.count == 1;
        double left = alone ? r[at] - peaks[k].prominence : find_trough(r, before, at);
        double right = alone ? left : find_trough(r, at, after);
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
