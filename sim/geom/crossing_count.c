/* Counting: a tree of boxes over the triangles, walked against itself or against another. */
#include <float.h>
#include <stdio.h>
#include <stdlib.h>

#include "sim/base/error.h"
#include "sim/geom/crossing.h"

#define LEAF 4 /* triangles; 2 to 8 cost the same within 10 % */

typedef struct Box {
    double low[3], high[3]; /* [m] */
} Box;

/* Node 0 is the root; the children of an inner node stand side by side. */
typedef struct TreeNode {
    Box box;
    int begin, count; /* leaf: range in `order`; inner: count 0 */
    int child;        /* inner: first of the two */
} TreeNode;

typedef struct Tree {
    const CrossingMesh *mesh;
    TreeNode *nodes; /* (node_count) */
    Box *boxes;      /* (triangle_count) */
    int *order;      /* (triangle_count) triangle numbers, leaf by leaf */
    int node_count;
} Tree;

const char *crossing_find_damage(const CrossingMesh *mesh) {
    static _Thread_local char words[96];
    for (int i = 0; i < mesh->vertex_count; i++) {
        for (int k = 0; k < 3; k++) {
            if (!isfinite(mesh->vertices[3 * (size_t)i + (size_t)k])) {
                snprintf(words, sizeof words, "vertex %d is not finite", i);
                return words;
            }
        }
    }
    for (int i = 0; i < mesh->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            int vertex = mesh->triangles[3 * (size_t)i + (size_t)k];
            if (vertex < 0 || vertex >= mesh->vertex_count) {
                snprintf(words, sizeof words, "triangle %d names vertex %d of %d", i, vertex,
                         mesh->vertex_count);
                return words;
            }
        }
    }
    return NULL;
}

static const double *corner(const CrossingMesh *mesh, int triangle, int k) {
    return mesh->vertices + 3 * (size_t)mesh->triangles[3 * (size_t)triangle + (size_t)k];
}

static CrossingTriangle triangle_of(const CrossingMesh *mesh, int i) {
    return (CrossingTriangle){{corner(mesh, i, 0), corner(mesh, i, 1), corner(mesh, i, 2)}};
}

