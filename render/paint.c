#include "render/paint.h"

#include <stdlib.h>
#include <string.h>

#include "render/passes.h"
#include "sim/base/clock.h"
#include "sim/base/memory.h"

#define CASTERS_REACH 4.0 /* of the scale: casters farther from the target get no shadow */

const Quality qualities[] = {
    {"draft", "quick look, one sample a pixel: about 180 CPU-ms", 1, 51000, 4, 6, 4, 6, 1024},
    {"standard", "films: 2 x 2 samples a pixel: about 340 CPU-ms", 2, 100000, 5, 8, 5, 9, 2048},
    {"quality", "stills: denser surface, smoother shadows: about 410 CPU-ms", 2, 205000, 6, 10, 8,
     16, 2048},
};
const int quality_count = sizeof qualities / sizeof qualities[0];

const char *const paint_stage_names[PAINT_STAGE_COUNT] = {
    "upload",  "shadow_map", "half_depth", "occlusion", "backdrop",
    "gbuffer", "cloth",      "props",      "composite", "read_back"};

const Quality *quality_find(const char *name) {
    for (int i = 0; i < quality_count; i++) {
        if (strcmp(qualities[i].name, name) == 0) {
            return &qualities[i];
        }
    }
    return NULL;
}

/* Pictures from outside: rows go up in textures. */
static GLuint texture_of(const Image *image, bool repeats) {
    size_t row = IMAGE_CHANNELS * (size_t)image->width;
    uint8_t *rows = memory_new(row * (size_t)image->height);
    for (int y = 0; y < image->height; y++) {
        memcpy(rows + row * (size_t)(image->height - 1 - y), image->rgba + row * (size_t)y, row);
    }
    GLuint texture = gl_texture_from(rows, image->width, image->height, repeats);
    free(rows);
    return texture;
}

static void create_pictures(Painter *painter) {
    const PaintDef *def = &painter->def;
    for (int i = 0; def->prints && i < def->cloth_count; i++) {
        bool takes = def->prints[i].image && def->looks[i]->quantity == QUANTITY_NONE;
        painter->prints[i] = takes ? texture_of(def->prints[i].image, true) : 0;
    }
    painter->plate = def->plate ? texture_of(def->plate, false) : 0;
}

Painter *paint_create(const PaintDef *def, Error *error) {
    if (def->cloth_count + def->prop_count > PAINT_MOST_THINGS) {
        error_set(error, EXIT_BAD_INPUT, "%d cloths and obstacles; at most %d can be drawn",
                  def->cloth_count + def->prop_count, PAINT_MOST_THINGS);
        return NULL;
    }
    Painter *painter = memory_zeroed(1, sizeof *painter);
    painter->def = *def;
    painter->looks = arena_push(&painter->arena, const Look *, def->cloth_count);
    painter->props = arena_push(&painter->arena, PaintProp, def->prop_count);
    painter->thickness = arena_push(&painter->arena, double, def->cloth_count);
    painter->shading = arena_push(&painter->arena, GLuint, def->cloth_count);
    painter->prints = arena_push(&painter->arena, GLuint, def->cloth_count);
    create_pictures(painter);
    for (int i = 0; i < def->cloth_count; i++) {
        painter->looks[i] = def->looks[i];
        painter->veiled = painter->veiled || def->looks[i]->cover > 0.0f;
        painter->thickness[i] = def->thickness ? def->thickness[i] : 0.0;
    }
    for (int i = 0; def->ranges && i < QUANTITY_COUNT; i++) {
        painter->ranges[i] = def->ranges[i];
    }
    for (int i = 0; i < def->prop_count; i++) {
        painter->props[i] = def->props[i];
    }
    painter->stage =
        stage_create(&def->camera, def->floor, def->width, def->height, def->quality->samples);
    if (!passes_create_programs(painter, error)) {
        paint_destroy(painter);
        return NULL;
    }
    passes_create_targets(painter);
    if (painter->veiled) {
        veil_create_targets(painter);
    }
    if (def->splats) {
        splats_create_targets(painter);
    }
    buffers_create_props(painter);
    painter->stage_block = buffers_create_block(sizeof(StageBlock), &painter->stage.block);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, BLOCK_STAGE, painter->stage_block);
    return painter;
}

void paint_destroy(Painter *painter) {
    if (!painter) {
        return;
    }
    buffers_destroy_cloth(painter);
    buffers_destroy_props(painter);
    passes_destroy(painter);
    veil_destroy(painter);
    splats_destroy(painter);
    gl.DeleteBuffers(1, &painter->stage_block);
    gl.DeleteTextures(painter->def.cloth_count, painter->prints);
    gl.DeleteTextures(1, &painter->plate);
    arena_free(&painter->arena);
    free(painter);
}

void paint_set_surface(Painter *painter, const Surface *surface) {
    ASSERT(surface->part_count == painter->def.cloth_count);
    buffers_destroy_cloth(painter);
    buffers_create_cloth(painter, surface);
}

