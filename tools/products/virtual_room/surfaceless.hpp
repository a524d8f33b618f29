// Makes OpenGL contexts without window or display, by the library EGL.
#pragma once

namespace room {

/// OpenGL context without a surface, current on the thread that made it. Throws cli::UserError where EGL or
/// OpenGL 3.3 is missing.
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

/// Limits software OpenGL (llvmpipe) to one thread, so that the haptic loop has the other cores. Call it
/// before the first context is made. A setting in the user's environment has priority.
void leave_cores_to_the_haptic_loop();

}  // namespace room
