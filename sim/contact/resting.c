#include "sim/contact/resting.h"

#include <math.h>
#include <string.h>

#include "sim/base/parallel.h"
#include "sim/contact/force.h"

#define GROUP_GRAIN 8 /* groups that a thread takes at once, some 10 us */

Resting resting_create(int owners, Arena *arena) {
    static RestKernel *const *const kernels[] = {&rest_kernel_scalar, &rest_kernel_sse2,
                                                 &rest_kernel_avx2, &rest_kernel_avx512};
    int chunks = parallel_chunk_count(owners, GROUP_GRAIN);
    Resting resting = {.groups = arena_push(arena, RestGroup, owners),
                       .pushes = arena_push(arena, RestPush, chunks),
                       .kernel = *kernels[vector_best()]};
    resting_clear(&resting, owners);
    return resting;
}

void resting_clear(Resting *resting, int owners) {
    for (int i = 0; i < owners; i++) {
        resting->groups[i].until = -1.0;
    }
}

void resting_make_room(Resting *resting, int used, int room, Arena *arena) {
    resting->place = arena_grow(arena, int, resting->place, used, room);
    resting->level = arena_grow(arena, double, resting->level, used, room);
    resting->distance = arena_grow(arena, double, resting->distance, used, room);
}

/* can no other obstacle meet the group? */
static bool only_obstacle(const Contact *c, int owner) {
    int obstacles = c->def->obstacle_count, first = owner / obstacles * obstacles;
    for (int i = first; i < first + obstacles; i++) {
        if (i != owner && c->touches.groups[i].listed > 0) {
            return false;
        }
    }
    return true;
}

/* a vertex over the face of the first, or a triangle over it */
static bool lies_flat(const Contact *c, const Touch *touch, const Vec3 *normal, double path,
                      double *until) {
    bool vertex = touch->place[1] < 0;
    double end = vertex ? touch->frozen : c->touches.due[touch - c->touches.list];
    bool flat = vertex ? memcmp(normal, &touch->normal, sizeof *normal) == 0 : touch->spare;
    *until = min2(*until, end);
    return flat && end > path;
}

void resting_settle(Contact *c, int owner) {
    Resting *r = &c->resting;
    RestGroup *rest = &r->groups[owner];
    GroupTouch *group = &c->touches.groups[owner];
    const Touch *touches = c->touches.list + group->begin;
    if (c->impulses || group->near_count == 0 || !only_obstacle(c, owner) ||
        c->def->obstacles[owner % c->def->obstacle_count].moves) {
        return;
    }
    double until = INFINITY;
    int count = 0;
    rest->normal = c->touches.list[c->touches.near[group->begin]].normal;
    for (int t = 0; t < group->count; t++) {
        if (!lies_flat(c, &touches[t], &rest->normal, group->path, &until)) {
            return;
        }
        if (touches[t].place[1] < 0) {
            int k = group->begin + count++;
            r->place[k] = touches[t].place[0];
            r->level[k] = touches[t].level;
            r->distance[k] = touches[t].distance;
        }
    }
    rest->count = count;
    rest->until = until;
    group->near_count = 0;
}

bool resting_look(Contact *c, const Points *x, int owner) {
    Resting *r = &c->resting;
    const RestGroup *rest = &r->groups[owner];
    GroupTouch *group = &c->touches.groups[owner];
    if (group->path > rest->until || !only_obstacle(c, owner)) {
        resting_wake(c, owner);
        return false;
    }
    double gap = INFINITY;
    for (int k = group->begin; k < group->begin + rest->count; k++) {
        double d = vec3_dot(rest->normal, point_at(x, r->place[k])) - r->level[k];
        r->distance[k] = d;
        gap = min2(gap, d);
    }
    group->gap = gap;
    group->earliest = min2(group->path + gap - group->near, rest->until);
    return true;
}

void resting_wake(Contact *c, int owner) {
    Points x = contact_positions(c);
    GroupTouch *group = &c->touches.groups[owner];
    c->resting.groups[owner].until = -1.0;
    group->earliest = -INFINITY;
    group->near_count = 0;
    for (int t = group->begin; t < group->begin + group->count; t++) {
        Touch *touch = &c->touches.list[t];
        if (touch->place[1] < 0) {
            obstacle_project(&x, touch);
            c->touches.due[t] = -INFINITY;
            if (touch->distance <= group->near) {
                c->touches.near[group->begin + group->near_count++] = t;
            }
        }
    }
}

/* ---- forces ---- */

typedef struct RestJob {
    Contact *c;
    double dt, share;
} RestJob;

