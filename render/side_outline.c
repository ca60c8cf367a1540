/* Outlines of covers by marching squares at one half, and distances between them. */
#include <stdlib.h>
#include <string.h>

#include "render/side_view.h"
#include "sim/base/memory.h"

#define CELL 16 /* [px] of the grid that finds the nearest piece */

typedef struct Piece {
    double a[2], b[2]; /* [px] */
} Piece;

typedef struct Outline {
    Piece *pieces;
    int count, columns, rows;
    int *begin, *order; /* pieces of each cell of the grid */
} Outline;

/* Value at the middle of a pixel; nothing lies outside. */
static double at(const float *cover, int width, int height, int x, int y) {
    bool in = x >= 0 && y >= 0 && x < width && y < height;
    return in ? (double)cover[(size_t)y * (size_t)width + (size_t)x] : 0.0;
}

/* Crossings of the four sides of the square whose upper left corner is the middle of (x, y). Ambiguous squares are
 * joined in the order of their sides. */
static int cut_square(const double v[4], int x, int y, Piece out[2]) {
    static const int corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    double found[4][2];
    int count = 0;
    for (int k = 0; k < 4; k++) {
        double p = v[k], q = v[(k + 1) % 4];
        if ((p < 0.5) != (q < 0.5)) {
            double t = (0.5 - p) / (q - p);
            const int *from = corner[k], *to = corner[(k + 1) % 4];
            found[count][0] = x + 0.5 + from[0] + t * (to[0] - from[0]);
            found[count++][1] = y + 0.5 + from[1] + t * (to[1] - from[1]);
        }
    }
    for (int k = 0; k + 1 < count; k += 2) {
        memcpy(out[k / 2].a, found[k], sizeof out->a);
        memcpy(out[k / 2].b, found[k + 1], sizeof out->b);
    }
    return count / 2;
}

static int cell_of(const Outline *outline, const double p[2]) {
    int i = (int)fmax(0.0, fmin(p[0] / CELL, outline->columns - 1));
    int j = (int)fmax(0.0, fmin(p[1] / CELL, outline->rows - 1));
    return j * outline->columns + i;
}

static void sort_into_cells(Outline *outline) {
    int cells = outline->columns * outline->rows;
    outline->begin = memory_zeroed((size_t)cells + 1, sizeof(int));
    outline->order = memory_zeroed((size_t)outline->count, sizeof(int));
    for (int i = 0; i < outline->count; i++) {
        outline->begin[cell_of(outline, outline->pieces[i].a) + 1]++;
    }
    for (int c = 0; c < cells; c++) {
        outline->begin[c + 1] += outline->begin[c];
    }
    int *next = memory_zeroed((size_t)cells, sizeof *next);
    for (int i = 0; i < outline->count; i++) {
        int c = cell_of(outline, outline->pieces[i].a);
        outline->order[outline->begin[c] + next[c]++] = i;
    }
    free(next);
}

static Outline find_outline(const float *cover, int width, int height) {
    Outline outline = {.columns = width / CELL + 1, .rows = height / CELL + 1};
    for (int pass = 0; pass < 2; pass++) { /* count, then fill */
        outline.pieces = pass ? memory_zeroed((size_t)outline.count, sizeof(Piece)) : NULL;
        outline.count = 0;
        for (int y = -1; y < height; y++) {
            for (int x = -1; x < width; x++) {
                const double v[4] = {
                    at(cover, width, height, x, y), at(cover, width, height, x + 1, y),
                    at(cover, width, height, x + 1, y + 1), at(cover, width, height, x, y + 1)};
                Piece found[2];
                int count = cut_square(v, x, y, found);
                if (pass && count > 0) {
                    memcpy(outline.pieces + outline.count, found, sizeof(Piece) * (size_t)count);
                }
                outline.count += count;
            }
        }
    }
    sort_into_cells(&outline);
    return outline;
}

static void free_outline(Outline *outline) {
    free(outline->pieces);
    free(outline->begin);
    free(outline->order);
}

static double distance_to(const Piece *piece, const double p[2]) {
    double d[2] = {piece->b[0] - piece->a[0], piece->b[1] - piece->a[1]};
    double q[2] = {p[0] - piece->a[0], p[1] - piece->a[1]}, length = d[0] * d[0] + d[1] * d[1];
    double t = length > 0.0 ? (q[0] * d[0] + q[1] * d[1]) / length : 0.0;
    t = fmax(0.0, fmin(1.0, t));
    return hypot(q[0] - t * d[0], q[1] - t * d[1]);
}

/* Cells in growing squares around the point, until no nearer piece can lie further out. */
static double nearest(const Outline *outline, const double p[2]) {
    int cell = cell_of(outline, p), column = cell % outline->columns, row = cell / outline->columns;
    int most = outline->columns > outline->rows ? outline->columns : outline->rows;
    double best = INFINITY;
    for (int ring = 0; ring <= most && best > CELL * (ring - 1.0) - 1.5; ring++) {
        for (int j = row - ring; j <= row + ring; j++) {
            bool edge = j == row - ring || j == row + ring;
            for (int i = column - ring; i <= column + ring; i += edge || ring == 0 ? 1 : 2 * ring) {
                if (i < 0 || j < 0 || i >= outline->columns || j >= outline->rows) {
                    continue;
                }
                int c = j * outline->columns + i;
                for (int k = outline->begin[c]; k < outline->begin[c + 1]; k++) {
                    best = fmin(best, distance_to(&outline->pieces[outline->order[k]], p));
                }
            }
        }
    }
    return best;
}

static int compare_numbers(const void *a, const void *b) {
    const double *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

static void measure_outlines(const Outline *one, const Outline *other, SideNumbers *numbers) {
    int count = one->count + other->count;
    double *all = memory_zeroed((size_t)count, sizeof *all), sum = 0.0, weights = 0.0;
    for (int i = 0; i < count; i++) {
        bool first = i < one->count;
        const Piece *piece = first ? &one->pieces[i] : &other->pieces[i - one->count];
        const double middle[2] = {0.5 * (piece->a[0] + piece->b[0]),
                                  0.5 * (piece->a[1] + piece->b[1])};
        double weight = hypot(piece->b[0] - piece->a[0], piece->b[1] - piece->a[1]);
        all[i] = nearest(first ? other : one, middle);
        sum += weight * all[i];
        weights += weight;
    }
    qsort(all, (size_t)count, sizeof *all, compare_numbers);
    numbers->mean = sum / fmax(weights, 1e-300);
    numbers->hausdorff = all[count - 1];
    numbers->hausdorff95 = all[(int)(0.95 * (count - 1))];
    free(all);
}

bool side_compare(const float *first, const float *second, int width, int height,
                  SideNumbers *numbers) {
    double common = 0.0, either = 0.0;
    *numbers = (SideNumbers){0};
    for (size_t i = 0; i < (size_t)width * (size_t)height; i++) {
        double a = (double)first[i], b = (double)second[i];
        numbers->area[0] += a, numbers->area[1] += b;
        common += fmin(a, b), either += fmax(a, b);
    }
    Outline one = find_outline(first, width, height), other = find_outline(second, width, height);
    bool good = one.count > 0 && other.count > 0;
    if (good) {
        numbers->iou = common / either;
        measure_outlines(&one, &other, numbers);
    }
    free_outline(&one);
    free_outline(&other);
    return good;
}
