/* shaders.h: the GLSL texts of render/shaders/, built into the program. */
#ifndef TOILE_RENDER_SHADERS_H
#define TOILE_RENDER_SHADERS_H

#include <stdint.h>

/* X(identifier, file name). The first ones are shared text, the rest are stages. */
#define SHADER_FILES(X)                                                                            \
    X(COMMON, "common.glsl")                                                                       \
    X(SHADOW, "shadow.glsl")                                                                       \
    X(WEAVE, "weave.glsl")                                                                         \
    X(FULLSCREEN, "fullscreen.vert.glsl")                                                          \
    X(DEPTH_VERTEX, "depth.vert.glsl")                                                             \
    X(DEPTH_FRAGMENT, "depth.frag.glsl")                                                           \
    X(LINEAR, "linear.frag.glsl")                                                                  \
    X(OCCLUSION, "occlusion.frag.glsl")                                                            \
    X(BLUR, "blur.frag.glsl")                                                                      \
    X(BACKDROP, "backdrop.frag.glsl")                                                              \
    X(SOFTEN, "soften.frag.glsl")                                                                  \
    X(GBUFFER_VERTEX, "gbuffer.vert.glsl")                                                         \
    X(GBUFFER_FRAGMENT, "gbuffer.frag.glsl")                                                       \
    X(CLOTH, "cloth.frag.glsl")                                                                    \
    X(MEASURED, "measured.frag.glsl")                                                              \
    X(PROP_VERTEX, "prop.vert.glsl")                                                               \
    X(PROP_WORDS, "prop_words.frag.glsl")                                                          \
    X(PROP, "prop.frag.glsl")                                                                      \
    X(SPLAT_VERTEX, "splat.vert.glsl")                                                             \
    X(SPLAT_FRAGMENT, "splat.frag.glsl")                                                           \
    X(SPLAT_WORDS, "splat_words.frag.glsl")                                                        \
    X(SPLAT_TILES, "splat_tiles.frag.glsl")                                                        \
    X(VEIL, "veil.frag.glsl")                                                                      \
    X(COMPOSITE, "composite.frag.glsl")

typedef enum ShaderName {
#define SHADER_ENUM(NAME, file) SHADER_##NAME,
    SHADER_FILES(SHADER_ENUM)
#undef SHADER_ENUM
        SHADER_COUNT
} ShaderName;

typedef struct ShaderText {
    const char *file;
    const char *text;
} ShaderText;

ShaderText shader_text(ShaderName name);

/* Of all texts: changes when any shader does. */
uint64_t shader_hash(void);

#endif
