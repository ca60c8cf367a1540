/* groups.c: how every group moves in a step (motion.h), and what all of them do together. */
#include <math.h>

#include "sim/contact/engine.h"

/* groups a thread takes at once, some 2 to 5 us: those that are blocks, others */
#define BLOCK_GRAIN 200
#define MOVE_GRAIN 20

/* What concerns all groups, of some. */
struct GroupsMove {
    Vec3 sum;        /* [m/s] of those of cloth */
    double farthest; /* [m/s] from c->groups.mean */
    bool outgrown;   /* does so much motion of one exceed its `near` at a solid? */
    bool narrow;     /* does it concern the guard there? */
};

/* which groups every place has */
static void index_vertices(Groups *groups, const Surface *s, int places, Arena *arena) {
    int *begin = arena_push(arena, int, places + 1), total = 0;
    for (int g = 0; g < s->group_count; g++) {
        for (int k = s->groups[g].vertex_begin; k < s->groups[g].vertex_end; k++) {
            begin[s->group_vertices[k]]++;
            total++;
        }
    }
    int *of_vertex = arena_push(arena, int, total);
    for (int i = 0, at = 0; i <= places; i++) {
        int count = i < places ? begin[i] : 0;
        begin[i] = at;
        at += count;
    }
    for (int g = s->group_count - 1; g >= 0; g--) {
        for (int k = s->groups[g].vertex_begin; k < s->groups[g].vertex_end; k++) {
            int slot = begin[s->group_vertices[k]];
            while (of_vertex[slot] != 0) {
                slot++;
            }
            of_vertex[slot] = g + 1;
        }
    }
    for (int k = 0; k < total; k++) {
        of_vertex[k]--;
    }
    groups->begin = begin;
    groups->of_vertex = of_vertex;
}

Groups groups_create(const Surface *surface, int vertex_count, int places, Arena *arena) {
    int count = surface->group_count;
    int most = parallel_chunk_count(count, BLOCK_GRAIN) + parallel_chunk_count(count, MOVE_GRAIN);
    Groups groups = {.rows = motion_rows_create(surface, vertex_count, arena),
                     .motion = arena_push(arena, GroupMotion, count),
                     .moves = arena_push(arena, GroupsMove, most)};
    index_vertices(&groups, surface, places, arena);
    return groups;
}

static Vec3 velocity_of(const Contact *c, int place) {
    const Lanes *lanes = c->view.lanes;
    if (place >= c->def->vertex_count) {
        return contact_velocity(c, place);
    }
    int slot = c->view.slot[place];
    return vec3(lanes->v[0][slot], lanes->v[1][slot], lanes->v[2][slot]);
}

static void move_group(Contact *c, int g, Vec3 (*velocity)(const Contact *c, int place)) {
    const SurfaceGroup *group = &c->surface.groups[g];
    const int *vertices = c->surface.group_vertices;
    Vec3 middle = velocity(c, vertices[(group->vertex_begin + group->vertex_end) / 2]);
    double most = 0.0;
    for (int k = group->vertex_begin; k < group->vertex_end; k++) {
        Vec3 d = vec3_sub(velocity(c, vertices[k]), middle);
        double square = vec3_dot(d, d);
        most = square > most ? square : most;
    }
    double deviation = sqrt(most);
    c->groups.motion[g] = (GroupMotion){middle, deviation, vec3_length(middle) + deviation};
}

/* may touches be so near, at the last look, that impulses or planes ask for them? */
static bool is_narrow(const Contact *c, const GroupTouch *touch, int obstacle, double dt) {
    double motion = dt * max2(CONTACT_IMPULSE_RESERVE, 1.0 / CONTACT_PLANE_SHARE) * touch->speed;
    bool moves = c->def->obstacles[obstacle].moves;
    return touch->count > 0 && (moves || touch->gap - CONTACT_IMPULSE_GAP * touch->dhat < motion);
}

