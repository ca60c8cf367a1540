#include "sim/contact/lists.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/contact/constants.h"

#define TRIM_BINS 32      /* of distance, to choose a slack */
#define LEAST_HOLES 4096  /* pairs; fewer are not worth closing */
#define SAFE_FAR 1.0001   /* more than rounding does to a squared distance */
#define LEAST_SINE2 1e-12 /* of two edges: below, their common normal is noise */

Lists lists_create(const Surface *surface, const double *start, bool cloth_meets_cloth,
                   Arena *arena) {
    Lists l = {
        .surface = surface, .cloth_meets_cloth = cloth_meets_cloth, .arena = arena, .stamp = 1};
    l.slopes = arena_push(arena, GroupSlopes, surface->group_count);
    l.bounds = arena_push(arena, GroupBounds, surface->group_count);
    l.boxes = arena_push(arena, Box, surface->group_count);
    Vec3 *centres = arena_push(arena, Vec3, surface->group_count);
    for (int g = 0; g < surface->group_count; g++) {
        Box box = box_empty();
        const SurfaceGroup *group = &surface->groups[g];
        for (int k = group->vertex_begin; k < group->vertex_end; k++) {
            box_add(&box, vec3_load(start + 3 * (size_t)surface->group_vertices[k]));
        }
        centres[g] = vec3_scale(0.5, vec3_add(box.low, box.high));
    }
    l.tree = box_tree_create(centres, surface->group_count, arena);
    return l;
}

/* ---- bristles between lists ---- */

static void key_of(const Pair *pair, int key[4]) {
    memcpy(key, pair->place, 4 * sizeof *key);
    key[3] = pair->kind == PAIR_EDGES ? -1 - key[3] : key[3];
}

/* where a key is, or the free place for it; place[0] < 0 is free */
static PairMemory *kept_at(const Lists *l, const int key[4]) {
    uint64_t mask = (uint64_t)l->kept_room - 1;
    for (uint64_t i = hash_bytes(key, 4 * sizeof *key);; i++) {
        PairMemory *m = &l->kept[i & mask];
        if (m->place[0] < 0 || memcmp(m->place, key, sizeof m->place) == 0) {
            return m;
        }
    }
}

static void kept_empty(Lists *l) {
    for (int i = 0; i < l->kept_room && l->kept_count > 0; i++) {
        l->kept[i].place[0] = -1;
    }
    l->kept_count = 0;
}

static void keep(Lists *l, const PairMemory *memory) {
    if (2 * (l->kept_count + 1) > l->kept_room) {
        PairMemory *old = l->kept;
        int room = l->kept_room;
        l->kept_room = room ? 2 * room : 1024;
        l->kept = arena_push(l->arena, PairMemory, l->kept_room);
        for (int i = 0; i < l->kept_room; i++) {
            l->kept[i].place[0] = -1;
        }
        for (int i = 0; i < room; i++) {
            if (old[i].place[0] >= 0) {
                *kept_at(l, old[i].place) = old[i];
            }
        }
    }
    PairMemory *at = kept_at(l, memory->place);
    l->kept_count += at->place[0] < 0;
    *at = *memory;
}

static bool is_stretched(const Pair *pair) {
    return pair->bristle.x != 0.0 || pair->bristle.y != 0.0 || pair->bristle.z != 0.0;
}

static PairMemory memory_of(const Pair *pair) {
    PairMemory memory;
    key_of(pair, memory.place);
    vec3_store(memory.bristle, pair->bristle);
    return memory;
}

int lists_remember(const Lists *l, PairMemory *memory, int room) {
    int count = 0;
    for (int i = 0; i < l->group_pair_count; i++) {
        const GroupPair *owner = &l->group_pairs[i];
        for (int p = owner->begin; p < owner->begin + owner->count && count < room; p++) {
            if (is_stretched(&l->pairs[p])) {
                memory[count++] = memory_of(&l->pairs[p]);
            }
        }
    }
    return count;
}

void lists_clear(Lists *l, const PairMemory *memory, int memory_count) {
    l->group_pair_count = l->pair_count = l->pair_end = 0;
    l->reach = l->spent = 0.0;
    l->stamp++;
    kept_empty(l);
    for (int i = 0; i < memory_count; i++) {
        keep(l, &memory[i]);
    }
}

/* ---- blocks of pairs ---- */

