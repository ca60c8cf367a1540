#include "sim/contact/clamp.h"

#include <math.h>
#include <string.h>

#include "sim/contact/ccd.h"
#include "sim/contact/constants.h"

Clamp clamp_create(const ContactDef *def, Arena *arena) {
    Clamp clamp = {.near = candidates_create(def, arena)};
    int places = clamp.near.places.count;
    clamp.share = arena_push(arena, double, places);
    clamp.next = arena_push(arena, double, places);
    clamp.stamp = arena_push(arena, int, places);
    clamp.changed = arena_push(arena, unsigned char, places);
    clamp.yields = arena_push(arena, double, def->obstacle_count);
    clamp.next_yields = arena_push(arena, double, def->obstacle_count);
    clamp.obstacle_stamp = arena_push(arena, int, def->obstacle_count);
    return clamp;
}

double clamp_target(double dhat, double d0) {
    double core = CONTACT_CORE * dhat;
    if (d0 < core) {
        return CONTACT_INSIDE_CORE * d0;
    }
    return fmin(CONTACT_ENTRY * dhat, core + CONTACT_CORE_SHARE * (d0 - core));
}

static int corner_count(const Candidate *item) { return item->obstacle < 0 ? 4 : 3; }

/* the obstacle that takes part in a pair, or -1 */
static int obstacle_of(const Clamp *c, const Candidate *item) {
    int place = item->place[0] > item->place[3] ? item->place[0] : item->place[3];
    bool solid = item->obstacle >= 0, mesh = !solid && place >= c->near.def->vertex_count;
    return mesh ? places_obstacle(&c->near.places, place) : item->obstacle;
}

/* dx of the vertices of a mesh: straight to where a share of its motion leads */
static void aim_mesh(const Clamp *c, const ClampObstacles *o, int obstacle, double share,
                     const double *x, double *dx) {
    size_t first = 3 * (size_t)c->near.places.mesh_first[obstacle];
    size_t end = 3 * (size_t)c->near.places.mesh_first[obstacle + 1];
    double ahead = o->advance ? share * o->advance[obstacle] : 0.0;
    if (end == first) {
        return;
    }
    if (ahead <= 0.0) {
        memset(dx + first, 0, (end - first) * sizeof *dx);
        return;
    }
    places_pose(&c->near.def->obstacles[obstacle], o->to[obstacle], o->clocks[obstacle] + ahead,
                dx + first);
    for (size_t k = first; k < end; k++) {
        dx[k] -= x[k];
    }
}

/* the corners and, with `share`, their shortened motions; in the frame of the solid */
static void load(const Candidate *item, const ClampObstacles *o, const double *x, const double *dx,
                 const double *share, Vec3 y[4], Vec3 p[4]) {
    for (int k = 0; k < corner_count(item); k++) {
        size_t at = 3 * (size_t)item->place[k];
        y[k] = vec3_load(x + at);
        p[k] = dx ? vec3_load(dx + at) : vec3(0, 0, 0);
        p[k] = share ? vec3_scale(share[item->place[k]], p[k]) : p[k];
        if (item->obstacle < 0) {
            continue;
        }
        Vec3 end = vec3_add(y[k], p[k]);
        Pose pose = o->from[item->obstacle];
        y[k] = pose_unapply(pose, y[k]);
        p[k] = o->advance ? vec3_sub(pose_unapply(o->to[item->obstacle], end), y[k])
                          : quat_rotate(quat_inverse(pose.turn), p[k]);
    }
}

/* turn of the frame in which the motion of a pair with an obstacle ends */
static Quat end_turn(const ClampObstacles *o, int obstacle) {
    return o->advance ? o->to[obstacle].turn : o->from[obstacle].turn;
}

static double distance_of(const Clamp *c, const Candidate *item, const ClampObstacles *o,
                          const double *x) {
    Vec3 y[4], p[4], normal;
    load(item, o, x, NULL, NULL, y, p);
    if (item->obstacle >= 0) {
        double w[3];
        int feature;
        return ccd_solid_distance(&c->near.def->obstacles[item->obstacle].solid, y, &normal, w,
                                  &feature);
    }
    return pair_between(item->kind, y).distance;
}

/* candidates of this motion that could come too near, with their targets */
static void find(Clamp *c, const ClampObstacles *o, const double *x, const double *dx) {
    candidates_find(&c->near, o->from, o->advance ? o->to : o->from, x, dx);
    c->item_count = 0;
    if (c->item_room < c->near.count) {
        c->item_room = c->near.room;
        c->items = arena_push(c->near.arena, Candidate, c->item_room);
    }
    for (int i = 0; i < c->near.count; i++) {
        Candidate item = c->near.items[i];
        Vec3 y[4], p[4];
        double motion[4] = {0}, d0 = distance_of(c, &item, o, x);
        load(&item, o, x, dx, NULL, y, p);
        for (int k = 0; k < corner_count(&item); k++) {
            motion[k] = vec3_length(p[k]);
        }
        int first = item.obstacle >= 0 ? 3 : item.kind == PAIR_FACE ? 1 : 2;
        double most[2] = {0.0, 0.0};
        for (int k = 0; k < 4; k++) {
            most[k >= first] = fmax(most[k >= first], motion[k]);
        }
        item.target = clamp_target(item.dhat, d0);
        if (o->advance && obstacle_of(c, &item) >= 0 && d0 < CONTACT_CORE * item.dhat) {
            item.target = CONTACT_PINCHED * d0;
        }
        if (d0 > 0.0 && d0 - item.target <= most[0] + most[1]) {
            c->items[c->item_count++] = item;
        }
    }
}

