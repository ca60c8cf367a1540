#include "sim/contact/flatness.h"

#include <math.h>
#include <string.h>

void flatness_slopes(const Surface *surface, const Points *x, int g, Box gradient[2]) {
    const SurfaceGroup *group = &surface->groups[g];
    const SurfacePanel *panel = &surface->panels[group->panel];
    gradient[0] = gradient[1] = box_empty();
    int across = panel->wrap ? panel->nu : panel->nu - 1;
    int i0 = group->block[0] * SURFACE_BLOCK, j0 = group->block[1] * SURFACE_BLOCK;
    int i1 = i0 + SURFACE_BLOCK < across ? i0 + SURFACE_BLOCK : across;
    int j1 = j0 + SURFACE_BLOCK < panel->nv - 1 ? j0 + SURFACE_BLOCK : panel->nv - 1;
    Vec3 below[SURFACE_BLOCK + 1], here[SURFACE_BLOCK + 1];
    for (int j = j0; j <= j1; j++) {
        for (int i = i0; i <= i1; i++) {
            here[i - i0] = point_at(x, panel->first + j * panel->nu + i % panel->nu);
            if (i > i0) {
                Vec3 du = vec3_sub(here[i - i0], here[i - i0 - 1]);
                box_add(&gradient[0], vec3_scale(1.0 / panel->h1, du));
            }
            if (j > j0) {
                Vec3 dv = vec3_sub(here[i - i0], below[i - i0]);
                box_add(&gradient[1], vec3_scale(1.0 / panel->h2, dv));
            }
        }
        memcpy(below, here, sizeof below);
    }
}

double flatness_stretch(Vec3 a, Vec3 b) {
    double p = vec3_dot(a, a), q = vec3_dot(b, b), r = vec3_dot(a, b);
    double least = 0.5 * (p + q) - sqrt(0.25 * (p - q) * (p - q) + r * r);
    return sqrt(fmax(least, 0.0));
}

double flatness_least(const Box gradient[2]) {
    Vec3 c1 = vec3_scale(0.5, vec3_add(gradient[0].low, gradient[0].high));
    Vec3 c2 = vec3_scale(0.5, vec3_add(gradient[1].low, gradient[1].high));
    Vec3 e1 = vec3_sub(gradient[0].high, gradient[0].low);
    Vec3 e2 = vec3_sub(gradient[1].high, gradient[1].low);
    double e = 0.5 * sqrt(vec3_dot(e1, e1) + vec3_dot(e2, e2));
    return flatness_stretch(c1, c2) - e;
}

int flatness_groups(const Surface *surface, int first, int second, int group[4]) {
    const SurfaceGroup *a = &surface->groups[first], *b = &surface->groups[second];
    const SurfacePanel *panel = &surface->panels[a->panel];
    if (a->panel != b->panel || panel->nu == 0) {
        return 0;
    }
    const int *blocks = surface->blocks + 2 * a->panel;
    if (flatness_step(a->block[0], b->block[0], blocks[0], panel->wrap) == 2 ||
        flatness_step(a->block[1], b->block[1], blocks[1], false) == 2) {
        return 0;
    }
    for (int k = 0; k < 4; k++) {
        int i = k & 1 ? b->block[0] : a->block[0], j = k & 2 ? b->block[1] : a->block[1];
        group[k] = surface->first_group[a->panel] + j * blocks[0] + i;
    }
    return 4;
}

void flatness_refresh(const Surface *surface, GroupSlopes *slopes, const Points *x, long stamp,
                      int first, int second) {
    int group[4], groups = flatness_groups(surface, first, second, group);
    for (int k = 0; k < groups; k++) {
        GroupSlopes *of_group = &slopes[group[k]];
        if (of_group->stamp != stamp) {
            flatness_slopes(surface, x, group[k], of_group->gradient);
            of_group->stamp = stamp;
        }
    }
}

double flatness_distance(const Surface *surface, const GroupSlopes *slopes, int first, int second) {
    int group[4];
    if (flatness_groups(surface, first, second, group) == 0) {
        return 0.0;
    }
    Box gradient[2] = {box_empty(), box_empty()};
    for (int k = 0; k < 4; k++) {
        gradient[0] = box_union(gradient[0], slopes[group[k]].gradient[0]);
        gradient[1] = box_union(gradient[1], slopes[group[k]].gradient[1]);
    }
    const SurfacePanel *panel = &surface->panels[surface->groups[first].panel];
    return flatness_least(gradient) * surface_lattice_altitude(panel);
}
