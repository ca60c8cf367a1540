/* Programs, targets, and the passes of a frame one by one. */
#include "render/passes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define DEFINES_SIZE 256
#define OFFSET_SLOPE 1.5f /* polygon offset of the shadow map, per slope and per depth unit */
#define OFFSET_UNITS 2.0f
#define STENCIL_MASK 0xff
#define FILTER_BORDER 6 /* [px] free border for the blur and look-ups between texels */

/* The program that shades each cloth: cloths whose looks need the same one share it. */
static bool create_shading(Painter *painter, const char *taps, Error *error) {
    for (int i = 0; i < painter->def.cloth_count; i++) {
        char defines[DEFINES_SIZE + LOOK_DEFINES_SIZE + 32], wanted[LOOK_DEFINES_SIZE];
        const Look *look = painter->looks[i];
        const char *printed = painter->prints[i] ? "#define PRINTED\n" : "";
        look_cloth_defines(look, wanted);
        for (int j = 0; j < i && !painter->shading[i]; j++) {
            char other[LOOK_DEFINES_SIZE];
            look_cloth_defines(painter->looks[j], other);
            bool alike = strcmp(wanted, other) == 0 && !painter->prints[i] == !painter->prints[j];
            painter->shading[i] = alike ? painter->shading[j] : 0;
        }
        snprintf(defines, sizeof defines, "%s%s%s", taps, wanted, printed);
        bool measured = look->quantity != QUANTITY_NONE;
        if (!painter->shading[i]) {
            painter->shading[i] = gl_program_create(
                SHADER_FULLSCREEN, measured ? SHADER_MEASURED : SHADER_CLOTH, defines, error);
        }
        if (!painter->shading[i]) {
            return false;
        }
    }
    return true;
}

bool passes_create_programs(Painter *painter, Error *error) {
    const Quality *quality = painter->def.quality;
    char taps[DEFINES_SIZE], floor_taps[DEFINES_SIZE], common[DEFINES_SIZE];
    const char *linear = painter->def.linear ? "#define LINEAR\n" : "";
    char veiled[64];
    snprintf(veiled, sizeof veiled, "%s%s", painter->veiled ? "#define VEILED\n" : "", linear);
    snprintf(common, sizeof common, "%s%s%s", painter->def.clear ? "#define CLEAR\n" : "", linear,
             painter->plate ? "#define PLATE\n" : "");
    snprintf(taps, sizeof taps, "%s#define BLOCKER_TAPS %d\n#define FILTER_TAPS %d\n", veiled,
             quality->blocker_taps, quality->filter_taps);
    snprintf(floor_taps, sizeof floor_taps,
             "%s#define SHADED\n#define BLOCKER_TAPS %d\n#define FILTER_TAPS %d\n", veiled,
             quality->floor_blocker_taps, quality->floor_filter_taps);
    Programs *programs = &painter->programs;
    const struct {
        GLuint *program;
        ShaderName vertex, fragment;
        const char *defines;
    } list[] = {
        {&programs->depth, SHADER_DEPTH_VERTEX, SHADER_DEPTH_FRAGMENT, ""},
        {&programs->linear, SHADER_FULLSCREEN, SHADER_LINEAR, ""},
        {&programs->occlusion, SHADER_FULLSCREEN, SHADER_OCCLUSION, ""},
        {&programs->blur, SHADER_FULLSCREEN, SHADER_BLUR, ""},
        {&programs->still, SHADER_FULLSCREEN, SHADER_BACKDROP, linear},
        {&programs->backdrop, SHADER_FULLSCREEN, SHADER_BACKDROP, floor_taps},
        {&programs->soften, SHADER_FULLSCREEN, SHADER_SOFTEN, ""},
        {&programs->gbuffer, SHADER_GBUFFER_VERTEX, SHADER_GBUFFER_FRAGMENT,
         painter->def.splats ? "#define DERIVATIVES\n" : ""},
        {&programs->gbuffer_measured, SHADER_GBUFFER_VERTEX, SHADER_GBUFFER_FRAGMENT,
         painter->def.splats ? "#define MEASURED\n#define DERIVATIVES\n" : "#define MEASURED\n"},
        {&programs->prop_words, SHADER_PROP_VERTEX, SHADER_PROP_WORDS, ""},
        {&programs->prop, SHADER_FULLSCREEN, SHADER_PROP, taps},
        {&programs->composite, SHADER_FULLSCREEN, SHADER_COMPOSITE, common},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list; i++) {
        *list[i].program =
            gl_program_create(list[i].vertex, list[i].fragment, list[i].defines, error);
        if (!*list[i].program) {
            return false;
        }
    }
    if (!create_shading(painter, taps, error) ||
        (painter->veiled && !veil_create_programs(painter, error)) ||
        (painter->def.splats && !splats_create_programs(painter, error))) {
        return false;
    }
    programs->depth_model_clip = gl.GetUniformLocation(programs->depth, "model_clip");
    programs->blur_direction = gl.GetUniformLocation(programs->blur, "direction");
    programs->gbuffer_panel_scale = gl.GetUniformLocation(programs->gbuffer, "panel_scale");
    programs->words_model_world = gl.GetUniformLocation(programs->prop_words, "model_world");
    programs->prop_world_model = gl.GetUniformLocation(programs->prop, "world_model");
    return true;
}

