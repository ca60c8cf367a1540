#include "render/stage.h"

#include <math.h>
#include <string.h>

/* Unit-free directions of the lights: right of the camera, towards the camera, up. */
static const Vec3 KEY_DIRECTION = {-1.55, 1.00, 1.30};
static const Vec3 RIM_DIRECTION = {0.55, -0.85, 0.42};
static const Vec3 FILL_DIRECTION = {0.90, 0.75, 0.35};

/* Linear radiance of the lights. */
static const float KEY_COLOR[4] = {11.6f, 10.6f, 9.2f, 0};
static const float RIM_COLOR[4] = {3.8f, 4.4f, 5.6f, 0};
static const float FILL_COLOR[4] = {0.8f, 0.75f, 0.7f, 0};
#define AMBIENT 0.66f
static const float AMBIENT_LOW[4] = {.30f * AMBIENT, .27f * AMBIENT, .24f * AMBIENT, 0};
static const float AMBIENT_HIGH[4] = {.44f * AMBIENT, .49f * AMBIENT, .57f * AMBIENT, 0};

#define COVE_BEGIN 3.4        /* of the scale: behind the target, where the floor begins to rise */
#define COVE_RADIUS 2.4       /* of the scale */
#define LIGHT_STEPS 8.0       /* sizes of the shadow map in an octave: it does not breathe */
#define LIGHT_MARGIN 1.06     /* free border of the shadow map, wider than its filter */
#define LIGHT_DEPTH_EXTRA 1.2 /* depth range over the width of the map */
#define RECEIVER_TEXELS 3.5   /* shadow look-ups leave the surface by this much */
#define OCCLUSION_REACH 0.34  /* of the scale; FARTHEST in occlusion.frag.glsl */
#define PENUMBRA_TEXELS 34.0  /* at 2048; SEARCH in backdrop.frag.glsl */
#define PENUMBRA_MAP 2048.0
#define EMPTY 1e300

static void set3(float out[4], Vec3 v, double w) {
    out[0] = (float)v.x, out[1] = (float)v.y, out[2] = (float)v.z, out[3] = (float)w;
}

static void set4(float out[4], double x, double y, double z, double w) {
    set3(out, vec3(x, y, z), w);
}

static Vec3 direction_of(Vec3 light, Vec3 right, Vec3 wall) {
    Vec3 d = vec3_axpy(vec3_scale(light.x, right), -light.y, wall);
    d.z = light.z;
    return vec3_unit(d, vec3(0, 0, 1));
}

static void place_lights(Stage *stage, Vec3 wall) {
    StageBlock *block = &stage->block;
    Vec3 right = vec3_cross(wall, vec3(0, 0, 1));
    stage->key_light = direction_of(KEY_DIRECTION, right, wall);
    set3(block->key_light, stage->key_light, 0);
    set3(block->rim_light, direction_of(RIM_DIRECTION, right, wall), 0);
    set3(block->fill_light, direction_of(FILL_DIRECTION, right, wall), 0);
    memcpy(block->key_color, KEY_COLOR, sizeof KEY_COLOR);
    memcpy(block->rim_color, RIM_COLOR, sizeof RIM_COLOR);
    memcpy(block->fill_color, FILL_COLOR, sizeof FILL_COLOR);
    memcpy(block->ambient_low, AMBIENT_LOW, sizeof AMBIENT_LOW);
    memcpy(block->ambient_high, AMBIENT_HIGH, sizeof AMBIENT_HIGH);
}

Stage stage_create(const Camera *camera, bool floor, int width, int height, int samples) {
    Stage stage = {.camera = *camera, .floor = floor};
    StageBlock *block = &stage.block;
    double n = camera->near, f = camera->far;
    Mat4 unclip = camera_unclip(camera);
    stage.clip = camera_clip(camera);
    mat4_store(&stage.clip, block->world_clip);
    mat4_store(&unclip, block->clip_world);
    if (camera->perspective) {
        set3(block->eye, camera->eye, 1);
        set4(block->depth, n * f, 0, f, n - f);
    } else {
        set3(block->eye, vec3_scale(-1, camera->forward), 0);
        set4(block->depth, n, f - n, 1, 0);
    }
    set3(block->forward, camera->forward, vec3_dot(camera->eye, camera->forward));
    set4(block->ray, camera->half_x, camera->half_y, camera->perspective, 0);
    Vec3 level = camera->forward;
    if (hypot(level.x, level.y) < 0.05) { /* looking straight down: the wall is above the picture */
        level = camera->up;
    }
    Vec3 wall = vec3_unit(vec3(level.x, level.y, 0), vec3(0, 1, 0));
    place_lights(&stage, wall);
    set3(block->wall, wall, camera->floor_height);
    set4(block->cove, COVE_BEGIN * camera->scale, COVE_RADIUS * camera->scale, floor, 0);
    set3(block->centre, camera->target, camera->scale);
    set4(block->size, width, height, samples, 0);
    return stage;
}

void stage_keep_lights(Stage *stage, const Stage *other) {
    stage->key_light = other->key_light;
    memcpy(stage->block.key_light, other->block.key_light, sizeof stage->block.key_light);
    memcpy(stage->block.rim_light, other->block.rim_light, sizeof stage->block.rim_light);
    memcpy(stage->block.fill_light, other->block.fill_light, sizeof stage->block.fill_light);
}