/* tells the touches of a group its speed; `steps` as in GroupsMove.outgrown */
static void add_group(Contact *c, int g, double steps, double dt, GroupsMove *all) {
    const GroupMotion *motion = &c->groups.motion[g];
    double off = vec3_length(vec3_sub(motion->velocity, c->groups.mean)) + motion->deviation;
    all->farthest = max2(all->farthest, off);
    if (g >= contact_cloth_groups(c)) {
        return;
    }
    all->sum = vec3_add(all->sum, motion->velocity);
    int obstacles = c->def->obstacle_count;
    GroupTouch *touch = c->touches.groups + (size_t)g * (size_t)obstacles;
    for (int o = 0; o < obstacles; o++) {
        touch[o].speed = motion->fastest + c->obstacle_speed[o];
        all->outgrown = all->outgrown || steps * touch[o].speed * dt > touch[o].near;
        all->narrow = all->narrow || is_narrow(c, &touch[o], o, dt);
    }
}

typedef struct MoveJob {
    Contact *c;
    double dt;
} MoveJob;

static void block_chunk(int chunk, int first, int end, void *context) {
    const MoveJob *job = context;
    Contact *c = job->c;
    GroupsMove all = {0};
    motion_bound(&c->groups.rows, first, end, c->view.lanes->v, c->groups.motion);
    for (int k = first; k < end; k++) {
        add_group(c, c->groups.rows.blocks[k].group, CONTACT_LEAST_NEAR_STEPS, job->dt, &all);
    }
    c->groups.moves[chunk] = all;
}

static void other_chunk(int chunk, int first, int end, void *context) {
    const MoveJob *job = context;
    Contact *c = job->c;
    GroupsMove all = {0};
    for (int k = first; k < end; k++) {
        int g = c->groups.rows.others[k];
        move_group(c, g, velocity_of);
        add_group(c, g, CONTACT_LEAST_NEAR_STEPS, job->dt, &all);
    }
    c->groups.moves[parallel_chunk_count(c->groups.rows.block_count, BLOCK_GRAIN) + chunk] = all;
}

/* with the sum over chunks, in turn */
static void take_moves(Contact *c) {
    int chunks = parallel_chunk_count(c->groups.rows.block_count, BLOCK_GRAIN) +
                 parallel_chunk_count(c->groups.rows.other_count, MOVE_GRAIN);
    GroupsMove all = {0};
    for (int p = 0; p < c->surface.panel_count; p++) {
        all.farthest = c->surface.panels[p].still ? vec3_length(c->groups.mean) : all.farthest;
    }
    for (int k = 0; k < chunks; k++) {
        all.sum = vec3_add(all.sum, c->groups.moves[k].sum);
        all.farthest = max2(all.farthest, c->groups.moves[k].farthest);
        all.outgrown = all.outgrown || c->groups.moves[k].outgrown;
        all.narrow = all.narrow || c->groups.moves[k].narrow;
    }
    c->groups.fastest_relative = all.farthest;
    c->groups.outgrown = all.outgrown;
    c->groups.narrow = all.narrow;
    c->groups.mean = vec3_scale(1.0 / contact_cloth_groups(c), all.sum);
}

void contact_move_groups(Contact *c, double dt) {
    MoveJob job = {c, dt};
    MotionCopy copy = {&c->groups.rows, c->view.lanes->v, c->v};
    ParallelLoop loops[] = {motion_copy_loop(&copy),
                            {c->groups.rows.block_count, BLOCK_GRAIN, block_chunk, &job},
                            {c->groups.rows.other_count, MOVE_GRAIN, other_chunk, &job}};
    parallel_for_all(loops, 3);
    take_moves(c);
}

void contact_move_changed_groups(Contact *c, double dt) {
    GroupsMove all = {.farthest = c->groups.fastest_relative};
    for (int k = 0; k < c->changed_count; k++) {
        int place = c->changed[k];
        for (int m = c->groups.begin[place]; m < c->groups.begin[place + 1]; m++) {
            move_group(c, c->groups.of_vertex[m], contact_velocity);
            add_group(c, c->groups.of_vertex[m], 1.0 / CONTACT_PLANE_SHARE, dt, &all);
        }
    }
    c->groups.fastest_relative = all.farthest;
    c->groups.outgrown = all.outgrown;
    c->groups.narrow = c->groups.narrow || all.narrow;
}
