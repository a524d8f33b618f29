// Draws pictures of the virtual room without a window, for files and tests.
#pragma once

#include <memory>

#include "tools/products/virtual_room/png_file.hpp"
#include "tools/products/virtual_room/room_view.hpp"
#include "tools/products/virtual_room/surfaceless.hpp"

namespace room {

/// Renderer of pictures of a fixed size. It has its own OpenGL context, which is current on this thread as
/// long as the renderer lives.
class OffscreenRoom {
 public:
  /// Makes the OpenGL context and the renderer. Throws cli::UserError if OpenGL 3.3 is missing.
  OffscreenRoom(const RoomMeasures& measures, int width, int height, float scale = 1, int samples = 4);
  OffscreenRoom(const OffscreenRoom&) = delete;
  OffscreenRoom& operator=(const OffscreenRoom&) = delete;
  ~OffscreenRoom();

  RoomView& view() { return *view_; }
  /// Draws a picture of the room; `elapsed` is the time since the last picture, s.
  PixelImage draw(const Snapshot& room, float elapsed);

 private:
  SurfacelessContext context_;
  std::unique_ptr<RoomView> view_;
  int width_, height_;
  unsigned frame_ = 0, colour_ = 0;
};

}  // namespace room
