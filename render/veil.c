/* Sheer cloth by depth peeling [Everitt 2001: Interactive order-independent transparency]: each layer
 * is drawn like any cloth, but only behind the one before; layers are blended under each other. */
#include "render/passes.h"

#define LAYERS 4 /* of sheer cloth, one behind the other; what lies behind them is not seen */
#define LIGHT_TAKEN 0.75f /* of the cover: threads let some light through */

bool veil_create_programs(Painter *painter, Error *error) {
    Programs *programs = &painter->programs;
    programs->gbuffer_veil = gl_program_create(
        SHADER_GBUFFER_VERTEX, SHADER_GBUFFER_FRAGMENT,
        painter->def.splats ? "#define PEEL\n#define DERIVATIVES\n" : "#define PEEL\n", error);
    programs->merge_veil =
        programs->gbuffer_veil ? gl_program_create(SHADER_FULLSCREEN, SHADER_VEIL, "", error) : 0;
    if (!programs->merge_veil) {
        return false;
    }
    programs->veil_panel_scale = gl.GetUniformLocation(programs->gbuffer_veil, "panel_scale");
    return true;
}

void veil_create_targets(Painter *painter) {
    VeilTargets *veil = &painter->veil;
    Size layer = painter->targets.layer;
    int side = painter->def.quality->shadow_size;
    veil->shadow = gl_texture_create(GL_DEPTH_COMPONENT24, side, side, GL_NEAREST);
    veil->shadow_target = gl_target_create(0, veil->shadow, false);
    veil->depth = gl_texture_create(GL_DEPTH24_STENCIL8, layer.width, layer.height, GL_NEAREST);
    for (int i = 0; i < 2; i++) {
        veil->words[i] = gl_texture_create(GL_RGBA32UI, layer.width, layer.height, GL_NEAREST);
        veil->words_target[i] = gl_target_create(veil->words[i], veil->depth, true);
    }
    veil->color = gl_texture_create(GL_RGBA16F, layer.width, layer.height, GL_NEAREST);
    veil->color_target = gl_target_create(veil->color, veil->depth, true);
    float most = 0.0f;
    for (int i = 0; i < painter->def.cloth_count; i++) {
        most = painter->looks[i]->cover > most ? painter->looks[i]->cover : most;
    }
    painter->stage.block.size[3] = LIGHT_TAKEN * most;
}

void veil_destroy(Painter *painter) {
    VeilTargets *veil = &painter->veil;
    GLuint textures[] = {veil->shadow, veil->words[0], veil->words[1], veil->depth, veil->color};
    GLuint targets[] = {veil->shadow_target, veil->words_target[0], veil->words_target[1],
                        veil->color_target};
    gl.DeleteTextures(sizeof textures / sizeof *textures, textures);
    gl.DeleteFramebuffers(sizeof targets / sizeof *targets, targets);
    gl.DeleteProgram(painter->programs.gbuffer_veil);
    gl.DeleteProgram(painter->programs.merge_veil);
}

void pass_veil_shadow(Painter *painter, const FrameView *view) {
    int side = painter->def.quality->shadow_size;
    const float far_away = 1.0f;
    float matrix[16];
    mat4_store(&painter->stage.light, matrix);
    gl_target_bind(painter->veil.shadow_target, side, side);
    gl.UseProgram(painter->programs.depth);
    gl.UniformMatrix4fv(painter->programs.depth_model_clip, 1, GL_FALSE, matrix);
    gl.Enable(GL_POLYGON_OFFSET_FILL);
    gl.Enable(GL_DEPTH_TEST);
    gl.ClearBufferfv(GL_DEPTH, 0, &far_away);
    for (int i = 0; i < view->surface->part_count; i++) {
        const SurfacePart *part = &view->surface->parts[i];
        if (passes_is_sheer(painter, i)) {
            buffers_draw_cloth(painter, part->coarse_begin, part->coarse_count, false);
        }
    }
    gl.Disable(GL_DEPTH_TEST);
    gl.Disable(GL_POLYGON_OFFSET_FILL);
    gl_texture_bind(UNIT_VEIL, painter->veil.shadow);
}

