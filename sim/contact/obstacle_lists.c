/* obstacle_lists.c: which vertices and triangles of the cloth are near convex solids on the explicit
 * road (explicit.md 5, 10.1): groups with paths, as for pairs. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/contact/engine.h"

/* what a thread takes at once, some 10 us: groups to be asked, groups to be looked at */
#define OWNER_GRAIN 500
#define LOOK_GRAIN 32
#define LEAST_HOLES 1024 /* touches; fewer are not worth closing */

static void touch_key(const Touch *touch, int key[4]) {
    memcpy(key, touch->place, 3 * sizeof *key);
    key[3] = touch->obstacle;
}

/* ---- blocks of touches ---- */

static void make_touch_room(Contact *c, int room) {
    c->touches = arena_grow(c->arena, Touch, c->touches, c->touch_end, room);
    c->touch_due = arena_grow(c->arena, double, c->touch_due, c->touch_end, room);
    c->old_touches = arena_push(c->arena, Touch, room);
    c->old_touch_due = arena_push(c->arena, double, room);
    c->due_touches = arena_push(c->arena, int, room); /* a look follows */
    c->looked = arena_push(c->arena, int, room);
    c->near_touches = arena_push(c->arena, int, room);
    resting_make_room(&c->resting, c->touch_end, room, c->arena);
    c->touch_room = room;
}

/* behind the others of the group that is searched now */
static void add_touch(Contact *c, const Touch *touch, double due) {
    if (c->touch_end == c->touch_room) {
        make_touch_room(c, 2 * c->touch_room + 1024);
    }
    c->touches[c->touch_end] = *touch;
    c->touch_due[c->touch_end++] = due;
}

/* leaves a hole behind */
static void drop_block(Contact *c, GroupTouch *group) {
    for (int t = group->begin; t < group->begin + group->count; t++) {
        const Touch *touch = &c->touches[t];
        if (touch->place[1] >= 0 && vec3_dot(touch->bristle, touch->bristle) > 0.0 &&
            c->touch_memory_count < c->touch_memory_room) {
            PairMemory *memory = &c->touch_memory[c->touch_memory_count++];
            touch_key(touch, memory->place);
            vec3_store(memory->bristle, touch->bristle);
        }
    }
    c->touch_count -= group->count;
    group->count = 0;
    c->resting.groups[group - c->group_touches].until = -1.0;
}

