#include "tests/support/rig.h"

#include <string.h>

#include "tests/support/check.h"
#include "tests/support/cloths.h"

static Vec3 rig_velocity(const Rig *r, int i) {
    return vec3(r->lanes.v[0][i], r->lanes.v[1][i], r->lanes.v[2][i]);
}

double rig_fastest(void *owner) {
    const Rig *r = owner;
    double most = 0.0;
    for (int i = 0; i < rig_count(r); i++) {
        most = fmax(most, vec3_length(rig_velocity(r, i)));
    }
    return most;
}

Vec3 rig_place(const Rig *r, int i) {
    return vec3(r->lanes.x[0][i], r->lanes.x[1][i], r->lanes.x[2][i]);
}

static double *const *rig_mark(void *owner, double ahead) {
    Rig *r = owner;
    for (int i = 0; i < rig_count(r); i++) {
        for (int a = 0; a < 3; a++) {
            r->marked[a][i] = r->lanes.x[a][i] + ahead * r->lanes.v[a][i];
        }
    }
    r->ahead += ahead > 0.0;
    return r->marked;
}

/* largest difference of two nodes next to each other, in u or in v */
static double rig_most(const Rig *r, Vec3 (*value)(const Rig *r, int i)) {
    const SurfacePanel *panel = &r->def.panels[0];
    double most = 0.0;
    for (int i = 0; i < rig_count(r); i++) {
        int column = i % panel->nu, right = column + 1 < panel->nu ? i + 1 : i - column;
        int next[2] = {panel->wrap || column + 1 < panel->nu ? right : i, i + panel->nu};
        for (int k = 0; k < 2; k++) {
            if (next[k] < rig_count(r)) {
                most = fmax(most, vec3_length(vec3_sub(value(r, i), value(r, next[k]))));
            }
        }
    }
    return most;
}

static Vec3 rig_moved(const Rig *r, int i) {
    return vec3_sub(rig_place(r, i), vec3(r->marked[0][i], r->marked[1][i], r->marked[2][i]));
}

static double rig_spread(void *owner) { return rig_most(owner, rig_moved); }

static double rig_box(const Rig *r, Vec3 (*value)(const Rig *r, int i)) {
    Box box = box_empty();
    for (int i = 0; i < rig_count(r); i++) {
        box_add(&box, value(r, i));
    }
    return vec3_length(vec3_sub(box.high, box.low));
}

static double rig_moved_mutually(void *owner) { return rig_box(owner, rig_moved); }

double rig_mutual(const Rig *r) { return rig_box(r, rig_velocity); }

double rig_relative(void *owner) { return rig_most(owner, rig_velocity); }

void rig_make(Rig *r, int nodes, bool sleeve, Vec3 centre) {
    memset(r, 0, sizeof *r);
    Fabric fabric = cloths_fabric(0.15, 1000.0, 0.3, 1e-5, 0.0);
    r->bench.cloth = sleeve ? cloths_sleeve(0.24 / 6.2831853, 0.04, 48, 13, true, fabric)
                            : cloths_rectangle(0.24, 0.24, nodes, nodes, fabric);
    r->bench.scene = cloths_scene(&r->bench.cloth);
    r->bench.scene.solver.self_contact = true;
    bench_build(&r->bench, 0);
    Arena *arena = &r->bench.arena;
    r->ball = (ContactObstacle){.solid = {SOLID_SPHERE, {0.02, 0.02, 0.02}, 0.02},
                                .start = pose_identity(),
                                .motion = &r->rest};
    r->ball.start.shift = centre;
    r->def = r->bench.system.contact;
    r->def.obstacle_count = 1;
    r->def.obstacles = &r->ball;
    r->lanes = lanes_create(rig_count(r), arena);
    r->slot = arena_push(arena, int, rig_count(r));
    r->held = arena_push(arena, unsigned char, rig_count(r));
    for (int a = 0; a < 3; a++) {
        r->marked[a] = arena_push(arena, double, rig_count(r));
    }
    r->memory = (ContactMemory){.poses = arena_push(arena, Pose, 1),
                                .clocks = arena_push(arena, double, 1),
                                .bristles = arena_push(arena, double, 3 * rig_count(r)),
                                .pairs = arena_push(arena, PairMemory, 1)};
    r->memory.poses[0] = r->ball.start;
    for (int i = 0; i < rig_count(r); i++) {
        r->slot[i] = i;
        for (int a = 0; a < 3; a++) {
            r->lanes.x[a][i] = r->def.start[3 * i + a];
        }
    }
    r->contact = contact_create(&r->def, arena);
}

