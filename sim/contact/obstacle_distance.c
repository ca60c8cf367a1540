/* obstacle_distance.c: how far a vertex or a triangle is from a convex solid.
 *
 * Vertices meet the signed distance; sides and faces of triangles meet edges, corners and curved sides where
 * their nearest point lies inside. Each near triangle has a plane that parts it from the whole solid. */
#include <math.h>
#include <string.h>

#include "sim/contact/engine.h"

static bool vec3_same(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

static Vec3 frame_apply(const Frame *f, Vec3 a) {
    Vec3 sum = vec3_axpy(vec3_scale(a.x, f->axis[0]), a.y, f->axis[1]);
    return vec3_axpy(sum, a.z, f->axis[2]);
}

static size_t corner_index(const Contact *c, int place, int obstacle) {
    return (size_t)place * (size_t)c->def->obstacle_count + (size_t)obstacle;
}

static void find_distance(const Contact *c, const Points *x, int place, int obstacle,
                          VertexDistance *out) {
    const Frame *f = &c->frames[obstacle];
    Vec3 d = vec3_sub(point_at(x, place), f->origin);
    out->stamp = c->lists.stamp;
    out->place = vec3(vec3_dot(f->axis[0], d), vec3_dot(f->axis[1], d), vec3_dot(f->axis[2], d));
    out->distance = solid_distance(&c->def->obstacles[obstacle].solid, out->place, &out->normal);
}

/* Of corner k of a triangle: known, or found by this thread for a triangle before it, or found into `own`
 * where an earlier corner has its place; what is known is left to other threads to read. */
static const VertexDistance *corner_distance(const Contact *c, const Points *x, const Touch *touch,
                                             int k, Corners *corners,
                                             const VertexDistance *const before[],
                                             VertexDistance *own) {
    size_t index = corner_index(c, touch->place[k], touch->obstacle);
    if (c->touches.known[index].stamp == c->lists.stamp) {
        return &c->touches.known[index];
    }
    Corner *corner = &corners->one[index % CORNERS];
    if (corner->next_index == index + 1) {
        return &corner->found;
    }
    bool taken = (k > 0 && before[0] == &corner->found) || (k > 1 && before[1] == &corner->found);
    VertexDistance *out = taken ? own : &corner->found;
    corner->next_index = taken ? corner->next_index : index + 1;
    find_distance(c, x, touch->place[k], touch->obstacle, out);
    return out;
}

/* what an evaluation found: nearest point and normal in the frame of the obstacle */
static void set_touch(const Contact *c, Touch *touch, double distance, Vec3 nearest, Vec3 normal) {
    const Frame *f = &c->frames[touch->obstacle];
    touch->distance = distance;
    touch->normal = frame_apply(f, normal);
    touch->point = vec3_add(f->origin, frame_apply(f, vec3_axpy(nearest, -distance, normal)));
    touch->level = vec3_dot(touch->normal, touch->point);
}

/* ... and known to triangles from now on */
void obstacle_evaluate_vertex(Contact *c, const Points *x, Touch *touch) {
    VertexDistance *v = &c->touches.known[corner_index(c, touch->place[0], touch->obstacle)];
    if (v->stamp != c->lists.stamp) {
        find_distance(c, x, touch->place[0], touch->obstacle, v);
    }
    set_touch(c, touch, v->distance, v->place, v->normal);
}

/* side k of a triangle, if it is near; corners in the frame of the obstacle */
static bool set_side(const Contact *c, const Touch *touch, const Vec3 place[3], int k,
                     const SolidSide *found) {
    int side = contact_side(c, touch, k), next = (k + 1) % 3;
    double dhat = c->def->vertex_distance[touch->place[0]];
    if (side < 0 || found->distance >= dhat) {
        return false;
    }
    const Frame *f = &c->frames[touch->obstacle];
    SideTouch *out = &c->touches.sides[side];
    out->at = touch->place[k] < touch->place[next] ? found->at : 1.0 - found->at;
    out->distance = found->distance;
    out->share = contact_share_inside(found->lower, dhat);
    out->normal = frame_apply(f, found->normal);
    if (c->def->obstacles[touch->obstacle].moves) {
        Vec3 at = vec3_axpy(place[k], found->at, vec3_sub(place[next], place[k]));
        Vec3 point = vec3_axpy(at, -found->distance, found->normal);
        out->point = vec3_add(f->origin, frame_apply(f, point));
    }
    return true;
}

/* the exact nearest points */
static void set_nearest(const Contact *c, Touch *touch, const Vec3 place[3],
                        const SolidNearest *nearest) {
    unsigned sides = 0;
    for (int k = 0; k < 3; k++) {
        sides |= set_side(c, touch, place, k, &nearest->side[k]) ? 1U << k : 0U;
    }
    obstacle_forget_sides(c, touch, touch->sides & ~sides);
    touch->sides = sides;
    touch->share = contact_share_inside(nearest->lower, c->def->vertex_distance[touch->place[0]]);
    touch->feature = (short)nearest->feature;
    memcpy(touch->weight, nearest->weight, sizeof touch->weight);
    set_touch(c, touch, nearest->distance, nearest->point, nearest->normal);
}

void obstacle_finish(const Contact *c, TouchBatch *batch) {
    int count = box_batch_solve(&batch->boxes);
    for (int k = 0; k < count; k++) {
        Vec3 place[3];
        box_batch_corners(&batch->boxes, k, place);
        set_nearest(c, batch->touches[k], place, &batch->boxes.nearest[k]);
    }
}

static void search_triangle(const Contact *c, TouchBatch *batch, Touch *touch,
                            const VertexDistance *const v[3]) {
    const Solid *solid = &c->def->obstacles[touch->obstacle].solid;
    if (solid->kind == SOLID_BOX) {
        batch->touches[batch->boxes.count] = touch;
        for (int k = 0; k < 3; k++) {
            box_batch_set(&batch->boxes, k, v[k]->place, v[k]->distance, v[k]->normal);
        }
        if (box_batch_add(&batch->boxes, solid) == BOX_BATCH) {
            obstacle_finish(c, batch);
        }
        return;
    }
    Vec3 place[3] = {v[0]->place, v[1]->place, v[2]->place};
    Vec3 normal[3] = {v[0]->normal, v[1]->normal, v[2]->normal};
    double d[3] = {v[0]->distance, v[1]->distance, v[2]->distance};
    SolidNearest nearest = solid_nearest_on_triangle(solid, place, d, normal);
    set_nearest(c, touch, place, &nearest);
}

/* The distance is convex: below no tangent plane. The tangent at a corner bounds it over the
 * triangle, and parts the triangle from the solid when it is positive on all corners. Exact
 * points are looked for only where there may be a force. */
void obstacle_evaluate_triangle(const Contact *c, const Points *x, Corners *corners,
                                TouchBatch *batch, Touch *touch) {
    VertexDistance own[3];
    const VertexDistance *v[3];
    const Solid *solid = &c->def->obstacles[touch->obstacle].solid;
    double bound = -INFINITY, dhat = c->def->vertex_distance[touch->place[0]];
    int best = 0;
    for (int k = 0; k < 3; k++) {
        v[k] = corner_distance(c, x, touch, k, corners, v, &own[k]);
    }
    double lowest = min2(min2(v[0]->distance, v[1]->distance), v[2]->distance);
    touch->spare = vec3_same(v[0]->normal, v[1]->normal) && vec3_same(v[1]->normal, v[2]->normal);
    if (touch->spare) {
        obstacle_forget_sides(c, touch, touch->sides);
        touch->distance = lowest;
        touch->feature = 1;
        touch->margin =
            min2(min2(solid_flat_margin(solid, v[0]->place), solid_flat_margin(solid, v[1]->place)),
                 solid_flat_margin(solid, v[2]->place));
        return;
    }
    for (int a = 0; a < 3; a++) {
        Vec3 p = v[a]->place, n = v[a]->normal;
        double one = vec3_dot(n, vec3_sub(v[(a + 1) % 3]->place, p));
        double two = vec3_dot(n, vec3_sub(v[(a + 2) % 3]->place, p));
        double least = v[a]->distance + min2(0.0, min2(one, two));
        best = least > bound ? a : best;
        bound = least > bound ? least : bound;
    }
    if (bound < lowest - CONTACT_LEVEL * dhat && bound < dhat) {
        search_triangle(c, batch, touch, v);
        return;
    }
    obstacle_forget_sides(c, touch, touch->sides);
    touch->feature = (short)(1 << best);
    touch->weight[0] = touch->weight[1] = touch->weight[2] = 0.0;
    touch->weight[best] = 1.0;
    set_touch(c, touch, v[best]->distance, v[best]->place, v[best]->normal);
    touch->distance = bound;
}

double obstacle_frozen(const Contact *c, const Touch *touch) {
    const ContactObstacle *obstacle = &c->def->obstacles[touch->obstacle];
    int place = touch->place[0];
    if (obstacle->moves) {
        return -1.0;
    }
    size_t at = corner_index(c, place, touch->obstacle);
    return max2(solid_flat_margin(&obstacle->solid, c->touches.known[at].place),
                CONTACT_FROZEN_SHARE * c->def->vertex_distance[place]);
}

void obstacle_project(const Points *x, Touch *touch) {
    touch->distance = vec3_dot(touch->normal, point_at(x, touch->place[0])) - touch->level;
}
