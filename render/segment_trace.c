/* The outline of a piece to parts of a pixel, and the circle of a plate on it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/segment.h"
#include "sim/base/memory.h"
#include "sim/base/vec.h"

#define REACH 9   /* [px] along a ray, on either side of the piece's border */
#define PLATEAU 4 /* [px] from the border: further off lies one side only */
#define STEP 0.25 /* [px] */
#define SAMPLES (2 * REACH * 4 + 1)

/* Linear light between the middles of pixels. */
static void sample(const Image *image, double x, double y, double out[3]) {
    double column = fmin(fmax(x - 0.5, 0.0), image->width - 1.001);
    double row = fmin(fmax(y - 0.5, 0.0), image->height - 1.001);
    int i = (int)column, j = (int)row;
    double s = column - i, t = row - j;
    const uint8_t *p =
        image->rgba + IMAGE_CHANNELS * ((size_t)j * (size_t)image->width + (size_t)i);
    const uint8_t *q = p + IMAGE_CHANNELS * (size_t)image->width;
    for (int k = 0; k < 3; k++) {
        out[k] =
            (1 - t) * ((1 - s) * segment_linear(p[k]) + s * segment_linear(p[k + IMAGE_CHANNELS])) +
            t * ((1 - s) * segment_linear(q[k]) + s * segment_linear(q[k + IMAGE_CHANNELS]));
    }
}

/* Where the picture is half way between its two sides, near r; r itself when they do not differ. */
static double refine(const Image *image, double x, double y, double c, double s, double r) {
    double light[SAMPLES][3], side[2][3] = {{0}}, across[3], length = 0.0;
    int counts[2] = {0};
    for (int i = 0; i < SAMPLES; i++) {
        double at = r - REACH + STEP * i, off = at - r;
        sample(image, x + at * c, y - at * s, light[i]);
        int which = off < -PLATEAU ? 0 : off > PLATEAU ? 1 : -1;
        for (int k = 0; which >= 0 && k < 3; k++) {
            side[which][k] += light[i][k];
        }
        if (which >= 0) {
            counts[which]++;
        }
    }
    for (int k = 0; k < 3; k++) {
        side[0][k] /= counts[0];
        side[1][k] /= counts[1];
        across[k] = side[0][k] - side[1][k];
        length += across[k] * across[k];
    }
    double best = r, nearest = INFINITY, before = 0.0;
    for (int i = 0; i < SAMPLES && length > 1e-5; i++) {
        double part = 0.0, at = r - REACH + STEP * i;
        for (int k = 0; k < 3; k++) {
            part += (light[i][k] - side[1][k]) * across[k] / length;
        }
        if (i > 0 && before >= 0.5 && part < 0.5) {
            double crossing = at - STEP * (0.5 - part) / (before - part);
            if (fabs(crossing - r) < nearest) {
                nearest = fabs(crossing - r);
                best = crossing;
            }
        }
        before = part;
    }
    return nearest <= REACH - PLATEAU ? best : r;
}

/* Rays whose border was put somewhere else than their neighbours': noise. */
static void drop_outliers(double *r) {
    double smooth[CONTOUR_RAYS];
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double near[5];
        for (int k = 0; k < 5; k++) {
            near[k] = r[(i + k - 2 + CONTOUR_RAYS) % CONTOUR_RAYS];
        }
        for (int a = 1; a < 5; a++) { /* five numbers */
            for (int b = a; b > 0 && near[b - 1] > near[b]; b--) {
                double swap = near[b];
                near[b] = near[b - 1];
                near[b - 1] = swap;
            }
        }
        smooth[i] = fabs(r[i] - near[2]) > 1.0 ? near[2] : r[i];
    }
    memcpy(r, smooth, sizeof smooth);
}

Contour segment_trace(const Image *image, const Segment *segment, double x, double y) {
    Coverage coverage = {segment->width, segment->height, 1.0, 0.0, 0.0, NULL};
    size_t width = (size_t)segment->width, height = (size_t)segment->height;
    coverage.part = memory_zeroed(width * height, sizeof *coverage.part);
    for (size_t j = 0; j < height; j++) { /* rows of a coverage go up */
        for (size_t i = 0; i < width; i++) {
            coverage.part[(height - 1 - j) * width + i] = segment->inside[j * width + i];
        }
    }
    Contour contour = contour_trace(&coverage, x, segment->height - y, 0.0);
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double angle = 2.0 * PI * i / CONTOUR_RAYS;
        if (contour.r[i] > REACH) {
            contour.r[i] = refine(image, x, y, cos(angle), sin(angle), contour.r[i]);
        }
    }
    drop_outliers(contour.r);
    coverage_free(&coverage);
    return contour;
}

/* ---- the plate ---- */

#define GRID 2          /* [px] side of a cell of votes */
#define EDGE_SHARE 0.06 /* of the pixels inside: the strongest edges vote */
#define STANDS_OUT 1.5  /* the best radius over the next one */
#define DIRECTION 0.96  /* cosine: an edge that looks to the middle */

typedef struct Edges {
    int count;
    float *x, *y, *dx, *dy; /* (count) places, unit gradients */
} Edges;