/* leaves a hole behind */
static void drop_block(Lists *l, GroupPair *owner) {
    for (int p = owner->begin; p < owner->begin + owner->count; p++) {
        if (is_stretched(&l->pairs[p])) {
            PairMemory memory = memory_of(&l->pairs[p]);
            keep(l, &memory);
        }
    }
    l->pair_count -= owner->count;
    owner->count = 0;
}

/* closes the holes */
static void pack_blocks(Lists *l) {
    if (l->old_room < l->pair_room) {
        l->old_pairs = arena_push(l->arena, Pair, l->pair_room);
        l->old_due = arena_push(l->arena, double, l->pair_room);
        l->old_room = l->pair_room;
    }
    int end = 0;
    for (int i = 0; i < l->group_pair_count; i++) {
        GroupPair *owner = &l->group_pairs[i];
        size_t count = (size_t)owner->count;
        if (count > 0) {
            memcpy(l->old_pairs + end, l->pairs + owner->begin, count * sizeof *l->pairs);
            memcpy(l->old_due + end, l->due + owner->begin, count * sizeof *l->due);
        }
        owner->begin = end;
        end += owner->count;
    }
    Pair *pairs = l->pairs;
    double *due = l->due;
    int room = l->pair_room;
    l->pairs = l->old_pairs, l->due = l->old_due, l->pair_room = l->old_room;
    l->old_pairs = pairs, l->old_due = due, l->old_room = room;
    l->pair_end = end;
}

/* ---- level 1 ---- */

static const SurfacePanel *panel_of(const Lists *l, int g) {
    return &l->surface->panels[l->surface->groups[g].panel];
}

static void bound_group(Lists *l, const Points *x, int g) {
    GroupBounds *bounds = &l->bounds[g];
    const SurfaceGroup *group = &l->surface->groups[g];
    if (bounds->boxed == l->stamp || (bounds->boxed > 0 && panel_of(l, g)->still)) {
        return;
    }
    bounds->boxed = l->stamp;
    bounds->all = box_empty();
    for (int c = group->cell_begin; c < group->cell_end; c++) {
        const SurfaceCell *cell = &l->surface->cells[c];
        Box box = box_empty();
        for (int k = 0; k < 3 * cell->triangle_count; k++) {
            box_add(&box, point_at(x, l->surface->triangles[3 * cell->triangle[k / 3] + k % 3]));
        }
        bounds->cell[c - group->cell_begin] = box;
        bounds->all = box_union(bounds->all, box);
    }
}

static uint64_t pair_hash(int a, int b) {
    int key[2] = {a, b};
    return hash_bytes(key, sizeof key);
}

static void add_group_pair(int a, int b, void *context) {
    Lists *l = context;
    bool mesh_a = panel_of(l, a)->obstacle, mesh_b = panel_of(l, b)->obstacle;
    if ((mesh_a && mesh_b) || (!mesh_a && !mesh_b && !l->cloth_meets_cloth)) {
        return;
    }
    if (box_distance(&l->boxes[a], &l->boxes[b]) > l->reach) {
        return;
    }
    if (l->group_pair_count == l->group_pair_room) {
        int old = l->group_pair_room, room = 2 * old + 4 * l->surface->group_count + 64;
        l->group_pairs = arena_grow(l->arena, GroupPair, l->group_pairs, old, room);
        l->old_group_pairs = arena_grow(l->arena, GroupPair, l->old_group_pairs, old, room);
        l->renumber = arena_grow(l->arena, int, l->renumber, old, room);
        l->group_pair_room = room;
    }
    l->group_pairs[l->group_pair_count++] = (GroupPair){.a = a, .b = b, .limit = -1.0};
}

/* hash of the old group pairs: number + 1 */
static void index_old(Lists *l, int count) {
    int wanted = 64;
    while (wanted < 4 * count) {
        wanted *= 2;
    }
    if (wanted > l->slot_count) {
        l->slot_count = wanted;
        l->slots = arena_push(l->arena, int, wanted);
    }
    memset(l->slots, 0, (size_t)l->slot_count * sizeof *l->slots);
    for (int i = 0; i < count; i++) {
        uint64_t at = pair_hash(l->old_group_pairs[i].a, l->old_group_pairs[i].b);
        while (l->slots[at & ((uint64_t)l->slot_count - 1)]) {
            at++;
        }
        l->slots[at & ((uint64_t)l->slot_count - 1)] = i + 1;
    }
}

