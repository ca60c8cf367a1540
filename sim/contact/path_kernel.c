/* path_kernel.c: the row loops of paths.h. Compiled once per vector width (see the Makefile). */
#include "sim/contact/constants.h"
#include "sim/contact/paths.h"

#define BATCH 128 /* group pairs whose motions are looked up at once */

/* How two groups move against each other, number by number. */
typedef struct Meeting {
    double square[BATCH];                          /* [m2/s2] of their middles */
    double deviation_a[BATCH], deviation_b[BATCH]; /* [m/s] */
} Meeting;

static void look_up(const PathEnds *ends, const GroupMotion *motion, int count, Meeting *meeting) {
    for (int k = 0; k < count; k++) {
        const GroupMotion *a = &motion[ends[k].a], *b = &motion[ends[k].b];
        Vec3 apart = vec3_sub(a->velocity, b->velocity);
        meeting->square[k] = vec3_dot(apart, apart);
        meeting->deviation_a[k] = a->deviation;
        meeting->deviation_b[k] = b->deviation;
    }
}

/* Rows from one group pair on. */
typedef struct Batch {
    const double *restrict path, *restrict limit, *restrict near, *restrict earliest;
    double *restrict speed, *restrict next;
} Batch;

static inline Batch batch_at(const PathRows *rows, int first) {
    return (Batch){rows->path + first,     rows->limit + first, rows->near + first,
                   rows->earliest + first, rows->speed + first, rows->next + first};
}

/* as a number: bytes among them would make vectors of bytes */
static inline double answer(double next, double motion, double limit, double earliest) {
    double spent = next > limit ? PATH_SPENT : 0.0, due = next >= earliest ? PATH_DUE : 0.0;
    double soon = next + CONTACT_SOON_STEPS * motion > limit ? PATH_SOON : 0.0;
    return spent + soon + due;
}

static inline void write_flags(unsigned char *restrict flags, const double *restrict answers,
                               int count) {
    VECTOR_LOOP
    for (int k = 0; k < count; k++) {
        flags[k] = (unsigned char)(int)answers[k];
    }
}

static void ask(const PathRows *rows, const GroupMotion *motion, const PathQuestion *question,
                int first, int end) {
    const double dt = question->dt, steps = question->steps, share = question->share;
    Meeting m;
    double answers[BATCH];
    for (int at = first; at < end; at += BATCH) {
        int count = end - at < BATCH ? end - at : BATCH;
        Batch b = batch_at(rows, at);
        look_up(rows->ends + at, motion, count, &m);
        VECTOR_LOOP
        for (int k = 0; k < count; k++) {
            double speed = __builtin_sqrt(m.square[k]) + m.deviation_a[k] + m.deviation_b[k];
            double moved = speed * dt, next = b.path[k] + moved;
            double wanted = steps * moved > share * b.near[k] ? PATH_WANTED : 0.0;
            b.speed[k] = speed;
            b.next[k] = next;
            answers[k] = wanted + answer(next, moved, b.limit[k], b.earliest[k]);
        }
        write_flags(rows->flags + at, answers, count);
    }
}

static void advance(const PathRows *rows, int first, int end, double dt) {
    double answers[BATCH];
    for (int at = first; at < end; at += BATCH) {
        int count = end - at < BATCH ? end - at : BATCH;
        Batch b = batch_at(rows, at);
        VECTOR_LOOP
        for (int k = 0; k < count; k++) {
            double moved = b.speed[k] * dt, next = b.path[k] + moved;
            b.next[k] = next;
            answers[k] = answer(next, moved, b.limit[k], b.earliest[k]);
        }
        write_flags(rows->flags + at, answers, count);
    }
}

const PathKernel VECTOR_JOIN(path_kernel_, VECTOR_VARIANT) = {ask, advance};
