/* Point splats into the words of the G-buffer [Zwicker et al. 2001: Surface splatting; Botsch et al.
 * 2005: High-quality surface splatting on today's GPUs]: the nearest depth of all discs, then the
 * weighted sum of those that lie in the surface seen, then its mean. Folds too sharp for discs are triangles. */
#include "render/passes.h"

#define TILE 32 /* [sample]: as the shaders have it */

enum { STORAGE_VERTICES, STORAGE_SURFELS, STORAGE_VALUES, STORAGE_BENDS, STORAGE_SLOPES };

bool splats_create_programs(Painter *painter, Error *error) {
    SplatPrograms *programs = &painter->splats.programs;
    const struct {
        GLuint *program;
        ShaderName vertex, fragment;
        const char *defines;
    } list[] = {
        {&programs->visible, SHADER_SPLAT_VERTEX, SHADER_SPLAT_FRAGMENT, "#define VISIBLE\n"},
        {&programs->sum, SHADER_SPLAT_VERTEX, SHADER_SPLAT_FRAGMENT, ""},
        {&programs->sum_measured, SHADER_SPLAT_VERTEX, SHADER_SPLAT_FRAGMENT, "#define MEASURED\n"},
        {&programs->visible_whole, SHADER_SPLAT_VERTEX, SHADER_SPLAT_FRAGMENT,
         "#define WHOLE\n#define VISIBLE\n"},
        {&programs->sum_whole, SHADER_SPLAT_VERTEX, SHADER_SPLAT_FRAGMENT, "#define WHOLE\n"},
        {&programs->sum_whole_measured, SHADER_SPLAT_VERTEX, SHADER_SPLAT_FRAGMENT,
         "#define WHOLE\n#define MEASURED\n"},
        {&programs->tiles, SHADER_FULLSCREEN, SHADER_SPLAT_TILES, ""},
        {&programs->words, SHADER_FULLSCREEN, SHADER_SPLAT_WORDS, ""},
        {&programs->words_measured, SHADER_FULLSCREEN, SHADER_SPLAT_WORDS, "#define MEASURED\n"},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list; i++) {
        *list[i].program =
            gl_program_create(list[i].vertex, list[i].fragment, list[i].defines, error);
        if (!*list[i].program) {
            return false;
        }
    }
    programs->sum_panel_scale = gl.GetUniformLocation(programs->sum, "panel_scale");
    programs->sum_whole_panel_scale = gl.GetUniformLocation(programs->sum_whole, "panel_scale");
    return true;
}

void splats_create_targets(Painter *painter) {
    Splats *splats = &painter->splats;
    Size layer = painter->targets.layer;
    const GLenum buffers[2] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    splats->frame = gl_texture_create(GL_RGBA32F, layer.width, layer.height, GL_NEAREST);
    splats->place = gl_texture_create(GL_RGBA32F, layer.width, layer.height, GL_NEAREST);
    splats->tiled = (Size){(layer.width + TILE - 1) / TILE, (layer.height + TILE - 1) / TILE};
    splats->tiles =
        gl_texture_create(GL_R32F, splats->tiled.width, splats->tiled.height, GL_NEAREST);
    splats->tiles_target = gl_target_create(splats->tiles, 0, false);
    splats->target = gl_target_create(splats->frame, painter->targets.layer_depth, true);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, splats->place, 0);
    gl.DrawBuffers(2, buffers);
    ASSERT(gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE);
}

void splats_destroy(Painter *painter) {
    Splats *splats = &painter->splats;
    const SplatPrograms *p = &splats->programs;
    GLuint textures[] = {splats->frame, splats->place, splats->tiles};
    GLuint targets[] = {splats->target, splats->tiles_target};
    GLuint programs[] = {p->visible,      p->sum,
                         p->sum_measured, p->visible_whole,
                         p->sum_whole,    p->sum_whole_measured,
                         p->words,        p->words_measured,
                         p->tiles};
    gl.DeleteTextures(3, textures);
    gl.DeleteFramebuffers(2, targets);
    for (size_t i = 0; i < sizeof programs / sizeof *programs; i++) {
        gl.DeleteProgram(programs[i]);
    }
}

static bool is_measured(const Painter *painter, int cloth) {
    return painter->looks[cloth]->quantity != QUANTITY_NONE;
}

/* Three corners a surfel, fetched by number: those of a cloth that are whole, or those that are cut. */
static void draw_surfels(const Painter *painter, const FrameView *view, int cloth, bool whole) {
    const SurfacePart *part = &view->surface->parts[cloth];
    const int *begin = painter->cloth.cut_begin + cloth;
    if (whole) {
        gl_draw_numbered(3 * part->vertex_begin, 3 * part->vertex_count);
    } else if (begin[1] > begin[0]) {
        gl_draw_listed(painter->cloth.cut, begin[0], begin[1] - begin[0]);
    }
}

static void bind_storage(const Painter *painter) {
    const SurfaceBuffers *cloth = &painter->cloth;
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_VERTICES, cloth->vertices);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_SURFELS, cloth->surfels);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_BENDS, cloth->bends);
    if (cloth->values) {
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_VALUES, cloth->values);
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, STORAGE_SLOPES, cloth->slopes);
    }
}

