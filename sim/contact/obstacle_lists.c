/* obstacle_lists.c: which vertices and triangles of the cloth are near convex solids on the explicit
 * road: groups with paths, as for pairs (contact.md, Lists). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/contact/engine.h"

/* what a thread takes at once, some 10 us: groups to be asked, groups to be looked at */
#define OWNER_GRAIN 200
#define LOOK_GRAIN 8

static void touch_key(const Touch *touch, int key[4]) {
    memcpy(key, touch->place, 3 * sizeof *key);
    key[3] = touch->obstacle;
}

static void side_key(const Contact *c, int side, int key[4]) {
    memcpy(key, contact_side_places(c, side), 2 * sizeof *key);
    key[2] = -1;
    key[3] = side % c->def->obstacle_count;
}

/* ---- blocks of touches ---- */

static void make_touch_room(Contact *c, int room) {
    c->touches.list = arena_grow(c->arena, Touch, c->touches.list, c->touches.end, room);
    c->touches.due = arena_grow(c->arena, double, c->touches.due, c->touches.end, room);
    c->look.touches = arena_push(c->arena, int, room); /* a look follows */
    c->touches.looked = arena_push(c->arena, int, room);
    c->touches.near = arena_push(c->arena, int, room);
    resting_make_room(&c->resting, c->touches.end, room, c->arena);
    c->touches.room = room;
}

/* of a group, for all of its vertices and triangles; it stays through the interval */
static void reserve_block(Contact *c, GroupTouch *group, const SurfaceGroup *cells, bool plane) {
    if (group->room > 0) {
        return;
    }
    for (int k = cells->cell_begin; k < cells->cell_end; k++) {
        const SurfaceCell *cell = &c->surface.cells[k];
        group->room += cell->vertex_count + (plane ? 0 : cell->triangle_count);
    }
    if (c->touches.end + group->room > c->touches.room) {
        make_touch_room(c, 2 * (c->touches.room + group->room) + 1024);
    }
    group->begin = c->touches.end;
    c->touches.end += group->room;
}

static double group_distance(const Contact *c, int g) {
    return c->surface.panels[c->surface.groups[g].panel].distance;
}

/* lower bound of the distance of a group */
static double group_apart(const Contact *c, const Points *x, int g, int o) {
    const SurfaceGroup *group = &c->surface.groups[g];
    Box box = box_empty();
    for (int k = group->vertex_begin; k < group->vertex_end; k++) {
        box_add(&box, point_at(x, c->surface.group_vertices[k]));
    }
    Vec3 normal, centre = vec3_scale(0.5, vec3_add(box.low, box.high));
    double radius = 0.5 * vec3_length(vec3_sub(box.high, box.low));
    Vec3 p = pose_unapply(c->poses[o], centre);
    return solid_distance(&c->def->obstacles[o].solid, p, &normal) - radius;
}

/* Lists all that a group has, unless it is far away, and leaves it to the look that follows. */
static void query_group(Contact *c, const Points *x, int owner, double dt) {
    int g = owner / c->def->obstacle_count, o = owner % c->def->obstacle_count;
    GroupTouch *group = &c->touches.groups[owner];
    double dhat = group_distance(c, g), step = group->speed * dt;
    double slack = max2(CONTACT_LEAST_SLACK * dhat, CONTACT_LONG_SLACK_STEPS * step);
    group->near = max2(dhat, CONTACT_NEAR_STEPS * step);
    c->resting.groups[owner].until = -1.0;
    if (c->def->obstacles[o].mesh) { /* its features are in the lists of pairs */
        group->near = group->limit = INFINITY;
        return;
    }
    double apart = group_apart(c, x, g, o);
    bool far = apart > group->near + slack;
    group->limit = group->path + (far ? apart - group->near : slack);
    group->reach = group->near + slack;
    group->fresh = !far;
    group->earliest = -INFINITY;
    group->dhat =
        c->def->vertex_distance[c->surface.group_vertices[c->surface.groups[g].vertex_begin]];
    if (far) {
        c->touches.count -= group->count;
        group->count = group->listed = 0;
        return;
    }
    reserve_block(c, group, &c->surface.groups[g], c->def->obstacles[o].solid.kind == SOLID_PLANE);
    c->touches.count += group->room - group->count;
    group->listed = group->room;
}

