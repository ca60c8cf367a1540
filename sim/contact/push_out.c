#include "sim/contact/push_out.h"

#include <stdlib.h>
#include <string.h>

#define MOST_ROUNDS 100 /* over all vertices and triangles; a corner takes about ten */
#define TOO_CLOSE 0.5   /* of the contact distance: nearer, the law would throw the cloth off */

typedef struct Pushed {
    const ContactDef *def;
    const unsigned char *held;
    double *x;
    bool again;
} Pushed;

static void move_vertex(Pushed *s, int i, Vec3 by) {
    if (!s->held[i]) {
        vec3_store(s->x + 3 * (size_t)i, vec3_add(vec3_load(s->x + 3 * (size_t)i), by));
        s->again = true;
    }
}

static void push_vertex(Pushed *s, const Solid *solid, Pose pose, int i) {
    Vec3 normal, p = pose_unapply(pose, vec3_load(s->x + 3 * (size_t)i));
    double d = solid_distance(solid, p, &normal), wanted = s->def->vertex_distance[i];
    if (d < TOO_CLOSE * wanted) {
        move_vertex(s, i, vec3_scale(wanted - d, quat_rotate(pose.turn, normal)));
    }
}

/* a triangle may cut an edge or a corner although its own corners are outside */
static void push_triangle(Pushed *s, const Solid *solid, Pose pose, const int place[3]) {
    Vec3 p[3], normal[3];
    double d[3], square = 0.0;
    for (int k = 0; k < 3; k++) {
        p[k] = pose_unapply(pose, vec3_load(s->x + 3 * (size_t)place[k]));
        d[k] = solid_distance(solid, p[k], &normal[k]);
    }
    SolidNearest nearest = solid_nearest_on_triangle(solid, p, d, normal);
    const double *weight = nearest.weight;
    for (int k = 0; k < 3; k++) {
        square += s->held[place[k]] ? 0.0 : weight[k] * weight[k];
    }
    double wanted = s->def->vertex_distance[place[0]];
    double missing = wanted - nearest.distance;
    for (int k = 0; k < 3 && missing > (1.0 - TOO_CLOSE) * wanted && square > 0.0; k++) {
        if (weight[k] > 0.0) {
            double share = missing * weight[k] / square;
            move_vertex(s, place[k], vec3_scale(share, quat_rotate(pose.turn, nearest.normal)));
        }
    }
}

static void push_round(Pushed *s, const Solid *solid, Pose pose) {
    const ContactDef *def = s->def;
    for (int i = 0; i < def->vertex_count; i++) {
        if (def->mass[i] > 0.0) {
            push_vertex(s, solid, pose, i);
        }
    }
    for (int c = 0; c < def->panel_count && solid->kind != SOLID_PLANE; c++) {
        const SurfacePanel *panel = &def->panels[c];
        for (int t = 0; t < panel->triangle_count; t++) {
            const int *corner = panel->triangles + 3 * (size_t)t;
            int place[3] = {panel->first + corner[0], panel->first + corner[1],
                            panel->first + corner[2]};
            push_triangle(s, solid, pose, place);
        }
    }
}

PushOut push_out(const ContactDef *def, const Pose *poses, const unsigned char *held, double *x) {
    Arena scratch = {0};
    size_t n = 3 * (size_t)def->vertex_count;
    double *before = arena_push(&scratch, double, n);
    memcpy(before, x, n * sizeof *x);
    Pushed s = {.def = def, .held = held, .x = x, .again = true};
    for (int round = 0; round < MOST_ROUNDS && s.again; round++) {
        s.again = false;
        for (int o = 0; o < def->obstacle_count; o++) {
            if (!def->obstacles[o].mesh) {
                push_round(&s, &def->obstacles[o].solid, poses[o]);
            }
        }
    }
    PushOut out = {.farthest = -1};
    for (int i = 0; i < def->vertex_count; i++) {
        Vec3 moved = vec3_sub(vec3_load(x + 3 * i), vec3_load(before + 3 * i));
        double way = vec3_length(moved);
        out.moved += way > 0.0;
        if (way > out.way) {
            out.way = way;
            out.farthest = i;
        }
    }
    arena_free(&scratch);
    return out;
}