static double ccd(const Clamp *c, const Candidate *item, const ClampObstacles *o, const double *x,
                  const double *dx, const double *share, Vec3 *normal) {
    Vec3 y[4], p[4];
    load(item, o, x, dx, share, y, p);
    if (item->obstacle < 0) {
        return ccd_pair(item->kind, y, p, item->target, normal);
    }
    double t = ccd_solid(&c->near.def->obstacles[item->obstacle].solid, y, p, item->target, normal);
    *normal = quat_rotate(end_turn(o, item->obstacle), *normal);
    return t;
}

/* ---- stage 1 ---- */

/* motion along n of the nearest point of one side of a pair, where the search stopped */
static double foot_motion(const Candidate *item, const Vec3 y[4], const Vec3 p[4], double t,
                          int begin, int end, const double along[4]) {
    Vec3 stopped[4];
    for (int k = 0; k < 4; k++) {
        stopped[k] = vec3_axpy(y[k], t, p[k]);
    }
    Pair pair = pair_between(item->kind, stopped);
    double sum = 0.0;
    for (int k = begin; k < end; k++) {
        sum += fabs(pair.weight[k]) * along[k];
    }
    return sum;
}

/* takes the approach along n out of the motion of a blocked pair; true when something changed */
static bool project(Clamp *c, const Candidate *item, const ClampObstacles *o,
                    const unsigned char *held, const double *x, double *dx, double t, Vec3 n,
                    int round) {
    Vec3 y[4], p[4];
    load(item, o, x, dx, NULL, y, p);
    int count = corner_count(item);
    int first = item->obstacle >= 0 ? 3 : item->kind == PAIR_FACE ? 1 : 2;
    double mean[2] = {0.0, 0.0}, along[4];
    bool fixed[2] = {true, true}, any = false;
    for (int k = 0; k < count; k++) {
        int side = k >= first;
        Vec3 moved = item->obstacle < 0 ? p[k] : quat_rotate(end_turn(o, item->obstacle), p[k]);
        along[k] = vec3_dot(n, moved);
        mean[side] += along[k] / (side ? count - first : first);
        fixed[side] = fixed[side] && held[item->place[k]];
    }
    double common = 0.5 * (mean[0] + mean[1]);
    common = fixed[0] ? mean[0] : fixed[1] ? mean[1] : common;
    common = item->obstacle >= 0 ? 0.0 : common;
    if (item->obstacle < 0 && o->advance && obstacle_of(c, item) >= 0) { /* the mesh may turn */
        bool mesh_first = item->place[0] >= c->near.def->vertex_count;
        common = foot_motion(item, y, p, t, mesh_first ? 0 : first, mesh_first ? first : 4, along);
    }
    for (int k = 0; k < count; k++) {
        double wrong = along[k] - common;
        int place = item->place[k];
        if (held[place] || (k < first ? wrong >= 0.0 : wrong <= 0.0)) {
            continue;
        }
        double out = fmax(1.0 - t, CONTACT_PROJECT_LEAST) * wrong;
        double *d = dx + 3 * (size_t)place;
        vec3_store(d, vec3_axpy(vec3_load(d), -out, n));
        c->stamp[place] = round;
        c->changed[place] = 1;
        any = true;
    }
    return any;
}

static bool is_fresh(const Clamp *c, const Candidate *item, int round) {
    for (int k = 0; k < corner_count(item); k++) {
        if (c->stamp[item->place[k]] >= round - 1) {
            return true;
        }
    }
    int obstacle = obstacle_of(c, item);
    return obstacle >= 0 && c->obstacle_stamp[obstacle] >= round - 1;
}

/* true when some pair was blocked */
static bool project_all(Clamp *c, const ClampObstacles *o, const unsigned char *held,
                        const double *x, double *dx) {
    bool blocked = false;
    memset(c->stamp, 0, (size_t)c->near.places.count * sizeof *c->stamp);
    for (int i = 0; i < c->near.def->obstacle_count; i++) {
        c->obstacle_stamp[i] = -1;
    }
    for (int round = 1; round <= CONTACT_PROJECT_ROUNDS; round++) {
        bool again = false;
        for (int i = 0; i < c->item_count; i++) {
            const Candidate *item = &c->items[i];
            Vec3 n = {0, 0, 0};
            if (!is_fresh(c, item, round)) {
                continue;
            }
            double t = ccd(c, item, o, x, dx, NULL, &n);
            if (t < 1.0) {
                blocked = true;
                again = project(c, item, o, held, x, dx, t, n, round) || again;
            }
        }
        if (!again) {
            break;
        }
    }
    return blocked;
}

