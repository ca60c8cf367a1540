/* impact_zone.h: rigid impact zones (Provot 1997): vertices that still collide after all impulses move
 * on as one rigid body.
 *
 *   x_c, v_c by mass,  L = sum m r x (v - v_c),  J = sum m (|r|^2 I - r r'),  r = x - x_c,
 *   omega = J^+ L,  v = v_c + omega x r,  with x of the start of the step.
 *
 * Among all rigid motions this is the nearest one in kinetic energy: momentum and angular momentum stay,
 * the energy never rises. J^+ is the pseudo-inverse: vertices on a line do not turn about it. In a step
 * |r + t omega x r| >= |r|: no two points of a zone come nearer, so it never collides with itself. Folds
 * are glued as long as it lasts. */
#ifndef TOILE_CONTACT_IMPACT_ZONE_H
#define TOILE_CONTACT_IMPACT_ZONE_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/base/vec.h"

/* The motion v [m/s] (count) of vertices at x [m] (count) becomes rigid. A mass [kg] of INFINITY is
 * moved by a handle or a programme and keeps its velocity: all others then follow the rigid motion
 * nearest to those. At a solid the motion is that of the solid, `lead` [m/s] (count); NULL: at none. False,
 * and nothing changed, when the driven ones move unlike any rigid body, or unlike `lead`. */
bool impact_zone_settle(int count, const double *mass, const Vec3 *x, const Vec3 *lead, Vec3 *v);

#define ZONE_FREE (-1)  /* at no solid */
#define ZONE_STILL (-2) /* at solids that stand */
#define ZONE_TORN (-3)  /* at two that do not move as one */

/* Which places are in which zone. */
typedef struct ImpactZones {
    int *parent;  /* (place_count) towards the root of its zone; -1: in none */
    int *next;    /* (place_count) the next place of its zone, around */
    int *members; /* (member_count) all places in zones, as they came */
    int *solid;   /* (place_count) of roots: the solid that it is at, or one of ZONE_... */
    int member_count;
} ImpactZones;

ImpactZones impact_zones_create(int place_count, Arena *arena);
void impact_zones_clear(ImpactZones *zones);
/* These places, and their zones, become one zone, which is at `solid` too. */
void impact_zones_join(ImpactZones *zones, int count, const int *place, int solid);
/* The root of the zone of a place, or -1. */
int impact_zones_root(ImpactZones *zones, int place);
int impact_zones_count(ImpactZones *zones);

#endif
