/* stage.h: the studio around the cloth: lights, floor, cove and wall, and where they are.
 *
 * All lengths are parts of the camera's scale (half the height of the view), so a sleeve of
 * 10 cm and a curtain of 3 m are lit alike. The lights turn with the camera's azimuth.
 */
#ifndef TOILE_RENDER_STAGE_H
#define TOILE_RENDER_STAGE_H

#include <stdbool.h>

#include "render/camera.h"
#include "render/mat4.h"

/* std140 twin of the block in common.glsl; meanings are there. */
typedef struct StageBlock {
    float world_clip[16], clip_world[16], world_light[16];
    float eye[4], forward[4], ray[4], depth[4];
    float key_light[4], key_color[4], rim_light[4], rim_color[4], fill_light[4], fill_color[4];
    float ambient_low[4], ambient_high[4];
    float wall[4], cove[4], centre[4], shadow[4], size[4];
} StageBlock;

typedef struct StageBox {
    Vec3 low, high; /* [m] */
} StageBox;

/* A rectangle of the picture, 0..1 from the lower left. */
typedef struct ScreenBox {
    double x0, y0, x1, y1;
} ScreenBox;

typedef struct Stage {
    StageBlock block;
    Camera camera;
    bool floor;
    Vec3 key_light; /* unit vector to the key light */
    Mat4 clip;      /* world -> clip */
    Mat4 light;     /* world -> clip of the shadow map */
    double texel;   /* [m] of the shadow map */
} Stage;

/* Everything that stays the same over a film. samples: along a pixel side. */
Stage stage_create(const Camera *camera, bool floor, int width, int height, int samples);

/* Leaves the lights where another stage has them: they stay in the room when the camera moves. */
void stage_keep_lights(Stage *stage, const Stage *other);

/* Fits the shadow map (texels x texels) around what casts shadows. */
void stage_aim_light(Stage *stage, StageBox casters, int texels);

StageBox stage_box_empty(void);
bool stage_box_is_empty(const StageBox *box);
void stage_box_add(StageBox *box, Vec3 p);
void stage_box_join(StageBox *box, const StageBox *other);

ScreenBox screen_box_empty(void);
/* Adds where a box, grown by `margin` [m], is on the screen. */
void screen_box_add(ScreenBox *screen, const Stage *stage, const StageBox *box, double margin);
/* Adds where its shadow falls on the studio. */
void screen_box_add_shadow(ScreenBox *screen, const Stage *stage, const StageBox *box,
                           double margin);

/* [m] how far occlusion reaches, and half the widest penumbra. */
double stage_occlusion_reach(const Stage *stage);
double stage_penumbra_reach(const Stage *stage, int texels);

#endif