/* closes the holes; what lies near in the cloth lies near in memory again */
static void pack_blocks(Contact *c) {
    int end = 0;
    for (int i = 0; i < contact_owners(c); i++) {
        if (resting_holds(&c->resting, i)) {
            resting_wake(c, i);
        }
    }
    for (int i = 0; i < contact_owners(c); i++) {
        GroupTouch *group = &c->group_touches[i];
        size_t count = (size_t)group->count;
        if (count > 0) {
            memcpy(c->old_touches + end, c->touches + group->begin, count * sizeof *c->touches);
            memcpy(c->old_touch_due + end, c->touch_due + group->begin,
                   count * sizeof *c->touch_due);
        }
        group->begin = end;
        end += group->count;
    }
    Touch *touches = c->touches;
    double *due = c->touch_due;
    c->touches = c->old_touches, c->touch_due = c->old_touch_due;
    c->old_touches = touches, c->old_touch_due = due;
    c->touch_end = end;
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

static void search_cell(Contact *c, const Points *x, const SurfaceCell *cell, int owner, int o,
                        double slack) {
    const GroupTouch *group = &c->group_touches[owner];
    for (int k = 0; k < cell->vertex_count; k++) {
        Touch touch = {.obstacle = o,
                       .owner = owner,
                       .frozen = -1.0,
                       .place = {cell->vertex[k], -1, -1},
                       .weight = {1.0},
                       .feature = 1};
        obstacle_evaluate(c, x, &touch);
        if (touch.distance <= group->near + slack) {
            add_touch(c, &touch, group->path + touch.distance - group->near);
        } else {
            memset(contact_vertex_bristle(c, touch.place[0], o), 0, 3 * sizeof(double));
        }
    }
    for (int k = 0; k < cell->triangle_count && c->def->obstacles[o].solid.kind != SOLID_PLANE;
         k++) {
        const int *corner = c->surface.triangles + 3 * (size_t)cell->triangle[k];
        Touch touch = {.obstacle = o,
                       .owner = owner,
                       .frozen = -1.0,
                       .place = {corner[0], corner[1], corner[2]}};
        obstacle_evaluate(c, x, &touch);
        if (touch.distance <= group->near + slack) {
            add_touch(c, &touch, group->path + touch.distance - group->near);
        }
    }
}

static void query_group(Contact *c, const Points *x, int g, int o, double dt) {
    int owner = g * c->def->obstacle_count + o;
    GroupTouch *group = &c->group_touches[owner];
    double dhat = group_distance(c, g), step = group->speed * dt;
    group->near = max2(dhat, CONTACT_NEAR_STEPS * step);
    group->begin = c->touch_end;
    double slack = max2(CONTACT_LEAST_SLACK * dhat, CONTACT_LONG_SLACK_STEPS * step);
    if (c->def->obstacles[o].mesh) { /* its features are in the lists of pairs */
        group->near = group->limit = INFINITY;
        return;
    }
    double apart = group_apart(c, x, g, o);
    if (apart > group->near + slack) {
        group->limit = group->path + apart - group->near;
        return;
    }
    const SurfaceGroup *cells = &c->surface.groups[g];
    for (int k = cells->cell_begin; k < cells->cell_end; k++) {
        search_cell(c, x, &c->surface.cells[k], owner, o, slack);
    }
    group->limit = group->path + slack;
    group->count = c->touch_end - group->begin;
    group->earliest = -INFINITY;
    c->touch_count += group->count;
    if (group->count > 0) {
        group->dhat = c->def->vertex_distance[c->touches[group->begin].place[0]];
    }
}

static bool is_wanted(const GroupTouch *group, bool by_path, double dt) {
    return by_path ? group->path > group->limit
                   : CONTACT_LEAST_NEAR_STEPS * group->speed * dt > group->near;
}

bool obstacle_search(Contact *c, bool by_path, double dt) {
    int wanted = 0;
    for (int i = 0; i < contact_owners(c); i++) {
        c->owner_wanted[i] = is_wanted(&c->group_touches[i], by_path, dt);
        wanted += c->owner_wanted[i];
    }
    if (wanted == 0) {
        return false;
    }
    Points x = contact_positions(c);
    c->statistics.rebuilds++;
    c->touch_memory_count = 0;
    for (int i = 0; i < contact_owners(c); i++) {
        if (c->owner_wanted[i]) {
            drop_block(c, &c->group_touches[i]);
        }
    }
    if (c->touch_end > 2 * c->touch_count + LEAST_HOLES) {
        pack_blocks(c);
    }
    int first = c->touch_end;
    for (int i = 0; i < contact_owners(c); i++) {
        if (c->owner_wanted[i]) {
            query_group(c, &x, i / c->def->obstacle_count, i % c->def->obstacle_count, dt);
        }
    }
    obstacle_restore(c, first);
    return true;
}

static int compare_keys(const void *a, const void *b) {
    return memcmp(((const PairMemory *)a)->place, ((const PairMemory *)b)->place,
                  sizeof((const PairMemory *)a)->place);
}

/* gives kept bristles to the touches from `first` on */
void obstacle_restore(Contact *c, int first) {
    size_t kept = (size_t)c->touch_memory_count;
    if (kept > 1) {
        qsort(c->touch_memory, kept, sizeof *c->touch_memory, compare_keys);
    }
    for (int t = first; t < c->touch_end && kept > 0; t++) {
        PairMemory key;
        touch_key(&c->touches[t], key.place);
        const PairMemory *memory =
            bsearch(&key, c->touch_memory, kept, sizeof *c->touch_memory, compare_keys);
        if (memory) {
            c->touches[t].bristle = vec3_load(memory->bristle);
        }
    }
    c->touch_memory_count = 0;
}

void obstacle_begin(Contact *c, double dt) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        obstacle_place(c, o);
    }
    c->touch_count = c->touch_end = c->due_touch_count = c->due_group_count = 0;
    memset(c->group_touches, 0, (size_t)contact_owners(c) * sizeof *c->group_touches);
    resting_clear(&c->resting, contact_owners(c));
    for (int g = 0; g < contact_cloth_groups(c); g++) {
        for (int o = 0; o < c->def->obstacle_count; o++) {
            GroupTouch *group = &c->group_touches[g * c->def->obstacle_count + o];
            group->speed = c->motion[g].fastest;
            group->limit = -1.0;
        }
    }
    int kept = c->touch_memory_count; /* from the last interval; nothing is dropped yet */
    obstacle_search(c, true, dt);
    c->touch_memory_count = kept;
    obstacle_restore(c, 0);
}

void obstacle_forget(const Contact *c, Touch *touch) {
    touch->bristle = vec3(0, 0, 0);
    if (touch->place[1] < 0) {
        memset(contact_vertex_bristle(c, touch->place[0], touch->obstacle), 0, 3 * sizeof(double));
    }
}

/* ---- looking ---- */

/* The looks of a step, group by group: what each finds stands from its first touch on. */
typedef struct LookJob {
    Contact *c;
    Points x;
} LookJob;

