#include "render/gl.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LOG_SIZE 2048
#define PROGRAM_TEXTS 6

GlFunctions gl;

static const GlBackend *const backends[] = {&gl_osmesa, &gl_egl,
                                            NULL}; /* the first that opens is used */
static const GlBackend *backend;                   /* the one in use */
static GLuint empty_vertices;                      /* a vertex array without attributes */

static void load_functions(void) {
#define GL_LOAD(TYPE, name)                                                                        \
    gl.name = (PFNGL##TYPE##PROC)backend->address("gl" #name);                                     \
    ASSERT(gl.name);
    GL_FUNCTIONS(GL_LOAD)
#undef GL_LOAD
}

bool gl_open(int threads, Error *error) {
    if (backend) {
        return true;
    }
    char count[16];
    snprintf(count, sizeof count, "%d", threads);
    setenv("LP_NUM_THREADS", count, 1); /* llvmpipe reads it when it is loaded */
    Error last = {0};
    for (int i = 0; !backend && backends[i]; i++) {
        const char *wanted = getenv("TOILE_GL"); /* osmesa or egl; else whatever there is */
        if (wanted && *wanted && strcmp(wanted, backends[i]->name) != 0) {
            continue;
        }
        last = (Error){0};
        if (backends[i]->open(GL_MAJOR, GL_MINOR, &last)) {
            backend = backends[i];
        }
    }
    if (!backend && last.code == EXIT_OK) {
        return error_set(error, EXIT_USAGE, "TOILE_GL=%s: expected osmesa or egl",
                         getenv("TOILE_GL"));
    }
    if (!backend) {
        return error_set(error, last.code, "%s", last.text);
    }
    load_functions();
    gl.GenVertexArrays(1, &empty_vertices);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    return true;
}

const char *gl_describe(void) {
    static char text[512];
    snprintf(text, sizeof text, "%s, OpenGL %s, %s", backend->name,
             (const char *)gl.GetString(GL_VERSION), (const char *)gl.GetString(GL_RENDERER));
    return text;
}

GLuint gl_texture_create(GLenum format, int width, int height, GLenum filter) {
    GLuint texture = 0;
    gl.GenTextures(1, &texture);
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.TexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, (GLint)filter);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, (GLint)filter);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}

GLuint gl_texture_from(const uint8_t *rgba, int width, int height, bool repeats) {
    int levels = 1, longest = width > height ? width : height;
    while (repeats && longest >> levels > 0) {
        levels++;
    }
    GLuint texture = 0;
    gl.GenTextures(1, &texture);
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.TexStorage2D(GL_TEXTURE_2D, levels, GL_SRGB8_ALPHA8, width, height);
    gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    GLint wrap = repeats ? GL_REPEAT : GL_CLAMP_TO_EDGE;
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER,
                     repeats ? GL_LINEAR_MIPMAP_LINEAR : GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, repeats ? GL_LINEAR : GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, wrap);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, wrap);
    if (repeats) {
        gl.GenerateMipmap(GL_TEXTURE_2D);
    }
    return texture;
}

GLuint gl_target_create(GLuint color, GLuint depth, bool depth_has_stencil) {
    GLuint target = 0;
    gl.GenFramebuffers(1, &target);
    gl.BindFramebuffer(GL_FRAMEBUFFER, target);
    GLenum buffer = color ? GL_COLOR_ATTACHMENT0 : GL_NONE;
    if (color) {
        gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color, 0);
    }
    if (depth) {
        GLenum point = depth_has_stencil ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT;
        gl.FramebufferTexture2D(GL_FRAMEBUFFER, point, GL_TEXTURE_2D, depth, 0);
    }
    gl.DrawBuffers(1, &buffer);
    gl.ReadBuffer(buffer);
    ASSERT(gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE);
    return target;
}

static GLuint compile(GLenum kind, ShaderName name, const char *defines, Error *error) {
    ShaderText common = shader_text(SHADER_COMMON), text = shader_text(name);
    ShaderText shadow = shader_text(SHADER_SHADOW), weave = shader_text(SHADER_WEAVE);
    const char *texts[PROGRAM_TEXTS] = {"#version 430 core\n", defines,    common.text,
                                        shadow.text,           weave.text, text.text};
    GLuint shader = gl.CreateShader(kind);
    gl.ShaderSource(shader, PROGRAM_TEXTS, texts, NULL);
    gl.CompileShader(shader);
    GLint good = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (!good) {
        char log[LOG_SIZE] = "";
        gl.GetShaderInfoLog(shader, LOG_SIZE, NULL, log);
        gl.DeleteShader(shader);
        error_set(error, EXIT_OUR_BUG, "shader %s does not compile: %s", text.file, log);
        return 0;
    }
    return shader;
}

GLuint gl_program_create(ShaderName vertex, ShaderName fragment, const char *defines,
                         Error *error) {
    GLuint shaders[2] = {compile(GL_VERTEX_SHADER, vertex, defines, error),
                         compile(GL_FRAGMENT_SHADER, fragment, defines, error)};
    GLuint program = 0;
    if (shaders[0] && shaders[1]) {
        program = gl.CreateProgram();
        gl.AttachShader(program, shaders[0]);
        gl.AttachShader(program, shaders[1]);
        gl.LinkProgram(program);
        GLint good = 0;
        gl.GetProgramiv(program, GL_LINK_STATUS, &good);
        if (!good) {
            char log[LOG_SIZE] = "";
            gl.GetProgramInfoLog(program, LOG_SIZE, NULL, log);
            error_set(error, EXIT_OUR_BUG, "shaders %s, %s do not link: %s",
                      shader_text(vertex).file, shader_text(fragment).file, log);
            gl.DeleteProgram(program);
            program = 0;
        }
    }
    gl.DeleteShader(shaders[0]);
    gl.DeleteShader(shaders[1]);
    return program;
}

void gl_texture_bind(int unit, GLuint texture) {
    gl.ActiveTexture(GL_TEXTURE0 + (GLenum)unit);
    gl.BindTexture(GL_TEXTURE_2D, texture);
}

void gl_draw_fullscreen(void) {
    gl.BindVertexArray(empty_vertices);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

void gl_draw_numbered(int first, int count) {
    gl.BindVertexArray(empty_vertices);
    gl.DrawArrays(GL_TRIANGLES, first, count);
}

void gl_draw_listed(GLuint list, int first, int count) {
    gl.BindVertexArray(empty_vertices);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, list);
    gl.DrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT,
                    (const void *)(sizeof(uint32_t) * (size_t)first));
}

void gl_target_bind(GLuint target, int width, int height) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, target);
    gl.Viewport(0, 0, width, height);
}
