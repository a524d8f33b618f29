#include "tools/products/virtual_room/offscreen.hpp"

#include <epoxy/gl.h>
#include <imgui.h>

#include <algorithm>
#include <memory>

#include "tools/libraries/files/user_error.hpp"

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
  view_->follow(room.settings);
  view_->draw(room, width_, height_, elapsed, frame_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  return read_pixels(width_, height_);
}

}  // namespace room