/* ---- stage 2 ---- */

/* lowers next shares of the vertices of a blocked pair; true when it was blocked */
static bool shorten(Clamp *c, const Candidate *item, const ClampObstacles *o, const double *x,
                    const double *dx, int round) {
    Vec3 n = {0, 0, 0};
    double t = ccd(c, item, o, x, dx, c->share, &n);
    if (t >= 1.0) {
        return false;
    }
    t = round > CONTACT_STOP_AFTER ? 0.0 : round > CONTACT_HALVE_AFTER ? 0.5 * t : t;
    for (int k = 0; k < corner_count(item); k++) {
        int place = item->place[k];
        if (place < c->near.def->vertex_count) {
            c->next[place] = fmin(c->next[place], t * c->share[place]);
        }
    }
    int obstacle = obstacle_of(c, item);
    if (obstacle >= 0) {
        double *yields = &c->next_yields[obstacle];
        *yields = fmin(*yields, t * c->yields[obstacle]);
    }
    return true;
}

/* obstacles keep the shares of their motions that this round left; true when one waits */
static bool yield(Clamp *c, const ClampObstacles *o, const double *x, double *dx, int round) {
    bool waits = false;
    for (int i = 0; o->advance && i < c->near.def->obstacle_count; i++) {
        if (c->next_yields[i] < c->yields[i]) {
            double ahead = c->next_yields[i] * o->advance[i];
            o->to[i] = ahead > 0.0 ? contact_pose(&c->near.def->obstacles[i], o->clocks[i] + ahead)
                                   : o->from[i];
            c->obstacle_stamp[i] = round;
            aim_mesh(c, o, i, c->next_yields[i], x, dx);
            waits = waits || o->advance[i] > 0.0;
        }
        c->yields[i] = c->next_yields[i];
    }
    return waits;
}

/* true when an obstacle keeps only a share of its motion; *smallest: share of a vertex */
static bool shorten_all(Clamp *c, const ClampObstacles *o, const double *x, double *dx,
                        bool at_once, double *smallest) {
    int n = c->near.places.count;
    for (int i = 0; i < n; i++) {
        c->share[i] = c->next[i] = 1.0;
        c->stamp[i] = 0;
    }
    for (int i = 0; i < c->near.def->obstacle_count; i++) {
        c->yields[i] = c->next_yields[i] = 1.0;
        c->obstacle_stamp[i] = 0;
    }
    bool again = true, waits = false;
    int skipped = at_once ? CONTACT_STOP_AFTER : 0;
    for (int round = 1; again; round++) {
        again = false;
        for (int i = 0; i < c->item_count; i++) {
            const Candidate *item = &c->items[i];
            if (is_fresh(c, item, round)) {
                again = shorten(c, item, o, x, dx, round + skipped) || again;
            }
        }
        for (int i = 0; i < n; i++) {
            c->stamp[i] = c->next[i] < c->share[i] ? round : c->stamp[i];
            c->share[i] = c->next[i];
        }
        waits = yield(c, o, x, dx, round) || waits;
    }
    for (int i = 0; o->advance && i < c->near.def->obstacle_count; i++) {
        o->advance[i] *= c->yields[i];
    }
    *smallest = 1.0;
    for (int i = 0; i < n; i++) {
        if (c->share[i] < 1.0) {
            *smallest = fmin(*smallest, c->share[i]);
            c->changed[i] = 1;
            vec3_store(dx + 3 * (size_t)i, vec3_scale(c->share[i], vec3_load(dx + 3 * (size_t)i)));
        }
    }
    return waits;
}

double clamp_motion(Clamp *c, const ClampObstacles *o, const unsigned char *held, const double *x,
                    double *dx) {
    int n = c->near.places.count;
    memset(c->changed, 0, (size_t)n);
    for (int i = 0; i < c->near.def->obstacle_count; i++) {
        aim_mesh(c, o, i, 1.0, x, dx);
    }
    for (int k = 0; k < 3 * n; k++) {
        if (!isfinite(dx[k])) {
            memset(dx, 0, 3 * (size_t)n * sizeof *dx);
            for (int i = 0; o->advance && i < c->near.def->obstacle_count; i++) {
                o->advance[i] = 0.0;
                o->to[i] = o->from[i];
            }
            return 0.0;
        }
    }
    for (int search = 0; search < CONTACT_PROJECT_SEARCHES; search++) {
        find(c, o, x, dx);
        if (!project_all(c, o, held, x, dx)) {
            return 1.0; /* all pairs of this motion are proven */
        }
    }
    /* what waits goes another way than the list was made for */
    bool waits = true;
    double smallest = 1.0;
    for (int search = 0; waits; search++) {
        find(c, o, x, dx);
        waits = shorten_all(c, o, x, dx, search >= CONTACT_PROJECT_SEARCHES, &smallest);
    }
    return smallest;
}
