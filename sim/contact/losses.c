/* losses.c: the book of what contact takes out of the cloth. All impulses of a step count as one: each
 * works on the mean of the velocities before the kick and after the guard, so that what pushes and
 * what holds at rest do no work, however hard. */
#include "sim/base/parallel.h"
#include "sim/contact/engine.h"

typedef struct ClearJob {
    Contact *c;
    Vec3 given;
} ClearJob;

static void clear_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const ClearJob *job = context;
    Contact *c = job->c;
    const Lanes *lanes = c->view.lanes;
    TouchedWalk walk = touched_walk(c->is_touched, first, end, true);
    for (int place; (place = touched_next(&walk)) >= 0;) {
        int slot = c->view.slot[place];
        double weight = lanes->weight[slot], own = c->weight_kept[place];
        if (weight < own) {
            Vec3 v = vec3(lanes->v[0][slot], lanes->v[1][slot], lanes->v[2][slot]);
            Vec3 pushed = vec3_sub(vec3_sub(v, c->tolls[place].before), job->given);
            c->tolls[place].inertia =
                vec3_scale(c->held[place] ? 0.0 : 1.0 / own - 1.0 / weight, pushed);
            lanes->weight[slot] = own;
        }
        lanes->f[0][slot] = lanes->f[1][slot] = lanes->f[2][slot] = 0.0;
    }
}

void contact_clear(Contact *c, Vec3 given) {
    ClearJob job = {c, given};
    if (c->some_touched) {
        parallel_for(c->def->vertex_count, CONTACT_VERTEX_GRAIN, clear_chunk, &job);
    }
}

static void count_chunk(int chunk, int first, int end, void *context) {
    Contact *c = context;
    Loss sum = {0};
    TouchedWalk walk = touched_walk(c->is_touched, first, end, true);
    for (int place; (place = touched_next(&walk)) >= 0;) {
        const Toll *toll = &c->tolls[place];
        Vec3 mean = vec3_scale(0.5, vec3_add(toll->before, contact_velocity(c, place)));
        sum.damping -= vec3_dot(mean, toll->damping);
        sum.friction -= vec3_dot(mean, toll->friction);
        sum.guard -= vec3_dot(mean, toll->inertia);
    }
    c->losses[chunk] = sum;
}

ParallelLoop contact_losses_loop(Contact *c) {
    int count = c->some_touched ? c->def->vertex_count : 0;
    return (ParallelLoop){count, CONTACT_VERTEX_GRAIN, count_chunk, c};
}

void contact_sum_losses(Contact *c) {
    ContactStatistics *s = &c->statistics;
    int chunks =
        c->some_touched ? parallel_chunk_count(c->def->vertex_count, CONTACT_VERTEX_GRAIN) : 0;
    for (int k = 0; k < chunks; k++) {
        s->damping += c->losses[k].damping;
        s->friction += c->losses[k].friction;
        s->guard += c->losses[k].guard;
    }
    for (int k = 0; k < c->changed_count; k++) {
        int place = c->changed[k];
        if (c->held[place]) { /* a handle loses nothing */
            continue;
        }
        Vec3 v = contact_velocity(c, place), kicked = c->kicked[place];
        Vec3 before = c->is_touched[place] ? c->tolls[place].before : kicked;
        s->guard -= 0.5 * c->def->mass[place] * vec3_dot(vec3_sub(v, kicked), vec3_add(before, v));
    }
    if (c->some_touched) {
        memset(c->is_touched, UNTOUCHED, (size_t)c->def->vertex_count);
        c->some_touched = false;
    }
}
