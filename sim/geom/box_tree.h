/* box_tree.h: a binary tree over boxes that move but stay neighbours. Its shape is fixed once,
 * from start centres; the boxes are refitted before a query. */
#ifndef TOILE_GEOM_BOX_TREE_H
#define TOILE_GEOM_BOX_TREE_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/base/vec.h"

typedef struct Box {
    Vec3 low, high; /* [m]; low > high: empty */
} Box;

static inline Box box_empty(void) {
    return (Box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}
static inline void box_add(Box *box, Vec3 p) {
    box->low.x = p.x < box->low.x ? p.x : box->low.x;
    box->low.y = p.y < box->low.y ? p.y : box->low.y;
    box->low.z = p.z < box->low.z ? p.z : box->low.z;
    box->high.x = p.x > box->high.x ? p.x : box->high.x;
    box->high.y = p.y > box->high.y ? p.y : box->high.y;
    box->high.z = p.z > box->high.z ? p.z : box->high.z;
}
static inline Box box_union(Box a, Box b) {
    box_add(&a, b.low);
    box_add(&a, b.high);
    return a;
}
/* are the boxes nearer than `reach` along every axis? By the largest gap: a branch for each would be
 * foreseen too seldom */
static inline bool box_near(const Box *a, const Box *b, double reach) {
    double x = max2(a->low.x - b->high.x, b->low.x - a->high.x);
    double y = max2(a->low.y - b->high.y, b->low.y - a->high.y);
    double z = max2(a->low.z - b->high.z, b->low.z - a->high.z);
    return max2(max2(x, y), z) <= reach;
}
/* [m] lower bound of the distance of their contents */
static inline double box_distance(const Box *a, const Box *b) {
    double x = max2(0.0, max2(a->low.x - b->high.x, b->low.x - a->high.x));
    double y = max2(0.0, max2(a->low.y - b->high.y, b->low.y - a->high.y));
    double z = max2(0.0, max2(a->low.z - b->high.z, b->low.z - a->high.z));
    return sqrt(x * x + y * y + z * z);
}

typedef struct BoxTree {
    int item_count, node_count;
    int *child; /* (node_count) first of two neighbouring children; -1 - item for a leaf */
    Box *box;   /* (node_count) */
} BoxTree;

/* Median splits of the centres along their longest extent; ties by item number. */
BoxTree box_tree_create(const Vec3 *centres, int item_count, Arena *arena);

void box_tree_refit(BoxTree *tree, const Box *items);

typedef void BoxPairBody(int a, int b, void *context);

/* Calls body for every pair a < b of items nearer than `reach`, always in the same order. */
void box_tree_pairs(const BoxTree *tree, double reach, BoxPairBody *body, void *context);

/* The same in parts, for threads: all pairs of one part after those of another, in the same order. */
typedef struct BoxTreePart {
    int a, b;
} BoxTreePart;

#define BOX_TREE_PARTS 256

/* parts: (BOX_TREE_PARTS); returns how many there are. */
int box_tree_parts(const BoxTree *tree, double reach, BoxTreePart *parts);
void box_tree_part_pairs(const BoxTree *tree, BoxTreePart part, double reach, BoxPairBody *body,
                         void *context);

#endif