static int find_old(const Lists *l, int a, int b) {
    for (uint64_t at = pair_hash(a, b);; at++) {
        int i = l->slots[at & ((uint64_t)l->slot_count - 1)] - 1;
        if (i < 0 || (l->old_group_pairs[i].a == a && l->old_group_pairs[i].b == b)) {
            return i;
        }
    }
}

void lists_remake(Lists *l, const Points *x, double least_reach) {
    int groups = l->surface->group_count, old_count = l->group_pair_count;
    GroupPair *old = l->group_pairs;
    l->group_pairs = l->old_group_pairs, l->old_group_pairs = old;
    l->group_pair_count = 0;
    double size = 0.0;
    int cloth_groups = 0;
    for (int g = 0; g < groups; g++) {
        bound_group(l, x, g);
        l->boxes[g] = l->bounds[g].all;
        if (!panel_of(l, g)->obstacle) {
            size += vec3_length(vec3_sub(l->boxes[g].high, l->boxes[g].low));
            cloth_groups++;
        }
    }
    size /= cloth_groups;
    l->reach = max2(CONTACT_GROUP_REACH * size, 2.0 * least_reach);
    l->spent = l->widest = 0.0;
    box_tree_refit(&l->tree, l->boxes);
    for (int g = 0; g < groups; g++) {
        add_group_pair(g, g, l);
    }
    box_tree_pairs(&l->tree, l->reach, add_group_pair, l);
    index_old(l, old_count);
    memset(l->renumber, -1, (size_t)l->group_pair_room * sizeof *l->renumber);
    for (int i = 0; i < l->group_pair_count; i++) {
        GroupPair *pair = &l->group_pairs[i];
        int before = old_count > 0 ? find_old(l, pair->a, pair->b) : -1;
        if (before >= 0) {
            *pair = l->old_group_pairs[before];
            l->renumber[before] = i;
            l->widest = max2(l->widest, pair->near);
        }
    }
    for (int i = 0; i < old_count; i++) {
        if (l->renumber[i] < 0) {
            drop_block(l, &l->old_group_pairs[i]);
        }
    }
    pack_blocks(l);
}

/* ---- level 2 ---- */

typedef struct Search {
    Lists *lists;
    const Points *x;
    double path, reach, near, dhat;
    const SurfacePanel
        *scattered; /* of both, or NULL: neighbours may be nearer than dhat at rest */
} Search;

/* are the parallel planes that hold the two features farther apart than the reach? Cheaper than
 * the distance, of which theirs is a lower bound. */
static inline bool planes_far(const Search *s, PairKind kind, const int place[4]) {
    Vec3 a = point_at(s->x, place[0]), b = point_at(s->x, place[1]);
    Vec3 c = point_at(s->x, place[2]), d = point_at(s->x, place[3]);
    Vec3 e = kind == PAIR_FACE ? vec3_sub(c, d) : vec3_sub(a, b);
    Vec3 f = kind == PAIR_FACE ? vec3_sub(b, d) : vec3_sub(c, d);
    Vec3 normal = vec3_cross(e, f);
    double apart = vec3_dot(normal, vec3_sub(a, d)), square = vec3_dot(normal, normal);
    return apart * apart > SAFE_FAR * s->reach * s->reach * square &&
           square > LEAST_SINE2 * vec3_dot(e, e) * vec3_dot(f, f);
}

static void make_pair_room(Lists *l) {
    int room = 2 * l->pair_room + 1024;
    l->pairs = arena_grow(l->arena, Pair, l->pairs, l->pair_end, room);
    l->due = arena_grow(l->arena, double, l->due, l->pair_end, room);
    l->pair_room = room;
}

static void add_pair(const Search *s, PairKind kind, int a, int b, int c, int d) {
    Lists *l = s->lists;
    int place[4] = {a, b, c, d};
    if (planes_far(s, kind, place)) {
        return;
    }
    if (l->pair_end == l->pair_room) {
        make_pair_room(l);
    }
    Pair *pair = &l->pairs[l->pair_end];
    *pair = (Pair){.kind = kind, .place = {a, b, c, d}, .dhat = s->dhat};
    pair_evaluate(s->x, pair);
    if (pair->distance > s->reach) {
        return;
    }
    if (s->scattered) {
        pair->dhat = pair_rest_limit(s->scattered, pair, s->dhat);
    }
    if (l->kept_count > 0) {
        int key[4];
        key_of(pair, key);
        const PairMemory *memory = kept_at(l, key);
        if (memory->place[0] >= 0) {
            pair->bristle = vec3_load(memory->bristle);
        }
    }
    l->due[l->pair_end++] = s->path + pair->distance - s->near;
}

