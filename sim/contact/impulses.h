/* impulses.h: contact by repulsions and impulses (Bridson, Fedkiw, Anderson 2002) with rigid impact
 * zones (impact_zone.h), instead of the force law and the planes of contact.h. Not for others than the
 * files of the explicit contact.
 *
 * Each step, on the velocities after the kick, over the pairs of the same lists; H: contact distance,
 * d: overlap H - distance, W = sum w_k^2/m_k: mobility of the closest points, v_N: their speed apart.
 * 1. Repulsion, once: a pair nearer than H that approaches is stopped, and is parted by
 *      impulse = min(dt k d, (0.1 d/dt - v_N)/W)  if v_N < 0.1 d/dt.
 *    The bounds on sides and springs follow (sim/step).
 * 2. Collisions: pairs that would come too near in x + t v (ccd.h) get the stopping impulse -v_N/W where
 *    they would meet; again, up to five rounds, until none is left.
 * 3. Impact zones of what still collides, joined until nothing does.
 * Each normal impulse is followed by friction, which takes off the sliding speed at most mu times the
 * change of v_N. Pairs one after the other, in the order of the lists.
 *
 * Obstacles that move take part with their velocity, a mesh by those of its vertices: v_N is relative to
 * it, a solid is met in its own frame, along the straight line there between both ends of the step, and
 * a zone at it moves with it. Where cloth is pinched, that is where zones would glue too much or follow two
 * of them, or cloth ends nearer to anything than half of what a collision leaves, all that struck cloth in
 * the step wait for it, and catch up later. What they hold then may all be glued.
 *
 * There is no potential: what rests trembles within H, and glued folds lose their energy. */
#ifndef TOILE_CONTACT_IMPULSES_H
#define TOILE_CONTACT_IMPULSES_H

#include "sim/contact/engine.h"
#include "sim/contact/impact_zone.h"

/* What impulses act between: a pair, or a touch (the obstacle's own point has no weight). */
typedef struct Strike {
    int count, place[4];
    double weight[4]; /* of the closest points: + first, - second feature */
    Vec3 normal;      /* from the second to the first */
    Vec3 carried;    /* [m/s] of what is met and follows a programme, in the sense of the weights */
    double friction; /* mu */
    int obstacle;    /* that is met, or -1 */
} Strike;

struct Impulses {
    ImpactZones zones;
    int *changed;           /* (places) round in which it collided or changed its velocity last */
    int round;              /* of this step, from 1 */
    bool searched;          /* pairs may be new in this round: all of them are looked at */
    int colliding;          /* pairs in this round */
    unsigned char *strikes; /* (obstacle_count) moves, and struck cloth in this step */
    double (*given)[2];     /* [J] (obstacle_count) by it in repulsions of this step; in friction */
    bool waits;             /* an obstacle does, in this step */
    bool stuck;             /* a programme moves vertices of one zone into each other */
    double *mass;           /* [kg] (places) of the vertices of one zone */
    Vec3 *place, *move;     /* [m], [m/s] (places) likewise */
    Vec3 *lead;             /* [m/s] (places) likewise, of the solid that they are at */
};

Strike impulses_pair(const Contact *c, const Pair *pair);
Strike impulses_touch(const Contact *c, const Touch *touch, double dt);
bool impulses_all_held(const Contact *c, const Strike *strike);
/* Before and after an impulse: its places are in the books of the step, and have changed in this round. */
void impulses_note_before(Contact *c, const Strike *strike);
void impulses_note_change(Contact *c, const Strike *strike);

Impulses *impulses_create(const Contact *contact, Arena *arena);

/* Finds the near pairs; notes the velocities before the kick. */
void impulses_find(Contact *c, double dt);

/* 1 */
void impulses_repel(Contact *c, double dt);

/* 2 and 3: changes velocities so that nothing crosses in x += dt v. Sets statistics.rejected when that glues
 * too many vertices together, or cannot be. */
void impulses_guard(Contact *c, double dt);

/* v_N of a strike becomes at least `wanted` [m/s]; returns by how much it grew. */
double impulses_stop(Contact *c, const Strike *strike, double wanted);
/* Friction after v_N grew by `grown` [m/s]; returns its impulse [N s]. */
Vec3 impulses_rub(Contact *c, const Strike *strike, double grown);

#endif
