/* rest_kernel.c: the row loop of rest_batch.h. Compiled once per vector width (see the Makefile). What
 * force.h finds by branches is found here by choosing, by the same operations. */
#include "sim/contact/constants.h"
#include "sim/contact/rest_batch.h"

static inline double dot(double ax, double ay, double az, double bx, double by, double bz) {
    return ax * bx + ay * by + az * bz;
}

static inline double larger(double a, double b) { return a > b ? a : b; }

static void find_forces(const RestFace *face, RestRows *rows, int vectors) {
    const double nx = face->normal[0], ny = face->normal[1], nz = face->normal[2];
    const double dt = face->dt, share_dt = face->share_dt, dhat = face->dhat, mu = face->friction;
    const double tau = CONTACT_LOG_BELOW * dhat, least = CONTACT_LEAST_GAP * dhat;
    const double share = face->stiffness, root = __builtin_sqrt(share);
    const double along = CONTACT_BRISTLE_DAMPING * __builtin_sqrt(CONTACT_BRISTLE_SHARE);
    int count = vectors * REST_VECTOR;
    VECTOR_LOOP
    for (int i = 0; i < count; i++) {
        double m = rows->mass[i], d = rows->distance[i], k = share * m / (dt * dt);
        double critical = 2.0 * root * m / dt, damping = CONTACT_DAMPING * critical;
        double safe = larger(d, least), steep = k * tau * (dhat - tau) / safe;
        double steeper = k * tau * (dhat - tau) / (safe * safe);
        double force = d >= tau ? k * (dhat - d) : steep, curvature = d >= tau ? k : steeper;
        force = d >= dhat ? 0.0 : force, curvature = d >= dhat ? 0.0 : curvature;
        double vx = rows->v[0][i], vy = rows->v[1][i], vz = rows->v[2][i];
        double vn = dot(vx, vy, vz, nx, ny, nz), total = larger(0.0, force - damping * vn);
        double sx = vx + -vn * nx, sy = vy + -vn * ny, sz = vz + -vn * nz;
        double kt = CONTACT_BRISTLE_SHARE * k, ct = along * critical, limit = total * mu;
        double tx = rows->bristle[0][i] + share_dt * sx, ty = rows->bristle[1][i] + share_dt * sy;
        double tz = rows->bristle[2][i] + share_dt * sz, tn = -dot(tx, ty, tz, nx, ny, nz);
        tx = tx + tn * nx, ty = ty + tn * ny, tz = tz + tn * nz;
        double pull2 = kt * kt * dot(tx, ty, tz, tx, ty, tz), limit2 = limit * limit;
        double cut = pull2 > limit2 ? limit / __builtin_sqrt(pull2) : 1.0;
        tx = cut * tx, ty = cut * ty, tz = cut * tz;
        double fx = -kt * tx + -ct * sx, fy = -kt * ty + -ct * sy, fz = -kt * tz + -ct * sz;
        double size2 = dot(fx, fy, fz, fx, fy, fz);
        double less = size2 > limit2 ? limit / __builtin_sqrt(size2) : 1.0;
        int near = d < dhat;
        rows->bristle[0][i] = near ? tx : 0.0, rows->bristle[1][i] = near ? ty : 0.0;
        rows->bristle[2][i] = near ? tz : 0.0;
        rows->friction[0][i] = less * fx, rows->friction[1][i] = less * fy;
        rows->friction[2][i] = less * fz;
        rows->total[i] = total, rows->damping[i] = total - force;
        rows->stiffness[i] = curvature + damping / dt, rows->approach[i] = -vn;
    }
}

RestKernel *const VECTOR_JOIN(rest_kernel_, VECTOR_VARIANT) = find_forces;
