// OpenGL without a window or a display, by EGL.
#pragma once

namespace room {

/// Makes a context current on this thread. Throws cli::UserError where EGL or OpenGL 3.3 is missing.
class SurfacelessContext {
 public:
  SurfacelessContext();
  SurfacelessContext(const SurfacelessContext&) = delete;
  SurfacelessContext& operator=(const SurfacelessContext&) = delete;
  ~SurfacelessContext();

 private:
  void* display_ = nullptr;
  void* context_ = nullptr;
};

/// Lets a software OpenGL (llvmpipe) compute on one thread: the others belong to the haptic loop. To be
/// called before the first context; what the person set stays.
void leave_cores_to_the_haptic_loop();

}  // namespace room
