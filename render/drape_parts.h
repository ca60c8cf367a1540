/* drape_parts.h: what drape.c and drape_mesh.c share. */
#ifndef TOILE_RENDER_DRAPE_PARTS_H
#define TOILE_RENDER_DRAPE_PARTS_H

#include "render/drape.h"

/* One cloth in one frame. */
typedef struct DrapePart {
    int cloth;
    StateFrame frame;
    StateLayout layout;
    FieldMesh mesh;
    double *x, *v; /* [m], [m/s] (vertex_count x 3) of the cloth's surface */
} DrapePart;

bool drape_read_part(Run *run, const DrapeDef *def, int index, Arena *arena, DrapePart *part,
                     Error *error);

double drape_flat_area(const FieldMesh *mesh); /* [m2] on the panel */
double drape_kinetic(const DrapePart *part, double radius);

/* Signed area, slices: of the smooth surface. */
void drape_slice(const Surface *surface, const SurfacePart *part, Drape *drape);
/* Rim, strain, kinetic energy: of the mesh of the states. */
void drape_measure_mesh(const DrapePart *part, Arena *arena, Drape *drape);
/* Billows: of the same. */
void drape_cut(const DrapePart *part, const DrapeDef *def, Arena *arena, Drape *drape);

/* Harmonics of an outline, and its nodes at 3 %, 2 %, 4.5 % of `radius`. */
void drape_measure_outline(const double *r, double radius, Harmonics *harmonics, Nodes *nodes,
                           int *most, int *least);

#endif
