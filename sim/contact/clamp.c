#include "sim/contact/clamp.h"

#include <math.h>
#include <string.h>

#include "sim/contact/ccd.h"
#include "sim/contact/constants.h"

Clamp clamp_create(const ContactDef *def, Arena *arena) {
    Clamp clamp = {.near = candidates_create(def, arena)};
    clamp.share = arena_push(arena, double, def->vertex_count);
    clamp.next = arena_push(arena, double, def->vertex_count);
    clamp.stamp = arena_push(arena, int, def->vertex_count);
    clamp.changed = arena_push(arena, unsigned char, def->vertex_count);
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

/* the corners and, with `share`, their shortened motions; in the frame of the solid */
static void load(const Candidate *item, const Pose *poses, const double *x, const double *dx,
                 const double *share, Vec3 y[4], Vec3 p[4]) {
    for (int k = 0; k < corner_count(item); k++) {
        size_t at = 3 * (size_t)item->place[k];
        y[k] = vec3_load(x + at);
        p[k] = dx ? vec3_load(dx + at) : vec3(0, 0, 0);
        p[k] = share ? vec3_scale(share[item->place[k]], p[k]) : p[k];
        if (item->obstacle >= 0) {
            Pose pose = poses[item->obstacle];
            y[k] = pose_unapply(pose, y[k]);
            p[k] = quat_rotate(quat_inverse(pose.turn), p[k]);
        }
    }
}

static double distance_of(const Clamp *c, const Candidate *item, const Pose *poses,
                          const double *x) {
    Vec3 y[4], p[4], normal;
    load(item, poses, x, NULL, NULL, y, p);
    if (item->obstacle >= 0) {
        double w[3];
        int feature;
        return ccd_solid_distance(&c->near.def->obstacles[item->obstacle].solid, y, &normal, w,
                                  &feature);
    }
    Points points = {&y[0].x};
    Pair pair = {.kind = item->kind, .place = {0, 1, 2, 3}};
    pair_evaluate(&points, &pair);
    return pair.distance;
}

/* candidates of this motion that could come too near, with their targets */
static void find(Clamp *c, const Pose *poses, const double *x, const double *dx) {
    candidates_find(&c->near, poses, x, dx);
    int kept = 0;
    for (int i = 0; i < c->near.count; i++) {
        Candidate item = c->near.items[i];
        double motion[4] = {0}, d0 = distance_of(c, &item, poses, x);
        for (int k = 0; k < corner_count(&item); k++) {
            motion[k] = vec3_length(vec3_load(dx + 3 * (size_t)item.place[k]));
        }
        int first = item.obstacle >= 0 ? 3 : item.kind == PAIR_FACE ? 1 : 2;
        double most[2] = {0.0, 0.0};
        for (int k = 0; k < 4; k++) {
            most[k >= first] = fmax(most[k >= first], motion[k]);
        }
        item.target = clamp_target(item.dhat, d0);
        if (d0 > 0.0 && d0 - item.target <= most[0] + most[1]) {
            c->near.items[kept++] = item;
        }
    }
    c->near.count = kept;
}

static double ccd(const Clamp *c, const Candidate *item, const Pose *poses, const double *x,
                  const double *dx, const double *share, Vec3 *normal) {
    Vec3 y[4], p[4];
    load(item, poses, x, dx, share, y, p);
    if (item->obstacle < 0) {
        return ccd_pair(item->kind, y, p, item->target, normal);
    }
    double t = ccd_solid(&c->near.def->obstacles[item->obstacle].solid, y, p, item->target, normal);
    *normal = quat_rotate(poses[item->obstacle].turn, *normal);
    return t;
}

/* ---- stage 1 ---- */

/* takes the approach along n out of the motion of a blocked pair; true when something changed */
static bool project(Clamp *c, const Candidate *item, const unsigned char *held, double *dx,
                    double t, Vec3 n, int round) {
    int count = corner_count(item);
    int first = item->obstacle >= 0 ? 3 : item->kind == PAIR_FACE ? 1 : 2;
    double mean[2] = {0.0, 0.0}, along[4];
    bool fixed[2] = {true, true}, any = false;
    for (int k = 0; k < count; k++) {
        int side = k >= first;
        along[k] = vec3_dot(n, vec3_load(dx + 3 * (size_t)item->place[k]));
        mean[side] += along[k] / (side ? count - first : first);
        fixed[side] = fixed[side] && held[item->place[k]];
    }
    double common = 0.5 * (mean[0] + mean[1]);
    common = fixed[0] ? mean[0] : fixed[1] ? mean[1] : common;
    common = item->obstacle >= 0 ? 0.0 : common;
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
    return false;
}

/* true when some pair was blocked */
static bool project_all(Clamp *c, const Pose *poses, const unsigned char *held, const double *x,
                        double *dx, ClampReport *report) {
    bool blocked = false;
    memset(c->stamp, 0, (size_t)c->near.def->vertex_count * sizeof *c->stamp);
    for (int round = 1; round <= CONTACT_PROJECT_ROUNDS; round++) {
        bool again = false;
        for (int i = 0; i < c->near.count; i++) {
            const Candidate *item = &c->near.items[i];
            Vec3 n = {0, 0, 0};
            if (!is_fresh(c, item, round)) {
                continue;
            }
            double t = ccd(c, item, poses, x, dx, NULL, &n);
            if (t < 1.0) {
                blocked = true;
                report->projected++;
                again = project(c, item, held, dx, t, n, round) || again;
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
static bool shorten(Clamp *c, const Candidate *item, const Pose *poses, const double *x,
                    const double *dx, int round) {
    Vec3 n = {0, 0, 0};
    double t = ccd(c, item, poses, x, dx, c->share, &n);
    if (t >= 1.0) {
        return false;
    }
    t = round > CONTACT_STOP_AFTER ? 0.0 : round > CONTACT_HALVE_AFTER ? 0.5 * t : t;
    for (int k = 0; k < corner_count(item); k++) {
        int place = item->place[k];
        c->next[place] = fmin(c->next[place], t * c->share[place]);
    }
    return true;
}

static void shorten_all(Clamp *c, const Pose *poses, const double *x, double *dx,
                        ClampReport *report) {
    int n = c->near.def->vertex_count;
    for (int i = 0; i < n; i++) {
        c->share[i] = c->next[i] = 1.0;
        c->stamp[i] = 0;
    }
    bool again = true;
    for (int round = 1; again; round++) {
        again = false;
        for (int i = 0; i < c->near.count; i++) {
            const Candidate *item = &c->near.items[i];
            if (is_fresh(c, item, round)) {
                again = shorten(c, item, poses, x, dx, round) || again;
            }
        }
        for (int i = 0; i < n; i++) {
            c->stamp[i] = c->next[i] < c->share[i] ? round : c->stamp[i];
            c->share[i] = c->next[i];
        }
    }
    report->smallest_share = 1.0;
    for (int i = 0; i < n; i++) {
        if (c->share[i] < 1.0) {
            report->smallest_share = fmin(report->smallest_share, c->share[i]);
            report->shortened++;
            c->changed[i] = 1;
            vec3_store(dx + 3 * (size_t)i, vec3_scale(c->share[i], vec3_load(dx + 3 * (size_t)i)));
        }
    }
}

ClampReport clamp_motion(Clamp *c, const Pose *poses, const unsigned char *held, const double *x,
                         double *dx) {
    ClampReport report = {.smallest_share = 1.0};
    int n = c->near.def->vertex_count;
    memset(c->changed, 0, (size_t)n);
    for (int k = 0; k < 3 * n; k++) {
        if (!isfinite(dx[k])) {
            memset(dx, 0, 3 * (size_t)n * sizeof *dx);
            report.smallest_share = 0.0;
            return report;
        }
    }
    for (int search = 0; search < CONTACT_PROJECT_SEARCHES; search++) {
        find(c, poses, x, dx);
        if (!project_all(c, poses, held, x, dx, &report)) {
            return report; /* all pairs of this motion are proven */
        }
    }
    find(c, poses, x, dx);
    shorten_all(c, poses, x, dx, &report);
    return report;
}