bool obstacle_search(Contact *c, double dt) {
    bool searched = false;
    Points x = contact_positions(c);
    for (int i = 0; i < contact_owners(c); i++) {
        const GroupTouch *group = &c->touches.groups[i];
        if (CONTACT_LEAST_NEAR_STEPS * group->speed * dt > group->near) {
            query_group(c, &x, i, dt);
            searched = true;
        }
    }
    c->statistics.rebuilds += searched;
    return searched;
}

void obstacle_forget_sides(const Contact *c, Touch *touch, unsigned sides) {
    for (int k = 0; k < 3; k++) {
        if (sides & 1U << k) {
            c->bristles.sides[contact_side(c, touch, k)] = vec3(0, 0, 0);
        }
    }
    touch->sides &= ~sides;
}

void obstacle_forget(const Contact *c, Touch *touch) {
    touch->bristle = vec3(0, 0, 0);
    if (touch->place[1] < 0) {
        memset(contact_vertex_bristle(c, touch->place[0], touch->obstacle), 0, 3 * sizeof(double));
    } else {
        obstacle_forget_sides(c, touch, touch->sides);
    }
}

/* ---- what a search lists ---- */

static int compare_keys(const void *a, const void *b) {
    return memcmp(((const PairMemory *)a)->place, ((const PairMemory *)b)->place,
                  sizeof((const PairMemory *)a)->place);
}

/* Takes over a bristle of the last interval; false: there is none. */
static bool restore(const Contact *c, const PairMemory *key, Vec3 *bristle) {
    const PairMemory *memory = bsearch(key, c->bristles.memory, (size_t)c->bristles.memory_count,
                                       sizeof *c->bristles.memory, compare_keys);
    *bristle = memory ? vec3_load(memory->bristle) : *bristle;
    return memory;
}

static void restore_bristles(const Contact *c, Touch *touch) {
    PairMemory key = {0};
    touch_key(touch, key.place);
    restore(c, &key, &touch->bristle);
    for (int k = 0; k < 3 && touch->place[1] >= 0; k++) {
        int side = contact_side(c, touch, k);
        if (side >= 0) {
            side_key(c, side, key.place);
            touch->sides |= restore(c, &key, &c->bristles.sides[side]) ? 1U << k : 0U;
        }
    }
}

/* Where the last touch that is not listed yet will stand, and the last of the old list that did not move
 * up: that list is in the order of the cells too. */
typedef struct Expansion {
    int at, old;
} Expansion;

static void list_touch(Contact *c, const GroupTouch *group, const Touch *wanted, Expansion *e) {
    Touch *touch = &c->touches.list[e->at], *old = &c->touches.list[e->old];
    if (e->old >= group->begin && memcmp(old->place, wanted->place, sizeof old->place) == 0) {
        if (old != touch) {
            *touch = *old;
        }
        touch->frozen = -1.0;
        e->old--;
    } else {
        *touch = *wanted;
        if (c->bristles.memory_count > 0) {
            restore_bristles(c, touch);
        }
    }
    c->touches.due[e->at--] = -INFINITY;
}

static void list_group(Contact *c, int owner) {
    int g = owner / c->def->obstacle_count, o = owner % c->def->obstacle_count;
    GroupTouch *group = &c->touches.groups[owner];
    bool plane = c->def->obstacles[o].solid.kind == SOLID_PLANE;
    Touch vertex = {.obstacle = o,
                    .owner = owner,
                    .frozen = -1.0,
                    .place = {-1, -1, -1},
                    .weight = {1.0},
                    .feature = 1};
    Touch triangle = {.obstacle = o, .owner = owner, .frozen = -1.0};
    Expansion e = {group->begin + group->room - 1, group->begin + group->count - 1};
    for (int n = c->surface.groups[g].cell_end - 1; n >= c->surface.groups[g].cell_begin; n--) {
        const SurfaceCell *cell = &c->surface.cells[n];
        for (int k = cell->triangle_count - 1; k >= 0 && !plane; k--) {
            triangle.triangle = cell->triangle[k];
            memcpy(triangle.place, c->surface.triangles + 3 * (size_t)cell->triangle[k],
                   sizeof triangle.place);
            list_touch(c, group, &triangle, &e);
        }
        for (int k = cell->vertex_count - 1; k >= 0; k--) {
            vertex.place[0] = cell->vertex[k];
            list_touch(c, group, &vertex, &e);
        }
    }
    ASSERT(e.at == group->begin - 1 && e.old == e.at);
    group->count = group->room;
}