static inline Box box_of(const Points *x, const int *places, int count) {
    Vec3 first = point_at(x, places[0]);
    Box box = {first, first};
    for (int k = 1; k < count; k++) {
        box_add(&box, point_at(x, places[k]));
    }
    return box;
}

/* boxes of what a cell owns, made when they are first needed */
typedef struct CellBoxes {
    bool known;
    Box triangle[2], edge[5];
} CellBoxes;

static const CellBoxes *cell_boxes(const Search *s, const SurfaceCell *cell, CellBoxes *boxes) {
    if (!boxes->known) {
        const Surface *surface = s->lists->surface;
        boxes->known = true;
        for (int k = 0; k < cell->triangle_count; k++) {
            boxes->triangle[k] =
                box_of(s->x, surface->triangles + 3 * (size_t)cell->triangle[k], 3);
        }
        for (int k = 0; k < cell->edge_count; k++) {
            boxes->edge[k] = box_of(s->x, surface->edges + 2 * (size_t)cell->edge[k], 2);
        }
    }
    return boxes;
}

/* vertices owned by cell a against triangles of cell b, whose box is `around` */
static void search_faces(const Search *s, const SurfaceCell *a, const SurfaceCell *b,
                         const Box *around, const CellBoxes *in_b) {
    for (int k = 0; k < a->vertex_count; k++) {
        int v = a->vertex[k];
        Box point = box_of(s->x, &v, 1);
        for (int t = 0; t < b->triangle_count && box_near(&point, around, s->reach); t++) {
            const int *corner = s->lists->surface->triangles + 3 * (size_t)b->triangle[t];
            if (v != corner[0] && v != corner[1] && v != corner[2] &&
                box_near(&point, &in_b->triangle[t], s->reach)) {
                add_pair(s, PAIR_FACE, v, corner[0], corner[1], corner[2]);
            }
        }
    }
}

static void search_edges(const Search *s, const SurfaceCell *a, const CellBoxes *in_a,
                         const SurfaceCell *b, const Box *around, const CellBoxes *in_b) {
    for (int i = 0; i < a->edge_count; i++) {
        const int *p = s->lists->surface->edges + 2 * (size_t)a->edge[i];
        if (!box_near(&in_a->edge[i], around, s->reach)) {
            continue;
        }
        for (int j = a == b ? i + 1 : 0; j < b->edge_count; j++) {
            const int *q = s->lists->surface->edges + 2 * (size_t)b->edge[j];
            if (box_near(&in_a->edge[i], &in_b->edge[j], s->reach) && p[0] != q[0] &&
                p[0] != q[1] && p[1] != q[0] && p[1] != q[1]) {
                add_pair(s, PAIR_EDGES, p[0], p[1], q[0], q[1]);
            }
        }
    }
}

static void search_pair(const Search *s, const GroupPair *pair) {
    const Lists *l = s->lists;
    const SurfaceGroup *a = &l->surface->groups[pair->a], *b = &l->surface->groups[pair->b];
    const GroupBounds *in_a = &l->bounds[pair->a], *in_b = &l->bounds[pair->b];
    CellBoxes boxes_a[SURFACE_GROUP_CELLS], boxes_b[SURFACE_GROUP_CELLS];
    for (int k = 0; k < SURFACE_GROUP_CELLS; k++) {
        boxes_a[k].known = boxes_b[k].known = false;
    }
    for (int i = a->cell_begin; i < a->cell_end; i++) {
        const Box *box = &in_a->cell[i - a->cell_begin];
        if (!box_near(box, &in_b->all, s->reach)) {
            continue;
        }
        for (int j = pair->a == pair->b ? i : b->cell_begin; j < b->cell_end; j++) {
            const SurfaceCell *p = &l->surface->cells[i], *q = &l->surface->cells[j];
            const Box *other = &in_b->cell[j - b->cell_begin];
            if (!box_near(box, other, s->reach)) {
                continue;
            }
            const CellBoxes *of_p = cell_boxes(s, p, &boxes_a[i - a->cell_begin]);
            const CellBoxes *of_q = cell_boxes(s, q, &boxes_b[j - b->cell_begin]);
            search_faces(s, p, q, other, of_q);
            if (i != j) {
                search_faces(s, q, p, box, of_p);
            }
            search_edges(s, p, of_p, q, other, of_q);
        }
    }
}