static GLuint texture_of(Size size, GLenum format, GLenum filter) {
    return gl_texture_create(format, size.width, size.height, filter);
}

void passes_create_targets(Painter *painter) {
    const PaintDef *def = &painter->def;
    Targets *t = &painter->targets;
    int samples = def->quality->samples, side = def->quality->shadow_size;
    t->full = (Size){def->width, def->height};
    t->half = (Size){(def->width + 1) / 2, (def->height + 1) / 2};
    t->layer = (Size){def->width * samples, def->height * samples};
    t->shadow = texture_of((Size){side, side}, GL_DEPTH_COMPONENT24, GL_NEAREST);
    t->shadow_target = gl_target_create(0, t->shadow, false);
    t->depth = texture_of(t->half, GL_DEPTH_COMPONENT24, GL_NEAREST);
    t->depth_target = gl_target_create(0, t->depth, false);
    t->linear = texture_of(t->half, GL_R32F, GL_NEAREST);
    t->linear_target = gl_target_create(t->linear, 0, false);
    for (int i = 0; i < 2; i++) {
        t->occlusion[i] = texture_of(t->half, GL_RG32F, GL_NEAREST);
        t->occlusion_target[i] = gl_target_create(t->occlusion[i], 0, false);
    }
    t->still = texture_of(t->half, GL_RGBA32F, GL_NEAREST);
    t->still_target = gl_target_create(t->still, 0, false);
    t->grainy = texture_of(t->half, GL_RGBA32F, GL_NEAREST);
    t->grainy_target = gl_target_create(t->grainy, 0, false);
    t->backdrop = texture_of(t->half, GL_RGBA32F, GL_LINEAR);
    t->backdrop_target = gl_target_create(t->backdrop, 0, false);
    t->layer_depth = texture_of(t->layer, GL_DEPTH24_STENCIL8, GL_NEAREST);
    t->words = texture_of(t->layer, GL_RGBA32UI, GL_NEAREST);
    t->words_target = gl_target_create(t->words, t->layer_depth, true);
    t->layer_color = texture_of(t->layer, def->linear ? GL_RGBA16F : GL_SRGB8_ALPHA8, GL_LINEAR);
    t->layer_target = gl_target_create(t->layer_color, t->layer_depth, true);
    t->picture = texture_of(t->full, def->linear ? GL_RGBA32F : GL_RGBA8, GL_NEAREST);
    t->picture_target = gl_target_create(t->picture, 0, false);
}