/* The face and the back of a cloth never mix, even where they meet at the rim of a fold. */
static void set_stencil(GLenum function, int cloth) {
    int value = passes_stencil_of_cloth(cloth);
    gl.StencilFuncSeparate(GL_FRONT, function, value, 0xff);
    gl.StencilFuncSeparate(GL_BACK, function, value | STENCIL_BACK, 0xff);
}

/* Triangles of sharp folds. */
static void draw_folds(const Painter *painter, const FrameView *view) {
    for (int i = 0; i < view->surface->part_count; i++) {
        const SurfacePart *part = &view->surface->parts[i];
        if (part->fold_count > 0 && !passes_is_sheer(painter, i)) {
            passes_use_words(painter, i, part);
            set_stencil(GL_ALWAYS, i);
            buffers_draw_folds(painter, part->fold_begin, part->fold_count);
        }
    }
}

/* Depth and stencil of what is nearest; the words' target has them. */
static void find_visible(const Painter *painter, const FrameView *view) {
    const SplatPrograms *programs = &painter->splats.programs;
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    for (int i = 0; i < 2 * view->surface->part_count; i++) {
        int cloth = i / 2;
        bool whole = i % 2 == 0;
        if (!passes_is_sheer(painter, cloth)) {
            gl.UseProgram(whole ? programs->visible_whole : programs->visible);
            set_stencil(GL_ALWAYS, cloth);
            draw_surfels(painter, view, cloth, whole);
        }
    }
    draw_folds(painter, view);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

/* The farthest of what is seen in each tile. */
static void find_tiles(const Painter *painter, const ScreenBox *screen) {
    const Splats *splats = &painter->splats;
    gl_target_bind(splats->tiles_target, splats->tiled.width, splats->tiled.height);
    gl.Disable(GL_DEPTH_TEST);
    gl.Disable(GL_STENCIL_TEST);
    passes_scissor(screen, splats->tiled, 2);
    gl_texture_bind(UNIT_INPUT, painter->targets.layer_depth);
    gl.UseProgram(splats->programs.tiles);
    gl_draw_fullscreen();
    gl_texture_bind(UNIT_INPUT, splats->tiles);
    gl.Enable(GL_DEPTH_TEST);
    gl.Enable(GL_STENCIL_TEST);
}

static void use_sum(const SplatPrograms *programs, const SurfacePart *part, bool measured,
                    bool whole) {
    GLuint sum = whole ? programs->sum_whole : programs->sum;
    GLuint sum_measured = whole ? programs->sum_whole_measured : programs->sum_measured;
    gl.UseProgram(measured ? sum_measured : sum);
    if (!measured) {
        gl.Uniform2f(whole ? programs->sum_whole_panel_scale : programs->sum_panel_scale,
                     (float)(1.0 / part->size[0]), (float)(1.0 / part->size[1]));
    }
}

static void add_up(const Painter *painter, const FrameView *view) {
    const Splats *splats = &painter->splats;
    Size layer = painter->targets.layer;
    const float nothing[4] = {0, 0, 0, 0};
    gl_target_bind(splats->target, layer.width, layer.height);
    gl.ClearBufferfv(GL_COLOR, 0, nothing);
    gl.ClearBufferfv(GL_COLOR, 1, nothing);
    gl.DepthMask(GL_FALSE);
    gl.DepthFunc(GL_LEQUAL);
    gl.StencilMask(0);
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_ONE, GL_ONE);
    for (int i = 0; i < 2 * view->surface->part_count; i++) {
        int cloth = i / 2;
        bool whole = i % 2 == 0;
        if (!passes_is_sheer(painter, cloth)) {
            use_sum(&splats->programs, &view->surface->parts[cloth], is_measured(painter, cloth),
                    whole);
            set_stencil(GL_EQUAL, cloth);
            draw_surfels(painter, view, cloth, whole);
        }
    }
    gl.Disable(GL_BLEND);
    gl.DepthFunc(GL_LESS);
    gl.DepthMask(GL_TRUE);
}

static void write_words(const Painter *painter, const FrameView *view) {
    const Targets *t = &painter->targets;
    const SplatPrograms *programs = &painter->splats.programs;
    gl.Disable(GL_DEPTH_TEST);
    gl_target_bind(t->words_target, t->layer.width, t->layer.height);
    gl_texture_bind(UNIT_INPUT, painter->splats.frame);
    gl_texture_bind(UNIT_LAYER, painter->splats.place);
    for (int i = 0; i < view->surface->part_count; i++) {
        if (!passes_is_sheer(painter, i)) {
            gl.UseProgram(is_measured(painter, i) ? programs->words_measured : programs->words);
            gl.StencilFunc(GL_EQUAL, passes_stencil_of_cloth(i), STENCIL_THING);
            gl_draw_fullscreen();
        }
    }
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_EQUAL); /* where the same triangles were nearest before */
    draw_folds(painter, view);
    gl.DepthFunc(GL_LESS);
}

void pass_splats(Painter *painter, const FrameView *view) {
    ScreenBox screen = screen_box_empty();
    screen_box_add(&screen, &painter->stage, &view->cloth_box, 0.0);
    bind_storage(painter);
    gl.StencilMask(0xff);
    gl.StencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    find_visible(painter, view);
    find_tiles(painter, &screen);
    passes_scissor(&screen, painter->targets.layer, 2);
    add_up(painter, view);
    write_words(painter, view);
    passes_scissor_off();
}
