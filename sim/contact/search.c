/* search.c: level 2 of the lists (lists.h): the pairs of features of group pairs. Each group pair is
 * searched by itself, so that threads share the work; what they find is put together in order. */
#include "sim/contact/search.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/contact/constants.h"
#include "sim/contact/pair_batch.h"

#define TRIM_BINS 32      /* of distance, to choose a slack */
#define SAFE_FAR 1.0001   /* more than rounding does to a squared distance */
#define LEAST_SINE2 1e-12 /* of two edges: below, their common normal is noise */
/* what a thread takes at once, some 10 us: group pairs to be searched, groups to be bounded */
#define SEARCH_GRAIN 4
#define BOUND_GRAIN 16

typedef struct Search {
    const Lists *lists;
    Found *found;
    const Points *x;
    PairBatch *batch;
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

static void add_pair(const Search *s, PairKind kind, int a, int b, int c, int d) {
    Found *found = s->found;
    int place[4] = {a, b, c, d};
    if (planes_far(s, kind, place)) {
        return;
    }
    if (found->count == found->room) {
        found->full = true;
        return;
    }
    Pair *pair = &found->pairs[found->count++];
    *pair = (Pair){.kind = kind, .place = {a, b, c, d}, .dhat = s->dhat};
    pair_batch_add(s->batch, s->x, pair);
}

/* of those from `first` on, when all are evaluated */
static void keep_within_reach(const Search *s, int first) {
    Found *found = s->found;
    int kept = first;
    for (int p = first; p < found->count; p++) {
        Pair *pair = &found->pairs[p];
        if (pair->distance > s->reach) {
            continue;
        }
        if (s->scattered) {
            pair->dhat = pair_rest_limit(s->scattered, pair, s->dhat);
        }
        if (pair->distance < pair->dhat) { /* whatever does not push lets go */
            lists_recall(s->lists, pair);
        }
        found->due[kept] = s->path + pair->distance - s->near;
        found->pairs[kept++] = *pair;
    }
    found->count = kept;
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
        if (!box_near(&point, around, s->reach)) {
            continue;
        }
        for (int t = 0; t < b->triangle_count; t++) {
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

static void search_pair(const Search *s, int first, int second) {
    const Lists *l = s->lists;
    const SurfaceGroup *a = &l->surface->groups[first], *b = &l->surface->groups[second];
    const GroupBounds *in_a = &l->bounds[first], *in_b = &l->bounds[second];
    CellBoxes boxes_a[SURFACE_GROUP_CELLS], boxes_b[SURFACE_GROUP_CELLS];
    for (int k = 0; k < SURFACE_GROUP_CELLS; k++) {
        boxes_a[k].known = boxes_b[k].known = false;
    }
    for (int i = a->cell_begin; i < a->cell_end; i++) {
        const Box *box = &in_a->cell[i - a->cell_begin];
        if (!box_near(box, &in_b->all, s->reach)) {
            continue;
        }
        for (int j = first == second ? i : b->cell_begin; j < b->cell_end; j++) {
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
static double trim_pairs(Found *found, int first, double near, double slack, double longest) {
    if (found->count - first <= CONTACT_FEW_PAIRS || longest <= slack) {
        return longest;
    }
    int bins[TRIM_BINS] = {0}, most = 0;
    double width = longest / TRIM_BINS;
    for (int p = first; p < found->count; p++) {
        int bin = (int)((found->pairs[p].distance - near) / width);
        bins[bin < 0 ? 0 : bin >= TRIM_BINS ? TRIM_BINS - 1 : bin]++;
    }
    for (int sum = bins[0]; most + 1 < TRIM_BINS && sum <= CONTACT_FEW_PAIRS;) {
        sum += bins[++most];
    }
    slack = max2(slack, most * width);
    int kept = first;
    for (int p = first; p < found->count; p++) {
        if (found->pairs[p].distance <= near + slack) {
            found->pairs[kept] = found->pairs[p];
            found->due[kept++] = found->due[p];
        }
    }
    found->count = kept;
    return slack;
}

/* ---- group pairs ---- */

typedef struct SearchJob {
    Lists *lists;
    const Points *x;
    double dt;
} SearchJob;

static const SurfacePanel *panel_of(const Lists *l, int g) {
    return &l->surface->panels[l->surface->groups[g].panel];
}

static double dhat_of(const Lists *l, PathEnds ends) {
    return 0.5 * (panel_of(l, ends.a)->distance + panel_of(l, ends.b)->distance);
}

/* [m] beyond it a group pair needs no pairs */
static double enough(const Lists *l, int i) {
    return l->paths.near[i] + CONTACT_LEAST_SLACK * dhat_of(l, l->paths.ends[i]);
}

/* how near, and how flat: a bound of the distance into l->apart; slopes are known */
static void judge_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const SearchJob *job = context;
    Lists *l = job->lists;
    for (int k = first; k < end; k++) {
        int i = l->searched[k];
        PathEnds ends = l->paths.ends[i];
        l->paths.near[i] = max2(dhat_of(l, ends), CONTACT_NEAR_STEPS * l->paths.speed[i] * job->dt);
        l->apart[k] = flatness_distance(&l->flatness, l->surface, ends.a, ends.b);
    }
}

static void search_one(const SearchJob *job, int k, Found *found, PairBatch *batch) {
    Lists *l = job->lists;
    int i = l->searched[k], a = l->paths.ends[i].a, b = l->paths.ends[i].b;
    GroupPair *pair = &l->group_pairs[i];
    const SurfacePanel *of_a = panel_of(l, a), *of_b = panel_of(l, b);
    double path = l->paths.path[i], near = l->paths.near[i];
    double dhat = dhat_of(l, l->paths.ends[i]), step = l->paths.speed[i] * job->dt;
    double most = max2(CONTACT_LEAST_SLACK * dhat, CONTACT_LONG_SLACK * of_a->h1);
    double slack = min2(most, max2(CONTACT_LEAST_SLACK * dhat, CONTACT_SLACK_STEPS * step));
    double apart = l->apart[k];
    if (apart <= enough(l, i) && a != b) {
        apart = box_distance(&l->bounds[a].all, &l->bounds[b].all);
    }
    if (apart > enough(l, i)) {
        l->paths.limit[i] = path + apart - near;
        return;
    }
    double longest = pair->dense ? slack : max2(slack, min2(most, CONTACT_LONG_SLACK_STEPS * step));
    Search search = {.lists = l,
                     .found = found,
                     .x = job->x,
                     .batch = batch,
                     .path = path,
                     .reach = near + longest,
                     .near = near,
                     .dhat = dhat,
                     .scattered = of_a == of_b && of_a->nu == 0 ? of_a : NULL};
    int first = found->count;
    search_pair(&search, a, b);
    pair_batch_end(batch);
    if (found->full) {
        return;
    }
    keep_within_reach(&search, first);
    pair->dense = found->count - first > CONTACT_FEW_PAIRS;
    l->paths.limit[i] = path + trim_pairs(found, first, near, slack, longest);
    pair->count = found->count - first;
    pair->evaluated = l->stamp;
    double earliest = INFINITY;
    for (int p = first; p < found->count; p++) {
        earliest = min2(earliest, found->due[p]);
    }
    l->paths.earliest[i] = earliest;
}

static void search_chunk(int chunk, int first, int end, void *context) {
    const SearchJob *job = context;
    Found *found = &job->lists->found[chunk];
    PairBatch batch;
    pair_batch_begin(&batch, job->lists->width);
    found->count = 0;
    found->full = false;
    for (int k = first; k < end && !found->full; k++) {
        search_one(job, k, found, &batch);
    }
}

/* ---- bounds of groups, each found once for the positions of now ---- */

static void bound_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const SearchJob *job = context;
    Lists *l = job->lists;
    for (int k = first; k < end; k++) {
        const SurfaceGroup *group = &l->surface->groups[l->marked[k]];
        GroupBounds *bounds = &l->bounds[l->marked[k]];
        bounds->all = box_empty();
        for (int i = group->cell_begin; i < group->cell_end; i++) {
            const SurfaceCell *cell = &l->surface->cells[i];
            Box box = box_of(job->x, cell->corner, cell->corner_count);
            bounds->cell[i - group->cell_begin] = box;
            bounds->all = box_union(bounds->all, box);
        }
    }
}

/* in rising order: what lies near in the cloth is found by the thread that has met it before */
static int list_marked(Lists *l) {
    int count = 0;
    for (int first = 0; first < l->surface->group_count; first += 8) {
        uint64_t some;
        memcpy(&some, l->is_marked + first, 8);
        for (int g = first; some != 0 && g < first + 8; g++) {
            l->marked[count] = g;
            count += l->is_marked[g];
            l->is_marked[g] = 0;
        }
    }
    return count;
}

static void mark_bounds(Lists *l, int g) {
    if (l->boxed[g] != l->stamp && !(l->boxed[g] > 0 && panel_of(l, g)->still)) {
        l->boxed[g] = l->stamp;
        l->is_marked[g] = 1;
    }
}

static void bound_marked(SearchJob *job) {
    parallel_for(list_marked(job->lists), BOUND_GRAIN, bound_chunk, job);
}

void search_bound_all(Lists *l, const Points *x) {
    SearchJob job = {.lists = l, .x = x};
    for (int g = 0; g < l->surface->group_count; g++) {
        mark_bounds(l, g);
    }
    bound_marked(&job);
}

static void slope_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const SearchJob *job = context;
    Lists *l = job->lists;
    flatness_fit(&l->flatness, l->surface, job->x, l->marked + first, end - first);
}

static void find_slopes(SearchJob *job, int searched) {
    Lists *l = job->lists;
    for (int k = 0; k < searched; k++) {
        PathEnds ends = l->paths.ends[l->searched[k]];
        int group[4], groups = flatness_groups(l->surface, ends.a, ends.b, group);
        for (int m = 0; m < groups; m++) {
            if (l->sloped[group[m]] != l->stamp) {
                l->sloped[group[m]] = l->stamp;
                l->is_marked[group[m]] = 1;
            }
        }
    }
    parallel_for(list_marked(l), BOUND_GRAIN, slope_chunk, job);
}

static void find_bounds(SearchJob *job, int searched) {
    Lists *l = job->lists;
    for (int k = 0; k < searched; k++) {
        if (l->apart[k] <= enough(l, l->searched[k])) {
            mark_bounds(l, l->paths.ends[l->searched[k]].a);
            mark_bounds(l, l->paths.ends[l->searched[k]].b);
        }
    }
    bound_marked(job);
}

static void make_room(Lists *l, Found *found) {
    found->room = 2 * found->room + 1024;
    found->pairs = arena_push(l->arena, Pair, found->room);
    found->due = arena_push(l->arena, double, found->room);
}

int search_pairs(Lists *l, const Points *x, int searched, double dt) {
    SearchJob job = {l, x, dt};
    int share = (searched + SEARCH_CHUNKS - 1) / SEARCH_CHUNKS;
    int grain = share > SEARCH_GRAIN ? share : SEARCH_GRAIN;
    find_slopes(&job, searched);
    parallel_for(searched, BOUND_GRAIN, judge_chunk, &job);
    find_bounds(&job, searched);
    parallel_for(searched, grain, search_chunk, &job);
    int chunks = parallel_chunk_count(searched, grain);
    for (int k = 0; k < chunks; k++) {
        while (l->found[k].full) {
            make_room(l, &l->found[k]);
            int first = k * grain, end = first + grain;
            search_chunk(k, first, end < searched ? end : searched, &job);
        }
    }
    return chunks;
}
