/* resample.h: a smooth surface, at any density, from the node states of a frame.
 *
 * The density is chosen once a layout (never per frame: nothing pops), so that cells are about
 * CELL_PIXELS wide on the screen. Positions and both derivatives come from the same smooth
 * function of the material coordinates, so facets never show, however few nodes there are.
 *
 *   lattice    cubic B-spline through the nodes, with analytic derivatives; closed along u when
 *              the lattice wraps around; quadratic at free borders. Every cell between nodes is cut in the same way,
 *              along its diagonal too
 *   scattered  radial basis functions through the neighbours of each surface vertex in material
 *              space, blended over the triangles of the layout
 */
#ifndef TOILE_RENDER_RESAMPLE_H
#define TOILE_RENDER_RESAMPLE_H

#include <stdint.h>

#include "sim/base/arena.h"
#include "sim/state/state.h"

/* One vertex as the graphics driver reads it. For splats normal and tangent are the derivatives of
 * the position along u and v. */
typedef struct SurfaceVertex {
    float position[3]; /* [m] */
    float normal[3];   /* unit, out of the face side */
    float tangent[3];  /* unit, along u */
} SurfaceVertex;

/* The piece of a surface that belongs to one cloth. */
typedef struct SurfacePart {
    int vertex_begin, vertex_count;
    int fine_begin, fine_count;     /* triangles in `fine` */
    int coarse_begin, coarse_count; /* triangles in `coarse` */
    int fold_begin, fold_count;     /* triangles in `folds`, of this frame */
    double corner[2];               /* [m] (u, v) of the panel's lower corner */
    double size[2];                 /* [m] of the panel */
    bool around;                    /* closed along u */
    bool rectangle;                 /* the panel fills its bounding box */
} SurfacePart;

/* All cloths of a layout. */
typedef struct Surfel Surfel; /* render/surfel.h */

typedef struct Surface {
    int part_count, vertex_count, fine_count, coarse_count;
    SurfacePart *parts;      /* (part_count) */
    SurfaceVertex *vertices; /* (vertex_count), rewritten for each frame */
    float *uv;               /* [m] (vertex_count x 2), from the panel's corner */
    float *values;           /* (vertex_count) see resample_values; NULL unless asked for */
    Surfel *surfels;         /* (vertex_count) of splats, or NULL; then vertices hold du, dv */
    float *slopes;   /* [1/m] (vertex_count x 2) of the values along u and v, of splats; or NULL */
    float *bends;    /* [1/m] (vertex_count x 6) of splats: n_u, n_v of the unit normal; or NULL */
    uint32_t *folds; /* (fold_count x 3) of splats: fine triangles with a moved corner; or NULL */
    int fold_count;
    unsigned char *moved;  /* (vertex_count) 1: drawn back to the triangles (render/apart.h) */
    uint32_t *fine;        /* (fine_count x 3) triangles to look at */
    uint32_t *coarse;      /* (coarse_count x 3) every second vertex: shadow, occlusion */
    float low[3], high[3]; /* [m] bounding box of the vertices */
} Surface;

typedef struct ResampleDef {
    double pixels_per_metre; /* on the screen, where the cloth is */
    int triangle_cap;        /* of all cloths together; 100000 */
    int triangles;           /* instead of both: about so many, whatever is seen; 0 */
    bool splats;             /* fill surfels; vertices hold derivatives; false */
    bool values;             /* make room for numbers of measuring looks; false */
    bool crossing;           /* smooth everywhere, even where layers then cross; false */
} ResampleDef;

typedef struct Piece Piece; /* render/apart.h */

/* One kind of cloth layout. */
typedef struct ResampleKind {
    const char *name;
    /* Number of vertices and triangles when a cell is `cell` [m] wide; fills the part but for its
     * begins, and remembers what it needs in arena. */
    void *(*plan)(const StateLayout *layout, int cloth, double cell, Arena *arena,
                  SurfacePart *part);
    /* Makes what stays the same for all frames, once the width of a cell is settled; may be NULL. */
    void (*prepare)(void *plan, Arena *arena);
    /* Fills uv and triangles of the part. */
    void (*connect)(const void *plan, Surface *surface, const SurfacePart *part);
    /* Where the vertices of the part stand in each of `count` simulated triangles: fills all of a piece but
     * its corners, which it may turn; triangles hold numbers of the cloth's vertices, from 0. False:
     * the part does not follow them. */
    bool (*place)(const void *plan, const SurfacePart *part, const int32_t *triangles, int count,
                  Piece *pieces);
    /* Fills the vertices of the part from x (nodes) and s (surface vertices), both [m];
     * derivatives: in place of normal and tangent. */
    void (*evaluate)(void *plan, const double *x, const double *s, bool derivatives,
                     SurfaceVertex *vertices);
} ResampleKind;

extern const ResampleKind resample_lattice, resample_scattered;

typedef struct Resampler Resampler;

/* The layout is only read here; it may change or vanish afterwards, but resample_frame needs one
 * of the same shape. */
Resampler *resample_create(const StateLayout *layout, const ResampleDef *def);
void resample_destroy(Resampler *resampler);

/* The surface at node positions x [m] (node_count x 3). Valid until the next call. */
const Surface *resample_frame(Resampler *resampler, const StateLayout *layout, const double *x);
const Surface *resample_surface(const Resampler *resampler);

/* Spreads numbers at the surface vertices of a cloth (as many as the layout has) over its part of
 * surface.values, by the same smooth function as the positions. */
void resample_values(Resampler *resampler, const StateLayout *layout, int cloth,
                     const double *values);

/* False if the surface vertices of a cloth are not where its numbers would be needed. */
bool resample_takes_values(const StateLayout *layout, int cloth);

/* Unit normal and tangent from the derivatives along u and v, or these themselves. Collapsed surfaces
 * get any normal. */
void resample_set_frame(SurfaceVertex *vertex, const double du[3], const double dv[3],
                        bool derivatives);

#endif
