#include "sim/step/limit.h"

#include <math.h>
#include <string.h>

static void create_graph(Limit *l, Arena *arena) {
    l->begin = arena_push(arena, int, l->node_count + 1);
    l->neighbour = arena_push(arena, int, 2 * l->count);
    for (int k = 0; k < l->count; k++) {
        l->begin[l->springs[k].a + 1]++;
        l->begin[l->springs[k].b + 1]++;
    }
    for (int i = 0; i < l->node_count; i++) {
        l->begin[i + 1] += l->begin[i];
    }
    int *at = l->queue; /* free until the first interval */
    memcpy(at, l->begin, (size_t)l->node_count * sizeof *at);
    for (int k = 0; k < l->count; k++) {
        l->neighbour[at[l->springs[k].a]++] = l->springs[k].b;
        l->neighbour[at[l->springs[k].b]++] = l->springs[k].a;
    }
}

/* breadth first from the held nodes; what they do not reach stays at node_count */
static void find_distances(Limit *l) {
    int end = 0;
    for (int i = 0; i < l->node_count; i++) {
        l->distance[i] = l->held[i] ? 0 : l->node_count;
        l->queue[end] = i;
        end += l->held[i] != 0;
    }
    for (int k = 0; k < end; k++) {
        int i = l->queue[k];
        for (int n = l->begin[i]; n < l->begin[i + 1]; n++) {
            int next = l->neighbour[n];
            if (l->distance[next] == l->node_count) {
                l->distance[next] = l->distance[i] + 1;
                l->queue[end++] = next;
            }
        }
    }
}

/* the place of a spring: its ends' distances together; springs alike keep the order of the model */
static int place_of(const Limit *l, int spring) {
    return l->distance[l->springs[spring].a] + l->distance[l->springs[spring].b];
}

static void find_order(Limit *l) {
    find_distances(l);
    for (int next = 0, place = 0, at = 0; at < l->count; place = next) {
        next = 2 * l->node_count;
        for (int k = 0; k < l->count; k++) {
            int p = place_of(l, k);
            if (p == place) {
                l->order[at++] = k;
            } else if (p > place && p < next) {
                next = p;
            }
        }
    }
}

Limit limit_create(const Cloth *cloth, const int *slot, Arena *arena) {
    int nodes = cloth->node_count;
    if (cloth->spring_limit_count == 0) {
        return (Limit){0};
    }
    Limit l = {.count = cloth->spring_limit_count,
               .node_count = nodes,
               .rounds = (int)cloth->def->limit_rounds,
               .springs = cloth->spring_limits,
               .slot = slot,
               .held = arena_push(arena, unsigned char, nodes),
               .order = arena_push(arena, int, cloth->spring_limit_count),
               .distance = arena_push(arena, int, nodes),
               .queue = arena_push(arena, int, nodes)};
    create_graph(&l, arena);
    find_order(&l);
    return l;
}

void limit_see(Limit *l, const unsigned char *held) {
    if (l->count > 0 && memcmp(l->held, held, (size_t)l->node_count) != 0) {
        memcpy(l->held, held, (size_t)l->node_count);
        find_order(l);
    }
}

static inline Vec3 load(double *const lane[3], int slot) {
    return vec3(lane[0][slot], lane[1][slot], lane[2][slot]);
}

static inline void push(const Lanes *lanes, int slot, double mobility, Vec3 impulse) {
    lanes->v[0][slot] += mobility * impulse.x;
    lanes->v[1][slot] += mobility * impulse.y;
    lanes->v[2][slot] += mobility * impulse.z;
}

/* [m] to take off the motion `d` of the ends apart, along the unit vector u that they have now, so that
 * its length becomes `longest`, or as near as it gets: forces along u have no moment */
static double excess(Vec3 d, Vec3 u, double longest) {
    double along = vec3_dot(d, u), square = vec3_dot(d, d) - longest * longest;
    return along - sqrt(fmax(along * along - square, 0.0));
}

/* the impulse that lets the spring have its longest length after dt */
static double hold_spring(const Limit *l, const SpringLimit *s, const Lanes *lanes, double dt,
                          double *handles) {
    int a = l->slot[s->a], b = l->slot[s->b];
    Vec3 apart = vec3_sub(load(lanes->v, b), load(lanes->v, a));
    Vec3 now = vec3_sub(load(lanes->x, b), load(lanes->x, a)), d = vec3_axpy(now, dt, apart);
    if (!(vec3_dot(d, d) > s->longest * s->longest)) {
        return 0.0;
    }
    double first = l->held[s->a] ? 0.0 : lanes->weight[a], length = vec3_length(now);
    double second = l->held[s->b] ? 0.0 : lanes->weight[b], mobility = first + second;
    if (mobility == 0.0 || length == 0.0) {
        return 0.0;
    }
    Vec3 u = vec3_scale(1.0 / length, now);
    Vec3 impulse = vec3_scale(excess(d, u, s->longest) / (dt * mobility), u);
    push(lanes, a, first, impulse);
    push(lanes, b, -second, impulse);
    *handles -= first > 0.0 ? 0.0 : vec3_dot(impulse, load(lanes->v, a));
    *handles += second > 0.0 ? 0.0 : vec3_dot(impulse, load(lanes->v, b));
    /* times the mean of the velocities before and after */
    return vec3_dot(impulse, vec3_axpy(apart, -0.5 * mobility, impulse));
}

double limit_hold(const Limit *l, const Lanes *lanes, double dt, double *handles) {
    double taken = 0.0;
    for (int round = 0; round < l->rounds; round++) {
        for (int k = 0; k < l->count; k++) {
            taken += hold_spring(l, &l->springs[l->order[k]], lanes, dt, handles);
        }
    }
    return taken;
}
