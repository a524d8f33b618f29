// Makes OpenGL contexts without a window or a display, by EGL.
#pragma once

namespace room {

/// OpenGL context, current on the thread that made it. Throws cli::UserError where EGL or OpenGL 3.3 is
/// missing.
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

/// Makes a software OpenGL (llvmpipe) compute on one thread and leave the other cores to the haptic loop.
/// Call it before the first context; the person's own setting has priority.
void leave_cores_to_the_haptic_loop();

}  // namespace room
