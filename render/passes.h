/* passes.h: inside of the painter: what the passes share, and the passes in their order. */
#ifndef TOILE_RENDER_PASSES_H
#define TOILE_RENDER_PASSES_H

#include "render/gl.h"
#include "render/paint.h"
#include "render/solid_mesh.h"
#include "render/stage.h"

/* Texture units; the shaders' layout(binding) says the same. */
enum {
    UNIT_INPUT,
    UNIT_LAYER,
    UNIT_BEFORE,
    UNIT_SHADOW,
    UNIT_OCCLUSION,
    UNIT_VEIL,
    UNIT_PRINT,
    UNIT_PLATE,
    UNIT_STILL
};

/* Uniform blocks. */
enum { BLOCK_STAGE, BLOCK_CLOTH, BLOCK_PROP };

typedef struct Size {
    int width, height;
} Size;

/* Textures and the targets that draw into them. Sizes: full: the picture; half: half of it;
 * layer: full times samples. */
typedef struct Targets {
    Size full, half, layer;
    GLuint shadow, shadow_target;             /* depth from the key light */
    GLuint depth, depth_target;               /* half: depth from the eye */
    GLuint linear, linear_target;             /* half: R32F depth along the view [m] */
    GLuint occlusion[2], occlusion_target[2]; /* half: RG32F visible part, depth */
    GLuint still, still_target;               /* half: RGBA32F backdrop without a shadow */
    GLuint grainy, grainy_target;             /* half: RGBA32F, with grain in its shadow */
    GLuint backdrop, backdrop_target;         /* half: RGBA32F backdrop of this frame */
    GLuint words, words_target;               /* layer: RGBA32UI G-buffer */
    GLuint layer_depth;                       /* layer: depth, stencil (see stencil_of_prop) */
    GLuint layer_color, layer_target;         /* layer: SRGB8_ALPHA8 premultiplied */
    GLuint picture, picture_target;           /* full: RGBA8 */
} Targets;

/* What only films with sheer cloth have. Words: layers of it from the front, in turn. */
typedef struct VeilTargets {
    GLuint shadow, shadow_target;     /* depth from the key light of sheer cloth alone */
    GLuint words[2], words_target[2]; /* layer: RGBA32UI G-buffer */
    GLuint depth;                     /* layer: depth, stencil */
    GLuint color, color_target;       /* layer: RGBA16F premultiplied, linear */
} VeilTargets;

/* What only films of splats have. */
typedef struct SplatPrograms {
    GLuint visible, sum, sum_measured;                   /* of discs that the border cuts */
    GLuint visible_whole, sum_whole, sum_whole_measured; /* of all others */
    GLuint tiles, words, words_measured;
    GLint sum_panel_scale, sum_whole_panel_scale;
} SplatPrograms;

typedef struct Splats {
    SplatPrograms programs;
    GLuint frame, place, target; /* layer: RGBA32F sums, with the layer's depth and stencil */
    GLuint tiles, tiles_target;  /* tiled: R32F farthest depth of what is seen in each tile */
    Size tiled;
} Splats;

typedef struct Programs {
    GLuint depth, linear, occlusion, blur, still, backdrop, soften, gbuffer, gbuffer_measured,
        prop_words, prop, composite, gbuffer_veil, merge_veil;
    GLint veil_panel_scale;
    GLint depth_model_clip, blur_direction, gbuffer_panel_scale, words_model_world,
        prop_world_model;
} Programs;

/* The cloth's vertices and triangles in the driver. */
typedef struct SurfaceBuffers {
    GLuint array, vertices, uv, values, surfels, fine,
        coarse;     /* values: of measuring looks, or 0; surfels: of splats, or 0 */
    GLuint bends;   /* of surfels, or 0 */
    GLuint slopes;  /* of surfels with values, or 0 */
    GLuint cut;     /* three vertex numbers a surfel that the border cuts, or 0 */
    int *cut_begin; /* (cloth_count + 1) of each cloth's, in numbers */
    GLuint *blocks; /* (cloth_count) ClothBlock or MeasuredBlock */
    GLuint folds;   /* triangles of sharp folds, of surfels, or 0 */
    bool folded;    /* there are some */
    bool uploaded;
} SurfaceBuffers;

typedef struct PropBuffers {
    GLuint array, vertices, triangles, block;
    int triangle_count;
    StageBox box; /* [m] in the solid's frame */
} PropBuffers;

