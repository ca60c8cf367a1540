/* losses.c: the book of what contact takes out of the cloth. All impulses of a step count as one: each
 * works on the mean of the velocities before the kick and after the guard, so that what pushes and
 * what holds at rest do no work, however hard. */
#include "sim/contact/engine.h"

void contact_clear(Contact *c, Vec3 given) {
    const Lanes *lanes = c->view.lanes;
    for (int k = 0; k < c->touched_count; k++) {
        int place = c->touched[k], slot = c->view.slot[place];
        double weight = lanes->weight[slot], own = c->weight_kept[place];
        if (weight < own) {
            Vec3 v = vec3(lanes->v[0][slot], lanes->v[1][slot], lanes->v[2][slot]);
            Vec3 pushed = vec3_sub(vec3_sub(v, c->tolls[place].before), given);
            c->tolls[place].inertia =
                vec3_scale(c->held[place] ? 0.0 : 1.0 / own - 1.0 / weight, pushed);
            lanes->weight[slot] = own;
        }
        lanes->f[0][slot] = lanes->f[1][slot] = lanes->f[2][slot] = 0.0;
        c->stiff[place] = 0.0;
    }
}

void contact_count_losses(Contact *c) {
    ContactStatistics *s = &c->statistics;
    for (int k = 0; k < c->touched_count; k++) {
        int place = c->touched[k];
        const Toll *toll = &c->tolls[place];
        Vec3 mean = vec3_scale(0.5, vec3_add(toll->before, contact_velocity(c, place)));
        s->damping -= vec3_dot(mean, toll->damping);
        s->friction -= vec3_dot(mean, toll->friction);
        s->guard -= vec3_dot(mean, toll->inertia);
    }
    for (int k = 0; k < c->changed_count; k++) {
        int place = c->changed[k];
        Vec3 v = contact_velocity(c, place), kicked = c->kicked[place];
        Vec3 before = c->is_touched[place] ? c->tolls[place].before : kicked;
        s->guard -= 0.5 * c->def->mass[place] * vec3_dot(vec3_sub(v, kicked), vec3_add(before, v));
    }
    for (int k = 0; k < c->touched_count; k++) {
        c->is_touched[c->touched[k]] = 0;
    }
    c->touched_count = 0;
}
