#include "sim/step/air.h"

#include <math.h>

static Vec3 lane_at(double *const lane[3], int slot) {
    return vec3(lane[0][slot], lane[1][slot], lane[2][slot]);
}

static Vec3 at(const double *values, int place) { return vec3_load(values + 3 * (size_t)place); }

static Vec3 mean(const Vec3 v[3]) {
    return vec3_scale(1.0 / 3.0, vec3_add(vec3_add(v[0], v[1]), v[2]));
}

AirFace air_face(const AirDef *air, const Vec3 x[3], Vec3 flow) {
    AirFace face = {0};
    Vec3 twice = vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]));
    double size = vec3_length(twice), area = 0.5 * size;
    if (size > 0.0) {
        face.normal = vec3_scale(1.0 / size, twice);
        double across = vec3_dot(flow, face.normal);
        double along = vec3_length(vec3_axpy(flow, -across, face.normal));
        double half = 0.5 * air->density;
        face.across = area * (air->normal_drag + half * air->across * fabs(across));
        face.along = area * half * air->along * along;
    }
    return face;
}

double air_add_push(const AirDef *air, const Cloth *cloth, const Lanes *lanes, const int *slot) {
    const Panel *panel = &cloth->panel;
    double power = 0.0;
    for (int t = 0; t < panel->triangle_count; t++) {
        int corner[3];
        Vec3 x[3], v[3];
        for (int k = 0; k < 3; k++) {
            corner[k] = slot[panel->triangles[3 * t + k]];
            x[k] = lane_at(lanes->x, corner[k]);
            v[k] = lane_at(lanes->v, corner[k]);
        }
        Vec3 carried = mean(v), flow = vec3_sub(carried, air->wind);
        AirFace face = air_face(air, x, flow);
        Vec3 push = vec3_scale(1.0 / 3.0, air_push(&face, flow));
        power += 3.0 * vec3_dot(push, carried);
        for (int k = 0; k < 3; k++) {
            lanes->f[0][corner[k]] += push.x;
            lanes->f[1][corner[k]] += push.y;
            lanes->f[2][corner[k]] += push.z;
        }
    }
    return power;
}

static AirFace face_at(const AirDef *air, const int *corner, const double *x, const double *v,
                       Vec3 *carried) {
    Vec3 places[3], rates[3];
    for (int k = 0; k < 3; k++) {
        places[k] = at(x, corner[k]);
        rates[k] = at(v, corner[k]);
    }
    *carried = mean(rates);
    return air_face(air, places, vec3_sub(*carried, air->wind));
}

double air_add_gradient(const AirDef *air, const Cloth *cloth, const double *x, const double *v,
                        double *gradient) {
    const Panel *panel = &cloth->panel;
    double power = 0.0;
    for (int t = 0; t < panel->triangle_count; t++) {
        const int *corner = panel->triangles + 3 * (size_t)t;
        Vec3 carried;
        AirFace face = face_at(air, corner, x, v, &carried);
        Vec3 push = air_push(&face, vec3_sub(carried, air->wind));
        power += vec3_dot(push, carried);
        for (int k = 0; k < 3; k++) {
            double *g = gradient + 3 * (size_t)corner[k];
            vec3_store(g, vec3_axpy(vec3_load(g), -1.0 / 3.0, push));
        }
    }
    return power;
}

/* ---- implicit steps ---- */

int air_find_faces(const AirDef *air, const Cloth *cloth, int first, const double *x,
                   const double *v, AirFace *faces) {
    const Panel *panel = &cloth->panel;
    for (int t = 0; t < panel->triangle_count; t++) {
        const int *corner = panel->triangles + 3 * (size_t)t;
        Vec3 carried;
        faces[t] = face_at(air, corner, x, v, &carried);
        for (int k = 0; k < 3; k++) {
            faces[t].corner[k] = first + corner[k];
        }
    }
    return panel->triangle_count;
}

/* [m] mean motion of the corners from the start to x */
static Vec3 motion_of(const AirStep *step, const AirFace *face, const double *x) {
    Vec3 moved[3];
    for (int k = 0; k < 3; k++) {
        moved[k] = vec3_sub(at(x, face->corner[k]), at(step->start, face->corner[k]));
    }
    return mean(moved);
}

static Vec3 flow_of(const AirStep *step, const AirFace *face, const double *x) {
    return vec3_axpy(vec3_scale(-1.0, step->wind), 1.0 / step->dt, motion_of(step, face, x));
}

double air_step_energy(const AirStep *step, const double *x) {
    double energy = 0.0;
    for (int t = 0; t < step->count; t++) {
        Vec3 flow = flow_of(step, &step->faces[t], x);
        energy -= 0.5 * step->dt * vec3_dot(air_push(&step->faces[t], flow), flow);
    }
    return energy;
}

void air_step_add_gradient(const AirStep *step, const double *x, double *gradient) {
    for (int t = 0; t < step->count; t++) {
        const AirFace *face = &step->faces[t];
        Vec3 push = air_push(face, flow_of(step, face, x));
        for (int k = 0; k < 3; k++) {
            double *g = gradient + 3 * (size_t)face->corner[k];
            vec3_store(g, vec3_axpy(vec3_load(g), -1.0 / 3.0, push));
        }
    }
}

void air_step_add_hessian(const AirStep *step, const BlockMatrix *matrix) {
    for (int t = 0; t < step->count; t++) {
        const AirFace *face = &step->faces[t];
        double n[3], block[9], share = 1.0 / (9.0 * step->dt);
        vec3_store(n, face->normal);
        for (int k = 0; k < 9; k++) {
            int r = k / 3, c = k % 3;
            block[k] =
                share * ((face->across - face->along) * n[r] * n[c] + (r == c ? face->along : 0.0));
        }
        for (int a = 0; a < 3; a++) {
            for (int b = 0; b <= a; b++) {
                BlockPlace place;
                if (block_matrix_find(matrix, face->corner[a], face->corner[b], &place)) {
                    block_add(matrix->values, place, block);
                }
            }
        }
    }
}

double air_step_work(const AirStep *step, const double *x) {
    double work = 0.0;
    for (int t = 0; t < step->count; t++) {
        const AirFace *face = &step->faces[t];
        work += vec3_dot(air_push(face, flow_of(step, face, x)), motion_of(step, face, x));
    }
    return work;
}
