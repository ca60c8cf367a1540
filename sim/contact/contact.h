/* contact.h: cloth against obstacles, other cloth and itself. Sees surface vertices and
 * triangles only, never a cloth model.
 *
 * One force law for both roads: with d the distance of two features, dhat the
 * contact distance and tau = dhat/2,
 *   E(d) = k/2 (dhat - d)^2                                          for d >= tau,
 *        = k tau (dhat - tau) log(tau/d) + k/2 (dhat - tau)^2        below (C2 at tau),
 * and a bristle for friction: t stretches with the relative tangential motion, |kt t| <= mu f.
 * The explicit road's last guard are separating planes: features are convex, so a plane between
 * their closest points parts them, and no vertex leaves its side of any plane in a step. By name it can
 * have impulses instead of the law and the planes (impulses.h).
 *
 * Obstacles are convex solids (sim/geom/solid.h) and triangle meshes; vertices, edges and triangles
 * of the cloth meet their faces, edges and corners exactly. */
#ifndef TOILE_CONTACT_CONTACT_H
#define TOILE_CONTACT_CONTACT_H

#include <stdbool.h>

#include "sim/contact/lists.h"
#include "sim/geom/lanes.h"
#include "sim/geom/solid.h"
#include "sim/scene/mesh.h"
#include "sim/scene/motion.h"

typedef struct ContactObstacle {
    Solid solid;
    const MeshDef *mesh;  /* NULL: the solid is the obstacle */
    Pose start;           /* at t = 0 */
    const Motion *motion; /* in world space, after `start` */
    double friction;      /* negative: the cloth's own */
    bool moves;
} ContactObstacle;

typedef struct ContactDef {
    double distance;       /* [m] largest contact distance of any cloth */
    double reference_step; /* [s] the explicit step without contact: sets the stiffness */
    bool self;             /* cloth meets itself and other cloth */
    bool impulses;         /* explicit road: impulses.h instead of the law */
    int obstacle_count;
    const ContactObstacle *obstacles;
    int panel_count;
    const SurfacePanel *panels;    /* (panel_count) one per cloth */
    int vertex_count;              /* places, ghosts among them */
    const double *mass;            /* [kg] (vertex_count); 0: never in contact (ghosts) */
    const double *friction;        /* (vertex_count) of the fabric */
    const double *vertex_distance; /* [m] (vertex_count) contact distance */
    const double *start;           /* [m] (vertex_count x 3) positions at t = 0 */
} ContactDef;

/* Bounds of the motion of all vertices, asked for while nothing is near (quiet.h). */
typedef struct ContactMotion {
    double (*fastest)(void *owner); /* [m/s] no vertex is faster now */
    /* Spreads count from the positions to which the velocities of now lead in `ahead` [s]. Returns them, in
     * lanes (3). */
    double *const *(*mark)(void *owner, double ahead);
    /* [m] how far nodes next to each other on a lattice have moved against each other: with p, q the most
     * along u and along v, sqrt((p^2/h1^2 + q^2/h2^2) / (1/h1^2 + 1/h2^2)) */
    double (*spread)(void *owner);
    double (*mutual)(void *owner);   /* [m] no two vertices have moved more against each other */
    double (*relative)(void *owner); /* [m/s] `spread` of the velocities of now */
    /* Does the drift bound that closely when asked (ContactSpeeds), on every lattice? */
    bool framed;
    void *owner;
} ContactMotion;

/* Bounds of how fast cloth moved in a drift. */
typedef struct ContactSpeeds {
    double fastest;  /* [m/s] any vertex */
    double mutual;   /* [m/s] two vertices against each other */
    double relative; /* [m/s] two nodes next to each other on a lattice, likewise */
} ContactSpeeds;

/* Positions, velocities and forces of the vertices in lanes: vertex i has slot[i]. */
typedef struct ContactView {
    const Lanes *lanes;
    const int *slot;           /* (vertex_count) */
    const unsigned char *held; /* (vertex_count) 1: moved by a handle, not by forces */
    /* 1: times the share of m / step^2 at obstacles; more under scaled inertia, whose steps are so much
     * longer and bear it */
    double stiffer;
    ContactMotion motion;
    bool continues; /* are the positions those that the last interval ended with? */
} ContactView;

