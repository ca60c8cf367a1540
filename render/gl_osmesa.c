/* The OSMesa backend. Mesa 25.1 removed OSMesa: gl_egl.c replaces this file one day. */
#include <GL/osmesa.h>
#include <dlfcn.h>
#include <stddef.h>

#include "render/gl_backend.h"

/* The default framebuffer is never drawn to; it only has to exist. */
#define DUMMY_SIZE 16

static const char *const library_names[] = {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"};

static OSMESAproc (*get_proc_address)(const char *);
static unsigned char dummy[DUMMY_SIZE * DUMMY_SIZE * 4];

/* ISO C has no conversion from object to function pointers; POSIX says they fit. */
static void load(void *library, const char *name, void *function) {
    *(void **)function = dlsym(library, name);
}

static bool osmesa_open(int major, int minor, Error *error) {
    void *library = NULL;
    for (size_t i = 0; !library && i < sizeof library_names / sizeof *library_names; i++) {
        library = dlopen(library_names[i], RTLD_NOW | RTLD_LOCAL);
    }
    if (!library) {
        return error_set(error, EXIT_MISSING_INPUT,
                         "no OSMesa library was found (Debian package libosmesa6): %s", dlerror());
    }
    OSMesaContext (*create)(const int *, OSMesaContext);
    GLboolean (*make_current)(OSMesaContext, void *, GLenum, GLsizei, GLsizei);
    load(library, "OSMesaCreateContextAttribs", &create);
    load(library, "OSMesaMakeCurrent", &make_current);
    load(library, "OSMesaGetProcAddress", &get_proc_address);
    if (!create || !make_current || !get_proc_address) {
        return error_set(error, EXIT_MISSING_INPUT, "the OSMesa library is too old");
    }
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              0,
                              OSMESA_STENCIL_BITS,
                              0,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              major,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              minor,
                              0};
    OSMesaContext context = create(attributes, NULL);
    if (!context || !make_current(context, dummy, GL_UNSIGNED_BYTE, DUMMY_SIZE, DUMMY_SIZE)) {
        return error_set(error, EXIT_MISSING_INPUT, "OSMesa has no OpenGL %d.%d core context",
                         major, minor);
    }
    return true;
}

static GlFunction osmesa_address(const char *name) { return (GlFunction)get_proc_address(name); }

const GlBackend gl_osmesa = {"osmesa", osmesa_open, osmesa_address};
