/* air.h: the push of the air on the faces of the cloth, beyond the linear drag that is part of a kick
 * (sim/scene/air.h). A third of the push on a triangle goes to each corner. It lets a flag wave: cloth
 * that lies along the wind is hardly pushed, cloth across it is. */
#ifndef TOILE_STEP_AIR_H
#define TOILE_STEP_AIR_H

#include "sim/geom/lanes.h"
#include "sim/model/model.h"
#include "sim/solve/block_matrix.h"

/* A triangle in the air. Implicit steps keep what depends on normal and speed as it was at their
 * start, so that the push has a potential. */
typedef struct AirFace {
    int corner[3];
    Vec3 normal;          /* unit */
    double across, along; /* [kg/s] push against velocity, along the normal and in the plane */
} AirFace;

/* `flow` [m/s]: mean velocity of the corners at x less the wind; all 0 where the triangle has no area. */
AirFace air_face(const AirDef *air, const Vec3 x[3], Vec3 flow);

/* [N] on the whole triangle. */
static inline Vec3 air_push(const AirFace *face, Vec3 flow) {
    double across = vec3_dot(flow, face->normal);
    Vec3 push = vec3_scale(-face->along, flow);
    return vec3_axpy(push, (face->along - face->across) * across, face->normal);
}

/* Adds to lanes->f [N]; returns the power [W] at the velocities of now. slot: (node_count) of this
 * cloth. */
double air_add_push(const AirDef *air, const Cloth *cloth, const Lanes *lanes, const int *slot);

/* The same for x and v (node_count x 3) of this cloth: takes it from `gradient`. */
double air_add_gradient(const AirDef *air, const Cloth *cloth, const double *x, const double *v,
                        double *gradient);

/* ---- an implicit step of dt from `start` (places x 3): flow is (x - start) / dt - wind ---- */

/* The triangles of a cloth, at x and v (node_count x 3); corners are places from `first` on. Returns how
 * many. */
int air_find_faces(const AirDef *air, const Cloth *cloth, int first, const double *x,
                   const double *v, AirFace *faces);

typedef struct AirStep {
    const AirFace *faces;
    int count;
    Vec3 wind;
    double dt;           /* [s] */
    const double *start; /* [m] */
} AirStep;

double air_step_energy(const AirStep *step, const double *x); /* [J] */
void air_step_add_gradient(const AirStep *step, const double *x, double *gradient);
void air_step_add_hessian(const AirStep *step, const BlockMatrix *matrix);
/* [J] that the air did from the start to x. */
double air_step_work(const AirStep *step, const double *x);

#endif
