/* The assembler copies each file into the program, so that it runs from any directory. */
#include "render/shaders.h"

#include <string.h>

#include "sim/base/hash.h"

#define SHADER_EMBED(NAME, file)                                                                   \
    __asm__(".section .rodata\n"                                                                   \
            ".global shader_begin_" #NAME "\n"                                                     \
            "shader_begin_" #NAME ":\n"                                                            \
            ".incbin \"" TOILE_SOURCE_DIR "/render/shaders/" file "\"\n"                           \
            ".byte 0\n"                                                                            \
            ".previous\n");                                                                        \
    extern const char shader_begin_##NAME[];

SHADER_FILES(SHADER_EMBED)

ShaderText shader_text(ShaderName name) {
    switch (name) {
#define SHADER_CASE(NAME, file)                                                                    \
    case SHADER_##NAME:                                                                            \
        return (ShaderText){file, shader_begin_##NAME};
        SHADER_FILES(SHADER_CASE)
#undef SHADER_CASE
    case SHADER_COUNT:
        break;
    }
    return (ShaderText){"", ""};
}

uint64_t shader_hash(void) {
    uint64_t hashes[SHADER_COUNT];
    for (int i = 0; i < SHADER_COUNT; i++) {
        ShaderText text = shader_text((ShaderName)i);
        hashes[i] = hash_bytes(text.text, strlen(text.text));
    }
    return hash_bytes(hashes, sizeof hashes);
}
