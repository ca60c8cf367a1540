/* Sewn panels: each has a smooth surface of its own, and on a seam the two are drawn half-way. */
#include <stdlib.h>

#include "render/apart_parts.h"

/* Bits of ApartTriangle.sewn, of the first side and corner. */
#define SEWN_SIDE 1
#define SEWN_CORNER 8

/* Side k of a triangle, from corner k to the next. */
typedef struct Side {
    int32_t low, high; /* joined vertices */
    int triangle, number;
} Side;

static int compare_sides(const void *a, const void *b) {
    const Side *p = a, *q = b;
    if (p->low != q->low || p->high != q->high) {
        return p->low != q->low ? (p->low > q->low) - (p->low < q->low)
                                : (p->high > q->high) - (p->high < q->high);
    }
    return p->triangle != q->triangle ? (p->triangle > q->triangle) - (p->triangle < q->triangle)
                                      : p->number - q->number;
}

/* Two sides with the same ends that do not have the same vertices, both cut alike. */
static bool are_sewn(const Apart *apart, const Side *a, const Side *b) {
    const Piece *p = &apart->pieces[a->triangle], *q = &apart->pieces[b->triangle];
    int32_t p0 = p->corner[a->number], p1 = p->corner[(a->number + 1) % 3];
    int32_t q0 = q->corner[b->number], q1 = q->corner[(b->number + 1) % 3];
    bool same = (p0 == q0 && p1 == q1) || (p0 == q1 && p1 == q0);
    return !same && p->level == q->level && p->level > 1;
}

/* Corners at nodes that several vertices share. False: there are none. */
static bool find_seam_nodes(Apart *apart, Arena *scratch) {
    bool any = false, *shared = arena_push(scratch, bool, apart->vertex_count);
    for (int i = 0; i < apart->vertex_count; i++) {
        bool other = apart->join[i] != i;
        shared[apart->join[i]] = shared[apart->join[i]] || other;
        any = any || other;
    }
    for (int i = 0; i < 3 * apart->triangle_count; i++) {
        const Piece *piece = &apart->pieces[i / 3];
        if (piece->level > 0 && shared[apart->join[piece->corner[i % 3]]]) {
            apart->triangles[i / 3].sewn |= SEWN_CORNER << i % 3;
        }
    }
    return any;
}

void apart_find_seams(Apart *apart, Arena *arena) {
    Arena scratch = {0};
    int count = 3 * apart->triangle_count;
    if (!find_seam_nodes(apart, &scratch)) {
        arena_free(&scratch);
        return;
    }
    apart->seams = arena_push(arena, ApartSeam, count);
    Side *sides = arena_push(&scratch, Side, count);
    for (int i = 0; i < count; i++) {
        const int32_t *corner = apart->pieces[i / 3].corner;
        int32_t one = apart->join[corner[i % 3]], two = apart->join[corner[(i + 1) % 3]];
        sides[i] = (Side){one < two ? one : two, one < two ? two : one, i / 3, i % 3};
    }
    qsort(sides, (size_t)count, sizeof *sides, compare_sides);
    for (int i = 0, end = 0; i < count; i = end) {
        for (end = i + 1;
             end < count && sides[end].low == sides[i].low && sides[end].high == sides[i].high;) {
            end++;
        }
        if (end == i + 2 && are_sewn(apart, &sides[i], &sides[i + 1])) {
            ApartSeam *seam = &apart->seams[apart->seam_count++];
            for (int k = 0; k < 2; k++) {
                seam->triangle[k] = sides[i + k].triangle;
                seam->side[k] = sides[i + k].number;
                apart->triangles[seam->triangle[k]].sewn |= SEWN_SIDE << seam->side[k];
            }
        }
    }
    arena_free(&scratch);
}

/* The grid place of vertex s of n on a side. */
static void place_on_side(int side, int s, int n, int *i, int *j) {
    *i = side == 0 ? s : side == 1 ? n - s : 0;
    *j = side == 0 ? 0 : side == 1 ? s : n - s;
}

static float *leave_on_side(const Apart *apart, int t, int side, int s) {
    int i, j, n = apart->pieces[t].level;
    place_on_side(side, s, n, &i, &j);
    return apart_leaves(apart, t) + 3 * (j * (n + 1) - j * (j - 1) / 2 + i);
}

void apart_sew(Apart *apart) {
    for (int k = 0; k < apart->seam_count; k++) {
        const ApartSeam *seam = &apart->seams[k];
        const Piece *p = &apart->pieces[seam->triangle[0]], *q = &apart->pieces[seam->triangle[1]];
        bool along = apart->join[p->corner[seam->side[0]]] == apart->join[q->corner[seam->side[1]]];
        ApartTriangle *one = &apart->triangles[seam->triangle[0]];
        ApartTriangle *two = &apart->triangles[seam->triangle[1]];
        double reach = max2(one->reach, two->reach);
        one->reach = one->rise = one->fall = two->reach = two->rise = two->fall = reach;
        for (int s = 1; s < p->level; s++) {
            float *a = leave_on_side(apart, seam->triangle[0], seam->side[0], s);
            float *b =
                leave_on_side(apart, seam->triangle[1], seam->side[1], along ? s : p->level - s);
            for (int c = 0; c < 3; c++) {
                a[c] = b[c] = 0.5f * (a[c] + b[c]);
            }
        }
    }
}

bool apart_is_sewn(const Apart *apart, int t, int i, int j) {
    int sewn = apart->triangles[t].sewn, n = apart->pieces[t].level, corner = SEWN_CORNER;
    bool side = (sewn & SEWN_SIDE && j == 0) || (sewn & SEWN_SIDE << 1 && i + j == n) ||
                (sewn & SEWN_SIDE << 2 && i == 0);
    return side || (sewn & corner && i + j == 0) || (sewn & corner << 1 && i == n) ||
           (sewn & corner << 2 && j == n);
}
