/* engine.h: what the files of the explicit contact share. Not for others. */
#ifndef TOILE_CONTACT_ENGINE_H
#define TOILE_CONTACT_ENGINE_H

#include "sim/base/error.h"
#include "sim/base/parallel.h"
#include "sim/contact/constants.h"
#include "sim/contact/contact.h"
#include "sim/contact/motion.h"
#include "sim/contact/places.h"
#include "sim/contact/quiet.h"
#include "sim/contact/resting.h"
#include "sim/contact/touched.h"

/* A pair that is near in this step, and its group pair. */
typedef struct DuePair {
    int pair, owner;
} DuePair;

/* Of two that stand for one contact, the second follows the bristle of the first. */
typedef struct Follower {
    int second, first;
} Follower;

/* A contact that several pairs may stand for, and the pair that came first. */
typedef struct Twin {
    int key[3], pair; /* pair < 0: a free place */
} Twin;

/* How hard one kind of contact pushes, and what asks for more or less of it. */
typedef struct Stiffness {
    double share;    /* of m / step^2 */
    double impulses; /* of the guard, in this interval */
    double room;     /* smallest distance / contact distance in it */
} Stiffness;

typedef struct Impulses Impulses;
typedef struct GroupsMove GroupsMove;

struct Contact {
    const ContactDef *def;
    Arena *arena;
    Places places;
    Surface surface; /* that of places */
    Lists lists;
    ContactView view;        /* of this interval */
    bool pairs_wanted;       /* do features of two surfaces ever meet? */
    double *x, *v;           /* [m], [m/s] (places.count x 3) copied from the lanes: quicker to look
                                up; v is that of now within the guard, else that before the kick */
    unsigned char *held;     /* (places.count) moved by a handle or a mesh's programme */
    MotionRows rows;         /* where those lie in the lanes */
    GroupMotion *motion;     /* (group_count) */
    GroupsMove *moves;       /* of chunks of them */
    Vec3 mean;               /* [m/s] of groups of cloth in the last step */
    double fastest_relative; /* [m/s] no group is faster against `mean` */
    bool outgrown;           /* does a group move too fast for its `near` at a solid? */
    bool narrow;             /* ... so fast that the guard has to look at touches? */
    int *vertex_group_begin; /* (places.count + 1) */
    int *vertex_groups;      /* groups of every vertex */
    int *wanted;             /* (wanted_count) group pairs to be searched */
    int wanted_count, wanted_room, due_owner_count;
    int *wanted_counts;   /* of chunks of them */
    int *due_owners;      /* (due_owner_count) group pairs with pairs to be looked at */
    int *near_counts;     /* (due_owner_count) near pairs of each */
    Question question;    /* the last one, ... */
    double asked_step;    /* [s] ... for a step of that */
    bool foreseen;        /* paths.next is where the step that was asked about leads */
    bool advanced;        /* wanted and the answers are those of the paths of now */
    int *near_pairs;      /* (due_room) those of each from its `begin` on */
    ContactForce *forces; /* (force_room) of the pairs or touches that push, one kind at a time */
    ForceEnds *ends;      /* (force_room) of pairs, where threads share the vertices */
    int force_room;
    int *pushing;        /* (pushing_count) which those are */
    int *left;           /* (force_room) those that are added after the others */
    Follower *followers; /* (follower_count) of this step */
    int pushing_count, follower_count;
    DuePair *due_pairs; /* pairs evaluated in this step */
    int due_count, due_room;
    int *tight;  /* pairs that impulses may have to hold apart */
    Twin *twins; /* (twin_room) hash table of contacts that already gave a force */
    int twin_room, twin_count;
    int *twin_places;          /* (twin_count) used places of the table */
    unsigned char *is_touched; /* (vertex_count + 8) until losses are counted, see touched.h */
    bool some_touched;
    Loss *losses;                       /* of chunks of vertices */
    Push *pushes;                       /* (vertex_count) */
    Toll *tolls;                        /* (vertex_count) of those touched */
    double step, kick_time, step_count; /* [s] of this step, of its kick; steps in this interval */
    Stiffness at_cloth, at_solids;      /* see ContactMemory; at meshes as at cloth */
    double *scale;                      /* (vertex_count) share of a motion that the planes leave */
    int *changed;                       /* vertices whose velocity the guard changed */
    Vec3 *kicked;                       /* [m/s] (vertex_count) of those: before it did */
    unsigned char *is_changed;
    int changed_count;
    double level_step;   /* [m] how much nearer any two groups come in this step, at most */
    double *weight_kept; /* [1/kg] (vertex_count) lanes weight without contact */
    /* obstacles */
    GroupTouch *group_touches; /* (group_count x obstacle_count) */
    int *due_groups;           /* likewise: with touches to be looked at */
    Touch *touches;            /* (touch_end) in blocks of groups, which are not full */
    double *touch_due;         /* [m] (touch_end) path of the group at which it must be looked at */
    int touch_count, touch_end, touch_room; /* touch_count: of all groups */
    int *due_touches;   /* (due_touch_count) that are near; listed where impulses or motions ask */
    int *looked;        /* (touch_room) triangles of each group from its `begin` on */
    int *near_touches;  /* (touch_room) likewise */
    LookSum *look_sums; /* of chunks of groups */
    bool solids_move;
    int due_touch_count, due_group_count;
    Resting resting;                /* groups over flat faces */
    int *spent_groups;              /* (group_count x obstacle_count) that want to be searched */
    int *due_counts, *spent_counts; /* of chunks of groups */
    bool touches_asked;             /* these are known for the paths of now */
    VertexDistance *distances;      /* (vertex_count x obstacle_count) */
    SideTouch *sides;    /* (side_count: edges of cloth x obstacle_count) where a solid is */
    Vec3 *side_bristles; /* (side_count) */
    int side_count;
    bool sides_rub;     /* does any of them have a bristle? */
    Pose *poses, *next; /* (obstacle_count) now; demanded at the end of the step */
    Frame *frames;      /* (obstacle_count) of poses */
    double *clocks, *next_clocks, *obstacle_speed;
    double *mesh_target;      /* [m] (places of meshes x 3) demanded at the end of the step */
    double *bristles;         /* [m] (vertex_count x obstacle_count x 3) */
    PairMemory *touch_memory; /* bristles of edges and faces at obstacles from the last interval */
    int touch_memory_count, touch_memory_room;
    Impulses *impulses; /* NULL: the law and planes */
    Quiet quiet;
    ContactStatistics statistics;
};