void passes_destroy(Painter *painter) {
    Targets *t = &painter->targets;
    Programs *p = &painter->programs;
    GLuint textures[] = {t->shadow,       t->depth,   t->linear,  t->occlusion[0],
                         t->occlusion[1], t->still,   t->words,   t->layer_depth,
                         t->layer_color,  t->picture, t->backdrop};
    GLuint targets[] = {t->shadow_target,       t->depth_target,        t->linear_target,
                        t->occlusion_target[0], t->occlusion_target[1], t->still_target,
                        t->backdrop_target,     t->grainy_target,       t->words_target,
                        t->layer_target,        t->picture_target};
    GLuint programs[] = {
        p->depth,  p->linear,  p->occlusion,        p->blur, p->still,      p->backdrop,
        p->soften, p->gbuffer, p->gbuffer_measured, p->prop, p->prop_words, p->composite};
    gl.DeleteTextures(sizeof textures / sizeof *textures, textures);
    gl.DeleteFramebuffers(sizeof targets / sizeof *targets, targets);
    for (size_t i = 0; i < sizeof programs / sizeof *programs; i++) {
        gl.DeleteProgram(programs[i]);
    }
    for (int i = 0; i < painter->def.cloth_count; i++) {
        bool shared = false;
        for (int j = 0; j < i; j++) {
            shared = shared || painter->shading[j] == painter->shading[i];
        }
        gl.DeleteProgram(shared ? 0 : painter->shading[i]);
    }
}

void passes_scissor(const ScreenBox *box, Size size, int border) {
    int x0 = (int)floor(box->x0 * size.width) - border, x1 = (int)ceil(box->x1 * size.width);
    int y0 = (int)floor(box->y0 * size.height) - border, y1 = (int)ceil(box->y1 * size.height);
    x0 = x0 < 0 ? 0 : x0, y0 = y0 < 0 ? 0 : y0;
    int width = x1 + border - x0, height = y1 + border - y0;
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(x0, y0, width < 0 ? 0 : width, height < 0 ? 0 : height);
}

void passes_scissor_off(void) { gl.Disable(GL_SCISSOR_TEST); }

StageBox passes_prop_box(const Painter *painter, int prop, Pose pose) {
    StageBox box = stage_box_empty();
    const StageBox *local = &painter->prop_buffers[prop].box;
    for (int corner = 0; corner < 8 && !painter->props[prop].hidden; corner++) {
        Vec3 p = vec3(corner & 1 ? local->high.x : local->low.x,
                      corner & 2 ? local->high.y : local->low.y,
                      corner & 4 ? local->high.z : local->low.z);
        stage_box_add(&box, pose_apply(pose, p));
    }
    return box;
}

bool passes_is_sheer(const Painter *painter, int cloth) {
    return painter->looks[cloth]->cover > 0.0f;
}

/* Depth of everything that casts a whole shadow: coarse cloth and props. */
static void draw_depth(const Painter *painter, const FrameView *view, const Mat4 *world_clip) {
    float matrix[16];
    gl.UseProgram(painter->programs.depth);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    gl.DepthMask(GL_TRUE);
    const float far_away = 1.0f;
    gl.ClearBufferfv(GL_DEPTH, 0, &far_away);
    mat4_store(world_clip, matrix);
    gl.UniformMatrix4fv(painter->programs.depth_model_clip, 1, GL_FALSE, matrix);
    for (int i = 0; i < view->surface->part_count; i++) {
        const SurfacePart *part = &view->surface->parts[i];
        if (!passes_is_sheer(painter, i)) {
            buffers_draw_cloth(painter, part->coarse_begin, part->coarse_count, false);
        }
    }
    for (int i = 0; i < painter->def.prop_count; i++) {
        Mat4 model = mat4_multiply(*world_clip, mat4_from_pose(view->poses[i]));
        mat4_store(&model, matrix);
        gl.UniformMatrix4fv(painter->programs.depth_model_clip, 1, GL_FALSE, matrix);
        buffers_draw_prop(painter, i);
    }
    gl.Disable(GL_DEPTH_TEST);
}

void pass_shadow(Painter *painter, const FrameView *view) {
    int side = painter->def.quality->shadow_size;
    gl_target_bind(painter->targets.shadow_target, side, side);
    gl.Enable(GL_POLYGON_OFFSET_FILL);
    gl.PolygonOffset(OFFSET_SLOPE, OFFSET_UNITS);
    draw_depth(painter, view, &painter->stage.light);
    gl.Disable(GL_POLYGON_OFFSET_FILL);
    gl_texture_bind(UNIT_SHADOW, painter->targets.shadow);
}

void pass_depth(Painter *painter, const FrameView *view) {
    const Targets *t = &painter->targets;
    gl_target_bind(t->depth_target, t->half.width, t->half.height);
    draw_depth(painter, view, &painter->stage.clip);
    gl_target_bind(t->linear_target, t->half.width, t->half.height);
    gl_texture_bind(UNIT_INPUT, t->depth);
    gl.UseProgram(painter->programs.linear);
    gl_draw_fullscreen();
}

