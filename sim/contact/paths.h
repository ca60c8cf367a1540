/* paths.h: the relative paths of all group pairs (lists.h) as one row per number. Every step asks all of
 * them, so that is done by row loops that vectorise; the same bits for every width. */
#ifndef TOILE_CONTACT_PATHS_H
#define TOILE_CONTACT_PATHS_H

#include "sim/base/vector.h"
#include "sim/contact/motion.h"

/* The groups of a pair. */
typedef struct PathEnds {
    int a, b; /* a <= b */
} PathEnds;

/* What is asked of a group pair. */
enum {
    PATH_WANTED = 1, /* must it be searched at its speed? */
    PATH_SPENT = 2,  /* ... because its path will pass its limit? */
    PATH_SOON = 4,   /* ... in CONTACT_SOON_STEPS more? */
    PATH_DUE = 8     /* must pairs of it be looked at then? */
};

/* (room) each */
typedef struct PathRows {
    PathEnds *ends;
    double *path;         /* [m] relative motion since it was made */
    double *next;         /* [m] path at the end of this step */
    double *limit;        /* [m] path until which its pairs are complete */
    double *near;         /* [m] see CONTACT_NEAR_STEPS; -1: never searched */
    double *speed;        /* [m/s] bound of the relative speed in this step */
    double *earliest;     /* [m] path at which the first of its pairs must be looked at */
    unsigned char *flags; /* answers */
} PathRows;

/* A question about all of them: is `near` less than CONTACT_LEAST_NEAR_STEPS; can a step use up
 * more than CONTACT_PLANE_SHARE of it; where do paths lead, by known speeds; by those asked about. */
typedef enum Question { OUTGROWN, OUTRUN, ADVANCED, FORESEEN } Question;

/* Can `steps` steps of dt [s] use up more than a share of `near`? */
typedef struct PathQuestion {
    double steps, share, dt;
} PathQuestion;

/* Group pairs first .. end - 1: paths of a step of dt into `next`, and answers. */
typedef struct PathKernel {
    /* to all three questions, with speeds from the motion */
    void (*ask)(const PathRows *rows, const GroupMotion *motion, const PathQuestion *question,
                int first, int end);
    /* to the last two, by known speeds */
    void (*advance)(const PathRows *rows, int first, int end, double dt);
} PathKernel;

extern const PathKernel path_kernel_scalar, path_kernel_sse2, path_kernel_avx2, path_kernel_avx512;

#endif
