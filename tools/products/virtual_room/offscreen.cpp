#include "tools/products/virtual_room/offscreen.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <imgui.h>
#include <stb_image_write.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>

#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/run.hpp"

namespace room {

namespace {

[[noreturn]] void complain(const std::string& what) {
  throw cli::UserError("no pictures without OpenGL 3.3: " + what +
                       "; --headless without --frames runs without pictures");
}

}  // namespace

void leave_cores_to_the_haptic_loop() { setenv("LP_NUM_THREADS", "1", 0); }

PixelImage read_pixels(int width, int height) {
  PixelImage image{width, height, {}};
  const std::size_t row = 3 * static_cast<std::size_t>(width);
  image.rgb.resize(row * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
  // Reverses the order of the rows, because OpenGL's begin at the bottom.
  for (std::size_t y = 0; y < static_cast<std::size_t>(height) / 2; ++y) {
    const auto upper = image.rgb.begin() + static_cast<std::ptrdiff_t>(y * row);
    const auto lower = image.rgb.end() - static_cast<std::ptrdiff_t>((y + 1) * row);
    std::swap_ranges(upper, upper + static_cast<std::ptrdiff_t>(row), lower);
  }
  return image;
}

void write_png(const std::string& file, const PixelImage& image) {
  if (!stbi_write_png(file.c_str(), image.width, image.height, 3, image.rgb.data(), 3 * image.width))
    throw cli::UserError("cannot write the picture " + file);
}

/// OpenGL context without a surface, made by the library EGL and current on the thread that made it.
struct OffscreenRoom::Context {
  Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context();

  EGLDisplay display_ = nullptr;
  EGLContext context_ = nullptr;
};

OffscreenRoom::Context::Context() {
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

OffscreenRoom::Context::~Context() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  // Leaves the EGL display open until the process ends. If the driver were unloaded, a leak checker could not
  // name what it leaks.
}

OffscreenRoom::OffscreenRoom(const RoomMeasures& measures, int width, int height, float scale, int samples)
    : context_(std::make_unique<Context>()), width_(width), height_(height) {
  if (epoxy_gl_version() < 33) throw cli::UserError("no pictures: OpenGL 3.3 is needed, and this is older");
  glGenFramebuffers(1, &frame_);
  glGenRenderbuffers(1, &colour_);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glBindRenderbuffer(GL_RENDERBUFFER, colour_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_);
  view_ = std::make_unique<RoomView>(measures, samples, scale);
  ImGui::GetIO().DisplaySize = ImVec2(static_cast<float>(width), static_cast<float>(height));
}

OffscreenRoom::~OffscreenRoom() {
  view_.reset();
  glDeleteRenderbuffers(1, &colour_);
  glDeleteFramebuffers(1, &frame_);
}

PixelImage OffscreenRoom::draw(const Snapshot& room, float elapsed) {
  ImGui::GetIO().DeltaTime = std::max(elapsed, 1e-4f);
  view_->follow(room.settings);
  view_->draw(room, width_, height_, elapsed, frame_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  return read_pixels(width_, height_);
}

namespace {

Camera camera_of(const PictureOptions& picture) {
  Camera camera;
  if (const std::vector<double>& eye = picture.eye; eye.size() == 6) {
    constexpr double degree = 3.14159265358979 / 180;
    camera.azimuth = static_cast<float>(eye[0] * degree);
    camera.elevation = static_cast<float>(eye[1] * degree);
    camera.distance = static_cast<float>(eye[2]);
    camera.target = Eigen::Vector3d(eye[3], eye[4], eye[5]).cast<float>();
  }
  return camera;
}

}  // namespace

DrawFrame draw_into(const RunOptions& options) {
  std::error_code error;
  std::filesystem::create_directories(options.frames, error);
  if (error) throw cli::UserError("cannot make the folder " + options.frames + ": " + error.message());
  leave_cores_to_the_haptic_loop();
  const PictureOptions& picture = options.picture;
  const float wanted = picture.scale > 0 ? static_cast<float>(picture.scale) : 1.0f;
  const float scale = fitting_scale(wanted, picture.width, picture.height);
  const auto room =
      std::make_shared<OffscreenRoom>(options.loop.measures, picture.width, picture.height, scale);
  room->view().panels = picture.panels;
  room->view().title = picture.title;
  room->view().camera = camera_of(picture);
  const auto elapsed = static_cast<float>(1 / options.frames_per_second);
  return {[room](const PlotPoint& point) { room->view().add(point); },
          [room, elapsed, folder = options.frames](const Snapshot& now, long frame) {
            write_png(fmt::format("{}/frame_{:05d}.png", folder, frame), room->draw(now, elapsed));
          }};
}

}  // namespace room
