/* paint.h: draws frames: shadow map, occlusion, backdrop, G-buffer, shading, props, composite.
 *
 * A painter belongs to one film: camera, looks and size are fixed when it is made. Needs an open
 * GL context (render/gl.h). The same inputs give the same bits, whatever was drawn before.
 */
#ifndef TOILE_RENDER_PAINT_H
#define TOILE_RENDER_PAINT_H

#include "render/camera.h"
#include "render/image.h"
#include "render/image_exr.h"
#include "render/look.h"
#include "render/resample.h"
#include "sim/geom/solid.h"

/* How much work a frame may be. The costs are CPU-ms at 1280 x 720 on one core. */
typedef struct Quality {
    const char *name, *about;
    int samples;                               /* along a pixel side: 1 or 2 */
    int triangle_cap;                          /* of the resampled cloths */
    int blocker_taps, filter_taps;             /* of the soft shadow on things */
    int floor_blocker_taps, floor_filter_taps; /* on the half-size backdrop */
    int shadow_size;                           /* [texel] side of the shadow map */
} Quality;

extern const Quality qualities[];
extern const int quality_count;
#define QUALITY_DEFAULT "standard"

const Quality *quality_find(const char *name); /* NULL if unknown */

typedef struct PaintProp {
    Solid solid;
    const StateMesh *mesh; /* instead of the solid; NULL */
    const PropLook *look;
    bool hidden; /* the floor stands for it */
} PaintProp;

/* A picture printed on a cloth, once or again and again. */
typedef struct Print {
    const Image *image; /* the first row is at the top of v; NULL: none */
    double width;       /* [m] of a repeat, whose height follows; 0: the panel's width */
} Print;

typedef struct PaintDef {
    int width, height; /* [px] even */
    const Quality *quality;
    Camera camera;
    bool floor;
    /* pictures are light, for paint_read_exr; the image of paint_frame is left alone */
    bool linear;
    bool clear;  /* no backdrop; alpha is what is covered */
    bool splats; /* cloth as surfels, not triangles; sheer cloth is always triangles */
    /* picture of the film's size behind everything, with the floor's shadows; NULL */
    const Image *plate;
    int cloth_count;
    const Print *prints;         /* (cloth_count) pictures on the faces of cloths; NULL */
    const Look *const *looks;    /* (cloth_count) */
    const double *thickness;     /* [m] (cloth_count) of the fabrics; NULL: looks as they are */
    const QuantityRange *ranges; /* (QUANTITY_COUNT) of measuring looks; NULL without them */
    int prop_count;
    const PaintProp *props; /* (prop_count) */
} PaintDef;

/* The stages of a frame, for their cost. */
typedef enum PaintStage {
    PAINT_UPLOAD,
    PAINT_SHADOW,
    PAINT_DEPTH,
    PAINT_OCCLUSION,
    PAINT_BACKDROP,
    PAINT_GBUFFER,
    PAINT_CLOTH,
    PAINT_PROPS,
    PAINT_COMPOSITE,
    PAINT_READ,
    PAINT_STAGE_COUNT
} PaintStage;

extern const char *const paint_stage_names[PAINT_STAGE_COUNT];

typedef struct Painter Painter;

#define PAINT_MOST_THINGS 127 /* cloths and props: the stencil tells them apart */

/* Errors: EXIT_BAD_INPUT for too many things; EXIT_OUR_BUG when a shader does not compile. */
Painter *paint_create(const PaintDef *def, Error *error);
void paint_destroy(Painter *painter);

/* Tells the painter about a new surface (a new layout). */
void paint_set_surface(Painter *painter, const Surface *surface);

/* The vertices [m] (vertex_count x 3) of the mesh of a prop from now on, before its pose. */
void paint_move_mesh(Painter *painter, int prop, const double *vertices);

/* Looks from another place from now on; the lights stay where the first camera had them. */
void paint_set_camera(Painter *painter, const Camera *camera);

/* Draws a frame of that surface. poses: (prop_count). image must have the size of the film. */
void paint_frame(Painter *painter, const Surface *surface, const Pose *poses, Image *image);

/* The frame drawn last by a linear painter. */
void paint_read_exr(Painter *painter, ExrPicture *picture);

/* Waits for the driver after each stage and adds its CPU time [s] to times; NULL: stops. */
void paint_measure(Painter *painter, double times[PAINT_STAGE_COUNT]);

#endif