/* ---- looking ---- */

/* What a look is for: only what a search listed is looked at, and is due again; touches that are near; those
 * that push too, and the others let go. */
typedef enum LookAim { LOOK_LISTS, LOOK_NEAR, LOOK_PUSHING } LookAim;

/* The looks of a step, group by group: what each finds stands from its first touch on. */
typedef struct LookJob {
    Contact *c;
    Points x;
    LookAim aim;
} LookJob;

/* One touch, which was due and is evaluated: until when it need not be again; into those that are near,
 * when it is. */
static inline void note_touch(const LookJob *job, GroupTouch *group, int t) {
    Contact *c = job->c;
    Touch *touch = &c->touches.list[t];
    double path = group->path, due = path + touch->distance - group->near;
    if (group->fresh && (job->aim == LOOK_LISTS || touch->distance > group->near)) {
        touch->frozen = -1.0;
    } else if (touch->spare) {
        due = max2(due, path + touch->margin);
    } else if (touch->distance <= group->near) {
        c->touches.near[group->begin + group->near_count++] = t;
        group->gap = min2(group->gap, touch->distance);
    } else {
        obstacle_forget(c, touch);
    }
    c->touches.due[t] = due;
    group->earliest = min2(group->earliest, due);
}

static inline void look_at_vertex(const LookJob *job, GroupTouch *group, int t) {
    Contact *c = job->c;
    Touch *touch = &c->touches.list[t];
    if (group->path <= touch->frozen) {
        obstacle_project(&job->x, touch);
    } else {
        obstacle_evaluate_vertex(c, &job->x, touch);
        touch->frozen = group->path + obstacle_frozen(c, touch);
    }
    note_touch(job, group, t);
}

/* The groups that have something to be looked at, and those that spent their path: when these are searched
 * they have too. */
static void ask_groups(Contact *c, int chunk, int first, int end) {
    int due = 0, spent = 0;
    for (int i = first; i < end; i++) {
        const GroupTouch *group = &c->touches.groups[i];
        bool listed = group->count > 0 || group->fresh, gone = group->path > group->limit;
        if (gone) {
            c->look.spent[first + spent++] = i;
        }
        if (gone || (listed && group->path >= group->earliest)) {
            c->look.groups[first + due++] = i;
        }
    }
    c->look.counts[chunk] = due;
    c->look.spent_counts[chunk] = spent;
}

static void due_chunk(int chunk, int first, int end, void *context) {
    ask_groups(context, chunk, first, end);
}

static void advance_chunk(int chunk, int first, int end, void *context) {
    Contact *c = context;
    for (int i = first; i < end; i++) {
        c->touches.groups[i].path += c->touches.groups[i].speed * c->step;
    }
    ask_groups(c, chunk, first, end);
}

ParallelLoop obstacle_advance_loop(Contact *c) {
    c->look.asked = true;
    return (ParallelLoop){contact_owners(c), OWNER_GRAIN, advance_chunk, c};
}

/* vertices are looked at first, so that triangles find the distances of their corners */
static void vertex_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const LookJob *job = context;
    Contact *c = job->c;
    for (int k = first; k < end; k++) {
        int owner = c->look.groups[k];
        GroupTouch *group = &c->touches.groups[owner];
        bool rests = resting_holds(&c->resting, owner) && resting_look(c, &job->x, owner);
        group->looked = group->near_count = 0;
        if (group->fresh) {
            list_group(c, owner);
        }
        if (rests) {
            continue;
        }
        group->earliest = group->gap = INFINITY;
        for (int t = group->begin; t < group->begin + group->count; t++) {
            if (group->path < c->touches.due[t]) {
                group->earliest = min2(group->earliest, c->touches.due[t]);
            } else if (c->touches.list[t].place[1] < 0) {
                look_at_vertex(job, group, t);
            } else {
                c->touches.looked[group->begin + group->looked++] = t;
            }
        }
    }
}