/* What one frame changes. */
typedef struct FrameView {
    const Surface *surface;
    const Pose *poses;
    StageBox cloth_box, all_box; /* [m] */
    ScreenBox dynamic;           /* where shadow or occlusion of this frame may be */
} FrameView;

struct Painter {
    PaintDef def;
    Arena arena;
    const Look **looks; /* (cloth_count) */
    double *thickness;  /* [m] (cloth_count); 0: unknown */
    GLuint *shading;    /* (cloth_count) programs; cloths of like looks share one */
    GLuint *prints;     /* (cloth_count) textures; 0: not printed */
    GLuint plate;       /* texture; 0: none */
    QuantityRange ranges[QUANTITY_COUNT];
    PaintProp *props; /* (prop_count) */
    Stage stage;
    GLuint stage_block;
    Targets targets;
    bool veiled; /* some cloth is sheer */
    VeilTargets veil;
    Splats splats;
    Programs programs;
    SurfaceBuffers cloth;
    PropBuffers *prop_buffers; /* (prop_count) */
    bool still_drawn;
    double *times; /* (PAINT_STAGE_COUNT) or NULL */
};

/* ---- passes.c ---- */
bool passes_create_programs(Painter *painter, Error *error);
void passes_create_targets(Painter *painter);
void passes_destroy(Painter *painter);

/* Limits drawing to a part of a target of this size, grown by `border` pixels; and stops it. */
void passes_scissor(const ScreenBox *box, Size size, int border);
void passes_scissor_off(void);

/* [m] box around a prop in the world; empty when it is hidden. */
StageBox passes_prop_box(const Painter *painter, int prop, Pose pose);

/* In this order; targets that each fills, from those before it. */
void pass_shadow(Painter *painter, const FrameView *view);    /* shadow: all that is not sheer */
void pass_depth(Painter *painter, const FrameView *view);     /* depth, linear: likewise, coarse */
void pass_occlusion(Painter *painter, const FrameView *view); /* occlusion, and softened */
void pass_backdrop(Painter *painter, const FrameView *view);  /* backdrop: still, with shadows */
void pass_gbuffer(Painter *painter, const FrameView *view);   /* words, layer_depth: what is seen */
void pass_cloth(Painter *painter, const FrameView *view);     /* layer: the cloths in it, shaded */
void pass_props(Painter *painter, const FrameView *view);     /* layer: the obstacles */
void pass_composite(Painter *painter);                        /* picture: layer over backdrop */
/* The program and the constants that shade a cloth. */
void passes_use_cloth(const Painter *painter, int cloth);
/* Stencil value of a cloth; 0 is nothing, the obstacles come after the cloths. Splats whose back is
 * seen add STENCIL_BACK, which only they look at. */
#define STENCIL_THING 0x7f
#define STENCIL_BACK 0x80
int passes_stencil_of_cloth(int cloth);
/* Shades the samples with this stencil value inside a box of the world. */
void passes_shade(const Painter *painter, int stencil, const StageBox *box);
/* The program that writes the words of a cloth's triangles. */
void passes_use_words(const Painter *painter, int cloth, const SurfacePart *part);
bool passes_is_sheer(const Painter *painter, int cloth);

/* ---- splats.c: surfels instead of the fine triangles; only called when the film asks ---- */
bool splats_create_programs(Painter *painter, Error *error);
void splats_create_targets(Painter *painter);
void splats_destroy(Painter *painter);
void pass_splats(Painter *painter, const FrameView *view);

/* ---- veil.c: sheer cloth over everything else; only called when there is some ---- */
bool veil_create_programs(Painter *painter, Error *error);
void veil_create_targets(Painter *painter);
void veil_destroy(Painter *painter);
/* The map of its shadow, which only dims the key light. */
void pass_veil_shadow(Painter *painter, const FrameView *view);
/* Its layers from the front to the back, then over the picture. */
void pass_veil(Painter *painter, const FrameView *view);

/* ---- buffers.c: geometry in the driver ---- */
void buffers_create_cloth(Painter *painter, const Surface *surface);
void buffers_upload_cloth(Painter *painter, const Surface *surface);
void buffers_destroy_cloth(Painter *painter);
void buffers_create_props(Painter *painter);
void buffers_move_prop(Painter *painter, int prop, const double *vertices);
void buffers_destroy_props(Painter *painter);
GLuint buffers_create_block(GLsizeiptr bytes, const void *data);
void buffers_draw_cloth(const Painter *painter, int first, int count, bool fine);
void buffers_draw_folds(const Painter *painter, int first, int count);
void buffers_draw_prop(const Painter *painter, int prop);

#endif