void pass_occlusion(Painter *painter, const FrameView *view) {
    const Targets *t = &painter->targets;
    const float nothing[4] = {1, 0, 0, 0};
    for (int i = 0; i < 2; i++) {
        gl_target_bind(t->occlusion_target[i], t->half.width, t->half.height);
        gl.ClearBufferfv(GL_COLOR, 0, nothing);
    }
    passes_scissor(&view->dynamic, t->half, FILTER_BORDER);
    gl_target_bind(t->occlusion_target[0], t->half.width, t->half.height);
    gl_texture_bind(UNIT_INPUT, t->linear);
    gl.UseProgram(painter->programs.occlusion);
    gl_draw_fullscreen();
    gl.UseProgram(painter->programs.blur);
    for (int i = 0; i < 2; i++) {
        gl_target_bind(t->occlusion_target[1 - i], t->half.width, t->half.height);
        gl_texture_bind(UNIT_INPUT, t->occlusion[i]);
        gl.Uniform2f(painter->programs.blur_direction, i == 0 ? 1.0f / (float)t->half.width : 0.0f,
                     i == 1 ? 1.0f / (float)t->half.height : 0.0f);
        gl_draw_fullscreen();
    }
    passes_scissor_off();
    gl_texture_bind(UNIT_OCCLUSION, t->occlusion[0]);
}

/* Fills a target with the still backdrop and leaves it current. */
static void copy_still(const Painter *painter, GLuint target) {
    const Targets *t = &painter->targets;
    gl_target_bind(target, t->half.width, t->half.height);
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, t->still_target);
    gl.BlitFramebuffer(0, 0, t->half.width, t->half.height, 0, 0, t->half.width, t->half.height,
                       GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void pass_backdrop(Painter *painter, const FrameView *view) {
    const Targets *t = &painter->targets;
    if (!painter->still_drawn) {
        gl_target_bind(t->still_target, t->half.width, t->half.height);
        gl.UseProgram(painter->programs.still);
        gl_draw_fullscreen();
        painter->still_drawn = true;
    }
    copy_still(painter, t->backdrop_target);
    if (painter->def.floor) {
        copy_still(painter, t->grainy_target);
        passes_scissor(&view->dynamic, t->half, 0);
        gl.UseProgram(painter->programs.backdrop);
        gl_draw_fullscreen();
        gl_target_bind(t->backdrop_target, t->half.width, t->half.height);
        gl_texture_bind(UNIT_INPUT, t->grainy);
        gl.UseProgram(painter->programs.soften);
        gl_draw_fullscreen();
        passes_scissor_off();
    }
}

int passes_stencil_of_cloth(int cloth) { return cloth + 1; }
static int stencil_of_prop(const Painter *painter, int prop) {
    return painter->def.cloth_count + prop + 1;
}

void passes_use_words(const Painter *painter, int cloth, const SurfacePart *part) {
    const Programs *programs = &painter->programs;
    bool measured = painter->looks[cloth]->quantity != QUANTITY_NONE;
    gl.UseProgram(measured ? programs->gbuffer_measured : programs->gbuffer);
    if (!measured) {
        gl.Uniform2f(programs->gbuffer_panel_scale, (float)(1.0 / part->size[0]),
                     (float)(1.0 / part->size[1]));
    }
}

static void draw_cloth_words(const Painter *painter, const FrameView *view) {
    for (int i = 0; i < view->surface->part_count; i++) {
        const SurfacePart *part = &view->surface->parts[i];
        if (passes_is_sheer(painter, i)) {
            continue;
        }
        passes_use_words(painter, i, part);
        gl.StencilFunc(GL_ALWAYS, passes_stencil_of_cloth(i), STENCIL_MASK);
        buffers_draw_cloth(painter, part->fine_begin, part->fine_count, true);
    }
}

void pass_gbuffer(Painter *painter, const FrameView *view) {
    const Targets *t = &painter->targets;
    const Programs *programs = &painter->programs;
    gl_target_bind(t->words_target, t->layer.width, t->layer.height);
    gl.Enable(GL_DEPTH_TEST);
    gl.Enable(GL_STENCIL_TEST);
    gl.StencilMask(STENCIL_MASK);
    gl.StencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    gl.ClearBufferfi(GL_DEPTH_STENCIL, 0, 1.0f, 0);
    if (painter->veiled) { /* sheer cloth reads the depth of what is behind it */
        const GLuint far_away[4] = {0, 0x3f800000u, 0, 0};
        gl.ClearBufferuiv(GL_COLOR, 0, far_away);
    }
    gl.UseProgram(programs->prop_words);
    for (int i = 0; i < painter->def.prop_count; i++) {
        float matrix[16];
        Mat4 model = mat4_from_pose(view->poses[i]);
        mat4_store(&model, matrix);
        gl.StencilFunc(GL_ALWAYS, stencil_of_prop(painter, i), STENCIL_MASK);
        gl.UniformMatrix4fv(programs->words_model_world, 1, GL_FALSE, matrix);
        buffers_draw_prop(painter, i);
    }
    if (painter->def.splats) {
        pass_splats(painter, view);
    } else {
        draw_cloth_words(painter, view);
    }
    gl.Disable(GL_STENCIL_TEST);
    gl.Disable(GL_DEPTH_TEST);
}

void passes_shade(const Painter *painter, int stencil, const StageBox *box) {
    ScreenBox screen = screen_box_empty();
    screen_box_add(&screen, &painter->stage, box, 0.0);
    passes_scissor(&screen, painter->targets.layer, 1);
    gl.StencilFunc(GL_EQUAL, stencil, STENCIL_THING);
    gl_draw_fullscreen();
}

static void begin_shading(const Painter *painter) {
    const Targets *t = &painter->targets;
    gl_target_bind(t->layer_target, t->layer.width, t->layer.height);
    gl.Enable(GL_STENCIL_TEST);
    gl.StencilMask(0);
    gl.StencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    gl_texture_bind(UNIT_INPUT, t->words);
}

static void end_shading(void) {
    gl.Disable(GL_STENCIL_TEST);
    passes_scissor_off();
}

void passes_use_cloth(const Painter *painter, int cloth) {
    gl.UseProgram(painter->shading[cloth]);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, BLOCK_CLOTH, painter->cloth.blocks[cloth]);
    if (painter->prints[cloth]) {
        gl_texture_bind(UNIT_PRINT, painter->prints[cloth]);
    }
}

