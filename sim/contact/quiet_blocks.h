/* quiet_blocks.h: trees of blocks of all panels, with bounds of where each is and how it is bent. */
#ifndef TOILE_CONTACT_QUIET_BLOCKS_H
#define TOILE_CONTACT_QUIET_BLOCKS_H

#include "sim/contact/slope_batch.h"
#include "sim/contact/slopes.h"
#include "sim/geom/lanes.h"

typedef struct QuietBlock {
    Box place;     /* [m] */
    Slopes slopes; /* on lattices only */
} QuietBlock;

/* The columns of cells of a leaf of a lattice (axis 0), its rows (axis 1). */
typedef struct QuietStrips {
    QuietBlock strip[2][SURFACE_BLOCK];
} QuietStrips;

typedef struct QuietLevel {
    int across, along; /* blocks along u and v; one row where there is no lattice */
    QuietBlock *blocks;
    /* [m] room of every block with those right of it and above; NaN: not asked yet */
    double *window;
} QuietLevel;

#define QUIET_MOST_LEVELS 32

typedef struct QuietPanel {
    int level_count; /* the last one has one block; 0: no triangles */
    QuietLevel level[QUIET_MOST_LEVELS];
    /* on lattices */
    double least;        /* slope at which features without a common vertex may touch */
    double motion;       /* [m] spread of neighbours (ContactMotion) that changes gradients by 1 */
    double line[2];      /* h1, h2 over `motion`: spreads by which two lines come nearer, along u, v */
    QuietStrips *strips; /* (leaves) on lattices, of those that were cut */
    unsigned char *cut;  /* (leaves) bit of each axis along which it was */
} QuietPanel;

/* Where the vertices are: those of cloth in lanes, others (of meshes) in x. */
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

/* Slopes of SLOPE_BATCH blocks, each of SLOPE_PARTS others; some may be the same. */
void quiet_blocks_join(const SlopeKernel *kernel, const Slopes *part[][SLOPE_PARTS], Slopes *all[]);

/* Bounds of the positions of now; forgets windows and strips. */
void quiet_blocks_fit(const QuietView *view, QuietPanel *panel, int p);

/* Cells of a leaf along u (axis 0) or v (1). */
int quiet_blocks_cells(const SurfacePanel *panel, const int block[2], int axis);

/* Strips of a leaf, one after the other along an axis. */
const QuietBlock *quiet_blocks_cut(const QuietView *view, const QuietPanel *panel, int p,
                                   const int block[2], int axis);

static inline bool quiet_is_lattice(const Surface *surface, int panel) {
    return surface->panels[panel].nu > 0;
}

#endif