/* Words of the layer behind `before`, into target `into`. */
static void peel(Painter *painter, const FrameView *view, int into, int before) {
    const VeilTargets *veil = &painter->veil;
    const Programs *programs = &painter->programs;
    Size layer = painter->targets.layer;
    const GLuint nothing[4] = {0, 0x3f800000u, 0, 0}; /* as far as can be: no layer behind it */
    gl_target_bind(veil->words_target[into], layer.width, layer.height);
    gl.StencilMask(0xff);
    gl.ClearBufferuiv(GL_COLOR, 0, nothing);
    gl.ClearBufferfi(GL_DEPTH_STENCIL, 0, 1.0f, 0);
    gl.Enable(GL_DEPTH_TEST);
    gl.StencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    gl_texture_bind(UNIT_INPUT, painter->targets.words);
    gl_texture_bind(UNIT_BEFORE, veil->words[before]);
    gl.UseProgram(programs->gbuffer_veil);
    for (int i = 0; i < view->surface->part_count; i++) {
        const SurfacePart *part = &view->surface->parts[i];
        if (passes_is_sheer(painter, i)) {
            gl.StencilFunc(GL_ALWAYS, passes_stencil_of_cloth(i), 0xff);
            gl.Uniform2f(programs->veil_panel_scale, (float)(1.0 / part->size[0]),
                         (float)(1.0 / part->size[1]));
            buffers_draw_cloth(painter, part->fine_begin, part->fine_count, true);
        }
    }
    gl.Disable(GL_DEPTH_TEST);
}

/* Shades the layer in `words` and blends it under what is in front of it. */
static void shade(Painter *painter, const FrameView *view, int words) {
    Size layer = painter->targets.layer;
    gl_target_bind(painter->veil.color_target, layer.width, layer.height);
    gl.StencilMask(0);
    gl.StencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
    gl_texture_bind(UNIT_INPUT, painter->veil.words[words]);
    for (int i = 0; i < view->surface->part_count; i++) {
        if (passes_is_sheer(painter, i)) {
            passes_use_cloth(painter, i);
            passes_shade(painter, passes_stencil_of_cloth(i), &view->cloth_box);
        }
    }
    gl.Disable(GL_BLEND);
    passes_scissor_off();
}

/* In linear light: the layer of the picture holds display code. */
static void merge(const Painter *painter) {
    const Targets *t = &painter->targets;
    gl_target_bind(t->layer_target, t->layer.width, t->layer.height);
    gl.Enable(GL_FRAMEBUFFER_SRGB);
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    gl_texture_bind(UNIT_INPUT, painter->veil.color);
    gl.UseProgram(painter->programs.merge_veil);
    gl_draw_fullscreen();
    gl.Disable(GL_BLEND);
    gl.Disable(GL_FRAMEBUFFER_SRGB);
}

void pass_veil(Painter *painter, const FrameView *view) {
    Size layer = painter->targets.layer;
    const GLuint front[4] = {0, 0, 0, 0}; /* depth 0: nothing is in front */
    const float clear[4] = {0, 0, 0, 0};
    gl_target_bind(painter->veil.words_target[1], layer.width, layer.height);
    gl.ClearBufferuiv(GL_COLOR, 0, front);
    gl_target_bind(painter->veil.color_target, layer.width, layer.height);
    gl.ClearBufferfv(GL_COLOR, 0, clear);
    gl.Enable(GL_STENCIL_TEST);
    for (int i = 0; i < LAYERS; i++) {
        peel(painter, view, i % 2, 1 - i % 2);
        shade(painter, view, i % 2);
    }
    gl.Disable(GL_STENCIL_TEST);
    merge(painter);
}
