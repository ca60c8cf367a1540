/* constants.h: the numbers of the contact law, its lists and its guard, all relative to the
 * contact distance dhat, the step, or the vertex mass (contact.md). */
#ifndef TOILE_CONTACT_CONSTANTS_H
#define TOILE_CONTACT_CONSTANTS_H

/* k = share * m / dt^2. Larger pumps energy, smaller sinks deeper (g dt^2 / share at rest). */
#define CONTACT_STIFFNESS 0.2       /* against obstacles */
#define CONTACT_SELF_STIFFNESS 0.06 /* many pairs share a vertex */
/* Where the guard's impulses have to hold the cloth, which shakes what rests there, the law is too soft: it
 * is made stiffer, and slowly softer again while there is room. */
#define CONTACT_MOST_IMPULSES 0.5 /* per step */
#define CONTACT_ROOMY 0.3   /* of dhat: nothing came nearer; more than one softening above 0.2 */
#define CONTACT_STIFFER 1.5 /* from one interval to the next */
#define CONTACT_SOFTER 0.95
#define CONTACT_MOST_STIFFNESS 0.8      /* at solids: no inertia for one contact of a vertex */
#define CONTACT_MOST_SELF_STIFFNESS 4.2 /* between cloths; 6.4 shakes tight twists */
#define CONTACT_FULL_STEP_STIFFNESS 0.8 /* what is stiffer may feed cloth that moves */
#define CONTACT_CROWDED 0.05 /* pairs of cloth for a vertex: a drape has 0.03, folds on folds 0.5 */
#define CONTACT_MESH_STIFFNESS 0.4 /* most at meshes, where it follows the step */
#define CONTACT_DAMPING 0.1        /* of critical, along the normal; 0.2 pumps with many pairs */
#define CONTACT_SELF_DAMPING 0.05
#define CONTACT_LOG_BELOW 0.5      /* of dhat: the law turns logarithmic */
#define CONTACT_LEAST_GAP 1e-6     /* of dhat: keeps the logarithm finite; the guard keeps 0.02 */
#define CONTACT_STABLE_SHARE 1.4   /* of 4 = dt^2 lambda: what the membrane leaves at courant 0.8 */
#define CONTACT_STABLE_SCALED 1.95 /* the same with scaled inertia: waves at the limit are short */
#define CONTACT_PARALLEL 0.01      /* sine^2 below which pairs of edges lose stiffness */

/* of dhat: a side that is nearer to a solid than its ends by less, or a face than its sides, loses stiffness. Such
 * forces have no potential: below 0.1 some sheets swing on them for ever, from 0.3 on others do. */
#define CONTACT_FADE 0.2

#define CONTACT_FROZEN_SHARE 0.02 /* of dhat: motion of a vertex that leaves its normal */
#define CONTACT_LEVEL 1e-6 /* of dhat: a corner that is lowest by less needs no exact search */

#define CONTACT_BRISTLE_SHARE 0.5   /* tangential / normal stiffness */
#define CONTACT_BRISTLE_DAMPING 0.3 /* of critical */

#define CONTACT_IMPULSE_GAP 0.2 /* of dhat: impulses act before the gap falls below this */
/* steps of motion: pairs farther apart are not asked for impulses, which change speeds */
#define CONTACT_IMPULSE_RESERVE 2.0
#define CONTACT_PLANE_SHARE 0.9 /* of the room to the plane that one step may use */
/* of dhat, at obstacles: never nearer; without it gaps reach 1e-12 m */
#define CONTACT_PLANE_FLOOR 0.02
#define CONTACT_MIDDLE_FLOOR 0.01 /* of dhat, on either side of the plane between two cloths */
#define CONTACT_YIELD_SHARE 0.95  /* of the room left that an obstacle may use */
#define CONTACT_CATCH_UP 1.25     /* of dt: fastest clock of an obstacle that fell behind */
#define CONTACT_LEAP_AFTER 2.0    /* steps: so late, it may skip what lies between */

