/* contact.h: cloth against obstacles. Sees surface vertices only, never a cloth model.
 *
 * One force law for both roads (explicit.md 3): with d the distance to an obstacle, dhat the
 * contact distance and tau = dhat/2,
 *   E(d) = k/2 (dhat - d)^2                                          for d >= tau,
 *        = k tau (dhat - tau) log(tau/d) + k/2 (dhat - tau)^2        below (C2 at tau),
 * and a bristle for friction: t stretches with the relative tangential motion, |kt t| <= mu f.
 * The explicit road's last guard are separating planes: obstacles are convex, so the tangent
 * plane at the closest point parts them from a vertex; no vertex crosses it in a step.
 */
#ifndef TOILE_CONTACT_CONTACT_H
#define TOILE_CONTACT_CONTACT_H

#include <stdbool.h>

#include "sim/geom/lanes.h"
#include "sim/geom/solid.h"
#include "sim/scene/motion.h"

typedef struct ContactObstacle {
    Solid solid;
    Pose start;           /* at t = 0 */
    const Motion *motion; /* in world space, after `start` */
    double friction;      /* negative: the vertex's own */
    bool moves;
} ContactObstacle;

typedef struct ContactDef {
    double distance;       /* [m] dhat */
    double reference_step; /* [s] the explicit stability limit: sets the implicit stiffness */
    int obstacle_count;
    const ContactObstacle *obstacles;
    int vertex_count;
    const double *mass;     /* [kg] (vertex_count); 0: never in contact (ghosts) */
    const double *friction; /* (vertex_count) of the fabric */
} ContactDef;

/* Positions, velocities and forces of the vertices in lanes: vertex i has slot[i]. */
typedef struct ContactView {
    const Lanes *lanes;
    const int *slot;           /* (vertex_count) */
    const unsigned char *held; /* (vertex_count) 1: moved by a handle, not by forces */
} ContactView;

/* One vertex near one obstacle, as evaluated at the start of the step. */
typedef struct ContactPair {
    int vertex, obstacle;
    double distance; /* [m] */
    Vec3 normal;     /* from the obstacle to the vertex */
    Vec3 point;      /* closest point of the obstacle */
    double due;      /* [m] path at which it can be near at the earliest; until then it is neither
                   evaluated nor guarded */
} ContactPair;

typedef struct ContactStatistics {
    double smallest_gap, truncations, impulses, rebuilds;
    double work; /* [J] done on the cloth by moving obstacles */
} ContactStatistics;

typedef struct Contact {
    const ContactDef *def;
    ContactPair *pairs; /* (vertex_count x obstacle_count at most) */
    int pair_count;
    double near, slack; /* [m] pairs not in the list are at least near + slack - path away */
    double path, step;  /* [m] longest possible motion since the list was made, in this step */
    Pose *poses;        /* (obstacle_count) now */
    Pose *next;         /* (obstacle_count) demanded at the end of the step */
    double *clocks;     /* [s] (obstacle_count) */
    double *next_clocks;
    double *bristles;    /* [m] (vertex_count x obstacle_count x 3) */
    double *weight_kept; /* [1/kg] (vertex_count) lanes weight without contact */
    ContactStatistics statistics;
} Contact;

Contact contact_create(const ContactDef *def, Arena *arena);

/* The pose of an obstacle whose programme stands at `clock` [s]. */
Pose contact_pose(const ContactObstacle *obstacle, double clock);

/* Energy E [J], force -dE/dd [N] and stiffness [N/m] of the law above. */
double contact_law(double distance, double dhat, double k, double *force, double *curvature);

/* ---- implicit road: the same law with a stiffness that does not depend on the step ---- */

/* Contact of one vertex with all obstacles. x: position; moved: its motion since the start of
 * the step; bristles: (obstacle_count x 3) at the start of the step. Adds to force (3) and to
 * block (3 x 3 stiffness, positive semidefinite); either may be NULL. Friction is the
 * incremental potential of the bristle, |kt t| <= mu f (a Huber function). `next_bristles`: what
 * the bristles become when x is accepted, or NULL. */
void contact_at_vertex(const ContactDef *def, const Pose *poses, int vertex, Vec3 x, Vec3 moved,
                       const double *bristles, double *force, double *block, double *next_bristles);
/* [m] how far a vertex at that distance may approach in one iteration. */
double contact_room(const ContactDef *def, double distance);

/* ---- explicit road: forces, kick, clear, refresh, guard, drift ---- */

/* Takes over poses, clocks and bristles, and makes the list. `fastest` [m/s] of any vertex. */
void contact_begin(Contact *contact, ContactView view, const Pose *poses, const double *clocks,
                   const double *bristles, double fastest, double dt);
/* Adds forces to lanes->f and inertia to lanes->weight. dt: the step, which sets the stiffness;
 * `share`: of the step that the kick will take (1, or 1/2 at the ends of an interval);
 * `time_end`: of this step, where the obstacles want to be. */
void contact_forces(Contact *contact, ContactView view, double dt, double share, double time_end);
/* After the kick: takes the forces of this step back out of lanes->f and lanes->weight. */
void contact_clear(Contact *contact, ContactView view);
/* Makes the list again when the speed after the kick, `fastest` [m/s], could carry a vertex from
 * outside the list into contact. */
void contact_refresh(Contact *contact, ContactView view, double dt, double fastest);
/* Changes velocities so that no vertex crosses an obstacle in x += dt v, and moves the
 * obstacles as far as the cloth lets them. */
void contact_guard(Contact *contact, ContactView view, double dt);

/* [J] stored in contacts at lanes->x with stiffness kappa m / dt^2. */
double contact_energy(const Contact *contact, ContactView view, double dt);

/* Smallest distance of any vertex from any obstacle [m]. */
double contact_smallest_gap(const Contact *contact, ContactView view);

#endif