/* [m] slack that leaves few pairs of those from `first` on, but at least `slack`; drops the rest */
static double trim_pairs(Lists *l, int first, double near, double slack, double longest) {
    int found = l->pair_end - first;
    if (found <= CONTACT_FEW_PAIRS || longest <= slack) {
        return longest;
    }
    int bins[TRIM_BINS] = {0}, most = 0;
    double width = longest / TRIM_BINS;
    for (int p = first; p < l->pair_end; p++) {
        int bin = (int)((l->pairs[p].distance - near) / width);
        bins[bin < 0 ? 0 : bin >= TRIM_BINS ? TRIM_BINS - 1 : bin]++;
    }
    for (int sum = bins[0]; most + 1 < TRIM_BINS && sum <= CONTACT_FEW_PAIRS;) {
        sum += bins[++most];
    }
    slack = max2(slack, most * width);
    int kept = first;
    for (int p = first; p < l->pair_end; p++) {
        if (l->pairs[p].distance <= near + slack) {
            l->pairs[kept] = l->pairs[p];
            l->due[kept++] = l->due[p];
        }
    }
    l->pair_end = kept;
    return slack;
}

static void query_one(Lists *l, const Points *x, int index, double dt) {
    GroupPair *pair = &l->group_pairs[index];
    const SurfaceGroup *a = &l->surface->groups[pair->a], *b = &l->surface->groups[pair->b];
    const SurfacePanel *of_a = &l->surface->panels[a->panel];
    const SurfacePanel *of_b = &l->surface->panels[b->panel];
    double dhat = 0.5 * (of_a->distance + of_b->distance), step = pair->speed * dt;
    pair->near = max2(dhat, CONTACT_NEAR_STEPS * step);
    l->widest = max2(l->widest, pair->near);
    double most = max2(CONTACT_LEAST_SLACK * dhat, CONTACT_LONG_SLACK * of_a->h1);
    double slack = min2(most, max2(CONTACT_LEAST_SLACK * dhat, CONTACT_SLACK_STEPS * step));
    double enough = pair->near + CONTACT_LEAST_SLACK * dhat, apart;
    apart = flatness_distance(l->surface, l->slopes, x, l->stamp, pair->a, pair->b);
    if (apart <= enough) {
        bound_group(l, x, pair->a);
        bound_group(l, x, pair->b);
        if (pair->a != pair->b) {
            apart = box_distance(&l->bounds[pair->a].all, &l->bounds[pair->b].all);
        }
    }
    if (apart > enough) {
        pair->limit = pair->path + apart - pair->near;
        return;
    }
    double longest = pair->dense ? slack : max2(slack, min2(most, CONTACT_LONG_SLACK_STEPS * step));
    Search search = {.lists = l,
                     .x = x,
                     .path = pair->path,
                     .reach = pair->near + longest,
                     .near = pair->near,
                     .dhat = dhat,
                     .scattered = a->panel == b->panel && of_a->nu == 0 ? of_a : NULL};
    pair->begin = l->pair_end;
    search_pair(&search, pair);
    pair->dense = l->pair_end - pair->begin > CONTACT_FEW_PAIRS;
    pair->limit = pair->path + trim_pairs(l, pair->begin, pair->near, slack, longest);
    pair->count = l->pair_end - pair->begin;
    pair->evaluated = l->stamp;
    pair->earliest = INFINITY;
    for (int p = pair->begin; p < l->pair_end; p++) {
        pair->earliest = min2(pair->earliest, l->due[p]);
    }
    l->pair_count += pair->count;
}

void lists_query(Lists *l, const Points *x, const unsigned char *wanted, double dt) {
    for (int i = 0; i < l->group_pair_count; i++) {
        if (wanted[i] && l->group_pairs[i].count > 0) {
            drop_block(l, &l->group_pairs[i]);
        }
    }
    for (int i = 0; i < l->group_pair_count; i++) {
        if (wanted[i]) {
            query_one(l, x, i, dt);
        }
    }
    if (l->pair_end > 2 * l->pair_count + LEAST_HOLES) {
        pack_blocks(l);
    }
    kept_empty(l);
}