static void set_row(const Contact *c, RestRows *rows, int k, int place, int owner,
                    double distance) {
    Vec3 v = contact_velocity(c, place);
    const double *bristle = contact_vertex_bristle(c, place, owner % c->def->obstacle_count);
    rows->distance[k] = c->held[place] ? INFINITY : distance;
    rows->mass[k] = c->def->mass[place];
    rows->v[0][k] = v.x, rows->v[1][k] = v.y, rows->v[2][k] = v.z;
    for (int a = 0; a < 3; a++) {
        rows->bristle[a][k] = bristle[a];
    }
}

/* the last vector is worked on as a whole */
static void fill_rows(RestRows *rows, int count, int end) {
    for (int k = count; k < end; k++) {
        rows->distance[k] = INFINITY;
        rows->mass[k] = 1.0;
        for (int a = 0; a < 3; a++) {
            rows->v[a][k] = rows->bristle[a][k] = 0.0;
        }
    }
}

static ContactForce force_of(const RestRows *rows, int k, Vec3 normal) {
    Vec3 friction = {rows->friction[0][k], rows->friction[1][k], rows->friction[2][k]};
    return (ContactForce){.sum = vec3_axpy(friction, rows->total[k], normal),
                          .damping = vec3_scale(rows->damping[k], normal),
                          .friction = friction,
                          .stiffness = rows->stiffness[k]};
}

/* the force on a vertex that nothing else touches */
static void push_alone(Contact *c, int place, const ContactForce *force) {
    const Lanes *lanes = c->view.lanes;
    int slot = c->view.slot[place];
    double own = c->weight_kept[place];
    double inertia = c->held[place] ? 0.0 : contact_inertia(c, force->stiffness);
    lanes->f[0][slot] += force->sum.x;
    lanes->f[1][slot] += force->sum.y;
    lanes->f[2][slot] += force->sum.z;
    lanes->weight[slot] = inertia * own > 1.0 ? 1.0 / inertia : own;
    c->is_touched[place] = TOUCHED_ALONE;
    c->tolls[place] = (Toll){.damping = vec3_scale(c->kick_time, force->damping),
                             .friction = vec3_scale(c->kick_time, force->friction),
                             .before = contact_velocity(c, place)};
}

/* the vertices from `first` on */
static void push_rows(const RestJob *job, int owner, int first, int count, RestPush *sum) {
    Contact *c = job->c;
    Resting *r = &c->resting;
    Vec3 n = r->groups[owner].normal;
    const GroupTouch *group = &c->touches.groups[owner];
    int obstacle = owner % c->def->obstacle_count;
    double own = c->def->obstacles[obstacle].friction;
    RestFace face = {.normal = {n.x, n.y, n.z},
                     .dhat = group->dhat,
                     .friction =
                         own >= 0.0 ? own : touch_friction(c, &c->touches.list[group->begin]),
                     .stiffness = c->at_solids.share,
                     .dt = job->dt,
                     .share_dt = job->share * job->dt};
    RestRows rows;
    int vectors = (count + REST_VECTOR - 1) / REST_VECTOR;
    for (int k = 0; k < count; k++) {
        set_row(c, &rows, k, r->place[first + k], owner, r->distance[first + k]);
    }
    fill_rows(&rows, count, vectors * REST_VECTOR);
    r->kernel(&face, &rows, vectors);
    for (int k = 0; k < count; k++) {
        int place = r->place[first + k];
        double *bristle = contact_vertex_bristle(c, place, obstacle);
        bool pushes = rows.distance[k] < face.dhat;
        ContactForce force = force_of(&rows, k, n);
        if (pushes && c->is_touched[place] == UNTOUCHED) {
            push_alone(c, place, &force);
        } else if (pushes) {
            contact_push(c, place, 1.0, &force);
        }
        for (int a = 0; a < 3; a++) {
            bristle[a] = rows.bristle[a][k];
        }
        if (pushes) {
            *sum = (RestPush){true, max2(sum->approach, rows.approach[k])};
        }
    }
}

static void force_chunk(int chunk, int first, int end, void *context) {
    const RestJob *job = context;
    Contact *c = job->c;
    Resting *r = &c->resting;
    RestPush sum = {0};
    for (int k = first; k < end; k++) {
        int owner = c->look.groups[k], begin = c->touches.groups[owner].begin;
        int count = resting_count(r, owner);
        for (int m = 0; m < count; m += REST_BATCH) {
            int rows = count - m < REST_BATCH ? count - m : REST_BATCH;
            push_rows(job, owner, begin + m, rows, &sum);
        }
    }
    r->pushes[chunk] = sum;
}

void resting_forces(Contact *c, double dt, double share) {
    RestJob job = {c, dt, share};
    double *approach = &c->statistics.approach;
    parallel_for(c->look.group_count, GROUP_GRAIN, force_chunk, &job);
    for (int k = 0; k < parallel_chunk_count(c->look.group_count, GROUP_GRAIN); k++) {
        *approach = max2(*approach, c->resting.pushes[k].approach);
        c->some_touched = c->some_touched || c->resting.pushes[k].some;
    }
}
