/* The EGL backend: a context without a surface on Mesa's software device, for systems whose Mesa has no
 * OSMesa any more (25.1 and later). EGL_MESA_device_software, EGL_MESA_platform_surfaceless. */
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "render/gl_backend.h"

#define MOST_DEVICES 32

typedef __typeof__(eglGetProcAddress) *GetProcAddress;
typedef __typeof__(eglInitialize) *Initialize;
typedef __typeof__(eglBindAPI) *BindApi;
typedef __typeof__(eglCreateContext) *CreateContext;
typedef __typeof__(eglMakeCurrent) *MakeCurrent;

static GetProcAddress get_proc_address;

/* ISO C has no conversion from object to function pointers; POSIX says they fit. */
static void load(void *library, const char *name, void *function) {
    *(void **)function = dlsym(library, name);
}

/* The display of the first device that draws with the processor; NULL: there is none. */
static EGLDisplay software_device(PFNEGLGETPLATFORMDISPLAYEXTPROC get_display) {
    PFNEGLQUERYDEVICESEXTPROC query_devices =
        (PFNEGLQUERYDEVICESEXTPROC)get_proc_address("eglQueryDevicesEXT");
    PFNEGLQUERYDEVICESTRINGEXTPROC query_string =
        (PFNEGLQUERYDEVICESTRINGEXTPROC)get_proc_address("eglQueryDeviceStringEXT");
    EGLDeviceEXT devices[MOST_DEVICES];
    EGLint count = 0;
    if (!query_devices || !query_string || !query_devices(MOST_DEVICES, devices, &count)) {
        return EGL_NO_DISPLAY;
    }
    for (int i = 0; i < count; i++) {
        const char *extensions = query_string(devices[i], EGL_EXTENSIONS);
        if (extensions && strstr(extensions, "EGL_MESA_device_software")) {
            return get_display(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
        }
    }
    return EGL_NO_DISPLAY;
}

static EGLDisplay find_display(void) {
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_display =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)get_proc_address("eglGetPlatformDisplayEXT");
    EGLDisplay display = get_display ? software_device(get_display) : EGL_NO_DISPLAY;
    if (get_display && display == EGL_NO_DISPLAY) { /* an older Mesa */
        setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
        display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    }
    return display;
}

static bool egl_open(int major, int minor, Error *error) {
    void *library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        return error_set(error, EXIT_MISSING_INPUT,
                         "no EGL library was found (Debian package "
                         "libegl1): %s",
                         dlerror());
    }
    Initialize initialize;
    BindApi bind_api;
    CreateContext create;
    MakeCurrent make_current;
    load(library, "eglGetProcAddress", &get_proc_address);
    load(library, "eglInitialize", &initialize);
    load(library, "eglBindAPI", &bind_api);
    load(library, "eglCreateContext", &create);
    load(library, "eglMakeCurrent", &make_current);
    if (!get_proc_address || !initialize || !bind_api || !create || !make_current) {
        return error_set(error, EXIT_MISSING_INPUT, "the EGL library is too old");
    }
    EGLDisplay display = find_display();
    EGLint has_major, has_minor;
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 major,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 minor,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_NONE};
    if (display == EGL_NO_DISPLAY || !initialize(display, &has_major, &has_minor) ||
        !bind_api(EGL_OPENGL_API)) {
        return error_set(error, EXIT_MISSING_INPUT, "EGL has no display without a screen");
    }
    EGLContext context = create(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context == EGL_NO_CONTEXT ||
        !make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        return error_set(error, EXIT_MISSING_INPUT, "EGL has no OpenGL %d.%d core context", major,
                         minor);
    }
    return true;
}

static GlFunction egl_address(const char *name) { return (GlFunction)get_proc_address(name); }

const GlBackend gl_egl = {"egl", egl_open, egl_address};
