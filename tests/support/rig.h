/* rig.h: a cloth whose motion the test prescribes, and the distances of all its features, against which quiet.h
 * is held. */
#ifndef TOILE_TESTS_SUPPORT_RIG_H
#define TOILE_TESTS_SUPPORT_RIG_H

#include "sim/contact/engine.h"
#include "tests/support/strips.h"

#define RIG_STEP 1e-4 /* [s] */

typedef struct Rig {
    Bench bench;
    Motion rest;
    ContactObstacle ball;
    ContactDef def;
    ContactMemory memory;
    Lanes lanes;
    int *slot;
    unsigned char *held;
    double *marked[3]; /* [m] */
    int ahead;         /* proofs that were ahead of the cloth */
    bool continues;
    bool unframed; /* the drift bounds neighbours by the speeds of all nodes only */
    Contact *contact;
} Rig;

static inline int rig_count(const Rig *r) { return r->def.vertex_count; }

Vec3 rig_place(const Rig *r, int i);
double rig_mutual(const Rig *r); /* [m/s] box of all velocities */
double rig_relative(void *owner);
double rig_fastest(void *owner);

/* A sheet of 24 cm of nodes x nodes, or a sleeve, and a ball of 2 cm at `centre`. */
void rig_make(Rig *r, int nodes, bool sleeve, Vec3 centre);

/* Begins an interval; is it quiet? */
bool rig_begin(Rig *r);

/* [m] Least distance of any two features without a common vertex, and of any vertex to the ball, less the
 * contact distance. */
double rig_apart(Rig *r);

typedef Vec3 RigProgramme(const Rig *rig, int node, double time);

/* Steps along a programme while the proof holds; returns the time when it ended, or `seconds`. What quiet
 * keeps of paths is checked in every step. *least [m]: how near anything was to touching at `checks` times. */
double rig_play(Rig *r, RigProgramme *programme, double seconds, int checks, double *least);

#endif