bool rig_begin(Rig *r) {
    ContactMotion motion = {rig_fastest,  rig_mark,     rig_spread, rig_moved_mutually,
                            rig_relative, !r->unframed, r};
    contact_begin(r->contact, (ContactView){&r->lanes, r->slot, r->held, 1.0, motion, r->continues},
                  &r->memory, RIG_STEP);
    return r->contact->quiet.holds;
}

double rig_apart(Rig *r) {
    const Surface *s = &r->contact->surface;
    double least = INFINITY;
    contact_gather(r->contact);
    Points x = contact_positions(r->contact);
    for (int v = 0; v < rig_count(r); v++) {
        least = fmin(least, vec3_length(vec3_sub(rig_place(r, v), r->ball.start.shift)) - 0.02);
        for (int t = 0; t < s->triangle_count; t++) {
            const int *c = s->triangles + 3 * (size_t)t;
            if (v != c[0] && v != c[1] && v != c[2]) {
                Pair pair = {.kind = PAIR_FACE, .place = {v, c[0], c[1], c[2]}};
                pair_evaluate(&x, &pair);
                least = fmin(least, pair.distance);
            }
        }
    }
    for (int a = 0; a < s->edge_count; a++) {
        for (int b = a + 1; b < s->edge_count; b++) {
            const int *p = s->edges + 2 * (size_t)a, *q = s->edges + 2 * (size_t)b;
            if (p[0] != q[0] && p[0] != q[1] && p[1] != q[0] && p[1] != q[1]) {
                Pair pair = {.kind = PAIR_EDGES, .place = {p[0], p[1], q[0], q[1]}};
                pair_evaluate(&x, &pair);
                least = fmin(least, pair.distance);
            }
        }
    }
    return least - r->def.distance;
}

/* [m] the most that any two nodes have moved against each other */
static double farthest_moved(const Rig *r) {
    double square = 0.0;
    for (int i = 0; i < rig_count(r); i++) {
        for (int j = 0; j < i; j++) {
            Vec3 d = vec3_sub(rig_moved(r, i), rig_moved(r, j));
            square = fmax(square, vec3_dot(d, d));
        }
    }
    return sqrt(square);
}

/* velocities that lead to the places of the programme a step after `time` */
static void set_out(Rig *r, RigProgramme *programme, double time) {
    for (int i = 0; i < rig_count(r); i++) {
        Vec3 v = vec3_sub(programme(r, i, time + RIG_STEP), programme(r, i, time));
        r->lanes.v[0][i] = v.x / RIG_STEP, r->lanes.v[1][i] = v.y / RIG_STEP;
        r->lanes.v[2][i] = v.z / RIG_STEP;
    }
}

double rig_play(Rig *r, RigProgramme *programme, double seconds, int checks, double *least) {
    double time = 0.0;
    *least = INFINITY;
    for (int i = 0; i < rig_count(r); i++) {
        Vec3 p = programme(r, i, 0.0);
        r->lanes.x[0][i] = p.x, r->lanes.x[1][i] = p.y, r->lanes.x[2][i] = p.z;
    }
    set_out(r, programme, 0.0);
    assert_true(rig_begin(r));
    for (int step = 0; time < seconds; step++, time = step * RIG_STEP) {
        set_out(r, programme, time);
        contact_forces(r->contact, RIG_STEP, 1.0, time + RIG_STEP);
        contact_clear(r->contact, vec3(0, 0, 0));
        contact_guard(r->contact, RIG_STEP);
        if (!r->contact->quiet.holds) {
            break;
        }
        for (int i = 0; i < rig_count(r); i++) {
            Vec3 p = programme(r, i, time + RIG_STEP);
            r->lanes.x[0][i] = p.x, r->lanes.x[1][i] = p.y, r->lanes.x[2][i] = p.z;
        }
        double most = 2.0 * rig_fastest(r);
        ContactSpeeds speeds = {rig_fastest(r), rig_mutual(r), rig_relative(r)};
        if (r->unframed) {
            speeds.mutual = speeds.relative = most;
        }
        contact_drifted(r->contact, &speeds, RIG_STEP);
        CHECK_AT_MOST(rig_spread(r) - r->contact->quiet.near_path, 1e-12);
        if (r->def.obstacle_count == 0 && step % 10 == 0) {
            CHECK_AT_MOST(farthest_moved(r) - r->contact->quiet.far_path, 1e-12);
        }
        assert_false(contact_statistics(r->contact)->rejected);
        *least =
            step % (int)(seconds / RIG_STEP / checks) == 0 ? fmin(*least, rig_apart(r)) : *least;
    }
    *least = fmin(*least, rig_apart(r));
    return time;
}