#define CONTACT_NEAR_STEPS 2.0       /* steps of relative motion within which pairs are evaluated */
#define CONTACT_LEAST_NEAR_STEPS 1.2 /* a list with less room is made again; 1 is the bound */
#define CONTACT_SLACK_STEPS 20.0     /* steps until pairs are looked for again */
#define CONTACT_SOON_STEPS 2.0       /* a search takes those along that would want one so soon */
#define CONTACT_LONG_SLACK_STEPS 100.0 /* where few pairs are found: they cost less than searches */
#define CONTACT_LONG_SLACK 0.25 /* of the spacing, at most: neighbours come into reach beyond */
#define CONTACT_FEW_PAIRS 8
#define CONTACT_LEAST_SLACK 0.35 /* of dhat */
/* of the mobility that a point would have if no handle held cloth at it: with less, impulses would throw what is
 * free to stop what is not, and planes do instead */
#define CONTACT_LEAST_FREE 0.01
#define CONTACT_QUIET_STEPS 200.0 /* that a proof of quiet should hold: it costs some two steps */
#define CONTACT_QUIET_SHORT_STEPS 20.0 /* ... at least */
/* of what the last proof gave: what cannot be had is not looked for */
#define CONTACT_QUIET_LONGER 1.3
#define CONTACT_QUIET_LEAST_STEPS 3.0 /* that it must hold, or the lists are made */
#define CONTACT_QUIET_FOLD_STEPS 30.0 /* less is worth a look at single rows of cells */
#define CONTACT_QUIET_COST 30.0       /* of a proof, in looks at the spread of neighbours */
#define CONTACT_QUIET_SHARE 0.7       /* of the room of flat cloth is enough */
/* steps that speeds alone could use up the room of neighbours in: where less, rows get frames */
#define CONTACT_QUIET_CLOSE_STEPS 16.0
#define CONTACT_QUIET_AHEAD                                                                        \
    0.4 /* of the room of neighbours: so far a proof is ahead of the cloth */
#define CONTACT_QUIET_BEGIN 0.85    /* of a room: more is not left by one that is ahead */
#define CONTACT_QUIET_FAR_STEPS 3.0 /* after which any two vertices are looked at again */
#define CONTACT_QUIET_RETRY 20.0    /* steps until the next try */
#define CONTACT_VERTEX_GRAIN 1024   /* vertices that a thread takes at once; a multiple of 8 */
#define CONTACT_PARTS 8             /* of the forces at solids, at most */
#define CONTACT_LEAST_PART 64       /* forces of a part, some 5 us */
#define CONTACT_GROUP_REACH 0.4     /* of the size of a group: how far neighbours are listed */

/* ---- implicit road ---- */

#define CONTACT_CORE 0.1        /* of dhat: the clamp never lets a pair nearer; 0.25 crowds heaps */
#define CONTACT_CORE_SHARE 0.2  /* of the gap above the core that one motion must leave */
#define CONTACT_ENTRY 0.95      /* of dhat: how near a pair from outside may come in one motion */
#define CONTACT_INSIDE_CORE 0.9 /* of a gap below the core that one motion must leave */
#define CONTACT_CCD_NEAR 1.05   /* of the target: near enough to stop */
#define CONTACT_CCD_ADVANCE 1e-7   /* of the motion: less is no progress */
#define CONTACT_CCD_ROUNDS 64      /* then what is proven so far counts */
#define CONTACT_LIST_MARGIN 0.5    /* of dhat: room of a vertex for which pairs are looked for */
#define CONTACT_PROJECT_SEARCHES 3 /* candidates are looked for again after each */
#define CONTACT_PROJECT_ROUNDS 8
#define CONTACT_PROJECT_LEAST 0.02 /* of the approach taken out at least; 0 never ends */
#define CONTACT_HALVE_AFTER 12     /* rounds of shortening after which shares are halved */
#define CONTACT_STOP_AFTER 20      /* ... after which blocked nodes stay where they are */
#define CONTACT_PINCHED 0.999      /* of a gap below the core that a moving obstacle must leave */
#define CONTACT_MOST_TURN 0.1      /* [rad] of an obstacle in one step: arcs are taken as chords */
#define CONTACT_REST_SHARE 0.5 /* of the rest distance of two features of one panel: largest dhat */

#endif