/* one touch, which is due; into those that are near, when it is */
static inline void look_at(const LookJob *job, GroupTouch *group, int t) {
    Contact *c = job->c;
    Touch *touch = &c->touches[t];
    double path = group->path;
    if (path <= touch->frozen) {
        obstacle_project(&job->x, touch);
    } else {
        obstacle_evaluate(c, &job->x, touch);
        touch->frozen = path + obstacle_frozen(c, touch);
    }
    double due = path + touch->distance - group->near;
    if (touch->spare) {
        due = max2(due, path + touch->margin);
    } else if (touch->distance <= group->near) {
        c->near_touches[group->begin + group->near_count++] = t;
        group->gap = min2(group->gap, touch->distance);
    } else {
        obstacle_forget(c, touch);
    }
    c->touch_due[t] = due;
    group->earliest = min2(group->earliest, due);
}

static void due_chunk(int chunk, int first, int end, void *context) {
    Contact *c = ((const LookJob *)context)->c;
    int count = 0;
    for (int i = first; i < end; i++) {
        const GroupTouch *group = &c->group_touches[i];
        if (group->count > 0 && group->path >= group->earliest) {
            c->due_groups[first + count++] = i;
        }
    }
    c->touch_counts[chunk] = count;
}

/* vertices are looked at first, so that triangles find the distances of their corners */
static void vertex_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const LookJob *job = context;
    Contact *c = job->c;
    for (int k = first; k < end; k++) {
        int owner = c->due_groups[k];
        GroupTouch *group = &c->group_touches[owner];
        bool rests = resting_holds(&c->resting, owner) && resting_look(c, &job->x, owner);
        group->looked = group->near_count = 0;
        if (rests) {
            continue;
        }
        group->earliest = group->gap = INFINITY;
        for (int t = group->begin; t < group->begin + group->count; t++) {
            if (group->path < c->touch_due[t]) {
                group->earliest = min2(group->earliest, c->touch_due[t]);
            } else if (c->touches[t].place[1] < 0) {
                look_at(job, group, t);
            } else {
                c->looked[group->begin + group->looked++] = t;
            }
        }
    }
}

static void triangle_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const LookJob *job = context;
    Contact *c = job->c;
    for (int k = first; k < end; k++) {
        int owner = c->due_groups[k];
        GroupTouch *group = &c->group_touches[owner];
        for (int m = 0; m < group->looked; m++) {
            look_at(job, group, c->looked[group->begin + m]);
        }
        if (!resting_holds(&c->resting, owner)) {
            resting_settle(c, owner);
        }
    }
}

void obstacle_look(Contact *c) {
    LookJob job = {c, contact_positions(c)};
    int owners = contact_owners(c);
    parallel_for(owners, OWNER_GRAIN, due_chunk, &job);
    int groups = parallel_close_up(c->due_groups, c->touch_counts, owners, OWNER_GRAIN);
    parallel_for(groups, LOOK_GRAIN, vertex_chunk, &job);
    parallel_for(groups, LOOK_GRAIN, triangle_chunk, &job);
    c->due_group_count = groups;
    c->due_touch_count = 0;
    for (int k = 0; k < groups; k++) {
        const GroupTouch *group = &c->group_touches[c->due_groups[k]];
        c->statistics.evaluations += resting_count(&c->resting, c->due_groups[k]);
        memcpy(c->due_touches + c->due_touch_count, c->near_touches + group->begin,
               (size_t)group->near_count * sizeof *c->due_touches);
        c->due_touch_count += group->near_count;
    }
    c->statistics.evaluations += c->due_touch_count;
    c->statistics.pairs += c->touch_count;
}

void obstacle_find(Contact *c, double dt) {
    obstacle_search(c, true, dt);
    obstacle_look(c);
    for (int k = 0; k < c->due_group_count; k++) {
        const GroupTouch *group = &c->group_touches[c->due_groups[k]];
        c->statistics.smallest_gap = min2(c->statistics.smallest_gap, group->gap);
        if (group->count > 0) {
            c->at_solids.room = min2(c->at_solids.room, group->gap / group->dhat);
        }
    }
}

int obstacle_remember(const Contact *c, PairMemory *memory, int room) {
    int count = 0;
    for (int i = 0; i < contact_owners(c); i++) {
        const GroupTouch *group = &c->group_touches[i];
        for (int t = group->begin; t < group->begin + group->count && count < room; t++) {
            const Touch *touch = &c->touches[t];
            if (touch->place[1] >= 0 && vec3_dot(touch->bristle, touch->bristle) > 0.0) {
                touch_key(touch, memory[count].place);
                vec3_store(memory[count++].bristle, touch->bristle);
            }
        }
    }
    return count;
}