static Box box_empty(void) {
    return (Box){{DBL_MAX, DBL_MAX, DBL_MAX}, {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
}

static void box_add(Box *box, const double *low, const double *high) {
    for (int k = 0; k < 3; k++) {
        box->low[k] = low[k] < box->low[k] ? low[k] : box->low[k];
        box->high[k] = high[k] > box->high[k] ? high[k] : box->high[k];
    }
}

/* exact: the numbers are the coordinates themselves */
static bool boxes_meet(const Box *a, const Box *b) {
    return a->low[0] <= b->high[0] && b->low[0] <= a->high[0] && a->low[1] <= b->high[1] &&
           b->low[1] <= a->high[1] && a->low[2] <= b->high[2] && b->low[2] <= a->high[2];
}

/* twice the middle; halves first, against overflow */
static double middle(const Box *box, int axis) {
    return 0.5 * box->low[axis] + 0.5 * box->high[axis];
}

/* Puts the triangles with the `half` smallest middles first (Hoare's selection). */
static void select_half(const Tree *tree, int *order, int count, int half, int axis) {
    int low = 0, high = count - 1;
    while (low < high) {
        double pivot = middle(&tree->boxes[order[low + (high - low) / 2]], axis);
        int i = low, j = high;
        while (i <= j) {
            while (middle(&tree->boxes[order[i]], axis) < pivot) {
                i++;
            }
            while (middle(&tree->boxes[order[j]], axis) > pivot) {
                j--;
            }
            if (i <= j) {
                int keep = order[i];
                order[i++] = order[j];
                order[j--] = keep;
            }
        }
        if (half <= j) {
            high = j;
        } else if (half >= i) {
            low = i;
        } else {
            return;
        }
    }
}

static int longest_axis(const Box *box) {
    int axis = 0;
    for (int k = 1; k < 3; k++) {
        if (box->high[k] - box->low[k] > box->high[axis] - box->low[axis]) {
            axis = k;
        }
    }
    return axis;
}

/* Halves along the longest side, so the tree is at most log2(triangles) + 1 deep. */
static void build_node(Tree *tree, int index, int begin, int count) {
    TreeNode *node = &tree->nodes[index];
    node->box = box_empty();
    for (int i = begin; i < begin + count; i++) {
        const Box *box = &tree->boxes[tree->order[i]];
        box_add(&node->box, box->low, box->high);
    }
    if (count <= LEAF) {
        node->begin = begin;
        node->count = count;
        return;
    }
    int half = count / 2;
    select_half(tree, tree->order + begin, count, half, longest_axis(&node->box));
    node->child = tree->node_count;
    tree->node_count += 2;
    build_node(tree, node->child, begin, half);
    build_node(tree, node->child + 1, begin + half, count - half);
}

static Tree build_tree(const CrossingMesh *mesh, Arena *arena) {
    int count = mesh->triangle_count;
    Tree tree = {.mesh = mesh,
                 .nodes = arena_push(arena, TreeNode, 2 * count + 1),
                 .boxes = arena_push(arena, Box, count),
                 .order = arena_push(arena, int, count),
                 .node_count = 1};
    for (int i = 0; i < count; i++) {
        tree.order[i] = i;
        tree.boxes[i] = box_empty();
        for (int k = 0; k < 3; k++) {
            box_add(&tree.boxes[i], corner(mesh, i, k), corner(mesh, i, k));
        }
    }
    build_node(&tree, 0, 0, count);
    return tree;
}

/* Both triangles turned so that the corners that they share by number come first. */
static int share_corners(const CrossingMesh *mesh, int i, int j, CrossingTriangle *a,
                         CrossingTriangle *b) {
    const int32_t *p = mesh->triangles + 3 * (size_t)i, *q = mesh->triangles + 3 * (size_t)j;
    int shared = 0, rest_a = 0;
    bool used[3] = {false, false, false};
    const double *apart[3];
    for (int k = 0; k < 3; k++) {
        int twin = -1;
        for (int m = 0; m < 3; m++) {
            twin = !used[m] && p[k] == q[m] ? m : twin;
        }
        const double *at = mesh->vertices + 3 * (size_t)p[k];
        if (twin >= 0) {
            used[twin] = true;
            a->corner[shared] = b->corner[shared] = at;
            shared++;
        } else {
            apart[rest_a++] = at;
        }
    }
    for (int k = 0, at = shared; k < rest_a; k++) {
        a->corner[at++] = apart[k];
    }
    for (int m = 0, at = shared; m < 3; m++) {
        if (!used[m]) {
            b->corner[at++] = mesh->vertices + 3 * (size_t)q[m];
        }
    }
    return shared;
}

static void note(Crossings *found, int i, int j) {
    if (found->count++ == 0 || i < found->first[0] ||
        (i == found->first[0] && j < found->first[1])) {
        found->first[0] = i;
        found->first[1] = j;
    }
}

static void test_pair(const Tree *a, const Tree *b, int i, int j, Crossings *found) {
    CrossingTriangle first, second;
    int shared = 0;
    if (a == b) {
        int low = i < j ? i : j, high = i < j ? j : i;
        i = low, j = high;
        shared = share_corners(a->mesh, i, j, &first, &second);
    } else {
        first = triangle_of(a->mesh, i);
        second = triangle_of(b->mesh, j);
    }
    if (crossing_triangles_sharing(&first, &second, shared)) {
        note(found, i, j);
    }
}

static void test_leaves(const Tree *a, const Tree *b, const TreeNode *m, const TreeNode *n,
                        Crossings *found) {
    for (int i = 0; i < m->count; i++) {
        int one = a->order[m->begin + i];
        for (int j = m == n ? i + 1 : 0; j < n->count; j++) {
            int other = b->order[n->begin + j];
            if (boxes_meet(&a->boxes[one], &b->boxes[other])) {
                test_pair(a, b, one, other, found);
            }
        }
    }
}

/* Every pair of leaves below m and n whose boxes meet; below m == n of one tree, each pair once. */
static void walk(const Tree *a, const Tree *b, const TreeNode *m, const TreeNode *n,
                 Crossings *found) {
    if (!boxes_meet(&m->box, &n->box)) {
        return;
    }
    const TreeNode *m_child = a->nodes + m->child, *n_child = b->nodes + n->child;
    if (m->count && n->count) {
        test_leaves(a, b, m, n, found);
    } else if (m == n) {
        walk(a, b, m_child, m_child, found);
        walk(a, b, m_child + 1, m_child + 1, found);
        walk(a, b, m_child, m_child + 1, found);
    } else if (m->count) {
        walk(a, b, m, n_child, found);
        walk(a, b, m, n_child + 1, found);
    } else {
        walk(a, b, m_child, n, found);
        walk(a, b, m_child + 1, n, found);
    }
}

Crossings crossing_count_self(const CrossingMesh *mesh, Arena *scratch) {
    Crossings found = {0, {-1, -1}};
    if (mesh->triangle_count > 0) {
        ArenaMark mark = arena_mark(scratch);
        Tree tree = build_tree(mesh, scratch);
        walk(&tree, &tree, tree.nodes, tree.nodes, &found);
        arena_rewind(scratch, mark);
    }
    return found;
}

Crossings crossing_count_between(const CrossingMesh *a, const CrossingMesh *b, Arena *scratch) {
    Crossings found = {0, {-1, -1}};
    if (a->triangle_count > 0 && b->triangle_count > 0) {
        ArenaMark mark = arena_mark(scratch);
        Tree tree_a = build_tree(a, scratch), tree_b = build_tree(b, scratch);
        walk(&tree_a, &tree_b, tree_a.nodes, tree_b.nodes, &found);
        arena_rewind(scratch, mark);
    }
    return found;
}