void pass_cloth(Painter *painter, const FrameView *view) {
    const float nothing[4] = {0, 0, 0, 0};
    begin_shading(painter);
    gl.ClearBufferfv(GL_COLOR, 0, nothing);
    for (int i = 0; i < view->surface->part_count; i++) {
        if (!passes_is_sheer(painter, i)) {
            passes_use_cloth(painter, i);
            passes_shade(painter, passes_stencil_of_cloth(i), &view->cloth_box);
        }
    }
    end_shading();
}

void pass_props(Painter *painter, const FrameView *view) {
    begin_shading(painter);
    gl.UseProgram(painter->programs.prop);
    for (int i = 0; i < painter->def.prop_count; i++) {
        StageBox box = passes_prop_box(painter, i, view->poses[i]);
        float matrix[16];
        Mat4 inverse = mat4_from_pose(pose_inverse(view->poses[i]));
        mat4_store(&inverse, matrix);
        gl.UniformMatrix4fv(painter->programs.prop_world_model, 1, GL_FALSE, matrix);
        gl.BindBufferBase(GL_UNIFORM_BUFFER, BLOCK_PROP, painter->prop_buffers[i].block);
        if (!stage_box_is_empty(&box)) {
            passes_shade(painter, stencil_of_prop(painter, i), &box);
        }
    }
    end_shading();
}

void pass_composite(Painter *painter) {
    const Targets *t = &painter->targets;
    gl_target_bind(t->picture_target, t->full.width, t->full.height);
    gl_texture_bind(UNIT_INPUT, t->backdrop);
    gl_texture_bind(UNIT_LAYER, t->layer_color);
    if (painter->plate) {
        gl_texture_bind(UNIT_PLATE, painter->plate);
        gl_texture_bind(UNIT_STILL, t->still);
    }
    gl.UseProgram(painter->programs.composite);
    gl_draw_fullscreen();
}