typedef struct ContactStatistics {
    double smallest_gap, smallest_self_gap; /* [m] to obstacles; of cloth to cloth */
    double truncations, impulses, rebuilds; /* motions that planes cut; of the guard; searches */
    double pairs, evaluations;              /* summed over steps: listed, looked at */
    double work;                            /* [J] done on the cloth by moving obstacles */
    double friction, damping;               /* [J] taken out of the cloth */
    double guard; /* [J] by the guard, by the inertia added to crowded vertices, less stiffened */
    double stiffened; /* [J] stored by making the law stiffer for the next interval */
    double approach;  /* [m/s] fastest approach of a near pair */
    double rounds, zones, zone_vertices; /* of collisions; impact zones, summed over steps */
    bool rejected; /* not to be used: impact zones would take too much, or something leapt */
    double seconds, search_seconds; /* [s] of the clock: all of contact; the lists in it */
} ContactStatistics;

typedef struct Contact Contact;

/* What a contact keeps from one interval to the next. */
typedef struct ContactMemory {
    Pose *poses;       /* (obstacle_count) where the obstacles are */
    double *clocks;    /* [s] (obstacle_count) time in each obstacle's own programme */
    double *bristles;  /* [m] (vertex_count x obstacle_count x 3) of vertices at obstacles */
    PairMemory *pairs; /* (pair_room) all other bristles: touch_count at obstacles, then cloth */
    int touch_count, pair_count, pair_room;
    double approach; /* [m/s] fastest of a touching pair in the last interval */
    /* more where cloth is pressed hard; 0: none yet. Of cloth to cloth, share of m / reference_step^2: it
     * does not follow the step, which would add to what is stored; at solids, share of m / step^2 */
    double stiffness, solid_stiffness;
} ContactMemory;

/* Places for pairs of this many per vertex; more bristles than that are forgotten. */
#define CONTACT_MEMORY_PER_VERTEX 6

Contact *contact_create(const ContactDef *def, Arena *arena);

/* The pose of an obstacle whose programme stands at `clock` [s]. */
Pose contact_pose(const ContactObstacle *obstacle, double clock);

/* [s] where the clock of an obstacle wants to be after a step of dt that ends at time_end: there, or as
 * far behind as it must be when it was stopped. */
double contact_next_clock(const ContactObstacle *obstacle, double clock, double time_end,
                          double dt);

/* [s] the longest explicit step that feeds no cloth in motion, whose crowded vertices have an inertia that
 * comes and goes: by the stiffness between cloths; or INFINITY. */
double contact_longest_step(const ContactDef *def, const ContactMemory *memory);

/* Does much of the cloth lie on cloth, or is it pressed on cloth harder than the law bears? */
bool contact_is_crowded(const ContactDef *def, const ContactMemory *memory);

/* [s] from when on an obstacle stands still: its motion, and the frames of its mesh. */
double contact_motion_end(const ContactObstacle *obstacle);

/* Energy E [J], force -dE/dd [N] and stiffness [N/m] of the law above. */
double contact_law(double distance, double dhat, double k, double *force, double *curvature);

/* Share of the stiffness of a contact inside a side or a face at a solid, which is nearer by `lower` [m] than what
 * bounds it. That is felt already, so what comes in addition must come without a leap. */
double contact_share_inside(double lower, double dhat);

/* ---- explicit road (the implicit one: barrier.h): begin, then per step: forces, kick,
 * clear, repel, guard, drift, drifted; end ---- */

/* Takes over memory and makes the lists. */
void contact_begin(Contact *contact, ContactView view, const ContactMemory *memory, double dt);
/* Adds forces to lanes->f and inertia to lanes->weight. dt: the step, which sets the stiffness;
 * `share`: of the step that the kick will take (1, or 1/2 at the ends of an interval);
 * `time_end`: of this step, where the obstacles want to be. */
void contact_forces(Contact *contact, double dt, double share, double time_end);
/* After the kick: takes the forces of this step back out of lanes->f and lanes->weight. `given` [m/s]:
 * what the kick gave to every vertex, whatever its inertia. */
void contact_clear(Contact *contact, Vec3 given);
/* After the kick, before bounds on sides and springs: repulsions of contact by impulses. Did velocities change? */
bool contact_repel(Contact *contact, double dt);
/* Changes velocities so that nothing crosses in x += dt v, and moves the obstacles as far as the
 * cloth lets them. Did any change? */
bool contact_guard(Contact *contact, double dt);
/* Is a close bound of how fast neighbours move in this step worth its time? */
bool contact_asks_relative(const Contact *contact);
/* After the drift. Sets statistics.rejected when that was too fast for what was known before it. */
void contact_drifted(Contact *contact, const ContactSpeeds *speeds, double dt);
/* Writes what the next interval needs. */
void contact_end(Contact *contact, ContactMemory *memory);

const ContactStatistics *contact_statistics(const Contact *contact);

/* [J] stored in the contacts that were evaluated last, for a step of dt. */
double contact_energy(Contact *contact, double dt);

#endif
