/* What stands off the support in the cut of a draped cloth with a horizontal plane. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/drape_parts.h"

/* One end of a piece of the cut: where an edge of the surface meets the plane. */
typedef struct CutEnd {
    uint64_t edge; /* lower vertex, higher vertex */
    int piece, side;
    double at[2]; /* [m] from the middle of the support */
} CutEnd;

/* Curves of the cut, one after the other. */
typedef struct Curves {
    int count, *begin; /* (count + 1) */
    bool *closed;      /* (count) */
    double *at;        /* (begin[count] x 2) [m] from the middle of the support */
} Curves;

static int compare_ends(const void *a, const void *b) {
    const CutEnd *p = a, *q = b;
    return p->edge != q->edge     ? (p->edge < q->edge ? -1 : 1)
           : p->piece != q->piece ? (p->piece < q->piece ? -1 : 1)
                                  : p->side - q->side;
}

/* The ends of the piece that triangle `corners` has of the cut; false: it has none. */
static bool cut_triangle(const double *x, const int32_t *corners, double height,
                         const double *middle, CutEnd ends[2]) {
    int count = 0;
    for (int k = 0; k < 3; k++) {
        int32_t p = corners[k], q = corners[(k + 1) % 3];
        int32_t low = p < q ? p : q, high = p < q ? q : p; /* the same bits from both triangles */
        const double *a = x + 3 * (size_t)low, *b = x + 3 * (size_t)high;
        if ((a[2] < height) != (b[2] < height)) {
            double part = (height - a[2]) / (b[2] - a[2]);
            ends[count].edge = (uint64_t)low << 32 | (uint64_t)high;
            for (int c = 0; c < 2; c++) {
                ends[count].at[c] = a[c] + part * (b[c] - a[c]) - middle[c];
            }
            count++;
        }
    }
    return count == 2;
}

/* How many triangles have a piece; `ends` (2 each) may be NULL. */
static int find_ends(const DrapePart *part, double height, const double *middle, CutEnd *ends) {
    int pieces = 0;
    for (size_t t = 0; t < (size_t)part->mesh.triangle_count; t++) {
        CutEnd found[2];
        if (!cut_triangle(part->x, part->mesh.triangles + 3 * t, height, middle, found)) {
            continue;
        }
        for (int side = 0; ends && side < 2; side++) {
            found[side].piece = pieces;
            found[side].side = side;
            ends[2 * pieces + side] = found[side];
        }
        pieces++;
    }
    return pieces;
}

/* For each end, by 2 piece + side: its place in `ends` and the end of the next piece, -1 if none. */
static void join_ends(const CutEnd *ends, int count, int *place, int *next) {
    for (int i = 0; i < count; i++) {
        place[2 * ends[i].piece + ends[i].side] = i;
        next[2 * ends[i].piece + ends[i].side] = -1;
    }
    for (int i = 0; i + 1 < count; i++) {
        if (ends[i].edge == ends[i + 1].edge) {
            int a = 2 * ends[i].piece + ends[i].side, b = 2 * ends[i + 1].piece + ends[i + 1].side;
            next[a] = b, next[b] = a;
            i++;
        }
    }
}

/* Follows the pieces from `end` on and marks them. */
static void follow(const CutEnd *ends, const int *place, const int *next, int end, bool *seen,
                   Curves *curves) {
    int first = end, points = curves->begin[curves->count];
    while (end >= 0 && !seen[end / 2]) {
        seen[end / 2] = true;
        memcpy(curves->at + 2 * (size_t)points++, ends[place[end]].at, sizeof ends->at);
        first = end;
        end = next[end ^ 1];
    }
    curves->closed[curves->count] = end >= 0;
    if (end < 0) { /* at the rim */
        memcpy(curves->at + 2 * (size_t)points++, ends[place[first ^ 1]].at, sizeof ends->at);
    }
    curves->begin[++curves->count] = points;
}

static Curves find_curves(const DrapePart *part, double height, const double *middle,
                          Arena *arena) {
    int pieces = find_ends(part, height, middle, NULL), count = 2 * pieces;
    CutEnd *ends = arena_push(arena, CutEnd, count);
    int *place = arena_push(arena, int, count), *next = arena_push(arena, int, count);
    bool *seen = arena_push(arena, bool, pieces);
    Curves curves = {.begin = arena_push(arena, int, pieces + 1),
                     .closed = arena_push(arena, bool, pieces),
                     .at = arena_push(arena, double, 4 * (size_t)pieces)};
    find_ends(part, height, middle, ends);
    qsort(ends, (size_t)count, sizeof *ends, compare_ends);
    join_ends(ends, count, place, next);
    for (int closed = 0; closed < 2; closed++) { /* those from rim to rim first */
        for (int end = 0; end < count; end++) {
            if (!seen[end / 2] && (closed || next[end] < 0)) {
                follow(ends, place, next, end, seen, &curves);
            }
        }
    }
    return curves;
}

/* [m] from p, of the middle of the support, to its outline; 0 inside */
static double find_distance(const DrapeSupport *support, const double *p) {
    double least = INFINITY;
    bool inside = support->count > 0;
    for (int i = 0; i < support->count; i++) {
        const double *a = support->outline + 2 * (size_t)i;
        const double *b = support->outline + 2 * (size_t)((i + 1) % support->count);
        double along[2] = {b[0] - a[0], b[1] - a[1]};
        double to[2] = {p[0] + support->centre[0] - a[0], p[1] + support->centre[1] - a[1]};
        double part =
            (to[0] * along[0] + to[1] * along[1]) / (along[0] * along[0] + along[1] * along[1]);
        part = fmin(fmax(part, 0.0), 1.0);
        least = fmin(least, hypot(to[0] - part * along[0], to[1] - part * along[1]));
        inside = inside && along[0] * to[1] - along[1] * to[0] > 0.0; /* it is convex */
    }
    return inside ? 0.0 : least;
}

