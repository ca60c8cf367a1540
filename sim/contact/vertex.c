/* vertex.c: the contact law for the implicit road, one vertex at a time. */
#include <math.h>
#include <string.h>

#include "sim/contact/constants.h"
#include "sim/contact/contact.h"

/* adds s (I - a a') - shared by normal (s < 0: only a a') and tangential stiffness */
static void add_outer(double *block, double s, const double a[3]) {
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            block[3 * r + c] += s * a[r] * a[c];
        }
    }
}

static void add_friction(double k, double limit, Vec3 normal, Vec3 t, double *force, double *block,
                         double *next) {
    double kt = CONTACT_BRISTLE_SHARE * k, pull = kt * vec3_length(t);
    bool slips = pull > limit;
    double share = slips ? limit / pull : 1.0; /* secant stiffness: positive, never too soft */
    Vec3 f = vec3_scale(-kt * share, t);
    if (force) {
        force[0] += f.x, force[1] += f.y, force[2] += f.z;
    }
    if (block) {
        double n[3] = {normal.x, normal.y, normal.z};
        for (int c = 0; c < 3; c++) {
            block[4 * c] += kt * share;
        }
        add_outer(block, -kt * share, n);
    }
    if (next) {
        vec3_store(next, vec3_scale(share, t));
    }
}

void contact_at_vertex(const ContactDef *def, const Pose *poses, int vertex, Vec3 x, Vec3 moved,
                       const double *bristles, double *force, double *block,
                       double *next_bristles) {
    double dt = def->reference_step, k = CONTACT_STIFFNESS * def->mass[vertex] / (dt * dt);
    for (int o = 0; o < def->obstacle_count; o++) {
        const ContactObstacle *obstacle = &def->obstacles[o];
        Vec3 local;
        double push, curvature;
        double distance = solid_distance(&obstacle->solid, pose_unapply(poses[o], x), &local);
        if (next_bristles) {
            memset(next_bristles + 3 * o, 0, 3 * sizeof(double));
        }
        if (distance >= def->vertex_distance[vertex]) {
            continue;
        }
        Vec3 normal = quat_rotate(poses[o].turn, local);
        double n[3] = {normal.x, normal.y, normal.z};
        contact_law(distance, def->vertex_distance[vertex], k, &push, &curvature);
        for (int c = 0; c < 3 && force; c++) {
            force[c] += push * n[c];
        }
        if (block) {
            add_outer(block, curvature, n);
        }
        double mu = obstacle->friction >= 0.0 ? obstacle->friction : def->friction[vertex];
        Vec3 t = vec3_add(vec3_load(bristles + 3 * o), moved);
        t = vec3_axpy(t, -vec3_dot(t, normal), normal);
        add_friction(k, mu * push, normal, t, force, block,
                     next_bristles ? next_bristles + 3 * o : NULL);
    }
}