static double brightness(const Image *image, int x, int y, int k) {
    return segment_linear(
        image->rgba[IMAGE_CHANNELS * ((size_t)y * (size_t)image->width + (size_t)x) + (size_t)k]);
}

/* Gradient of the channel that changes most, over 5 pixels. */
static double gradient(const Image *image, int x, int y, double *dx, double *dy) {
    double best = 0.0;
    *dx = *dy = 0.0;
    for (int k = 0; k < 3; k++) {
        double gx = 0.0, gy = 0.0;
        for (int d = -2; d <= 2; d++) {
            gx += brightness(image, x + 2, y + d, k) - brightness(image, x - 2, y + d, k);
            gy += brightness(image, x + d, y + 2, k) - brightness(image, x + d, y - 2, k);
        }
        if (gx * gx + gy * gy > best) {
            best = gx * gx + gy * gy;
            *dx = gx;
            *dy = gy;
        }
    }
    return sqrt(best);
}

static int compare_floats(const void *a, const void *b) {
    float p = *(const float *)a, q = *(const float *)b;
    return (p > q) - (p < q);
}

static Edges find_edges(const Image *image, const Segment *segment) {
    size_t count = (size_t)segment->width * (size_t)segment->height, inside = 0;
    float *strength = memory_zeroed(count, sizeof *strength),
          *sorted = memory_zeroed(count, sizeof *sorted);
    int margin = 12; /* [px] away from the outline of the cloth, which is no circle */
    for (int y = margin; y < segment->height - margin; y++) {
        for (int x = margin; x < segment->width - margin; x++) {
            size_t at = (size_t)y * (size_t)segment->width + (size_t)x;
            size_t row = (size_t)margin * (size_t)segment->width;
            double dx, dy;
            if (segment->inside[at - (size_t)margin] && segment->inside[at + (size_t)margin] &&
                segment->inside[at - row] && segment->inside[at + row]) {
                strength[at] = (float)gradient(image, x, y, &dx, &dy);
                sorted[inside++] = strength[at];
            }
        }
    }
    qsort(sorted, inside, sizeof *sorted, compare_floats);
    float least = inside ? sorted[(size_t)((1.0 - EDGE_SHARE) * (double)(inside - 1))] : 1.0f;
    free(sorted);
    Edges edges = {0};
    float *data = memory_zeroed(4 * (inside / 4 + 1), 4 * sizeof *data);
    size_t room = 4 * (inside / 4 + 1);
    edges.x = data, edges.y = data + room, edges.dx = data + 2 * room, edges.dy = data + 3 * room;
    for (size_t at = 0; at < count; at++) {
        if (strength[at] > least && strength[at] > 0.0f) {
            int x = (int)(at % (size_t)segment->width), y = (int)(at / (size_t)segment->width);
            double dx, dy, length = gradient(image, x, y, &dx, &dy);
            edges.x[edges.count] = (float)x + 0.5f;
            edges.y[edges.count] = (float)y + 0.5f;
            edges.dx[edges.count] = (float)(dx / length);
            edges.dy[edges.count++] = (float)(dy / length);
        }
    }
    free(strength);
    return edges;
}

/* Votes of all edges for middles between `low` and `high` from them, along their gradients. */
static void vote(const Edges *edges, const Segment *segment, double low, double high,
                 SegmentDisc *disc) {
    int columns = segment->width / GRID + 1, rows = segment->height / GRID + 1;
    float *votes = memory_zeroed((size_t)columns * (size_t)rows, sizeof *votes);
    for (int i = 0; i < edges->count; i++) {
        for (int side = -1; side <= 1; side += 2) {
            for (int step = (int)low; step < (int)high; step += GRID) {
                int column = (int)((edges->x[i] + (float)(side * step) * edges->dx[i]) / GRID);
                int row = (int)((edges->y[i] + (float)(side * step) * edges->dy[i]) / GRID);
                if (column >= 0 && row >= 0 && column < columns && row < rows) {
                    votes[(size_t)row * (size_t)columns + (size_t)column] += 1.0f / (float)step;
                }
            }
        }
    }
    float best = -1.0f;
    for (int row = 1; row + 1 < rows; row++) {
        for (int column = 1; column + 1 < columns; column++) {
            float sum = 0.0f;
            for (int d = 0; d < 9; d++) {
                sum += votes[(size_t)(row + d / 3 - 1) * (size_t)columns +
                             (size_t)(column + d % 3 - 1)];
            }
            if (sum > best) {
                best = sum;
                disc->x = GRID * (column + 0.5);
                disc->y = GRID * (row + 0.5);
            }
        }
    }
    free(votes);
}

