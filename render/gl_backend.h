/* gl_backend.h: the ways to get an OpenGL context without a window. */
#ifndef TOILE_RENDER_GL_BACKEND_H
#define TOILE_RENDER_GL_BACKEND_H

#include <stdbool.h>

#include "sim/base/error.h"

typedef void (*GlFunction)(void);

/* One way to get a context. A new one is a new file and a line in gl.c. */
typedef struct GlBackend {
    const char *name;
    /* Makes a context of at least major.minor core current in this thread. */
    bool (*open)(int major, int minor, Error *error);
    GlFunction (*address)(const char *name); /* of a GL function; valid after open */
} GlBackend;

extern const GlBackend gl_osmesa, gl_egl;

#endif
