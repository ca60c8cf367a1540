#include "sim/step/air.h"

static Vec3 lane_at(double *const lane[3], int slot) {
    return vec3(lane[0][slot], lane[1][slot], lane[2][slot]);
}

double air_add_push(const AirDef *air, const Cloth *cloth, const Lanes *lanes, const int *slot) {
    const Panel *panel = &cloth->panel;
    double power = 0.0;
    for (int t = 0; t < panel->triangle_count; t++) {
        int corner[3];
        Vec3 x[3], carried = {0, 0, 0};
        for (int k = 0; k < 3; k++) {
            corner[k] = slot[panel->triangles[3 * t + k]];
            x[k] = lane_at(lanes->x, corner[k]);
            carried = vec3_axpy(carried, 1.0 / 3.0, lane_at(lanes->v, corner[k]));
        }
        /* twice the area, along the normal */
        Vec3 face = vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]));
        double size = vec3_length(face);
        if (size <= 0.0) {
            continue;
        }
        double across = vec3_dot(vec3_sub(air->wind, carried), face) / size;
        Vec3 push = vec3_scale(air->normal_drag * across / 6.0, face);
        power += 3.0 * vec3_dot(push, carried);
        for (int k = 0; k < 3; k++) {
            lanes->f[0][corner[k]] += push.x;
            lanes->f[1][corner[k]] += push.y;
            lanes->f[2][corner[k]] += push.z;
        }
    }
    return power;
}