/* The radius around the middle where most edges look at it; false when another one does as well. */
static bool find_radius(const Edges *edges, double low, double high, SegmentDisc *disc) {
    int bins = (int)high + 2;
    double *histogram = memory_zeroed((size_t)bins, sizeof *histogram);
    for (int i = 0; i < edges->count; i++) {
        double dx = edges->x[i] - disc->x, dy = edges->y[i] - disc->y, r = hypot(dx, dy);
        if (r > low && r < high && fabs(dx * edges->dx[i] + dy * edges->dy[i]) > DIRECTION * r) {
            histogram[(int)r] += 1.0 / r;
        }
    }
    double best = 0.0, second = 0.0;
    int window = 2 + (int)(0.02 * high), at = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int b = window; b + window < bins; b++) {
            double sum = 0.0;
            for (int d = -window; d <= window; d++) {
                sum += histogram[b + d];
            }
            if (pass == 0 && sum > best) {
                best = sum;
                at = b;
            } else if (pass == 1 && abs(b - at) > 3 * window) {
                second = fmax(second, sum);
            }
        }
    }
    free(histogram);
    disc->radius = at + 0.5;
    return best > 0.0 && best >= STANDS_OUT * second;
}

/* A x^2 + B x y + C y^2 + D x + E y = 1 through the points by least squares; x, y over the radius. */
static bool fit_ellipse(const double (*points)[2], int count, SegmentDisc *disc) {
    double m[5][6] = {{0}}, v[5];
    for (int i = 0; i < count; i++) {
        double x = points[i][0], y = points[i][1], t[5] = {x * x, x * y, y * y, x, y};
        for (int a = 0; a < 5; a++) {
            for (int b = 0; b < 5; b++) {
                m[a][b] += t[a] * t[b];
            }
            m[a][5] += t[a];
        }
    }
    for (int c = 0; c < 5; c++) { /* symmetric and definite: no pivots */
        if (fabs(m[c][c]) < 1e-9) {
            return false;
        }
        for (int r = 0; r < 5; r++) {
            double factor = r == c ? 0.0 : m[r][c] / m[c][c];
            for (int k = c; k < 6; k++) {
                m[r][k] -= factor * m[c][k];
            }
        }
    }
    for (int c = 0; c < 5; c++) {
        v[c] = m[c][5] / m[c][c];
    }
    double det = 4.0 * v[0] * v[2] - v[1] * v[1];
    if (det <= 0.0) {
        return false;
    }
    double x = (v[1] * v[4] - 2.0 * v[2] * v[3]) / det, y = (v[1] * v[3] - 2.0 * v[0] * v[4]) / det;
    double value = 1.0 + v[0] * x * x + v[1] * x * y + v[2] * y * y;
    double mean = 0.5 * (v[0] + v[2]), spread = 0.5 * hypot(v[0] - v[2], v[1]);
    double big = sqrt(value / (mean - spread)), small = sqrt(value / (mean + spread));
    disc->x += x * disc->radius;
    disc->y += y * disc->radius;
    disc->ratio = big / small;
    disc->radius *= sqrt(big * small);
    return true;
}

/* The strongest edge along a ray within 6 % of the circle. */
static double find_edge(const Image *image, const SegmentDisc *disc, double c, double s) {
    double best = 0.0, at = 0.0;
    int steps = (int)(0.12 * disc->radius / STEP);
    for (int n = 0; n <= steps; n++) {
        double r = 0.94 * disc->radius + STEP * n, inner[3], outer[3], change = 0.0;
        sample(image, disc->x + (r - 1.5) * c, disc->y - (r - 1.5) * s, inner);
        sample(image, disc->x + (r + 1.5) * c, disc->y - (r + 1.5) * s, outer);
        for (int k = 0; k < 3; k++) {
            change += (inner[k] - outer[k]) * (inner[k] - outer[k]);
        }
        if (change > best) {
            best = change;
            at = r;
        }
    }
    return at;
}

static bool is_inside(const Segment *segment, double x, double y) {
    int i = (int)floor(x), j = (int)floor(y);
    return i >= 0 && j >= 0 && i < segment->width && j < segment->height &&
           segment->inside[(size_t)j * (size_t)segment->width + (size_t)i];
}

/* An ellipse through the places where the picture is half way between plate and cloth; only where
 * there is enough cloth beside the plate to tell. */
static bool refine_disc(const Image *image, const Segment *segment, SegmentDisc *disc) {
    enum { RAYS = 360 };
    double points[RAYS][2];
    int count = 0;
    for (int i = 0; i < RAYS; i++) {
        double c = cos(PI * i / 180.0), s = sin(PI * i / 180.0);
        double r = find_edge(image, disc, c, s);
        double far = r + REACH + 2.0;
        if (r > REACH && is_inside(segment, disc->x + far * c, disc->y - far * s)) {
            r = refine(image, disc->x, disc->y, c, s, r) / disc->radius;
            points[count][0] = r * c;
            points[count++][1] = -r * s;
        }
    }
    return count > RAYS / 4 && fit_ellipse((const double(*)[2])points, count, disc);
}

bool segment_find_disc(const Image *image, const Segment *segment, SegmentDisc *disc) {
    double size = sqrt(segment->area / PI);
    Edges edges = find_edges(image, segment);
    *disc = (SegmentDisc){.ratio = 1.0};
    vote(&edges, segment, 0.3 * size, 0.95 * size, disc);
    bool found = find_radius(&edges, 0.3 * size, 0.95 * size, disc);
    free(edges.x);
    for (int i = 0; found && i < 3; i++) {
        found = refine_disc(image, segment, disc);
    }
    return found;
}
