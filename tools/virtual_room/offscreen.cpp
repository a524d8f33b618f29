#include "tools/virtual_room/offscreen.hpp"

#include <epoxy/gl.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "tools/cli/user_error.hpp"
#include "tools/virtual_room/screen.hpp"

namespace room {

OffscreenRoom::OffscreenRoom(const RoomMeasures& measures, int width, int height, float scale, int samples)
    : width_(width), height_(height) {
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
  view_->gui.settings = room.settings;
  view_->draw(room, width_, height_, elapsed, frame_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  return read_pixels(width_, height_);
}

DrawFrame draw_into(const RunOptions& options, HapticLoop& loop) {
  std::error_code error;
  std::filesystem::create_directories(options.frames, error);
  if (error) throw cli::UserError("cannot make the folder " + options.frames + ": " + error.message());
  leave_cores_to_the_haptic_loop();
  const PictureOptions& picture = options.picture;
  const float scale = picture.scale > 0 ? static_cast<float>(picture.scale) : 1.0f;
  const auto room = std::make_shared<OffscreenRoom>(options.loop.measures, picture.width, picture.height, scale);
  room->view().panels = picture.panels;
  const auto elapsed = static_cast<float>(1 / options.frames_per_second);
  return [room, elapsed, folder = options.frames, &plot = loop.exchange().plot](const Snapshot& now, long frame) {
    for (PlotPoint point; plot.pop(point);) room->view().add(point);
    write_png(fmt::format("{}/frame_{:05d}.png", folder, frame), room->draw(now, elapsed));
  };
}

}  // namespace room