/* What is not within the reach of a group that was searched is dropped. */
static void close_up(Contact *c, GroupTouch *group) {
    int begin = group->begin, *renumbered = c->touches.looked, end = begin;
    for (int t = begin; t < begin + group->count; t++) {
        Touch *touch = &c->touches.list[t];
        if (touch->distance > group->reach) {
            obstacle_forget(c, touch);
            continue;
        }
        renumbered[t] = end;
        if (end < t) {
            c->touches.list[end] = *touch;
            c->touches.due[end] = c->touches.due[t];
        }
        end++;
    }
    group->count = end - begin;
    group->fresh = false;
    for (int m = begin; m < begin + group->near_count; m++) {
        c->touches.near[m] = renumbered[c->touches.near[m]];
    }
}

/* those of a group that push, and triangles with sides that may: -1 - touch */
static void list_pushing(Contact *c, GroupTouch *group) {
    for (int m = group->begin; m < group->begin + group->near_count; m++) {
        int t = c->touches.near[m];
        Touch *touch = &c->touches.list[t];
        bool pushes = obstacle_pushes(c, touch), vertex = touch->place[1] < 0;
        if (!pushes && vertex) {
            obstacle_forget(c, touch);
        } else if (!pushes) {
            touch->bristle = vec3(0, 0, 0);
        }
        bool sides = !vertex && touch->sides;
        if (pushes || sides) {
            c->touches.looked[group->begin + group->pushing++] = sides ? -1 - t : t;
        }
    }
}

static void sum_group(const Contact *c, int owner, LookSum *sum) {
    GroupTouch *group = &c->touches.groups[owner];
    sum->listed += group->count - group->listed;
    sum->near += group->near_count;
    sum->resting += resting_count(&c->resting, owner);
    sum->gap = min2(sum->gap, group->gap);
    sum->room = group->count > 0 ? min2(sum->room, group->gap / group->dhat) : sum->room;
    group->listed = group->count;
}

/* the triangles of some groups, those at boxes together */
static void evaluate_triangles(const LookJob *job, int first, int end) {
    Contact *c = job->c;
    Corners corners;
    TouchBatch batch;
    corners_clear(&corners);
    box_batch_begin(&batch.boxes, c->lists.width);
    for (int k = first; k < end; k++) {
        const GroupTouch *group = &c->touches.groups[c->look.groups[k]];
        for (int m = group->begin; m < group->begin + group->looked; m++) {
            obstacle_evaluate_triangle(c, &job->x, &corners, &batch,
                                       &c->touches.list[c->touches.looked[m]]);
        }
    }
    obstacle_finish(c, &batch);
}

static void triangle_chunk(int chunk, int first, int end, void *context) {
    const LookJob *job = context;
    Contact *c = job->c;
    evaluate_triangles(job, first, end);
    LookSum sum = {.gap = INFINITY, .room = INFINITY};
    for (int k = first; k < end; k++) {
        int owner = c->look.groups[k];
        GroupTouch *group = &c->touches.groups[owner];
        for (int m = 0; m < group->looked; m++) {
            note_touch(job, group, c->touches.looked[group->begin + m]);
        }
        if (group->fresh) {
            close_up(c, group);
        }
        if (job->aim != LOOK_LISTS && !resting_holds(&c->resting, owner)) {
            resting_settle(c, owner);
        }
        group->pushing = 0;
        if (job->aim == LOOK_PUSHING && !resting_holds(&c->resting, owner)) {
            list_pushing(c, group);
        }
        sum_group(c, owner, &sum);
    }
    c->look.sums[chunk] = sum;
}

/* the groups that spent their path; a look follows */
static void search_spent(Contact *c, double dt) {
    int owners = contact_owners(c);
    Points x = contact_positions(c);
    if (!c->look.asked) {
        parallel_for(owners, OWNER_GRAIN, due_chunk, c);
        c->look.asked = true;
    }
    int count = parallel_close_up(c->look.spent, c->look.spent_counts, owners, OWNER_GRAIN);
    for (int k = 0; k < count; k++) {
        query_group(c, &x, c->look.spent[k], dt);
    }
    c->statistics.rebuilds += count > 0;
}

