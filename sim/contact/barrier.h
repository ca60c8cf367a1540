/* barrier.h: contact on the implicit road: energy, gradient and stiffness of all contacts at given
 * positions, the clamp that keeps motions legal, and the memory of friction.
 *
 * The same law as on the explicit road, so that both give the same gap and the same friction:
 * contact_law with k = share m / reference_step^2. It acts on
 *   at solids   every vertex; every edge whose nearest point lies inside it (one for a triangle would
 *               jump along a cylinder or a box edge) and every face that comes nearer than its edges,
 *               both by contact_share_inside;
 *   on cloth    vertex-face pairs, those clamped to an edge or a vertex once; edge-edge pairs when
 *               both nearest points lie inside.
 *
 * Gradient: -w_a (f n - friction) on vertex a, with the shares of sides and faces held: their slopes would
 * push a side and its ends apart, and the explicit road has none. Stiffness (Gauss-Newton, positive semidefinite):
 * w_a w_b S, S = f' n n' + friction. Blocks between vertices that the cloth couples are kept, all
 * others are lumped: |w_a w_b| S on both diagonal blocks, which majorises. A face or
 * an edge at a round solid adds what its tilt does to the gap:
 * f (R + d) (grad w_a . grad w_b) n n'.
 *
 * Friction: the bristle t of each contact is stretched by the relative tangential motion since the
 * start of the step:
 *
 *   |kt t| <= mu f   sticks: force -kt t, stiffness kt (I - n n')
 *   else             slips: force -mu f s, s = t / |t|, stiffness mu f / |t| (I - n n' - s s')
 *
 * The force is continuous; Newton must cut its steps where they pass from one to the other
 * (NewtonParams.cut), or it runs to and fro between them. f is that of the iterate.
 *
 * All loops are serial and in the order of the candidates: the same bits for any thread count. */
#ifndef TOILE_CONTACT_BARRIER_H
#define TOILE_CONTACT_BARRIER_H

#include "sim/contact/clamp.h"

typedef struct Barrier Barrier;

typedef struct BarrierReport {
    int contacts;                           /* with a force */
    double smallest_gap, smallest_self_gap; /* [m] INFINITY: none */
} BarrierReport;

Barrier *barrier_create(const ContactDef *def, Arena *arena);

/* A new step: it starts at x [m] (vertex_count x 3) with this memory; both stay borrowed.
 * held: (vertex_count) 1: moved by a handle. */
void barrier_begin(Barrier *barrier, const ContactMemory *memory, const double *x,
                   const unsigned char *held);

/* The next clamp moves the obstacles too, towards where they want to be at time_end [s], and at
 * most as far as contact_next_clock; where cloth cannot yield they wait. */
void barrier_drive(Barrier *barrier, double time_end, double dt);
/* [J] that moving obstacles did on the cloth in this step, by the forces of now. */
double barrier_work(const Barrier *barrier);
/* [J] that friction took in this step, by the forces of now; bristles give some of it back. */
double barrier_friction(const Barrier *barrier);

/* Finds the contacts at x. What follows speaks of them. */
BarrierReport barrier_look(Barrier *barrier, const double *x);

/* [J] of the normal forces. */
double barrier_energy(const Barrier *barrier);
/* [N] adds to g (vertex_count x 3). */
void barrier_add_gradient(const Barrier *barrier, double *g);
/* Calls add(context, a, b, block) for blocks [N/m] (3 x 3, symmetric) of the stiffness; a == b once
 * or more, a != b once for both triangles. add returns false when (a, b) is not in the pattern:
 * then the block is lumped. */
typedef bool BarrierAdd(void *context, int a, int b, const double block[9]);
void barrier_add_stiffness(Barrier *barrier, BarrierAdd *add, void *context);
/* y += (true - lumped stiffness) p for the blocks that were lumped last. False: there are none. */
bool barrier_add_lumped(const Barrier *barrier, const double *p, double *y);

/* 1 in flags for vertices with a contact force; others stay. */
void barrier_mark(const Barrier *barrier, unsigned char *flags);

/* See clamp_motion; *changed (vertex_count) 1: clamped by this motion, until the next one. */
double barrier_clamp(Barrier *barrier, const double *x, double *dx, const unsigned char **changed);

/* What memory becomes when the positions that were looked at last are accepted: bristles, poses. */
void barrier_end(const Barrier *barrier, ContactMemory *memory);

/* Triangles that cross each other, or reach into an obstacle, at x; by sim/geom/crossing.h. */
int barrier_count_crossings(const Barrier *barrier, const double *x);

#endif
