#include "sim/contact/lists.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "sim/contact/constants.h"
#include "sim/contact/search.h"

#define LEAST_HOLES 4096 /* pairs; fewer are not worth closing */

Lists lists_create(const Surface *surface, const double *start, bool cloth_meets_cloth,
                   Arena *arena) {
    static const PathKernel *const kernels[] = {&path_kernel_scalar, &path_kernel_sse2,
                                                &path_kernel_avx2, &path_kernel_avx512};
    Lists l = {.surface = surface,
               .cloth_meets_cloth = cloth_meets_cloth,
               .width = vector_best(),
               .arena = arena,
               .stamp = 1};
    l.path_kernel = kernels[l.width];
    l.flatness = flatness_create(surface, arena);
    l.bounds = arena_push(arena, GroupBounds, surface->group_count);
    l.boxes = arena_push(arena, Box, surface->group_count);
    l.marked = arena_push(arena, int, surface->group_count + 8);
    l.boxed = arena_push(arena, unsigned, surface->group_count);
    l.sloped = arena_push(arena, unsigned, surface->group_count);
    l.is_marked = arena_push(arena, unsigned char, surface->group_count + 8);
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

void lists_recall(const Lists *l, Pair *pair) {
    if (l->kept_count > 0) {
        int key[4];
        key_of(pair, key);
        const PairMemory *memory = kept_at(l, key);
        if (memory->place[0] >= 0) {
            pair->bristle = vec3_load(memory->bristle);
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

static uint64_t pair_hash(int a, int b) {
    int key[2] = {a, b};
    return hash_bytes(key, sizeof key);
}

static void grow_paths(PathRows *paths, int used, int room, Arena *arena) {
    paths->ends = arena_grow(arena, PathEnds, paths->ends, used, room);
    paths->path = arena_grow(arena, double, paths->path, used, room);
    paths->next = arena_grow(arena, double, paths->next, used, room);
    paths->limit = arena_grow(arena, double, paths->limit, used, room);
    paths->near = arena_grow(arena, double, paths->near, used, room);
    paths->speed = arena_grow(arena, double, paths->speed, used, room);
    paths->earliest = arena_grow(arena, double, paths->earliest, used, room);
    paths->flags = arena_grow(arena, unsigned char, paths->flags, used, room);
}

static void set_path(PathRows *paths, int i, PathEnds ends) {
    paths->ends[i] = ends;
    paths->path[i] = paths->next[i] = paths->speed[i] = 0.0;
    paths->limit[i] = paths->near[i] = -1.0;
    paths->earliest[i] = INFINITY;
}

/* what stays when the lists are made again */
static void take_path(PathRows *paths, int i, const PathRows *old, int before) {
    paths->path[i] = old->path[before];
    paths->limit[i] = old->limit[before];
    paths->near[i] = old->near[before];
    paths->speed[i] = old->speed[before];
    paths->earliest[i] = old->earliest[before];
}

static bool may_meet(const Lists *l, int a, int b) {
    bool mesh_a = panel_of(l, a)->obstacle, mesh_b = panel_of(l, b)->obstacle;
    if ((mesh_a && mesh_b) || (!mesh_a && !mesh_b && !l->cloth_meets_cloth)) {
        return false;
    }
    return box_distance(&l->boxes[a], &l->boxes[b]) <= l->reach;
}

static void add_group_pair(Lists *l, PathEnds ends) {
    if (l->group_pair_count == l->group_pair_room) {
        int old = l->group_pair_room, room = 2 * old + 4 * l->surface->group_count + 64;
        l->group_pairs = arena_grow(l->arena, GroupPair, l->group_pairs, old, room);
        l->old_group_pairs = arena_grow(l->arena, GroupPair, l->old_group_pairs, old, room);
        grow_paths(&l->paths, old, room, l->arena);
        grow_paths(&l->old_paths, old, room, l->arena);
        l->renumber = arena_grow(l->arena, int, l->renumber, old, room);
        l->searched = arena_push(l->arena, int, room);
        l->apart = arena_push(l->arena, double, room);
        l->group_pair_room = room;
    }
    set_path(&l->paths, l->group_pair_count, ends);
    l->group_pairs[l->group_pair_count++] = (GroupPair){0};
}

typedef struct NearJob {
    Lists *lists;
    const BoxTreePart *parts;
} NearJob;

typedef struct NearBody {
    const Lists *lists;
    NearGroups *near;
} NearBody;

static void note_near(int a, int b, void *context) {
    const NearBody *body = context;
    NearGroups *near = body->near;
    if (may_meet(body->lists, a, b)) {
        if (near->count < near->room) {
            near->ends[near->count] = (PathEnds){a, b};
        }
        near->count++;
    }
}

static void near_chunk(int chunk, int first, int end, void *context) {
    const NearJob *job = context;
    Lists *l = job->lists;
    NearBody body = {l, &l->near[chunk]};
    body.near->count = 0;
    for (int k = first; k < end; k++) {
        box_tree_part_pairs(&l->tree, job->parts[k], l->reach, note_near, &body);
    }
}

/* groups that may meet others: found in parts of the tree, listed in their order */
static void add_near_groups(Lists *l) {
    BoxTreePart parts[BOX_TREE_PARTS];
    int count = box_tree_parts(&l->tree, l->reach, parts);
    NearJob job = {l, parts};
    parallel_for(count, NEAR_GRAIN, near_chunk, &job);
    for (int k = 0; k < parallel_chunk_count(count, NEAR_GRAIN); k++) {
        NearGroups *near = &l->near[k];
        if (near->count > near->room) { /* again, with room */
            near->room = 2 * near->count;
            near->ends = arena_push(l->arena, PathEnds, near->room);
            int first = k * NEAR_GRAIN, end = first + NEAR_GRAIN;
            near_chunk(k, first, end < count ? end : count, &job);
        }
        for (int m = 0; m < near->count; m++) {
            add_group_pair(l, near->ends[m]);
        }
    }
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
        uint64_t at = pair_hash(l->old_paths.ends[i].a, l->old_paths.ends[i].b);
        while (l->slots[at & ((uint64_t)l->slot_count - 1)]) {
            at++;
        }
        l->slots[at & ((uint64_t)l->slot_count - 1)] = i + 1;
    }
}

static int find_old(const Lists *l, int a, int b) {
    for (uint64_t at = pair_hash(a, b);; at++) {
        int i = l->slots[at & ((uint64_t)l->slot_count - 1)] - 1;
        if (i < 0 || (l->old_paths.ends[i].a == a && l->old_paths.ends[i].b == b)) {
            return i;
        }
    }
}

void lists_remake(Lists *l, const Points *x, double least_reach) {
    int groups = l->surface->group_count, old_count = l->group_pair_count;
    GroupPair *old = l->group_pairs;
    PathRows old_paths = l->paths;
    l->group_pairs = l->old_group_pairs, l->old_group_pairs = old;
    l->paths = l->old_paths, l->old_paths = old_paths;
    l->group_pair_count = 0;
    double size = 0.0;
    int cloth_groups = 0;
    search_bound_all(l, x);
    for (int g = 0; g < groups; g++) {
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
        if (may_meet(l, g, g)) {
            add_group_pair(l, (PathEnds){g, g});
        }
    }
    add_near_groups(l);
    index_old(l, old_count);
    memset(l->renumber, -1, (size_t)l->group_pair_room * sizeof *l->renumber);
    for (int i = 0; i < l->group_pair_count; i++) {
        PathEnds ends = l->paths.ends[i];
        int before = old_count > 0 ? find_old(l, ends.a, ends.b) : -1;
        if (before >= 0) {
            l->group_pairs[i] = l->old_group_pairs[before];
            take_path(&l->paths, i, &l->old_paths, before);
            l->renumber[before] = i;
            l->widest = max2(l->widest, l->paths.near[i]);
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

static void make_pair_room(Lists *l, int more) {
    if (l->pair_end + more > l->pair_room) {
        int room = 2 * l->pair_room + more + 1024;
        l->pairs = arena_grow(l->arena, Pair, l->pairs, l->pair_end, room);
        l->due = arena_grow(l->arena, double, l->due, l->pair_end, room);
        l->pair_room = room;
    }
}

/* what was found, behind what there is; group pairs learn where theirs begin */
static void take_found(Lists *l, int chunks, int searched) {
    int end = l->pair_end;
    for (int k = 0; k < chunks; k++) {
        const Found *found = &l->found[k];
        size_t count = (size_t)found->count;
        make_pair_room(l, found->count);
        if (count > 0) {
            memcpy(l->pairs + l->pair_end, found->pairs, count * sizeof *l->pairs);
            memcpy(l->due + l->pair_end, found->due, count * sizeof *l->due);
        }
        l->pair_end += found->count;
    }
    for (int k = 0; k < searched; k++) {
        GroupPair *pair = &l->group_pairs[l->searched[k]];
        l->widest = max2(l->widest, l->paths.near[l->searched[k]]);
        pair->begin = end;
        end += pair->count;
        l->pair_count += pair->count;
    }
}

void lists_query(Lists *l, const Points *x, const int *wanted, int count, double dt) {
    for (int k = 0; k < count; k++) {
        l->searched[k] = wanted[k];
        l->paths.earliest[wanted[k]] = INFINITY;
        if (l->group_pairs[wanted[k]].count > 0) {
            drop_block(l, &l->group_pairs[wanted[k]]);
        }
    }
    take_found(l, search_pairs(l, x, count, dt), count);
    if (l->pair_end > 2 * l->pair_count + LEAST_HOLES) {
        pack_blocks(l);
    }
    kept_empty(l);
}
