#include "tools/products/virtual_room/surfaceless.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <cstdlib>
#include <string>

#include "tools/libraries/files/user_error.hpp"

namespace room {

namespace {

[[noreturn]] void complain(const std::string& what) {
  throw cli::UserError("no pictures without OpenGL 3.3: " + what +
                       "; --headless without --frames runs without pictures");
}

}  // namespace

SurfacelessContext::SurfacelessContext() {
  // Looks for libEGL itself first. If it is missing, libepoxy would end the program.
  void* const library = dlopen("libEGL.so.1", RTLD_LAZY);
  if (!library) complain("libEGL.so.1 is not installed");
  dlclose(library);
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (!extensions || !epoxy_extension_in_string(extensions, "EGL_MESA_platform_surfaceless"))
    complain("this EGL has no surfaceless platform");
  display_ = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (!display_ || !eglInitialize(display_, nullptr, nullptr)) complain("EGL does not start");
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                               3,
                               EGL_CONTEXT_MINOR_VERSION,
                               3,
                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                               EGL_NONE};
  if (eglBindAPI(EGL_OPENGL_API))
    context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
  if (!context_ || !eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
    if (context_) eglDestroyContext(display_, context_);
    eglTerminate(display_);
    complain("EGL gives no such context");
  }
}

SurfacelessContext::~SurfacelessContext() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  // Leaves the EGL display open until the process ends. If the driver were unloaded, a leak checker could not
  // name what it leaks.
}

void leave_cores_to_the_haptic_loop() { setenv("LP_NUM_THREADS", "1", 0); }

}  // namespace room