/* p in half widths of a box, as its first side goes; false: the support is no box. */
static bool find_place(const DrapeSupport *support, const double *p, double place[2]) {
    for (int k = 0; k < 2 && support->count == 4; k++) {
        const double *from = support->outline, *to = support->outline + (k == 0 ? 2 : 6);
        double side[2] = {to[0] - from[0], to[1] - from[1]};
        place[k] =
            2.0 * (p[0] * side[0] + p[1] * side[1]) / (side[0] * side[0] + side[1] * side[1]);
    }
    return support->count == 4;
}

static int find_corner(const double place[2]) {
    return place[1] > 0.0 ? (place[0] > 0.0 ? 2 : 3) : (place[0] > 0.0 ? 1 : 0);
}

static void add_billows(const Curves *curves, int curve, Drape *drape, Arena *arena) {
    int begin = curves->begin[curve], count = curves->begin[curve + 1] - begin;
    const double *at = curves->at + 2 * (size_t)begin;
    double *off = arena_push(arena, double, count);
    Peak peaks[DRAPE_MOST_BILLOWS];
    for (int i = 0; i < count; i++) {
        off[i] = find_distance(&drape->support, at + 2 * (size_t)i);
    }
    int found = contour_find_peaks(off, count, curves->closed[curve], drape->cut.prominence, peaks,
                                   DRAPE_MOST_BILLOWS);
    for (int k = 0; k < found && drape->cut.count < DRAPE_MOST_BILLOWS; k++) {
        const double *p = at + 2 * (size_t)peaks[k].at;
        double angle = atan2(p[1], p[0]) - drape->warp, place[2];
        angle -= 2.0 * PI * floor(angle / (2.0 * PI));
        bool box = find_place(&drape->support, p, place);
        drape->cut.billows[drape->cut.count++] =
            (Billow){angle, off[peaks[k].at], peaks[k].prominence, box ? find_corner(place) : -1};
    }
}

/* Raises r (CONTOUR_RAYS, in half widths of the box, whose corners are then at 45 degrees). */
static void add_rays(const Curves *curves, const DrapeSupport *support, double *r) {
    for (int k = 0; k < curves->count; k++) {
        int begin = curves->begin[k], count = curves->begin[k + 1] - begin;
        for (int i = 0; i + !curves->closed[k] < count; i++) {
            double p[2], q[2];
            find_place(support, curves->at + 2 * (size_t)(begin + i), p);
            find_place(support, curves->at + 2 * (size_t)(begin + (i + 1) % count), q);
            contour_add_segment(r, 0.0, p, q);
        }
    }
}

/* What stands off along a ray, as an area over its angle. */
static double find_area(const double *r, int ray) {
    double angle = 2.0 * PI * ray / CONTOUR_RAYS;
    double edge = 1.0 / fmax(fabs(cos(angle)), fabs(sin(angle)));
    double far = r[(ray + CONTOUR_RAYS) % CONTOUR_RAYS];
    return fmax(far * far - edge * edge, 0.0);
}

static void measure_corners(const Curves *curves, const DrapeSupport *support, DrapeCut *cut) {
    enum { EIGHTH = CONTOUR_RAYS / 8 };
    double r[CONTOUR_RAYS] = {0}, mean[EIGHTH] = {0}, common = 0.0;
    add_rays(curves, support, r);
    for (int k = 0; k < 4; k++) {
        double odd[EIGHTH], all = 0.0, skew = 0.0;
        int corner = (5 + 2 * k) * EIGHTH, sense = k % 2 ? -1 : 1;
        for (int i = 0; i < EIGHTH; i++) {
            double one = find_area(r, corner + sense * i), other = find_area(r, corner - sense * i);
            odd[i] = one - other;
            skew += fabs(odd[i]);
            all += one + other;
        }
        cut->skew[k] = all > 0.0 ? skew / all : NAN;
        for (int i = 0; i < EIGHTH; i++) {
            mean[i] += all > 0.0 ? 0.25 * odd[i] / all : NAN;
        }
    }
    for (int i = 0; i < EIGHTH; i++) {
        common += fabs(mean[i]);
    }
    cut->skew_common = common;
    for (int i = 0; i < cut->count; i++) {
        cut->at_corner[cut->billows[i].corner]++;
    }
}

static int compare_billows(const void *a, const void *b) {
    const Billow *p = a, *q = b;
    return (p->angle > q->angle) - (p->angle < q->angle);
}

void drape_cut(const DrapePart *part, const DrapeDef *def, Arena *arena, Drape *drape) {
    DrapeCut *cut = &drape->cut;
    const DrapeSupport *support = &drape->support;
    *cut =
        (DrapeCut){.depth = isnan(def->cut) ? DRAPE_CUT * drape->specimen : def->cut,
                   .prominence = isnan(def->prominence) ? DRAPE_BILLOW_PROMINENCE * drape->specimen
                                                        : def->prominence,
                   .corners = support->count == 4 ? 4 : 0};
    Curves curves = find_curves(part, support->plane - cut->depth, support->centre, arena);
    for (int k = 0; k < curves.count; k++) {
        add_billows(&curves, k, drape, arena);
    }
    qsort(cut->billows, (size_t)cut->count, sizeof *cut->billows, compare_billows);
    if (cut->corners > 0) {
        measure_corners(&curves, support, cut);
    }
}
