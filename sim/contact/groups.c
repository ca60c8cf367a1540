/* groups.c: how every group moves in a step (motion.h). */
#include <math.h>

#include "sim/contact/engine.h"

/* groups a thread takes at once, some 2 to 5 us: those that are blocks, others */
#define BLOCK_GRAIN 200
#define MOVE_GRAIN 20

static void move_group(Contact *c, int g) {
    const SurfaceGroup *group = &c->surface.groups[g];
    const int *vertices = c->surface.group_vertices;
    Vec3 middle = contact_velocity(c, vertices[(group->vertex_begin + group->vertex_end) / 2]);
    double most = 0.0;
    for (int k = group->vertex_begin; k < group->vertex_end; k++) {
        Vec3 d = vec3_sub(contact_velocity(c, vertices[k]), middle);
        double square = vec3_dot(d, d);
        most = square > most ? square : most;
    }
    double deviation = sqrt(most);
    c->motion[g] = (GroupMotion){middle, deviation, vec3_length(middle) + deviation};
}

static void other_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    Contact *c = context;
    for (int k = first; k < end; k++) {
        move_group(c, c->rows.others[k]);
    }
}

static void block_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    Contact *c = context;
    motion_bound(&c->rows, first, end, c->view.lanes->v, c->motion);
}

void contact_move_groups(Contact *c) {
    ParallelLoop loops[] = {{c->rows.block_count, BLOCK_GRAIN, block_chunk, c},
                            {c->rows.other_count, MOVE_GRAIN, other_chunk, c}};
    parallel_for_all(loops, 2);
}

void contact_move_changed_groups(Contact *c) {
    for (int k = 0; k < c->changed_count; k++) {
        int place = c->changed[k];
        for (int m = c->vertex_group_begin[place]; m < c->vertex_group_begin[place + 1]; m++) {
            move_group(c, c->vertex_groups[m]);
        }
    }
}