/* at all groups that are due; returns what was found */
static LookSum look(Contact *c, LookAim aim) {
    LookJob job = {c, contact_positions(c), aim};
    int owners = contact_owners(c);
    if (!c->look.asked) {
        parallel_for(owners, OWNER_GRAIN, due_chunk, c);
    }
    c->look.asked = false;
    c->look.group_count = parallel_close_up(c->look.groups, c->look.counts, owners, OWNER_GRAIN);
    parallel_for(c->look.group_count, LOOK_GRAIN, vertex_chunk, &job);
    parallel_for(c->look.group_count, LOOK_GRAIN, triangle_chunk, &job);
    LookSum sum = {.gap = INFINITY, .room = INFINITY};
    for (int k = 0; k < parallel_chunk_count(c->look.group_count, LOOK_GRAIN); k++) {
        sum.listed += c->look.sums[k].listed;
        sum.near += c->look.sums[k].near;
        sum.resting += c->look.sums[k].resting;
        sum.gap = min2(sum.gap, c->look.sums[k].gap);
        sum.room = min2(sum.room, c->look.sums[k].room);
    }
    c->touches.count += sum.listed;
    return sum;
}

void obstacle_begin(Contact *c, double dt) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        obstacle_place(c, o);
    }
    c->touches.count = c->touches.end = c->look.touch_count = c->look.group_count = 0;
    memset(c->touches.groups, 0, (size_t)contact_owners(c) * sizeof *c->touches.groups);
    resting_clear(&c->resting, contact_owners(c));
    for (int g = 0; g < contact_cloth_groups(c); g++) {
        for (int o = 0; o < c->def->obstacle_count; o++) {
            GroupTouch *group = &c->touches.groups[g * c->def->obstacle_count + o];
            group->speed = c->groups.motion[g].fastest;
            group->limit = -1.0;
        }
    }
    if (c->bristles.memory_count > 1) {
        qsort(c->bristles.memory, (size_t)c->bristles.memory_count, sizeof *c->bristles.memory,
              compare_keys);
    }
    c->look.asked = false;
    search_spent(c, dt);
    look(c, LOOK_LISTS);
    c->bristles.memory_count = c->look.group_count = 0;
}

static void list_due(Contact *c) {
    c->look.touch_count = 0;
    for (int k = 0; k < c->look.group_count; k++) {
        const GroupTouch *group = &c->touches.groups[c->look.groups[k]];
        for (int m = 0; m < group->near_count; m++) {
            c->look.touches[c->look.touch_count++] = c->touches.near[group->begin + m];
        }
    }
}

static LookSum look_near(Contact *c, LookAim aim) {
    LookSum sum = look(c, aim);
    if (c->impulses || c->programmes.some) {
        list_due(c);
    }
    c->look.touch_count = sum.near;
    c->statistics.evaluations += sum.resting + sum.near;
    c->statistics.pairs += c->touches.count;
    return sum;
}

void obstacle_look(Contact *c) {
    look_near(c, LOOK_NEAR);
    c->groups.narrow = true;
}

void obstacle_find(Contact *c, double dt) {
    search_spent(c, dt);
    LookSum sum = look_near(c, c->impulses ? LOOK_NEAR : LOOK_PUSHING);
    c->statistics.smallest_gap = min2(c->statistics.smallest_gap, sum.gap);
    c->at_solids.room = min2(c->at_solids.room, sum.room);
}

typedef struct Remembered {
    PairMemory *memory;
    int count, room;
} Remembered;

/* the next one has its key already */
static void remember(Remembered *r, Vec3 bristle) {
    if (r->count < r->room && vec3_dot(bristle, bristle) > 0.0) {
        vec3_store(r->memory[r->count++].bristle, bristle);
    }
}

static void remember_triangle(const Contact *c, const Touch *touch, Remembered *r) {
    if (r->count < r->room) {
        touch_key(touch, r->memory[r->count].place);
        remember(r, touch->bristle);
    }
    for (int k = 0; k < 3 && r->count < r->room; k++) {
        if (touch->sides & 1U << k) {
            int side = contact_side(c, touch, k);
            side_key(c, side, r->memory[r->count].place);
            remember(r, c->bristles.sides[side]);
        }
    }
}

int obstacle_remember(const Contact *c, PairMemory *memory, int room) {
    Remembered r = {memory, 0, room};
    for (int i = 0; i < contact_owners(c); i++) {
        const GroupTouch *group = &c->touches.groups[i];
        for (int t = group->begin; t < group->begin + group->count; t++) {
            if (c->touches.list[t].place[1] >= 0) {
                remember_triangle(c, &c->touches.list[t], &r);
            }
        }
    }
    return r.count;
}
