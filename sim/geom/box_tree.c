#include "sim/geom/box_tree.h"

#include <stdlib.h>

#define PART_LEVELS 6 /* 64 nodes with themselves and 192 pairs of others, at most */

typedef struct Keyed {
    double key;
    int item;
} Keyed;

static int by_key(const void *a, const void *b) {
    const Keyed *p = a, *q = b;
    if (p->key != q->key) {
        return p->key < q->key ? -1 : 1;
    }
    return p->item - q->item;
}

static double component(Vec3 p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

static void split(BoxTree *tree, int node, const Vec3 *centres, Keyed *items, int count) {
    if (count == 1) {
        tree->child[node] = -1 - items[0].item;
        return;
    }
    Box bounds = box_empty();
    for (int i = 0; i < count; i++) {
        box_add(&bounds, centres[items[i].item]);
    }
    Vec3 extent = vec3_sub(bounds.high, bounds.low);
    int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    for (int i = 0; i < count; i++) {
        items[i].key = component(centres[items[i].item], axis);
    }
    qsort(items, (size_t)count, sizeof *items, by_key);
    int child = tree->node_count;
    tree->child[node] = child;
    tree->node_count += 2;
    split(tree, child, centres, items, count / 2);
    split(tree, child + 1, centres, items + count / 2, count - count / 2);
}

BoxTree box_tree_create(const Vec3 *centres, int item_count, Arena *arena) {
    int most = item_count > 0 ? 2 * item_count - 1 : 0;
    BoxTree tree = {.item_count = item_count,
                    .node_count = item_count > 0,
                    .child = arena_push(arena, int, most),
                    .box = arena_push(arena, Box, most)};
    if (item_count > 0) {
        ArenaMark mark = arena_mark(arena);
        Keyed *items = arena_push(arena, Keyed, item_count);
        for (int i = 0; i < item_count; i++) {
            items[i].item = i;
        }
        split(&tree, 0, centres, items, item_count);
        arena_rewind(arena, mark);
    }
    return tree;
}

void box_tree_refit(BoxTree *tree, const Box *items) {
    /* children come after their parents */
    for (int node = tree->node_count - 1; node >= 0; node--) {
        int child = tree->child[node];
        tree->box[node] =
            child < 0 ? items[-1 - child] : box_union(tree->box[child], tree->box[child + 1]);
    }
}

typedef struct Query {
    const BoxTree *tree;
    double reach;
    BoxPairBody *body;
    void *context;
} Query;

static double volume(const Box *box) {
    Vec3 e = vec3_sub(box->high, box->low);
    return e.x + e.y + e.z;
}

/* of two nodes that have children, the larger one is split */
static bool splits_first(const BoxTree *tree, int a, int b) {
    return volume(&tree->box[a]) >= volume(&tree->box[b]);
}

static void descend(const Query *q, int a, int b) {
    const BoxTree *tree = q->tree;
    if (a == b) {
        int child = tree->child[a];
        if (child >= 0) {
            descend(q, child, child);
            descend(q, child + 1, child + 1);
            descend(q, child, child + 1);
        }
        return;
    }
    if (!box_near(&tree->box[a], &tree->box[b], q->reach)) {
        return;
    }
    int ca = tree->child[a], cb = tree->child[b];
    if (ca < 0 && cb < 0) {
        int i = -1 - ca, j = -1 - cb;
        q->body(i < j ? i : j, i < j ? j : i, q->context);
    } else if (cb < 0 || (ca >= 0 && splits_first(tree, a, b))) {
        descend(q, ca, b);
        descend(q, ca + 1, b);
    } else {
        descend(q, a, cb);
        descend(q, a, cb + 1);
    }
}

void box_tree_pairs(const BoxTree *tree, double reach, BoxPairBody *body, void *context) {
    if (tree->item_count > 1) {
        box_tree_part_pairs(tree, (BoxTreePart){0, 0}, reach, body, context);
    }
}

void box_tree_part_pairs(const BoxTree *tree, BoxTreePart part, double reach, BoxPairBody *body,
                         void *context) {
    Query query = {tree, reach, body, context};
    descend(&query, part.a, part.b);
}

typedef struct Parting {
    const BoxTree *tree;
    double reach;
    BoxTreePart *parts;
    int count;
} Parting;

/* as descend, some levels deep */
static void part(Parting *p, int a, int b, int levels) {
    const int *child = p->tree->child;
    if (a != b && !box_near(&p->tree->box[a], &p->tree->box[b], p->reach)) {
        return;
    }
    if (levels == 0 || child[a] < 0 || child[b] < 0) {
        p->parts[p->count++] = (BoxTreePart){a, b};
    } else if (a == b) {
        part(p, child[a], child[a], levels - 1);
        part(p, child[a] + 1, child[a] + 1, levels - 1);
        part(p, child[a], child[a] + 1, levels - 1);
    } else {
        bool first = splits_first(p->tree, a, b);
        part(p, first ? child[a] : a, first ? b : child[b], levels - 1);
        part(p, first ? child[a] + 1 : a, first ? b : child[b] + 1, levels - 1);
    }
}

int box_tree_parts(const BoxTree *tree, double reach, BoxTreePart *parts) {
    Parting parting = {tree, reach, parts, 0};
    if (tree->item_count > 1) {
        part(&parting, 0, 0, PART_LEVELS);
    }
    return parting.count;
}
