#include "render/motion.h"

#include <math.h>
#include <stdlib.h>

#include "render/camera_fit.h"
#include "sim/base/memory.h"

typedef struct Corner {
    double x, y;   /* [px] */
    double nearer; /* linear in the picture: 1 / depth, or - depth in parallel */
    double weight; /* of the corner's share: 1 / depth, or 1 */
    Vec3 before;   /* [m] */
} Corner;

static void set_motion(const MotionDef *def, ExrPicture *picture, int x, int y, Vec3 before) {
    double seen[3];
    size_t at = 2 * ((size_t)y * (size_t)picture->width + (size_t)x);
    camera_see(def->camera_before, picture->width, picture->height, before, seen);
    picture->motion[at] = (float)(x + def->sample[0] - seen[0]);
    picture->motion[at + 1] = (float)(y + def->sample[1] - seen[1]);
}

/* Pixels whose sample lies in a triangle of the cloth that they show. */
static void fill_triangle(const MotionDef *def, const Corner c[3], uint32_t id, float *depth,
                          ExrPicture *picture) {
    double x0 = fmin(c[0].x, fmin(c[1].x, c[2].x)), x1 = fmax(c[0].x, fmax(c[1].x, c[2].x));
    double y0 = fmin(c[0].y, fmin(c[1].y, c[2].y)), y1 = fmax(c[0].y, fmax(c[1].y, c[2].y));
    double area = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y);
    int left = (int)fmax(ceil(x0 - def->sample[0]), 0.0);
    int top = (int)fmax(ceil(y0 - def->sample[1]), 0.0);
    int right = (int)fmin(floor(x1 - def->sample[0]), picture->width - 1.0);
    int bottom = (int)fmin(floor(y1 - def->sample[1]), picture->height - 1.0);
    for (int y = top; y <= bottom && fabs(area) > 1e-12; y++) {
        for (int x = left; x <= right; x++) {
            double px = x + def->sample[0], py = y + def->sample[1], w[3], nearer = 0.0, sum = 0.0;
            bool inside = true;
            for (int k = 0; k < 3; k++) {
                const Corner *a = &c[(k + 1) % 3], *b = &c[(k + 2) % 3];
                w[k] = ((b->x - a->x) * (py - a->y) - (b->y - a->y) * (px - a->x)) / area;
                inside = inside && w[k] >= -1e-9;
                nearer += w[k] * c[k].nearer;
                sum += w[k] * c[k].weight;
            }
            size_t at = (size_t)y * (size_t)picture->width + (size_t)x;
            if (!inside || picture->id[at] != id || !(nearer > (double)depth[at])) {
                continue;
            }
            Vec3 before = vec3(0, 0, 0);
            for (int k = 0; k < 3; k++) {
                before = vec3_axpy(before, w[k] * c[k].weight / sum, c[k].before);
            }
            depth[at] = (float)nearer;
            set_motion(def, picture, x, y, before);
        }
    }
}

static Vec3 vertex_at(const float *places, uint32_t vertex) {
    const float *p = places + 3 * (size_t)vertex;
    return vec3((double)p[0], (double)p[1], (double)p[2]);
}

/* Where a point is seen; false: not in front of the camera. */
static bool see_corner(const MotionDef *def, const ExrPicture *picture, Vec3 now, Vec3 before,
                       Corner *corner) {
    double at[3];
    bool flat = !def->camera->perspective;
    camera_see(def->camera, picture->width, picture->height, now, at);
    *corner = (Corner){at[0], at[1], flat ? -at[2] : 1.0 / at[2], flat ? 1.0 : 1.0 / at[2], before};
    return flat || at[2] > def->camera->near;
}

static void fill_cloth(const MotionDef *def, int cloth, float *depth, ExrPicture *picture) {
    const SurfacePart *part = &def->surface->parts[cloth];
    const uint32_t *corner = def->surface->fine + 3 * (size_t)part->fine_begin;
    for (int t = 0; t < part->fine_count; t++, corner += 3) {
        Corner c[3];
        bool seen = true;
        for (int k = 0; k < 3; k++) {
            Vec3 now = vertex_at(def->places, corner[k]),
                 before = vertex_at(def->before, corner[k]);
            seen = see_corner(def, picture, now, before, &c[k]) && seen;
        }
        if (seen) {
            fill_triangle(def, c, (uint32_t)cloth + 1, depth, picture);
        }
    }
}

static bool moves_itself(const MotionDef *def, int obstacle) {
    const StateMesh *mesh = def->header->obstacles[obstacle].mesh;
    return mesh && mesh->moves;
}

static void fill_mesh(const MotionDef *def, int obstacle, float *depth, ExrPicture *picture) {
    const StateMesh *mesh = def->header->obstacles[obstacle].mesh;
    const double *vertices[2] = {state_mesh_vertices(def->header, def->now, obstacle),
                                 state_mesh_vertices(def->header, def->then, obstacle)};
    uint32_t id = (uint32_t)(def->surface->part_count + obstacle + 1);
    const int32_t *corner = mesh->triangles;
    for (int t = 0; t < mesh->triangle_count; t++, corner += 3) {
        Corner c[3];
        bool seen = true;
        for (int k = 0; k < 3; k++) {
            size_t at = 3 * (size_t)corner[k];
            Vec3 now = pose_apply(def->now->pose[obstacle], vec3_load(vertices[0] + at));
            Vec3 before = pose_apply(def->then->pose[obstacle], vec3_load(vertices[1] + at));
            seen = see_corner(def, picture, now, before, &c[k]) && seen;
        }
        if (seen) {
            fill_triangle(def, c, id, depth, picture);
        }
    }
}

/* Where in the world a pixel's sample is. */
static Vec3 place_of(const MotionDef *def, const ExrPicture *picture, int x, int y) {
    const Camera *c = def->camera;
    double depth = (double)picture->depth[(size_t)y * (size_t)picture->width + (size_t)x];
    double far = c->perspective ? depth : 1.0;
    double right = far * c->half_x * (2.0 * (x + def->sample[0]) / picture->width - 1.0);
    double up = far * c->half_y * (1.0 - 2.0 * (y + def->sample[1]) / picture->height);
    return vec3_axpy(vec3_axpy(vec3_axpy(c->eye, depth, c->forward), right, c->right), up, c->up);
}

/* Obstacles whose shape stays. */
static void fill_obstacles(const MotionDef *def, ExrPicture *picture) {
    int cloths = def->surface->part_count;
    for (int y = 0; y < picture->height; y++) {
        for (int x = 0; x < picture->width; x++) {
            int number =
                (int)picture->id[(size_t)y * (size_t)picture->width + (size_t)x] - cloths - 1;
            if (number >= 0 && number < def->header->obstacle_count && !moves_itself(def, number)) {
                Vec3 own = pose_unapply(def->now->pose[number], place_of(def, picture, x, y));
                set_motion(def, picture, x, y, pose_apply(def->then->pose[number], own));
            }
        }
    }
}

void motion_fill(const MotionDef *def, ExrPicture *picture) {
    size_t count = (size_t)picture->width * (size_t)picture->height;
    float *depth = memory_new(count * sizeof *depth); /* how near the nearest is */
    for (size_t i = 0; i < count; i++) {
        depth[i] = -INFINITY;
    }
    for (int i = 0; i < def->surface->part_count; i++) {
        fill_cloth(def, i, depth, picture);
    }
    for (int i = 0; i < def->header->obstacle_count; i++) {
        if (moves_itself(def, i)) {
            fill_mesh(def, i, depth, picture);
        }
    }
    fill_obstacles(def, picture);
    free(depth);
}
