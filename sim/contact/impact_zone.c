#include "sim/contact/impact_zone.h"

#include <math.h>

#define SINGULAR 1e-14 /* of the largest moment of inertia: smaller ones are rounding */
#define UNLIKE 0.01    /* of the fastest: a programme's chord of a turn is no more off than this */
#define SWEEPS 12      /* of Jacobi rotations; 5 reach rounding */

typedef double Matrix[3][3];

/* makes a[p][q] zero by a rotation, which v collects in its columns */
static void rotate(Matrix a, Matrix v, int p, int q) {
    if (a[p][q] == 0.0) {
        return;
    }
    double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    double t = (theta >= 0.0 ? 1.0 : -1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
    double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
    for (int k = 0; k < 3; k++) {
        double kp = a[k][p], kq = a[k][q];
        a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
    }
    for (int k = 0; k < 3; k++) {
        double pk = a[p][k], qk = a[q][k], vp = v[k][p], vq = v[k][q];
        a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
        v[k][p] = c * vp - s * vq, v[k][q] = s * vp + c * vq;
    }
}

/* J^+ b of a symmetric J, by its eigenvectors */
static Vec3 pseudo_solve(Matrix j, Vec3 b) {
    Matrix v = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        rotate(j, v, 0, 1);
        rotate(j, v, 0, 2);
        rotate(j, v, 1, 2);
    }
    double most = fmax(fmax(j[0][0], j[1][1]), j[2][2]);
    Vec3 sum = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        Vec3 axis = {v[0][k], v[1][k], v[2][k]};
        if (j[k][k] > SINGULAR * most) {
            sum = vec3_axpy(sum, vec3_dot(axis, b) / j[k][k], axis);
        }
    }
    return sum;
}

/* The rigid motion of the vertices that count: those moved by a programme if `driven`, or all. */
typedef struct RigidMotion {
    Vec3 middle, velocity, turn;
} RigidMotion;

static double share_of(double mass, bool driven) { return isinf(mass) ? 1.0 : driven ? 0.0 : mass; }

static RigidMotion rigid_motion(int count, const double *mass, const Vec3 *x, const Vec3 *v,
                                bool driven) {
    RigidMotion m = {.turn = {0, 0, 0}};
    double total = 0.0;
    for (int i = 0; i < count; i++) {
        double w = share_of(mass[i], driven);
        total += w;
        m.middle =
            vec3_axpy(m.middle, w, vec3_sub(x[i], x[0])); /* small numbers: no cancellation */
        m.velocity = vec3_axpy(m.velocity, w, v[i]);
    }
    m.middle = vec3_axpy(x[0], 1.0 / total, m.middle);
    m.velocity = vec3_scale(1.0 / total, m.velocity);
    Vec3 moment = {0, 0, 0};
    Matrix j = {{0}};
    for (int i = 0; i < count; i++) {
        double w = share_of(mass[i], driven);
        Vec3 r = vec3_sub(x[i], m.middle), u = vec3_sub(v[i], m.velocity);
        double component[3] = {r.x, r.y, r.z}, square = vec3_dot(r, r);
        moment = vec3_axpy(moment, w, vec3_cross(r, u));
        for (int a = 0; a < 3; a++) {
            j[a][a] += w * square;
            for (int b = 0; b < 3; b++) {
                j[a][b] -= w * component[a] * component[b];
            }
        }
    }
    m.turn = pseudo_solve(j, moment);
    return m;
}

static Vec3 velocity_at(const RigidMotion *m, Vec3 x) {
    return vec3_add(m->velocity, vec3_cross(m->turn, vec3_sub(x, m->middle)));
}

bool impact_zone_settle(int count, const double *mass, const Vec3 *x, const Vec3 *lead, Vec3 *v) {
    bool driven = false;
    double fastest = 0.0, off = 0.0;
    for (int i = 0; i < count; i++) {
        driven = driven || isinf(mass[i]);
        fastest = isinf(mass[i]) ? fmax(fastest, vec3_length(v[i])) : fastest;
    }
    RigidMotion motion = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    if (!lead) {
        motion = rigid_motion(count, mass, x, v, driven);
    }
    for (int i = 0; i < count; i++) {
        Vec3 led = lead ? lead[i] : velocity_at(&motion, x[i]);
        off = isinf(mass[i]) ? fmax(off, vec3_length(vec3_sub(v[i], led))) : off;
    }
    if (off > UNLIKE * fastest) {
        return false;
    }
    for (int i = 0; i < count; i++) {
        Vec3 led = lead ? lead[i] : velocity_at(&motion, x[i]);
        v[i] = isinf(mass[i]) ? v[i] : led;
    }
    return true;
}

/* ---- which places are in which zone ---- */

ImpactZones impact_zones_create(int place_count, Arena *arena) {
    ImpactZones z = {.parent = arena_push(arena, int, place_count),
                     .next = arena_push(arena, int, place_count),
                     .members = arena_push(arena, int, place_count),
                     .solid = arena_push(arena, int, place_count)};
    for (int i = 0; i < place_count; i++) {
        z.parent[i] = -1;
    }
    return z;
}

void impact_zones_clear(ImpactZones *z) {
    for (int k = 0; k < z->member_count; k++) {
        z->parent[z->members[k]] = -1;
    }
    z->member_count = 0;
}

int impact_zones_root(ImpactZones *z, int place) {
    int root = z->parent[place];
    while (root >= 0 && z->parent[root] != root) {
        root = z->parent[root];
    }
    if (root >= 0) {
        z->parent[place] = root;
    }
    return root;
}

static void add(ImpactZones *z, int place) {
    z->parent[place] = z->next[place] = place;
    z->solid[place] = ZONE_FREE;
    z->members[z->member_count++] = place;
}

static int both(int a, int b) {
    return a == ZONE_FREE ? b : b == ZONE_FREE || a == b ? a : ZONE_TORN;
}

void impact_zones_join(ImpactZones *z, int count, const int *place, int solid) {
    for (int k = 0; k < count; k++) {
        if (z->parent[place[k]] < 0) {
            add(z, place[k]);
        }
        int a = impact_zones_root(z, place[0]), b = impact_zones_root(z, place[k]);
        if (a != b) { /* the rings open and close as one */
            int after = z->next[a];
            z->next[a] = z->next[b];
            z->next[b] = after;
            z->solid[a] = both(z->solid[a], z->solid[b]);
            z->parent[b] = a;
        }
        z->solid[a] = both(z->solid[a], solid);
    }
}

int impact_zones_count(ImpactZones *z) {
    int count = 0;
    for (int k = 0; k < z->member_count; k++) {
        count += z->parent[z->members[k]] == z->members[k];
    }
    return count;
}