void stage_aim_light(Stage *stage, StageBox casters, int texels) {
    Vec3 z = stage->key_light;
    Vec3 x = vec3_unit(vec3_cross(vec3(0, 0, 1), z), vec3(1, 0, 0));
    Vec3 y = vec3_cross(z, x);
    Vec3 axes[3] = {x, y, z};
    double low[3], high[3], half = 0.0;
    for (int k = 0; k < 3; k++) {
        low[k] = EMPTY, high[k] = -EMPTY;
        for (int corner = 0; corner < 8; corner++) {
            Vec3 p = {corner & 1 ? casters.high.x : casters.low.x,
                      corner & 2 ? casters.high.y : casters.low.y,
                      corner & 4 ? casters.high.z : casters.low.z};
            double at = vec3_dot(axes[k], p);
            low[k] = fmin(low[k], at), high[k] = fmax(high[k], at);
        }
        half = fmax(half, 0.5 * (high[k] - low[k]) * LIGHT_MARGIN);
    }
    half = exp2(ceil(LIGHT_STEPS * log2(fmax(half, 1e-6))) / LIGHT_STEPS);
    stage->texel = 2.0 * half / texels;
    double middle[3], range = LIGHT_DEPTH_EXTRA * half;
    for (int k = 0; k < 3; k++) { /* whole texels: edges of shadows do not crawl */
        middle[k] = round(0.5 * (low[k] + high[k]) / stage->texel) * stage->texel;
    }
    Mat4 view = mat4_view(x, y, z, vec3(0, 0, 0));
    Mat4 clip = {{1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -1 / range, 0, -middle[0] / half,
                  -middle[1] / half, middle[2] / range, 1}};
    Mat4 to_texture = {{0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0.5, 0.5, 0.5, 1}};
    stage->light = mat4_multiply(clip, view);
    Mat4 light = mat4_multiply(to_texture, stage->light);
    mat4_store(&light, stage->block.world_light);
    set4(stage->block.shadow, stage->texel, 2.0 * range, texels, RECEIVER_TEXELS * stage->texel);
}

StageBox stage_box_empty(void) {
    return (StageBox){{EMPTY, EMPTY, EMPTY}, {-EMPTY, -EMPTY, -EMPTY}};
}

bool stage_box_is_empty(const StageBox *box) { return box->low.x > box->high.x; }

void stage_box_add(StageBox *box, Vec3 p) {
    box->low = vec3(fmin(box->low.x, p.x), fmin(box->low.y, p.y), fmin(box->low.z, p.z));
    box->high = vec3(fmax(box->high.x, p.x), fmax(box->high.y, p.y), fmax(box->high.z, p.z));
}

void stage_box_join(StageBox *box, const StageBox *other) {
    if (!stage_box_is_empty(other)) {
        stage_box_add(box, other->low);
        stage_box_add(box, other->high);
    }
}

ScreenBox screen_box_empty(void) { return (ScreenBox){1, 1, 0, 0}; }

static void screen_box_add_point(ScreenBox *screen, const Stage *stage, Vec3 p) {
    double clip[4];
    mat4_apply(&stage->clip, p, clip);
    if (clip[3] < stage->camera.near && stage->camera.perspective) { /* behind the eye */
        *screen = (ScreenBox){0, 0, 1, 1};
        return;
    }
    double x = 0.5 + 0.5 * clip[0] / clip[3], y = 0.5 + 0.5 * clip[1] / clip[3];
    x = fmax(0, fmin(1, x)), y = fmax(0, fmin(1, y));
    screen->x0 = fmin(screen->x0, x), screen->x1 = fmax(screen->x1, x);
    screen->y0 = fmin(screen->y0, y), screen->y1 = fmax(screen->y1, y);
}

static Vec3 box_corner(const StageBox *box, int corner, double margin) {
    return vec3(corner & 1 ? box->high.x + margin : box->low.x - margin,
                corner & 2 ? box->high.y + margin : box->low.y - margin,
                corner & 4 ? box->high.z + margin : box->low.z - margin);
}

void screen_box_add(ScreenBox *screen, const Stage *stage, const StageBox *box, double margin) {
    for (int corner = 0; corner < 8 && !stage_box_is_empty(box); corner++) {
        screen_box_add_point(screen, stage, box_corner(box, corner, margin));
    }
}

void screen_box_add_shadow(ScreenBox *screen, const Stage *stage, const StageBox *box,
                           double margin) {
    for (int corner = 0; corner < 8 && !stage_box_is_empty(box); corner++) {
        /* the shadow on cove or wall lies between the corner and its shadow on the floor */
        Vec3 p = box_corner(box, corner, margin);
        double fall = fmax(p.z - stage->camera.floor_height, 0.0) / stage->key_light.z;
        screen_box_add_point(screen, stage, p);
        screen_box_add_point(screen, stage, vec3_axpy(p, -fall, stage->key_light));
    }
}

double stage_occlusion_reach(const Stage *stage) { return OCCLUSION_REACH * stage->camera.scale; }

double stage_penumbra_reach(const Stage *stage, int texels) {
    return PENUMBRA_TEXELS * texels / PENUMBRA_MAP * stage->texel;
}
