/* quiet_blocks.h: trees of blocks of all panels, with bounds of where each is and how it is bent. */
#ifndef TOILE_CONTACT_QUIET_BLOCKS_H
#define TOILE_CONTACT_QUIET_BLOCKS_H

#include "sim/contact/slope_batch.h"
#include "sim/contact/slopes.h"
#include "sim/geom/lanes.h"

/* A part of a leaf of a lattice. */
typedef struct QuietStrip {
    Box place; /* [m] */
    Slopes slopes;
} QuietStrip;

/* The columns of cells of a leaf of a lattice (axis 0), its rows (axis 1). */
typedef struct QuietStrips {
    QuietStrip strip[2][SURFACE_BLOCK];
} QuietStrips;

typedef struct QuietLevel {
    int across, along; /* blocks along u and v; one row where there is no lattice */
    Box *places;       /* [m] (across x along) */
    /* On lattices block (i, j) is number j pitch + i; the row after the last one is that again, the column
     * after the last one likewise, or the first one where u runs around. */
    int pitch, room;
    SlopeField slopes; /* (room) */
    float *window;     /* (room) quiet_blocks_window; NaN: not asked yet */
} QuietLevel;

#define QUIET_MOST_LEVELS 32

typedef struct QuietPanel {
    int level_count; /* the last one has one block; 0: no triangles */
    QuietLevel level[QUIET_MOST_LEVELS];
    /* on lattices */
    double least;   /* slope at which features without a common vertex may touch */
    double motion;  /* [m] spread of neighbours (ContactMotion) that changes gradients by 1 */
    double line[2]; /* h1, h2 over `motion`: spreads by which two lines come nearer, along u, v */
    /* Nodes of all leaves, packed: [m] coordinate a of node (3 i + c, 3 j + m) is in row 9 a + 3 m + c, as
     * number j pitch + i. */
    float *packed;       /* (27 x room of the leaves), from the origin on */
    double origin[3];    /* [m] */
    float *cells[2];     /* (room of the leaves) along u and v */
    QuietStrips *strips; /* (leaves) on lattices, of those that were cut */
    unsigned char *cut;  /* (leaves) bit of each axis along which it was */
} QuietPanel;

/* Where the vertices are: those of cloth in lanes, others (of meshes) in x. The nodes of a row of a lattice follow
 * each other in lanes. */
typedef struct QuietView {
    const Surface *surface;
    double *const *lanes; /* 3 */
    const int *slot;      /* (cloth_count) */
    int cloth_count;
    const double *x; /* [m] (places x 3) */
    const SlopeKernel *kernel;
} QuietView;

const SlopeKernel *quiet_blocks_kernel(VectorWidth width);

QuietPanel *quiet_blocks_create(const Surface *surface, Arena *arena);

/* Bounds of the positions of now; forgets windows and strips. */
void quiet_blocks_fit(const QuietView *view, QuietPanel *panel, int p);

/* Cells of a leaf along u (axis 0) or v (1). */
int quiet_blocks_cells(const SurfacePanel *panel, const int block[2], int axis);

static inline Slopes quiet_slopes_at(const QuietLevel *level, int i, int j) {
    return slope_field_at(&level->slopes, j * level->pitch + i);
}

/* s_min(P C) - e over a block of a lattice, that right of it and those above both, as far as there are any */
double quiet_blocks_window(const SlopeKernel *kernel, const QuietLevel *level, int i, int j);

/* Strips of a leaf, one after the other along an axis. */
const QuietStrip *quiet_blocks_cut(const QuietView *view, const QuietPanel *panel, int p,
                                   const int block[2], int axis);

static inline bool quiet_is_lattice(const Surface *surface, int panel) {
    return surface->panels[panel].nu > 0;
}

#endif
