/* gl.h: OpenGL without a window: the function table, and the few helpers every pass uses.
 *
 * gl_open finds a driver that needs no screen (gl_backend.h), makes a 4.3 core context current and
 * fills `gl`. Nothing is linked against a GL library, and there is no default framebuffer:
 * every pass draws into textures. Images are bit-identical for any thread count.
 * Thread-safety: one context in a process, used by one thread.
 */
#ifndef TOILE_RENDER_GL_H
#define TOILE_RENDER_GL_H

#include <GL/glcorearb.h>
#include <stdbool.h>

#include "render/gl_backend.h"
#include "render/shaders.h"
#include "sim/base/error.h"

/* Every GL function in use: X(name in PFNGL..PROC, name after gl). */
#define GL_FUNCTIONS(X)                                                                            \
    X(ACTIVETEXTURE, ActiveTexture)                                                                \
    X(ATTACHSHADER, AttachShader)                                                                  \
    X(BINDBUFFER, BindBuffer)                                                                      \
    X(BINDBUFFERBASE, BindBufferBase)                                                              \
    X(BINDFRAMEBUFFER, BindFramebuffer)                                                            \
    X(BINDTEXTURE, BindTexture)                                                                    \
    X(BINDVERTEXARRAY, BindVertexArray)                                                            \
    X(BLENDFUNC, BlendFunc)                                                                        \
    X(BLITFRAMEBUFFER, BlitFramebuffer)                                                            \
    X(BUFFERDATA, BufferData)                                                                      \
    X(BUFFERSUBDATA, BufferSubData)                                                                \
    X(CHECKFRAMEBUFFERSTATUS, CheckFramebufferStatus)                                              \
    X(CLEARBUFFERFV, ClearBufferfv)                                                                \
    X(CLEARBUFFERFI, ClearBufferfi)                                                                \
    X(CLEARBUFFERUIV, ClearBufferuiv)                                                              \
    X(COLORMASK, ColorMask)                                                                        \
    X(COMPILESHADER, CompileShader)                                                                \
    X(CREATEPROGRAM, CreateProgram)                                                                \
    X(CREATESHADER, CreateShader)                                                                  \
    X(DELETEBUFFERS, DeleteBuffers)                                                                \
    X(DELETEFRAMEBUFFERS, DeleteFramebuffers)                                                      \
    X(DELETEPROGRAM, DeleteProgram)                                                                \
    X(DELETESHADER, DeleteShader)                                                                  \
    X(DELETETEXTURES, DeleteTextures)                                                              \
    X(DELETEVERTEXARRAYS, DeleteVertexArrays)                                                      \
    X(DEPTHFUNC, DepthFunc)                                                                        \
    X(DEPTHMASK, DepthMask)                                                                        \
    X(DISABLE, Disable)                                                                            \
    X(DRAWARRAYS, DrawArrays)                                                                      \
    X(DRAWBUFFERS, DrawBuffers)                                                                    \
    X(DRAWELEMENTS, DrawElements)                                                                  \
    X(ENABLE, Enable)                                                                              \
    X(ENABLEVERTEXATTRIBARRAY, EnableVertexAttribArray)                                            \
    X(FINISH, Finish)                                                                              \
    X(FRAMEBUFFERTEXTURE2D, FramebufferTexture2D)                                                  \
    X(GENBUFFERS, GenBuffers)                                                                      \
    X(GENERATEMIPMAP, GenerateMipmap)                                                              \
    X(GENFRAMEBUFFERS, GenFramebuffers)                                                            \
    X(GENTEXTURES, GenTextures)                                                                    \
    X(GENVERTEXARRAYS, GenVertexArrays)                                                            \
    X(GETERROR, GetError)                                                                          \
    X(GETPROGRAMINFOLOG, GetProgramInfoLog)                                                        \
    X(GETPROGRAMIV, GetProgramiv)                                                                  \
    X(GETSHADERINFOLOG, GetShaderInfoLog)                                                          \
    X(GETSHADERIV, GetShaderiv)                                                                    \
    X(GETSTRING, GetString)                                                                        \
    X(GETUNIFORMLOCATION, GetUniformLocation)                                                      \
    X(LINKPROGRAM, LinkProgram)                                                                    \
    X(PIXELSTOREI, PixelStorei)                                                                    \
    X(POLYGONOFFSET, PolygonOffset)                                                                \
    X(READBUFFER, ReadBuffer)                                                                      \
    X(READPIXELS, ReadPixels)                                                                      \
    X(SCISSOR, Scissor)                                                                            \
    X(SHADERSOURCE, ShaderSource)                                                                  \
    X(STENCILFUNC, StencilFunc)                                                                    \
    X(STENCILFUNCSEPARATE, StencilFuncSeparate)                                                    \
    X(STENCILMASK, StencilMask)                                                                    \
    X(STENCILOP, StencilOp)                                                                        \
    X(TEXPARAMETERI, TexParameteri)                                                                \
    X(TEXSTORAGE2D, TexStorage2D)                                                                  \
    X(TEXSUBIMAGE2D, TexSubImage2D)                                                                \
    X(UNIFORM1I, Uniform1i)                                                                        \
    X(UNIFORM2F, Uniform2f)                                                                        \
    X(UNIFORM4F, Uniform4f)                                                                        \
    X(UNIFORMMATRIX4FV, UniformMatrix4fv)                                                          \
    X(USEPROGRAM, UseProgram)                                                                      \
    X(VERTEXATTRIBPOINTER, VertexAttribPointer)                                                    \
    X(VIEWPORT, Viewport)

typedef struct GlFunctions {
#define GL_MEMBER(TYPE, name) PFNGL##TYPE##PROC name;
    GL_FUNCTIONS(GL_MEMBER)
#undef GL_MEMBER
} GlFunctions;

extern GlFunctions gl; /* filled by gl_open, constant afterwards */

#define GL_MAJOR 4
#define GL_MINOR 3

/* Opens the context. threads: raster threads of the driver, 0 = draw in the calling thread.
 * Calling it again does nothing. Errors: EXIT_MISSING_INPUT when no driver is found. */
bool gl_open(int threads, Error *error);

/* "backend, version, renderer"; valid after gl_open. */
const char *gl_describe(void);

/* ---- objects; names of 0 are "none", deleting them does nothing ---- */

/* A texture without mipmaps; filter: GL_NEAREST or GL_LINEAR; edges are clamped. */
GLuint gl_texture_create(GLenum format, int width, int height, GLenum filter);

/* A picture of sRGB colours and alpha (rows go up), with smaller copies of itself if it repeats. */
GLuint gl_texture_from(const uint8_t *rgba, int width, int height, bool repeats);

/* A framebuffer with one colour texture (or 0) and one depth texture (or 0). An incomplete one
 * is our bug. */
GLuint gl_target_create(GLuint color, GLuint depth, bool depth_has_stencil);

/* A program of #version, `defines` (lines, "" = none), the shared text and the two stages.
 * A shader that does not compile is our bug; the driver's log is in the error. */
GLuint gl_program_create(ShaderName vertex, ShaderName fragment, const char *defines, Error *error);

void gl_texture_bind(int unit, GLuint texture);

/* Draws one triangle over the whole viewport with the current program (fullscreen.vert). */
void gl_draw_fullscreen(void);

/* Draws triangles without attributes: the vertex shader has gl_VertexID alone. */
void gl_draw_numbered(int first, int count);
/* The same for vertices whose numbers (uint32_t) stand in a list, from its place `first` on. */
void gl_draw_listed(GLuint list, int first, int count);

/* Makes target current with a viewport of its size. */
void gl_target_bind(GLuint target, int width, int height);

#endif
