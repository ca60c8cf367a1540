/* engine.h: the explicit contact as a whole, which its files share. Not for others.
 *
 * A step (contact.c): contact_forces looks at the pairs and touches that may be near, and pushes; contact_clear takes
 * the forces back out of the lanes after the kick; contact_guard widens lists for the new velocities, changes these by
 * impulses and planes, moves the obstacles, and then all paths by the motion of the step. */
#ifndef TOILE_CONTACT_ENGINE_H
#define TOILE_CONTACT_ENGINE_H

#include "sim/base/error.h"
#include "sim/base/parallel.h"
#include "sim/contact/constants.h"
#include "sim/contact/contact.h"
#include "sim/contact/groups.h"
#include "sim/contact/places.h"
#include "sim/contact/quiet.h"
#include "sim/contact/resting.h"
#include "sim/contact/self.h"
#include "sim/contact/touch.h"
#include "sim/contact/touched.h"
#include "sim/contact/twins.h"

/* How hard one kind of contact pushes, and what asks for more or less of it. */
typedef struct Stiffness {
    double share;    /* of m / step^2 */
    double impulses; /* of the guard, in this interval */
    double room;     /* smallest distance / contact distance in it */
} Stiffness;

typedef struct Impulses Impulses;

struct Contact {
    const ContactDef *def;
    Arena *arena;
    Places places;
    Surface surface; /* that of places */
    ContactStatistics statistics;

    /* time */
    ContactView view;       /* of this interval */
    double step, kick_time; /* [s] of this step, of its kick */
    double step_count;      /* in this interval */
    Quiet quiet;            /* a proof that no step has to look */

    /* vertices, and groups of them */
    /* [m], [m/s] (places.count x 3) copied from the lanes: quicker to look up; v is that of now within the
     * guard, else that before the kick */
    double *x, *v;
    unsigned char *held; /* (places.count) moved by a handle or a mesh's programme */
    double *weight_kept; /* [1/kg] (vertex_count) lanes weight without contact */
    Groups groups;       /* how they move in this step */

    /* cloth with cloth and with meshes */
    bool pairs_wanted;  /* do features of two surfaces ever meet? */
    Lists lists;        /* the pairs that may */
    Asked asked;        /* which of them must be searched or looked at */
    DuePairs due;       /* those that were */
    Twins twins;        /* of pairs that push */
    Stiffness at_cloth; /* see ContactMemory; at meshes as at cloth */

    /* cloth with solids */
    Touches touches; /* what may meet them */
    TouchLook look;  /* which of it was looked at */
    SolidBristles bristles;
    Resting resting; /* groups over flat faces */
    Stiffness at_solids;

    /* obstacles, solids and meshes, (obstacle_count) each */
    Pose *poses;            /* where they are */
    Frame *frames;          /* those as axes */
    double *obstacle_speed; /* [m/s] no point of one is faster in this step */
    Programmes programmes;

    /* the kick of this step (touched.h) */
    Forces forces;
    unsigned char *is_touched; /* (vertex_count + 8) until losses are counted */
    bool some_touched;
    Push *pushes; /* (vertex_count) */
    Toll *tolls;  /* (vertex_count) of those touched */
    Loss *losses; /* of chunks of vertices */

    /* the guard of this step */
    Impulses *impulses; /* NULL: the law and planes */
    int *changed;       /* (changed_count) vertices whose velocity it changed */
    int changed_count;
    unsigned char *is_changed; /* (vertex_count) */
    Vec3 *kicked;              /* [m/s] (vertex_count) of those: before it did */
    double *scale;             /* (vertex_count) share of a motion that the planes leave */
};

static inline double *contact_vertex_bristle(const Contact *c, int place, int obstacle) {
    return c->bristles.vertices +
           3 * ((size_t)place * (size_t)c->def->obstacle_count + (size_t)obstacle);
}
/* of side k of a triangle that is its first; and the edge of a side */
static inline int contact_side(const Contact *c, const Touch *touch, int k) {
    int edge = c->surface.sides[3 * (size_t)touch->triangle + (size_t)k];
    return edge * c->def->obstacle_count + touch->obstacle;
}
static inline const int *contact_side_places(const Contact *c, int side) {
    return c->surface.edges + 2 * (size_t)(side / c->def->obstacle_count);
}
/* groups of cloth come before those of meshes */
static inline int contact_cloth_groups(const Contact *c) {
    return c->surface.first_group[c->def->panel_count];
}
/* owners of touches (touch.h) */
static inline int contact_owners(const Contact *c) {
    return contact_cloth_groups(c) * c->def->obstacle_count;
}
static inline Points contact_positions(const Contact *c) { return (Points){c->x}; }
void contact_gather(Contact *c); /* after positions changed */
static inline Vec3 contact_velocity(const Contact *c, int place) {
    return vec3_load(c->v + 3 * (long)place);
}
/* [1/kg] 0 for what a handle or a programme moves */
static inline double contact_mobility(const Contact *c, int place) {
    return c->held[place] ? 0.0 : c->weight_kept[place];
}

/* [kg] that a crowded vertex has at least in a kick */
static inline double contact_inertia(const Contact *c, double stiffness) {
    bool scaled = c->view.stiffer > 1.0;
    return stiffness * c->step * c->step / (scaled ? CONTACT_STABLE_SCALED : CONTACT_STABLE_SHARE);
}

/* losses.c, with the velocities at the end of a step in c->v: losses of those touched; then their sum. */
ParallelLoop contact_losses_loop(Contact *c);
void contact_sum_losses(Contact *c);

/* contact.c, for both kinds of contact */
/* Room for so many forces. */
void contact_make_force_room(Contact *c, int most);
/* Inelastic: lifts the normal velocity of that point from `approach` to `wanted` [m/s]; nothing, and false,
 * when it is higher or hardly anything there is free. Keeps the gap out of the steep part of the law. `carried` [m/s]: of what is met
 * and follows a programme, which works on the cloth. */
bool contact_impulse(Contact *c, int count, const int *place, const double *weight, Vec3 normal,
                     Vec3 carried, double approach, double wanted);
/* A vertex uses at most a share of the room [m] that it has over a plane with normal `away`. */
void contact_hold_back(Contact *c, int place, Vec3 away, double room, double dt);
/* Notes a motion that must shrink to `share`. */
void contact_shorten(Contact *c, int place, double share);
void contact_mark_changed(Contact *c, int place); /* before it is */

/* obstacle_mesh.c: their places; features meet those of the cloth in self.c */
void mesh_begin(Contact *c);                           /* to where the clocks stand */
void mesh_demand(Contact *c, int obstacle, double dt); /* after c->next was set */
/* phi for a mesh, see free_share in obstacle_motion.c */
double mesh_free_share(const Contact *c, int obstacle, double dt);
void mesh_move(Contact *c, int obstacle, double phi);
/* the mesh that a pair is at, or -1 */
int pair_obstacle(const Contact *c, const Pair *pair);
/* How far the mesh side of a pair will reach beyond its closest point [m]; `away` is the normal
 * from the mesh to the cloth. */
double mesh_reach(const Contact *c, const Pair *pair, Vec3 away);

#endif
