/* obstacle_mesh.c: triangle meshes as obstacles on the explicit road. Their vertices are places
 * after those of the cloth, moved by nothing but their programme; features of both meet in the
 * same lists (lists.h). Driven meshes take part in the guard as driven solids do. */
#include <math.h>
#include <string.h>

#include "sim/contact/engine.h"

void mesh_begin(Contact *c) {
    for (int o = 0; o < c->def->obstacle_count; o++) {
        size_t first = (size_t)c->places.mesh_first[o],
               count = (size_t)c->places.mesh_first[o + 1] - first;
        if (count > 0) {
            places_pose(&c->def->obstacles[o], c->poses[o], c->programmes.clocks[o],
                        c->x + 3 * first);
            memcpy(c->programmes.mesh_target + 3 * (first - (size_t)c->def->vertex_count),
                   c->x + 3 * first, 3 * count * sizeof *c->x);
            memset(c->v + 3 * first, 0, 3 * count * sizeof *c->v);
        }
    }
}

void mesh_demand(Contact *c, int o, double dt) {
    int first = c->places.mesh_first[o], count = c->places.mesh_first[o + 1] - first;
    double *target = c->programmes.mesh_target + 3 * (size_t)(first - c->def->vertex_count);
    const double *x = c->x + 3 * (size_t)first;
    double *v = c->v + 3 * (size_t)first, most = 0.0;
    places_pose(&c->def->obstacles[o], c->programmes.next[o], c->programmes.next_clocks[o], target);
    for (int i = 0; i < count; i++) {
        double square = 0.0;
        for (int a = 3 * i; a < 3 * i + 3; a++) {
            v[a] = (target[a] - x[a]) / dt;
            square += v[a] * v[a];
        }
        most = max2(most, square);
    }
    c->obstacle_speed[o] = sqrt(most);
}

int pair_obstacle(const Contact *c, const Pair *pair) {
    int place = pair->place[0] > pair->place[3] ? pair->place[0] : pair->place[3];
    return place < c->def->vertex_count ? -1 : places_obstacle(&c->places, place);
}

/* the corners of a pair that are cloth or mesh: begin <= a < end */
static void side_of(const Contact *c, const Pair *pair, bool mesh, int *begin, int *end) {
    int first = pair->kind == PAIR_FACE ? 1 : 2;
    bool before = (pair->place[0] >= c->def->vertex_count) == mesh;
    *begin = before ? 0 : first;
    *end = before ? first : 4;
}

double mesh_reach(const Contact *c, const Pair *pair, Vec3 away) {
    int begin, end;
    double closest = 0.0, most = -INFINITY;
    side_of(c, pair, true, &begin, &end);
    for (int a = begin; a < end; a++) {
        const double *x = c->x + 3 * (size_t)pair->place[a];
        const double *to =
            c->programmes.mesh_target + 3 * (size_t)(pair->place[a] - c->def->vertex_count);
        closest += fabs(pair->weight[a]) * vec3_dot(away, vec3_load(x));
        most = max2(most, vec3_dot(away, vec3_load(to)));
    }
    return most - closest;
}

/* how far the corners of the cloth will be beyond the closest point of the mesh */
static double cloth_room(const Contact *c, const Pair *pair, Vec3 away, double dt) {
    int begin, end;
    double here = 0.0, least = INFINITY;
    side_of(c, pair, false, &begin, &end);
    for (int a = begin; a < end; a++) {
        Vec3 x = vec3_load(c->x + 3 * (size_t)pair->place[a]);
        Vec3 moved = vec3_axpy(x, dt, contact_velocity(c, pair->place[a]));
        here += fabs(pair->weight[a]) * vec3_dot(away, x);
        least = min2(least, vec3_dot(away, moved));
    }
    return least - here + pair->distance;
}

double mesh_free_share(const Contact *c, int o, double dt) {
    double phi = 1.0;
    for (int k = 0; k < c->due.count; k++) {
        const Pair *pair = &c->lists.pairs[c->due.pairs[k].pair];
        if (pair_obstacle(c, pair) != o) {
            continue;
        }
        bool before = pair->place[0] < c->def->vertex_count;
        Vec3 away = vec3_scale(before ? 1.0 : -1.0, pair->normal);
        double beyond = mesh_reach(c, pair, away);
        double gap = cloth_room(c, pair, away, dt) - CONTACT_PLANE_FLOOR * pair->dhat;
        if (beyond > CONTACT_YIELD_SHARE * gap) {
            phi = min2(phi, max2(0.0, CONTACT_YIELD_SHARE * gap / beyond));
        }
    }
    return phi;
}

void mesh_move(Contact *c, int o, double phi) {
    double *x = c->x + 3 * (size_t)c->places.mesh_first[o];
    if (phi < 1.0) {
        places_pose(&c->def->obstacles[o], c->poses[o], c->programmes.clocks[o], x);
        return;
    }
    size_t count = (size_t)(c->places.mesh_first[o + 1] - c->places.mesh_first[o]);
    const double *target =
        c->programmes.mesh_target + 3 * (size_t)(c->places.mesh_first[o] - c->def->vertex_count);
    memcpy(x, target, 3 * count * sizeof *x);
}
