/* system.h: everything that is given in a simulation, and the state that changes.
 *
 * A vector over the system has 3 numbers for each *place*: the nodes of the first cloth, its
 * ghost nodes, the nodes of the second cloth, ... */
#ifndef TOILE_STEP_SYSTEM_H
#define TOILE_STEP_SYSTEM_H

#include "sim/contact/contact.h"
#include "sim/geom/crossing.h"
#include "sim/model/model.h"
#include "sim/scene/scene.h"
#include "sim/solve/factor.h"

/* The nodes of one handle. */
typedef struct Handle {
    const HandleDef *def;
    int count;
    const int *places;   /* (count) nodes, and ghosts for a clamp */
    const double *start; /* [m] (count x 3) positions at t = 0 */
} Handle;

typedef struct System {
    const Scene *scene;
    Arena *arena; /* lives as long as the system */
    int cloth_count, handle_count, place_count, node_count;
    Cloth *cloths;      /* (cloth_count) */
    int *first;         /* (cloth_count + 1) first place of each cloth */
    Handle *handles;    /* (handle_count) */
    int history_count;  /* of all cloths */
    double *mass;       /* [kg] (place_count); 0 for ghosts */
    double *area;       /* [m2] (place_count) */
    double *damping;    /* [1/s] (place_count) mass damping of the cloth plus drag / density */
    double weight;      /* [N] of all cloth, the force that tolerances refer to */
    double size;        /* [m] diagonal of the start positions, the length they refer to */
    ContactDef contact; /* obstacles, friction, distance; see contact.h */
} System;

bool system_has_contact(const System *system);

/* The surface of all cloths at x (place_count x 3), for the exact check; x stays borrowed. */
CrossingMesh system_mesh(const System *system, const double *x, Arena *arena);

/* The mesh of an obstacle (not NULL) in the world. */
CrossingMesh system_obstacle_mesh(const System *system, int obstacle, Pose pose, double clock,
                                  Arena *arena);

/* What changes. Copied before a step is tried, so that a bad step can be taken back. */
typedef struct State {
    double time;      /* [s] */
    double *x, *v;    /* [m], [m/s] (place_count x 3) */
    double *x_before; /* BDF2: one step earlier; valid when step_before > 0 */
    double *v_before;
    double step_before; /* [s] length of the last implicit step; 0: none yet */
    double *history;    /* (system.history_count) of the cloths, one after the other */
    double scaled;      /* 1: the explicit road scaled inertia when it came here (inertia.h) */
    double hidden;      /* [J] then: kinetic energy beyond that of the masses */
    double unguarded; /* [s] for which the guard of contact had nothing to do; negative: a pause */
    double calm;      /* [s] for which nothing has moved; explicit cloth then sleeps */
    ContactMemory contact;
    /* [N] (place_count x 3) of contacts on the cloth: explicit, the mean over the last run of steps; implicit,
     * at x. NULL: no look asks for it */
    double *contact_force;
} State;

/* What happened in one frame; names in statistic_names. */
typedef struct Statistics {
    double asleep;         /* 1 when nothing had to be computed */
    double steps, retries; /* accepted; steps or intervals that were taken back */
    double step_length;    /* [s] of the last one */
    double newton_iterations, factorisations, residual; /* of implicit steps; [N] of the last one */
    double kinetic, elastic, gravity, contact;          /* [J] at the end of the frame */
    double work;                                        /* [J] done by handles during the frame */
    double stretch; /* largest of a lattice's cell along its threads at the end of the frame */
    double behind;  /* [m] largest way from a held place to where its handle is, likewise */
    double smallest_gap, smallest_self_gap; /* [m] to obstacles, of cloth to cloth; INFINITY: none
                                               was near */
    double truncations, impulses, lag;      /* guard; lag [s] of the slowest obstacle */
    double pairs, evaluations, rebuilds;    /* listed and looked at (mean of a step); searches */
    double rounds, zones, zone_vertices;    /* of contact by impulses: rounds of collisions, impact
                                               zones and vertices in them, summed over steps */
    double friction, damping, guard, sides; /* [J] taken out of the cloth in the frame */
    double fabric, drag; /* [J] likewise: by damping inside the fabrics; of the mass and by air */
    double numerical;    /* [J] likewise: by implicit steps themselves, by scaled inertia */
    double approach;     /* [m/s] fastest of a near pair */
    double cpu;          /* [s] process time of the frame */
    double seconds, contact_seconds, search_seconds; /* [s] of the clock: the frame, contact in it,
                                                        the lists in contact (explicit) */
} Statistics;
#define STATISTIC_COUNT ((int)(sizeof(Statistics) / sizeof(double)))
extern const char statistic_names[]; /* one per line, in the order of the struct */

bool system_create(System *system, const Scene *scene, uint64_t seed, Arena *arena, Error *error);

State state_allocate(const System *system, Arena *arena);
void state_copy(const System *system, State *to, const State *from);
/* Triangles that cross: cloth with itself, other cloth and every obstacle; exact, and slow. A closed
 * mesh with the first node inside counts too. */
long system_crossings(const System *system, const State *state);

/* Start of the scene: positions, velocities, obstacles at t = 0. */
void state_start(const System *system, State *state);

/* The history of a state becomes that of the cloths, which forces depend on; and back. */
void system_load_history(const System *system, const State *state);
void system_store_history(const System *system, State *state);
/* The positions of the state are accepted: its history, and that of the cloths, follow. */
void system_commit(const System *system, State *state);

/* Is some handle moving the place at `time`? 1 in held for every such place and every ghost. */
void system_mark_held(const System *system, double time, unsigned char *held);
/* Writes the positions that handles ask for at `time` into x (held places only). */
void system_place_held(const System *system, double time, double *x);

/* Largest stretch of a cell along its threads, over all lattices (0: none is longer than at rest), and
 * the cloth that has it. */
double system_stretch(const System *system, const double *x, int *cloth);

/* [m] Largest way from a held place to where its handle is at `time`, and the place. scratch: (place_count x 3) */
double system_behind(const System *system, const double *x, double time, double *scratch,
                     int *place);

double system_elastic_energy(const System *system, const double *x);
void system_add_gradient(const System *system, const double *x, double *gradient);
double system_kinetic_energy(const System *system, const double *v, const unsigned char *held);
double system_gravity_energy(const System *system, const double *x, const unsigned char *held);

/* [s] smallest stable explicit step of all cloths; with scaled inertia where a cloth can have it. */
double system_stable_step(const System *system);
double system_scaled_step(const System *system);
/* By what stretched lattices at x gain on the square of the frequency that bounds `stable`, that step, at
 * least 1. */
double system_stiffening(const System *system, const double *x, double stable);

/* Can its inertia be scaled (inertia.h), and does the scene leave it to the stepper? */
bool system_is_scalable(const System *system, const Cloth *cloth);

#endif