static inline double *contact_vertex_bristle(const Contact *c, int place, int obstacle) {
    return c->bristles + 3 * ((size_t)place * (size_t)c->def->obstacle_count + (size_t)obstacle);
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
/* groups of cloth at obstacles: group g at obstacle o is number g x obstacle_count + o */
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

/* groups.c: velocities from the lanes and how groups move by them in a step of dt; of what the guard changed. */
void contact_move_groups(Contact *c, double dt);
void contact_move_changed_groups(Contact *c, double dt);
GroupsMove *contact_moves_create(int groups, Arena *arena);

/* losses.c, with the velocities at the end of a step in c->v: losses of those touched; then their sum. */
ParallelLoop contact_losses_loop(Contact *c);
void contact_sum_losses(Contact *c);

/* contact.c, for both kinds of contact */
/* Room for so many forces. */
void contact_make_force_room(Contact *c, int most);
/* The index that came first with this key since contact_clear_twins, or -1: `index` is the first. */
int contact_find_twin(Contact *c, const int key[3], int index);
void contact_clear_twins(Contact *c, int most); /* and makes room for so many */
/* Inelastic: lifts the normal velocity of that point from `approach` to `wanted` [m/s]; nothing
 * when it is higher. Keeps the gap out of the steep part of the law. `carried` [m/s]: of what is met
 * and follows a programme, which works on the cloth. */
void contact_impulse(Contact *c, int count, const int *place, const double *weight, Vec3 normal,
                     Vec3 carried, double approach, double wanted);
/* A vertex uses at most a share of the room [m] that it has over a plane with normal `away`. */
void contact_hold_back(Contact *c, int place, Vec3 away, double room, double dt);
/* Notes a motion that must shrink to `share`. */
void contact_shorten(Contact *c, int place, double share);
void contact_mark_changed(Contact *c, int place); /* before it is */

/* self.c: cloth with cloth. c->motion must be that of the velocities of now. */
void self_begin(Contact *c, double dt);
void self_find(Contact *c, double dt); /* the pairs that are near at the positions of now */
void self_forces(Contact *c, double dt, double share);
void self_refresh(Contact *c, double dt);
void self_impulses(Contact *c, double dt);
void self_shorten(Contact *c, double dt);
/* After the velocities were changed: looks for pairs that may now meet. True: shorten again. */
bool self_check(Contact *c, double dt);
/* Moves all paths on by this step; after it: what that leads to is known. */
ParallelLoop self_advance_loop(Contact *c);
void self_advanced(Contact *c);
double self_energy(Contact *c, double dt);
double pair_friction(const Contact *c, const Pair *pair); /* mu */
/* [m/s] velocity of a mesh at the pair, in the sense of the weights; 0 between cloths */
Vec3 pair_carried(const Contact *c, const Pair *pair);

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