void paint_move_mesh(Painter *painter, int prop, const double *vertices) {
    buffers_move_prop(painter, prop, vertices);
}

void paint_set_camera(Painter *painter, const Camera *camera) {
    const PaintDef *def = &painter->def;
    Stage stage = stage_create(camera, def->floor, def->width, def->height, def->quality->samples);
    stage_keep_lights(&stage, &painter->stage);
    stage.block.size[3] = painter->stage.block.size[3];
    painter->stage = stage;
    painter->still_drawn = false;
}

void paint_measure(Painter *painter, double times[PAINT_STAGE_COUNT]) { painter->times = times; }

static double clamp(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}

/* A large obstacle must not spoil the shadow map: only what is near the target counts. */
static void clip_box(StageBox *box, Vec3 target, double reach) {
    Vec3 low = box->low, high = box->high, t = target;
    box->low = vec3(clamp(low.x, t.x - reach, t.x + reach), clamp(low.y, t.y - reach, t.y + reach),
                    clamp(low.z, t.z - reach, t.z + reach));
    box->high =
        vec3(clamp(high.x, t.x - reach, t.x + reach), clamp(high.y, t.y - reach, t.y + reach),
             clamp(high.z, t.z - reach, t.z + reach));
}

/* Where things are in this frame: in the world, on the screen, and their shadows. */
static FrameView look_at_frame(Painter *painter, const Surface *surface, const Pose *poses) {
    FrameView view = {.surface = surface, .poses = poses};
    view.cloth_box = (StageBox){vec3(surface->low[0], surface->low[1], surface->low[2]),
                                vec3(surface->high[0], surface->high[1], surface->high[2])};
    view.all_box = view.cloth_box;
    for (int i = 0; i < painter->def.prop_count; i++) {
        StageBox box = passes_prop_box(painter, i, poses[i]);
        stage_box_join(&view.all_box, &box);
    }
    Stage *stage = &painter->stage;
    clip_box(&view.all_box, stage->camera.target, CASTERS_REACH * stage->camera.scale);
    int texels = painter->def.quality->shadow_size;
    stage_aim_light(stage, view.all_box, texels);
    double reach = stage_occlusion_reach(stage), penumbra = stage_penumbra_reach(stage, texels);
    view.dynamic = screen_box_empty();
    for (int i = -1; i < painter->def.prop_count; i++) {
        StageBox box = i < 0 ? view.cloth_box : passes_prop_box(painter, i, poses[i]);
        screen_box_add(&view.dynamic, stage, &box, reach);
        screen_box_add_shadow(&view.dynamic, stage, &box, penumbra);
    }
    return view;
}

/* Adds the time since *start to a stage, when somebody measures. */
static void account(Painter *painter, PaintStage stage, double *start) {
    if (painter->times) {
        gl.Finish();
        double now = clock_process_seconds();
        painter->times[stage] += now - *start;
        *start = now;
    }
}

static void read_picture(Painter *painter, Image *image) {
    ASSERT(image->width == painter->def.width && image->height == painter->def.height);
    gl.BindFramebuffer(GL_FRAMEBUFFER, painter->targets.picture_target);
    gl.ReadPixels(0, 0, image->width, image->height, GL_RGBA, GL_UNSIGNED_BYTE, image->rgba);
}

void paint_frame(Painter *painter, const Surface *surface, const Pose *poses, Image *image) {
    double start = painter->times ? clock_process_seconds() : 0.0;
    FrameView view = look_at_frame(painter, surface, poses);
    buffers_upload_cloth(painter, surface);
    gl.BindBuffer(GL_UNIFORM_BUFFER, painter->stage_block);
    gl.BufferSubData(GL_UNIFORM_BUFFER, 0, sizeof(StageBlock), &painter->stage.block);
    account(painter, PAINT_UPLOAD, &start);
    pass_shadow(painter, &view);
    if (painter->veiled) {
        pass_veil_shadow(painter, &view);
    }
    account(painter, PAINT_SHADOW, &start);
    pass_depth(painter, &view);
    account(painter, PAINT_DEPTH, &start);
    pass_occlusion(painter, &view);
    account(painter, PAINT_OCCLUSION, &start);
    pass_backdrop(painter, &view);
    account(painter, PAINT_BACKDROP, &start);
    pass_gbuffer(painter, &view);
    account(painter, PAINT_GBUFFER, &start);
    pass_cloth(painter, &view);
    account(painter, PAINT_CLOTH, &start);
    pass_props(painter, &view);
    if (painter->veiled) {
        pass_veil(painter, &view);
    }
    account(painter, PAINT_PROPS, &start);
    pass_composite(painter);
    account(painter, PAINT_COMPOSITE, &start);
    if (!painter->def.linear) {
        read_picture(painter, image);
    }
    account(painter, PAINT_READ, &start);
}
